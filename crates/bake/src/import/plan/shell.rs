//! What does a room look like before anything stands in it? Floor, ceiling and four sides, shaded towards the edges.
//!
//! There are no light maps: soft darkening where surfaces meet is painted into vertex colours, after the look of ambient
//! occlusion (Zhukov, Iones & Kronin, "An ambient light illumination model", 1998), here a function of the distances to
//! the edges alone. Surfaces are cut into cells fine enough to carry it.

use super::finish::{Finish, GLASS, IRON, LAMPLIGHT};
use super::layout::Tile;
use super::legend::{Ceiling, Facing, Floor};
use super::mesh::Mesh;
use super::rng::Rng;
use super::run::{Moulding, Run, runs_towards, subdivided};
use super::{Plan, Room, SceneBuilder};
use glam::Vec3;

const WALL: Finish = Finish::matt("wall paint", 0xffffff).gloss(0.9);
const FLOOR: Finish = Finish::matt("floor", 0xffffff).gloss(0.45);
const TRIM: Finish = Finish::matt("mouldings", 0xffffff).gloss(0.6);
const CEILING: Finish = Finish::matt("ceiling plaster", 0xffffff).gloss(0.95);
const SKIRTING: [(f32, f32); 4] = [(0.025, 0.0), (0.025, 0.11), (0.012, 0.14), (0.0, 0.14)];
const CORNICE_M: f32 = 0.18;
/// Cells of walls, plain floors and ceilings are at most so wide, metres; in vast rooms a 96th of the room.
const CELL_M: f32 = 1.5;
const INSET_M: f32 = 0.4;

/// Light that reaches a point at this distance from an edge, of what would reach it without.
fn openness(distance_m: f32) -> f32 {
    1.0 - 0.34 * (-distance_m / 0.42).exp()
}

fn shaded(colour: [f32; 3], light: f32) -> [f32; 4] {
    let [r, g, b] = colour.map(|c| c * light);
    [r, g, b, 1.0]
}

/// Adds the surfaces of one room.
pub(super) fn build_room(plan: &Plan, index: usize, builder: &mut SceneBuilder) {
    let room = &plan.rooms[index];
    let shell = RoomShell {
        plan,
        room,
        index,
        height_m: plan.layout.room_height_m[index],
    };
    builder.place_once(format!("{}/floor", room.name), shell.floor());
    builder.place_once(format!("{}/ceiling", room.name), shell.ceiling());
    for towards in Facing::ALL {
        builder.place_once(format!("{}/{} wall", room.name, towards.word()), shell.walls(towards));
    }
}

struct RoomShell<'a> {
    plan: &'a Plan,
    room: &'a Room,
    index: usize,
    height_m: f32,
}

