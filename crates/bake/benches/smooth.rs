//! How small and how fast are smooth LODs? Prints tables; asserts that what was decoded is what was encoded.
//! `cargo bench -p belvedere-bake --bench smooth -- [mesh,mesh …]`
//!
//! Sizes in % of 12 B a vertex + 6 B a triangle (Schmalstieg 1997, table 7), with all attributes in % of a plain GLB's
//! vertices and indices. Beside it meshoptimizer's vertex and index codecs with zstd on the same numbers, in the same run.
//! Times are CPU time of one thread.

#![allow(clippy::print_stdout, clippy::unwrap_used, missing_docs)]

mod meshes;
mod timing;

use belvedere_bake::smooth;
use belvedere_bake::smooth::error::{Ruler, Surface};
use belvedere_bake::smooth::quantise::{Precision, QuantisedMesh};
use belvedere_bake::source::{Primitive, SourceModel};
use belvedere_scene::smooth::Decoder;
use timing::timed;

/// The table's errors, of the box's diagonal.
const ERRORS: [f64; 4] = [0.03, 0.01, 0.003, 0.001];

fn main() {
    let wanted = std::env::args().nth(1).filter(|name| !name.starts_with('-'));
    println!(
        "mesh       vertices triangles |  slod B     %   bpv | thesis % | meshopt+zstd % | encode decode Mtri/s | bytes to 3 / 1 / 0.3 / 0.1 % RMS | all attributes %, meshopt+zstd %, decode Mtri/s"
    );
    let mut logs = [(0.0, 0); 4];
    for (name, make) in meshes::ALL {
        if wanted
            .as_ref()
            .is_none_or(|wanted| wanted.split(',').any(|w| w == name))
        {
            let model = make();
            for (log, share) in logs.iter_mut().zip(row(name, &model)) {
                if let Some(share) = share {
                    log.0 += share.ln();
                    log.1 += 1;
                }
            }
        }
    }
    let mean = |i: usize| (logs[i].0 / f64::from(logs[i].1)).exp();
    println!(
        "geometric mean: positions {:.2} %, meshopt + zstd {:.2} %; all attributes {:.2} %, meshopt + zstd {:.2} %",
        mean(0),
        mean(1),
        mean(2),
        mean(3)
    );
}
const READABLE: &str = "no vertex of the measured meshes has very many triangles";

/// Prints a mesh's row; gives its shares in %.
fn row(name: &str, model: &SourceModel) -> [Option<f64>; 4] {
    let plain = Precision {
        with_attributes: false,
        ..Precision::default()
    };
    let mesh = QuantisedMesh::new(model, plain);
    let (vertices, triangles) = (mesh.positions.len(), mesh.triangles.len());
    let million = triangles as f64 / 1e6;
    let (encode_s, bytes) = timed(|| smooth::encode(&mesh).expect(READABLE));
    let decode_s = decode(&bytes, &mesh);
    let object_bytes = (12 * vertices + 6 * triangles) as f64;
    let share = 100.0 * bytes.len() as f64 / object_bytes;
    let vertex_bytes: Vec<[u16; 4]> = mesh
        .positions
        .iter()
        .map(|p| [p[0] as u16, p[1] as u16, p[2] as u16, 0])
        .collect();
    let indices: Vec<u32> = mesh.triangles.iter().flatten().copied().collect();
    let other = 100.0 * meshopt_bytes(&vertex_bytes, &indices) as f64 / object_bytes;
    let reached = bytes_to_errors(&bytes, &mesh);

    let whole = QuantisedMesh::new(model, Precision::default());
    let dressed = smooth::encode(&whole).expect(READABLE);
    let dressed_s = decode(&dressed, &whole);
    let glb_bytes = glb_bytes(model) as f64;
    let dressed_share = 100.0 * dressed.len() as f64 / glb_bytes;
    let has_attributes = !whole.channels.is_empty();
    let dressed_other = 100.0 * meshopt_dressed(&whole) as f64 / glb_bytes;
    let dressed_row = if has_attributes {
        format!("{dressed_share:5.2} {dressed_other:5.2} {:5.2}", million / dressed_s)
    } else {
        "none".to_owned()
    };
    println!(
        "{name:10} {vertices:8} {triangles:9} | {:8} {share:5.2} {:5.2} | {:8.2} | {other:14.2} | {:6.2} {:6.2} | {reached:?} | {dressed_row}",
        bytes.len(),
        8.0 * bytes.len() as f64 / vertices as f64,
        thesis_share(&mesh),
        million / encode_s,
        million / decode_s,
    );
    [
        Some(share),
        Some(other),
        has_attributes.then_some(dressed_share),
        has_attributes.then_some(dressed_other),
    ]
}

