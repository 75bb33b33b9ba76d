//! How do vertices and indices lie in a glTF buffer? (glTF 2.0 §3.6, §3.7, `EXT_meshopt_compression`)
//!
//! Vertices with equal rows become one; triangles are put into an order that suits the vertex cache (Forsyth,
//! *Linear-Speed Vertex Cache Optimisation*, 2006, through meshopt), vertices into the order of their first use. There
//! is one buffer view for each attribute of each primitive and one for its indices. A view is compressed when that saves
//! more than the words that say so.

use serde_json::{Map, Value, json};

use crate::glb::lattice::Frame;
use crate::glb::streams::{self, Stream, UNSIGNED_SHORT};
use crate::meshopt_view;
use crate::source::{Material, Primitive, Topology};

const ARRAY_BUFFER: u32 = 34962;
const ELEMENT_ARRAY_BUFFER: u32 = 34963;
const UNSIGNED_INT: u32 = 5125;
/// What it takes to say that a view is compressed.
const WORDS_BYTES: usize = 140;

/// Collects the binary chunk and what describes it.
#[derive(Default)]
pub(super) struct BufferWriter {
    bytes: Vec<u8>,
    /// Length of the buffer that compressed views unfold into.
    unfolded_bytes: usize,
    views: Vec<Value>,
    accessors: Vec<Value>,
}

/// Rows of a buffer view.
struct Rows<'a> {
    mode: &'static str,
    filter: &'static str,
    stride: usize,
    plain: &'a [u8],
    compressed: Option<Vec<u8>>,
}

impl BufferWriter {
    /// Writes a primitive's data and returns its JSON, without material.
    pub(super) fn primitive(
        &mut self,
        primitive: &Primitive,
        frame: &Frame,
        material: Option<&Material>,
    ) -> Map<String, Value> {
        let (streams, indices) = ordered(primitive, streams::streams(primitive, frame, material));
        let vertices = streams[0].rows.len() / streams[0].stride;
        let mut attributes = Map::new();
        for stream in &streams {
            attributes.insert(stream.name.clone(), json!(self.stream(stream, vertices)));
        }
        let mode = match primitive.topology {
            Topology::Points => 0,
            Topology::Lines => 1,
            Topology::Triangles => 4,
        };
        let mut json = Map::new();
        json.insert("attributes".into(), Value::Object(attributes));
        let indices = self.indices(&indices, vertices, primitive.topology);
        json.insert("indices".into(), json!(indices));
        json.insert("mode".into(), json!(mode));
        json
    }

    /// Describes everything that was written and hands over the binary chunk, padded to a multiple of four.
    pub(super) fn write_into(self, root: &mut Map<String, Value>) -> Vec<u8> {
        if !self.bytes.is_empty() {
            root.insert("accessors".into(), Value::Array(self.accessors));
            root.insert("bufferViews".into(), Value::Array(self.views));
            let mut buffers = vec![json!({"byteLength": self.bytes.len()})];
            if self.unfolded_bytes > 0 {
                let extensions = json!({meshopt_view::EXTENSION: {"fallback": true}});
                buffers.push(json!({"byteLength": self.unfolded_bytes, "extensions": extensions}));
            }
            root.insert("buffers".into(), Value::Array(buffers));
        }
        self.bytes
    }

    /// Whether any view is compressed.
    pub(super) fn is_compressed(&self) -> bool {
        self.unfolded_bytes > 0
    }

    fn stream(&mut self, stream: &Stream, vertices: usize) -> usize {
        let plain = stream.unfiltered();
        let view = self.view(&Rows {
            mode: "ATTRIBUTES",
            filter: stream.filter,
            stride: stream.stride,
            plain: &plain,
            compressed: meshopt_view::encode_attributes(&stream.rows, stream.stride),
        });
        self.views[view]["byteStride"] = json!(stream.stride);
        self.views[view]["target"] = json!(ARRAY_BUFFER);
        let mut accessor = json!({"bufferView": view, "componentType": stream.component, "count": vertices,
            "type": stream.shape});
        if stream.normalized {
            accessor["normalized"] = json!(true);
        }
        if stream.name == "POSITION" {
            let (min, max) = extent(&plain, stream);
            accessor["min"] = min;
            accessor["max"] = max;
        }
        self.accessors.push(accessor);
        self.accessors.len() - 1
    }

