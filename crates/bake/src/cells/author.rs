//! Which cells did the author draw? Checks them, makes neighbours share planes, and finds the openings between them.
//!
//! A cell is a closed convex polyhedron of any number of faces (Marvie & Bouatouch, *A VRML97-X3D extension for massive
//! scenery management in virtual worlds*, 2004, §3.1). Its planes are those of its triangles, whichever way these face.
//! What an author can draw no more exactly than a tolerance is taken as meant: faces that nearly lie in one plane are put
//! on one, so that neighbours leave no gap. Two cells are adjacent where faces of theirs lie on each other; the common
//! part is the opening, unless `portal:` polygons on it say which parts of it are open.
//!
//! Cost: only cells whose boxes meet are compared, and faces only with planes that lie about as they do, so it grows with the number of
//! cells as long as each touches a few.

use std::sync::Arc;

use belvedere_scene::{Bounds, convex::HalfSpace};
use glam::DVec3;

use super::{
    flaw::{AuthorError, CellFlaw},
    hull::{CellHull, Unbounded, area_m2, clipped, convex_outline, normal},
    near::{Boxes, grown},
    overlap::overlap_m,
    shared_planes::share_planes,
    view_cell::{CellGraph, Portal, ViewCell},
};
use crate::{
    defect::Defects,
    occluders::{Body, tolerance_of},
    progress::{Progress, Silent, Stage},
    source::{Authored, AuthoredShape, Said},
    world::World,
};

/// How exactly authors draw, in metres; in a cell of less than a metre a thousandth of it.
pub const TOLERANCE_M: f64 = 1e-3;
/// A `portal:` polygon may lie so far off the faces that it is an opening of.
const PORTAL_REACH_M: f64 = 0.05;
/// Cells whose boxes are further apart than the tolerance and this share of their size do not touch.
const NEAR: f64 = 1e-5;
/// A cell may have so many faces: each travels with the index.
pub(super) const MAX_FACES: usize = 128;
/// All openings of a cell together may take so many bytes of its record. No more than 1 MiB of that is geometry, and its hull needs some.
const MAX_OPENING_BYTES: usize = (1 << 20) - (1 << 16);
/// Every face must be covered by triangles up to this share of its area, or the cell is not closed.
const COVERED: f64 = 0.995;

/// The author's cells, each sound by itself and none in another.
#[derive(Debug)]
pub(crate) struct SoundCells {
    checked: Vec<Checked>,
    hulls: Vec<CellHull>,
}

/// A cell that was checked by itself.
#[derive(Debug)]
pub(super) struct Checked {
    node: String,
    said: Option<Arc<Said>>,
    pub(super) tolerance_m: f64,
    bounds: Bounds,
    pub(super) faces: Vec<FacePlane>,
}

/// The plane of a face: triangles on it, and then its place among all planes.
#[derive(Debug)]
pub(super) struct FacePlane {
    pub(super) half: HalfSpace,
    pub(super) triangles: Vec<[DVec3; 3]>,
}

/// Why a bake would refuse the author's cells before it has looked at anything else.
#[must_use]
pub fn refusal(authored: &Authored) -> Option<AuthorError> {
    /// Of more it takes long to find the planes that they share, and with these whether cells are closed and apart: that is left
    /// to the bake.
    const MOST_FACES: usize = 16_384;
    let checked = match checked(authored) {
        Ok(checked) => checked,
        Err(error) => return Some(error),
    };
    let faces: usize = checked.iter().map(|cell| cell.faces.len()).sum();
    if faces > MOST_FACES {
        return None;
    }
    SoundCells::among(checked).err()
}

/// The author's cells by their planes.
fn checked(authored: &Authored) -> Result<Vec<Checked>, AuthorError> {
    let check = |shape: &AuthoredShape| Checked::of(shape).map_err(|flaw| flaw.said(&shape.said));
    authored.cells.iter().map(check).collect()
}

