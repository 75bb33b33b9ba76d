//! Which models stand in so many places that their triangles are held once, and how does a ray meet them there?
//!
//! Rays are fastest where everything is flattened into one tree. A wood of a few kinds of trees, though, is a hundred times
//! as large flattened as not. So all is flattened up to a limit, and beyond that the models that save most are held once, in
//! their own space: a tree over the boxes of their places leads a ray there, and it goes on in the space of the model.

use glam::{DMat3, Mat3, Vec3, Vec3A};
use obvhs::{
    aabb::Aabb,
    bvh2::Bvh2,
    ray::{Ray, RayHit},
};

use super::{
    cast::Facet,
    flatten::{self, Placing},
    mesh::{Mesh, padded},
    tree::{each_near, tree_over},
};
use crate::source::{SourceModel, SourceObject, SourceScene};

/// A model is held in its own space only when it stands no further than so many times its size from the zero of that space,
/// so that rays lose nothing there.
const MAX_OFF_CENTER: f64 = 64.0;
/// … and is placed by a matrix that stretches no direction more than so many times as much as another.
const MAX_STRETCH: f64 = 1e3;

/// Which models are held once.
pub(super) struct Once(pub(super) Vec<bool>);

impl Once {
    /// The models that save most, as long as more than so many triangles would be flattened.
    pub(super) fn of(scene: &SourceScene, most_flat: usize) -> Self {
        let triangles: Vec<usize> = scene.models.iter().map(SourceModel::triangle_count).collect();
        let mut flat: usize = scene.objects.iter().map(|object| triangles[object.model]).sum();
        let mut once = vec![false; scene.models.len()];
        if flat <= most_flat {
            return Self(once);
        }
        let mut places = vec![0usize; scene.models.len()];
        for object in &scene.objects {
            places[object.model] += usize::from(is_placed_well(object));
        }
        let saves = |model: usize| triangles[model] * places[model].saturating_sub(1);
        let mut order: Vec<usize> = (0..scene.models.len())
            .filter(|model| saves(*model) > 0 && is_centered(&scene.models[*model]))
            .collect();
        order.sort_by_key(|model| (std::cmp::Reverse(saves(*model)), *model));
        for model in order {
            if flat <= most_flat {
                break;
            }
            once[model] = true;
            flat -= triangles[model] * places[model];
        }
        Self(once)
    }

    /// Whether an object is one of the places of a model that is held once.
    pub(super) fn places(&self, object: &SourceObject) -> bool {
        self.0[object.model] && is_placed_well(object)
    }
}

fn is_centered(model: &SourceModel) -> bool {
    let points = model.primitives.iter().flat_map(|primitive| &primitive.positions);
    let bounds = belvedere_scene::Bounds::around(points.map(|p| p.map(f64::from)));
    let reach = bounds
        .min
        .iter()
        .chain(&bounds.max)
        .fold(0.0, |most, x| x.abs().max(most));
    !bounds.is_empty() && reach <= MAX_OFF_CENTER * bounds.diagonal_m()
}

/// Whether rays lose nothing in the space of an object that is placed like this.
fn is_placed_well(object: &SourceObject) -> bool {
    let matrix = DMat3::from_mat4(object.world_from_object);
    let lengths = matrix
        .to_cols_array_2d()
        .map(|column| glam::DVec3::from(column).length());
    let [least, most] = [f64::min, f64::max].map(|of| lengths.into_iter().reduce(of).unwrap_or(0.0));
    // How far the columns are from standing on each other.
    let upright = matrix.determinant().abs() / (lengths[0] * lengths[1] * lengths[2]);
    most <= MAX_STRETCH * least && upright >= 1.0 / MAX_STRETCH
}

/// Models that are held once, and where they stand.
#[derive(Default)]
pub(super) struct Copies {
    pub(super) meshes: Vec<Mesh>,
    placed: Vec<Placed>,
    tree: Bvh2,
}

/// A model where it stands.
pub(super) struct Placed {
    pub(super) mesh: usize,
    pub(super) placing: Placing,
    /// Where the zero of its space stands, relative to the world's origin.
    at: Vec3,
    mesh_from_world: Mat3,
}

impl Placed {
    pub(super) fn new(mesh: usize, placing: Placing) -> Self {
        let matrix = placing.matrix();
        Self {
            mesh,
            at: matrix.w_axis.truncate().as_vec3(),
            mesh_from_world: DMat3::from_mat4(matrix).inverse().as_mat3(),
            placing,
        }
    }

    /// A ray in the space of the model; lengths of its direction stay what they are.
    fn enter(&self, ray: &Ray) -> Ray {
        let (origin, direction) = (Vec3::from(ray.origin) - self.at, Vec3::from(ray.direction));
        let [origin, direction] = [origin, direction].map(|v| Vec3A::from(self.mesh_from_world * v));
        Ray::new(origin, direction, ray.tmin, ray.tmax)
    }

    /// The box in the space of the model around a box of the world's.
    fn enter_box(&self, around: &Aabb) -> Aabb {
        let (center, half) = (
            Vec3::from(around.center()) - self.at,
            0.5 * Vec3::from(around.diagonal()),
        );
        let center = self.mesh_from_world * center;
        let m = self.mesh_from_world;
        let half = half.x * m.x_axis.abs() + half.y * m.y_axis.abs() + half.z * m.z_axis.abs();
        padded(Aabb::new((center - half).into(), (center + half).into()))
    }
}

impl Copies {
    /// Models that stand where `placed` says, each with the box around it.
    pub(super) fn new(meshes: Vec<Mesh>, placed: Vec<(Placed, Aabb)>) -> Self {
        let boxes: Vec<_> = placed.iter().map(|(_, bounds)| padded(*bounds)).collect();
        Self {
            meshes,
            tree: tree_over(&boxes),
            placed: placed.into_iter().map(|(placed, _)| placed).collect(),
        }
    }

    pub(super) fn placed(&self, number: usize) -> &Placed {
        &self.placed[number]
    }

    /// Calls with every facet of every copy that a ray meets before its end, which is where `meet` says that it was, if
    /// anywhere. `wanted` says which objects count.
    pub(super) fn traverse(
        &self,
        ray: Ray,
        wanted: impl Fn(u32) -> bool,
        mut meet: impl FnMut(&Placing, &Ray, &Facet) -> f32,
    ) {
        if self.placed.is_empty() {
            return;
        }
        self.tree.ray_traverse(ray, &mut RayHit::none(), |ray, index| {
            let placed = &self.placed[self.tree.primitive_indices[index] as usize];
            let mut nearest = f32::INFINITY;
            if wanted(placed.placing.object()) {
                self.meshes[placed.mesh].traverse(placed.enter(ray), |ray, facet| {
                    let t = meet(&placed.placing, ray, facet);
                    nearest = nearest.min(t);
                    t
                });
            }
            nearest
        });
    }

    /// Calls with every triangle of a copy that may reach into a box, by its place in the model.
    pub(super) fn near(&self, around: Aabb, visit: &mut dyn FnMut(&Placed, usize)) {
        each_near(&self.tree, around, |index| {
            let index = index as usize;
            let placed = &self.placed[index];
            self.meshes[placed.mesh].near(placed.enter_box(&around), &mut |triangle| visit(placed, triangle));
        });
    }
}

/// A model held once, ready for rays.
pub(super) fn mesh_of(scene: &SourceScene, model: usize) -> Mesh {
    Mesh::of(flatten::triangles(scene, &scene.models[model]).collect())
}
