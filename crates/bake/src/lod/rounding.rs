//! What of a level is drawn when its vertices stand on a lattice?
//!
//! Rounding leaves slivers without area, which nobody draws. Each becomes what it covers: its longest side as a line, or,
//! where all of it falls to one place, a point; neither where something else has this edge or this corner. So what is drawn
//! covers exactly the rounded surface, no point of which is farther from where it was than a vertex moved.
//!
//! All else stays shape for shape; of a level without error, the source itself, what fell stays besides. Cost: a pass over the shapes, and O(n log n) for the n that fall.

use std::collections::BTreeSet;

use crate::glb::lattice::Lattice;
use crate::lod::LodLevel;
use crate::lod::collapse::longest_edge_of_flat;
use crate::lod::octree::position_bits;
use crate::source::{Primitive, Topology};

/// The ends of a line in rising order, or a point twice.
type Place = [[u32; 3]; 2];

/// A level as a GLB on this lattice shows it. Its error grows by how far the vertex moved that moved farthest.
#[must_use]
pub fn rounded(level: &LodLevel, lattice: Lattice) -> LodLevel {
    let mut primitives = level.primitives.clone();
    let moved = lattice.round(&mut primitives);
    let shapes: Vec<Shapes> = primitives.iter().map(Shapes::of).collect();
    if shapes.iter().any(|shapes| !shapes.fallen.is_empty()) {
        let mut alone = Alone::new(&primitives, &shapes);
        let is_source = level.geometric_error == 0.0;
        let mut fell = |topology| -> Vec<Option<Primitive>> {
            let each = primitives.iter().zip(&shapes);
            each.map(|(primitive, shapes)| alone.take(primitive, &shapes.fallen, topology))
                .collect()
        };
        let thin = fell(Topology::Lines).into_iter().zip(fell(Topology::Points));
        let parts = primitives.iter().zip(shapes).zip(thin);
        let parts = parts.flat_map(|((primitive, shapes), (lines, points))| {
            let kept = if is_source {
                Some(primitive.clone())
            } else {
                (!shapes.standing.is_empty()).then(|| primitive.subset(shapes.standing))
            };
            [kept, lines, points].into_iter().flatten()
        });
        primitives = parts.collect();
    }
    LodLevel::new(primitives, level.geometric_error + moved)
}

/// The shapes of a primitive after rounding, as indices of vertices.
struct Shapes {
    /// What is what it was.
    standing: Vec<u32>,
    /// The ends of all else.
    fallen: Vec<[u32; 2]>,
}

impl Shapes {
    fn of(primitive: &Primitive) -> Self {
        let (mut standing, mut fallen) = (Vec::new(), Vec::new());
        for shape in primitive.indices.chunks_exact(primitive.topology.arity()) {
            let at = |corner: usize| primitive.positions[shape[corner] as usize];
            let ends = match primitive.topology {
                Topology::Points => None,
                Topology::Lines => (at(0) == at(1)).then_some((0, 1)),
                Topology::Triangles => longest_edge_of_flat([at(0), at(1), at(2)]),
            };
            match ends {
                Some((a, b)) => fallen.push([shape[a], shape[b]]),
                None => standing.extend(shape),
            }
        }
        Self { standing, fallen }
    }
}

/// Where something fell and nothing else is drawn.
struct Alone(BTreeSet<Place>);

impl Alone {
    fn new(primitives: &[Primitive], shapes: &[Shapes]) -> Self {
        let each = || primitives.iter().zip(shapes);
        let fallen = each().flat_map(|(primitive, shapes)| shapes.fallen.iter().map(|ends| place(primitive, *ends)));
        let mut alone = Self(fallen.collect());
        for (primitive, shapes) in each() {
            for shape in shapes.standing.chunks_exact(primitive.topology.arity()) {
                for (i, &a) in shape.iter().enumerate() {
                    alone.0.remove(&place(primitive, [a, a]));
                    alone.0.remove(&place(primitive, [a, shape[(i + 1) % shape.len()]]));
                }
            }
        }
        alone
    }

    /// What fell to lines, or to points where no line taken before ends; each once.
    fn take(&mut self, primitive: &Primitive, fallen: &[[u32; 2]], topology: Topology) -> Option<Primitive> {
        let mut indices = Vec::new();
        for &[a, b] in fallen {
            let place = place(primitive, [a, b]);
            let is_line = place[0] != place[1];
            if is_line == (topology == Topology::Lines) && self.0.remove(&place) {
                for end in place {
                    self.0.remove(&[end; 2]);
                }
                indices.extend(&[a, b][..topology.arity()]);
            }
        }
        (!indices.is_empty()).then(|| Primitive {
            topology,
            // Tangents shade surfaces only.
            tangents: Vec::new(),
            ..primitive.subset(indices)
        })
    }
}

fn place(primitive: &Primitive, ends: [u32; 2]) -> Place {
    let mut ends = ends.map(|vertex| position_bits(primitive.positions[vertex as usize]));
    ends.sort_unstable();
    ends
}