/// Makes the author's cells the view cells.
///
/// # Errors
/// When a cell is not closed, not convex, without volume, overlaps another or has too many openings.
pub fn build(world: &World, authored: &Authored, defects: &mut Defects) -> Result<CellGraph, AuthorError> {
    joined(&SoundCells::of(authored)?, (world, authored), defects, &Silent)
}

impl SoundCells {
    /// Checks what takes nothing but the cells themselves.
    ///
    /// # Errors
    /// When a cell is not closed, not convex, without volume, or overlaps another.
    pub(crate) fn of(authored: &Authored) -> Result<Self, AuthorError> {
        Self::among(checked(authored)?)
    }

    /// The same of cells whose planes are known.
    fn among(mut checked: Vec<Checked>) -> Result<Self, AuthorError> {
        let middle_of = |cell: &Checked| DVec3::from(cell.bounds.center());
        let around = Bounds::around(checked.iter().map(|cell| middle_of(cell).to_array()));
        checked.sort_by_cached_key(|cell| crate::pipeline::z_order(middle_of(cell), &around));
        share_planes(&mut checked);
        let hull = |cell: &Checked| cell.hull().map_err(|flaw| flaw.said(&cell.said));
        let hulls = checked.iter().map(hull).collect::<Result<Vec<_>, _>>()?;
        // Boxes that are apart have an axis that separates what is in them.
        let boxes = Boxes::of(hulls.iter().map(CellHull::bounds).collect());
        for (number, (a, hull)) in (0u32..).zip(checked.iter().zip(&hulls)) {
            for other in boxes.after(number) {
                let (b, by_m) = (&checked[other as usize], overlap_m(hull, &hulls[other as usize]));
                if by_m > a.tolerance_m.max(b.tolerance_m) {
                    let flaw = CellFlaw::Overlap {
                        node: a.node.clone(),
                        other: b.node.clone(),
                        by_m,
                    };
                    return Err(flaw.said(&a.said));
                }
            }
        }
        Ok(Self { checked, hulls })
    }
}

/// The same of cells that are checked.
///
/// # Errors
/// When a cell has too many openings.
pub(crate) fn joined(
    SoundCells { checked, hulls }: &SoundCells,
    (world, authored): (&World, &Authored),
    defects: &mut Defects,
    progress: &dyn Progress,
) -> Result<CellGraph, AuthorError> {
    progress.start(Stage::Cells, hulls.len() as u64);
    let mut graph = CellGraph {
        cells: hulls.iter().map(cell_of).collect(),
        voxel_m: TOLERANCE_M,
        reason: match hulls.len() {
            1 => "one cell as its author drew it".to_owned(),
            cells => format!("{cells} cells as their author drew them"),
        },
    };
    let mut used = vec![false; authored.portals.len()];
    let portals = Portals::of(&authored.portals);
    let reaches = hulls.iter().map(|hull| {
        let bounds = hull.bounds();
        grown(&bounds, TOLERANCE_M + NEAR * bounds.diagonal_m())
    });
    let boxes = Boxes::of(reaches.collect());
    for (number, hull) in (0u32..).zip(hulls) {
        for other in boxes.after(number) {
            for polygon in openings([hull, &hulls[other as usize]], &portals, &mut used) {
                graph.join([number, other], &polygon);
            }
        }
        progress.advance(1);
    }
    graph.settle();
    check_openings(&graph, checked)?;
    graph.name_doors(world);
    let unused: Vec<_> = authored.portals.iter().zip(&used).filter(|(_, used)| !**used).collect();
    defects.note(
        "author's portal that lies between no two cells: not used",
        unused.len() as u64,
        || unused[0].0.node.clone(),
    );
    let alone: Vec<_> = graph
        .cells
        .iter()
        .zip(checked)
        .filter(|(cell, _)| cell.adjacent.is_empty())
        .collect();
    if hulls.len() > 1 {
        defects.note(
            "isolated cell: an author's cell that touches no other",
            alone.len() as u64,
            || alone[0].1.node.clone(),
        );
    }
    Ok(graph)
}

