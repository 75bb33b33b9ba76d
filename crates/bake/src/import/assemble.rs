//! Which objects does the scene have? Nodes, meshes, skins and instances put together.

use std::collections::BTreeMap;

use glam::{DMat3, DMat4};

use super::document::Item;
use super::instances::Instances;
use super::mark::{AuthoredKind, Mark};
use super::nodes::{Hierarchy, PlacedNode, walk};
use super::poses::{Movements, Skinned, moving};
use super::primitives::{ReadPrimitive, Wanted, read as read_primitive};
use super::procedural::{self, Ground, Nursery, Planting, Wish};
use super::reader::Reader;
use super::skin::{Placed, Skin, flatten};
use super::{ImportError, Limits, extras, finish, impostor, materials, uv_sets};
use crate::progress::Stage;
use crate::source::{AuthoredShape, Role, SourceModel, SourceObject, SourceScene};

/// What moving a vertex by its own matrix takes: the matrix, its position in f64, and every attribute once more.
const MOVED_VERTEX_BYTES: usize = 400;

/// A mesh, with the bits of the morph weights that a node gives it in place of the mesh's own.
type MeshKey = (usize, Option<Vec<u64>>);

/// The scene under construction.
struct Assembly<'r, 'a> {
    reader: &'r mut Reader<'a>,
    hierarchy: &'r Hierarchy,
    movements: Movements,
    limits: &'r Limits,
    scene: SourceScene,
    /// Shared models by mesh; `None` when nothing of the mesh can be drawn.
    models: BTreeMap<MeshKey, Option<usize>>,
    /// Whether meshes have morph targets.
    has_targets: BTreeMap<usize, bool>,
}

/// Reads everything that the document's scene draws; what rules grow at its nodes, where they may.
pub(super) fn assemble(reader: &mut Reader, ground: Ground, nodes_grow: bool) -> Result<SourceScene, ImportError> {
    let Ground { limits, progress, .. } = ground;
    let animations = reader.root.length("animations") as u64;
    reader
        .defects
        .note("animation: not played", animations, || "/animations/0".into());
    extras::note_unknown(&reader.root, &mut reader.defects);
    let mut hierarchy = walk(reader)?;
    let drawn = hierarchy.nodes.iter().enumerate();
    let drawn = drawn.filter(|(_, node)| matches!(node.mark, Mark::Drawn(_)));
    let wishes = drawn.filter_map(|(place, node)| {
        let item = reader.root.listed("nodes", node.index).ok()?;
        Some((place, Wish::of(item.value)?))
    });
    let mut wishes: BTreeMap<usize, Wish> = wishes.collect();
    let steps = procedural::steps_of(wishes.values().filter(|_| nodes_grow), limits);
    progress.start(Stage::Import, steps + hierarchy.nodes.len() as u64);
    let mut assembly = Assembly {
        reader,
        hierarchy: &hierarchy,
        movements: Movements::default(),
        limits,
        scene: SourceScene::default(),
        models: BTreeMap::new(),
        has_targets: BTreeMap::new(),
    };
    let mut plantings = Vec::new();
    for (place, node) in hierarchy.nodes.iter().enumerate() {
        if progress.cancelled() {
            return Err(ImportError::Cancelled);
        }
        let item = assembly.reader.root.listed("nodes", node.index);
        match (node.mark, assembly.reader.settle(item)?) {
            (Mark::Authored(kind), Some(item)) => {
                let rules = u64::from(Wish::of(item.value).is_some());
                let defect = "rules at a node that is a cell, a portal or an occluder: not grown";
                assembly.reader.defects.note(defect, rules, || node.name.clone());
                assembly.keep_for_the_bake(node, &item, kind)?;
            }
            (Mark::Drawn(role), Some(item)) => {
                let skin = assembly.reader.settle(item.index("skin"))?.flatten();
                let skin = skin.filter(|_| item.member("mesh").is_some());
                if let Some(wish) = wishes.remove(&place) {
                    plantings.push(Planting {
                        node: node.name.clone(),
                        role,
                        world_from_node: node.world_from_node,
                        wish,
                    });
                }
                assembly.draw(node, &item, (role, skin))?;
            }
            (_, None) | (Mark::Avatar, _) => {}
        }
        progress.advance(1);
    }
    let Assembly { mut scene, .. } = assembly;
    finish::leave_out_unused_models(&mut scene);
    materials::read_used(reader, &mut scene)?;
    uv_sets::fill(reader, &mut scene)?;
    finish::name_what_is_not_kept(reader, &scene);
    let mut nursery = Nursery::default();
    scene.viewpoints = std::mem::take(&mut hierarchy.viewpoints);
    for planting in &plantings {
        if !nodes_grow {
            let kind = "rules in a file that rules place: not grown";
            reader.defects.note(kind, 1, || planting.node.clone());
            continue;
        }
        nursery.plant(&mut scene, planting, (reader, ground))?;
    }
    procedural::number_viewpoints(&mut scene);
    if scene.objects.is_empty() {
        return Err(finish::nothing_to_draw(reader, &scene));
    }
    scene.title = finish::title(reader);
    Ok(scene)
}

