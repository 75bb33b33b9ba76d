//! How far off is what a surface looks like?
//!
//! A floor of black and white fields is flat: fourteen triangles are as near to it as a thousand, and look like shards. So what is
//! painted on a surface counts as well, in the same unit as distance: how far away from where the source has it a level shows it.
//! For points spread over the source's surface that is
//!
//! * of materials: how far the nearest place of the level is that has the point's material or, if that is nearer, the nearest place of
//!   the source that has the material shown instead. A field that vanishes costs half its width, a border that moves half its way.
//! * of the texture coordinates of a picture: how far one has to go in the source until they change by as much, for half of the points:
//!   where surfaces are close, the nearest may be another one, and what stands there says nothing.
//! * of vertex colours: a tenth of the model's extent for the change from one end of a channel to the other, on average (the
//!   quadric generator's weight, see [`super::attributes`]).
//!
//! Normals do not count. This is an estimate, from a bounded number of points: what is small on the surface may be missed.
//! Costs nothing for a model of one material without pictures and colours.

use std::{
    collections::{BTreeMap, BTreeSet},
    sync::OnceLock,
};

use belvedere_scene::Bounds;
use glam::{DVec2, DVec3, DVec4};
use rayon::prelude::*;

use crate::lod::octree::to_f64;
use crate::lod::proximity::{ShapeTree, shapes_of};
use crate::lod::representative::area;
use crate::source::{Primitive, Topology};

/// Points on the source, and no fewer than [`LEAST_EACH`] on what has a material.
const POINTS: usize = 1024;
const LEAST_EACH: usize = 24;
/// A whole change of colour counts as this share of the model's extent.
const COLOR_WEIGHT: f64 = 0.1;
/// A picture that is shifted by more than half of it looks like one that is shifted by less the other way.
const MOST_OF_A_PICTURE: f64 = 0.5;
/// The irrational steps of an even sequence in a square (Roberts 2018: the plastic number's inverse and its square).
const STEPS: [f64; 2] = [0.754_877_666_246_692_7, 0.569_840_290_998_053_2];

/// By which set of texture coordinates each material shows a picture, and how many of it lie along a unit of these.
type Pictured = BTreeMap<usize, (usize, f64)>;

/// A model's surface, as it is painted.
pub(crate) struct Looks<'a> {
    primitives: &'a [Primitive],
    pictured: &'a Pictured,
    points: Vec<Point>,
    /// The surface by material; of one alone, nothing.
    by_material: BTreeMap<Option<usize>, OnceLock<ShapeTree>>,
    extent: f64,
}

/// A place on a surface and what is painted there.
struct Point {
    at: DVec3,
    paint: Paint,
    /// So many pictures lie along each unit of length; nothing where none is shown.
    pictures_a_length: f64,
}

/// How far off that is on a level, in model-space units.
struct Off {
    material: f64,
    /// Nothing where no picture is shown, or what stands there is of another material.
    picture: Option<f64>,
    color: Option<f64>,
}

#[derive(Clone, Copy)]
struct Paint {
    material: Option<usize>,
    /// Where on its picture, in sizes of it.
    picture: Option<DVec2>,
    color: Option<DVec4>,
}

/// A surface that can be asked what is painted where.
struct Surface<'a> {
    primitives: &'a [Primitive],
    pictured: &'a Pictured,
    tree: &'a ShapeTree,
    /// The first shape of each primitive.
    firsts: Vec<u32>,
    by_material: BTreeMap<Option<usize>, ShapeTree>,
}

