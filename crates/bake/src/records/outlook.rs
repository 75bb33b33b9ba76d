//! Which way does one look who begins? Where most of the picture is far away and seen face on: through openings, along streets and
//! the long side of a room, not into a corner, and not to where nothing is.

use glam::DVec3;

/// One may look in so many directions, …
const HEADINGS: usize = 64;
/// … and sees so many of them to either side: 34°.
const BESIDE: usize = 6;

/// What ends a line of sight.
#[derive(Debug, Clone, Copy)]
pub(super) struct End {
    pub(super) away_m: f64,
    /// Cosine of the angle to what stands there upright on the line, 0 to 1.
    pub(super) face_on: f64,
}

/// The level direction in which lines of sight are longest, around which they are so as well; `None` where none ends anywhere.
pub(super) fn best(end_of: impl Fn(DVec3) -> Option<End>) -> Option<DVec3> {
    let worths: Vec<f64> = (0..HEADINGS).map(|i| end_of(heading(i)).map_or(0.0, worth)).collect();
    let around = |i: usize| -> f64 {
        let side = |by: usize| worths[(i + by) % HEADINGS] + worths[(i + HEADINGS - by) % HEADINGS];
        let beside = (1..=BESIDE).map(|by| (BESIDE + 1 - by) as f64 * side(by));
        (BESIDE + 1) as f64 * worths[i] + beside.sum::<f64>()
    };
    let mut best = (0, around(0));
    for i in 1..HEADINGS {
        let worth = around(i);
        // What is as good but for rounding is not better.
        if worth > best.1 * (1.0 + 1e-9) {
            best = (i, worth);
        }
    }
    (best.1 > 0.0).then(|| heading(best.0))
}

/// How far away it is; less where it is seen from the side, so that two walls that meet in a corner count less than one of them.
fn worth(end: End) -> f64 {
    end.away_m * end.face_on * end.face_on
}

/// One of the directions, from −Z on, as an author's camera looks that was not turned.
fn heading(i: usize) -> DVec3 {
    let angle = std::f64::consts::TAU * i as f64 / HEADINGS as f64;
    DVec3::new(angle.sin(), 0.0, -angle.cos())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A wall from one place to another, as seen from above.
    type Wall = [[f64; 2]; 2];

    fn room([west, north, east, south]: [f64; 4]) -> Vec<Wall> {
        let corners = [[west, north], [east, north], [east, south], [west, south]];
        (0..4).map(|i| [corners[i], corners[(i + 1) % 4]]).collect()
    }

    /// Where one looks who stands in the middle of all axes.
    fn best_among(walls: &[Wall]) -> Option<[f64; 2]> {
        let end_of = |direction: DVec3| {
            let direction = [direction.x, direction.z];
            let cross = |a: [f64; 2], b: [f64; 2]| a[0] * b[1] - a[1] * b[0];
            let met = walls.iter().filter_map(|[from, to]| {
                let along = [to[0] - from[0], to[1] - from[1]];
                let lean = cross(direction, along);
                let (away_m, share) = (cross(*from, along) / lean, cross(*from, direction) / lean);
                let long = along[0].hypot(along[1]);
                let face_on = (lean / long).abs();
                (away_m > 0.0 && (0.0..=1.0).contains(&share)).then_some(End { away_m, face_on })
            });
            met.min_by(|a, b| a.away_m.total_cmp(&b.away_m))
        };
        best(end_of).map(|direction| [direction.x, direction.z])
    }

    #[track_caller]
    fn assert_looks(walls: &[Wall], towards: [f64; 2]) {
        let found = best_among(walls).expect("there are walls");
        let straight = found[0] * towards[0] + found[1] * towards[1];
        assert!(straight > 0.99, "{found:?} instead of {towards:?}");
    }

    #[test]
    fn along_the_long_side_of_a_room_and_not_into_its_corners() {
        assert_looks(&room([-3.0, -2.0, 4.0, 2.0]), [1.0, 0.0]);
        assert_looks(&room([-3.0, -2.0, 3.0, 5.0]), [0.0, 1.0]);
        let square = best_among(&room([-2.0, -2.0, 2.0, 2.0])).expect("there are walls");
        assert!(square.iter().any(|along| along.abs() > 0.99), "{square:?}");
    }

    #[test]
    fn through_an_opening_along_a_street_or_at_what_is_there() {
        // The wall in the south leaves a doorway to a hall.
        let mut walls = room([-3.0, -3.0, 3.0, 12.0]);
        walls.extend([[[-3.0, 3.0], [-1.0, 3.0]], [[1.0, 3.0], [3.0, 3.0]]]);
        assert_looks(&walls, [0.0, 1.0]);
        let street = [
            [[-90.0, -6.0], [60.0, -6.0]],
            [[-90.0, 6.0], [60.0, 6.0]],
            [[-90.0, -6.0], [-90.0, 6.0]],
        ];
        assert_looks(&street, [-1.0, 0.0]);
        // All else is open country.
        assert_looks(&[[[30.0, -5.0], [30.0, 5.0]]], [1.0, 0.0]);
        assert_eq!(best_among(&[]), None);
    }
}
