use belvedere_scene::smooth::{Decoder, Header};

use super::encode;
use super::publish::{STEP_M, geometric_errors, is_worthwhile, precision};
use super::quantise::QuantisedMesh;
use crate::lod::error::HausdorffLimits;
use crate::lod::proximity::ShapeTree;
use crate::source::{Primitive, SourceModel, Topology};

/// A bowl of n × n quads, 1 m wide.
fn bowl(n: u32) -> Primitive {
    let at = |i: u32| f64::from(i) / f64::from(n) - 0.5;
    let mut primitive = Primitive::default();
    for j in 0..=n {
        for i in 0..=n {
            let (x, z) = (at(i), at(j));
            primitive.positions.push([x, x * x + 0.7 * z * z, z].map(|v| v as f32));
        }
    }
    let row = n + 1;
    for a in (0..n).flat_map(|j| j * row..j * row + n) {
        primitive
            .indices
            .extend([a, a + row, a + 1, a + 1, a + row, a + row + 1]);
    }
    primitive
}

fn model(primitives: impl Into<Vec<Primitive>>) -> SourceModel {
    SourceModel {
        primitives: primitives.into(),
        ..SourceModel::default()
    }
}

#[test]
fn no_sampled_point_is_farther_than_a_rung_says() {
    let model = model([bowl(24)]);
    let mesh = QuantisedMesh::new(&model, precision(&model, 1.0));
    let bytes = encode(&mesh);
    let (header, _) = Header::read(&bytes).unwrap().unwrap();
    let errors = geometric_errors(&model, &mesh, &bytes, HausdorffLimits::default()).unwrap();
    assert_eq!(errors.len(), header.cuts.len());
    assert!(errors.len() > 3 && errors.is_sorted_by(|a, b| a >= b), "{errors:?}");
    assert!(*errors.last().unwrap() < 1e-4, "{errors:?}");
    for (cut, error) in header.cuts.iter().zip(errors) {
        let mut decoder = Decoder::new(u64::MAX);
        decoder.push(&bytes[..cut.bytes as usize]).unwrap();
        let snapshot = decoder.snapshot();
        let drawn = ShapeTree::of(&[Primitive {
            positions: snapshot.positions,
            indices: snapshot.indices.concat(),
            ..Primitive::default()
        }]);
        let farthest = model.primitives[0].positions.iter().map(|p| {
            let p = glam::DVec3::from_array(p.map(f64::from));
            drawn.nearest_to_all(&[p], None, 0.0).distance
        });
        let farthest = farthest.fold(0.0, f64::max);
        assert!(
            farthest <= error,
            "{farthest} m after {} bytes, {error} m stated",
            cut.bytes
        );
        assert!(f64::from(cut.rms_error) <= error);
    }
}

#[test]
fn a_needle_that_rounding_swallows_is_in_the_last_error() {
    let mut primitive = bowl(24);
    let tip = primitive.positions.len() as u32;
    primitive
        .positions
        .extend([[0.0, 0.4, 0.0], [1e-6, 0.4, 0.0], [0.0, 0.9, 0.0]]);
    primitive.indices.extend([tip, tip + 1, tip + 2]);
    let model = model([primitive]);
    let mesh = QuantisedMesh::new(&model, precision(&model, 1.0));
    assert_eq!(mesh.degenerate, 1);
    let errors = geometric_errors(&model, &mesh, &encode(&mesh), HausdorffLimits::default()).unwrap();
    assert!((0.5..0.9).contains(errors.last().unwrap()), "{errors:?}");
}

#[test]
fn only_what_a_stream_holds_whole_gets_one() {
    let whole = bowl(20);
    assert!(is_worthwhile(&model([whole.clone()])));
    assert!(!is_worthwhile(&model([bowl(15)])), "few triangles");
    let lines = Primitive {
        topology: Topology::Lines,
        positions: vec![[0.0; 3]; 2],
        indices: vec![0, 1],
        ..Primitive::default()
    };
    assert!(!is_worthwhile(&model([whole.clone(), lines])));
    let mut lit = whole.clone();
    lit.normals = vec![[0.0, 1.0, 0.0]; lit.positions.len()];
    assert!(is_worthwhile(&model([lit.clone()])));
    assert!(!is_worthwhile(&model([whole, lit])), "some normals would be made up");
}

#[test]
fn large_models_and_repeated_pictures_get_more_bits() {
    let mut primitive = bowl(2);
    primitive.uvs = vec![primitive.positions.iter().map(|p| [3.0 * p[0], p[2]]).collect()];
    let model = model([primitive]);
    let of = |scale: f64| {
        let precision = precision(&model, scale);
        (precision.position_bits, precision.uv_bits)
    };
    assert_eq!(
        [1.0, 16.0, 20.0, 1000.0].map(of),
        [(14, 14), (14, 14), (15, 14), (16, 14)]
    );
    assert!(60.0 / f64::from((1 << of(60.0).0) - 1) <= STEP_M);
}
