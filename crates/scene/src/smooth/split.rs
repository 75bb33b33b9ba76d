//! What becomes of the triangles around a vertex when it is split in two?
//!
//! The vertex split of Hoppe, *Progressive meshes* (1996), for any triangles: each fan around the vertex is split by
//! itself. Some of its triangles move to the new vertex; where a moved triangle meets one that stays, the edge between
//! them opens into a new triangle. What no such rule describes is said outright: torn fans one triangle at a time, and
//! further new triangles by their third corner.

use super::fan::{Fan, Spoke, Star};
use super::mesh::Mesh;
use super::model::{Bit, Nibble, number, wide};
use super::rans::Coder;

/// What becomes of one fan.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Move {
    /// All triangles stay.
    Stay,
    /// All triangles move.
    Go,
    /// Those in one row move.
    Row(Row),
    /// Each for itself; no edge opens.
    Torn,
}

/// A row of triangles that move.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Row {
    /// Index of its first spoke in the fan.
    pub first: u32,
    /// How many; in a closed fan the row may go on at its beginning.
    pub count: u32,
    /// Whether the edge at its beginning opens, and that at its end.
    pub opens: [bool; 2],
}

/// A new triangle: the old vertex, the new one, and a third.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Born {
    /// The third vertex.
    pub third: u32,
    /// Whether its sense of rotation is old, new, third; else new, old, third.
    pub old_first: bool,
}

/// What becomes of all triangles around a vertex.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Split {
    /// One for each fan.
    pub moves: Vec<Move>,
    /// Whether each spoke moves; of torn fans only.
    pub torn: Vec<bool>,
    /// New triangles beside those of opened edges.
    pub extra: Vec<Born>,
    /// How many those are.
    pub extras: u32,
}

impl Split {
    /// Nothing happens.
    pub fn clear(&mut self) {
        self.moves.clear();
        self.torn.clear();
        self.extra.clear();
        self.extras = 0;
    }
}

/// Models of everything about connectivity.
#[derive(Debug, Clone)]
pub(super) struct SplitModels {
    kind: [[Nibble; 11]; 2],
    count: [[Nibble; 16]; 12],
    first: Box<[[Nibble; 16]; 16]>,
    other_first: [[Nibble; 16]; 2],
    torn: [Bit; 3],
    extras: [Nibble; 2],
    in_ring: Bit,
    old_first: [Bit; 2],
}

impl Default for SplitModels {
    fn default() -> Self {
        let row = || std::array::from_fn::<_, 16, _>(|_| Nibble::default());
        Self {
            kind: std::array::from_fn(|_| std::array::from_fn(|_| Nibble::default())),
            count: std::array::from_fn(|_| row()),
            first: Box::new(std::array::from_fn(|_| row())),
            other_first: std::array::from_fn(|_| row()),
            torn: Default::default(),
            extras: Default::default(),
            in_ring: Bit::default(),
            old_first: Default::default(),
        }
    }
}

const STAY: usize = 0;
const GO: usize = 1;
const TORN: usize = 2;
/// A row at the front of an open fan, of which the end opens.
const FRONT: usize = 3;
/// A row at the back of an open fan, of which the beginning opens.
const BACK: usize = 4;
/// Any row, plus 1 if its beginning opens, plus 2 if its end does.
const ROW: usize = 5;
/// A row of which both edges open, as nearly always where the surface is closed.
const ROW_BOTH: usize = ROW + 3;
/// There are extra triangles, which is said before what becomes of the first fan.
const EXTRA: usize = 15;

impl SplitModels {
    /// What becomes of the fans of a star, and how many extra triangles there are.
    #[inline(always)]
    pub(super) fn code_fans<C: Coder>(
        &mut self,
        coder: &mut C,
        mesh: &Mesh,
        vertex: u32,
        star: &Star,
        given: Option<&Split>,
        found: &mut Split,
    ) {
        found.clear();
        let mut last = if star.fans.len() == 1 {
            ROW_BOTH + 1
        } else {
            ROW_BOTH + 2
        };
        let given_extras = given.map_or(0, |split| split.extras);
        if star.fans.is_empty() {
            found.extras = number(coder, &mut self.extras[0], given_extras);
        }
        for (i, &fan) in star.fans.iter().enumerate() {
            let given_move = given.map_or(Move::Stay, |split| split.moves[i]);
            let given_kind = kind_of(given_move, fan);
            let kinds = &mut self.kind[usize::from(fan.closed)][last];
            let has_extra = i == 0 && given_extras > 0;
            let mut kind = coder.symbol(kinds, if has_extra { EXTRA } else { given_kind });
            if i == 0 && kind == EXTRA {
                let more = number(coder, &mut self.extras[1], given_extras.wrapping_sub(1));
                found.extras = more.saturating_add(1);
                kind = coder.symbol(kinds, given_kind);
            }
            let kind = kind.min(ROW_BOTH);
            last = kind;
            let moved = match kind {
                STAY => Move::Stay,
                GO => Move::Go,
                TORN => {
                    let mut before = 2;
                    let at = found.torn.len();
                    for k in 0..fan.length {
                        let given = given.is_some_and(|split| split.torn[at + k]);
                        let moves = coder.bit(&mut self.torn[before], given);
                        before = usize::from(moves);
                        found.torn.push(moves);
                    }
                    Move::Torn
                }
                _ => {
                    let given = match given_move {
                        Move::Row(row) => row,
                        _ => Row {
                            first: 0,
                            count: 0,
                            opens: [false; 2],
                        },
                    };
                    Move::Row(self.code_row(coder, mesh, vertex, star.of(fan), (fan, kind), given))
                }
            };
            found.moves.push(moved);
        }
    }