/// What Schmalstieg's packets take, checking that they hold the mesh.
fn thesis_share(mesh: &QuantisedMesh) -> f64 {
    let bytes = smooth::thesis::encode(mesh).unwrap();
    let told = belvedere_scene::smooth::thesis::decode(&bytes).unwrap();
    let counts = (told.positions.len(), told.triangles.len());
    assert_eq!(counts, (mesh.positions.len(), mesh.triangles.len()));
    let object_bytes = 12 * counts.0 + 6 * counts.1;
    100.0 * bytes.len() as f64 / object_bytes as f64
}

/// Bytes of vertices and indices of a plain GLB.
fn glb_bytes(model: &SourceModel) -> usize {
    let floats = |p: &Primitive| {
        3 * p.positions.len() + 3 * p.normals.len() + 4 * p.colors.len() + 2 * p.uvs.iter().map(Vec::len).sum::<usize>()
    };
    let index = |p: &Primitive| if p.positions.len() > 65535 { 4 } else { 2 };
    model
        .primitives
        .iter()
        .map(|p| 4 * floats(p) + index(p) * p.indices.len())
        .sum()
}

/// Seconds of CPU time that decoding takes, checking what comes out.
fn decode(bytes: &[u8], mesh: &QuantisedMesh) -> f64 {
    let rounds = (1_000_000 / mesh.triangles.len()).clamp(1, 200);
    let run = || {
        let mut decoder = Decoder::new(u64::MAX);
        decoder.push(bytes).unwrap();
        assert!(decoder.is_complete());
        decoder
    };
    let (seconds, decoder) = timed(|| {
        (1..rounds).for_each(|_| drop(run()));
        run()
    });
    assert!(
        smooth::canonical::of_mesh(mesh) == smooth::canonical::of_lattice(&decoder.lattice(), mesh.stride()),
        "what was decoded differs"
    );
    seconds / rounds as f64
}

/// How many bytes of a stream it takes until the error stays below each of [`ERRORS`].
fn bytes_to_errors(bytes: &[u8], mesh: &QuantisedMesh) -> Vec<usize> {
    let source = Surface::of(mesh);
    let ruler = Ruler::new(&source, 4000);
    let error_of = |count: usize| {
        let mut decoder = Decoder::new(u64::MAX);
        decoder.push(&bytes[..count]).unwrap();
        let (twice_positions, triangles) = decoder.geometry();
        ruler.rms(&Surface::new(&twice_positions, triangles)) / source.diagonal()
    };
    let mut least = 200.min(bytes.len());
    ERRORS
        .map(|wanted| {
            let (mut low, mut high) = (least, bytes.len());
            while high - low > 32 && high * 100 > low * 103 {
                let middle = low.midpoint(high);
                if error_of(middle) <= wanted {
                    high = middle
                } else {
                    low = middle
                }
            }
            least = low;
            high
        })
        .to_vec()
}

fn meshopt_bytes<T: Clone + Default>(vertices: &[T], indices: &[u32]) -> usize {
    let cached = meshopt::optimize_vertex_cache(indices, vertices.len());
    let mut indices = cached;
    let vertices = meshopt::optimize_vertex_fetch(&mut indices, vertices);
    let mut coded = meshopt::encode_vertex_buffer(&vertices).unwrap();
    coded.extend(meshopt::encode_index_buffer(&indices, vertices.len()).unwrap());
    zstd::bulk::compress(&coded, 19).unwrap().len()
}

/// The same for vertices with all their attributes, as gltfpack has them: positions, then channels.
fn meshopt_dressed(mesh: &QuantisedMesh) -> usize {
    let stride = mesh.stride();
    let mut rows: Vec<[u16; 16]> = vec![[0; 16]; mesh.values.len().checked_div(stride).unwrap_or(0)];
    for (triangle, corners) in mesh.triangles.iter().zip(&mesh.corners) {
        for (&vertex, &wedge) in triangle.iter().zip(corners) {
            let numbers = mesh.positions[vertex as usize]
                .iter()
                .chain(&mesh.values[wedge as usize * stride..][..stride]);
            for (slot, number) in rows[wedge as usize].iter_mut().zip(numbers) {
                *slot = *number as u16;
            }
        }
    }
    let indices: Vec<u32> = mesh.corners.iter().flatten().copied().collect();
    if rows.is_empty() {
        0
    } else {
        meshopt_bytes(&rows, &indices)
    }
}
