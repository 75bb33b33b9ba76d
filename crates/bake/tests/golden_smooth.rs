//! Do all readers of smooth LODs see the same, today and tomorrow? A few small streams with the hashes of what they give
//! at many lengths; the viewer's tests read the same files. `make bless` writes them anew.

#![allow(missing_docs)]

use std::{env, fs, path::PathBuf};

use belvedere_bake::smooth::{
    encode,
    quantise::{Precision, QuantisedMesh},
};
use belvedere_bake::source::{Primitive, SourceModel};
use belvedere_scene::BlobHash;
use belvedere_scene::smooth::{Decoder, Header};
use serde_json::{Value, json};

/// Sizes of the portions in which a stream is read besides its cuts.
const PORTIONS: u32 = 7;

fn folder() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../tests/golden/smooth")
}

/// A bowl of n × n quads with a seam in its texture, half of it of another material.
fn bowl(n: u16) -> SourceModel {
    let row = u32::from(n) + 1;
    let half = |side: u16| {
        let mut primitive = Primitive {
            material: Some(usize::from(side)),
            uvs: vec![Vec::new()],
            ..Primitive::default()
        };
        let last = f32::from(n);
        for (j, i) in (0..=n).flat_map(|j| (0..=n).map(move |i| (j, i))) {
            let (x, z) = (f32::from(side) + f32::from(i) / last, f32::from(j) / last);
            let (dx, dz) = (x - 1.0, z - 0.5);
            primitive.positions.push([x, dx * dx + dz * dz, z]);
            let length = (4.0 * dx * dx + 1.0 + 4.0 * dz * dz).sqrt();
            primitive.normals.push([-2.0 * dx, 1.0, -2.0 * dz].map(|v| v / length));
            primitive.uvs[0].push([f32::from(i) / last, z]);
        }
        for a in (0..u32::from(n)).flat_map(|j| j * row..j * row + u32::from(n)) {
            primitive
                .indices
                .extend([a, a + row, a + 1, a + 1, a + row, a + row + 1]);
        }
        primitive
    };
    SourceModel {
        primitives: vec![half(0), half(1)],
        ..SourceModel::default()
    }
}

/// A bowl so far from its origin that an f32 is coarser than the lattice.
fn far() -> SourceModel {
    let mut bowl = bowl(9);
    for x in bowl.primitives.iter_mut().flat_map(|p| p.positions.as_flattened_mut()) {
        *x += 1e5;
    }
    bowl
}

/// Triangles over the points of a small lattice, in colour: edges and corners that no surface has.
fn soup() -> SourceModel {
    let mut state = 7u32;
    let mut random = |below: u32| {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 16) % below
    };
    let mut primitive = Primitive::default();
    for i in 0..300 {
        let [x, y, z] = [random(5), random(5), random(3)].map(|v| v as f32);
        primitive.indices.push(i);
        primitive.positions.push([x, y, z]);
        primitive.colors.push([x / 4.0, y / 4.0, random(3) as f32, 1.0]);
    }
    SourceModel {
        primitives: vec![primitive],
        ..SourceModel::default()
    }
}

/// A box of n × n quads on each side: closed, with flat parts and sharp edges.
fn cube(n: i16) -> SourceModel {
    let mut primitive = Primitive::default();
    for side in 0..6u32 {
        for (j, i) in (0..n).flat_map(|j| (0..n).map(move |i| (j, i))) {
            for (u, v) in [(0, 0), (1, 0), (1, 1), (0, 0), (1, 1), (0, 1)] {
                let (u, v) = (f32::from(i + u), f32::from(j + v));
                let (u, v) = if side < 3 { (u, v) } else { (v, u) };
                let mut corner = [u, v, if side < 3 { 0.0 } else { f32::from(n) }];
                corner.rotate_right((side % 3) as usize);
                primitive.indices.push(primitive.positions.len() as u32);
                primitive.positions.push(corner);
            }
        }
    }
    SourceModel {
        primitives: vec![primitive],
        ..SourceModel::default()
    }
}

/// A hash of all numbers of the mesh and of all that is drawn.
fn hash(decoder: &Decoder) -> String {
    let lattice = decoder.lattice();
    let snapshot = decoder.snapshot();
    let mut bytes = Vec::new();
    let mut put = |count: usize, words: &mut dyn Iterator<Item = u32>| {
        bytes.extend((count as u32).to_le_bytes());
        bytes.extend(words.flat_map(u32::to_le_bytes));
    };
    for rows in [&lattice.triangles, &lattice.corners] {
        put(rows.len(), &mut rows.iter().flatten().copied());
    }
    put(
        lattice.twice_positions.len(),
        &mut lattice.twice_positions.iter().flatten().map(|&x| x as u32),
    );
    put(lattice.values.len(), &mut lattice.values.iter().map(|&x| x as u32));
    put(
        lattice.materials.len(),
        &mut lattice.materials.iter().map(|&x| u32::from(x)),
    );
    let floats = [&snapshot.positions, &snapshot.normals];
    for rows in floats {
        put(rows.len(), &mut rows.iter().flatten().map(|x| x.to_bits()));
    }
    for set in &snapshot.uvs {
        put(set.len(), &mut set.iter().flatten().map(|x| x.to_bits()));
    }
    put(
        snapshot.colours.len(),
        &mut snapshot.colours.iter().flatten().map(|x| x.to_bits()),
    );
    for corners in &snapshot.indices {
        put(corners.len(), &mut corners.iter().copied());
    }
    BlobHash::of(&bytes).to_string()
}

/// What a stream gives after several lengths.
fn told(bytes: &[u8]) -> Value {
    let (header, header_bytes) = Header::read(bytes).expect("a header").expect("all of it");
    let total = header.total_bytes;
    let mut lengths: Vec<u32> = (0..PORTIONS).map(|i| i * total / PORTIONS).collect();
    lengths.push(header_bytes as u32);
    lengths.push(total);
    lengths.extend(header.cuts.iter().map(|cut| cut.bytes));
    lengths.sort_unstable();
    lengths.dedup();
    let told = lengths.into_iter().map(|length| {
        let mut decoder = Decoder::new(1 << 24);
        decoder.push(&bytes[..length as usize]).expect("a beginning");
        json!({"bytes": length, "triangles": decoder.counts().1, "hash": hash(&decoder)})
    });
    told.collect()
}

#[test]
fn streams_and_what_they_give_are_as_they_were() {
    let precision = |position_bits, with_attributes| Precision {
        position_bits,
        with_attributes,
        ..Precision::default()
    };
    let blesses = env::var_os("BELVEDERE_BLESS").is_some();
    for (name, model, precision) in [
        ("bowl", bowl(9), precision(14, true)),
        ("soup", soup(), precision(6, true)),
        ("cube", cube(6), precision(16, true)),
        ("plain", bowl(12), precision(12, false)),
        ("far", far(), precision(14, false)),
        ("nothing", SourceModel::default(), precision(14, true)),
    ] {
        let bytes = encode(&QuantisedMesh::new(&model, precision)).unwrap();
        let told = format!("{:#}\n", told(&bytes));
        let (stream, hashes) = (
            folder().join(format!("{name}.slod")),
            folder().join(format!("{name}.json")),
        );
        if blesses {
            fs::create_dir_all(folder()).unwrap();
            fs::write(&stream, &bytes).unwrap();
            fs::write(&hashes, &told).unwrap();
        }
        assert!(
            fs::read(&stream).unwrap() == bytes,
            "{name}: other bytes than before; `make bless` if that is meant"
        );
        assert_eq!(fs::read_to_string(&hashes).unwrap(), told, "{name}");
    }
}
