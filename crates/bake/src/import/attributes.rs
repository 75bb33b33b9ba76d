//! Are the attributes of vertices fit to draw? Unit normals and tangents, finite coordinates and colours.

use glam::{DVec3, Vec3};

use crate::defect::Defects;
use crate::source::{Primitive, Topology};

/// How far from one a length may be before it counts as a defect. Quantised normals are off by up to this much.
const LENGTH_TOLERANCE: f64 = 0.02;

/// Larger texture coordinates and colours mean nothing: single precision tells such coordinates apart by a sixteenth of a picture.
const MOST: f32 = 1e6;

/// Makes normals unit vectors. One that has no direction is taken from the triangles around its vertex; where that is
/// impossible, all of them are left out.
pub(super) fn normals(
    mut raw: Vec<[f32; 3]>,
    primitive: &Primitive,
    (defects, place): (&mut Defects, &str),
) -> Vec<[f32; 3]> {
    let (mut off, mut bad) = (0, Vec::new());
    for (vertex, normal) in raw.iter_mut().enumerate() {
        match direction(*normal) {
            Some((unit, length)) => {
                off += u64::from((length - 1.0).abs() > LENGTH_TOLERANCE);
                *normal = unit;
            }
            None => bad.push(vertex),
        }
    }
    defects.note("normal that is not of unit length: made so", off, || place.to_owned());
    if bad.is_empty() {
        return raw;
    }
    let around = triangle_normals(primitive);
    for vertex in &bad {
        match around.get(*vertex).and_then(|n| n.try_normalize()) {
            Some(normal) => raw[*vertex] = normal.as_vec3().to_array(),
            None => {
                defects.note(
                    "normals without a direction: all of the primitive's left out",
                    1,
                    || place.to_owned(),
                );
                return Vec::new();
            }
        }
    }
    defects.note(
        "normal without a direction: taken from its triangles",
        bad.len() as u64,
        || format!("{place}, vertex {}", bad[0]),
    );
    raw
}

/// For each vertex the sum of its triangles' normals, by area; nothing for points and lines.
fn triangle_normals(primitive: &Primitive) -> Vec<DVec3> {
    if primitive.topology != Topology::Triangles {
        return Vec::new();
    }
    let mut sums = vec![DVec3::ZERO; primitive.positions.len()];
    for corners in primitive.indices.as_chunks::<3>().0 {
        let [a, b, c] = corners.map(|i| DVec3::from_array(primitive.positions[i as usize].map(f64::from)));
        let normal = (b - a).cross(c - a);
        for &corner in corners {
            sums[corner as usize] += normal;
        }
    }
    sums
}

/// Makes tangents unit vectors with a handedness of ±1; leaves out all when one has no direction.
pub(super) fn tangents(mut raw: Vec<[f32; 4]>, (defects, place): (&mut Defects, &str)) -> Vec<[f32; 4]> {
    for tangent in &mut raw {
        let [x, y, z, w] = *tangent;
        let Some(([x, y, z], _)) = direction([x, y, z]) else {
            defects.note(
                "tangents without a direction: all of the primitive's left out",
                1,
                || place.to_owned(),
            );
            return Vec::new();
        };
        *tangent = [x, y, z, if w < 0.0 { -1.0 } else { 1.0 }];
    }
    raw
}

/// Makes texture coordinates finite, and those that are beyond all pictures zero.
pub(super) fn uvs(mut raw: Vec<[f32; 2]>, (defects, place): (&mut Defects, &str)) -> Vec<[f32; 2]> {
    let [endless, large] = mend(&mut raw, 0.0);
    let place = || place.to_owned();
    defects.note("texture coordinate that is not finite: set to zero", endless, place);
    defects.note("texture coordinate beyond 1000000: set to zero", large, place);
    raw
}

/// Makes colours finite, and those that are brighter than any light one.
pub(super) fn colors(mut raw: Vec<[f32; 4]>, (defects, place): (&mut Defects, &str)) -> Vec<[f32; 4]> {
    let [endless, large] = mend(&mut raw, 1.0);
    let place = || place.to_owned();
    defects.note("colour that is not finite: set to one", endless, place);
    defects.note("colour beyond 1000000: set to one", large, place);
    raw
}

