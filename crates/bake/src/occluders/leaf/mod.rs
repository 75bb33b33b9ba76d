//! Where does a closed door hide, seen from which side?
//!
//! In planes across its thinnest side, where most of it lies. A door that stands askew is thin across its own faces and ends at its
//! own edges, not along axes of the world: a rectangle along those would hide what is beside the door.
//!
//! A *leaf* is a plane that hides where it cuts through closed parts of the door ([`section`]), and where faces lie in it that hide
//! from that side: not through glass, holes or an arch's corners, and not from where only culled backs are met. Panels one behind
//! the other have a leaf each, since sight lines at a slant pass between them. A body that others reach into, as knobs do, hides by
//! itself and has a leaf of its own, as if they were not there. So what is said of a wall ([`super::wall`]) holds for a
//! leaf as well, but that its border is grown by the gap that a closed door leaves around itself ([`gap`]).

mod beside;
mod frame;
mod gap;
mod section;

use glam::{DVec3, Vec2, Vec3};
use rayon::prelude::*;

pub(crate) use self::frame::Frame;
use self::{
    beside::Neighbour,
    gap::Grid,
    section::{Section, Solid},
};
use super::{Tolerance, Wall, Way, parts::parts, squares};
use crate::{
    progress::{Cancelled, Progress},
    world::{Triangle, World},
};

/// Faces across which sight lines run at a smaller sine than this cover nothing.
const EDGE_ON: f32 = 1e-3;
/// So many planes of a door are tried, through its closed parts and along its faces.
const MOST_PLANES: usize = 32;
/// A door has so many leaves at most …
const MOST_LEAVES: usize = 4;
/// … of which none shows less than this share of what the largest shows.
const LEAST_SHARE: f64 = 0.05;
/// So many of the bodies that a plane cuts, the widest, are looked at by themselves too.
const MOST_ALONE: usize = 32;
/// Lines along so many straight edges, the longest, …
const MOST_EDGES: usize = 40;
/// … and others no further apart than this share of the longest edge of a leaf.
const STEP: f32 = 0.015;

/// The leaves of all doors of a world; each has one at least, which may hide nothing.
///
/// # Errors
/// When cancelled.
pub(super) fn leaves(world: &World, tolerance: Tolerance, progress: &dyn Progress) -> Result<Vec<Wall>, Cancelled> {
    let of = |door: &u32| {
        if progress.cancelled() {
            return Err(Cancelled);
        }
        let triangles: Vec<_> = world.triangles_of(*door).iter().map(|face| face.closed()).collect();
        let mut leaves = if triangles.is_empty() {
            Vec::new()
        } else {
            leaves_of(&triangles, &beside::beside(world, *door), tolerance)
        };
        leaves.iter_mut().for_each(|leaf| leaf.door = Some(*door));
        progress.advance(1);
        Ok(leaves)
    };
    let leaves = world.doors().par_iter().map(of).collect::<Result<Vec<_>, _>>()?;
    Ok(leaves.concat())
}

/// A door in its own frame.
struct Door {
    frame: Frame,
    solids: Vec<Solid>,
    sheets: Vec<Sheet>,
    /// The box around it: its least and its greatest corner.
    around: [DVec3; 2],
    /// Faces of other things around it.
    beside: Vec<Neighbour<DVec3>>,
}

/// A face of no closed part.
struct Sheet {
    face: [Vec2; 3],
    depths: [f32; 2],
    /// Whether it hides, by [`Way`].
    hides: [bool; 2],
}

impl Sheet {
    fn area_m2(&self) -> f64 {
        let [a, b, c] = self.face;
        0.5 * f64::from((b - a).perp_dot(c - a).abs())
    }

    fn lies_at(&self, depth: f32, tolerance: Tolerance) -> bool {
        self.depths.iter().all(|d| (d - depth).abs() <= tolerance.plane_m)
    }
}

/// A plane of a door: which closed parts it cuts, and which sheets lie in it, with their areas in m².
struct Plane {
    depth: f64,
    /// Between these depths it cuts the same closed parts.
    between: [f64; 2],
    solids: Vec<(usize, f64)>,
    sheets: Vec<(usize, f64)>,
    /// Whether it is of one closed part alone, whatever else it cuts.
    alone: bool,
}

/// The leaves of a door; `beside` are faces of other things around it.
fn leaves_of(triangles: &[Triangle], beside: &[Neighbour<Vec3>], tolerance: Tolerance) -> Vec<Wall> {
    let door = Door::of(triangles, beside);
    let planes = door.best(door.planes(tolerance), tolerance);
    if planes.is_empty() {
        return vec![door.glass()];
    }
    let framed = planes.into_iter().map(|plane| door.framed(plane, tolerance));
    framed.map(|plane| door.leaf(&plane, tolerance)).collect()
}

