//! Which objects does a grown model consist of?

use std::collections::BTreeMap;
use std::sync::Arc;

use belvedere_scene::procedural::{Grown, Instance, Mesh, Part, Program, Recipe, SaidInFile, Settings, Surface, Watch};
use glam::{DMat4, DVec3, Vec3};
use serde_json::json;

use super::absorb::absorb;
use super::alone::Alone;
use super::details::coarser;
use super::marks;
use super::poses::pose;
use crate::defect::Defects;
use crate::growable::Tie;
use crate::import::limits::Budget;
use crate::import::mark::Mark;
use crate::import::topology::compact;
use crate::import::{ImportError, Limits};
use crate::progress::Progress;
use crate::source::{
    self, Authored, AuthoredShape, Material, Primitive, Role, SourceModel, SourceObject, SourceRecipe, SourceScene,
    SourceViewpoint, Topology,
};

/// A glTF file by the name that rules give it.
type Import<'i> = &'i mut dyn FnMut(&str) -> Result<SourceScene, ImportError>;

/// The texts of all files, and the seed.
pub(super) type Rules = (Arc<BTreeMap<String, String>>, u32);

/// With what the model was grown, and where to count what is wrong.
pub(super) struct Growing<'a> {
    pub(super) program: &'a Program,
    /// Where its files lie, from the source's folder.
    pub(super) folder: &'a str,
    /// How each part that can be made alone is made of the program.
    pub(super) recipes: &'a [Option<Recipe>],
    pub(super) rules: &'a Rules,
    pub(super) settings: &'a Settings,
    /// Whether what the author made coarser is wanted too.
    pub(super) with_levels: bool,
    /// Who looks on, and hears of steps.
    pub(super) progress: &'a dyn Progress,
    pub(super) watch: Watch<'a>,
    pub(super) defects: &'a mut Defects,
}

/// The scene that a model makes, within the limits: objects are counted, triangles of authored shapes take memory.
pub(super) fn scene_of(
    grown: &Grown,
    growing: Growing<'_>,
    (limits, budget): (&Limits, &Budget),
    import: Import,
) -> Result<SourceScene, ImportError> {
    let mut scene = SourceScene {
        title: Some(grown.parts[0].name.clone()),
        ..SourceScene::default()
    };
    let material_of = add_materials(grown, &mut scene);
    let Growing {
        program,
        folder,
        recipes,
        rules,
        settings,
        with_levels,
        progress,
        watch,
        defects,
    } = growing;
    let mut alone = Alone {
        program,
        settings,
        surfaces: &grown.materials,
        material_of: &material_of,
        added: Vec::new(),
        budget,
        progress,
        watch,
        steps: grown.usage.steps,
    };
    let mut models: Vec<Option<SourceModel>> = Vec::with_capacity(grown.parts.len());
    for (index, part) in grown.parts.iter().enumerate() {
        let mut made = model(part, &material_of, rules);
        if let Some(model) = &mut made {
            model.tie = tie(part, index == 0);
            let made = (part, recipes[index].as_ref());
            pose(model, made, &mut alone, (&mut scene, defects))?;
            if with_levels {
                model.coarser = coarser(made, &mut alone, &mut scene, defects);
            }
        }
        models.push(made);
    }
    marks::note(grown, &models, (program, folder), defects);
    marks::note_lookalikes(grown, (program, folder), defects);
    let mut model_of = vec![None; models.len()];
    let mut imported: BTreeMap<&str, Vec<SourceObject>> = BTreeMap::new();
    let files: Vec<&str> = program.files().map(|(file, _)| file).collect();
    let mut places = BTreeMap::new();
    let mut place_of = |said: SaidInFile| {
        let place = || {
            Arc::new(source::Said {
                texts: rules.0.clone(),
                folder: String::new(),
                file: files[said.file].to_owned(),
                at: said.at,
            })
        };
        Arc::clone(places.entry(said).or_insert_with(place))
    };
    for instance in grown.instances() {
        let part = &grown.parts[instance.part];
        let world_from_part = matrix(&instance);
        for (name, frame) in &part.viewpoints {
            let world_from_camera = world_from_part * DMat4::from_cols_array(&frame.columns());
            scene.viewpoints.push(SourceViewpoint {
                name: name.clone(),
                world_from_camera: rigid(world_from_camera),
            });
        }
        for (path, frame) in &part.models {
            if !imported.contains_key(path.as_str()) {
                let objects = absorb(&mut scene, import(path)?);
                imported.insert(path, objects);
            }
            let world_from_model = world_from_part * DMat4::from_cols_array(&frame.columns());
            for object in &imported[path.as_str()] {
                check_room(&scene, limits, path)?;
                scene.objects.push(SourceObject {
                    world_from_object: world_from_model * object.world_from_object,
                    ..object.clone()
                });
            }
        }
        let Some(model) = &models[instance.part] else { continue };
        let mark = Mark::of_name(instance.name);
        if let Some(Mark::Authored(kind)) = mark {
            let triangles = model.primitives.iter().map(|primitive| primitive.indices.len() / 3);
            let name = || instance.name.to_owned();
            budget.claim(triangles.sum(), size_of::<[DVec3; 3]>(), name)?;
            let triangles = model.primitives.iter().flat_map(Primitive::exact_triangles);
            kind.list(&mut scene.authored).push(AuthoredShape {
                said: instance.said.map(&mut place_of),
                ..AuthoredShape::placed(name(), triangles, world_from_part)
            });
            continue;
        }
        check_room(&scene, limits, instance.name)?;
        let index = *model_of[instance.part].get_or_insert_with(|| {
            scene.models.push(model.clone());
            scene.models.len() - 1
        });
        scene.objects.push(SourceObject {
            source_node: instance.name.to_owned(),
            part: 0,
            model: index,
            world_from_object: world_from_part,
            role: match mark {
                Some(Mark::Drawn(role)) => role,
                _ => Role::Ordinary,
            },
        });
    }
    let Authored {
        cells,
        portals,
        occluders,
    } = &mut scene.authored;
    let shapes = cells.iter_mut().chain(portals).chain(occluders);
    let objects = scene.objects.iter_mut().map(|object| &mut object.source_node);
    number(objects.chain(shapes.map(|shape| &mut shape.node)).collect());
    number_viewpoints(&mut scene);
    Ok(scene)
}