impl RoomShell<'_> {
    fn contains(&self, column: isize, row: isize) -> bool {
        self.plan.layout.tile(column, row) == Tile::Room(self.index)
    }

    fn contains_point(&self, x: f32, z: f32) -> bool {
        let tile_m = self.plan.layout.tile_m;
        self.contains((x / tile_m).floor() as isize, (z / tile_m).floor() as isize)
    }

    /// x, z of the least and greatest corner, metres.
    fn extent_m(&self) -> [f32; 4] {
        let [c0, r0, c1, r1] = self.plan.layout.room_extents[self.index];
        [c0, r0, c1 + 1, r1 + 1].map(|i| i as f32 * self.plan.layout.tile_m)
    }

    /// Coordinates at which the room's outline has corners or sides: x, then z.
    fn outline(&self) -> [Vec<f32>; 2] {
        let [c0, r0, c1, r1] = self.plan.layout.room_extents[self.index];
        let tile_m = self.plan.layout.tile_m;
        let columns = (c0..=c1 + 1).filter(|&c| (r0..=r1).any(|r| self.contains(c, r) != self.contains(c - 1, r)));
        let rows = (r0..=r1 + 1).filter(|&r| (c0..=c1).any(|c| self.contains(c, r) != self.contains(c, r - 1)));
        [
            columns.map(|c| c as f32 * tile_m).collect(),
            rows.map(|r| r as f32 * tile_m).collect(),
        ]
    }

    /// Distance from a point on the floor to the nearest wall, at most 2 m.
    fn wall_distance(&self, x: f32, z: f32) -> f32 {
        const REACH_M: f32 = 2.0;
        let tile_m = self.plan.layout.tile_m;
        let range = |v: f32| ((v - REACH_M) / tile_m).floor() as isize..=((v + REACH_M) / tile_m).floor() as isize;
        let mut nearest = REACH_M;
        for row in range(z) {
            for column in range(x) {
                if self.plan.layout.tile(column, row) == Tile::Wall {
                    let gap = |v: f32, i: isize| (i as f32 * tile_m - v).max(v - (i + 1) as f32 * tile_m).max(0.0);
                    nearest = nearest.min(gap(x, column).hypot(gap(z, row)));
                }
            }
        }
        nearest
    }

    /// Cells of a horizontal surface that lie in the room: least and greatest x and z.
    fn cells(&self, xs: &[f32], zs: &[f32]) -> Vec<[f32; 4]> {
        let mut cells = Vec::new();
        for z in zs.windows(2) {
            for x in xs.windows(2) {
                if self.contains_point((x[0] + x[1]) / 2.0, (z[0] + z[1]) / 2.0) {
                    cells.push([x[0], z[0], x[1], z[1]]);
                }
            }
        }
        cells
    }

    fn floor(&self) -> Mesh {
        let [x0, z0, x1, z1] = self.extent_m();
        let [xs, zs] = self.outline();
        let widest = (x1 - x0).max(z1 - z0);
        let module = |least: f32| ((x1 - x0) * (z1 - z0) / 320.0).sqrt().max(least).max(widest / 96.0);
        let at_multiples = |mut fixed: Vec<f32>, from: f32, to: f32, step: f32| {
            fixed.extend((1..((to - from) / step).ceil() as usize).map(|i| from + i as f32 * step));
            subdivided(fixed, step, 0.0)
        };
        let (xs, zs) = match self.room.style.floor {
            Floor::Plain(_) => {
                let step = CELL_M.max(widest / 96.0);
                (subdivided(xs, step, INSET_M), subdivided(zs, step, INSET_M))
            }
            Floor::Border(..) => {
                let step = (CELL_M * 1.3).max(widest / 96.0);
                (subdivided(xs, step, 0.5), subdivided(zs, step, 0.5))
            }
            Floor::Checker(..) => {
                let step = module(1.0);
                (at_multiples(xs, x0, x1, step), at_multiples(zs, z0, z1, step))
            }
            Floor::Planks(_) => {
                let step = module(0.45) * 0.8;
                (at_multiples(xs, x0, x1, step * 5.0), at_multiples(zs, z0, z1, step))
            }
        };
        let mut mesh = Mesh::new();
        let mut grain = Rng::new(self.index as u64);
        for [ax, az, bx, bz] in self.cells(&xs, &zs) {
            let (mx, mz) = ((ax + bx) / 2.0, (az + bz) / 2.0);
            let colour = match self.room.style.floor {
                Floor::Plain(colour) => colour.linear(),
                Floor::Checker(first, second) => {
                    let step = module(1.0);
                    let odd = (((mx - x0) / step) as i64 + ((mz - z0) / step) as i64) % 2 == 1;
                    if odd { second.linear() } else { first.linear() }
                }
                Floor::Border(field, border) => {
                    let at_edge = self.wall_distance(mx, mz) < 0.5;
                    if at_edge { border.linear() } else { field.linear() }
                }
                Floor::Planks(colour) => {
                    let shade = grain.range(0.78, 1.12);
                    colour.linear().map(|c| c * shade)
                }
            };
            let corners = [(ax, bz), (bx, bz), (bx, az), (ax, az)];
            let colours = corners.map(|(x, z)| shaded(colour, openness(self.wall_distance(x, z))));
            mesh.shaded_polygon(&FLOOR, &corners.map(|(x, z)| Vec3::new(x, 0.0, z)), &colours);
        }
        mesh
    }

    fn ceiling(&self) -> Mesh {
        let mut mesh = Mesh::new();
        let [x0, z0, x1, z1] = self.extent_m();
        let [xs, zs] = self.outline();
        let step = (CELL_M * 1.6).max((x1 - x0).max(z1 - z0) / 96.0);
        let y = self.height_m;
        match self.room.style.ceiling {
            Ceiling::Open => {}
            Ceiling::Glass => {
                let (xs, zs) = (subdivided(xs, step, 0.0), subdivided(zs, step, 0.0));
                for [ax, az, bx, bz] in self.cells(&xs, &zs) {
                    let pane = |y: f32| [(ax, az), (bx, az), (bx, bz), (ax, bz)].map(|(x, z)| Vec3::new(x, y, z));
                    mesh.polygon(&GLASS, &pane(y));
                    let mut above = pane(y + 0.02);
                    above.reverse();
                    mesh.polygon(&GLASS, &above);
                    let bar = 0.035;
                    mesh.cuboid(
                        &IRON,
                        Vec3::new(ax - bar, y - 0.12, az + bar),
                        Vec3::new(ax + bar, y + 0.06, bz - bar),
                    );
                    mesh.cuboid(
                        &IRON,
                        Vec3::new(ax - bar, y - 0.14, az - bar),
                        Vec3::new(bx - bar, y + 0.08, az + bar),
                    );
                }
            }
            Ceiling::Plaster(colour) | Ceiling::Beams(colour) | Ceiling::Skylight(colour) => {
                let colour = colour.linear();
                let (xs, zs) = (subdivided(xs, step, INSET_M), subdivided(zs, step, INSET_M));
                for [ax, az, bx, bz] in self.cells(&xs, &zs) {
                    let corners = [(ax, az), (bx, az), (bx, bz), (ax, bz)];
                    let colours = corners.map(|(x, z)| shaded(colour, openness(self.wall_distance(x, z))));
                    mesh.shaded_polygon(&CEILING, &corners.map(|(x, z)| Vec3::new(x, y, z)), &colours);
                }
                match self.room.style.ceiling {
                    Ceiling::Beams(_) => self.beams(&mut mesh),
                    Ceiling::Skylight(_) => self.skylight(&mut mesh),
                    _ => {}
                }
            }
        }
        mesh
    }

    /// Timber beams across the room, about every 1.8 m.
    fn beams(&self, mesh: &mut Mesh) {
        const BEAM: Finish = Finish::matt("beams", 0x4a3120).gloss(0.8);
        let tile_m = self.plan.layout.tile_m;
        let [c0, r0, c1, r1] = self.plan.layout.room_extents[self.index];
        let along_x = c1 - c0 <= r1 - r0;
        let (lines, across) = if along_x {
            (r0..=r1, c0..=c1)
        } else {
            (c0..=c1, r0..=r1)
        };
        let every = (1.8 / tile_m).round().max(1.0) as usize;
        for line in lines.skip(every / 2).step_by(every) {
            let has = |i: isize| {
                if along_x {
                    self.contains(i, line)
                } else {
                    self.contains(line, i)
                }
            };
            let middle = (line as f32 + 0.5) * tile_m;
            let mut from = *across.start();
            while from <= *across.end() {
                let to = (from..=*across.end()).find(|&i| !has(i)).unwrap_or(across.end() + 1);
                if to > from {
                    let (a, b) = (from as f32 * tile_m, to as f32 * tile_m);
                    let (min, max) = if along_x {
                        ([a, middle - 0.1], [b, middle + 0.1])
                    } else {
                        ([middle - 0.1, a], [middle + 0.1, b])
                    };
                    let y = [self.height_m - 0.24, self.height_m - 0.004];
                    mesh.cuboid(&BEAM, Vec3::new(min[0], y[0], min[1]), Vec3::new(max[0], y[1], max[1]));
                }
                from = to.max(from) + 1;
            }
        }
    }

    /// A luminous panel in a frame under the middle of the ceiling, where the room is wide enough.
    fn skylight(&self, mesh: &mut Mesh) {
        const FRAME: Finish = Finish::matt("skylight frame", 0xf0ece2);
        let [x0, z0, x1, z1] = self.extent_m();
        let margin = ((x1 - x0).min(z1 - z0) * 0.28).max(0.8);
        let [ax, az, bx, bz] = [x0 + margin, z0 + margin, x1 - margin, z1 - margin];
        let fits = [(ax, az), (bx, az), (bx, bz), (ax, bz)]
            .iter()
            .all(|&(x, z)| self.contains_point(x, z));
        if bx - ax < 0.8 || bz - az < 0.8 || !fits {
            return;
        }
        let y = self.height_m - 0.05;
        let panel = [(ax, az), (bx, az), (bx, bz), (ax, bz)].map(|(x, z)| Vec3::new(x, y, z));
        mesh.polygon(&LAMPLIGHT.dyed(Some(super::Rgb::hex(0xfff6e4))), &panel);
        let mut bar = |min: (f32, f32), max: (f32, f32)| {
            let (low, high) = (self.height_m - 0.14, self.height_m - 0.004);
            mesh.cuboid(&FRAME, Vec3::new(min.0, low, min.1), Vec3::new(max.0, high, max.1));
        };
        let w = 0.12;
        bar((ax - w, az - w), (bx + w, az));
        bar((ax - w, bz), (bx + w, bz + w));
        bar((ax - w, az), (ax, bz));
        bar((bx, az), (bx + w, bz));
        let along_x = bx - ax >= bz - az;
        let (from, to) = if along_x { (ax, bx) } else { (az, bz) };
        let count = ((to - from) / 1.6).round().clamp(1.0, 64.0) as usize;
        for i in 1..count {
            let at = from + (to - from) * i as f32 / count as f32;
            if along_x {
                bar((at - 0.03, az), (at + 0.03, bz));
            } else {
                bar((ax, at - 0.03), (bx, at + 0.03));
            }
        }
    }

    fn walls(&self, towards: Facing) -> Mesh {
        let mut mesh = Mesh::new();
        let layout = &self.plan.layout;
        let runs = runs_towards(layout, layout.room_extents[self.index], towards, |c, r| {
            self.contains(c, r)
        });
        for run in &runs {
            self.wall(&mut mesh, run);
            let base = self
                .room
                .style
                .dado
                .unwrap_or(self.room.style.walls)
                .linear()
                .map(|c| c * 0.55);
            let skirting = Moulding {
                profile: &SKIRTING,
                from_m: 0.0,
                to_m: 0.15,
                colour: base,
            };
            run.moulding(&mut mesh, &TRIM, layout, &skirting);
            if let Ceiling::Plaster(colour) | Ceiling::Skylight(colour) = self.room.style.ceiling {
                let low = self.height_m - CORNICE_M;
                let profile = [
                    (0.0, low),
                    (0.03, low),
                    (0.05, low + 0.06),
                    (CORNICE_M * 0.8, self.height_m - 0.03),
                    (CORNICE_M * 0.8, self.height_m),
                ];
                let colour = colour.linear().map(|c| c * 0.86);
                let cornice = Moulding {
                    profile: &profile,
                    from_m: low,
                    to_m: self.height_m,
                    colour,
                };
                run.moulding(&mut mesh, &TRIM, layout, &cornice);
            }
        }
        mesh
    }

    fn wall(&self, mesh: &mut Mesh, run: &Run) {
        const DADO_M: f32 = 1.0;
        let openings = run.openings(&self.plan.layout);
        let mut us = vec![run.start_m, run.end_m];
        let mut ys = vec![0.0, self.height_m];
        for (opening, start, end) in &openings {
            us.extend([*start, *end]);
            ys.extend([opening.bottom_m, opening.top_m]);
        }
        if self.room.style.dado.is_some() {
            ys.push(DADO_M);
        }
        let step = CELL_M.max((run.end_m - run.start_m) / 96.0);
        let (us, ys) = (subdivided(us, step, INSET_M), subdivided(ys, step, INSET_M));
        let light = |u: f32, y: f32| {
            let corner = |inner: bool, distance: f32| if inner { openness(distance) } else { 1.0 };
            let ceiling = if matches!(self.room.style.ceiling, Ceiling::Open | Ceiling::Glass) {
                1.0
            } else {
                openness(self.height_m - y)
            };
            let glow = 0.94 + 0.06 * (y / self.height_m);
            openness(y)
                * ceiling
                * glow
                * corner(run.inner_start, u - run.start_m)
                * corner(run.inner_end, run.end_m - u)
        };
        for y in ys.windows(2) {
            for u in us.windows(2) {
                let (mid_u, mid_y) = ((u[0] + u[1]) / 2.0, (y[0] + y[1]) / 2.0);
                let hole = openings
                    .iter()
                    .any(|(o, start, end)| (*start..*end).contains(&mid_u) && (o.bottom_m..o.top_m).contains(&mid_y));
                if hole {
                    continue;
                }
                let paint = match self.room.style.dado {
                    Some(dado) if mid_y < DADO_M => dado.linear(),
                    _ => self.room.style.walls.linear(),
                };
                let corners = [(u[0], y[0]), (u[1], y[0]), (u[1], y[1]), (u[0], y[1])];
                let colours = corners.map(|(u, y)| shaded(paint, light(u, y)));
                mesh.shaded_polygon(&WALL, &corners.map(|(u, y)| run.point(u, y, 0.0)), &colours);
            }
        }
        if let Some(dado) = self.room.style.dado {
            let colour = dado.linear().map(|c| c * 0.7);
            let profile = [
                (0.0, DADO_M - 0.04),
                (0.02, DADO_M - 0.03),
                (0.02, DADO_M + 0.02),
                (0.0, DADO_M + 0.03),
            ];
            let rail = Moulding {
                profile: &profile,
                from_m: DADO_M - 0.04,
                to_m: DADO_M + 0.03,
                colour,
            };
            run.moulding(mesh, &TRIM, &self.plan.layout, &rail);
        }
    }
}
