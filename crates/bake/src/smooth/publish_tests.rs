use belvedere_scene::smooth::{Decoder, Header};

use super::drawn;
use super::publish::{STEP_M, geometric_errors, is_whole, is_worthwhile, precision, tells_attributes};
use super::quantise::QuantisedMesh;
use super::tests::encode;
use crate::lod::LodSettings;
use crate::lod::error::HausdorffLimits;
use crate::lod::looks::Looks;
use crate::lod::proximity::ShapeTree;
use crate::source::{Material, Primitive, SourceModel, Topology};

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
    let mesh = QuantisedMesh::new(&model, precision(&model, &[], 1.0));
    let bytes = encode(&mesh);
    let (header, _) = Header::read(&bytes).unwrap().unwrap();
    let errors = geometric_errors(&model, &mesh, &bytes, &LodSettings::default()).unwrap();
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
    let mesh = QuantisedMesh::new(&model, precision(&model, &[], 1.0));
    assert_eq!(mesh.degenerate, 1);
    let errors = geometric_errors(&model, &mesh, &encode(&mesh), &LodSettings::default()).unwrap();
    assert!((0.5..0.9).contains(errors.last().unwrap()), "{errors:?}");
    let is_whole = |model: &SourceModel, errors: &[f64]| {
        let mesh = QuantisedMesh::new(model, precision(model, &[], 1.0));
        is_whole(model, &mesh, *errors.last().unwrap(), HausdorffLimits::default())
    };
    assert!(!is_whole(&model, &errors));
    // One that lies in a surface leaves nothing missing.
    let mut within = bowl(24);
    let tip = within.positions.len() as u32;
    within.positions.push(within.positions[0].map(|x| x + 1e-6));
    within.indices.extend([0, tip, 1]);
    let within = self::model([within]);
    let mesh = QuantisedMesh::new(&within, precision(&within, &[], 1.0));
    assert_eq!(mesh.degenerate, 1);
    let errors = geometric_errors(&within, &mesh, &encode(&mesh), &LodSettings::default()).unwrap();
    assert!(is_whole(&within, &errors), "{errors:?}");
}

#[test]
fn lines_and_points_that_no_stream_tells_are_in_no_error() {
    let beside = |topology, far: f32| Primitive {
        topology,
        positions: vec![[far, 9.0, 0.0], [far, 90.0, 0.0]],
        indices: vec![0, 1],
        ..Primitive::default()
    };
    let errors = |model: &SourceModel| {
        let mesh = QuantisedMesh::new(model, precision(model, &[], 1.0));
        geometric_errors(model, &mesh, &encode(&mesh), &LodSettings::default()).unwrap()
    };
    let alone = model([bowl(24)]);
    let [lines, points] = [Topology::Lines, Topology::Points].map(|topology| beside(topology, 1e5));
    assert_eq!(errors(&model([bowl(24), lines, points])), errors(&alone));
}

/// Six by six fields of a metre, each of 4 × 4 quads, of two materials in turn.
fn chess_floor() -> SourceModel {
    const FIELDS: u32 = 6;
    const QUADS: u32 = 4 * FIELDS;
    let at = |i: u32| i as f32 / 4.0;
    let of_material = |material: u32| {
        let mut primitive = Primitive {
            material: Some(material as usize),
            positions: (0..=QUADS)
                .flat_map(|z| (0..=QUADS).map(move |x| [at(x), 0.0, at(z)]))
                .collect(),
            ..Primitive::default()
        };
        for (z, x) in (0..QUADS).flat_map(|z| (0..QUADS).map(move |x| (z, x))) {
            if (z / 4 + x / 4) % 2 == material {
                let a = z * (QUADS + 1) + x;
                let b = a + QUADS + 1;
                primitive.indices.extend([a, b, a + 1, a + 1, b, b + 1]);
            }
        }
        primitive
    };
    model([of_material(0), of_material(1)])
}

#[test]
fn rungs_of_a_flat_floor_keep_its_fields_or_say_that_they_do_not() {
    let model = chess_floor();
    let mesh = QuantisedMesh::new(&model, precision(&model, &[], 1.0));
    let bytes = encode(&mesh);
    let (header, _) = Header::read(&bytes).unwrap().unwrap();
    let errors = geometric_errors(&model, &mesh, &bytes, &LodSettings::default()).unwrap();
    let stated: Vec<(u32, f64)> = header.cuts.iter().map(|cut| cut.triangles).zip(errors).collect();
    let (whole, coarser) = stated.split_last().unwrap();
    assert!(whole.1 < 1e-3, "{stated:?}");
    for (triangles, error) in coarser {
        assert!(
            *triangles >= 72 || *error > 0.2,
            "two triangles a field are the least: {stated:?}"
        );
    }
    // What has all fields comes long before the whole.
    let mut decoder = Decoder::new(u64::MAX);
    let half = bytes.len() / 2;
    decoder.push(&bytes[..half]).unwrap();
    let drawn = drawn::primitives(decoder.snapshot(), &[Some(0), Some(1)]);
    let pictured = Default::default();
    let off = Looks::of(&model.primitives, &pictured)
        .unwrap()
        .error_of(&drawn, &ShapeTree::of(&drawn));
    assert!(off < 0.05, "{off} m off after {half} bytes of {}", bytes.len());
}