    fn indices(&mut self, indices: &[u32], vertices: usize, topology: Topology) -> usize {
        // The largest index of a width is reserved: it restarts a strip.
        let (component, stride, plain): (_, _, Vec<u8>) = if vertices <= usize::from(u16::MAX) {
            let bytes = indices.iter().flat_map(|&i| (i as u16).to_le_bytes());
            (UNSIGNED_SHORT, 2, bytes.collect())
        } else {
            let bytes = indices.iter().flat_map(|i| i.to_le_bytes());
            (UNSIGNED_INT, 4, bytes.collect())
        };
        let (mode, compressed) = match topology {
            Topology::Triangles => ("TRIANGLES", meshopt::encode_index_buffer(indices, vertices)),
            _ => ("INDICES", meshopt::encode_index_sequence(indices, vertices)),
        };
        let view = self.view(&Rows {
            mode,
            filter: "NONE",
            stride,
            plain: &plain,
            compressed: compressed.ok(),
        });
        self.views[view]["target"] = json!(ELEMENT_ARRAY_BUFFER);
        self.accessors
            .push(json!({"bufferView": view, "componentType": component, "count": indices.len(), "type": "SCALAR"}));
        self.accessors.len() - 1
    }

    /// Adds a view, compressed or not.
    fn view(&mut self, rows: &Rows) -> usize {
        let length = rows.plain.len();
        let compressed = rows.compressed.as_ref().filter(|c| c.len() + WORDS_BYTES < length);
        let view = match compressed {
            None => json!({"buffer": 0, "byteOffset": self.append(rows.plain), "byteLength": length}),
            Some(compressed) => {
                let mut compression = json!({"buffer": 0, "byteOffset": self.append(compressed),
                    "byteLength": compressed.len(), "byteStride": rows.stride, "count": length / rows.stride,
                    "mode": rows.mode});
                if rows.filter != "NONE" {
                    compression["filter"] = json!(rows.filter);
                }
                let start = self.unfolded_bytes;
                self.unfolded_bytes = (start + length).next_multiple_of(4);
                json!({"buffer": 1, "byteOffset": start, "byteLength": length,
                    "extensions": {meshopt_view::EXTENSION: compression}})
            }
        };
        self.views.push(view);
        self.views.len() - 1
    }

    /// Appends to the binary chunk, up to a multiple of four; answers where it starts.
    fn append(&mut self, bytes: &[u8]) -> usize {
        let start = self.bytes.len();
        self.bytes.extend_from_slice(bytes);
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        start
    }
}

/// The same shapes with each vertex once, in an order that compresses and draws well.
fn ordered(primitive: &Primitive, mut streams: Vec<Stream>) -> (Vec<Stream>, Vec<u32>) {
    let vertices = primitive.positions.len();
    let first = first_of_equals(&streams, vertices);
    let mut indices: Vec<u32> = primitive.indices.iter().map(|i| first[*i as usize]).collect();
    if primitive.topology == Topology::Triangles {
        meshopt::optimize_vertex_cache_in_place(&mut indices, vertices);
    }
    let mut number = vec![u32::MAX; vertices];
    let mut used = Vec::new();
    for index in &mut indices {
        let number = &mut number[*index as usize];
        if *number == u32::MAX {
            *number = used.len() as u32;
            used.push(*index);
        }
        *index = *number;
    }
    for stream in &mut streams {
        stream.rows = used.iter().flat_map(|v| stream.row(*v)).copied().collect();
    }
    (streams, indices)
}

/// For each vertex the first one whose rows are equal to its own.
fn first_of_equals(streams: &[Stream], vertices: usize) -> Vec<u32> {
    let row = |vertex: u32| streams.iter().map(move |stream| stream.row(vertex));
    let mut sorted: Vec<u32> = (0..vertices as u32).collect();
    sorted.sort_unstable_by(|a, b| row(*a).cmp(row(*b)).then(a.cmp(b)));
    let mut first = vec![0; vertices];
    for equals in sorted.chunk_by(|a, b| row(*a).eq(row(*b))) {
        for vertex in equals {
            first[*vertex as usize] = equals[0];
        }
    }
    first
}

/// Smallest and largest coordinates. Floats as f64, so that the JSON says exactly what the f32 is.
fn extent(plain: &[u8], stream: &Stream) -> (Value, Value) {
    let rows = plain.chunks_exact(stream.stride);
    if stream.component == UNSIGNED_SHORT {
        let word = |row: &[u8], a: usize| u16::from_le_bytes([row[2 * a], row[2 * a + 1]]);
        let rows: Vec<[u16; 3]> = rows.map(|row| std::array::from_fn(|a| word(row, a))).collect();
        let ends = |pick: fn(u16, u16) -> u16| {
            rows.iter()
                .copied()
                .reduce(|x, y| std::array::from_fn(|a| pick(x[a], y[a])))
        };
        (json!(ends(u16::min)), json!(ends(u16::max)))
    } else {
        let float = |row: &[u8], a: usize| f32::from_le_bytes(std::array::from_fn(|i| row[4 * a + i]));
        let rows: Vec<[f64; 3]> = rows.map(|row| std::array::from_fn(|a| float(row, a).into())).collect();
        let ends = |pick: fn(f64, f64) -> f64| {
            rows.iter()
                .copied()
                .reduce(|x, y| std::array::from_fn(|a| pick(x[a], y[a])))
        };
        (json!(ends(f64::min)), json!(ends(f64::max)))
    }
}
