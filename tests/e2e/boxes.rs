//! Scenes of boxes, as GLB. Also used by `tests/services`.

use serde_json::{Value, json};

/// A cube from 0 to 1, faces outwards: corner i has x, y, z at 1 where bits 0, 1, 2 are set.
fn cube() -> (Vec<u8>, Vec<u8>) {
    const QUADS: [[u16; 4]; 6] = [
        [0, 4, 6, 2],
        [1, 3, 7, 5],
        [0, 1, 5, 4],
        [2, 6, 7, 3],
        [0, 2, 3, 1],
        [4, 5, 7, 6],
    ];
    let corner = |i: usize| [i & 1, i >> 1 & 1, i >> 2 & 1];
    let positions = (0..8).flat_map(|i| corner(i).map(|bit| bit as f32));
    let indices = QUADS.iter().flat_map(|[a, b, c, d]| [a, b, c, a, c, d]);
    (
        positions.flat_map(f32::to_le_bytes).collect(),
        indices.flat_map(|i| i.to_le_bytes()).collect(),
    )
}

/// A GLB of boxes.
pub(crate) fn boxes(boxes: &[Named]) -> Vec<u8> {
    askew(boxes, 0.0)
}

/// A GLB of boxes all of which are turned about +Y.
pub(crate) fn askew(boxes: &[Named], degrees: f64) -> Vec<u8> {
    let (positions, indices) = cube();
    let half = 0.5 * degrees.to_radians();
    let mut nodes: Vec<Value> = boxes
        .iter()
        .map(|(name, min, max)| {
            let size: [f64; 3] = std::array::from_fn(|axis| max[axis] - min[axis]);
            json!({"name": name, "mesh": 0, "translation": min, "scale": size})
        })
        .collect();
    let all: Vec<_> = (0..nodes.len()).collect();
    nodes.push(json!({"name": "all", "children": all, "rotation": [0.0, half.sin(), 0.0, half.cos()]}));
    let document = json!({
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [nodes.len() - 1]}],
        "nodes": nodes,
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 8, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 1]},
            {"bufferView": 1, "componentType": 5123, "count": 36, "type": "SCALAR"},
        ],
        "bufferViews": [
            {"buffer": 0, "byteOffset": 0, "byteLength": positions.len()},
            {"buffer": 0, "byteOffset": positions.len(), "byteLength": indices.len()},
        ],
        "buffers": [{"byteLength": positions.len() + indices.len()}],
    });
    let mut text = document.to_string().into_bytes();
    text.resize(text.len().next_multiple_of(4), b' ');
    let binary = [positions, indices].concat();
    let length = |bytes: &[u8]| u32::try_from(bytes.len()).expect("a small file").to_le_bytes();
    let chunks = [
        &length(&text)[..],
        b"JSON",
        &text,
        &length(&binary)[..],
        b"BIN\0",
        &binary,
    ]
    .concat();
    let total = u32::try_from(12 + chunks.len()).expect("a small file").to_le_bytes();
    [&b"glTF"[..], &2u32.to_le_bytes(), &total, &chunks].concat()
}

/// A box: its name, lowest and highest corner.
pub(crate) type Named = (&'static str, [f64; 3], [f64; 3]);

/// Rooms to the west and the east of a wall at x = 5 m, a door in it from z = 2 m to 3 m.
pub(crate) const TWO_ROOMS: [Named; 12] = [
    ("floor", [-0.2, -0.2, -0.2], [10.4, 0.0, 5.2]),
    ("ceiling", [-0.2, 3.0, -0.2], [10.4, 3.2, 5.2]),
    ("west", [-0.2, 0.0, -0.2], [0.0, 3.0, 5.2]),
    ("east", [10.2, 0.0, -0.2], [10.4, 3.0, 5.2]),
    ("south", [0.0, 0.0, -0.2], [10.2, 3.0, 0.0]),
    ("north", [0.0, 0.0, 5.0], [10.2, 3.0, 5.2]),
    ("left of the door", [5.0, 0.0, 0.0], [5.2, 3.0, 2.0]),
    ("right of the door", [5.0, 0.0, 3.0], [5.2, 3.0, 5.0]),
    ("lintel", [5.0, 2.2, 2.0], [5.2, 3.0, 3.0]),
    ("door:between", [5.0, 0.0, 2.0], [5.2, 2.2, 3.0]),
    ("beyond", [1.0, 0.0, 1.0], [1.4, 0.5, 1.4]),
    ("here", [9.0, 0.0, 2.3], [9.4, 1.5, 2.7]),
];

pub(crate) fn two_rooms() -> Vec<u8> {
    boxes(&TWO_ROOMS)
}
