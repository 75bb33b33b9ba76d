//! What does the text of a floor plan say? Headers line by line, then the drawing character by character.

use super::error::{PlanError, Problem};
use super::kinds::Kind;
use super::layout::{Layout, Mark, Marks, Opening, OpeningKind, Tile, extents_of, tiles_of};
use super::legend::{At, Entry, Facing, RoomStyle, Words, read_entry, read_style};
use super::place::{Piece, Symbol, Viewpoint, settle};
use super::{MAX_PIECES, MAX_ROOMS, MAX_SIDE_TILES, Plan, Room};
use std::collections::BTreeMap;

/// A doorway at least this wide is a passage, with a higher lintel, metres.
const PASSAGE_WIDTH_M: f32 = 1.9;
const PASSAGE_RISE_M: f32 = 0.7;
/// Wider passages are higher still, by as much as they are wider, up to this, metres.
const MOST_RISE_M: f32 = 2.2;
/// Wall left between an opening and the ceiling, metres.
const LEAST_LINTEL_M: f32 = 0.3;
const WINDOW_SILL_M: f32 = 0.9;

const FIXED: [(char, &str); 8] = [
    ('#', "wall"),
    ('.', "floor"),
    (' ', "floor or open ground"),
    ('+', "a doorway"),
    ('%', "a glass door"),
    ('=', "a window"),
    ('@', "a viewpoint that looks north"),
    ('0', "part of a room's number, as all digits do"),
];

/// A header line and what was read from it.
struct Headers {
    title: Option<String>,
    tile_m: f32,
    wall_height_m: f32,
    door_height_m: f32,
    rooms: BTreeMap<u32, (usize, String, RoomStyle)>,
    /// `None` in a bare drawing, where every letter is a marker.
    legend: Option<BTreeMap<char, (usize, Symbol)>>,
}

impl Headers {
    fn bare() -> Self {
        Self {
            title: None,
            tile_m: 1.0,
            wall_height_m: 3.0,
            door_height_m: 2.2,
            rooms: BTreeMap::new(),
            legend: None,
        }
    }

    fn symbol(&self, symbol: char) -> Option<Symbol> {
        match &self.legend {
            Some(legend) => match legend.get(&symbol) {
                Some((_, meaning)) => Some(*meaning),
                None => (symbol == '@').then_some(Symbol::Viewpoint(Facing::North)),
            },
            None if symbol.is_ascii_alphabetic() => Some(Symbol::Furniture(Entry::plain(Kind::Marker))),
            None => (symbol == '@').then_some(Symbol::Viewpoint(Facing::North)),
        }
    }

    fn known_symbols(&self) -> String {
        let letters: Vec<String> = match &self.legend {
            Some(legend) => legend.keys().map(char::to_string).collect(),
            None => vec!["a–z".to_owned(), "A–Z".to_owned()],
        };
        format!("# . + % = @ 0–9 {}", letters.join(" ")).trim_end().to_owned()
    }
}

/// Reads a floor plan: headers and a drawing, or a bare drawing.
///
/// # Errors
/// The first thing that is wrong, with its line, its column and the way out.
pub fn parse(text: &str) -> Result<Plan, PlanError> {
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let lines: Vec<&str> = text.lines().collect();
    let first = lines.iter().position(|line| says_something(line));
    let (headers, drawing_at) = if has_headers(text) {
        read_headers(&lines)?
    } else {
        (Headers::bare(), first.unwrap_or(0))
    };
    read_drawing(headers, &lines, drawing_at)
}

/// Whether a text begins with headers of a floor plan, whatever follows.
#[must_use]
pub fn has_headers(text: &str) -> bool {
    let first = text.lines().find(|line| says_something(line));
    first.is_some_and(|line| header_key(line).is_some())
}

fn says_something(line: &str) -> bool {
    !line.trim().is_empty() && !line.trim_start().starts_with("//")
}

const KEYS: [&str; 7] = ["title", "tile", "wall height", "door height", "rooms", "legend", "plan"];

/// The key of a header line and what follows its colon.
fn header_key(line: &str) -> Option<(&'static str, &str)> {
    let (key, value) = line.split_once(':')?;
    let key = KEYS.into_iter().find(|known| *known == key.trim())?;
    Some((key, value))
}

#[derive(PartialEq)]
enum Section {
    Top,
    Rooms,
    Legend,
}

