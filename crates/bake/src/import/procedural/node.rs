//! Which rules does a glTF node name? `extras.belvedere`: `{"procedural": "tree.dcg", "parameters": {…}, "seed": 1}`.

use std::collections::{BTreeMap, BTreeSet};

use belvedere_scene::procedural::limits::MAX_TEXT_BYTES;
use belvedere_scene::procedural::{Limits as GrowthLimits, Settings, Value, Watch, cut, in_place_of_text};
use glam::{DMat3, DMat4, DVec3};
use serde_json::Value as Json;

use super::absorb::absorb;
use super::{Astray, Beside, Budget, Ground, folder_of, growth_limits, is_gltf, planted, telling};
use crate::defect::Defects;
use crate::import::document::whole;
use crate::import::error::{Flaw, Read, Trouble, flaw};
use crate::import::nodes::{NO_DIRECTION, rigid};
use crate::import::reader::Reader;
use crate::import::uri::relative_path;
use crate::import::{ImportError, Limits, impostor};
use crate::source::{Authored, AuthoredShape, Role, SourceObject, SourceScene, SourceViewpoint};

/// Rules that a node names, and where they grow.
#[derive(Debug)]
pub(crate) struct Planting {
    /// The node's name.
    pub(crate) node: String,
    /// What its author said it is.
    pub(crate) role: Role,
    pub(crate) world_from_node: DMat4,
    pub(crate) wish: Wish,
}

/// What a node's `extras.belvedere` say of rules.
#[derive(Debug, Clone)]
pub(crate) struct Wish {
    of: Json,
    /// The same as a text: equal wishes have equal ones.
    key: String,
}

impl Wish {
    /// That of a node, when it has one.
    pub(crate) fn of(node: &Json) -> Option<Self> {
        let belvedere = node.pointer("/extras/belvedere")?;
        belvedere.get("procedural")?;
        Some(Self {
            of: belvedere.clone(),
            key: belvedere.to_string(),
        })
    }
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
    /// Why there is nothing.
    refused: Option<Flaw>,
}

/// The most steps that different wishes may take, as progress is told of them.
pub(crate) fn steps_of<'w>(wishes: impl Iterator<Item = &'w Wish>, limits: &Limits) -> u64 {
    let different: BTreeSet<_> = wishes.map(|wish| &wish.key).collect();
    different.len() as u64 * growth_limits(limits).steps
}

impl Nursery {
    /// Adds what a node's rules grow to the scene: objects, viewpoints, and shapes for the bake.
    pub(crate) fn plant(
        &mut self,
        scene: &mut SourceScene,
        planting: &Planting,
        (reader, ground): (&mut Reader, Ground),
    ) -> Result<(), ImportError> {
        let Wish { of: wanted, key } = &planting.wish;
        let Reader { defects, budget, .. } = reader;
        let linear = DMat3::from_mat4(planting.world_from_node);
        if linear.determinant() == 0.0 || !linear.inverse().is_finite() {
            defects.note("rules at a node without volume: not grown", 1, || planting.node.clone());
            return Ok(());
        }
        let asked = impostor::of_extras(wanted, defects, &planting.node);
        if !self.known.contains_key(key) {
            let limits = growth_limits(ground.limits);
            let most = limits.steps;
            let grown = telling(ground.progress, most, |tell| {
                grow_wanted(wanted, limits, (ground, budget), tell)
            });
            let grove = match grown {
                Ok((mut inner, found)) => {
                    defects.absorb(found);
                    Grove {
                        viewpoints: std::mem::take(&mut inner.viewpoints),
                        authored: std::mem::take(&mut inner.authored),
                        objects: absorb(scene, inner),
                        refused: None,
                    }
                }
                Err(Trouble::Flaw(flaw)) => Grove {
                    refused: Some(flaw),
                    ..Grove::default()
                },
                Err(Trouble::Fatal(error)) => return Err(error),
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
            refused,
        } = &self.known[key];
        if let Some(Flaw { kind, place }) = refused {
            defects.tell(kind, format!("node {:?}, {place}", cut(&planting.node)));
        }
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
                placed.push(AuthoredShape {
                    said: shape.said.clone(),
                    ..AuthoredShape::placed(node, triangles, planting.world_from_node)
                });
            }
        }
        Ok(())
    }
}

