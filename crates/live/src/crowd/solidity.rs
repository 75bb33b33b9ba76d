//! How much of a cell's border do the things in it cover? (§3.1.1)
//!
//! Each thing is projected onto each of the four sides, straight across; what the projections cover together, over the length of all
//! sides, is the cell's solidity. Of a disc that reaches over the border only the part inside counts.

use super::{Disc, Square};

/// From 0, nothing in it, to 1.
pub(super) fn solidity(square: &Square, discs: impl Iterator<Item = Disc> + Clone) -> f64 {
    let covered = [0, 1].map(|axis| {
        let (low, high) = (square.min[axis], square.max()[axis]);
        let reach = |disc: Disc| [disc.middle[axis] - disc.radius_m, disc.middle[axis] + disc.radius_m];
        let inside = discs.clone().map(reach).map(|[from, to]| [from.max(low), to.min(high)]);
        let mut spans: Vec<_> = inside.filter(|[from, to]| from < to).collect();
        spans.sort_by(|a, b| a[0].total_cmp(&b[0]));
        let (mut sum, mut end) = (0.0, low);
        for [from, to] in spans {
            sum += (to - from.max(end)).max(0.0);
            end = end.max(to);
        }
        sum
    });
    // Opposite sides see the same.
    ((covered[0] + covered[1]) / (2.0 * square.side_m)).min(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    const UNIT: Square = Square {
        min: [10.0, 20.0],
        side_m: 2.0,
    };

    fn disc(x: f64, z: f64, radius_m: f64) -> Disc {
        Disc::of([10.0 + x, 1.5, 20.0 + z], radius_m)
    }

    fn of(discs: &[Disc]) -> f64 {
        solidity(&UNIT, discs.iter().copied())
    }

    #[test]
    fn projections_add_up_where_they_do_not_overlap() {
        assert_eq!(of(&[]), 0.0);
        assert!((of(&[disc(1.0, 1.0, 0.25)]) - 0.25).abs() < 1e-12);
        assert!(
            (of(&[disc(1.0, 1.0, 0.25), disc(1.0, 1.0, 0.1)]) - 0.25).abs() < 1e-12,
            "one behind the other"
        );
        assert!((of(&[disc(0.5, 0.5, 0.25), disc(1.5, 1.5, 0.25)]) - 0.5).abs() < 1e-12);
        assert!(
            (of(&[disc(0.5, 1.0, 0.25), disc(1.5, 1.0, 0.25)]) - 0.375).abs() < 1e-12,
            "one beside the other"
        );
        assert!(
            (of(&[disc(0.0, 1.0, 0.5)]) - 0.375).abs() < 1e-12,
            "half of it stands next door"
        );
        assert_eq!(of(&[disc(1.0, 1.0, 9.0)]), 1.0);
    }
}
