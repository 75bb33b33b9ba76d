//! Which nodes does the scene draw, and where do they stand?
//!
//! The hierarchy is walked depth first with an explicit stack (a deep one cannot exhaust the call stack), in f64. Each
//! node is visited once: cycles and second parents are counted and not followed.

use std::collections::BTreeMap;

use glam::{DMat3, DMat4};

use super::ImportError;
use super::document::Item;
use super::impostor::{self, Asked};
use super::local::Local;
use super::lookalike;
use super::mark::Mark;
use super::reader::Reader;
use crate::source::{Role, SourceViewpoint};

/// Of a viewpoint.
pub(super) const NO_DIRECTION: &str = "viewpoint without a direction: left out";

/// A node that the scene reaches.
#[derive(Debug, Clone)]
pub(super) struct PlacedNode {
    /// Its index in the document.
    pub(super) index: usize,
    /// Its name, or `node[i]`.
    pub(super) name: String,
    /// Places it in the world; may be singular, is finite.
    pub(super) world_from_node: DMat4,
    /// Position of its parent among those that the scene reaches.
    pub(super) parent: Option<usize>,
    /// What it is marked as, by itself or by an ancestor.
    pub(super) mark: Mark,
    /// What pictures it asks for.
    pub(super) impostor: Option<Asked>,
}

/// Everything that the scene reaches, parents before children.
#[derive(Debug, Default)]
pub(super) struct Hierarchy {
    pub(super) nodes: Vec<PlacedNode>,
    pub(super) viewpoints: Vec<SourceViewpoint>,
    /// Position in `nodes` by the node's index in the document.
    by_index: BTreeMap<usize, usize>,
}

impl Hierarchy {
    /// The position in `nodes` of a node of the document, when the scene reaches it.
    pub(super) fn position(&self, index: usize) -> Option<usize> {
        self.by_index.get(&index).copied()
    }
}

enum Step {
    Enter {
        index: usize,
        parent: Option<usize>,
        mark: Mark,
        place: String,
    },
    Leave {
        index: usize,
    },
}

/// Walks the scene that the document wants shown.
pub(super) fn walk(reader: &mut Reader) -> Result<Hierarchy, ImportError> {
    let mut hierarchy = Hierarchy::default();
    // Whether a node is on the path from its root; absent when it was not met yet.
    let mut on_path: BTreeMap<usize, bool> = BTreeMap::new();
    let enter = |(index, place): (usize, String)| Step::Enter {
        index,
        parent: None,
        mark: Mark::Drawn(Role::Ordinary),
        place,
    };
    let mut stack: Vec<Step> = roots(reader)?.into_iter().rev().map(enter).collect();
    while let Some(step) = stack.pop() {
        let (index, parent, mark, place) = match step {
            Step::Leave { index } => {
                on_path.insert(index, false);
                continue;
            }
            Step::Enter {
                index,
                parent,
                mark,
                place,
            } => (index, parent, mark, place),
        };
        match on_path.get(&index) {
            Some(true) => reader.defects.note("node below itself: not followed", 1, || place),
            Some(false) => reader
                .defects
                .note("node with two parents: drawn below the first", 1, || place),
            None => {}
        }
        if on_path.contains_key(&index) {
            continue;
        }
        let listed = reader.root.listed("nodes", index);
        let Some(node) = reader.settle(listed)? else { continue };
        on_path.insert(index, true);
        stack.push(Step::Leave { index });
        if node.value.pointer("/extensions/KHR_node_visibility/visible") == Some(&serde_json::Value::Bool(false)) {
            let kind = "node that is not visible (KHR_node_visibility): left out with all below it";
            reader.defects.note(kind, 1, || node.place.clone());
            continue;
        }
        let Some(local) = reader.settle(Local::of(&node))? else {
            continue;
        };
        let world_from_parent = parent.map_or(DMat4::IDENTITY, |at: usize| hierarchy.nodes[at].world_from_node);
        let world_from_node = world_from_parent * local.parent_from_node();
        if !world_from_node.is_finite() {
            reader.defects.note(
                "node whose transform is not finite: left out with all below it",
                1,
                || node.place.clone(),
            );
            continue;
        }
        let mark = author_mark(reader, &node).unwrap_or(mark);
        note_viewpoint(reader, &mut hierarchy, &node, world_from_node)?;
        let name = node.name().map_or_else(|| format!("node[{index}]"), str::to_owned);
        let position = hierarchy.nodes.len();
        hierarchy.by_index.insert(index, position);
        let impostor = impostor::wished(reader, &node);
        hierarchy.nodes.push(PlacedNode {
            index,
            impostor,
            name,
            world_from_node,
            parent,
            mark,
        });
        for (index, place) in references(reader, &node, "children")?.into_iter().rev() {
            stack.push(Step::Enter {
                index,
                parent: Some(position),
                mark,
                place,
            });
        }
    }
    Ok(hierarchy)
}