/// Notes the author's portals where he has drawn no cells that they could lie between.
pub fn note_portals(authored: &Authored, defects: &mut Defects) {
    let kind = "author's portal in a scene without author's cells: not used, cells and openings are found in the geometry; draw the \
                rooms on either side as `cell:` to use it";
    defects.name(kind, authored.portals.iter().map(|portal| portal.node.clone()));
}

/// Whether the openings of each cell can be written.
fn check_openings(graph: &CellGraph, checked: &[Checked]) -> Result<(), AuthorError> {
    for (cell, node) in graph.cells.iter().zip(checked) {
        if opening_bytes(&cell.portals) > MAX_OPENING_BYTES {
            let mut openings_into = vec![0; checked.len()];
            for portal in &cell.portals {
                openings_into[portal.to as usize] += 1;
            }
            let most = openings_into.iter().zip(checked).max_by_key(|(openings, _)| **openings);
            let flaw = CellFlaw::TooManyOpenings {
                node: node.node.clone(),
                other: most.map_or_else(String::new, |(_, other)| other.node.clone()),
                openings: cell.portals.len(),
            };
            return Err(flaw.said(&node.said));
        }
    }
    Ok(())
}

/// No fewer bytes than openings take in a record: there a coordinate stands once, and corners are numbers of coordinates.
fn opening_bytes(portals: &[Portal]) -> usize {
    // Its cell, its door, how many corners it has, and that the cell is adjacent.
    const PORTAL: usize = 20;
    let corners = || portals.iter().flat_map(|portal| &portal.polygon);
    let of_axis = |axis: usize| {
        let mut coordinates: Vec<f64> = corners().map(|corner| corner[axis]).collect();
        let count = coordinates.len();
        coordinates.sort_by(f64::total_cmp);
        coordinates.dedup();
        let number_bytes = if coordinates.len() < 1 << 15 { 3 } else { 5 };
        size_of_val(&coordinates[..]) + count * number_bytes
    };
    (0..3).map(of_axis).sum::<usize>() + PORTAL * portals.len()
}

/// A body that hides on its author's word.
pub(crate) struct Drawn {
    /// The name of its node.
    pub(crate) node: String,
    pub(crate) body: Body,
}

/// The author's occluders as bodies. Whether one lies inside of what is drawn is taken on the author's word; it counts
/// as a part of the smallest object around its middle. Only proofs use it: what a ray has seen stays seen.
pub(crate) fn occluders(world: &World, authored: &Authored, defects: &mut Defects) -> Vec<Drawn> {
    let tolerance = tolerance_of(world);
    let mut drawn = Vec::new();
    if authored.occluders.is_empty() {
        return drawn;
    }
    let objects = Boxes::of(world.object_bounds().to_vec());
    for shape in &authored.occluders {
        let Ok(hull) = Checked::of(shape).and_then(|solid| solid.hull()) else {
            let kind = "author's occluder that is no closed convex solid: not used";
            defects.note(kind, 1, || shape.node.clone());
            continue;
        };
        let bounds = hull.bounds();
        let diagonal_m = |object: &u32| world.object_bounds()[*object as usize].diagonal_m();
        let around = objects.holding(bounds.center()).into_iter();
        let Some(object) = around.min_by(|a, b| diagonal_m(a).total_cmp(&diagonal_m(b))) else {
            let kind = "author's occluder inside no object: not used";
            defects.note(kind, 1, || shape.node.clone());
            continue;
        };
        let planes = hull.planes.iter().map(|half| {
            let offset = half[3] - normal(half).dot(world.origin());
            normal(half).extend(offset).as_vec4()
        });
        let sides = [bounds.min, bounds.max].map(|corner| world.relative(corner));
        let leaves_something = hull.thickness_m() > 2.0 * f64::from(tolerance.hole_m);
        let body = Body::inside(sides, &planes.collect::<Vec<_>>(), object, tolerance).filter(|_| leaves_something);
        let Some(body) = body else {
            let kind = "author's occluder that is thinner than what is known exactly in so wide a scene: not used";
            defects.note(kind, 1, || shape.node.clone());
            continue;
        };
        drawn.push(Drawn {
            node: shape.node.clone(),
            body,
        });
    }
    drawn
}

