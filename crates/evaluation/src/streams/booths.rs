//! Which world is measured in? A grid of booths, each a view cell of its own between opaque walls, and movers so large
//! that they reach into all of them.
//!
//! In one room thousands of participants would all be told of each other, which is quadratic and not what is measured.
//! Here each is told of the movers, and of the few who stand in the same booth.

use serde_json::{Value, json};

/// Booths along one side.
pub const SIDE: usize = 32;
/// From one booth to the next, metres. All are within 20 m of the middle, where movers are told of each tick.
const PITCH_M: f64 = 0.7;
const HEIGHT_M: f64 = 2.2;
const HALF_WALL_M: f64 = 0.05;

/// Movers reach everywhere from the middle.
pub const MOVER_RADIUS_M: f64 = 30.0;

/// Where the `i`-th participant stands.
#[must_use]
pub fn place(i: usize) -> [f64; 3] {
    let (booth, among) = (i % (SIDE * SIDE), i / (SIDE * SIDE));
    let at = |i: usize| (i as f64 + 0.5) * PITCH_M;
    // Side by side in a booth, a centimetre apart.
    let aside = (among % 40) as f64 * 0.01 - 0.2;
    [at(booth % SIDE) + aside, 1.5, at(booth / SIDE)]
}

/// The middle of the world.
#[must_use]
pub fn middle() -> [f64; 3] {
    let half = SIDE as f64 * PITCH_M / 2.0;
    [half, 1.5, half]
}

/// The world as a binary glTF.
#[must_use]
pub fn glb() -> Vec<u8> {
    let corner =
        |bit: usize| -> [f32; 3] { std::array::from_fn(|axis| if bit >> (2 - axis) & 1 == 1 { 0.5 } else { -0.5 }) };
    let faces: [[u16; 4]; 6] = [
        [0, 1, 3, 2],
        [4, 6, 7, 5],
        [0, 4, 5, 1],
        [2, 3, 7, 6],
        [0, 2, 6, 4],
        [1, 5, 7, 3],
    ];
    let mut bytes: Vec<u8> = (0..8).flat_map(corner).flat_map(f32::to_le_bytes).collect();
    let triangles = faces.iter().flat_map(|[a, b, c, d]| [a, b, c, a, c, d]);
    bytes.extend(triangles.flat_map(|index| index.to_le_bytes()));
    let nodes = nodes();
    let json = json!({
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": (0..nodes.len()).collect::<Vec<_>>()}],
        "nodes": nodes,
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 8, "type": "VEC3", "min": [-0.5, -0.5, -0.5], "max": [0.5, 0.5, 0.5]},
            {"bufferView": 1, "componentType": 5123, "count": 36, "type": "SCALAR"}
        ],
        "bufferViews": [{"buffer": 0, "byteOffset": 0, "byteLength": 96}, {"buffer": 0, "byteOffset": 96, "byteLength": 72}],
        "buffers": [{"byteLength": bytes.len()}]
    });
    let mut json = json.to_string().into_bytes();
    json.resize(json.len().next_multiple_of(4), b' ');
    let length = |bytes: &[u8]| (bytes.len() as u32).to_le_bytes();
    let all = (12 + 8 + json.len() + 8 + bytes.len()) as u32;
    [
        &b"glTF\x02\0\0\0"[..],
        &all.to_le_bytes(),
        &length(&json),
        b"JSON",
        &json,
        &length(&bytes),
        b"BIN\0",
        &bytes,
    ]
    .concat()
}

/// Walls between the booths, floor and ceiling, and a cell in each booth; all of them the same cube.
fn nodes() -> Vec<Value> {
    let cube = |name: String, from: [f64; 3], to: [f64; 3]| {
        let middle: [f64; 3] = std::array::from_fn(|axis| (from[axis] + to[axis]) / 2.0);
        let size: [f64; 3] = std::array::from_fn(|axis| to[axis] - from[axis]);
        json!({"name": name, "mesh": 0, "translation": middle, "scale": size})
    };
    let (t, h, side) = (HALF_WALL_M, HEIGHT_M, SIDE as f64 * PITCH_M);
    let mut nodes = vec![
        cube("floor".to_owned(), [-t, -0.2, -t], [side + t, 0.0, side + t]),
        cube("ceiling".to_owned(), [-t, h, -t], [side + t, h + 0.2, side + t]),
    ];
    for i in 0..=SIDE {
        let at = i as f64 * PITCH_M;
        nodes.push(cube(
            format!("wall x {i}"),
            [at - t, -0.1, -t],
            [at + t, h + 0.1, side + t],
        ));
        nodes.push(cube(
            format!("wall z {i}"),
            [-t, -0.1, at - t],
            [side + t, h + 0.1, at + t],
        ));
    }
    for i in 0..SIDE * SIDE {
        let [x, z] = [i % SIDE, i / SIDE].map(|i| i as f64 * PITCH_M);
        let to = [x + PITCH_M - t, h, z + PITCH_M - t];
        nodes.push(cube(format!("cell:{i}"), [x + t, 0.0, z + t], to));
    }
    nodes
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn everybody_stands_in_a_booth_within_reach_of_the_middle() {
        for i in 0..20_000 {
            let [x, _, z] = place(i);
            let inside = |at: f64| (at / PITCH_M).fract() * PITCH_M > HALF_WALL_M;
            assert!(inside(x) && inside(z), "{i}");
            let [mx, _, mz] = middle();
            assert!((x - mx).hypot(z - mz) < 16.0, "{i}");
        }
    }

    #[test]
    fn the_world_is_a_whole_file() {
        let glb = glb();
        assert_eq!(glb[8..12], (glb.len() as u32).to_le_bytes());
        assert_eq!(glb.len() % 4, 0);
    }
}