    #[inline(always)]
    fn code_row<C: Coder>(
        &mut self,
        coder: &mut C,
        mesh: &Mesh,
        vertex: u32,
        spokes: &[Spoke],
        (fan, kind): (Fan, usize),
        given: Row,
    ) -> Row {
        let length = fan.length as u32;
        let class = fan.length.min(15);
        let closed = usize::from(fan.closed);
        let count = &mut self.count[(kind - FRONT) * 2 + closed][class];
        let count = number(coder, count, given.count).min(length);
        let (first, opens) = match kind {
            FRONT => (0, [false, true]),
            BACK => (length - count, [true, false]),
            ROW_BOTH if fan.closed => {
                let widest = widest(mesh, vertex, spokes, count as usize);
                // Distance from the widest place, to both sides in turn.
                let ahead = wrapped(given.first as usize + fan.length - widest, fan.length) as u32;
                let folded = if 2 * ahead <= length {
                    2 * ahead
                } else {
                    2 * (length - ahead) - 1
                };
                let model = &mut self.first[class][(count as usize).min(15)];
                let folded = number(coder, model, folded).min(length - 1);
                let ahead = if folded.is_multiple_of(2) {
                    folded / 2
                } else {
                    length - folded.div_ceil(2)
                };
                (wrapped(widest + ahead as usize, fan.length) as u32, [true; 2])
            }
            _ => {
                let most = if fan.closed { length - 1 } else { length - count };
                let first = number(coder, &mut self.other_first[closed][class], given.first).min(most);
                (first, [(kind - ROW) & 1 == 1, (kind - ROW) & 2 == 2])
            }
        };
        Row { first, count, opens }
    }

    /// The extra triangles.
    #[cold]
    pub(super) fn code_extra<C: Coder>(
        &mut self,
        coder: &mut C,
        mesh: &Mesh,
        star: &Star,
        given: Option<&[Born]>,
        found: &mut Split,
    ) {
        found.extra.clear();
        let vertices = mesh.points.len() as u32;
        let corner = |i: u32| {
            let spoke = star.spokes[i as usize / 2];
            if i.is_multiple_of(2) { spoke.from } else { spoke.to }
        };
        let corners = 2 * star.spokes.len() as u32;
        for i in 0..found.extras as usize {
            let given = given.map(|extra| extra[i]);
            let given_third = given.map_or(0, |born| born.third);
            let given_corner = given.and_then(|_| (0..corners).find(|&i| corner(i) == given_third));
            let in_ring = corners > 0 && coder.bit(&mut self.in_ring, given_corner.is_some());
            let third = if in_ring {
                corner(uniform(coder, corners, given_corner.unwrap_or(0)))
            } else {
                uniform(coder, vertices, given_third)
            };
            let old_first = coder.bit(
                &mut self.old_first[usize::from(in_ring)],
                given.is_some_and(|born| born.old_first),
            );
            found.extra.push(Born { third, old_first });
        }
    }
}

/// One of `count` numbers that are equally likely.
fn uniform(coder: &mut impl Coder, count: u32, value: u32) -> u32 {
    let bits = 32 - (count - 1).leading_zeros();
    wide(coder, bits, value).min(count - 1)
}

fn kind_of(moved: Move, fan: Fan) -> usize {
    match moved {
        Move::Stay => STAY,
        Move::Go => GO,
        Move::Torn => TORN,
        Move::Row(Row { first, count, opens }) => match opens {
            [false, true] if !fan.closed && first == 0 => FRONT,
            [true, false] if !fan.closed && (first + count) as usize == fan.length => BACK,
            [start, end] => ROW + usize::from(start) + 2 * usize::from(end),
        },
    }
}

/// Where `count` triangles of a closed fan reach farthest to the side to which its vertex sees most: there likely was
/// another vertex. Gives the first of them.
#[inline(always)]
fn widest(mesh: &Mesh, vertex: u32, spokes: &[Spoke], count: usize) -> usize {
    let length = spokes.len();
    if length > MOST_SPOKES {
        return 0;
    }
    let at = mesh.points[vertex as usize].at();
    let mut ways = [[0i32; 3]; MOST_SPOKES];
    let mut sum = [0; 3];
    for (way, spoke) in ways.iter_mut().zip(spokes) {
        let other = mesh.points[spoke.from as usize].at();
        for axis in 0..3 {
            way[axis] = other[axis] - at[axis];
            sum[axis] += way[axis];
        }
    }
    let [x, y, z] = sum.map(i64::from);
    let mut reaches = [0; MOST_SPOKES];
    for (reach, way) in reaches.iter_mut().zip(&ways[..length]) {
        let way = way.map(i64::from);
        *reach = way[0] * x + way[1] * y + way[2] * z;
    }
    let reaches = &reaches[..length];
    // Only vertices between two of the triangles are new to it; if there are none, those at the ends.
    let (mut leave, mut enter) = if count > 1 { (1, count) } else { (0, count + 1) };
    let mut reach: i64 = reaches[leave..enter].iter().sum();
    let mut best = (reach, 0);
    for first in 1..length {
        enter = wrapped(enter, length);
        leave = wrapped(leave, length);
        reach += reaches[enter] - reaches[leave];
        enter += 1;
        leave += 1;
        let is_better = reach > best.0;
        best.0 = if is_better { reach } else { best.0 };
        best.1 = if is_better { first } else { best.1 };
    }
    best.1
}

/// A place less than twice around a fan.
#[inline(always)]
fn wrapped(place: usize, length: usize) -> usize {
    if place >= length { place - length } else { place }
}

/// For longer fans no place is likelier than another.
const MOST_SPOKES: usize = 20;
