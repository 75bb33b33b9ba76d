//! Which walls stop a sight line?
//!
//! Coplanar faces of a whole town make one wall, so the tree holds the pieces of walls ([`Wall::pieces`]) instead. What a
//! piece needs to turn a sight line away stands in the order of the tree's leaves: most are turned away without a look
//! at the wall's own grid.

use std::{ops::ControlFlow, sync::Arc};

use glam::{Vec2, Vec3};
use obvhs::bvh2::Bvh2;

use super::segment;
use crate::occluders::{Rectangle, Tolerance, Wall, Way};

/// Walls are looked for among so many of their pieces from either end of a sight line.
const PIECES_MET: usize = 96;

/// The walls of a scene, ready for sight lines.
pub(super) struct Stops {
    walls: Vec<Arc<Wall>>,
    tree: Bvh2,
    /// By the leaves of the tree.
    pieces: Vec<Piece>,
}

/// A rectangle of a wall: outside of all of them nothing is opaque.
struct Piece {
    plane: Plane,
    rectangle: Rectangle,
    wall: u32,
    /// Whether the wall hides anything, by [`Way`].
    hides: [bool; 2],
}

#[derive(Clone, Copy)]
struct Plane {
    normal: Vec3,
    offset: f32,
    axes: [Vec3; 2],
}

impl Plane {
    fn of(wall: &Wall) -> Self {
        Self {
            normal: wall.normal,
            offset: wall.offset,
            axes: wall.axes,
        }
    }

    /// Which way, and where, a segment crosses it.
    fn crosses(&self, from: Vec3, to: Vec3) -> Option<(Way, Vec2)> {
        let [a, b] = [from, to].map(|p| self.normal.dot(p) - self.offset);
        let way = if a > 0.0 { Way::Against } else { Way::Along };
        let place = || {
            let at = from.lerp(to, a / (a - b));
            Vec2::new(self.axes[0].dot(at), self.axes[1].dot(at))
        };
        (a * b < 0.0).then(|| (way, place()))
    }
}

impl Stops {
    pub(super) fn of(walls: &[Arc<Wall>], tolerance: Tolerance) -> Self {
        let mut pieces: Vec<Piece> = Vec::new();
        let mut boxes = Vec::new();
        for (number, wall) in (0u32..).zip(walls) {
            for (rectangle, around) in wall.pieces() {
                boxes.push(around);
                pieces.push(Piece {
                    plane: Plane::of(wall),
                    rectangle,
                    wall: number,
                    hides: [Way::Against, Way::Along].map(|way| wall.hides(way)),
                });
            }
        }
        let mut tree = segment::tree(boxes.into_iter(), tolerance.plane_m);
        let mut pieces: Vec<_> = pieces.into_iter().map(Some).collect();
        let in_order = (0u32..).zip(&mut tree.primitive_indices);
        let pieces = in_order.filter_map(|(place, number)| pieces[std::mem::replace(number, place) as usize].take());
        Self {
            walls: walls.to_vec(),
            pieces: pieces.collect(),
            tree,
        }
    }

    /// Visits walls that stop a segment, of doors all, as if they were closed: those near its first end, nearest to that first,
    /// then, if a path along it leads past more than [`PIECES_MET`] pieces of walls, those near its other end. Some are visited
    /// twice. What stands far from both ends hides little that these do not, and there may be a whole town of it.
    pub(super) fn on(&self, from: Vec3, to: Vec3, visit: &mut dyn FnMut(u32) -> ControlFlow<()>) {
        for [here, there] in [[from, to], [to, from]] {
            let mut pieces_left = PIECES_MET;
            let mut flow = ControlFlow::Continue(());
            segment::along(&self.tree, here, there, &mut |place| {
                if pieces_left == 0 {
                    return ControlFlow::Break(());
                }
                pieces_left -= 1;
                let piece = &self.pieces[place as usize];
                if let Some((way, place)) = piece.plane.crosses(from, to)
                    && piece.hides[way as usize]
                    && holds(&piece.rectangle, place)
                    && self.walls[piece.wall as usize].opaque_at(way, place)
                {
                    flow = visit(piece.wall);
                }
                flow
            });
            if pieces_left > 0 || flow.is_break() {
                return;
            }
        }
    }

    /// Visits walls that hide something in the direction of a segment, and that it meets within their grids, be it in an
    /// opening; some of them twice.
    pub(super) fn met(&self, from: Vec3, to: Vec3, visit: &mut dyn FnMut(u32)) {
        segment::along(&self.tree, from, to, &mut |place| {
            let piece = &self.pieces[place as usize];
            if let Some((way, place)) = piece.plane.crosses(from, to)
                && piece.hides[way as usize]
                && self.walls[piece.wall as usize].reaches(place)
            {
                visit(piece.wall);
            }
            ControlFlow::Continue(())
        });
    }
}

/// Whether a segment ends on a wall.
pub(super) fn stops(wall: &Wall, from: Vec3, to: Vec3) -> bool {
    let crossed = Plane::of(wall).crosses(from, to);
    crossed.is_some_and(|(way, place)| wall.opaque_at(way, place))
}

fn holds(rectangle: &Rectangle, place: Vec2) -> bool {
    (0..2).all(|axis| rectangle[axis][0] <= place[axis] && place[axis] <= rectangle[axis][1])
}
