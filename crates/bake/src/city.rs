//! What do the papers measure on? A city of boxes, the scene of Cohen-Or & Zadicario, *Visibility streaming for
//! network-based walkthroughs* (1998), Results: 2,128 buildings scattered evenly in a plane, a quarter of them made of
//! three boxes of random height one above the other; dense or sparse. Tests and benchmarks share it.
//!
//! Buildings have walls and roofs but no floors, as theirs; each is one object. A third parameter, the seed, is ours.

use glam::{DMat4, DVec3};

use crate::{
    source::{Primitive, Role, SourceModel, SourceObject, SourceScene, SourceViewpoint},
    visibility::random::Random,
};

/// Which city.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct City {
    /// Buildings along x and z.
    pub blocks: [usize; 2],
    /// Distance between the middles of neighbouring lots, in metres. Buildings are 8 to 14 m wide.
    pub spacing_m: f64,
    /// The share of buildings made of three boxes.
    pub stacked_share: f32,
    /// Every so many buildings along x and z a row of taller ones stands wall to wall, so that no street leads on; 0 for none.
    pub closed_after: usize,
    /// Where random numbers start.
    pub seed: u64,
}

impl City {
    /// The paper's `city1`: 2,128 buildings, streets about half as wide as houses.
    pub const DENSE: Self = Self {
        blocks: [56, 38],
        spacing_m: 17.0,
        stacked_share: 0.25,
        closed_after: 0,
        seed: 1998,
    };
    /// The paper's `city2`: as many buildings, further apart.
    pub const SPARSE: Self = Self {
        spacing_m: 26.0,
        ..Self::DENSE
    };

    /// Ours: as dense, in quarters from which no street leads. What is seen from a street does not grow with such a city.
    pub const QUARTERS: Self = Self {
        closed_after: 8,
        ..Self::DENSE
    };

    /// The edge of the paper's cells: a quarter of a building.
    pub const CELL_M: f64 = 2.75;

    /// How high buildings that stand wall to wall are: no other is higher.
    const CLOSING_M: f64 = 44.0;

    fn closes(&self, line: usize) -> bool {
        self.closed_after > 0 && line.is_multiple_of(self.closed_after)
    }

    /// The boxes of each building from the ground up, in metres, +Y up, the ground at 0.
    #[must_use]
    pub fn buildings(&self) -> Vec<Vec<[DVec3; 2]>> {
        let mut random = Random::stream(self.seed, 0);
        let mut between = move |from: f64, to: f64| from + (to - from) * f64::from(random.unit());
        let mut buildings = Vec::with_capacity(self.blocks[0] * self.blocks[1]);
        for column in 0..self.blocks[0] {
            for row in 0..self.blocks[1] {
                let half = DVec3::new(between(4.0, 7.0), 0.0, between(4.0, 7.0));
                let slack = DVec3::splat(0.5 * self.spacing_m - 1.0) - half;
                let middle = DVec3::new(
                    column as f64 * self.spacing_m + between(-1.0, 1.0) * slack.x.max(0.0),
                    0.0,
                    row as f64 * self.spacing_m + between(-1.0, 1.0) * slack.z.max(0.0),
                );
                let floors = if between(0.0, 1.0) < f64::from(self.stacked_share) {
                    3
                } else {
                    1
                };
                let (mut bottom, mut share) = (0.0, 1.0);
                let boxes = (0..floors).map(|_| {
                    let top = bottom + between(8.0, 24.0) / f64::from(floors).sqrt();
                    let body = [
                        middle - share * half + bottom * DVec3::Y,
                        middle + share * half + top * DVec3::Y,
                    ];
                    (bottom, share) = (top, share * between(0.6, 0.95));
                    body
                });
                let boxes: Vec<_> = boxes.collect();
                buildings.push(if self.closes(column) || self.closes(row) {
                    let lot = DVec3::new(column as f64, 0.0, row as f64) * self.spacing_m;
                    let half = DVec3::new(0.5, 0.0, 0.5) * self.spacing_m;
                    vec![[lot - half, lot + half + Self::CLOSING_M * DVec3::Y]]
                } else {
                    boxes
                });
            }
        }
        buildings
    }

