//! Which tiles are room, wall, opening or open ground? Flood fills over the drawing, four-connected.

use super::error::{PlanError, Problem};
use super::legend::Facing;

/// One tile of the drawing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Tile {
    /// Open ground around the building.
    Outdoors,
    Wall,
    /// Index into the rooms.
    Room(usize),
    /// Index into [`Layout::openings`].
    Opening(usize),
}

/// What a character says about its tile, before rooms are known.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Mark {
    /// Floor inside a room, open ground elsewhere.
    Blank,
    /// Certainly floor.
    Floor,
    Wall,
    Opening(OpeningKind),
}

/// What fills a hole in a wall.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum OpeningKind {
    Doorway,
    GlassDoor,
    Window,
}

/// A hole in a straight wall.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Opening {
    pub(crate) kind: OpeningKind,
    /// First tile: leftmost or topmost.
    pub(crate) column: usize,
    pub(crate) row: usize,
    /// Tiles along the wall.
    pub(crate) length: usize,
    /// Whether the wall runs east to west, so that one passes north to south.
    pub(crate) along_x: bool,
    /// Heights above the floor between which the wall is missing, metres.
    pub(crate) bottom_m: f32,
    pub(crate) top_m: f32,
}

/// The building as tiles.
#[derive(Debug, Clone)]
pub(crate) struct Layout {
    pub(crate) columns: usize,
    pub(crate) rows: usize,
    pub(crate) tile_m: f32,
    pub(crate) tiles: Vec<Tile>,
    pub(crate) openings: Vec<Opening>,
    /// Clear height of each room.
    pub(crate) room_height_m: Vec<f32>,
    /// Bounds of the tiles of each room: first column, first row, last column, last row.
    pub(crate) room_extents: Vec<[isize; 4]>,
}

/// The drawing: one mark for each tile, row by row, and where in the text it stands.
pub(super) struct Marks {
    pub(super) columns: usize,
    pub(super) rows: usize,
    pub(super) marks: Vec<Mark>,
    /// Line of the first row.
    pub(super) first_line: usize,
    /// Characters before the drawing on each row.
    pub(super) indents: Vec<usize>,
}

impl Marks {
    pub(super) fn error(&self, column: usize, row: usize, problem: Problem) -> PlanError {
        PlanError {
            line: self.first_line + row,
            column: self.indents[row] + column + 1,
            problem,
        }
    }

    fn at(&self, column: isize, row: isize) -> Option<Mark> {
        let inside = (0..self.columns as isize).contains(&column) && (0..self.rows as isize).contains(&row);
        inside.then(|| self.marks[row as usize * self.columns + column as usize])
    }

    fn neighbours(&self, at: usize) -> impl Iterator<Item = Option<usize>> {
        let (column, row) = ((at % self.columns) as isize, (at / self.columns) as isize);
        Facing::ALL.map(|f| f.step()).into_iter().map(move |(dx, dy)| {
            let (column, row) = (column + dx, row + dy);
            self.at(column, row)
                .map(|_| row as usize * self.columns + column as usize)
        })
    }
}

/// Finds open ground, rooms and openings.
///
/// # Errors
/// A floor that touches open ground or the edge of the drawing; an opening outside a straight wall; too many rooms.
pub(super) fn tiles_of(marks: &Marks, max_rooms: usize) -> Result<(Vec<Tile>, Vec<Opening>, usize), PlanError> {
    let mut tiles: Vec<Option<Tile>> = vec![None; marks.marks.len()];
    let edge = |at: usize| marks.neighbours(at).any(|n| n.is_none());
    let mut pending: Vec<usize> = (0..tiles.len())
        .filter(|&at| marks.marks[at] == Mark::Blank && edge(at))
        .collect();
    while let Some(at) = pending.pop() {
        if tiles[at].is_none() {
            tiles[at] = Some(Tile::Outdoors);
            pending.extend(
                marks
                    .neighbours(at)
                    .flatten()
                    .filter(|&n| marks.marks[n] == Mark::Blank),
            );
        }
    }
    let mut room_count = 0;
    for start in 0..tiles.len() {
        if tiles[start].is_some() || !matches!(marks.marks[start], Mark::Blank | Mark::Floor) {
            continue;
        }
        if room_count == max_rooms {
            let problem = Problem::TooMany {
                what: "rooms",
                limit: max_rooms,
            };
            return Err(marks.error(start % marks.columns, start / marks.columns, problem));
        }
        let mut pending = vec![start];
        while let Some(at) = pending.pop() {
            if tiles[at].is_some() {
                continue;
            }
            tiles[at] = Some(Tile::Room(room_count));
            for neighbour in marks.neighbours(at) {
                match neighbour {
                    Some(n) if tiles[n] == Some(Tile::Outdoors) => {
                        return Err(marks.error(at % marks.columns, at / marks.columns, Problem::Unclosed));
                    }
                    Some(n) if matches!(marks.marks[n], Mark::Blank | Mark::Floor) => pending.push(n),
                    Some(_) => {}
                    None => return Err(marks.error(at % marks.columns, at / marks.columns, Problem::Unclosed)),
                }
            }
        }
        room_count += 1;
    }
    let openings = openings_of(marks, &mut tiles)?;
    let tiles = tiles.into_iter().map(|tile| tile.unwrap_or(Tile::Wall)).collect();
    Ok((tiles, openings, room_count))
}

