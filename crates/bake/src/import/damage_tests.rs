//! Is there any change to a good file that makes the import panic, or give geometry that breaks its guarantees?

use proptest::prelude::*;
use serde_json::{Value, json};

use super::testing::{import_bytes, rich};

/// Every place of a value.
fn pointers(value: &Value, at: String, into: &mut Vec<String>) {
    match value {
        Value::Object(object) => object.iter().for_each(|(k, v)| pointers(v, format!("{at}/{k}"), into)),
        Value::Array(list) => list
            .iter()
            .enumerate()
            .for_each(|(i, v)| pointers(v, format!("{at}/{i}"), into)),
        _ => {}
    }
    into.push(at);
}

#[test]
fn whatever_stands_in_whatever_place_nothing_panics_and_geometry_stays_valid() {
    let gltf = rich();
    let mut places = Vec::new();
    pointers(&gltf.json, String::new(), &mut places);
    let values = [
        json!(null),
        json!("x"),
        json!(-1),
        json!(0),
        json!(1),
        json!(1.5),
        json!(7),
        json!(1_000_000_007u64),
        json!(u64::MAX),
        json!(1e308),
        json!([]),
        json!({}),
        json!(true),
        json!([1, "x", null]),
    ];
    let mut drawn = 0;
    for place in &places {
        for value in &values {
            let mut changed = gltf.clone();
            *changed.json.pointer_mut(place).unwrap() = value.clone();
            if let Ok(imported) = changed.import() {
                drawn += 1;
                for p in imported.scene.models.iter().flat_map(|m| &m.primitives) {
                    assert!(
                        p.indices.iter().all(|i| (*i as usize) < p.positions.len()),
                        "{place} = {value}"
                    );
                    assert!(
                        p.positions.as_flattened().iter().all(|x| x.is_finite()),
                        "{place} = {value}"
                    );
                    assert!([0, p.positions.len()].contains(&p.normals.len()), "{place} = {value}");
                }
                assert!(
                    imported.scene.objects.iter().all(|o| o.world_from_object.is_finite()),
                    "{place} = {value}"
                );
            }
        }
    }
    assert!(
        drawn > places.len(),
        "most places are not vital: {drawn} of {}",
        places.len() * values.len()
    );
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 512, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn damaged_files_never_panic(
        changes in proptest::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..20),
        keep in any::<prop::sample::Index>(),
        truncate in any::<bool>(),
    ) {
        let mut bytes = rich().glb();
        for (at, value) in changes {
            let at = at.index(bytes.len());
            bytes[at] = value;
        }
        if truncate {
            bytes.truncate(keep.index(bytes.len()));
        }
        let _ = import_bytes("x.glb", bytes);
    }

    #[test]
    fn several_wrong_members_at_once_never_panic(
        changes in proptest::collection::vec((any::<prop::sample::Index>(), 0usize..9), 2..6),
    ) {
        let mut gltf = rich();
        for (place, value) in changes {
            let mut places = Vec::new();
            pointers(&gltf.json, String::new(), &mut places);
            let value = [json!(0), json!(1), json!(2), json!(5126), json!("VEC4"), json!(-3.5), json!([]), json!({}),
                json!(9e15)][value].clone();
            *gltf.json.pointer_mut(&places[place.index(places.len())]).unwrap() = value;
        }
        let _ = gltf.import();
    }

    #[test]
    fn any_bytes_in_the_buffer_never_panic(seed in proptest::collection::vec(any::<u8>(), 1..64)) {
        let mut gltf = rich();
        let noise = seed.iter().cycle();
        for (byte, noise) in gltf.bin.iter_mut().zip(noise) {
            *byte = *noise;
        }
        let _ = gltf.import();
    }
}
