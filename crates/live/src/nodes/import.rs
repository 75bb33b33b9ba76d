//! What does a node believe of the movers of others? What their nodes have told it since they met, without a gap; where
//! there is one, it keeps what it has and asks for all again.

use std::collections::BTreeSet;

use belvedere_scene::ObjectId;

use super::{
    Exchange, NodeId,
    message::{Count, Poses, Says, Tell, To},
};
use crate::{Ms, event::Gone, journal::Journal, world::Sent};

/// Who has asked waits so long for an answer before it asks again.
const PATIENCE_MS: Ms = 500;

impl Exchange {
    /// A node tells of its movers.
    pub(super) fn hear_tell(&mut self, from: &NodeId, tell: Tell, world: &mut Journal, now_ms: Ms) {
        let Some(peer) = self.peers.get_mut(from) else { return };
        let heard = &mut peer.heard;
        if tell.count <= heard.count {
            return;
        }
        let next = Count {
            number: heard.count.number + 1,
            ..heard.count
        };
        let follows = tell.all.is_some() || (tell.count == next && !heard.broken);
        let first = tell.count.met_ms > heard.count.met_ms && tell.count.number == 1;
        if !follows && !first {
            heard.broken = true;
            self.ask_again(from, now_ms);
            return;
        }
        heard.count = tell.count;
        if tell.all.is_some() || first {
            heard.broken = false;
            let all: BTreeSet<_> = tell.all.into_iter().flatten().collect();
            let void: Vec<_> = heard.movers.extract_if(.., |object| !all.contains(object)).collect();
            void.into_iter()
                .for_each(|object| world.withdraw(object, Gone::Hidden, now_ms));
        }
        for (object, new) in tell.appear {
            let ours = self
                .peers
                .get(from)
                .is_some_and(|peer| peer.heard.movers.contains(&object));
            if !ours {
                // Its home is another one now, whose clock may be too.
                world.withdraw(object, Gone::Hidden, now_ms);
            }
            if world.import(object, new, now_ms).is_ok() || ours {
                self.move_home(from, object);
            }
        }
        let Some(peer) = self.peers.get_mut(from) else { return };
        for (objects, reason) in [(tell.hidden, Gone::Hidden), (tell.ended, Gone::Destroyed)] {
            for object in objects {
                if peer.heard.movers.remove(&object) {
                    world.withdraw(object, reason, now_ms);
                }
            }
        }
    }

    /// A node says where its movers are.
    pub(super) fn hear_poses(&mut self, from: &NodeId, poses: &Poses, world: &mut Journal, now_ms: Ms) {
        let Some(peer) = self.peers.get(from) else { return };
        for (object, pose) in poses.iter().filter(|(object, _)| peer.heard.movers.contains(object)) {
            // A pose that was overtaken by a newer one is refused, and so is what cannot be.
            _ = world.move_to(object, Sent::of(&pose), now_ms);
        }
    }

    /// A node says how much it has told us.
    pub(super) fn hear_count(&mut self, from: &NodeId, count: Option<Count>, now_ms: Ms) {
        let (Some(peer), Some(count)) = (self.peers.get_mut(from), count) else {
            return;
        };
        peer.heard.counted_ms = now_ms;
        if count > peer.heard.count {
            // Who has told nothing since has none of those that it had told of before.
            peer.heard.broken |= count.number > 0 || !peer.heard.movers.is_empty();
        }
        if peer.heard.broken {
            self.ask_again(from, now_ms);
        }
    }

    fn ask_again(&mut self, node: &NodeId, now_ms: Ms) {
        let Some(peer) = self.peers.get_mut(node) else { return };
        if peer
            .heard
            .asked_ms
            .is_none_or(|asked_ms| now_ms - asked_ms >= PATIENCE_MS)
        {
            peer.heard.asked_ms = Some(now_ms);
            self.write(To::Node(node.clone()), Says::Again);
        }
    }

    /// A mover is one of this node's, and of no other's.
    fn move_home(&mut self, node: &NodeId, object: ObjectId) {
        for (other, peer) in &mut self.peers {
            if other == node {
                peer.heard.movers.insert(object);
            } else {
                peer.heard.movers.remove(&object);
            }
        }
    }
}