impl<'a> Looks<'a> {
    /// Of a source. `None` where nothing is painted that could be off.
    pub(crate) fn of(primitives: &'a [Primitive], pictured: &'a Pictured) -> Option<Self> {
        let solid = || {
            primitives
                .iter()
                .filter(|p| p.topology == Topology::Triangles && !p.indices.is_empty())
        };
        let materials: BTreeSet<_> = solid().map(|p| p.material).collect();
        let is_painted = |p: &Primitive| !p.colors.is_empty() || picture_of(p, pictured).is_some();
        if materials.len() < 2 && !solid().any(is_painted) {
            return None;
        }
        let areas: Vec<Vec<f64>> = solid()
            .map(|p| shapes_of([p]).into_iter().map(area).collect())
            .collect();
        let total: f64 = areas.iter().map(|areas| areas.iter().sum::<f64>()).sum();
        let mut points = Vec::new();
        for (primitive, areas) in solid().zip(&areas) {
            let share = if total > 0.0 {
                areas.iter().sum::<f64>() / total
            } else {
                0.0
            };
            let count = ((share * POINTS as f64) as usize).max(LEAST_EACH);
            points.extend(spread(primitive, areas, count, pictured));
        }
        let by_material = materials.iter().filter(|_| materials.len() > 1);
        Some(Self {
            primitives,
            pictured,
            points,
            by_material: by_material.map(|m| (*m, OnceLock::new())).collect(),
            extent: extent(primitives),
        })
    }

    /// How far off a level, of whose shapes there is a tree, shows what is painted, in model-space units.
    pub(crate) fn error_of(&self, level: &[Primitive], tree: &ShapeTree) -> f64 {
        let surface = Surface::of((level, tree), self.pictured, self.by_material.keys().copied());
        if surface.tree.shapes.is_empty() {
            return 0.0;
        }
        let measured: Vec<Off> = self.points.par_iter().map(|point| self.off(point, &surface)).collect();
        let materials = measured.iter().map(|off| off.material).fold(0.0, f64::max);
        let mut pictures: Vec<f64> = measured.iter().filter_map(|off| off.picture).collect();
        pictures.sort_unstable_by(f64::total_cmp);
        let median = pictures.get(pictures.len() / 2).copied().unwrap_or_default();
        let colors: Vec<f64> = measured.iter().filter_map(|off| off.color).collect();
        let mean = colors.iter().sum::<f64>() / colors.len().max(1) as f64;
        materials.max(median).max(mean)
    }

    /// How far off is what is painted at a point.
    fn off(&self, point: &Point, surface: &Surface<'_>) -> Off {
        let near = surface.tree.nearest_to_all(&[point.at], None, 0.0);
        let shown = surface.paint(near.shape, point.at);
        let distance = |tree: &ShapeTree| tree.nearest_to_all(&[point.at], None, 0.0).distance;
        let is_own = shown.material == point.paint.material;
        // What an author paints anew for afar is meant so.
        let material = match self.tree_of(shown.material).filter(|_| !is_own) {
            Some(source) => {
                let own = surface.by_material.get(&point.paint.material);
                own.map_or(f64::INFINITY, distance).min(distance(source))
            }
            None => 0.0,
        };
        let picture = point.paint.picture.zip(shown.picture);
        let picture = picture.filter(|_| is_own && point.pictures_a_length > 0.0);
        let picture = picture.map(|(own, shown)| {
            let way = (own - shown).length().min(MOST_OF_A_PICTURE) / point.pictures_a_length;
            way.min(self.extent)
        });
        let color = point.paint.color.zip(shown.color).filter(|_| is_own);
        let color = color.map(|(own, shown)| (own - shown).abs().max_element().min(1.0) * COLOR_WEIGHT * self.extent);
        Off {
            material,
            picture,
            color,
        }
    }

    /// What of the source has a material.
    fn tree_of(&self, material: Option<usize>) -> Option<&ShapeTree> {
        let tree = self.by_material.get(&material)?;
        Some(tree.get_or_init(|| of_material(self.primitives, material)))
    }
}

impl<'a> Surface<'a> {
    fn of(
        (primitives, tree): (&'a [Primitive], &'a ShapeTree),
        pictured: &'a Pictured,
        materials: impl Iterator<Item = Option<usize>>,
    ) -> Self {
        let mut first = 0;
        let firsts = primitives.iter().map(|primitive| {
            first += primitive.count() as u32;
            first - primitive.count() as u32
        });
        let firsts = firsts.collect();
        let trees = materials.map(|material| (material, of_material(primitives, material)));
        Self {
            primitives,
            pictured,
            tree,
            firsts,
            by_material: trees.filter(|(_, tree)| !tree.shapes.is_empty()).collect(),
        }
    }