/// A box where the planes are those of one.
fn cell_of(hull: &CellHull) -> ViewCell {
    let straight = |half: &HalfSpace| half[..3].iter().any(|x| x.abs() == 1.0);
    if hull.planes.len() == 6 && hull.planes.iter().all(straight) {
        ViewCell::of_box(hull.bounds())
    } else {
        ViewCell::of_hull(hull.clone())
    }
}

impl Checked {
    /// The planes of a mesh; every corner of it lies behind each.
    fn of(shape: &AuthoredShape) -> Result<Self, CellFlaw> {
        let node = &shape.node[..];
        let bounds = Bounds::around(shape.triangles.iter().flatten().map(DVec3::to_array));
        let tolerance_m = TOLERANCE_M.min(TOLERANCE_M * bounds.diagonal_m());
        let mut triangles = shape.triangles.clone();
        triangles.sort_by(|a, b| area_m2(b).total_cmp(&area_m2(a)));
        let mut faces: Vec<FacePlane> = Vec::new();
        for triangle in triangles {
            let [a, b, c] = triangle;
            let longest = (b - a).length().max((c - b).length()).max((a - c).length());
            let thin = 2.0 * area_m2(&triangle) <= tolerance_m * longest;
            let on = |face: &FacePlane| triangle.iter().all(|p| height(&face.half, p).abs() <= tolerance_m);
            if let Some(face) = faces.iter_mut().find(|face| on(face)) {
                face.triangles.push(triangle);
            } else if !thin {
                let n = (b - a).cross(c - a).normalize();
                let half = [n.x, n.y, n.z, n.dot(a)];
                let corners = shape.triangles.iter().flatten();
                let [low, high] = corners.fold([0.0f64; 2], |[low, high], p| {
                    let at = height(&half, p);
                    [low.min(at), high.max(at)]
                });
                if low >= -tolerance_m && high <= tolerance_m {
                    return Err(CellFlaw::NoVolume { node: node.into() });
                }
                if high.min(-low) > tolerance_m {
                    return Err(CellFlaw::NotConvex {
                        node: node.into(),
                        by_m: high.min(-low),
                    });
                }
                if faces.len() == MAX_FACES {
                    return Err(CellFlaw::TooManyFaces { node: node.into() });
                }
                let half = if high > -low { half.map(|x| -x) } else { half };
                faces.push(FacePlane {
                    half,
                    triangles: vec![triangle],
                });
            }
        }
        if faces.is_empty() {
            return Err(CellFlaw::NoVolume { node: node.into() });
        }
        Ok(Self {
            node: node.into(),
            said: shape.said.clone(),
            tolerance_m,
            bounds,
            faces,
        })
    }

    /// The polyhedron that its planes leave, if its triangles cover it.
    fn hull(&self) -> Result<CellHull, CellFlaw> {
        let margin_m = 0.1 * self.bounds.diagonal_m();
        let within = Bounds {
            min: self.bounds.min.map(|x| x - margin_m),
            max: self.bounds.max.map(|x| x + margin_m),
        };
        let planes: Vec<_> = self.faces.iter().map(|face| face.half).collect();
        let drawn_m2 = |face: &FacePlane| face.triangles.iter().map(|t| area_m2(t)).sum::<f64>();
        let hull = CellHull::of(&planes, &within).map_err(|why| match why {
            Unbounded::Nothing => CellFlaw::NoVolume {
                node: self.node.clone(),
            },
            Unbounded::Open => CellFlaw::NotClosed {
                node: self.node.clone(),
                missing_m2: None,
            },
        })?;
        let mut missing_m2 = 0.0;
        for (face, half) in hull.planes.iter().enumerate() {
            let whole_m2 = area_m2(&hull.corners_of(face).collect::<Vec<_>>());
            let drawn = self
                .faces
                .iter()
                .filter(|face| face.half == *half)
                .map(drawn_m2)
                .sum::<f64>();
            if drawn < COVERED * whole_m2 {
                missing_m2 += whole_m2 - drawn;
            }
        }
        if missing_m2 > self.tolerance_m * self.bounds.diagonal_m() {
            return Err(CellFlaw::NotClosed {
                node: self.node.clone(),
                missing_m2: Some(missing_m2),
            });
        }
        Ok(hull)
    }
}