impl Door {
    fn of(triangles: &[Triangle], beside: &[Neighbour<Vec3>]) -> Self {
        let frame = Frame::of(triangles);
        let corners = triangles.iter().flat_map(|face| face.corners);
        let around = corners
            .map(|corner| frame.place(corner))
            .fold([DVec3::INFINITY, DVec3::NEG_INFINITY], |[min, max], corner| {
                [min.min(corner), max.max(corner)]
            });
        let beside = beside
            .iter()
            .map(|face| Neighbour {
                corners: face.corners.map(|corner| frame.place(corner)),
                frames: face.frames,
            })
            .collect();
        let (mut solids, mut sheets) = (Vec::new(), Vec::new());
        for part in parts(triangles) {
            let place = |corner: Vec3| frame.place(corner);
            match Solid::of(&part, place) {
                Some(solid) => solids.push(solid),
                None => sheets.extend(part.triangles.iter().filter_map(|face| frame.sheet(face))),
            }
        }
        Self {
            frame,
            solids,
            sheets,
            around,
            beside,
        }
    }

    /// Planes through its closed parts, half way between the depths of their corners, and along its sheets.
    fn planes(&self, tolerance: Tolerance) -> Vec<Plane> {
        let mut corners: Vec<f64> = self.solids.iter().flat_map(Solid::corner_depths).collect();
        corners.sort_by(f64::total_cmp);
        corners.dedup();
        let mut gaps: Vec<_> = corners.windows(2).map(|gap| [gap[0], gap[1]]).collect();
        gaps.sort_by(|a, b| (b[1] - b[0]).total_cmp(&(a[1] - a[0])).then(a[0].total_cmp(&b[0])));
        let through = gaps.into_iter().take(MOST_PLANES);

        let level = |sheet: &&Sheet| sheet.hides != [false; 2] && sheet.lies_at(sheet.depths[0], tolerance);
        let mut sheets: Vec<_> = self
            .sheets
            .iter()
            .filter(level)
            .map(|sheet| (sheet.area_m2(), sheet.depths[0]))
            .collect();
        sheets.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.total_cmp(&b.1)));
        let mut along: Vec<f32> = Vec::new();
        for (_, depth) in sheets {
            let known = along.iter().any(|known| (known - depth).abs() <= tolerance.plane_m);
            if !known && along.len() < MOST_PLANES {
                along.push(depth);
            }
        }
        let depths = through.chain(along.into_iter().map(|depth| [f64::from(depth); 2]));
        depths
            .map(|[low, high]| self.plane(0.5 * (low + high), [low, high], tolerance))
            .collect()
    }

    fn plane(&self, depth: f64, between: [f64; 2], tolerance: Tolerance) -> Plane {
        let areas = self.solids.iter().map(|solid| solid.section(depth).area_m2());
        let in_it = |(_, sheet): &(usize, &Sheet)| sheet.hides != [false; 2] && sheet.lies_at(depth as f32, tolerance);
        let sheets = self.sheets.iter().enumerate().filter(in_it);
        Plane {
            depth,
            between,
            solids: areas.enumerate().filter(|(_, area)| *area > 0.0).collect(),
            sheets: sheets.map(|(number, sheet)| (number, sheet.area_m2())).collect(),
            alone: false,
        }
    }

    /// The same plane at another depth.
    fn moved(&self, plane: &Plane, depth: f64, tolerance: Tolerance) -> Plane {
        let mut moved = self.plane(depth, plane.between, tolerance);
        if plane.alone {
            let kept = plane.solids[0].0;
            moved.solids.retain(|(number, _)| *number == kept);
            moved.sheets.clear();
            moved.alone = true;
        }
        moved
    }

    /// What a plane cuts out of its closed parts, out of the widest first.
    fn sections(&self, plane: &Plane) -> Vec<Section> {
        let mut solids = plane.solids.clone();
        solids.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
        let section = |(number, _): (usize, f64)| self.solids[number].section(plane.depth);
        solids.into_iter().map(section).collect()
    }

    /// The plane of the widest body alone, half way between the corners of its own that are furthest apart, if others reach into it.
    fn own(&self, widest: &[f64], tolerance: Tolerance) -> Option<Plane> {
        let widest = widest.iter().enumerate();
        let (main, _) = widest.reduce(|most, next| if next.1 > most.1 { next } else { most })?;
        let body = &self.solids[main];
        let reaches = |(number, other): (usize, &Solid)| number != main && body.meets(other, tolerance.hole_m.into());
        if !self.solids.iter().enumerate().any(reaches) {
            return None;
        }
        let mut corners: Vec<f64> = body.corner_depths().collect();
        corners.sort_by(f64::total_cmp);
        let gaps = corners.windows(2).map(|gap| [gap[0], gap[1]]);
        let widest = gaps.reduce(|most, next| {
            if next[1] - next[0] > most[1] - most[0] {
                next
            } else {
                most
            }
        });
        let [low, high] = widest?;
        let depth = 0.5 * (low + high);
        let area_m2 = body.section(depth).area_m2();
        (area_m2 > 0.0).then(|| Plane {
            depth,
            between: [low, high],
            solids: vec![(main, area_m2)],
            sheets: Vec::new(),
            alone: true,
        })
    }

    /// The planes that show most of what no better one shows.
    fn best(&self, mut planes: Vec<Plane>, tolerance: Tolerance) -> Vec<Plane> {
        let mut widest = vec![0.0f64; self.solids.len()];
        for (solid, area) in planes.iter().flat_map(|plane| &plane.solids) {
            widest[*solid] = widest[*solid].max(*area);
        }
        let mut shown = [vec![false; self.solids.len()], vec![false; self.sheets.len()]];
        let mut best: Vec<Plane> = Vec::new();
        let mut least_m2 = 0.0;
        if let Some(own) = self.own(&widest, tolerance) {
            let (main, area_m2) = own.solids[0];
            shown[0][main] = true;
            least_m2 = LEAST_SHARE * area_m2;
            best.push(own);
        }
        while best.len() < MOST_LEAVES {
            let adds = |plane: &Plane| -> f64 {
                let of = |items: &[(usize, f64)], shown: &[bool]| -> f64 {
                    items
                        .iter()
                        .filter(|(number, _)| !shown[*number])
                        .map(|(_, area)| area)
                        .sum()
                };
                of(&plane.solids, &shown[0]) + of(&plane.sheets, &shown[1])
            };
            let added = planes.iter().map(adds).enumerate();
            let most = added.reduce(|most, next| if next.1 > most.1 { next } else { most });
            let Some((number, area)) = most.filter(|(_, area)| *area > least_m2) else {
                break;
            };
            least_m2 = f64::max(least_m2, LEAST_SHARE * area);
            let plane = planes.swap_remove(number);
            for (solid, area) in &plane.solids {
                shown[0][*solid] |= *area >= 0.5 * widest[*solid];
            }
            for (sheet, _) in &plane.sheets {
                shown[1][*sheet] = true;
            }
            best.push(plane);
        }
        best
    }

    fn leaf(&self, plane: &Plane, tolerance: Tolerance) -> Wall {
        let sections = self.sections(plane);
        let mut sheets: Vec<&Sheet> = plane.sheets.iter().map(|(number, _)| &self.sheets[*number]).collect();
        // The fewer pieces of a square are left, the less others have to cut.
        sheets.sort_by(|a, b| b.area_m2().total_cmp(&a.area_m2()));
        let all = Section {
            edges: sections
                .iter()
                .flat_map(|section| section.edges.iter().copied())
                .collect(),
        };
        let mut lines = lines(&all, &sheets, tolerance);
        let count = (lines[0].len() - 1) * (lines[1].len() - 1);
        let mut solid = vec![false; count];
        // Also each by itself: what is inside of one stays closed where the outline of another crosses it.
        for section in [&all].into_iter().chain(sections.iter().take(MOST_ALONE)) {
            section.fill(&lines, 0.5 * f64::from(tolerance.hole_m), &mut solid);
        }
        let mut opaque = [0, 1].map(|way| {
            let faces = sheets.iter().filter(|sheet| sheet.hides[way]).map(|sheet| &sheet.face);
            let covered = squares::covered(faces, &lines, tolerance);
            covered
                .iter()
                .zip(&solid)
                .map(|(covered, solid)| covered | solid)
                .collect()
        });
        let gap_m = gap::most_m(longest_m(&lines));
        squares::trim(&mut lines, &mut opaque, gap_m);
        squares::join(&mut lines, &mut opaque);
        let mut grid = Grid { lines, opaque };
        self.close_gap(&mut grid, plane.depth, gap_m, tolerance);
        let Grid { mut lines, mut opaque } = grid;
        squares::join(&mut lines, &mut opaque);
        Wall::new(self.frame.normal, plane.depth as f32, self.frame.axes, lines, opaque)
    }

    /// The leaf of a door that hides nothing: the rectangle around it.
    fn glass(&self) -> Wall {
        let [min, max] = self.around;
        let lines = [[min.x, max.x], [min.y, max.y]].map(|ends| ends.map(|at| at as f32).to_vec());
        let depth = 0.5 * (min.z + max.z);
        let opaque = [vec![false], vec![false]];
        Wall::new(self.frame.normal, depth as f32, self.frame.axes, lines, opaque)
    }
}

