//! Which mesh has so many shapes and is nearest to the source?
//!
//! Asks the octree, the quadric generator, or both, and measures what they give. The error is the same for either, a true bound of
//! distances or, where that is more, how far off is what is painted ([`Looks`]), and it is what clients switch levels by: so the
//! smaller one wins.

use std::cell::OnceCell;

use crate::lod::collapse::{Collapsed, SourceShapes};
use crate::lod::error::{hausdorff_bound, hausdorff_bound_of};
use crate::lod::looks::Looks;
use crate::lod::octree::{Locked, Octree};
use crate::lod::proximity::ShapeTree;
use crate::lod::quadric::QuadricSource;
use crate::lod::reduction::Reduction;
use crate::lod::{LodLevel, LodSettings, Method, shape_count};
use crate::source::{Primitive, SourceModel, Topology};

/// A model, to be asked for ever coarser levels.
pub struct Generator<'a> {
    model: &'a SourceModel,
    settings: &'a LodSettings,
    locked: Locked,
    shapes: SourceShapes<'a>,
    /// Made when something is first measured.
    source: OnceCell<ShapeTree>,
    /// Likewise; nothing where all of it looks alike.
    looks: OnceCell<Option<Looks<'a>>>,
    quadric: Option<QuadricSource<'a>>,
    /// Lines and points, which the quadric generator leaves alone.
    thin: Option<Thin>,
    /// Made when it is first needed.
    reduction: Option<Reduction>,
}

impl<'a> Generator<'a> {
    /// Of a model. Cost: O(n log n) for n shapes.
    #[must_use]
    pub fn new(model: &'a SourceModel, settings: &'a LodSettings) -> Self {
        let locked = Locked::new(&model.cut_positions);
        let shapes = SourceShapes::new(&model.primitives, &settings.double_sided);
        let has_quadric = settings.method != Method::Octree && model.triangle_count() > 0;
        Self {
            quadric: has_quadric.then(|| QuadricSource::new(&model.primitives, &shapes, &locked)),
            thin: has_quadric.then(|| Thin::of(model, &locked, settings)).flatten(),
            reduction: None,
            source: OnceCell::new(),
            looks: OnceCell::new(),
            model,
            settings,
            locked,
            shapes,
        }
    }

    /// A level with at most about so many shapes, or as few as can be. `None` when nothing would be left.
    pub fn level(&mut self, target: usize) -> Option<LodLevel> {
        let by_quadric = self.by_quadric(target);
        let by_quadric = by_quadric.and_then(|mesh| self.measured(mesh, f64::INFINITY));
        if by_quadric.is_some() && self.settings.method == Method::Quadric {
            return by_quadric;
        }
        let of_interest = by_quadric.as_ref().map_or(f64::INFINITY, |level| level.geometric_error);
        let by_octree = self.by_octree(target);
        by_octree
            .and_then(|mesh| self.measured(mesh, of_interest))
            .or(by_quadric)
    }

    /// How far off is what the model's author made coarser?
    pub(super) fn authors(&self) -> Vec<LodLevel> {
        let limits = self.settings.error_limits;
        let measured = self.model.coarser.iter().map(|primitives| {
            let level = ShapeTree::of(primitives);
            let distance = hausdorff_bound_of(self.source(), &level, limits);
            LodLevel::new(primitives.clone(), distance.max(self.off(primitives, &level)))
        });
        measured.filter(|level| level.geometric_error.is_finite()).collect()
    }

    /// What the octree makes of it, not measured.
    pub fn octree_mesh(&mut self, target: usize) -> Option<Vec<Primitive>> {
        self.by_octree(target).map(|mesh| mesh.primitives)
    }

    /// What the quadric generator makes of it, not measured. `None` when that misses the target, and when the settings
    /// do not ask for it.
    pub fn quadric_mesh(&mut self, target: usize) -> Option<Vec<Primitive>> {
        self.by_quadric(target).map(|mesh| mesh.primitives)
    }

    fn source(&self) -> &ShapeTree {
        self.source.get_or_init(|| ShapeTree::of(&self.model.primitives))
    }

    /// How far off a level shows what is painted.
    fn off(&self, level: &[Primitive], tree: &ShapeTree) -> f64 {
        let (model, settings) = (self.model, self.settings);
        let looks = self
            .looks
            .get_or_init(|| Looks::of(&model.primitives, &settings.pictured));
        looks.as_ref().map_or(0.0, |looks| looks.error_of(level, tree))
    }

    fn by_quadric(&mut self, target: usize) -> Option<Collapsed> {
        let quadric = self.quadric.as_ref()?;
        let share = target as f64 / shape_count(&self.model.primitives) as f64;
        let mut mesh = quadric.simplify((share * quadric.triangles() as f64) as usize)?;
        if let Some(thin) = &mut self.thin {
            thin.add_to(&mut mesh, share, self.settings);
        }
        Some(mesh)
    }

    fn by_octree(&mut self, target: usize) -> Option<Collapsed> {
        let primitives = &self.model.primitives;
        let reduction = self.reduction.get_or_insert_with(|| {
            Reduction::new(Octree::new(primitives, &self.locked, &self.settings.octree), primitives)
        });
        let mesh = self.shapes.collapse(&reduction.clusters_for(target));
        let is_solid = mesh.primitives.iter().any(|p| p.topology == Topology::Triangles);
        (!mesh.origins.is_empty() && (is_solid || self.model.triangle_count() == 0)).then_some(mesh)
    }

    fn measured(&self, mesh: Collapsed, of_interest: f64) -> Option<LodLevel> {
        let level = ShapeTree::of(&mesh.primitives);
        let limits = self.settings.error_limits;
        let distance = hausdorff_bound(self.source(), &level, &mesh.origins, limits, of_interest)?;
        let error = distance.max(self.off(&mesh.primitives, &level));
        (error < of_interest).then(|| LodLevel::new(mesh.primitives, error))
    }
}

/// The lines and points of a model that has triangles too.
struct Thin {
    primitives: Vec<Primitive>,
    /// For each of their shapes, its number among all of the model.
    shapes: Vec<u32>,
    reduction: Reduction,
}

impl Thin {
    fn of(model: &SourceModel, locked: &Locked, settings: &LodSettings) -> Option<Self> {
        let (mut primitives, mut shapes, mut first) = (Vec::new(), Vec::new(), 0);
        for primitive in &model.primitives {
            let count = primitive.count() as u32;
            if primitive.topology != Topology::Triangles && count > 0 {
                primitives.push(primitive.clone());
                shapes.extend(first..first + count);
            }
            first += count;
        }
        let octree = (!primitives.is_empty()).then(|| Octree::new(&primitives, locked, &settings.octree))?;
        Some(Self {
            reduction: Reduction::new(octree, &primitives),
            primitives,
            shapes,
        })
    }

    /// Adds about a share of them.
    fn add_to(&mut self, mesh: &mut Collapsed, share: f64, settings: &LodSettings) {
        let target = (share * self.shapes.len() as f64).ceil() as usize;
        let shapes = SourceShapes::new(&self.primitives, &settings.double_sided);
        let thin = shapes.collapse(&self.reduction.clusters_for(target));
        mesh.primitives.extend(thin.primitives);
        mesh.origins
            .extend(thin.origins.iter().map(|&shape| self.shapes[shape as usize]));
    }
}
