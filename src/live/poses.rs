//! How is a pose written that many sessions are told of? Once: what is delivered together shares its text.

use std::collections::HashMap;

use belvedere_live::{Ms, event::ObjectPose, motion::Pose};
use belvedere_scene::ObjectId;
use bytes::Bytes;

/// Poses of one delivery as they are written.
#[derive(Debug, Default)]
pub(super) struct Poses(HashMap<ObjectId, (Pose, Bytes)>);

impl Poses {
    /// An entry of `object-pos`.
    pub(super) fn written(&mut self, told: &ObjectPose) -> Bytes {
        match self.0.get(&told.object) {
            Some((pose, text)) if *pose == told.pose => text.clone(),
            _ => {
                let text = serde_json::to_vec(told).expect("a pose holds nothing that JSON cannot say");
                let text = Bytes::from(text);
                self.0.insert(told.object, (told.pose, text.clone()));
                text
            }
        }
    }
}

/// The data of an `object-pos` with these entries.
pub(super) fn data(t_ms: Ms, entries: impl ExactSizeIterator<Item = Bytes> + Clone) -> String {
    let length: usize = entries.clone().map(|entry| entry.len() + 1).sum();
    let mut text = String::with_capacity(length + 48);
    text.push_str("{\"t_ms\":");
    text.push_str(&t_ms.to_string());
    text.push_str(",\"objects\":[");
    for (i, entry) in entries.enumerate() {
        if i > 0 {
            text.push(',');
        }
        text.push_str(str::from_utf8(&entry).expect("JSON is text"));
    }
    text.push_str("]}");
    text
}

#[cfg(test)]
mod tests {
    use belvedere_live::event::Event;

    use super::*;

    #[test]
    fn what_is_put_together_is_what_the_event_says() {
        let pose = |x: f64| Pose::resting(7, [x, -0.5, 1e-9], [0.0, 0.0, 0.0, 1.0]);
        let told = |object, x| ObjectPose {
            object: ObjectId(object),
            pose: pose(x),
        };
        let mut poses = Poses::default();
        // The same mover elsewhere is not taken for where it was.
        for objects in [
            vec![],
            vec![told(1, 0.25)],
            vec![told(1, 3.0), told(2, 0.1)],
            vec![told(2, 0.1), told(1, 3.0)],
        ] {
            let entries: Vec<_> = objects.iter().map(|told| poses.written(told)).collect();
            let event = Event::ObjectPos { t_ms: -3, objects };
            assert_eq!(data(-3, entries.into_iter()), serde_json::to_string(&event).unwrap());
        }
    }

    #[test]
    fn a_pose_is_written_once() {
        let mut poses = Poses::default();
        let told = ObjectPose {
            object: ObjectId(1),
            pose: Pose::resting(7, [1.0; 3], [0.0, 0.0, 0.0, 1.0]),
        };
        assert_eq!(poses.written(&told).as_ptr(), poses.written(&told).as_ptr());
    }
}