    /// What is painted on a shape where it is nearest to a place.
    fn paint(&self, shape: u32, at: DVec3) -> Paint {
        let number = self.firsts.partition_point(|first| *first <= shape) - 1;
        let (primitive, arity) = (&self.primitives[number], self.primitives[number].topology.arity());
        let first = (shape - self.firsts[number]) as usize * arity;
        let corners = [0, 1, 2].map(|i: usize| primitive.indices[first + i.min(arity - 1)]);
        paint(
            primitive,
            corners,
            shares_at(at, &self.tree.shapes[shape as usize]),
            self.pictured,
        )
    }
}

fn of_material(primitives: &[Primitive], material: Option<usize>) -> ShapeTree {
    ShapeTree::of(primitives.iter().filter(|p| p.material == material))
}

/// The texture coordinates by which a primitive shows a picture, and how many of it lie along a unit of these.
fn picture_of<'p>(primitive: &'p Primitive, pictured: &Pictured) -> Option<(&'p [[f32; 2]], f64)> {
    let (set, pictures) = *pictured.get(&primitive.material?)?;
    Some((primitive.uvs.get(set)?, pictures))
}

/// What is painted at a share of each corner.
fn paint(primitive: &Primitive, corners: [u32; 3], shares: [f64; 3], pictured: &Pictured) -> Paint {
    let corners = corners.map(|corner| corner as usize);
    let picture = picture_of(primitive, pictured).map(|(uvs, pictures)| {
        let corner = |i: usize| shares[i] * DVec2::from_array(uvs[corners[i]].map(f64::from));
        pictures * (corner(0) + corner(1) + corner(2))
    });
    let color = (!primitive.colors.is_empty()).then(|| {
        let corner = |i: usize| shares[i] * DVec4::from_array(primitive.colors[corners[i]].map(f64::from));
        corner(0) + corner(1) + corner(2)
    });
    Paint {
        material: primitive.material,
        picture,
        color,
    }
}

/// The shares of the corners of a triangle at its point that is nearest to a place, but for what lies beyond its edges, which
/// is drawn back along the triangle.
fn shares_at(at: DVec3, &[a, b, c]: &[DVec3; 3]) -> [f64; 3] {
    let (ab, ac, ap) = (b - a, c - a, at - a);
    let normal = ab.cross(ac);
    let squared = normal.length_squared();
    if squared == 0.0 {
        let along = ap.dot(ab) / ab.length_squared().max(f64::MIN_POSITIVE);
        let along = along.clamp(0.0, 1.0);
        return [1.0 - along, along, 0.0];
    }
    let v = (ap.cross(ac).dot(normal) / squared).clamp(0.0, 1.0);
    let w = (ab.cross(ap).dot(normal) / squared).clamp(0.0, 1.0);
    let sum = (v + w).max(1.0);
    let (v, w) = (v / sum, w / sum);
    [1.0 - v - w, v, w]
}

/// Points spread evenly over a primitive's triangles, which have these areas.
fn spread(primitive: &Primitive, areas: &[f64], count: usize, pictured: &Pictured) -> Vec<Point> {
    let area: f64 = areas.iter().sum();
    let mut points = Vec::with_capacity(count);
    let (mut passed, mut next) = (0.0, 0);
    for (triangle, &own) in primitive.indices.as_chunks::<3>().0.iter().zip(areas) {
        let corners = triangle.map(|corner| to_f64(primitive.positions[corner as usize]));
        passed += own;
        while next < count && (next as f64 + 0.5) * area <= passed * count as f64 && own > 0.0 {
            let [u, v] = STEPS.map(|step| (0.5 + step * next as f64).fract());
            let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
            let shares = [1.0 - u - v, u, v];
            let at = (0..3).map(|i| shares[i] * corners[i]).sum();
            points.push(Point {
                at,
                paint: paint(primitive, *triangle, shares, pictured),
                pictures_a_length: pictures_a_length(primitive, *triangle, own, pictured),
            });
            next += 1;
        }
    }
    points
}

