//! What does the building look like from outside? Façades with a plinth and a string course, roofs with a parapet, lawn.
//!
//! The roofscape is a height for each tile; a face stands wherever neighbours differ. Rooms under glass or open sky have
//! no roof tile of their own.

use super::finish::Finish;
use super::layout::{Layout, Tile};
use super::legend::{Ceiling, Facing};
use super::mesh::Mesh;
use super::rng::noise;
use super::run::{Moulding, Run, runs_towards};
use super::{Plan, SceneBuilder};
use glam::Vec3;

const FACADE: Finish = Finish::matt("façade", 0xd8c8a8).gloss(0.9);
const ROOF: Finish = Finish::matt("roof", 0x6f7a78).gloss(0.8);
const LAWN: Finish = Finish::matt("lawn", 0xffffff).gloss(1.0);
const GROUND_M: f32 = -0.15;
/// From a ceiling to the roof above it.
const ROOF_M: f32 = 0.35;
const PARAPET_M: f32 = 0.55;
const LAWN_MARGIN_M: f32 = 40.0;

struct Roofscape<'a> {
    plan: &'a Plan,
    layout: &'a Layout,
}

impl Roofscape<'_> {
    fn roof_of_room(&self, column: isize, row: isize) -> Option<f32> {
        match self.layout.tile(column, row) {
            Tile::Room(room) => Some(self.layout.room_height_m[room] + ROOF_M),
            _ => None,
        }
    }

    fn is_uncovered(&self, column: isize, row: isize) -> bool {
        match self.layout.tile(column, row) {
            Tile::Room(room) => matches!(self.plan.rooms[room].style.ceiling, Ceiling::Glass | Ceiling::Open),
            _ => false,
        }
    }

    /// Height of what covers a tile, metres.
    fn top(&self, column: isize, row: isize) -> f32 {
        match self.layout.tile(column, row) {
            Tile::Outdoors => GROUND_M,
            Tile::Room(room) => {
                let covered = if self.is_uncovered(column, row) { 0.0 } else { ROOF_M };
                self.layout.room_height_m[room] + covered
            }
            Tile::Wall | Tile::Opening(_) => {
                let around = || (-1..=1).flat_map(|dy| (-1..=1).map(move |dx| (column + dx, row + dy)));
                let highest = around()
                    .filter_map(|(c, r)| self.roof_of_room(c, r))
                    .fold(0.0, f32::max);
                let at_edge = around().any(|(c, r)| self.layout.tile(c, r) == Tile::Outdoors);
                let highest = if highest > 0.0 { highest } else { 3.0 + ROOF_M };
                if at_edge { highest + PARAPET_M } else { highest }
            }
        }
    }
}

/// Adds façades, roofs and the ground.
pub(super) fn build_outside(plan: &Plan, builder: &mut SceneBuilder) {
    let layout = &plan.layout;
    let roofs = Roofscape { plan, layout };
    // One tile of open ground all around belongs to the outside.
    let extent = [-1, -1, layout.columns as isize, layout.rows as isize];
    let outdoors = |c: isize, r: isize| layout.tile(c, r) == Tile::Outdoors;
    let tops: Vec<f32> = (0..layout.tiles.len())
        .map(|at| roofs.top((at % layout.columns) as isize, (at / layout.columns) as isize))
        .collect();
    let top = |c: isize, r: isize| match layout.tile(c, r) {
        Tile::Outdoors => GROUND_M,
        _ => tops[r as usize * layout.columns + c as usize],
    };
    let facades: Vec<Vec<Run>> = Facing::ALL.map(|f| runs_towards(layout, extent, f, outdoors)).into();
    let lowest_top = facades
        .iter()
        .flatten()
        .flat_map(|run| &run.behind)
        .map(|&(c, r)| top(c, r))
        .fold(f32::MAX, f32::min);
    for (towards, runs) in Facing::ALL.into_iter().zip(&facades) {
        let mut mesh = Mesh::new();
        for run in runs {
            facade(&mut mesh, run, layout, &top, lowest_top);
        }
        builder.place_once(format!("Outside/{} front", towards.opposite().word()), mesh);
    }
    let mut mesh = Mesh::new();
    for towards in Facing::ALL {
        let (dx, dy) = towards.step();
        for (run, (from, to), (low, high)) in steps(layout, towards, |c, r| {
            let (low, high) = (top(c, r), top(c + dx, r + dy));
            (!outdoors(c, r) && !outdoors(c + dx, r + dy) && high > low + 1e-3).then_some((low, high))
        }) {
            let (start, end) = run.span(from, to);
            let corners = [(start, low), (end, low), (end, high), (start, high)];
            mesh.polygon(&FACADE, &corners.map(|(u, y)| run.point(u, y, 0.0)));
        }
    }
    for ([c0, r0, c1, r1], height) in rectangles(layout, |c, r| {
        (!outdoors(c, r) && !roofs.is_uncovered(c, r)).then(|| top(c, r))
    }) {
        let [x0, z0, x1, z1] = [c0, r0, c1, r1].map(|i| i as f32 * layout.tile_m);
        mesh.polygon(
            &ROOF,
            &[(x0, z1), (x1, z1), (x1, z0), (x0, z0)].map(|(x, z)| Vec3::new(x, height, z)),
        );
    }
    builder.place_once("Outside/roof".to_owned(), mesh);
    builder.place_once("Outside/ground".to_owned(), ground(layout));
}