/// What the wish grows; without it the scene has all else.
fn grow_wanted(
    wanted: &Json,
    limits: GrowthLimits,
    (ground, budget): (Ground, &Budget),
    watch: Watch,
) -> Read<(SourceScene, Defects)> {
    let named = wanted["procedural"].as_str();
    let path = match named.map_or(Err(Astray::Empty), relative_path) {
        Ok(path) => path,
        Err(astray) => {
            let shown = shown(&wanted["procedural"]);
            let told = match astray {
                Astray::Empty => format!("`procedural` is {shown}; write the path of a file, as in \"tree.dcg\""),
                _ => format!("`procedural` is {shown}: {astray}"),
            };
            return flaw("`procedural` that names no file beside the source: not grown", told);
        }
    };
    let told = |what: String| format!("{}: {what}", cut(&path));
    let settings = Settings {
        seed: seed_of(wanted, told)?,
        parameters: parameters_of(wanted, told)?,
        limits,
        ..Settings::default()
    };
    let bytes = match ground.files.read(&path, MAX_TEXT_BYTES as u64) {
        Ok(bytes) => bytes,
        Err(cause) => {
            let beside = Beside::of("", ground);
            let cause = beside.told(&path, (&path, &["dcg"]), &cause);
            return flaw("rules that cannot be read: not grown", told(cause));
        }
    };
    if is_gltf(&bytes) {
        let what = format!(
            "this is glTF or an archive, and `procedural` takes rules (.dcg); rules place it with `model \"{}\"`",
            path.rsplit('/').next().unwrap_or_default()
        );
        return flaw("`procedural` that names no rules: not grown", told(what));
    }
    let folder = folder_of(&path);
    let kind = "rules that are wrong, or given what they do not take: not grown";
    let mut growth =
        planted(&path, bytes, (&settings, true), (ground, budget), watch).or_else(|cause| match cause {
            ImportError::Rules(error) if error.line == 0 => flaw(kind, told(error.to_string())),
            ImportError::Rules(error) => flaw(kind, error.below(folder).to_string()),
            ImportError::Memory { .. } | ImportError::TooManyObjects { .. } | ImportError::Cancelled => {
                Err(cause.into())
            }
            other => flaw(kind, told(other.to_string())),
        })?;
    growth.scene.authored.put_below(folder);
    Ok((growth.scene, growth.defects))
}

/// Values for parameters of the rules, by their names.
fn parameters_of(wanted: &Json, told: impl Fn(String) -> String) -> Read<BTreeMap<String, Value>> {
    let given = match wanted.get("parameters") {
        None => return Ok(BTreeMap::new()),
        Some(Json::Object(given)) => given,
        Some(other) => {
            let what = format!(
                "`parameters` is {}; write names and values, as in {{\"height\": 12}}",
                shown(other)
            );
            return flaw(
                "`parameters` that are not an object of names and values: not grown",
                told(what),
            );
        }
    };
    let mut parameters = BTreeMap::new();
    for (name, value) in given {
        let Some(known) = Value::from_json(value) else {
            let what = format!(
                "`{}` is {}; write {}",
                beginning(name),
                shown(value),
                in_place_of_text(value.as_str().unwrap_or(&value.to_string()))
                    .unwrap_or_else(|| "a number or a list of numbers".to_owned())
            );
            return flaw(
                "`parameters` that are not numbers or lists of them: not grown",
                told(what),
            );
        };
        parameters.insert(name.clone(), known);
    }
    Ok(parameters)
}

fn seed_of(wanted: &Json, told: impl Fn(String) -> String) -> Read<u32> {
    let Some(seed) = wanted.get("seed") else { return Ok(0) };
    match whole(seed).and_then(|seed| u32::try_from(seed).ok()) {
        Some(seed) => Ok(seed),
        None => flaw(
            "a `seed` that is not a whole number from 0 to 4294967295: not grown",
            told(format!("`seed` is {}", shown(seed))),
        ),
    }
}

/// A value as it is written, the beginning of a long one.
fn shown(value: &Json) -> String {
    beginning(&value.to_string())
}

fn beginning(text: &str) -> String {
    const MOST_SHOWN: usize = 60;
    match text.char_indices().nth(MOST_SHOWN) {
        Some((end, _)) => format!("{}…", &text[..end]),
        None => text.to_owned(),
    }
}
