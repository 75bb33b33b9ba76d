//! What does the drawing of a floor plan show? Walls, rooms and openings, character by character, and what stands in them.

use std::collections::BTreeMap;

use super::error::{PlanError, Problem};
use super::headers::Headers;
use super::kinds::Kind;
use super::layout::{Layout, Mark, Marks, Opening, OpeningKind, Tile, extents_of, tiles_of};
use super::legend::RoomStyle;
use super::place::{Piece, Symbol, Viewpoint, settle};
use super::{MAX_PIECES, MAX_ROOMS, MAX_SIDE_TILES, Plan, Room};

/// A doorway at least this wide is a passage, with a higher lintel, metres.
const PASSAGE_WIDTH_M: f32 = 1.9;
const PASSAGE_RISE_M: f32 = 0.7;
/// Wider passages are higher still, by as much as they are wider, up to this, metres.
const MOST_RISE_M: f32 = 2.2;
/// Wall left between an opening and the ceiling, metres.
const LEAST_LINTEL_M: f32 = 0.3;
const WINDOW_SILL_M: f32 = 0.9;

/// A letter of the drawing, where it stands, and what it means.
type Lettered = (usize, usize, char, Symbol);

/// Reads the drawing that begins on this line or after it, counted from 0.
pub(super) fn read_drawing(headers: Headers, lines: &[&str], drawing_at: usize) -> Result<Plan, PlanError> {
    let (mut marks, cells) = rows_of(lines, drawing_at)?;
    let symbols = read_marks(&headers, &mut marks, &cells)?;
    let (tiles, openings, room_count) = tiles_of(&marks, MAX_ROOMS)?;
    if room_count == 0 {
        return Err(marks.error(0, 0, Problem::NoDrawing));
    }
    let rooms = name_rooms(&headers, &marks, &cells, (&tiles, room_count))?;
    let mut layout = Layout {
        columns: marks.columns,
        rows: marks.rows,
        tile_m: headers.tile_m,
        openings: Vec::new(),
        room_height_m: rooms
            .iter()
            .map(|room| room.style.height_m.unwrap_or(headers.wall_height_m))
            .collect(),
        room_extents: extents_of(&tiles, marks.columns, room_count),
        tiles,
    };
    layout.openings = openings
        .into_iter()
        .map(|opening| with_heights(opening, &layout, headers.door_height_m))
        .collect();
    let (pieces, viewpoints) = put_down(symbols, &layout, (&headers, &marks, &rooms))?;
    Ok(Plan {
        title: headers.title,
        layout,
        rooms,
        pieces,
        viewpoints,
    })
}

/// The characters of each row, without what is around the drawing; nothing is marked yet.
fn rows_of(lines: &[&str], drawing_at: usize) -> Result<(Marks, Vec<Vec<char>>), PlanError> {
    let fail = |line: usize, column: usize, problem| {
        Err(PlanError {
            line: line + 1,
            column,
            problem,
        })
    };
    let blank = |line: &&str| line.trim().is_empty();
    let start = drawing_at
        + lines[drawing_at.min(lines.len())..]
            .iter()
            .take_while(|l| blank(l))
            .count();
    let rows = &lines[start.min(lines.len())..];
    let rows = &rows[..rows.len() - rows.iter().rev().take_while(|l| blank(l)).count()];
    if rows.is_empty() {
        return fail(start.min(lines.len().saturating_sub(1)), 1, Problem::NoDrawing);
    }
    if rows.len() > MAX_SIDE_TILES {
        let problem = Problem::TooLarge {
            tiles: rows.len(),
            side: "deep",
            limit: MAX_SIDE_TILES,
        };
        return fail(start + MAX_SIDE_TILES, 1, problem);
    }
    let later_indent = indent_of(rows, 1);
    let indents: Vec<usize> = (0..rows.len())
        .map(|r| if r == 0 { indent_of(rows, 0) } else { later_indent })
        .collect();
    let cells: Vec<Vec<char>> = rows
        .iter()
        .zip(&indents)
        .map(|(row, &indent)| row.trim_end_matches(' ').chars().skip(indent).collect())
        .collect();
    if let Some(row) = cells.iter().position(|row| row.len() > MAX_SIDE_TILES) {
        let problem = Problem::TooLarge {
            tiles: cells[row].len(),
            side: "wide",
            limit: MAX_SIDE_TILES,
        };
        return fail(start + row, indents[row] + MAX_SIDE_TILES + 1, problem);
    }
    let columns = cells.iter().map(Vec::len).max().unwrap_or(0);
    let marks = Marks {
        columns,
        rows: rows.len(),
        marks: vec![Mark::Blank; columns * rows.len()],
        first_line: start + 1,
        indents,
    };
    Ok((marks, cells))
}

/// Marks each tile; answers the letters among them.
fn read_marks(headers: &Headers, marks: &mut Marks, cells: &[Vec<char>]) -> Result<Vec<Lettered>, PlanError> {
    let mut symbols = Vec::new();
    for (row, characters) in cells.iter().enumerate() {
        for (column, &c) in characters.iter().enumerate() {
            let mark = match c {
                '#' => Mark::Wall,
                '.' | '0'..='9' => Mark::Floor,
                ' ' => Mark::Blank,
                '+' => Mark::Opening(OpeningKind::Doorway),
                '%' => Mark::Opening(OpeningKind::GlassDoor),
                '=' => Mark::Opening(OpeningKind::Window),
                '\t' => return Err(marks.error(column, row, Problem::Tab)),
                other => match headers.symbol(other) {
                    Some(_) if symbols.len() == MAX_PIECES => {
                        let problem = Problem::TooMany {
                            what: "pieces of furniture",
                            limit: MAX_PIECES,
                        };
                        return Err(marks.error(column, row, problem));
                    }
                    Some(symbol) => {
                        symbols.push((column, row, other, symbol));
                        Mark::Floor
                    }
                    None => {
                        let problem = Problem::UnknownSymbol {
                            symbol: other,
                            known: headers.known_symbols(),
                        };
                        return Err(marks.error(column, row, problem));
                    }
                },
            };
            marks.marks[row * marks.columns + column] = mark;
        }
    }
    Ok(symbols)
}

