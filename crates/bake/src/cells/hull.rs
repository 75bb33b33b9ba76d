//! Which convex polyhedron do half-spaces leave? Clips a box by one after the other (Sutherland & Hodgman, *Reentrant
//! polygon clipping*, 1974) and closes each cut with a polygon.
//!
//! World space, metres, f64; the arithmetic is done relative to the middle of the polyhedron.

use belvedere_scene::{Bounds, convex::HalfSpace, record::Hull};
use glam::DVec3;

/// Points nearer to a plane than this share of the polyhedron's size lie on it.
const ON_PLANE: f64 = 1e-9;

/// A convex polyhedron that is not an axis-aligned box.
#[derive(Debug, Clone, PartialEq)]
pub struct CellHull {
    /// Half-spaces whose common part it is, one for each face.
    pub planes: Vec<HalfSpace>,
    /// Its corners and faces, in the order of `planes`, counter-clockwise seen from outside.
    pub shape: Hull,
}

/// A face under construction: which half-space it lies on, `None` for a side of the box, and its corners.
type Face = (Option<usize>, Vec<DVec3>);

pub(super) fn normal(half: &HalfSpace) -> DVec3 {
    DVec3::new(half[0], half[1], half[2])
}

impl CellHull {
    /// What half-spaces leave of a box. `Err` when that is nothing, or when a side of the box is left, which means that
    /// the half-spaces do not close it.
    pub(super) fn of(planes: &[HalfSpace], within: &Bounds) -> Result<Self, Unbounded> {
        let middle = DVec3::from(within.center());
        let near = ON_PLANE * within.diagonal_m();
        let mut faces: Vec<Face> = box_faces(within)
            .map(|corners| (None, corners.map(|c| c - middle).to_vec()))
            .into();
        for (index, half) in planes.iter().enumerate() {
            clip(
                &mut faces,
                index,
                normal(half),
                half[3] - normal(half).dot(middle),
                near,
            );
        }
        if faces.len() < 4 {
            return Err(Unbounded::Nothing);
        }
        if faces.iter().any(|(plane, _)| plane.is_none()) {
            return Err(Unbounded::Open);
        }
        faces.sort_by_key(|(plane, _)| *plane);
        let mut points: Vec<DVec3> = Vec::new();
        let mut hull = Self {
            planes: Vec::with_capacity(faces.len()),
            shape: Hull {
                points: Vec::new(),
                faces: Vec::with_capacity(faces.len()),
            },
        };
        let mut exact: Vec<[Option<f64>; 3]> = Vec::new();
        for (plane, corners) in faces {
            let half = planes[plane.unwrap_or_default()];
            let mut face: Vec<u32> = Vec::with_capacity(corners.len());
            for corner in corners {
                let known = points.iter().position(|p| p.distance(corner) <= 16.0 * near);
                let at = known.unwrap_or_else(|| {
                    points.push(corner);
                    exact.push([None; 3]);
                    points.len() - 1
                });
                for axis in (0..3).filter(|axis| half[*axis].abs() == 1.0) {
                    exact[at][axis] = Some(half[3] * half[axis]);
                }
                if !face.contains(&(at as u32)) {
                    face.push(at as u32);
                }
            }
            if face.len() >= 3 {
                hull.planes.push(half);
                hull.shape.faces.push(face);
            }
        }
        // Where a face is axis-aligned, neighbours share the coordinate to the last bit.
        let place = |(point, exact): (&DVec3, &[Option<f64>; 3])| {
            let point = (*point + middle).to_array();
            [0, 1, 2].map(|axis| exact[axis].unwrap_or(point[axis]))
        };
        hull.shape.points = points.iter().zip(&exact).map(place).collect();
        if hull.planes.len() < 4 {
            Err(Unbounded::Nothing)
        } else {
            Ok(hull)
        }
    }

    /// The box around it.
    #[must_use]
    pub fn bounds(&self) -> Bounds {
        Bounds::around(self.shape.points.iter().copied())
    }