pub(super) fn height(half: &HalfSpace, point: &DVec3) -> f64 {
    normal(half).dot(*point) - half[3]
}

/// What an author says is open, by place.
struct Portals<'a> {
    shapes: &'a [AuthoredShape],
    boxes: Boxes,
}

impl<'a> Portals<'a> {
    fn of(shapes: &'a [AuthoredShape]) -> Self {
        let around = |shape: &AuthoredShape| {
            let corners = shape.triangles.iter().flatten();
            grown(
                &Bounds::around(corners.map(DVec3::to_array)),
                PORTAL_REACH_M + TOLERANCE_M,
            )
        };
        Self {
            shapes,
            boxes: Boxes::of(shapes.iter().map(around).collect()),
        }
    }

    /// Those that may lie on a polygon, rising.
    fn near(&self, polygon: &[DVec3]) -> impl Iterator<Item = usize> {
        let around = Bounds::around(polygon.iter().map(DVec3::to_array));
        self.boxes.meeting(&around).into_iter().map(|index| index as usize)
    }
}

/// The openings between two cells.
fn openings([a, b]: [&CellHull; 2], portals: &Portals<'_>, used: &mut [bool]) -> Vec<Vec<[f64; 3]>> {
    let near = 1e-9 * a.bounds().diagonal_m().max(b.bounds().diagonal_m());
    let mut openings = Vec::new();
    for (face, half) in a.planes.iter().enumerate() {
        let Some(back) = b.planes.iter().position(|other| other.map(|x| -x) == *half) else {
            continue;
        };
        let mut common: Vec<DVec3> = a.corners_of(face).collect();
        for (_, half) in b.planes.iter().enumerate().filter(|(other, _)| *other != back) {
            common = clipped(&common, &|p| height(half, p), near);
        }
        if area_m2(&common) <= least_area_m2(&common) {
            continue;
        }
        let open: Vec<_> = portals
            .near(&common)
            .filter_map(|index| Some((index, narrowed(&common, half, &portals.shapes[index])?)))
            .collect();
        for (index, _) in &open {
            used[*index] = true;
        }
        let polygons = if open.is_empty() {
            vec![common]
        } else {
            open.into_iter().map(|(_, p)| p).collect()
        };
        openings.extend(polygons.into_iter().map(|p| p.iter().map(DVec3::to_array).collect()));
    }
    openings
}

/// What is smaller is a seam and no opening: a strip as wide as the tolerance.
fn least_area_m2(polygon: &[DVec3]) -> f64 {
    let bounds = Bounds::around(polygon.iter().map(DVec3::to_array));
    TOLERANCE_M * bounds.diagonal_m().min(1.0) * bounds.diagonal_m()
}

/// The part of an opening that an author's polygon leaves open: none when that lies elsewhere.
fn narrowed(opening: &[DVec3], half: &HalfSpace, portal: &AuthoredShape) -> Option<Vec<DVec3>> {
    let corners: Vec<DVec3> = portal.triangles.iter().flatten().copied().collect();
    if corners.iter().any(|p| height(half, p).abs() > PORTAL_REACH_M) {
        return None;
    }
    let n = normal(half);
    let flat: Vec<DVec3> = corners.iter().map(|p| *p - height(half, p) * n).collect();
    let outline = convex_outline(&flat, n);
    let mut left = opening.to_vec();
    for (i, a) in outline.iter().enumerate() {
        let outwards = (outline[(i + 1) % outline.len()] - *a).cross(n).normalize_or_zero();
        left = clipped(&left, &|p| outwards.dot(*p - *a), 1e-9);
    }
    (outline.len() >= 3 && area_m2(&left) > least_area_m2(&left)).then_some(left)
}