fn read_headers(lines: &[&str]) -> Result<(Headers, usize), PlanError> {
    let mut headers = Headers {
        legend: Some(BTreeMap::new()),
        ..Headers::bare()
    };
    let mut section = Section::Top;
    let mut seen: BTreeMap<&str, usize> = BTreeMap::new();
    for (index, line) in lines.iter().enumerate() {
        let number = index + 1;
        let located = |(column, problem)| PlanError {
            line: number,
            column,
            problem,
        };
        if line.trim().is_empty() || line.trim_start().starts_with("//") {
            continue;
        }
        if let Some((key, value)) = header_key(line) {
            if let Some(first_line) = seen.insert(key, number) {
                return Err(located((
                    1,
                    Problem::Duplicate {
                        key: key.to_owned(),
                        first_line,
                    },
                )));
            }
            let column = line.chars().count() - value.chars().count() + 1;
            let mut words = Words::new(value, column);
            match key {
                "title" => {
                    headers.title = Some(value.trim().chars().filter(|c| !c.is_control()).take(200).collect());
                    continue;
                }
                "tile" => headers.tile_m = words.metres("a tile", 0.1, 10.0).map_err(located)?,
                "wall height" => headers.wall_height_m = words.metres("the wall height", 2.2, 30.0).map_err(located)?,
                "door height" => headers.door_height_m = words.metres("the door height", 1.8, 6.0).map_err(located)?,
                "rooms" => section = Section::Rooms,
                "legend" => section = Section::Legend,
                _ => {}
            }
            if words.peek().is_some() {
                return words.expected("the end of the line").map_err(located);
            }
            if key == "plan" {
                return Ok((headers, index + 1));
            }
            continue;
        }
        match section {
            Section::Top => {
                let expected = format!("a header: {}", KEYS.map(|k| format!("`{k}:`")).join(", "));
                let mut words = Words::new(line, 1);
                let found = words.next().unwrap_or_default().chars().take(24).collect();
                let column = 1 + line.chars().take_while(|c| c.is_whitespace()).count();
                return Err(located((column, Problem::Expected { found, expected })));
            }
            Section::Rooms => read_room(line, number, &mut headers.rooms).map_err(located)?,
            Section::Legend => {
                if let Some(legend) = &mut headers.legend {
                    read_symbol(line, number, legend).map_err(located)?;
                }
            }
        }
    }
    Err(PlanError {
        line: lines.len().max(1),
        column: 1,
        problem: Problem::NoDrawing,
    })
}

/// `12 = Armoury, walls #667, floor planks #852`.
fn read_room(line: &str, number: usize, rooms: &mut BTreeMap<u32, (usize, String, RoomStyle)>) -> At<()> {
    let indent = line.chars().take_while(|c| c.is_whitespace()).count();
    let expected = || Problem::Expected {
        found: line.trim().chars().take(24).collect(),
        expected: "a room, such as `12 = Armoury, walls #667`".to_owned(),
    };
    let (key, rest) = line.split_once('=').ok_or_else(|| (indent + 1, expected()))?;
    let digits = key.trim();
    if digits.is_empty() || digits.len() > 6 || !digits.bytes().all(|b| b.is_ascii_digit()) {
        return Err((indent + 1, expected()));
    }
    let room: u32 = digits.parse().map_err(|_| (indent + 1, expected()))?;
    let mut column = key.chars().count() + 2;
    let mut style = RoomStyle::default();
    let mut name = String::new();
    for (i, part) in rest.split(',').enumerate() {
        let mut words = Words::new(part, column);
        if i == 0 {
            name = part
                .trim()
                .chars()
                .filter(|c| !c.is_control() && *c != '/')
                .take(80)
                .collect();
            if name.is_empty() {
                return words.expected("the room's name");
            }
        } else {
            read_style(&mut words, &mut style)?;
        }
        column += part.chars().count() + 1;
    }
    match rooms.insert(room, (number, name, style)) {
        Some((first_line, ..)) => Err((
            indent + 1,
            Problem::Duplicate {
                key: room.to_string(),
                first_line,
            },
        )),
        None => Ok(()),
    }
}