    /// How thick it is between its faces and what lies farthest behind them, where that is least.
    #[must_use]
    pub fn thickness_m(&self) -> f64 {
        let points = self.shape.points.iter().map(|point| DVec3::from(*point));
        let behind = |half: &HalfSpace| {
            points
                .clone()
                .map(|p| half[3] - normal(half).dot(p))
                .fold(0.0, f64::max)
        };
        self.planes.iter().map(behind).fold(f64::INFINITY, f64::min)
    }

    /// The corners of a face.
    pub fn corners_of(&self, face: usize) -> impl Iterator<Item = DVec3> + '_ {
        self.shape.faces[face]
            .iter()
            .map(|i| DVec3::from(self.shape.points[*i as usize]))
    }

    /// Directions of its edges, each once for each of its two faces or less.
    pub(super) fn edges(&self) -> Vec<DVec3> {
        let mut edges: Vec<DVec3> = Vec::new();
        for face in 0..self.shape.faces.len() {
            let corners: Vec<_> = self.corners_of(face).collect();
            for (i, a) in corners.iter().enumerate() {
                let along = (corners[(i + 1) % corners.len()] - *a).normalize_or_zero();
                let known = |edge: &DVec3| edge.cross(along).length() < 1e-9;
                if along != DVec3::ZERO && !edges.iter().any(known) {
                    edges.push(along);
                }
            }
        }
        edges
    }
}

/// Why half-spaces are no polyhedron.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Unbounded {
    /// No point lies in all of them, or only those of a plane.
    Nothing,
    /// They leave a side open.
    Open,
}

/// The sides of a box, counter-clockwise seen from outside.
fn box_faces(bounds: &Bounds) -> [[DVec3; 4]; 6] {
    let corners = bounds.corners().map(DVec3::from);
    let faces = [
        [0, 4, 6, 2],
        [1, 3, 7, 5],
        [0, 1, 5, 4],
        [2, 6, 7, 3],
        [0, 2, 3, 1],
        [4, 5, 7, 6],
    ];
    faces.map(|face: [usize; 4]| face.map(|i| corners[i]))
}

/// Cuts off what lies outside a half-space `normal · p ≤ offset`.
fn clip(faces: &mut Vec<Face>, index: usize, normal: DVec3, offset: f64, near: f64) {
    let height = |p: &DVec3| normal.dot(*p) - offset;
    if faces.iter().flat_map(|(_, corners)| corners).all(|p| height(p) <= near) {
        return;
    }
    let mut cap: Vec<DVec3> = Vec::new();
    let mut add = |point: DVec3| {
        if !cap.iter().any(|known| known.distance(point) <= 8.0 * near) {
            cap.push(point);
        }
    };
    for (_, corners) in faces.iter_mut() {
        *corners = clipped(corners, &height, near);
        corners.iter().filter(|p| height(p).abs() <= near).for_each(|p| add(*p));
    }
    faces.retain(|(_, corners)| corners.len() >= 3 && corners.iter().any(|p| height(p) < -near));
    if cap.len() >= 3 && !faces.is_empty() {
        let middle = cap.iter().sum::<DVec3>() / cap.len() as f64;
        let (u, v) = normal.any_orthonormal_pair();
        // glam's pair is right-handed with the normal in some order; the angle runs counter-clockwise about it.
        let turn = if u.cross(v).dot(normal) > 0.0 { v } else { -v };
        let angle = |p: &DVec3| (*p - middle).dot(turn).atan2((*p - middle).dot(u));
        cap.sort_by(|a, b| angle(a).total_cmp(&angle(b)));
        faces.push((Some(index), cap));
    }
}

/// The part of a convex polygon where a height is not positive. Points within `near` of zero lie on the plane.
pub(crate) fn clipped(polygon: &[DVec3], height: &impl Fn(&DVec3) -> f64, near: f64) -> Vec<DVec3> {
    let mut kept = Vec::with_capacity(polygon.len() + 1);
    for (i, a) in polygon.iter().enumerate() {
        let b = &polygon[(i + 1) % polygon.len()];
        let (at_a, at_b) = (height(a), height(b));
        if at_a <= near {
            kept.push(*a);
        }
        if (at_a > near && at_b < -near) || (at_a < -near && at_b > near) {
            // From the inside out, so that both faces at an edge get the same point.
            let (inner, outer, at_inner, at_outer) = if at_a < at_b {
                (a, b, at_a, at_b)
            } else {
                (b, a, at_b, at_a)
            };
            kept.push(inner.lerp(*outer, at_inner / (at_inner - at_outer)));
        }
    }
    kept
}