impl<'a> Assembly<'_, 'a> {
    /// Adds the objects of one node.
    fn draw(
        &mut self,
        node: &PlacedNode,
        item: &Item<'a>,
        (role, skin): (Role, Option<usize>),
    ) -> Result<(), ImportError> {
        let referred = item.referred(&self.reader.root, "mesh", "meshes");
        let Some((mesh, mesh_item)) = self.reader.settle(referred)?.flatten() else {
            return Ok(());
        };
        // What its mesh asks for, every node of it does.
        let of_mesh = impostor::wished(self.reader, &mesh_item);
        let node = &PlacedNode {
            impostor: impostor::both(node.impostor.clone(), of_mesh),
            ..node.clone()
        };
        let name = || mesh_item.name().map_or_else(|| format!("mesh[{mesh}]"), str::to_owned);
        let own_weights = item.member("weights").is_some() && self.has_targets(mesh, &mesh_item);
        let weighted = if own_weights { item } else { &mesh_item };
        let rest = |position: usize| self.hierarchy.nodes[position].world_from_node;
        let skin = match skin {
            Some(index) => {
                let opened = Skin::open(self.reader, (self.hierarchy, &rest), index);
                self.reader.settle(opened)?.map(|skin| (index, skin))
            }
            None => None,
        };
        if let Some((index, skin)) = skin {
            if item.value.pointer("/extensions/EXT_mesh_gpu_instancing").is_some() {
                let kind = "instances of a skinned mesh: only one is published";
                self.reader.defects.note(kind, 1, || item.place.clone());
            }
            let read = self.read_mesh(&mesh_item, weighted, true)?;
            let vertices: usize = read.iter().map(|r| r.primitive.positions.len()).sum();
            self.reader
                .budget
                .claim(vertices, MOVED_VERTEX_BYTES, || node.name.clone())?;
            // What moves is made to be worn, so its origin is that of its node.
            let origin = moving(node).map(|_| node.world_from_node.w_axis.truncate());
            let posed = skin.pose(&read, origin, (&mut self.reader.defects, &item.place));
            if let Some(placed) = self.reader.settle(posed)? {
                self.reader
                    .defects
                    .note("skinned mesh: published in its rest pose", 1, || item.place.clone());
                let own = self.scene.models.len();
                self.add_own(node, (name(), placed), role)?;
                if let (Some(origin), Some(model)) = (origin, self.scene.models.get_mut(own)) {
                    let skinned = Skinned {
                        node,
                        skin: index,
                        read: &read,
                        origin,
                    };
                    self.movements.give(model, &skinned, (self.reader, self.hierarchy))?;
                }
                return Ok(());
            }
        } else if moving(node).is_some() {
            let kind = "`frames` for a mesh without a skin: one pose drawn";
            self.reader.defects.note(kind, 1, || item.place.clone());
        }
        let bits = |weights: Vec<f64>| weights.iter().map(|w| w.to_bits()).collect();
        let key = (mesh, own_weights.then(|| bits(morph_weights(item))));
        let model = match self.models.get(&key) {
            Some(known) => *known,
            None => {
                let read = self.read_mesh(&mesh_item, weighted, false)?;
                let primitives: Vec<_> = read.into_iter().map(|r| r.primitive).collect();
                let model = (!primitives.is_empty()).then(|| {
                    let name = name();
                    self.scene.models.push(SourceModel {
                        name,
                        primitives,
                        ..SourceModel::default()
                    });
                    self.scene.models.len() - 1
                });
                self.models.insert(key, model);
                model
            }
        };
        let Some(model) = model else { return Ok(()) };
        let opened = Instances::open(self.reader, item);
        match self.reader.settle(opened)? {
            None => Ok(()),
            Some(None) => self.place(node, (model, node.world_from_node), role),
            Some(Some(instances)) => {
                for index in 0..instances.count {
                    let world_from_object = node.world_from_node * instances.node_from_instance(index);
                    self.place(node, (model, world_from_object), role)?;
                }
                Ok(())
            }
        }
    }

    /// Adds the shape of a node that is not drawn: all triangles of its mesh where they stand.
    fn keep_for_the_bake(&mut self, node: &PlacedNode, item: &Item<'a>, kind: AuthoredKind) -> Result<(), ImportError> {
        let referred = item.referred(&self.reader.root, "mesh", "meshes");
        let Some(referred) = self.reader.settle(referred)? else {
            return Ok(());
        };
        let Some((_, mesh)) = referred else {
            // What is below a node takes its mark over.
            if item.member("children").is_none() {
                let defect = "author's cell, portal or occluder without a mesh: left out";
                self.reader.defects.note(defect, 1, || node.name.clone());
            }
            return Ok(());
        };
        let read = self.read_mesh(&mesh, &mesh, false)?;
        let count: usize = read.iter().map(|r| r.primitive.count()).sum();
        let claimed = size_of::<[[f64; 3]; 3]>();
        self.reader.budget.claim(count, claimed, || node.name.clone())?;
        let triangles = read.iter().flat_map(|r| r.primitive.exact_triangles());
        let shape = AuthoredShape::placed(node.name.clone(), triangles, node.world_from_node);
        if shape.triangles.is_empty() {
            let defect = "author's cell, portal or occluder without triangles: left out";
            self.reader.defects.note(defect, 1, || node.name.clone());
            return Ok(());
        }
        kind.list(&mut self.scene.authored).push(shape);
        Ok(())
    }

    /// Adds an object of a shared model.
    fn place(
        &mut self,
        node: &PlacedNode,
        (model, world_from_object): (usize, DMat4),
        role: Role,
    ) -> Result<(), ImportError> {
        let linear = DMat3::from_mat4(world_from_object);
        let defects = &mut self.reader.defects;
        if !world_from_object.is_finite() {
            defects.note("object whose transform is not finite: dropped", 1, || node.name.clone());
            return Ok(());
        }
        if linear == DMat3::ZERO {
            defects.note("object with zero scale: dropped", 1, || node.name.clone());
            return Ok(());
        }
        if linear.determinant() != 0.0 && linear.inverse().is_finite() {
            return self.add(node, (model, world_from_object), role);
        }
        let shared = &self.scene.models[model];
        let vertices: usize = shared.primitives.iter().map(|p| p.positions.len()).sum();
        self.reader
            .budget
            .claim(vertices, MOVED_VERTEX_BYTES, || node.name.clone())?;
        let name = shared.name.clone();
        self.reader.budget.claim(name.len(), 1, || node.name.clone())?;
        let flattened = flatten(
            &shared.primitives,
            world_from_object,
            (&mut self.reader.defects, &node.name),
        );
        match flattened {
            Some(placed) if !placed.primitives.is_empty() => {
                self.reader
                    .defects
                    .note("object flattened by its scale: published as it stands", 1, || {
                        node.name.clone()
                    });
                self.add_own(node, (name, placed), role)
            }
            _ => {
                self.reader
                    .defects
                    .note("object with zero scale: dropped", 1, || node.name.clone());
                Ok(())
            }
        }
    }

    /// Adds an object with a model that no other object has.
    fn add_own(&mut self, node: &PlacedNode, (name, placed): (String, Placed), role: Role) -> Result<(), ImportError> {
        if placed.primitives.is_empty() {
            return Ok(());
        }
        self.scene.models.push(SourceModel {
            name,
            primitives: placed.primitives,
            ..SourceModel::default()
        });
        self.add(node, (self.scene.models.len() - 1, placed.world_from_object), role)
    }

    fn add(
        &mut self,
        node: &PlacedNode,
        (model, world_from_object): (usize, DMat4),
        role: Role,
    ) -> Result<(), ImportError> {
        if self.scene.objects.len() >= self.limits.max_objects {
            return Err(ImportError::TooManyObjects {
                place: node.name.clone(),
                limit: self.limits.max_objects,
            });
        }
        self.reader
            .budget
            .claim(size_of::<SourceObject>() + node.name.len(), 1, || node.name.clone())?;
        let asked = &mut self.scene.models[model].impostor;
        *asked = impostor::joined(*asked, node.impostor.as_ref().map(|asked| asked.wish));
        self.scene.objects.push(SourceObject {
            source_node: node.name.clone(),
            part: 0,
            model,
            world_from_object,
            role,
        });
        Ok(())
    }

    /// Whether a mesh has morph targets; found once.
    fn has_targets(&mut self, mesh: usize, item: &Item) -> bool {
        let find = || {
            let primitives = item.elements("primitives").unwrap_or_default();
            primitives.iter().any(|p| p.member("targets").is_some())
        };
        *self.has_targets.entry(mesh).or_insert_with(find)
    }

    /// Reads what can be drawn of a mesh. `weighted` is what gives the weights of its morph targets: itself or a node.
    fn read_mesh(
        &mut self,
        mesh: &Item<'a>,
        weighted: &Item,
        influences: bool,
    ) -> Result<Vec<ReadPrimitive>, ImportError> {
        let wanted = Wanted {
            morph_weights: &morph_weights(weighted),
            influences,
        };
        let items = self.reader.settle(mesh.elements("primitives"))?.unwrap_or_default();
        self.reader
            .budget
            .claim(items.len(), size_of::<ReadPrimitive>(), || mesh.place.clone())?;
        let mut primitives = Vec::new();
        for item in items {
            let read = read_primitive(self.reader, &item, wanted);
            primitives.extend(self.reader.settle(read)?.flatten());
        }
        Ok(primitives)
    }
}

/// The weights that a node or a mesh states; what is no number weighs nothing.
fn morph_weights(item: &Item) -> Vec<f64> {
    let elements = item.elements("weights").unwrap_or_default();
    elements.iter().map(|w| w.value.as_f64().unwrap_or(0.0)).collect()
}