/// Replaces numbers that are not finite, and those that are too large; how many there were of each.
fn mend<const N: usize>(values: &mut [[f32; N]], mended: f32) -> [u64; 2] {
    let mut changed = [0; 2];
    for number in values.as_flattened_mut() {
        if !number.is_finite() {
            changed[0] += 1;
        } else if number.abs() > MOST {
            changed[1] += 1;
        } else {
            continue;
        }
        *number = mended;
    }
    changed
}

/// The unit vector and the length of a vector, unless it has none.
pub(super) fn direction(vector: [f32; 3]) -> Option<([f32; 3], f64)> {
    let vector = Vec3::from_array(vector).as_dvec3();
    let length = vector.length();
    // Below this a length is rounding noise of stored zeros.
    (length.is_finite() && length > 1e-12).then(|| ((vector / length).as_vec3().to_array(), length))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn triangle() -> Primitive {
        Primitive {
            positions: vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
            indices: vec![0, 1, 2],
            ..Primitive::default()
        }
    }

    #[test]
    fn a_long_normal_is_made_unit_and_one_without_direction_comes_from_its_triangle() {
        let mut defects = Defects::default();
        let raw = vec![[0.0, 0.0, 4.0], [f32::NAN; 3], [0.0; 3]];
        let normals = normals(raw, &triangle(), (&mut defects, "p"));
        assert_eq!(normals, [[0.0, 0.0, 1.0]; 3]);
        assert_eq!(defects.count("normal that is not of unit length: made so"), 1);
        assert_eq!(defects.count("normal without a direction: taken from its triangles"), 2);
    }

    #[test]
    fn normals_of_points_without_direction_are_left_out() {
        let points = Primitive {
            topology: Topology::Points,
            ..triangle()
        };
        let mut defects = Defects::default();
        assert!(normals(vec![[0.0; 3]; 3], &points, (&mut defects, "p")).is_empty());
        assert_eq!(defects.iter().count(), 1);
    }

    #[test]
    fn tangents_keep_their_handedness() {
        let mut defects = Defects::default();
        let raw = vec![[2.0, 0.0, 0.0, -0.5], [0.0, 1.0, 0.0, 1.0]];
        let tangents = tangents(raw, (&mut defects, "p"));
        assert_eq!(tangents, [[1.0, 0.0, 0.0, -1.0], [0.0, 1.0, 0.0, 1.0]]);
    }

    #[test]
    fn infinite_numbers_become_finite() {
        let mut defects = Defects::default();
        assert_eq!(uvs(vec![[f32::INFINITY, 0.5]], (&mut defects, "p")), [[0.0, 0.5]]);
        assert_eq!(
            colors(vec![[f32::NAN, 0.0, 0.0, 1.0]], (&mut defects, "p")),
            [[1.0, 0.0, 0.0, 1.0]]
        );
        assert_eq!(defects.iter().map(|d| d.count).sum::<u64>(), 2);
    }

    #[test]
    fn numbers_that_mean_nothing_are_replaced_and_told() {
        let mut defects = Defects::default();
        let raw = vec![[1e30, 0.5], [-2e6, 1e6], [f32::NAN, -0.5]];
        let mended = [[0.0, 0.5], [0.0, 1e6], [0.0, -0.5]];
        assert_eq!(uvs(raw, (&mut defects, "p")), mended);
        assert_eq!(defects.count("texture coordinate beyond 1000000: set to zero"), 2);
        assert_eq!(defects.count("texture coordinate that is not finite: set to zero"), 1);
        let raw = vec![[50.0, 1e30, 0.0, 1.0]];
        assert_eq!(colors(raw, (&mut defects, "p")), [[50.0, 1.0, 0.0, 1.0]]);
        assert_eq!(defects.count("colour beyond 1000000: set to one"), 1);
    }
}