#[cfg(test)]
mod tests {
    use glam::DVec3;
    use proptest::prelude::*;

    use super::*;
    use crate::glb::lattice::Lattice;
    use crate::lod::proximity::{ShapeTree, point_distance_squared};

    fn on_eighths(triangles: &[[[f32; 3]; 3]]) -> LodLevel {
        let mesh = Primitive {
            positions: triangles.as_flattened().to_vec(),
            indices: (0..3 * triangles.len() as u32).collect(),
            ..Primitive::default()
        };
        let eighths = Lattice::of_size(1.0, 1.0).of_error(2.0);
        assert_eq!(eighths.step(), 0.125);
        rounded(&LodLevel::new(vec![mesh], 2.0), eighths)
    }

    fn shapes(level: &LodLevel) -> Vec<(Topology, usize)> {
        level.primitives.iter().map(|p| (p.topology, p.count())).collect()
    }

    const WALL: [[f32; 3]; 3] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];

    #[test]
    fn a_sliver_becomes_a_line() {
        let sliver = [[0.0, 0.0, 0.0], [0.0, 0.01, 0.0], [0.0, 0.0, 3.0]];
        let level = on_eighths(&[WALL, sliver, sliver]);
        assert_eq!(shapes(&level), [(Topology::Triangles, 1), (Topology::Lines, 1)]);
        assert_eq!((level.triangles, level.lines), (1, 1));
        assert!((level.geometric_error - 2.01).abs() < 1e-6);
    }

    #[test]
    fn a_flat_triangle_with_three_corners_becomes_its_longest_side() {
        let level = on_eighths(&[WALL, [[0.0, 0.0, 0.0], [0.0, 0.01, 1.5], [0.0, 0.0, 3.0]]]);
        assert_eq!(shapes(&level), [(Topology::Triangles, 1), (Topology::Lines, 1)]);
        let ends: Vec<f32> = level.primitives[1].positions.iter().map(|p| p[2]).collect();
        assert_eq!(ends, [0.0, 3.0]);
    }

    #[test]
    fn what_lies_on_another_shape_is_not_told_twice() {
        let beside = [[0.0, 0.0, 0.0], [0.5, 0.01, 0.0], [1.0, 0.0, 0.0]];
        let at_a_corner = WALL.map(|p| p.map(|x| 0.01 * x));
        assert_eq!(
            shapes(&on_eighths(&[WALL, beside, at_a_corner])),
            [(Topology::Triangles, 1)]
        );
    }

    #[test]
    fn a_speck_stays_a_point() {
        let speck = WALL.map(|p| p.map(|x| 9.0 + 0.01 * x));
        let level = on_eighths(&[WALL, speck, speck]);
        assert_eq!(shapes(&level), [(Topology::Triangles, 1), (Topology::Points, 1)]);
    }

    #[test]
    fn the_source_stays_triangle_for_triangle() {
        let mesh = Primitive {
            positions: vec![[0.0, 0.0, 0.0], [0.0, 0.01, 0.0], [0.0, 0.0, 3.0]],
            indices: vec![0, 1, 2],
            ..Primitive::default()
        };
        let eighths = Lattice::of_size(1.0, 1.0).of_error(2.0);
        let level = rounded(&LodLevel::new(vec![mesh], 0.0), eighths);
        assert_eq!(shapes(&level), [(Topology::Triangles, 1), (Topology::Lines, 1)]);
    }

    proptest! {
        #[test]
        fn what_is_drawn_covers_all_that_was(
            positions in prop::collection::vec(prop::array::uniform3(-40i16..40), 3..40),
            corners in prop::collection::vec(prop::array::uniform3(any::<prop::sample::Index>()), 1..60),
        ) {
            let mesh = Primitive {
                indices: corners.iter().flatten().map(|i| i.index(positions.len()) as u32).collect(),
                positions: positions.iter().map(|p| p.map(|x| f32::from(x) / 64.0)).collect(),
                ..Primitive::default()
            };
            let lattice = Lattice::of_size(1.0, 1.0).of_error(2.0);
            let level = rounded(&LodLevel::new(vec![mesh.clone()], 1e-12), lattice);
            for [a, b, c] in level.primitives.iter().filter(|p| p.topology == Topology::Triangles).flat_map(Primitive::triangles) {
                let [a, b, c] = [a, b, c].map(|p| DVec3::from_array(p.map(f64::from)));
                prop_assert!((b - a).cross(c - a) != DVec3::ZERO);
            }
            let drawn = ShapeTree::of(&level.primitives).shapes;
            for [a, b, c] in ShapeTree::of(&[mesh]).shapes {
                for point in [a, b, c, (a + b) / 2.0, (b + c) / 2.0, (c + a) / 2.0, (a + b + c) / 3.0] {
                    let away = drawn.iter().map(|s| point_distance_squared(point, s)).fold(f64::INFINITY, f64::min);
                    prop_assert!(away.sqrt() <= level.geometric_error + 1e-12, "{}", away.sqrt());
                }
            }
        }
    }
}