/// The root nodes of the scene to show, with the places that name them.
fn roots(reader: &mut Reader) -> Result<Vec<(usize, String)>, ImportError> {
    let scenes = reader.root.length("scenes");
    if scenes == 0 {
        return parentless(reader);
    }
    let wanted = reader.root.index("scene");
    let mut wanted = reader.settle(wanted)?.flatten().unwrap_or(0);
    if wanted >= scenes {
        reader
            .defects
            .note("scene that is not there: the first scene taken", 1, || {
                format!("/scene = {wanted} of {scenes}")
            });
        wanted = 0;
    }
    let scene = reader.root.listed("scenes", wanted);
    match reader.settle(scene)? {
        Some(scene) => references(reader, &scene, "nodes"),
        None => Ok(Vec::new()),
    }
}

/// All nodes that are nobody's child, for a document without scenes.
fn parentless(reader: &mut Reader) -> Result<Vec<(usize, String)>, ImportError> {
    let count = reader.root.length("nodes");
    if count == 0 {
        return Ok(Vec::new());
    }
    reader
        .defects
        .note("no scenes: all nodes without a parent taken", 1, || "/scenes".into());
    let mut is_child = vec![false; count];
    for index in 0..count {
        // What is wrong with a node is counted when it is visited.
        let Ok(node) = reader.root.listed("nodes", index) else {
            continue;
        };
        for child in node.elements("children").unwrap_or_default() {
            if let Some(flag) = child.as_index().ok().and_then(|c| is_child.get_mut(c)) {
                *flag = true;
            }
        }
    }
    Ok((0..count)
        .filter(|i| !is_child[*i])
        .map(|i| (i, format!("/nodes/{i}")))
        .collect())
}

/// The indices in a list of node references.
fn references(reader: &mut Reader, item: &Item, key: &str) -> Result<Vec<(usize, String)>, ImportError> {
    let mut found = Vec::new();
    for element in reader.settle(item.elements(key))?.unwrap_or_default() {
        if let Some(index) = reader.settle(element.as_index())? {
            found.push((index, element.place));
        }
    }
    Ok(found)
}

/// What the author says a node is: `extras.belvedere.kind`, or else the start of its name.
fn author_kind<'a>(node: &Item<'a>) -> Option<&'a str> {
    stated_kind(node).or_else(|| Some(node.name()?.split_once(':')?.0))
}

fn stated_kind<'a>(node: &Item<'a>) -> Option<&'a str> {
    let belvedere = node.value.get("extras").and_then(|e| e.get("belvedere"));
    belvedere.and_then(|b| b.get("kind")).and_then(|k| k.as_str())
}

fn author_mark(reader: &mut Reader, node: &Item) -> Option<Mark> {
    let Some(mark) = author_kind(node).and_then(Mark::of) else {
        // Of what is something by other means, a name is nothing but a name.
        if stated_kind(node).is_none() && node.value.get("camera").is_none() {
            let alike = node.name().and_then(|name| lookalike::told(name, lookalike::OF_NODES));
            reader.defects.name(lookalike::KIND, alike);
        }
        return None;
    };
    if mark == Mark::Avatar {
        let kind = "avatar: not part of the scene that stands still, left out";
        reader.defects.note(kind, 1, || node.place.clone());
    }
    Some(mark)
}

/// Keeps cameras and nodes that are marked as viewpoints.
fn note_viewpoint(
    reader: &mut Reader,
    hierarchy: &mut Hierarchy,
    node: &Item,
    world_from_node: DMat4,
) -> Result<(), ImportError> {
    let camera = reader.settle(node.index("camera"))?.flatten();
    let marked = author_kind(node) == Some("viewpoint");
    if camera.is_none() && !marked {
        return Ok(());
    }
    let camera_name = camera.and_then(|c| reader.root.listed("cameras", c).ok()?.name());
    let stated = node.value.pointer("/extras/belvedere/name").and_then(|n| n.as_str());
    let own = node.name().map(|n| n.strip_prefix("viewpoint:").unwrap_or(n).trim());
    let name = stated.or(own).or(camera_name).filter(|n| !n.is_empty());
    match rigid(world_from_node) {
        Some(world_from_camera) => hierarchy.viewpoints.push(SourceViewpoint {
            name: name.map_or_else(|| node.place.clone(), str::to_owned),
            world_from_camera,
        }),
        None => reader.defects.note(NO_DIRECTION, 1, || node.place.clone()),
    }
    Ok(())
}

/// The transform without scale, shear and mirroring: keeps the position, the direction −Z and, near it, the up axis.
pub(super) fn rigid(world_from_node: DMat4) -> Option<DMat4> {
    let linear = DMat3::from_mat4(world_from_node);
    let back = linear.z_axis.try_normalize()?;
    let right = linear.y_axis.try_normalize()?.cross(back).try_normalize()?;
    let axes = DMat3::from_cols(right, back.cross(right), back);
    Some(DMat4::from_mat3_translation(axes, world_from_node.w_axis.truncate()))
}