impl Frame {
    /// A face in this frame, if sight lines that cross the door may meet it.
    fn sheet(&self, face: &Triangle) -> Option<Sheet> {
        let [a, b, c] = face.corners;
        let turned = (b - a).cross(c - a).normalize_or_zero().dot(self.normal);
        let sides = [face.hides_from_front(), face.hides_from_back()];
        let hides = |way: Way| sides[usize::from((turned > 0.0) != (way == Way::Against))];
        let placed = face.corners.map(|corner| self.place(corner));
        let depths = placed.map(|corner| corner.z as f32);
        (turned.abs() > EDGE_ON).then(|| Sheet {
            face: placed.map(|corner| corner.truncate().as_vec2()),
            depths: [
                depths[0].min(depths[1]).min(depths[2]),
                depths[0].max(depths[1]).max(depths[2]),
            ],
            hides: [Way::Against, Way::Along].map(hides),
        })
    }
}

/// Lines along the straight edges of a leaf, from end to end, and between.
fn lines(section: &Section, sheets: &[&Sheet], tolerance: Tolerance) -> [Vec<f32>; 2] {
    let cut = section.edges.iter().map(|edge| edge.map(|corner| corner.as_vec2()));
    let sides = |sheet: &&Sheet| {
        let [a, b, c] = sheet.face;
        [[a, b], [b, c], [c, a]]
    };
    let edges: Vec<[Vec2; 2]> = cut.chain(sheets.iter().flat_map(sides)).collect();
    let ends = [0, 1].map(|axis| {
        let places = edges.iter().flatten().map(|corner| corner[axis]);
        places.fold([f32::INFINITY, f32::NEG_INFINITY], |[low, high], at| {
            [low.min(at), high.max(at)]
        })
    });
    let longest_m = ends.iter().map(|[low, high]| high - low).fold(0.0, f32::max);
    [0, 1].map(|axis| {
        let straight = edges
            .iter()
            .filter(|[a, b]| (a[axis] - b[axis]).abs() <= tolerance.plane_m);
        let mut straight: Vec<(f32, f32)> = straight.map(|[a, b]| (a[axis], (a - b).length())).collect();
        straight.sort_by(|a, b| a.0.total_cmp(&b.0));
        let alike = straight.chunk_by(|a, b| b.0 - a.0 <= tolerance.plane_m);
        let mut alike: Vec<_> = alike
            .map(|some| (some[0].0, some.iter().map(|(_, length)| length).sum::<f32>()))
            .collect();
        alike.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.total_cmp(&b.0)));
        alike.truncate(MOST_EDGES);
        let mut lines: Vec<f32> = alike.into_iter().map(|(at, _)| at).chain(ends[axis]).collect();
        lines.sort_by(f32::total_cmp);
        lines.dedup_by(|b, a| *b - *a <= tolerance.plane_m);
        if lines.len() == 1 {
            lines.push(lines[0] + tolerance.plane_m);
        }
        // The ends are the ends, whichever line lies upon them.
        let last = lines.len() - 1;
        lines[last] = lines[last].max(ends[axis][1]);
        cut_up(&lines, STEP * longest_m)
    })
}

/// How long the longer edge of a grid is.
fn longest_m(lines: &[Vec<f32>; 2]) -> f32 {
    let lengths = lines.iter().map(|lines| lines[lines.len() - 1] - lines[0]);
    lengths.fold(0.0, f32::max)
}

/// These lines, and others between them where they are further apart than this.
fn cut_up(lines: &[f32], widest_m: f32) -> Vec<f32> {
    let between = |ends: &[f32]| {
        let (low, high) = (ends[0], ends[1]);
        let steps = ((high - low) / widest_m).ceil().max(1.0) as u32;
        (0..steps).map(move |step| low + (high - low) * step as f32 / steps as f32)
    };
    let mut cut: Vec<f32> = lines.windows(2).flat_map(between).collect();
    cut.extend(lines.last());
    cut
}

#[cfg(test)]
mod tests;
