//! How are poses written that many sessions are told of? Once: what is delivered together shares its text, and sessions that are
//! told the same share all of it.

use std::{collections::HashMap, sync::Arc, time::Instant};

use belvedere_live::{Ms, event::ObjectPose, motion::Pose};
use belvedere_scene::ObjectId;
use bytes::Bytes;

/// What is delivered together.
#[derive(Debug)]
pub(super) struct Delivery {
    pub(super) begun: Instant,
    pub(super) poses: Poses,
    /// Room for the chunks of several.
    pub(super) wire: Vec<u8>,
}

impl Delivery {
    pub(super) fn begin() -> Self {
        Self {
            begun: Instant::now(),
            poses: Poses::default(),
            wire: Vec::new(),
        }
    }
}

/// Poses of one delivery as they are written.
#[derive(Debug, Default)]
pub(super) struct Poses {
    each: HashMap<ObjectId, (Pose, Bytes)>,
    /// What the last session was told, and how that is written.
    last: Option<(Arc<[ObjectPose]>, Arc<Written>)>,
}

/// An `object-pos` as it is written.
#[derive(Debug)]
pub(super) struct Written {
    pub(super) t_ms: Ms,
    /// One for each mover.
    pub(super) entries: Vec<(ObjectId, Bytes)>,
    /// All of it.
    pub(super) data: Bytes,
}

impl Poses {
    /// An `object-pos`. Sessions that see the same movers follow each other often enough that the last one is kept.
    pub(super) fn all(&mut self, t_ms: Ms, objects: &Arc<[ObjectPose]>) -> Arc<Written> {
        if let Some((told, written)) = &self.last
            && written.t_ms == t_ms
            && (Arc::ptr_eq(told, objects) || told == objects)
        {
            return written.clone();
        }
        let entries: Vec<_> = objects.iter().map(|told| (told.object, self.written(told))).collect();
        let data = data(t_ms, entries.iter().map(|(_, entry)| entry)).into();
        let written = Arc::new(Written { t_ms, entries, data });
        self.last = Some((objects.clone(), written.clone()));
        written
    }

    /// An entry of `object-pos`.
    fn written(&mut self, told: &ObjectPose) -> Bytes {
        match self.each.get(&told.object) {
            Some((pose, text)) if *pose == told.pose => text.clone(),
            _ => {
                let text = serde_json::to_vec(told).expect("a pose holds nothing that JSON cannot say");
                let text = Bytes::from(text);
                self.each.insert(told.object, (told.pose, text.clone()));
                text
            }
        }
    }
}

/// The data of an `object-pos` with these entries.
pub(super) fn data<'a>(t_ms: Ms, entries: impl Iterator<Item = &'a Bytes> + Clone) -> String {
    let length: usize = entries.clone().map(|entry| entry.len() + 1).sum();
    let mut text = String::with_capacity(length + 48);
    text.push_str("{\"t_ms\":");
    text.push_str(&t_ms.to_string());
    text.push_str(",\"objects\":[");
    for (i, entry) in entries.enumerate() {
        if i > 0 {
            text.push(',');
        }
        text.push_str(str::from_utf8(entry).expect("JSON is text"));
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
            let objects = Arc::from(objects);
            let written = poses.all(-3, &objects);
            let event = Event::ObjectPos { t_ms: -3, objects };
            assert_eq!(written.data, serde_json::to_string(&event).unwrap());
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
        let [one, two] = [&[told][..], &[told, told]].map(Arc::from);
        let [first, other] = [&one, &two].map(|objects| poses.all(7, objects));
        let alike = [one.clone(), Arc::from([told])];
        let [again, and_again] = alike.each_ref().map(|objects| poses.all(7, objects));
        assert!(Arc::ptr_eq(&again, &and_again) && !Arc::ptr_eq(&first, &other));
        assert_eq!(first.entries[0].1.as_ptr(), other.entries[1].1.as_ptr());
        assert!(poses.all(8, &one).data.starts_with(b"{\"t_ms\":8,"), "another tick");
    }
}