/// How many pictures lie along a unit of length on a triangle of some area: the root of how large it is on its picture, beside that.
fn pictures_a_length(primitive: &Primitive, triangle: [u32; 3], area: f64, pictured: &Pictured) -> f64 {
    picture_of(primitive, pictured).map_or(0.0, |(uvs, pictures)| {
        let [a, b, c] = triangle.map(|corner| DVec2::from_array(uvs[corner as usize].map(f64::from)));
        pictures * (0.5 * (b - a).perp_dot(c - a).abs() / area).sqrt()
    })
}

/// The longest side of the box around everything.
fn extent(primitives: &[Primitive]) -> f64 {
    let places = primitives.iter().flat_map(|p| &p.positions);
    let bounds = Bounds::around(places.map(|place| place.map(f64::from)));
    bounds.size_m().into_iter().fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lod::{LodSettings, Method, chain};
    use crate::source::SourceModel;

    /// What lies in a rectangle of the floor from one corner to the opposite, in squares with an edge of about `step`.
    fn floor([x0, z0]: [f32; 2], [x1, z1]: [f32; 2], step: f32, material: usize, into: &mut Vec<Primitive>) {
        let place = into
            .iter()
            .position(|p| p.material == Some(material))
            .unwrap_or_else(|| {
                into.push(Primitive {
                    material: Some(material),
                    ..Primitive::default()
                });
                into.len() - 1
            });
        let primitive = &mut into[place];
        let counts = [x1 - x0, z1 - z0].map(|side| (side / step).round().max(1.0) as u32);
        let first = primitive.positions.len() as u32;
        for j in 0..=counts[1] {
            for i in 0..=counts[0] {
                let share = |from: f32, to: f32, k: u32, n: u32| from + (to - from) * k as f32 / n as f32;
                primitive
                    .positions
                    .push([share(x0, x1, i, counts[0]), 0.0, share(z0, z1, j, counts[1])]);
            }
        }
        for j in 0..counts[1] {
            for i in 0..counts[0] {
                let at = first + j * (counts[0] + 1) + i;
                let above = at + counts[0] + 1;
                primitive.indices.extend([at, above, at + 1, at + 1, above, above + 1]);
            }
        }
    }

    /// Fields of a metre of two materials, so many along each side.
    fn chess(fields: usize, step: f32) -> Vec<Primitive> {
        let mut primitives = Vec::new();
        for z in 0..fields {
            for x in 0..fields {
                let corner = [x as f32, z as f32];
                floor(corner, corner.map(|at| at + 1.0), step, (x + z) % 2, &mut primitives);
            }
        }
        primitives
    }

    fn error(source: &[Primitive], level: &[Primitive], pictured: &[usize]) -> f64 {
        let pictured = pictured.iter().map(|material| (*material, (0, 1.0))).collect();
        Looks::of(source, &pictured)
            .expect("something is painted")
            .error_of(level, &ShapeTree::of(level))
    }

    #[test]
    fn what_shows_as_the_source_does_is_not_off() {
        assert_eq!(error(&chess(4, 0.25), &chess(4, 1.0), &[]), 0.0);
        assert!(
            Looks::of(&chess(1, 0.25), &Pictured::new()).is_none(),
            "one material alone"
        );
    }

    #[test]
    fn a_field_that_vanishes_costs_half_its_width_or_all_of_it_in_a_corner() {
        let mut white = Vec::new();
        floor([0.0, 0.0], [6.0, 6.0], 6.0, 0, &mut white);
        let off = error(&chess(6, 0.25), &white, &[]);
        assert!((0.5..=1.0).contains(&off), "{off}");
    }

    #[test]
    fn a_border_that_moves_costs_half_its_way() {
        let with_border = |at: f32| {
            let mut primitives = Vec::new();
            floor([0.0, 0.0], [at, 2.0], 0.5, 0, &mut primitives);
            floor([at, 0.0], [4.0, 2.0], 0.5, 1, &mut primitives);
            primitives
        };
        let off = error(&with_border(2.0), &with_border(2.25), &[]);
        assert!((0.1..=0.125).contains(&off), "{off}");
    }

    #[test]
    fn a_picture_that_is_shifted_costs_its_way_where_there_is_one() {
        let at = |shift: f32| {
            let mut primitives = Vec::new();
            floor([0.0, 0.0], [4.0, 4.0], 1.0, 0, &mut primitives);
            let uvs = primitives[0]
                .positions
                .iter()
                .map(|[x, _, z]| [x / 2.0 + shift, z / 2.0]);
            primitives[0].uvs = vec![uvs.collect()];
            primitives
        };
        let off = error(&at(0.0), &at(0.1), &[0]);
        assert!((off - 0.2).abs() < 1e-3, "{off}");
        assert!(Looks::of(&at(0.0), &Pictured::new()).is_none(), "no picture");
    }

    #[test]
    fn a_small_sign_that_shows_another_part_of_its_picture_is_off_however_large_the_wall_is() {
        let sign = |shift: f32| {
            let mut primitives = Vec::new();
            floor([0.0, 0.0], [50.0, 50.0], 1.0, 0, &mut primitives);
            floor([60.0, 0.0], [61.0, 1.0], 1.0, 1, &mut primitives);
            let uvs = primitives[1].positions.iter().map(|[x, _, z]| [x - 60.0 + shift, *z]);
            primitives[1].uvs = vec![uvs.collect()];
            primitives
        };
        let off = error(&sign(0.0), &sign(0.25), &[1]);
        assert!((off - 0.25).abs() < 1e-3, "{off}");
    }

    #[test]
    fn two_sides_of_a_board_are_not_taken_for_each_other() {
        let mut board = Vec::new();
        floor([0.0, 0.0], [4.0, 4.0], 1.0, 0, &mut board);
        floor([0.0, 0.0], [4.0, 4.0], 1.0, 1, &mut board);
        for (primitive, turned) in board.iter_mut().zip([1.0, -1.0]) {
            let uvs = primitive.positions.iter().map(|[x, _, z]| [turned * x / 4.0, z / 4.0]);
            primitive.uvs = vec![uvs.collect()];
            primitive.colors = vec![[turned.max(0.0); 4]; primitive.positions.len()];
        }
        assert_eq!(error(&board, &board, &[0, 1]), 0.0);
    }

    #[test]
    fn colours_cost_a_tenth_of_the_extent() {
        let coloured = |color: [f32; 4]| {
            let mut primitives = Vec::new();
            floor([0.0, 0.0], [4.0, 4.0], 1.0, 0, &mut primitives);
            primitives[0].colors = vec![color; primitives[0].positions.len()];
            primitives
        };
        let off = error(&coloured([1.0, 1.0, 1.0, 1.0]), &coloured([0.5, 0.75, 1.0, 1.0]), &[]);
        assert!((off - 0.5 * 0.1 * 4.0).abs() < 1e-6, "{off}");
    }

    #[test]
    fn no_level_of_a_chess_floor_is_near_to_it_that_has_lost_its_fields() {
        let model = SourceModel {
            primitives: chess(8, 0.2),
            ..SourceModel::default()
        };
        for method in [Method::Octree, Method::Quadric, Method::Best] {
            let settings = LodSettings {
                method,
                ..LodSettings::default()
            };
            let levels = chain(&model, &settings).levels;
            for level in &levels[1..] {
                let off = error(&model.primitives, &level.primitives, &[]);
                assert!(
                    level.geometric_error >= off,
                    "{method}: {} states less",
                    level.triangles
                );
                assert!(
                    level.triangles >= 128 || level.geometric_error > 0.2,
                    "{method}: {} triangles state {}",
                    level.triangles,
                    level.geometric_error
                );
            }
            assert!(
                method == Method::Octree || levels.iter().any(|l| l.triangles < 1600 && l.geometric_error < 0.1),
                "{method}: nothing keeps the fields with fewer triangles: {:?}",
                levels
                    .iter()
                    .map(|l| (l.triangles, l.geometric_error))
                    .collect::<Vec<_>>()
            );
        }
    }
}
