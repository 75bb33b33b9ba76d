//! What is covered in a plane? Convex polygons: where ways cross it, and what triangles leave of them.

use glam::{DVec2, DVec3};

/// A plane with axes of its own.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Plane {
    normal: DVec3,
    offset: f64,
    axes: [DVec3; 2],
}

impl Plane {
    /// That of a unit normal, so far from zero.
    pub(crate) fn new((normal, offset): (DVec3, f64)) -> Self {
        let axis = normal.any_orthonormal_vector();
        Self {
            normal,
            offset,
            axes: [axis, normal.cross(axis)],
        }
    }

    /// How far a point is in front of it.
    pub(crate) fn height(&self, point: DVec3) -> f64 {
        self.normal.dot(point) - self.offset
    }

    /// Whether another one is the same and looks the same way.
    pub(crate) fn is_like(&self, other: &Self, slack: f64, slack_m: f64) -> bool {
        self.normal.dot(other.normal) > 1.0 - slack && (self.offset - other.offset).abs() <= slack_m
    }

    pub(crate) fn flat(&self, point: DVec3) -> DVec2 {
        DVec2::new(self.axes[0].dot(point), self.axes[1].dot(point))
    }

    pub(crate) fn raised(&self, point: DVec2) -> DVec3 {
        self.offset * self.normal + point.x * self.axes[0] + point.y * self.axes[1]
    }
}

/// The area of a convex polygon.
pub(crate) fn area(polygon: &[DVec2]) -> f64 {
    let next = polygon.iter().cycle().skip(1);
    let twice: f64 = polygon.iter().zip(next).map(|(a, b)| a.perp_dot(*b)).sum();
    0.5 * twice.abs()
}

/// Where ways between corners cross a plane; both ends of those that run along it.
pub(crate) fn crossings(near: &[DVec3], far: &[DVec3], height: &dyn Fn(&DVec3) -> f64, slack_m: f64) -> Vec<DVec3> {
    let cross = |a: &DVec3, b: &DVec3| {
        let falls_m = height(a) - height(b);
        if falls_m.abs() <= slack_m {
            vec![*a, *b]
        } else {
            vec![a.lerp(*b, (height(a) / falls_m).clamp(0.0, 1.0))]
        }
    };
    near.iter()
        .flat_map(|a| far.iter().flat_map(move |b| cross(a, b)))
        .collect()
}

/// The convex hull, counter-clockwise (Andrew, *Another Efficient Algorithm for Convex Hulls in Two Dimensions*, 1979).
pub(crate) fn hull(mut points: Vec<DVec2>) -> Vec<DVec2> {
    points.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    let chain = |points: &mut dyn Iterator<Item = DVec2>| {
        let mut chain: Vec<DVec2> = Vec::new();
        for point in points {
            while let [.., a, b] = chain[..]
                && (b - a).perp_dot(point - a) <= 0.0
            {
                chain.pop();
            }
            chain.push(point);
        }
        chain.pop();
        chain
    };
    let mut lower = chain(&mut points.iter().copied());
    lower.extend(chain(&mut points.iter().rev().copied()));
    lower
}

/// What a triangle, grown by the slack, leaves of a convex polygon.
pub(crate) fn without(piece: &[DVec2], triangle: &[DVec2; 3], slack_m: f64) -> Vec<Vec<DVec2>> {
    let mut left = Vec::new();
    let mut inside = piece.to_vec();
    for i in 0..3 {
        let (from, to) = (triangle[i], triangle[(i + 1) % 3]);
        let inward = (to - from).perp().normalize_or_zero();
        let depth = |point: DVec2| inward.dot(point - from) + slack_m;
        left.push(cut(&inside, &|point| -depth(point)));
        inside = cut(&inside, &depth);
    }
    if inside.len() < 3 {
        // It is not met at all.
        return vec![piece.to_vec()];
    }
    left.retain(|piece| piece.len() >= 3);
    left
}

/// What of a convex polygon has a height above zero.
fn cut(polygon: &[DVec2], height: &dyn Fn(DVec2) -> f64) -> Vec<DVec2> {
    let mut kept = Vec::with_capacity(polygon.len() + 1);
    for (i, a) in polygon.iter().enumerate() {
        let b = polygon[(i + 1) % polygon.len()];
        let (at_a, at_b) = (height(*a), height(b));
        if at_a > 0.0 {
            kept.push(*a);
        }
        if (at_a > 0.0) != (at_b > 0.0) {
            kept.push(a.lerp(b, at_a / (at_a - at_b)));
        }
    }
    kept
}
