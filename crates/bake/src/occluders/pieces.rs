//! Where on a wall is anything opaque? A few rectangles, so that who looks for walls on a sight line is not sent to one that
//! is open there: faces of a whole town may lie in one plane.

use std::ops::Range;

use super::wall::Rectangle;

/// A rectangle of which at least one in so many squares is opaque is not cut any further.
const DENSE: usize = 2;
/// A wall is cut at most so often in a row.
const DEPTH: u32 = 6;

/// Squares of a wall by the numbers of the lines before and behind them.
#[derive(Clone)]
struct Block([Range<usize>; 2]);

/// Rectangles that together hold all opaque squares; `count` says how many there are in a block of squares.
pub(super) fn pieces(lines: &[Vec<f32>; 2], count: &dyn Fn(&[Range<usize>; 2]) -> u32) -> Vec<Rectangle> {
    let all = Block([0, 1].map(|axis| 0..lines[axis].len() - 1));
    let mut pieces = Vec::new();
    cut(all, lines, count, DEPTH, &mut pieces);
    pieces
}

/// Whether a rectangle of opaque squares is nowhere narrower than this.
pub(super) fn is_wide(lines: &[Vec<f32>; 2], count: &dyn Fn(&[Range<usize>; 2]) -> u32, least_m: f32) -> bool {
    // For each line the first one that is so far behind it.
    let far = |axis: usize| {
        let lines = &lines[axis];
        let mut end = 0;
        (0..lines.len()).map_while(move |start| {
            while end < lines.len() && lines[end] - lines[start] < least_m {
                end += 1;
            }
            (end < lines.len()).then_some(start..end)
        })
    };
    far(1).any(|v| {
        far(0).any(|u| {
            let squares = u.len() * v.len();
            count(&[u, v.clone()]) as usize == squares
        })
    })
}

fn cut(
    block: Block,
    lines: &[Vec<f32>; 2],
    count: &dyn Fn(&[Range<usize>; 2]) -> u32,
    depth: u32,
    pieces: &mut Vec<Rectangle>,
) {
    let Some(Block(ranges)) = shrunk(block, count) else {
        return;
    };
    let squares = ranges[0].len() * ranges[1].len();
    if depth == 0 || count(&ranges) as usize * DENSE >= squares {
        pieces.push([0, 1].map(|axis| [lines[axis][ranges[axis].start], lines[axis][ranges[axis].end]]));
        return;
    }
    // Across the longer side, at the line nearest to its middle.
    let length_m = |axis: usize| lines[axis][ranges[axis].end] - lines[axis][ranges[axis].start];
    let longer = usize::from(length_m(1) > length_m(0));
    let axis = if ranges[longer].len() > 1 { longer } else { 1 - longer };
    let range = ranges[axis].clone();
    let middle = 0.5 * (lines[axis][range.start] + lines[axis][range.end]);
    let at = lines[axis][range.clone()].partition_point(|line| *line < middle) + range.start;
    let at = at.clamp(range.start + 1, range.end - 1);
    for half in [range.start..at, at..range.end] {
        let mut part = ranges.clone();
        part[axis] = half;
        cut(Block(part), lines, count, depth - 1, pieces);
    }
}

/// The block without rows and columns at its border in which nothing is opaque; `None` when nothing is.
fn shrunk(Block(mut ranges): Block, count: &dyn Fn(&[Range<usize>; 2]) -> u32) -> Option<Block> {
    if count(&ranges) == 0 {
        return None;
    }
    for axis in 0..2 {
        let range = ranges[axis].clone();
        let holds = |from: usize, to: usize| {
            let mut part = ranges.clone();
            part[axis] = from..to;
            count(&part) > 0
        };
        let start = first(range.clone(), |at| holds(range.start, at + 1));
        let end = first(start..range.end, |at| !holds(at + 1, range.end)) + 1;
        ranges[axis] = start..end;
    }
    Some(Block(ranges))
}

/// The first number for which something holds that holds for all after it.
fn first(range: Range<usize>, holds: impl Fn(usize) -> bool) -> usize {
    let (mut low, mut high) = (range.start, range.end);
    while low < high {
        let middle = low + (high - low) / 2;
        if holds(middle) {
            high = middle;
        } else {
            low = middle + 1;
        }
    }
    low
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Squares of one metre, opaque where `#`.
    fn found(rows: &[&str]) -> Vec<Rectangle> {
        let lines = [rows[0].len(), rows.len()].map(|count| (0..=count).map(|i| i as f32).collect());
        pieces(&lines, &|[u, v]| {
            let rows = rows[v.clone()].iter();
            rows.map(|row| row[u.clone()].matches('#').count() as u32).sum()
        })
    }

    #[test]
    fn houses_apart_are_pieces_and_a_wall_with_a_door_is_one() {
        assert_eq!(
            found(&[".##......", ".##....#."]),
            [[[1.0, 3.0], [0.0, 2.0]], [[7.0, 8.0], [1.0, 2.0]]]
        );
        assert_eq!(found(&["####", "##.#"]), [[[0.0, 4.0], [0.0, 2.0]]]);
        assert!(found(&["...", "..."]).is_empty());
    }

    #[test]
    fn strips_are_not_wide_however_many() {
        let wide = |rows: &[&str], least_m: f32| {
            let lines = [rows[0].len(), rows.len()].map(|count| (0..=count).map(|i| i as f32).collect());
            let count = |[u, v]: &[Range<usize>; 2]| {
                let rows = rows[v.clone()].iter();
                rows.map(|row| row[u.clone()].matches('#').count() as u32).sum()
            };
            is_wide(&lines, &count, least_m)
        };
        let strips = ["########", "........", "########", "........", "########"];
        assert!(wide(&strips, 1.0) && !wide(&strips, 1.5));
        let wall = ["........", "..###...", "..###.##", "..###.##"];
        assert!(wide(&wall, 3.0) && !wide(&wall, 3.5) && !wide(&wall, 9.0));
    }

    #[test]
    fn every_opaque_square_lies_in_a_piece() {
        let rows = [
            "#...........#",
            ".............",
            "......#......",
            "..........#..",
            "#............",
        ];
        let pieces = found(&rows);
        for (y, row) in rows.iter().enumerate() {
            for x in (0..row.len()).filter(|x| &row[*x..=*x] == "#") {
                let middle = [x as f32 + 0.5, y as f32 + 0.5];
                let inside = |r: &Rectangle| (0..2).all(|a| r[a][0] < middle[a] && middle[a] < r[a][1]);
                assert!(pieces.iter().any(inside), "{x} {y}");
            }
        }
        assert!(pieces.len() <= 5);
    }
}