/// Whether there may be one more object.
fn check_room(scene: &SourceScene, limits: &Limits, place: &str) -> Result<(), ImportError> {
    let limit = limits.max_objects;
    if scene.objects.len() >= limit {
        let place = place.to_owned();
        return Err(ImportError::TooManyObjects { place, limit });
    }
    Ok(())
}

/// Gives each viewpoint a name of its own.
pub(crate) fn number_viewpoints(scene: &mut SourceScene) {
    let names = scene.viewpoints.iter_mut().map(|viewpoint| &mut viewpoint.name);
    number(names.collect());
}

/// Gives each a name of its own: `tree`, `tree 2`, `tree 3` …; where something is called `tree 2` already, the second tree
/// takes the first number that no tree has.
fn number(names: Vec<&mut String>) {
    /// How many there are of a name, how many of them have been met, and the last number that was given.
    #[derive(Default)]
    struct Count {
        all: usize,
        met: usize,
        last: usize,
    }
    let mut counts: BTreeMap<String, Count> = BTreeMap::new();
    for name in &names {
        if let Some(count) = counts.get_mut(name.as_str()) {
            count.all += 1;
        } else {
            let count = Count {
                all: 1,
                ..Count::default()
            };
            counts.insert((*name).clone(), count);
        }
    }
    for name in names {
        let Some(count) = counts.get_mut(name.as_str()) else {
            continue;
        };
        count.met += 1;
        if count.met == 1 {
            continue;
        }
        let (mut number, mut last) = (count.met, count.last.max(count.all));
        while counts.contains_key(&format!("{name} {number}")) {
            last += 1;
            number = last;
        }
        if let Some(count) = counts.get_mut(name.as_str()) {
            count.last = last;
        }
        *name = format!("{name} {number}");
    }
}

fn matrix(instance: &Instance) -> DMat4 {
    DMat4::from_cols_array(&instance.world_from_part.columns())
}

/// Without scale: a viewpoint has a place and directions only.
fn rigid(world_from_camera: DMat4) -> DMat4 {
    let (_, rotation, translation) = world_from_camera.to_scale_rotation_translation();
    DMat4::from_rotation_translation(rotation.normalize(), translation)
}

