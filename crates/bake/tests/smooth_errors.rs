//! Does the error of a smooth LOD never rise along its stream? Towers of a city: large walls along the axes, and many small boxes
//! on them, which are what a coarse lattice may hold better by chance than the finer ones that follow.

#![allow(missing_docs)]

use belvedere_bake::{
    smooth::{
        encode,
        error::{Ruler, Surface},
        quantise::{Precision, QuantisedMesh},
    },
    source::{Primitive, SourceModel},
};
use belvedere_scene::smooth::Decoder;

/// By what factor the root mean square may be above the least before it.
const MOST_RISE: f64 = 1.05;
/// What is less, in steps of the lattice, is noise of the samples.
const NOISE: f64 = 0.1;

/// A tower in metres.
#[derive(Debug, Clone, Copy)]
struct Tower {
    width: f32,
    storeys: u16,
    storey: f32,
    /// Of a window box: how far it stands out, and how far in.
    depths: [f32; 2],
}

impl Tower {
    fn model(self) -> SourceModel {
        let mut primitive = Primitive::default();
        let height = self.storey * f32::from(self.storeys) + 1.0;
        add_box(&mut primitive, [0.0; 3], [self.width, height, self.width]);
        let bay = (self.width - 1.0) / 4.0;
        for (storey, window) in (0..self.storeys).flat_map(|storey| (0..4u8).map(move |window| (storey, window))) {
            let (x, y) = (1.0 + bay * f32::from(window), 1.0 + self.storey * f32::from(storey));
            let low = [x, y, -self.depths[0]];
            let high = [x + 0.55 * bay, y + 0.5 * self.storey, self.depths[1]];
            for wall in 0..4 {
                let first = primitive.positions.len();
                add_box(&mut primitive, low, high);
                for [x, _, z] in &mut primitive.positions[first..] {
                    for _ in 0..wall {
                        (*x, *z) = (self.width - *z, *x);
                    }
                }
            }
        }
        SourceModel {
            primitives: vec![primitive],
            ..SourceModel::default()
        }
    }
}

/// A box with six hard sides of which nobody shares a vertex.
fn add_box(primitive: &mut Primitive, low: [f32; 3], high: [f32; 3]) {
    for axis in 0..3 {
        for (is_high, end) in [(false, low[axis]), (true, high[axis])] {
            let first = primitive.positions.len() as u32;
            let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
            for (a, b) in [(low, low), (high, low), (high, high), (low, high)] {
                let mut at = [0.0; 3];
                (at[axis], at[u], at[v]) = (end, a[u], b[v]);
                primitive.positions.push(at);
            }
            let corners = if is_high {
                [0, 1, 2, 0, 2, 3]
            } else {
                [0, 2, 1, 0, 3, 2]
            };
            primitive.indices.extend(corners.map(|corner| first + corner));
        }
    }
}

/// Measured at many beginnings of the stream: the largest rise above the least error before, and after how many bytes it is.
fn largest_rise(mesh: &QuantisedMesh, stream: &[u8]) -> (f64, usize) {
    let source = Surface::of(mesh);
    let ruler = Ruler::new(&source, 1000);
    let (mut least, mut largest, mut triangles_before) = (f64::INFINITY, (0.0, 0), 0);
    let mut decoder = Decoder::new(u64::MAX);
    let mut from = 0;
    while from < stream.len() {
        // Small portions first: that is where the lattice becomes finer.
        let to = (from + (from / 50).max(12)).min(stream.len());
        decoder.push(&stream[from..to]).expect("a sound stream");
        from = to;
        let (twice_positions, triangles) = decoder.geometry();
        if triangles.is_empty() {
            continue;
        }
        assert!(triangles.len() >= triangles_before);
        triangles_before = triangles.len();
        let error = ruler.rms(&Surface::new(&twice_positions, triangles));
        if error > NOISE && error / least > largest.0 {
            largest = (error / least, to);
        }
        least = least.min(error);
    }
    largest
}

fn assert_errors_fall(tower: Tower, precision: Precision) {
    let mesh = QuantisedMesh::new(&tower.model(), precision);
    let stream = encode(&mesh).expect("readers take it");
    let (rise, bytes) = largest_rise(&mesh, &stream);
    assert!(
        rise <= MOST_RISE,
        "{tower:?}: {rise} times the least error before after {bytes} of {} bytes",
        stream.len()
    );
}

fn precision(position_bits: u32) -> Precision {
    Precision {
        position_bits,
        ..Precision::default()
    }
}

/// Without a look at lattices its error rises by 28 %.
#[test]
fn the_error_of_a_tower_with_windows_does_not_rise() {
    for (storeys, bits) in [(8, 15), (9, 16), (11, 16), (12, 16), (13, 14)] {
        let tower = Tower {
            width: 8.0,
            storeys,
            storey: 3.0,
            depths: [0.1, 0.05],
        };
        assert_errors_fall(tower, precision(bits));
    }
}
