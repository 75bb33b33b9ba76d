//! Which rules does a glTF node name? `extras.belvedere`: `{"procedural": "tree.dcg", "parameters": {…}, "seed": 1}`.

use std::collections::BTreeMap;

use belvedere_scene::procedural::limits::MAX_TEXT_BYTES;
use belvedere_scene::procedural::{Settings, Value};
use glam::{DMat3, DMat4, DVec3};
use serde_json::Value as Json;

use super::absorb::absorb;
use super::{Ground, growth_limits, planted};
use crate::defect::Defects;
use crate::import::document::whole;
use crate::import::nodes::{NO_DIRECTION, rigid};
use crate::import::reader::Reader;
use crate::import::uri::relative_path;
use crate::import::{ImportError, impostor};
use crate::source::{Authored, AuthoredShape, Role, SourceObject, SourceScene, SourceViewpoint};

/// Rules that a node names, and where they grow.
#[derive(Debug)]
pub(crate) struct Planting {
    /// The node's name.
    pub(crate) node: String,
    /// What its author said it is.
    pub(crate) role: Role,
    pub(crate) world_from_node: DMat4,
    /// Its `extras.belvedere`.
    pub(crate) wanted: Json,
}

/// What a node's extras say of rules, when they do.
pub(crate) fn wanted(node: &Json) -> Option<&Json> {
    let belvedere = node.pointer("/extras/belvedere")?;
    belvedere.get("procedural").map(|_| belvedere)
}

/// Grows what nodes name; equal wishes once.
#[derive(Default)]
pub(crate) struct Nursery {
    known: BTreeMap<String, Grove>,
}

/// What rules grew, as it stands where they stand by themselves.
#[derive(Default)]
struct Grove {
    objects: Vec<SourceObject>,
    viewpoints: Vec<SourceViewpoint>,
    authored: Authored,
}

impl Nursery {
    /// Adds what a node's rules grow to the scene: objects, viewpoints, and shapes for the bake.
    pub(crate) fn plant(
        &mut self,
        scene: &mut SourceScene,
        planting: &Planting,
        (reader, ground): (&mut Reader, Ground),
    ) -> Result<(), ImportError> {
        let key = planting.wanted.to_string();
        let Reader { defects, budget, .. } = reader;
        let linear = DMat3::from_mat4(planting.world_from_node);
        if linear.determinant() == 0.0 || !linear.inverse().is_finite() {
            defects.note("rules at a node without volume: not grown", 1, || planting.node.clone());
            return Ok(());
        }
        let asked = impostor::of_extras(&planting.wanted, defects, &planting.node);
        if !self.known.contains_key(&key) {
            let grown = grow_wanted(&planting.wanted, &planting.node, ground);
            let grove = match grown? {
                Ok((mut inner, found)) => {
                    defects.absorb(found);
                    Grove {
                        viewpoints: std::mem::take(&mut inner.viewpoints),
                        authored: std::mem::take(&mut inner.authored),
                        objects: absorb(scene, inner),
                    }
                }
                Err(kind) => {
                    defects.note(kind, 1, || {
                        format!("{}: {}", planting.node, planting.wanted["procedural"])
                    });
                    Grove::default()
                }
            };
            let asked = asked.map(|asked| asked.wish);
            if asked.is_some_and(|wish| wish.frames > 1) {
                let kind = "`frames` at a node of rules: ask for them in the rules; one pose drawn";
                defects.note(kind, 1, || planting.node.clone());
            }
            for object in &grove.objects {
                let wish = &mut scene.models[object.model].impostor;
                *wish = impostor::joined(*wish, asked);
            }
            self.known.insert(key.clone(), grove);
        }
        let Grove {
            objects,
            viewpoints,
            authored,
        } = &self.known[&key];
        for object in objects {
            if scene.objects.len() >= ground.limits.max_objects {
                let (place, limit) = (planting.node.clone(), ground.limits.max_objects);
                return Err(ImportError::TooManyObjects { place, limit });
            }
            scene.objects.push(SourceObject {
                source_node: format!("{}/{}", planting.node, object.source_node),
                world_from_object: planting.world_from_node * object.world_from_object,
                role: if planting.role == Role::Ordinary {
                    object.role
                } else {
                    planting.role
                },
                ..object.clone()
            });
        }
        for viewpoint in viewpoints {
            let name = || planting.node.clone();
            budget.claim(size_of::<SourceViewpoint>() + viewpoint.name.len(), 1, name)?;
            match rigid(planting.world_from_node * viewpoint.world_from_camera) {
                Some(world_from_camera) => scene.viewpoints.push(SourceViewpoint {
                    name: viewpoint.name.clone(),
                    world_from_camera,
                }),
                None => defects.note(NO_DIRECTION, 1, || format!("{}/{}", planting.node, viewpoint.name)),
            }
        }
        for (shapes, placed) in [
            (&authored.cells, &mut scene.authored.cells),
            (&authored.portals, &mut scene.authored.portals),
            (&authored.occluders, &mut scene.authored.occluders),
        ] {
            for shape in shapes {
                let node = format!("{}/{}", planting.node, shape.node);
                budget.claim(shape.triangles.len(), size_of::<[DVec3; 3]>(), || node.clone())?;
                let triangles = shape.triangles.iter().copied();
                placed.push(AuthoredShape::placed(node, triangles, planting.world_from_node));
            }
        }
        Ok(())
    }
}

/// What the wish grows, or why there is nothing.
fn grow_wanted(
    wanted: &Json,
    node: &str,
    ground: Ground,
) -> Result<Result<(SourceScene, Defects), &'static str>, ImportError> {
    let Some(path) = wanted["procedural"].as_str().and_then(relative_path) else {
        return Ok(Err("`procedural` that names no file beside the source: not grown"));
    };
    if wanted.get("parameters").is_some_and(|given| !given.is_object()) {
        return Ok(Err(
            "`parameters` that are not an object of names and values: not grown",
        ));
    }
    let mut parameters = BTreeMap::new();
    for (name, value) in wanted["parameters"].as_object().into_iter().flatten() {
        let Some(value) = Value::from_json(value) else {
            return Ok(Err("`parameters` that are not numbers or lists of them: not grown"));
        };
        parameters.insert(name.clone(), value);
    }
    let seed = match wanted.get("seed").map(whole) {
        None => 0,
        Some(seed) => match seed.and_then(|seed| u32::try_from(seed).ok()) {
            Some(seed) => seed,
            None => {
                return Ok(Err(
                    "a `seed` that is not a whole number from 0 to 4294967295: not grown",
                ));
            }
        },
    };
    let Ok(bytes) = ground.files.read(&path, MAX_TEXT_BYTES as u64) else {
        return Ok(Err("rules that cannot be read: not grown"));
    };
    let limits = growth_limits(ground.limits);
    let settings = Settings {
        seed,
        parameters,
        limits,
        ..Settings::default()
    };
    let growth = planted(&path, bytes, (&settings, true), ground).map_err(|cause| match cause {
        ImportError::Rules(error) => ImportError::RulesOfNode {
            node: node.to_owned(),
            error,
        },
        other => other,
    })?;
    Ok(Ok((growth.scene, growth.defects)))
}