/// What letters stand for, in the rooms where they stand.
fn put_down(
    symbols: Vec<Lettered>,
    layout: &Layout,
    (headers, marks, rooms): (&Headers, &Marks, &[Room]),
) -> Result<(Vec<Piece>, Vec<Viewpoint>), PlanError> {
    let (mut pieces, mut viewpoints) = (Vec::new(), Vec::new());
    for (column, row, letter, symbol) in symbols {
        let Tile::Room(room) = layout.tile(column as isize, row as isize) else {
            continue;
        };
        match symbol {
            Symbol::Viewpoint(facing) => {
                let name = rooms[room].name.clone();
                viewpoints.push(Viewpoint {
                    name,
                    position: layout.tile_middle(column, row),
                    facing,
                });
            }
            Symbol::Furniture(entry) => {
                let piece =
                    settle(layout, (column, row), entry).map_err(|problem| marks.error(column, row, problem))?;
                let label = (entry.kind == Kind::Marker && headers.legend.is_none()).then_some(letter);
                pieces.push(Piece { room, label, ..piece });
            }
        }
    }
    Ok((pieces, viewpoints))
}

/// How far the lines after the first are indented beyond it, when they all are by four spaces or more: so a drawing may
/// follow the indentation of the code around it.
fn indent_of(rows: &[&str], row: usize) -> usize {
    let indent = |line: &str| line.bytes().take_while(|b| *b == b' ').count();
    let least = |rows: &[&str]| {
        rows.iter()
            .filter(|l| !l.trim().is_empty())
            .map(|l| indent(l))
            .min()
            .unwrap_or(0)
    };
    let rest = least(rows.get(1..).unwrap_or(&[]));
    match row {
        0 => rows
            .first()
            .map_or(0, |first| indent(first).min(if rest == 0 { 0 } else { least(rows) })),
        _ if rest >= 4 => rest,
        _ => least(rows),
    }
}

/// How high it begins and ends.
fn with_heights(mut opening: Opening, layout: &Layout, door_height_m: f32) -> Opening {
    let ceiling = layout.lowest_ceiling_beside(&opening);
    let width_m = opening.length as f32 * layout.tile_m;
    let rise = if width_m >= PASSAGE_WIDTH_M {
        (PASSAGE_RISE_M + width_m - PASSAGE_WIDTH_M).min(MOST_RISE_M)
    } else {
        0.0
    };
    (opening.bottom_m, opening.top_m) = match opening.kind {
        OpeningKind::Window => (WINDOW_SILL_M, (ceiling * 0.7).min(ceiling - LEAST_LINTEL_M)),
        OpeningKind::Doorway | OpeningKind::GlassDoor => (0.0, (door_height_m + rise).min(ceiling - LEAST_LINTEL_M)),
    };
    opening
}

/// Rooms by the numbers that stand in them; those without go by letters.
fn name_rooms(
    headers: &Headers,
    marks: &Marks,
    cells: &[Vec<char>],
    (tiles, room_count): (&[Tile], usize),
) -> Result<Vec<Room>, PlanError> {
    let mut number_of: Vec<Option<(u32, usize)>> = vec![None; room_count];
    let mut line_of: BTreeMap<u32, usize> = BTreeMap::new();
    for (row, characters) in cells.iter().enumerate() {
        let line = marks.first_line + row;
        let mut column = 0;
        while column < characters.len() {
            let digits: String = characters[column..]
                .iter()
                .take_while(|c| c.is_ascii_digit())
                .take(6)
                .collect();
            if let (Ok(number), Tile::Room(room)) = (digits.parse::<u32>(), tiles[row * marks.columns + column]) {
                if let Some((first, first_line)) = number_of[room] {
                    return Err(marks.error(column, row, Problem::TwoNumbers { first, first_line }));
                }
                if let Some(first_line) = line_of.insert(number, line) {
                    return Err(marks.error(column, row, Problem::NumberTaken { number, first_line }));
                }
                number_of[room] = Some((number, line));
            }
            column += digits.len().max(1);
        }
    }
    if let Some((&number, &(line, ..))) = headers.rooms.iter().find(|(number, _)| !line_of.contains_key(number)) {
        return Err(PlanError {
            line,
            column: 1,
            problem: Problem::RoomNotDrawn { number },
        });
    }
    let mut used: BTreeMap<String, usize> = BTreeMap::new();
    let rooms = number_of.iter().enumerate().map(|(room, number)| {
        let told = number.and_then(|(number, _)| headers.rooms.get(&number));
        let (name, style) = match (told, number) {
            (Some((_, name, style)), _) => (name.clone(), *style),
            (None, Some((number, _))) => (format!("Room {number}"), RoomStyle::default()),
            (None, None) => (
                format!("Room {}", (b'A' + (room % 26) as u8) as char),
                RoomStyle::default(),
            ),
        };
        let count = used.entry(name.clone()).or_insert(0);
        *count += 1;
        Room {
            name: if *count > 1 { format!("{name} ({count})") } else { name },
            style,
        }
    });
    Ok(rooms.collect())
}