#[test]
fn only_what_a_stream_holds_whole_gets_one() {
    let whole = bowl(20);
    assert!(is_worthwhile(&model([whole.clone()]), &[]));
    assert!(!is_worthwhile(&model([bowl(15)]), &[]), "few triangles");
    let lines = Primitive {
        topology: Topology::Lines,
        positions: vec![[0.0; 3]; 2],
        indices: vec![0, 1],
        ..Primitive::default()
    };
    assert!(!is_worthwhile(&model([whole.clone(), lines]), &[]));
    let mut lit = whole.clone();
    lit.normals = vec![[0.0, 1.0, 0.0]; lit.positions.len()];
    assert!(is_worthwhile(&model([lit.clone()]), &[]));
    assert!(
        !is_worthwhile(&model([whole, lit]), &[]),
        "some normals would be made up"
    );
}

#[test]
fn large_models_and_repeated_pictures_get_more_bits() {
    let mut primitive = bowl(2);
    primitive.uvs = vec![primitive.positions.iter().map(|p| [3.0 * p[0], p[2]]).collect()];
    let model = model([primitive]);
    let of = |scale: f64| {
        let precision = precision(&model, &[], scale);
        (precision.position_bits, precision.uv_bits)
    };
    assert_eq!(
        [1.0, 16.0, 20.0, 1000.0].map(of),
        [(14, 14), (14, 14), (15, 14), (16, 14)]
    );
    assert!(60.0 / f64::from((1 << of(60.0).0) - 1) <= STEP_M);
}

#[test]
fn pictures_that_are_repeated_often_get_more_bits_until_there_are_none() {
    let mut primitive = bowl(20);
    primitive.uvs = vec![primitive.positions.iter().map(|p| [p[0], p[2]]).collect()];
    primitive.material = Some(0);
    let model = model([primitive]);
    let shown = |scale: f64| {
        let transform = serde_json::json!({"KHR_texture_transform": {"scale": [1, scale]}});
        let texture = serde_json::json!({"index": 0, "extensions": transform});
        [Material {
            gltf: serde_json::json!({"pbrMetallicRoughness": {"baseColorTexture": texture}}),
            see_through: false,
            double_sided: false,
        }]
    };
    for (scale, bits) in [(0.1, 12), (1.0, 12), (3.0, 14), (200.0, 20), (256.0, 20)] {
        let precision = precision(&model, &shown(scale), 1.0);
        assert_eq!(precision.uv_bits, bits, "{scale}");
        assert!(is_worthwhile(&model, &shown(scale)));
        let channel = QuantisedMesh::new(&model, precision).channels[0];
        assert!(f64::from(channel.step[1]) * scale < 1.0 / 4000.0, "{channel:?}");
    }
    assert!(!is_worthwhile(&model, &shown(300.0)) && !tells_attributes(&model, &shown(1e300)));
    let mut stray = model.clone();
    stray.primitives[0].uvs[0][5] = [1e6, 1e6];
    assert!(!is_worthwhile(&stray, &shown(1.0)));
}

#[test]
fn dark_colours_do_not_band_and_bytes_stay_bytes() {
    let srgb = |x: f32| {
        255.0
            * if x <= 0.003_130_8 {
                12.92 * x
            } else {
                1.055 * x.powf(1.0 / 2.4) - 0.055
            }
    };
    let coloured = |colour: &dyn Fn(f32) -> f32, first: f32| {
        let mut primitive = bowl(20);
        let shade = |p: &[f32; 3]| [colour(p[0] + 0.5), colour(p[2] + 0.5), 0.0, 1.0];
        primitive.colors = primitive.positions.iter().map(shade).collect();
        primitive.colors[0][0] = first;
        model([primitive])
    };
    for first in [1.0, 50.0] {
        let model = coloured(&|share| 0.01 * share, first);
        let mesh = QuantisedMesh::new(&model, precision(&model, &[], 1.0));
        let mut decoder = Decoder::new(u64::MAX);
        decoder.push(&encode(&mesh)).unwrap();
        let drawn = decoder.snapshot();
        let nearest = |given: &[f32; 4]| {
            let off = |told: &[f32; 4]| {
                (0..2)
                    .map(|i| (srgb(told[i]) - srgb(given[i])).abs())
                    .fold(0.0, f32::max)
            };
            drawn.colours.iter().map(off).fold(f32::INFINITY, f32::min)
        };
        let off = model.primitives[0].colors[1..].iter().map(nearest).fold(0.0, f32::max);
        assert!(off <= 0.5, "{off} of 255 with {first}");
    }
    let bytes = coloured(&|share| (255.0 * share).floor() / 255.0, 1.0);
    let mesh = QuantisedMesh::new(&bytes, precision(&bytes, &[], 1.0));
    assert_eq!(mesh.channels[0].step, [1.0 / 255.0; 2]);
    assert!(!is_worthwhile(&coloured(&|share| share, 300.0), &[]));
}