/// Adds the materials that some triangle has; where each of the model's lies in the scene.
fn add_materials(grown: &Grown, scene: &mut SourceScene) -> BTreeMap<usize, usize> {
    let mut material_of = BTreeMap::new();
    for mesh in grown.parts.iter().flat_map(|part| &part.meshes) {
        material_of.entry(mesh.material).or_insert_with(|| {
            scene.materials.push(material(&grown.materials[mesh.material]));
            scene.materials.len() - 1
        });
    }
    material_of
}

pub(super) fn material(surface: &Surface) -> Material {
    let [r, g, b] = surface.colour;
    let mut gltf = json!({
        "name": surface.name,
        "pbrMetallicRoughness": {
            "baseColorFactor": [r, g, b, surface.opacity],
            "metallicFactor": surface.metallic,
            "roughnessFactor": surface.roughness,
        },
    });
    if surface.emissive != [0.0; 3] {
        gltf["emissiveFactor"] = json!(surface.emissive);
    }
    if surface.opacity < 1.0 {
        gltf["alphaMode"] = json!("BLEND");
    }
    if surface.double_sided {
        gltf["doubleSided"] = json!(true);
    }
    if surface.recolour {
        gltf["extras"] = json!({"belvedere": {"recolour": true}});
    }
    Material {
        gltf,
        see_through: surface.opacity < 1.0,
        double_sided: surface.double_sided,
    }
}

/// A part's triangles; `None` when it has none with an area.
fn model(part: &Part, material_of: &BTreeMap<usize, usize>, (texts, seed): &Rules) -> Option<SourceModel> {
    let meshes = part.meshes.iter();
    let primitives = meshes.map(|mesh| primitive(mesh, material_of.get(&mesh.material).copied()));
    let primitives: Vec<Primitive> = primitives.filter(|primitive| !primitive.indices.is_empty()).collect();
    let recipe = |recipe: &Recipe| SourceRecipe {
        texts: texts.clone(),
        recipe: recipe.clone(),
        seed: *seed,
    };
    (!primitives.is_empty()).then(|| SourceModel {
        name: part.name.clone(),
        primitives,
        impostor: part.impostor,
        recipe: part.recipe.as_ref().map(recipe),
        ..SourceModel::default()
    })
}

/// What keeps a part from being made alone, which may be the whole of what has grown.
fn tie(part: &Part, is_whole: bool) -> Option<Tie> {
    let holds_others = !part.placements.is_empty() || !part.models.is_empty();
    match part.recipe {
        Some(_) => None,
        None if part.called.is_some() => Some(Tie::Called),
        None if holds_others && is_whole => Some(Tie::Outside),
        None if holds_others => Some(Tie::Others),
        None => part.takes_paint.then_some(Tie::Paint),
    }
}

/// Triangles that are left out, each part once.
pub(super) fn without_area(grown: &Grown) -> u64 {
    let meshes = grown.parts.iter().flat_map(|part| &part.meshes);
    let of_mesh = |mesh: &Mesh| {
        let triangles = mesh.indices.as_chunks::<3>().0.iter();
        triangles.filter(|triangle| !has_area(mesh, triangle)).count() as u64
    };
    meshes.map(of_mesh).sum()
}

fn has_area(mesh: &Mesh, triangle: &[u32; 3]) -> bool {
    let [a, b, c] = triangle.map(|i| Vec3::from_array(mesh.positions[i as usize]));
    (b - a).cross(c - a) != Vec3::ZERO
}

pub(super) fn primitive(mesh: &Mesh, material: Option<usize>) -> Primitive {
    let mut indices: Vec<u32> = mesh
        .indices
        .as_chunks::<3>()
        .0
        .iter()
        .filter(|triangle| has_area(mesh, triangle))
        .flatten()
        .copied()
        .collect();
    let used = compact(&mut indices);
    let pick = |values: &[[f32; 3]]| used.iter().map(|i| values[*i as usize]).collect();
    Primitive {
        topology: Topology::Triangles,
        material,
        positions: pick(&mesh.positions),
        normals: pick(&mesh.normals),
        indices,
        ..Primitive::default()
    }
}
