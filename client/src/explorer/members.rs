//! What has come of a pack or a bundle that is still on its way? Each file in it as soon as its bytes are here and are what its own name promises,
//! whatever becomes of the rest.

use bytes::Bytes;
use tokio::{
    sync::mpsc::UnboundedSender,
    task::{self, Id},
};

use crate::strategy::{
    file::{FileRef, Key},
    order::Member,
};

/// What has come of a request that is still on its way, and the task that carries it out.
pub(super) struct Come {
    pub(super) task: Id,
    pub(super) what: Parts,
}

pub(super) enum Parts {
    /// Files that came out of a pack.
    Levels { pack: Key, members: Vec<(Member, Bytes)> },
    /// One out of a bundle.
    Member(FileRef, Bytes),
}

/// Tells of a file out of a bundle, by the task that fetches that.
pub(super) fn tell_member(tell: &UnboundedSender<Come>, file: &FileRef, bytes: &[u8]) {
    // A copy, so that what stays does not keep the others in memory. Nobody listens when the explorer is gone, and the task with it.
    _ = tell.send(Come {
        task: task::id(),
        what: Parts::Member(file.clone(), Bytes::copy_from_slice(bytes)),
    });
}

/// Takes the files out of a pack that somebody waits for.
pub(super) struct Unpacking {
    pack: Key,
    waiting: Vec<Member>,
    /// So much of the pack has been looked at.
    seen_bytes: usize,
    tell: UnboundedSender<Come>,
}

impl Unpacking {
    pub(super) fn of(pack: Key, waiting: Vec<Member>, tell: UnboundedSender<Come>) -> Self {
        Self {
            pack,
            waiting,
            seen_bytes: 0,
            tell,
        }
    }

    /// Tells of what has come since it was last looked at, by the task that fetches. What is damaged waits for another try, or for the
    /// end.
    pub(super) fn look(&mut self, so_far: &[u8]) {
        if so_far.len() < self.seen_bytes {
            self.seen_bytes = 0;
        }
        let seen = std::mem::replace(&mut self.seen_bytes, so_far.len()) as u64;
        let mut members = Vec::new();
        self.waiting.retain(|member| {
            let come = member.out_of(so_far).filter(|_| member.to() > seen);
            let Some(right) = come.filter(|bytes| member.key.is_of(bytes)) else {
                return true;
            };
            // A copy, so that what stays does not keep the others in memory.
            members.push((*member, Bytes::copy_from_slice(right)));
            false
        });
        if !members.is_empty() {
            // Nobody listens when the explorer is gone, and the task with it.
            _ = self.tell.send(Come {
                task: task::id(),
                what: Parts::Levels {
                    pack: self.pack,
                    members,
                },
            });
        }
    }
}

#[cfg(test)]
mod tests {
    use tokio::sync::mpsc;

    use super::*;

    fn members(pack: &[&[u8]]) -> Vec<Member> {
        let mut from = 0;
        let of = |bytes: &&[u8]| {
            let name = belvedere_scene::BlobName::of(bytes, "glb").expect("a name");
            let member = Member {
                key: FileRef::object(&name, 0).name.key(),
                from,
                bytes: bytes.len() as u64,
            };
            from = member.to();
            member
        };
        pack.iter().map(of).collect()
    }

    #[tokio::test]
    async fn each_comes_once_and_what_was_damaged_with_another_try() {
        let waiting = members(&[b"one", b"two", b"three"]);
        let (tell, mut told) = mpsc::unbounded_channel();
        let pack = waiting[0].key;
        let mut unpacking = Unpacking::of(pack, waiting, tell);
        let looks = tokio::spawn(async move {
            for so_far in ["on", "one", "onetwX", "onetwXthr", "one", "onetw", "onetwothree"] {
                unpacking.look(so_far.as_bytes());
            }
        });
        looks.await.expect("it looks");
        let mut came = Vec::new();
        while let Some(come) = told.recv().await {
            let Parts::Levels { members, .. } = come.what else {
                panic!("it is no bundle")
            };
            came.push(members.into_iter().map(|(_, bytes)| bytes).collect::<Vec<_>>());
        }
        assert_eq!(came, [vec!["one"], vec!["two", "three"]]);
    }
}
