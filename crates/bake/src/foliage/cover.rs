//! Which share of the sides of boxes of air do leaves cover? Boxes stand in a grid, a quarter as high as they are wide. Each
//! leaf is projected straight across, along x and along z, onto the sides of the boxes that it is in; a pixel of a side is
//! covered when the middle of it is.

use std::collections::BTreeMap;

use belvedere_scene::foliage::Slab;
use glam::DVec3;

use super::leaves::PlacedLeaf;

/// Pixels of a side.
const COLUMNS: i64 = 32;
const ROWS: i64 = 8;

/// The pixels of a side, row by row.
type Side = [u32; ROWS as usize];

pub(super) struct Cover {
    side_m: f64,
    /// By the place of a box in the grid, x, y and z: what is covered seen along x and along z.
    boxes: BTreeMap<[i64; 3], [Side; 2]>,
}

impl Cover {
    pub(super) fn new(side_m: f64) -> Self {
        Self {
            side_m,
            boxes: BTreeMap::new(),
        }
    }

    pub(super) fn add(&mut self, leaf: &PlacedLeaf<'_>) {
        for (view, along) in [0, 2].into_iter().enumerate() {
            self.project(leaf, view, along);
        }
    }

    fn project(&mut self, leaf: &PlacedLeaf<'_>, view: usize, along: usize) {
        let pixel_m = self.side_m / COLUMNS as f64;
        let across = 2 - along;
        // In pixels; a pixel's middle has whole coordinates.
        let flat = leaf.corners.map(|p| [p[across] / pixel_m - 0.5, p.y / pixel_m - 0.5]);
        let [a, b, c] = flat;
        let area = cross(a, b, c);
        if area == 0.0 {
            return;
        }
        let range = |i: usize| {
            let low = flat.iter().map(|p| p[i]).fold(f64::INFINITY, f64::min);
            let high = flat.iter().map(|p| p[i]).fold(f64::NEG_INFINITY, f64::max);
            low.ceil() as i64..=high.floor() as i64
        };
        for v in range(1) {
            for u in range(0) {
                let p = [u as f64, v as f64];
                let weights = [cross(p, b, c) / area, cross(a, p, c) / area, cross(a, b, p) / area];
                if weights.iter().all(|weight| *weight >= 0.0) && leaf.hides_at(weights) {
                    let place = (0..3).map(|i| weights[i] * leaf.corners[i]).sum::<DVec3>();
                    let mut at = [0, v.div_euclid(ROWS), 0];
                    at[along] = (place[along] / self.side_m).floor() as i64;
                    at[across] = u.div_euclid(COLUMNS);
                    let sides = self.boxes.entry(at).or_default();
                    sides[view][v.rem_euclid(ROWS) as usize] |= 1 << u.rem_euclid(COLUMNS);
                }
            }
        }
    }

    /// Each box as a slab of its square, rising by square and height.
    pub(super) fn slabs(&self) -> impl Iterator<Item = ([i64; 2], Slab)> {
        let height_m = self.side_m * ROWS as f64 / COLUMNS as f64;
        let mut boxes: Vec<_> = self.boxes.iter().collect();
        boxes.sort_unstable_by_key(|([x, y, z], _)| [*x, *z, *y]);
        boxes.into_iter().map(move |([x, y, z], sides)| {
            let covered: u32 = sides.iter().flatten().map(|row| row.count_ones()).sum();
            let share = f64::from(covered) / (2 * COLUMNS * ROWS) as f64;
            let slab = Slab {
                from_m: *y as f64 * height_m,
                to_m: (*y + 1) as f64 * height_m,
                // Rounded so that it hides no more.
                solidity: (share * 100.0).floor() / 100.0,
            };
            ([*x, *z], slab)
        })
    }
}

/// Twice the area of a triangle, with a sign.
fn cross(a: [f64; 2], b: [f64; 2], c: [f64; 2]) -> f64 {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}