fn facade(mesh: &mut Mesh, run: &Run, layout: &Layout, top: &impl Fn(isize, isize) -> f32, lowest_top: f32) {
    let groups = run.grouped(|c, r| {
        let opening = match layout.tile(c, r) {
            Tile::Opening(opening) => Some(opening),
            _ => None,
        };
        (opening, top(c, r))
    });
    for ((opening, high), from, to) in groups {
        let (start, end) = run.span(from, to);
        let mut rise = |low: f32, high: f32| {
            if high > low + 1e-3 {
                let corners = [(start, low), (end, low), (end, high), (start, high)];
                mesh.polygon(&FACADE, &corners.map(|(u, y)| run.point(u, y, 0.0)));
            }
        };
        match opening {
            Some(opening) => {
                rise(GROUND_M, layout.openings[opening].bottom_m);
                rise(layout.openings[opening].top_m, high);
            }
            None => rise(GROUND_M, high),
        }
    }
    let plinth = [(0.1, GROUND_M), (0.1, 0.42), (0.04, 0.5), (0.0, 0.5)];
    let moulding = Moulding {
        profile: &plinth,
        from_m: 0.0,
        to_m: 0.5,
        colour: [0.6, 0.58, 0.54],
    };
    run.moulding(mesh, &FACADE, layout, &moulding);
    let y = lowest_top - PARAPET_M - 0.1;
    let course = [
        (0.0, y - 0.2),
        (0.12, y - 0.08),
        (0.12, y),
        (0.2, y + 0.06),
        (0.2, y + 0.14),
        (0.0, y + 0.16),
    ];
    let moulding = Moulding {
        profile: &course,
        from_m: y - 0.2,
        to_m: y + 0.16,
        colour: [0.88, 0.87, 0.84],
    };
    run.moulding(mesh, &FACADE, layout, &moulding);
}

/// Faces between tiles of different heights, gathered along each line: (low, high) for the lower tile of each.
fn steps(
    layout: &Layout,
    towards: Facing,
    step: impl Fn(isize, isize) -> Option<(f32, f32)>,
) -> Vec<(Run, (usize, usize), (f32, f32))> {
    let extent = [0, 0, layout.columns as isize - 1, layout.rows as isize - 1];
    let (dx, dy) = towards.step();
    let mut faces = Vec::new();
    // Lines of one parity at a time: a step may lead up to a tile from which the next step rises.
    for parity in [0, 1] {
        let inside = |c: isize, r: isize| (c * dx.abs() + r * dy.abs()) & 1 == parity && step(c, r).is_some();
        for run in runs_towards(layout, extent, towards, inside) {
            for (kind, from, to) in run.grouped(|c, r| step(c - dx, r - dy)) {
                faces.extend(kind.map(|kind| (run.clone(), (from, to), kind)));
            }
        }
    }
    faces
}

/// Disjoint rectangles of equal value that cover the drawing: first column and row, one past the last ones.
fn rectangles(layout: &Layout, value: impl Fn(isize, isize) -> Option<f32>) -> Vec<([isize; 4], f32)> {
    let (columns, rows) = (layout.columns as isize, layout.rows as isize);
    let mut open: Vec<([isize; 4], f32)> = Vec::new();
    let mut done = Vec::new();
    for row in 0..rows {
        let mut next: Vec<([isize; 4], f32)> = Vec::new();
        let mut column = 0;
        while column < columns {
            let from = column;
            let height = value(column, row);
            while column < columns && value(column, row) == height {
                column += 1;
            }
            let Some(height) = height else { continue };
            let above = open
                .iter()
                .position(|(r, h)| r[0] == from && r[2] == column && *h == height);
            let first_row = above.map_or(row, |i| open.swap_remove(i).0[1]);
            next.push(([from, first_row, column, row + 1], height));
        }
        done.append(&mut open);
        open = next;
    }
    done.append(&mut open);
    done
}

fn ground(layout: &Layout) -> Mesh {
    let mut mesh = Mesh::new();
    let (width, depth) = (
        layout.columns as f32 * layout.tile_m,
        layout.rows as f32 * layout.tile_m,
    );
    mesh.coloured_grid(&LAWN, (24, 24, false), |u, v| {
        let x = -LAWN_MARGIN_M + u * (width + 2.0 * LAWN_MARGIN_M);
        let z = depth + LAWN_MARGIN_M - v * (depth + 2.0 * LAWN_MARGIN_M);
        let shade = 1.0 + 0.25 * noise(Vec3::new(x, 0.0, z) / 9.0, 7);
        (
            Vec3::new(x, GROUND_M, z),
            Some([0.11 * shade, 0.2 * shade, 0.06 * shade]),
        )
    });
    mesh
}