/// The area of a plane convex polygon, in m².
pub(super) fn area_m2(polygon: &[DVec3]) -> f64 {
    let Some((first, rest)) = polygon.split_first() else {
        return 0.0;
    };
    let doubled: DVec3 = rest
        .windows(2)
        .map(|pair| (pair[0] - *first).cross(pair[1] - *first))
        .sum();
    0.5 * doubled.length()
}

/// The convex outline of points in a plane, counter-clockwise about its normal (Andrew's monotone chain, 1979).
pub(super) fn convex_outline(points: &[DVec3], n: DVec3) -> Vec<DVec3> {
    let (u, v) = n.any_orthonormal_pair();
    let v = if u.cross(v).dot(n) > 0.0 { v } else { -v };
    let mut sorted = points.to_vec();
    sorted.sort_by(|a, b| a.dot(u).total_cmp(&b.dot(u)).then(a.dot(v).total_cmp(&b.dot(v))));
    sorted.dedup();
    let chain = |points: &mut dyn Iterator<Item = &DVec3>| {
        let mut chain: Vec<DVec3> = Vec::new();
        for point in points {
            while let [.., a, b] = chain[..]
                && (b - a).cross(*point - b).dot(n) <= 0.0
            {
                chain.pop();
            }
            chain.push(*point);
        }
        chain.pop();
        chain
    };
    let mut outline = chain(&mut sorted.iter());
    outline.extend(chain(&mut sorted.iter().rev()));
    outline
}

#[cfg(test)]
mod tests {
    use super::*;

    fn around(min: [f64; 3], max: [f64; 3]) -> Bounds {
        Bounds { min, max }
    }

    #[test]
    fn a_corner_cut_off_a_box_leaves_seven_faces_that_look_outwards() {
        let mut planes = Vec::new();
        for axis in 0..3 {
            let mut half = [0.0; 4];
            (half[axis], half[3]) = (1.0, 2.0);
            planes.push(half);
            let mut half = [0.0; 4];
            half[axis] = -1.0;
            planes.push(half);
        }
        let third = 1.0 / 3.0f64.sqrt();
        planes.push([third, third, third, 5.0 * third]);
        let hull = CellHull::of(&planes, &around([-1.0; 3], [3.0; 3])).unwrap();
        assert_eq!((hull.shape.faces.len(), hull.shape.points.len()), (7, 10));
        let middle = DVec3::splat(1.0);
        for (face, half) in hull.planes.iter().enumerate() {
            let corners: Vec<_> = hull.corners_of(face).collect();
            let doubled = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
            assert!(doubled.dot(corners[0] - middle) > 0.0, "face {face} looks inwards");
            assert!(corners.iter().all(|p| (normal(half).dot(*p) - half[3]).abs() < 1e-9));
        }
        let cut = hull.planes.iter().position(|half| half[0] == third).unwrap();
        let corners: Vec<_> = hull.corners_of(cut).collect();
        assert!((area_m2(&corners) - 3.0f64.sqrt() / 2.0).abs() < 1e-9);
    }

    #[test]
    fn half_spaces_that_leave_a_side_open_or_nothing_are_told_apart() {
        let open = CellHull::of(&[[1.0, 0.0, 0.0, 0.0]], &around([-1.0; 3], [1.0; 3]));
        assert_eq!(open, Err(Unbounded::Open));
        let nothing = CellHull::of(&[[1.0, 0.0, 0.0, -2.0]], &around([-1.0; 3], [1.0; 3]));
        assert_eq!(nothing, Err(Unbounded::Nothing));
    }
}
