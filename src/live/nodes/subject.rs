//! Which subject is whose? `docs/NODES.md` lists them.

use belvedere_live::nodes::{NodeId, message::To};
use belvedere_scene::{CellId, Revision, SceneName};

/// All nodes of a scene that have the same revision: cells are numbered within one.
pub(super) fn all(scene: &SceneName, revision: Revision) -> String {
    format!("belvedere.v1.{scene}.{revision}.nodes")
}

/// One of them.
pub(super) fn node(scene: &SceneName, revision: Revision, node: &NodeId) -> String {
    format!("belvedere.v1.{scene}.{revision}.node.{node}")
}

/// Those whose sessions watch a cell.
pub(super) fn cell(scene: &SceneName, revision: Revision, cell: CellId) -> String {
    format!("belvedere.v1.{scene}.{revision}.cell.{}", cell.0)
}

pub(super) fn of(scene: &SceneName, revision: Revision, to: &To) -> String {
    match to {
        To::All => all(scene, revision),
        To::Node(name) => node(scene, revision, name),
        To::Cell(number) => cell(scene, revision, *number),
    }
}