/// Bounds of the tiles of each room: first column, first row, last column, last row.
pub(super) fn extents_of(tiles: &[Tile], columns: usize, room_count: usize) -> Vec<[isize; 4]> {
    let mut extents = vec![[isize::MAX, isize::MAX, 0, 0]; room_count];
    for (at, tile) in tiles.iter().enumerate() {
        if let Tile::Room(room) = *tile {
            let (c, r) = ((at % columns) as isize, (at / columns) as isize);
            let [c0, r0, c1, r1] = extents[room];
            extents[room] = [c0.min(c), r0.min(r), c1.max(c), r1.max(r)];
        }
    }
    extents
}

fn openings_of(marks: &Marks, tiles: &mut [Option<Tile>]) -> Result<Vec<Opening>, PlanError> {
    let mut openings: Vec<Opening> = Vec::new();
    for at in 0..tiles.len() {
        let Mark::Opening(kind) = marks.marks[at] else { continue };
        if tiles[at].is_some() {
            continue;
        }
        let (column, row) = (at % marks.columns, at / marks.columns);
        let mark = |dx: isize, dy: isize| marks.at(column as isize + dx, row as isize + dy);
        let passable = |m: Option<Mark>| matches!(m, None | Some(Mark::Blank | Mark::Floor));
        let run = |dx: isize, dy: isize| {
            (0..)
                .take_while(|&i| mark(dx * i, dy * i) == Some(marks.marks[at]))
                .count()
        };
        let fits = |along_x: bool| {
            let (dx, dy) = if along_x { (1, 0) } else { (0, 1) };
            let length = run(dx, dy) as isize;
            let ends = mark(-dx, -dy) == Some(Mark::Wall) && mark(dx * length, dy * length) == Some(Mark::Wall);
            let sides = (0..length)
                .all(|i| passable(mark(dx * i + dy, dy * i + dx)) && passable(mark(dx * i - dy, dy * i - dx)));
            (ends && sides).then_some(length as usize)
        };
        let Some((along_x, length)) = [true, false]
            .into_iter()
            .find_map(|along| fits(along).map(|n| (along, n)))
        else {
            return Err(marks.error(column, row, Problem::OpeningNotInWall));
        };
        for i in 0..length {
            tiles[at + if along_x { i } else { i * marks.columns }] = Some(Tile::Opening(openings.len()));
        }
        openings.push(Opening {
            kind,
            column,
            row,
            length,
            along_x,
            bottom_m: 0.0,
            top_m: 0.0,
        });
    }
    Ok(openings)
}

impl Layout {
    /// The tile at a column and row; open ground outside the drawing.
    pub(crate) fn tile(&self, column: isize, row: isize) -> Tile {
        if column < 0 || row < 0 || column >= self.columns as isize || row >= self.rows as isize {
            return Tile::Outdoors;
        }
        self.tiles[row as usize * self.columns + column as usize]
    }

    /// The middle of a tile on the floor, metres: x, z.
    pub(crate) fn tile_middle(&self, column: usize, row: usize) -> [f32; 2] {
        [column, row].map(|i| (i as f32 + 0.5) * self.tile_m)
    }

    /// Heights of the two rooms on either side of an opening; open ground counts for nothing.
    pub(crate) fn lowest_ceiling_beside(&self, opening: &Opening) -> f32 {
        let (dx, dy) = if opening.along_x { (0, 1) } else { (1, 0) };
        let mut lowest = f32::INFINITY;
        for i in 0..opening.length {
            let (column, row) = opening.tile(i);
            for side in [-1, 1] {
                if let Tile::Room(room) = self.tile(column + dx * side, row + dy * side) {
                    lowest = lowest.min(self.room_height_m[room]);
                }
            }
        }
        if lowest.is_finite() { lowest } else { 4.0 }
    }
}

impl Opening {
    /// Column and row of its tile number `i`.
    pub(crate) fn tile(&self, i: usize) -> (isize, isize) {
        let (column, row) = (self.column as isize, self.row as isize);
        if self.along_x {
            (column + i as isize, row)
        } else {
            (column, row + i as isize)
        }
    }
}
