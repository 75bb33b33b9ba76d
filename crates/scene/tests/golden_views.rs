//! Does every language choose the same triangles of a smooth LOD for the same path of an eye? Small streams, and for each view
//! what was done and hashes of what is drawn; the viewer's tests read the same file. `make bless` writes it anew.

#![allow(missing_docs)]
#![allow(clippy::unwrap_used, reason = "a test may fail at any step")]

use std::{env, fs, path::PathBuf};

use belvedere_scene::BlobHash;
use belvedere_scene::smooth::Decoder;
use belvedere_scene::smooth::select::{ClusterTree, Selection, View};
use serde_json::{Value, json};

/// Steps of a path; after the first so many, the second half of the stream has come.
const STEPS: u32 = 14;
const STEPS_OF_HALF: u32 = 5;
const LEAST_TRIANGLES: usize = 12;

fn folder() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../tests/golden/smooth")
}

/// A walk over the model from one corner of its box to another, looking ahead and now and then all around; in the end
/// without any error, and with any.
fn view(step: u32, (low, high): ([f64; 3], [f64; 3])) -> (View, usize) {
    let part = f64::from(step) / f64::from(STEPS);
    let eye: [f64; 3] = std::array::from_fn(|axis| low[axis] + (high[axis] - low[axis]) * part * [1.0, 0.9, 0.7][axis]);
    let ahead = [0.8, 0.0, 0.6];
    let plane = |normal: [f64; 3]| {
        let [x, y, z] = normal;
        [x, y, z, -(x * eye[0] + y * eye[1] + z * eye[2])]
    };
    let planes = if step % 5 == 3 {
        Vec::new()
    } else {
        vec![plane(ahead), plane([0.6, 0.0, -0.8])]
    };
    let most_error_px = match STEPS - step {
        1 => f64::INFINITY,
        2 => 0.0,
        _ => [0.5, 6.0, 1.5][step as usize % 3],
    };
    let view = View {
        eye,
        planes,
        pixels: 700.0,
        most_error_px,
        outside: if step % 4 == 2 { f64::INFINITY } else { 9.5 },
    };
    (view, if step % 3 == 2 { 1_000_000 } else { 400 })
}

fn hash(words: impl Iterator<Item = u32>) -> String {
    BlobHash::of(&words.flat_map(u32::to_le_bytes).collect::<Vec<u8>>()).to_string()
}

fn hash_of_tree(decoder: &Decoder) -> String {
    let tree = ClusterTree::new(decoder);
    let numbers = (1..tree.vertices() as u32).flat_map(|split| [tree.error(split), tree.radius(split)]);
    hash(
        numbers
            .map(f64::to_bits)
            .flat_map(|bits| [bits as u32, (bits >> 32) as u32]),
    )
}

fn hash_of_cut(selection: &Selection, decoder: &Decoder) -> String {
    let drawn = selection.drawn().iter();
    let corners = drawn.flat_map(|&t| [Some([t, 0, 0]), Some(selection.triangle(t)), selection.wedges(t)]);
    let snapshot = selection.snapshot(decoder);
    let positions = snapshot.positions.as_flattened().iter().map(|x| x.to_bits());
    hash(
        corners
            .flatten()
            .flatten()
            .chain(positions)
            .chain(snapshot.indices.concat()),
    )
}

fn told(name: &str) -> Value {
    let bytes = fs::read(folder().join(format!("{name}.slod"))).unwrap();
    let half = bytes.len() / 2;
    let mut decoder = Decoder::new(1 << 24);
    decoder.push(&bytes[..half]).unwrap();
    let positions = {
        let mut whole = Decoder::new(1 << 24);
        whole.push(&bytes).unwrap();
        whole.snapshot().positions
    };
    let side = |pick: fn(f64, f64) -> f64, start: f64| -> [f64; 3] {
        std::array::from_fn(|axis| positions.iter().map(|p| f64::from(p[axis])).fold(start, pick))
    };
    let space = (side(f64::min, 1e9), side(f64::max, -1e9));
    let mut selection = Selection::new(ClusterTree::new(&decoder), LEAST_TRIANGLES);
    let mut trees = vec![hash_of_tree(&decoder)];
    let mut steps = Vec::new();
    for step in 0..STEPS {
        if step == STEPS_OF_HALF {
            decoder.push(&bytes[half..]).unwrap();
            selection.grow(ClusterTree::new(&decoder));
            trees.push(hash_of_tree(&decoder));
        }
        let (view, most_work) = view(step, space);
        let done = selection.update(&view, most_work);
        let (clusters, triangles) = selection.counts();
        // What is infinite becomes `null`.
        steps.push(json!({
            "eye": view.eye, "planes": view.planes, "pixels": view.pixels, "most_error_px": view.most_error_px,
            "outside": view.outside, "most_work": most_work,
            "splits": done.splits, "merges": done.merges, "work": done.work, "is_settled": done.is_settled,
            "clusters": clusters, "triangles": triangles, "hash": hash_of_cut(&selection, &decoder),
        }));
    }
    json!({
        "name": name, "half": half, "steps_of_half": STEPS_OF_HALF, "least_triangles": LEAST_TRIANGLES,
        "trees": trees, "steps": steps,
    })
}

#[test]
fn paths_of_eyes_give_the_triangles_that_they_gave() {
    let told: Value = ["bowl", "soup", "cube", "plain", "nothing"]
        .into_iter()
        .map(told)
        .collect();
    let told = format!("{told:#}\n");
    let file = folder().join("views.json");
    if env::var_os("BELVEDERE_BLESS").is_some() {
        fs::write(&file, &told).unwrap();
    }
    assert!(
        fs::read_to_string(&file).unwrap() == told,
        "other triangles than before; `make bless` if that is meant"
    );
}