    /// Cells of the paper's size scattered over the streets, free of buildings, as `[min, max]` in metres.
    #[must_use]
    pub fn street_cells(&self, count: usize) -> Vec<[DVec3; 2]> {
        let mut random = Random::stream(self.seed, 1);
        let houses = self.buildings();
        let size_m = DVec3::new(self.blocks[0] as f64, 0.0, self.blocks[1] as f64) * self.spacing_m;
        let mut cells = Vec::with_capacity(count);
        while cells.len() < count {
            let min = random.cube().as_dvec3() * size_m;
            let cell = [min, min + Self::CELL_M];
            let free = houses.iter().all(|boxes| {
                let house = boxes[0];
                [0, 2]
                    .iter()
                    .any(|axis| cell[0][*axis] > house[1][*axis] || cell[1][*axis] < house[0][*axis])
            });
            if free {
                cells.push(cell);
            }
        }
        cells
    }

    /// The city as an importer would give it, with a viewpoint in a street.
    #[must_use]
    pub fn scene(&self) -> SourceScene {
        let mut scene = SourceScene {
            title: Some("City".to_owned()),
            ..SourceScene::default()
        };
        for (index, boxes) in self.buildings().into_iter().enumerate() {
            let corner = boxes[0][0];
            let mut primitive = Primitive::default();
            for [min, max] in boxes {
                add_box(&mut primitive, min - corner, max - corner);
            }
            scene.models.push(SourceModel {
                name: format!("building {index}"),
                primitives: vec![primitive],
                ..SourceModel::default()
            });
            scene.objects.push(SourceObject {
                source_node: format!("building {index}"),
                part: 0,
                model: index,
                world_from_object: DMat4::from_translation(corner),
                role: Role::Ordinary,
            });
        }
        let street = 0.5 * self.spacing_m;
        scene.viewpoints.push(SourceViewpoint {
            name: "street".to_owned(),
            world_from_camera: DMat4::from_translation(DVec3::new(street, 1.65, street)),
        });
        scene
    }
}

/// Four walls and a roof, ten triangles, seen from outside.
fn add_box(primitive: &mut Primitive, min: DVec3, max: DVec3) {
    let first = primitive.positions.len() as u32;
    let corners = (0..8).map(|i| {
        let pick = |bit: usize, axis: usize| if i >> bit & 1 == 0 { min[axis] } else { max[axis] };
        [pick(0, 0) as f32, pick(1, 1) as f32, pick(2, 2) as f32]
    });
    primitive.positions.extend(corners);
    // Corner i has x, y, z at their maximum where bits 0, 1, 2 are set.
    const QUADS: [[u32; 4]; 5] = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 2, 3, 1], [4, 5, 7, 6], [2, 6, 7, 3]];
    for [a, b, c, d] in QUADS {
        primitive.indices.extend([a, b, c, a, c, d].map(|i| first + i));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_city_has_the_papers_count_and_its_houses_do_not_meet() {
        let scene = City::DENSE.scene();
        assert_eq!(scene.objects.len(), 2128);
        let houses = City::DENSE.buildings();
        for (i, a) in houses.iter().enumerate() {
            for b in &houses[i + 1..] {
                let ([a_min, a_max], [b_min, b_max]) = (a[0], b[0]);
                assert!(a_min.x > b_max.x || b_min.x > a_max.x || a_min.z > b_max.z || b_min.z > a_max.z);
            }
        }
    }

    #[test]
    fn street_cells_keep_clear_of_houses() {
        let city = City {
            blocks: [6, 5],
            ..City::DENSE
        };
        let houses = city.buildings();
        for [min, max] in city.street_cells(40) {
            assert!(min.y >= 0.0 && (max - min - City::CELL_M).abs().max_element() < 1e-6);
            let meets = |house: &[DVec3; 2]| min.cmple(house[1]).all() && max.cmpge(house[0]).all();
            assert!(!houses.iter().flatten().any(meets));
        }
    }

    #[test]
    fn faces_look_outwards() {
        for model in &City::DENSE.scene().models {
            let primitive = &model.primitives[0];
            for (box_index, body) in primitive.positions.chunks(8).enumerate() {
                let middle = body.iter().map(|p| DVec3::from(p.map(f64::from))).sum::<DVec3>() / 8.0;
                for face in primitive.indices[30 * box_index..30 * (box_index + 1)].chunks(3) {
                    let corner = |i: u32| DVec3::from(primitive.positions[i as usize].map(f64::from));
                    let [a, b, c] = [corner(face[0]), corner(face[1]), corner(face[2])];
                    assert!((b - a).cross(c - a).dot(a - middle) > 0.0);
                }
            }
        }
    }
}
