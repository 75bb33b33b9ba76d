//! Which nodes and meshes ask for an impostor? `extras.belvedere.impostor`: `true`, or
//! `{"views": 8, "size": 64, "below": false, "frames": 8, "animation": "walk", "stride": 1.4}` of which any member may be
//! absent.

use belvedere_scene::impostor::Wish;
use serde_json::Value;

use super::document::{Item, whole};
use super::reader::Reader;
use crate::defect::Defects;

const NOT_UNDERSTOOD: &str = "`impostor` that is neither true, false nor an object of `views` (2 to 12), `size` (16, 32, 64 or \
    128), `below` (true or false), `frames` (2 to 16), `animation` (a name) and `stride` (above 0), all views of all frames \
    at most 4,096 pixels high: not made";
/// How fast people walk who are in no hurry, in metres a second.
const WALK_MPS: f64 = 1.4;

/// What a node or a mesh asks for.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Asked {
    pub(crate) wish: Wish,
    /// The animation whose frames are wanted, when it is not the first.
    pub(super) animation: Option<String>,
}

impl Asked {
    /// The stride that its author states, or that of a walk.
    pub(super) fn stride(&self, duration_s: f64) -> f64 {
        if self.wish.stride > 0.0 {
            self.wish.stride
        } else {
            WALK_MPS * duration_s
        }
    }
}

/// What a node or a mesh asks for.
pub(super) fn wished(reader: &mut Reader, item: &Item) -> Option<Asked> {
    let belvedere = item.value.pointer("/extras/belvedere")?;
    of_extras(belvedere, &mut reader.defects, &item.place)
}

/// What an `extras.belvedere` asks for; what cannot be understood is counted.
pub(super) fn of_extras(belvedere: &Value, defects: &mut Defects, place: &str) -> Option<Asked> {
    let wish = read(belvedere.get("impostor")?);
    if wish.is_none() {
        defects.note(NOT_UNDERSTOOD, 1, || format!("{place}/extras/belvedere/impostor"));
    }
    wish.flatten()
}

/// What suffices for both.
pub(crate) fn joined(a: Option<Wish>, b: Option<Wish>) -> Option<Wish> {
    match (a, b) {
        (Some(a), Some(b)) => Some(a.join(b)),
        _ => a.or(b),
    }
}

/// What suffices for both; the first says which animation is wanted, if it does.
pub(super) fn both(a: Option<Asked>, b: Option<Asked>) -> Option<Asked> {
    match (a, b) {
        (Some(a), Some(b)) => Some(Asked {
            wish: a.wish.join(b.wish),
            animation: a.animation.or(b.animation),
        }),
        (a, b) => a.or(b),
    }
}

fn read(value: &Value) -> Option<Option<Asked>> {
    let (mut wish, mut animation) = (Wish::DEFAULT, None);
    let members = match value {
        Value::Bool(true) => return Some(Some(Asked { wish, animation })),
        Value::Bool(false) => return Some(None),
        Value::Object(members) => members,
        _ => return None,
    };
    if members.contains_key("frames") {
        wish.views = Wish::VIEWS_OF_FRAMES;
    }
    for (name, value) in members {
        let number = || u32::try_from(whole(value)?).ok();
        match name.as_str() {
            "views" => wish.views = number().filter(|views| (Wish::LEAST_VIEWS..=Wish::MOST_VIEWS).contains(views))?,
            "size" => wish.size_px = number().filter(|size| Wish::SIZES_PX.contains(size))?,
            "below" => wish.below = value.as_bool()?,
            "frames" => wish.frames = number().filter(|frames| (2..=Wish::MOST_FRAMES).contains(frames))?,
            "animation" => animation = Some(value.as_str()?.to_owned()),
            "stride" => wish.stride = value.as_f64().filter(|stride| *stride > 0.0)?,
            _ => return None,
        }
    }
    wish.fits().then_some(Some(Asked { wish, animation }))
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;
    use crate::import::testing::Gltf;
    use crate::import::{FileError, Limits, SourceFiles, import};
    use crate::progress::Silent;

    struct Alone;

    impl SourceFiles for Alone {
        fn read(&self, _: &str, _: u64) -> Result<Vec<u8>, FileError> {
            Err(FileError::Missing)
        }
    }

    /// What the model asks for when its mesh and its nodes ask for this, and how many wishes were not understood.
    fn asked(mesh: Value, nodes: &[Value]) -> (Option<Wish>, u64) {
        let mut gltf = Gltf::triangle();
        let wish = |value: &Value| json!({"belvedere": {"impostor": value}});
        gltf.json["meshes"][0]["extras"] = wish(&mesh);
        for node in nodes {
            gltf.push("nodes", json!({"name": "b", "mesh": 0, "extras": wish(node)}));
        }
        gltf.json["scenes"][0]["nodes"] = (0..=nodes.len()).collect();
        let limits = Limits {
            memory_bytes: 64 << 20,
            max_objects: 100,
        };
        let imported = import("a.glb", gltf.glb(), &Alone, &limits, &Silent).expect("a triangle can be read");
        let first = |defect: crate::defect::Defect| (defect.kind == NOT_UNDERSTOOD).then_some(defect.first);
        if let Some(place) = imported.defects.iter().find_map(first) {
            assert!(
                place.starts_with("/nodes/1/extras") || place.starts_with("/meshes/0/extras"),
                "{place}"
            );
        }
        assert_eq!(imported.scene.models.len(), 1);
        (
            imported.scene.models[0].impostor,
            imported.defects.count(NOT_UNDERSTOOD),
        )
    }

    #[test]
    fn meshes_and_nodes_ask_and_what_suffices_for_all_is_made() {
        let wish = |views, size_px, below| {
            Some(Wish {
                views,
                size_px,
                below,
                ..Wish::DEFAULT
            })
        };
        assert_eq!(asked(json!(false), &[]), (None, 0));
        assert_eq!(asked(json!(true), &[]), (wish(8, 64, false), 0));
        assert_eq!(asked(json!(false), &[json!({})]), (wish(8, 64, false), 0));
        let both = [
            json!({"views": 5, "size": 128}),
            json!({"views": 12, "size": 16, "below": true}),
        ];
        assert_eq!(asked(json!(false), &both), (wish(12, 128, true), 0));
    }

    /// Some exporters know no whole numbers.
    #[test]
    fn a_number_that_is_written_with_a_point_is_what_it_is() {
        let wish = json!({"views": 5.0, "size": 128.0, "frames": 4.0});
        let same = json!({"views": 5, "size": 128, "frames": 4});
        assert_eq!(asked(wish, &[]), asked(same, &[]));
        assert_eq!(asked(json!({"views": 5.0}), &[]).1, 0);
    }

    #[test]
    fn what_cannot_be_understood_is_counted_with_its_place_and_nothing_is_made() {
        for wrong in [
            json!("yes"),
            json!(8),
            json!(null),
            json!([]),
            json!({"views": 1}),
            json!({"views": 13}),
            json!({"views": 4.5}),
            json!({"views": -8}),
            json!({"size": 48}),
            json!({"size": 1e30}),
            json!({"below": 1}),
            json!({"view": 8}),
            json!({"frames": 1}),
            json!({"frames": 17}),
            json!({"frames": 8, "animation": 0}),
            json!({"frames": 8, "stride": 0}),
            json!({"frames": 8, "views": 9}),
        ] {
            assert_eq!(asked(json!(false), std::slice::from_ref(&wrong)), (None, 1), "{wrong}");
            assert_eq!(asked(wrong.clone(), &[json!(true)]).0, Some(Wish::DEFAULT), "{wrong}");
        }
    }
}