/// `v = vase height 0.6 colour #2a5`.
fn read_symbol(line: &str, number: usize, legend: &mut BTreeMap<char, (usize, Symbol)>) -> At<()> {
    let indent = line.chars().take_while(|c| c.is_whitespace()).count();
    let mut words = Words::new(line, 1);
    let key = words.next().unwrap_or_default();
    let mut characters = key.chars();
    let (Some(symbol), None) = (characters.next(), characters.next()) else {
        let expected = "one character, a space and `=`, such as `b = bench`".to_owned();
        return Err((
            indent + 1,
            Problem::Expected {
                found: key.chars().take(24).collect(),
                expected,
            },
        ));
    };
    let fixed = if symbol.is_ascii_digit() { '0' } else { symbol };
    if let Some((_, meaning)) = FIXED.into_iter().find(|(c, _)| *c == fixed && *c != '@') {
        return Err((indent + 1, Problem::Reserved { symbol, meaning }));
    }
    if words.peek() != Some("=") {
        return words.expected("`=`");
    }
    words.next();
    let meaning = if words.peek() == Some("viewpoint") {
        words.next();
        let mut facing = Facing::North;
        if words.peek() == Some("facing") {
            words.next();
            facing = words.facing()?;
        }
        if words.peek().is_some() {
            return words.expected("the end of the line");
        }
        Symbol::Viewpoint(facing)
    } else {
        Symbol::Furniture(read_entry(&mut words)?)
    };
    match legend.insert(symbol, (number, meaning)) {
        Some((first_line, _)) => Err((
            indent + 1,
            Problem::Duplicate {
                key: symbol.to_string(),
                first_line,
            },
        )),
        None => Ok(()),
    }
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

fn read_drawing(headers: Headers, lines: &[&str], drawing_at: usize) -> Result<Plan, PlanError> {
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
    let columns = cells.iter().map(Vec::len).max().unwrap_or(0);
    if let Some(row) = cells.iter().position(|row| row.len() > MAX_SIDE_TILES) {
        let problem = Problem::TooLarge {
            tiles: cells[row].len(),
            side: "wide",
            limit: MAX_SIDE_TILES,
        };
        return fail(start + row, indents[row] + MAX_SIDE_TILES + 1, problem);
    }

    let mut marks = Marks {
        columns,
        rows: rows.len(),
        marks: vec![Mark::Blank; columns * rows.len()],
        first_line: start + 1,
        indents,
    };
    let mut symbols: Vec<(usize, usize, char, Symbol)> = Vec::new();
    for (row, characters) in cells.iter().enumerate() {
        for (column, &c) in characters.iter().enumerate() {
            marks.marks[row * columns + column] = match c {
                '#' => Mark::Wall,
                '.' | '0'..='9' => Mark::Floor,
                ' ' => Mark::Blank,
                '+' => Mark::Opening(OpeningKind::Doorway),
                '%' => Mark::Opening(OpeningKind::GlassDoor),
                '=' => Mark::Opening(OpeningKind::Window),
                '\t' => return Err(marks.error(column, row, Problem::Tab)),
                other => match headers.symbol(other) {
                    Some(symbol) => {
                        if symbols.len() == MAX_PIECES {
                            let problem = Problem::TooMany {
                                what: "pieces of furniture",
                                limit: MAX_PIECES,
                            };
                            return Err(marks.error(column, row, problem));
                        }
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
        }
    }
    let (tiles, openings, room_count) = tiles_of(&marks, MAX_ROOMS)?;
    if room_count == 0 {
        return Err(marks.error(0, 0, Problem::NoDrawing));
    }
    let rooms = name_rooms(&headers, &marks, &cells, (&tiles, room_count))?;
    let mut layout = Layout {
        columns,
        rows: rows.len(),
        tile_m: headers.tile_m,
        openings: Vec::new(),
        room_height_m: rooms
            .iter()
            .map(|room| room.style.height_m.unwrap_or(headers.wall_height_m))
            .collect(),
        room_extents: extents_of(&tiles, columns, room_count),
        tiles,
    };
    layout.openings = openings
        .into_iter()
        .map(|opening| with_heights(opening, &layout, headers.door_height_m))
        .collect();

    let mut pieces: Vec<Piece> = Vec::new();
    let mut viewpoints = Vec::new();
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
                    settle(&layout, (column, row), entry).map_err(|problem| marks.error(column, row, problem))?;
                let label = (entry.kind == Kind::Marker && headers.legend.is_none()).then_some(letter);
                pieces.push(Piece { room, label, ..piece });
            }
        }
    }
    Ok(Plan {
        title: headers.title,
        layout,
        rooms,
        pieces,
        viewpoints,
    })
}

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
