//! Whose word counts when two nodes move a door? The one with the larger stamp.

use std::collections::BTreeMap;

use belvedere_scene::{Bounds, ObjectId};

use super::message::{DoorState, NodeId, Stamp};

/// Doors that were moved since the node came to the scene, or while it heard of it.
#[derive(Debug, Default)]
pub(super) struct Doors(BTreeMap<ObjectId, DoorState>);

impl Doors {
    /// A door is moved here.
    pub(super) fn set(&mut self, node: &NodeId, object: ObjectId, bounds: &Bounds, open: bool) -> DoorState {
        let last = self.0.get(&object).map_or(0, |door| door.stamp.counter);
        let state = DoorState {
            object,
            bounds: *bounds,
            open,
            stamp: Stamp {
                counter: last.saturating_add(1),
                node: node.clone(),
            },
        };
        self.0.insert(object, state.clone());
        state
    }

    /// A door was moved elsewhere; whether that counts, and is new.
    pub(super) fn hear(&mut self, state: &DoorState) -> bool {
        let newer = self.0.get(&state.object).is_none_or(|door| door.stamp < state.stamp);
        if newer {
            self.0.insert(state.object, state.clone());
        }
        newer
    }

    /// All of them, for whoever comes later.
    pub(super) fn all(&self) -> Vec<DoorState> {
        self.0.values().cloned().collect()
    }

    /// Doors of another revision are other doors.
    pub(super) fn clear(&mut self) {
        self.0.clear();
    }
}
