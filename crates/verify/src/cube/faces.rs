//! Which way do the six faces look, and which of them does a triangle touch?

use glam::{DVec3, Vec3};

/// A face of the cube: three axes of the world, each with a sign.
#[derive(Debug, Clone, Copy)]
pub struct Face {
    right: (usize, f32),
    up: (usize, f32),
    forward: (usize, f32),
    /// For people.
    pub name: &'static str,
}

const X: usize = 0;
const Y: usize = 1;
const Z: usize = 2;

const fn face(name: &'static str, right: (usize, f32), up: (usize, f32), forward: (usize, f32)) -> Face {
    Face {
        right,
        up,
        forward,
        name,
    }
}

/// The faces; none shows the world mirrored.
pub const FACES: [Face; 6] = [
    face("+X", (Z, 1.0), (Y, 1.0), (X, 1.0)),
    face("-X", (Z, -1.0), (Y, 1.0), (X, -1.0)),
    face("+Y", (X, 1.0), (Z, 1.0), (Y, 1.0)),
    face("-Y", (X, 1.0), (Z, -1.0), (Y, -1.0)),
    face("+Z", (X, -1.0), (Y, 1.0), (Z, 1.0)),
    face("-Z", (X, 1.0), (Y, 1.0), (Z, -1.0)),
];

impl Face {
    /// A point as the face sees it: to the right, up, and forward.
    pub(super) fn view(&self, p: Vec3) -> Vec3 {
        let along = |(axis, sign): (usize, f32)| sign * p[axis];
        Vec3::new(along(self.right), along(self.up), along(self.forward))
    }

    /// Where on the face a direction points: to the right and up, from −1 to 1; `None` when at another face.
    pub(super) fn point(&self, direction: DVec3) -> Option<(f64, f64)> {
        let along = |(axis, sign): (usize, f32)| f64::from(sign) * direction[axis];
        let ahead = along(self.forward);
        let (right, up) = (along(self.right) / ahead, along(self.up) / ahead);
        (ahead > 0.0 && right.abs() <= 1.0 && up.abs() <= 1.0).then_some((right, up))
    }

    /// The direction in which a point of the face lies; `right` and `up` run from −1 to 1.
    pub(super) fn direction(&self, right: f64, up: f64) -> DVec3 {
        let mut direction = DVec3::ZERO;
        for ((axis, sign), value) in [(self.right, right), (self.up, up), (self.forward, 1.0)] {
            direction[axis] = f64::from(sign) * value;
        }
        direction
    }
}

/// The face through which a point is seen.
pub(super) fn face_of(p: Vec3) -> u8 {
    let size = p.abs();
    let (axis, along) = if size.x >= size.y && size.x >= size.z {
        (X, p.x)
    } else if size.y >= size.z {
        (Y, p.y)
    } else {
        (Z, p.z)
    };
    2 * axis as u8 + u8::from(along < 0.0)
}

/// The faces that a triangle may touch, given the face of each corner: never too few.
pub(super) fn touched(corners: [(Vec3, u8); 3]) -> impl Iterator<Item = usize> {
    // The pyramid of a face is convex: what has all its corners in it lies in it. A corner between two pyramids belongs
    // to both, but there a triangle is seen edge on, or has other corners to tell.
    let [a, b, c] = corners.map(|(_, face)| usize::from(face));
    let alone = a == b && b == c;
    let points = corners.map(|(corner, _)| corner);
    let faces = if alone { a..a + 1 } else { 0..6 };
    faces.filter(move |face| alone || may_touch(*face, points))
}

fn may_touch(face: usize, corners: [Vec3; 3]) -> bool {
    let views = corners.map(|p| FACES[face].view(p));
    let beyond: [fn(&Vec3) -> bool; 5] = [
        |p| p.z < 0.0,
        |p| p.x > p.z,
        |p| p.x < -p.z,
        |p| p.y > p.z,
        |p| p.y < -p.z,
    ];
    !beyond.iter().any(|outside| views.iter().all(outside))
}
