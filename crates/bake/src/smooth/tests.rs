use belvedere_scene::smooth::attributes::{Channel, ChannelKind};
use belvedere_scene::smooth::{Decoder, Header, SmoothError};
use proptest::prelude::*;

use super::canonical;
use super::error::{Ruler, Surface};
use super::prefix::Prefix;
use super::quantise::{Precision, QuantisedMesh};
use super::script::Undo;
use crate::source::{Primitive, SourceModel};

pub(super) fn encode(mesh: &QuantisedMesh) -> Vec<u8> {
    super::encode(mesh).expect("no vertex has very many triangles")
}

/// Triangles over points of a small lattice: close together, so that many share edges, are doubled or have no area.
fn soup(points: &[[u8; 3]], corners: &[[u8; 3]], materials: usize) -> SourceModel {
    let mut model = SourceModel::default();
    for material in 0..materials {
        let mut primitive = Primitive {
            material: Some(material),
            ..Primitive::default()
        };
        let own = corners.iter().enumerate().filter(|(i, _)| i % materials == material);
        for (i, corner) in own.flat_map(|(i, corners)| corners.map(|corner| (i, corner))) {
            let point = points[usize::from(corner) % points.len()];
            primitive.indices.push(primitive.positions.len() as u32);
            primitive.positions.push(point.map(f32::from));
            // Seams here and there.
            let angle = f32::from(corner % 5) + (i % 3) as f32;
            primitive.normals.push([angle.cos(), angle.sin(), 0.0]);
            primitive.uvs.resize(1, Vec::new());
            primitive.uvs[0].push([f32::from(point[0]), (i % 4) as f32]);
            primitive.colors.push([0.25 * (i % 5) as f32, 0.5, 1.0, 1.0]);
        }
        model.primitives.push(primitive);
    }
    model
}

/// A bent sheet with a seam in the middle of its texture.
fn sheet(n: u32) -> SourceModel {
    let mut primitive = Primitive {
        uvs: vec![Vec::new()],
        ..Primitive::default()
    };
    for half in 0..2 {
        let first = primitive.positions.len() as u32;
        for j in 0..=n {
            for i in 0..=n {
                let (u, v) = ((half * n + i) as f32 / n as f32, j as f32 / n as f32);
                primitive
                    .positions
                    .push([u, 0.2 * (5.0 * u).sin() * (4.0 * v).cos(), v]);
                primitive.normals.push([0.0, 1.0, 0.0]);
                primitive.uvs[0].push([i as f32 / n as f32, v]);
            }
        }
        let row = n + 1;
        for j in 0..n {
            for a in first + j * row..first + j * row + n {
                primitive
                    .indices
                    .extend([a, a + row, a + 1, a + 1, a + row, a + row + 1]);
            }
        }
    }
    SourceModel {
        primitives: vec![primitive],
        ..SourceModel::default()
    }
}

fn decoded(bytes: &[u8]) -> Decoder {
    let mut decoder = Decoder::new(u64::MAX);
    decoder.push(bytes).unwrap();
    decoder
}

fn assert_restored(mesh: &QuantisedMesh, decoder: &Decoder) {
    assert!(decoder.is_complete());
    assert_eq!(
        canonical::of_mesh(mesh),
        canonical::of_lattice(&decoder.lattice(), mesh.stride())
    );
}

/// After each byte, the writer knows what a decoder has.
fn assert_prefixes(mesh: &QuantisedMesh) {
    let mut header = super::header_of(mesh);
    let tree = super::collapse::cluster(mesh).unwrap();
    let source = Surface::of(mesh);
    let lacking = super::lattices::choose(mesh, &tree, &Ruler::new(&source, 60));
    let mut undo = Undo::new(mesh, &tree, &lacking);
    let (stream, course) = super::tell(&mut header, &mut undo).unwrap();
    header.total_bytes = (header.to_bytes().len() + stream.len()) as u32;
    let mut decoder = decoded(&header.to_bytes());
    let mut prefix = Prefix::new(mesh, &undo);
    for (byte, count) in stream[..stream.len() - 1].iter().zip(1..) {
        decoder.push(&[*byte]).unwrap();
        prefix.go_on(course.told(count));
        let (twice_positions, triangles) = decoder.geometry();
        let shapes = Surface::new(&twice_positions, triangles).shapes;
        assert_eq!(prefix.surface().shapes, shapes, "after {count} bytes");
        assert_eq!(prefix.triangles(), shapes.len());
    }
}

fn without_attributes() -> Precision {
    Precision {
        with_attributes: false,
        ..Precision::default()
    }
}

/// All indices in range, no corner twice, everything finite, as many of each as there should be.
fn assert_valid(decoder: &Decoder) {
    let lattice = decoder.lattice();
    for &[a, b, c] in &lattice.triangles {
        assert!(a != b && b != c && c != a);
        assert!([a, b, c].iter().all(|&v| (v as usize) < lattice.twice_positions.len()));
    }
    let snapshot = decoder.snapshot();
    let vertices = snapshot.positions.len();
    assert!(snapshot.indices.iter().flatten().all(|&i| (i as usize) < vertices));
    assert_eq!(
        snapshot.indices.iter().map(Vec::len).sum::<usize>(),
        3 * lattice.triangles.len()
    );
    assert!(snapshot.positions.iter().flatten().all(|x| x.is_finite()));
    assert!(snapshot.normals.iter().flatten().all(|x| x.is_finite()));
    assert!(snapshot.normals.is_empty() || snapshot.normals.len() == vertices);
    assert!(snapshot.uvs.iter().all(|set| set.len() == vertices));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(96))]

#[test]
    fn any_soup_comes_back_bit_for_bit(
        points in prop::collection::vec(prop::array::uniform3(0u8..6), 1..40),
        corners in prop::collection::vec(prop::array::uniform3(any::<u8>()), 0..120),
        materials in 1usize..4,
        position_bits in 1u32..=16,
        with_attributes in any::<bool>(),
    ) {
        let model = soup(&points, &corners, materials);
        let mesh = QuantisedMesh::new(&model, Precision { position_bits, with_attributes, ..Precision::default() });
        let bytes = encode(&mesh);
        assert_restored(&mesh, &decoded(&bytes));
    }

    #[test]
    fn what_any_beginning_of_a_soup_gives_is_known_without_decoding(
        points in prop::collection::vec(prop::array::uniform3(0u8..9), 3..40),
        corners in prop::collection::vec(prop::array::uniform3(any::<u8>()), 1..90),
        materials in 1usize..4,
        position_bits in 1u32..=16,
        with_attributes in any::<bool>(),
    ) {
        let model = soup(&points, &corners, materials);
        let mesh = QuantisedMesh::new(&model, Precision { position_bits, with_attributes, ..Precision::default() });
        if !mesh.triangles.is_empty() {
            assert_prefixes(&mesh);
        }
    }

    #[test]
    fn bytes_may_come_in_any_portions(cuts in prop::collection::vec(1usize..200, 1..40)) {
        let mesh = QuantisedMesh::new(&sheet(7), Precision::default());
        let bytes = encode(&mesh);
        let mut decoder = Decoder::new(u64::MAX);
        let mut at = 0;
        for cut in cuts {
            let end = (at + cut).min(bytes.len());
            decoder.push(&bytes[at..end]).unwrap();
            at = end;
        }
        decoder.push(&bytes[at..]).unwrap();
        assert_restored(&mesh, &decoder);
        prop_assert_eq!(decoder.lattice(), decoded(&bytes).lattice());
    }

    #[test]
    fn flipped_bits_do_no_harm(flips in prop::collection::vec((0usize..4000, 0u8..8), 1..6), split in 0usize..4000) {
        let mesh = QuantisedMesh::new(&sheet(9), Precision::default());
        let mut bytes = encode(&mesh);
        let length = bytes.len();
        for (at, bit) in flips {
            bytes[at % length] ^= 1 << bit;
        }
        let mut decoder = Decoder::new(1 << 24);
        let (first, rest) = bytes.split_at(split % length);
        let mut result = decoder.push(first);
        assert_valid(&decoder);
        if result.is_ok() {
            result = decoder.push(rest);
        }
        assert_valid(&decoder);
        // What was refused stays refused.
        if result.is_err() {
            prop_assert_eq!(decoder.push(&[]), result);
        }
    }

    #[test]
    fn noise_does_no_harm(noise in prop::collection::vec(any::<u8>(), 0..600), vertices in 0u32..5000, triangles in 0u32..9000) {
        let mesh = QuantisedMesh::new(&sheet(3), Precision::default());
        let (mut header, _) = Header::read(&encode(&mesh)).unwrap().unwrap();
        (header.vertices, header.triangles, header.wedges) = (vertices, triangles, 3 * triangles);
        header.cuts.clear();
        header.total_bytes = (header.to_bytes().len() + noise.len()) as u32;
        let mut bytes = header.to_bytes();
        bytes.extend(noise);
        let mut decoder = Decoder::new(1 << 24);
        let _ = decoder.push(&bytes);
        assert_valid(&decoder);
    }
}

#[test]
fn every_beginning_is_a_valid_mesh_and_finer_than_a_shorter_one() {
    let mesh = QuantisedMesh::new(&sheet(12), Precision::default());
    let bytes = encode(&mesh);
    let mut last = 0;
    for length in 0..=bytes.len() {
        let decoder = decoded(&bytes[..length]);
        assert_valid(&decoder);
        assert_eq!(decoder.is_complete(), length == bytes.len());
        let triangles = decoder.lattice().triangles.len();
        assert!(
            triangles >= last,
            "{triangles} triangles after {length} bytes, {last} before"
        );
        last = triangles;
    }
    // A decoder lags behind by at most what a step takes.
    let nearly = decoded(&bytes[..bytes.len() - 1]).lattice().triangles.len();
    assert!(
        nearly + 300 > mesh.triangles.len(),
        "{nearly} of {} triangles",
        mesh.triangles.len()
    );
}

#[test]
fn errors_fall_along_the_stream_and_cuts_state_them() {
    let mesh = QuantisedMesh::new(&sheet(40), without_attributes());
    let bytes = encode(&mesh);
    let source = Surface::of(&mesh);
    let ruler = Ruler::new(&source, 1500);
    let rms = |length: usize| {
        let decoder = decoded(&bytes[..length]);
        let (twice_positions, triangles) = decoder.geometry();
        (ruler.rms(&Surface::new(&twice_positions, triangles)), triangles.len())
    };
    let mut least = f64::INFINITY;
    for length in (250..bytes.len()).step_by(97) {
        let (error, _) = rms(length);
        // What is less than a tenth of a step is noise of the samples.
        assert!(
            error <= (1.05 * least).max(0.1),
            "{error} after {length} bytes, {least} before"
        );
        least = least.min(error);
    }
    let (header, _) = Header::read(&bytes).unwrap().unwrap();
    let cuts = &header.cuts;
    assert!(cuts.len() >= 4, "{cuts:?}");
    assert!(cuts[0].bytes < 1000, "{cuts:?}");
    for pair in cuts.windows(2) {
        assert!(
            pair[1].bytes > pair[0].bytes && pair[1].rms_error <= 0.51 * pair[0].rms_error,
            "{cuts:?}"
        );
    }
    for cut in cuts {
        let (error, triangles) = rms(cut.bytes as usize);
        assert_eq!(triangles, cut.triangles as usize);
        let stated = f64::from(cut.rms_error / header.step);
        assert!(
            (error - stated).abs() <= 0.15 * error + 0.05,
            "{error} measured, {stated} stated"
        );
    }
    assert_eq!(cuts.last().map(|cut| cut.bytes as usize), Some(bytes.len()));
}

#[test]
fn what_any_beginning_gives_is_known_without_decoding() {
    assert_prefixes(&QuantisedMesh::new(&sheet(18), Precision::default()));
    assert_prefixes(&QuantisedMesh::new(&leaves(60), without_attributes()));
}

/// Leaves of two triangles each, strewn about: nothing that could be simplified, but for leaving some out.
fn leaves(count: u32) -> SourceModel {
    let mut state = 7u32;
    let mut random = || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 8) as f32 / (1 << 24) as f32
    };
    let mut primitive = Primitive::default();
    for leaf in 0..count {
        let place = [10.0; 3].map(|side| side * random());
        let [along, across] = [[0.3; 3]; 2].map(|way| way.map(|side| side * (random() - 0.5)));
        for (a, b) in [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)] {
            let corner = |axis| place[axis] + a * along[axis] + b * across[axis];
            primitive.positions.push([corner(0), corner(1), corner(2)]);
        }
        primitive
            .indices
            .extend([0, 1, 2, 0, 2, 3].map(|corner| 4 * leaf + corner));
    }
    SourceModel {
        primitives: vec![primitive],
        ..SourceModel::default()
    }
}

#[test]
fn errors_halve_from_cut_to_cut_where_loose_leaves_come_in_one_pass() {
    let mesh = QuantisedMesh::new(&leaves(300), Precision::default());
    let bytes = encode(&mesh);
    assert_restored(&mesh, &decoded(&bytes));
    let (header, _) = Header::read(&bytes).unwrap().unwrap();
    let diagonal = Surface::of(&mesh).diagonal() * f64::from(mesh.step);
    let errors = header.cuts.iter().map(|cut| f64::from(cut.rms_error) / diagonal);
    let (mut last, mut cuts) = (0.12, 0);
    for error in errors.take(header.cuts.len() - 1) {
        assert!(error <= last / 2.0 && error > last / 3.0, "{error} after {last}");
        (last, cuts) = (error, cuts + 1);
    }
    assert!(cuts >= 3 && last < 0.015, "{cuts} cuts, {last}");
}

#[test]
fn a_smooth_lod_is_much_smaller_than_its_arrays() {
    let mesh = QuantisedMesh::new(&sheet(60), without_attributes());
    let arrays = 12 * mesh.positions.len() + 6 * mesh.triangles.len();
    let bytes = encode(&mesh).len();
    assert!(100 * bytes < 13 * arrays, "{bytes} of {arrays} bytes");
}

#[test]
fn a_hub_of_many_triangles_comes_back() {
    let mut primitive = Primitive::default();
    primitive.positions.push([0.0; 3]);
    for i in 0..3000 {
        let angle = i as f32 / 3000.0 * std::f32::consts::TAU;
        primitive
            .positions
            .push([angle.cos(), angle.sin(), 0.2 * (7.0 * angle).sin()]);
        primitive.indices.extend([0, i + 1, (i + 1) % 3000 + 1]);
    }
    let model = SourceModel {
        primitives: vec![primitive],
        ..SourceModel::default()
    };
    let mesh = QuantisedMesh::new(&model, Precision::default());
    let bytes = encode(&mesh);
    assert_restored(&mesh, &decoded(&bytes));
    assert!(bytes.len() < 4 * mesh.positions.len(), "{} bytes", bytes.len());
}

#[test]
fn bytes_are_those_of_version_2() {
    let mut state = 7u32;
    let mut random = || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 24) as u8
    };
    let points: Vec<[u8; 3]> = (0..60).map(|_| [random() % 16, random() % 16, random() % 4]).collect();
    let corners: Vec<[u8; 3]> = (0..150).map(|_| [random(), random(), random()]).collect();
    let bytes = encode(&QuantisedMesh::new(&soup(&points, &corners, 3), without_attributes()));
    // FNV-1a. When the format changes, raise its version; when only the writer chooses better, note what it gives now.
    let hash = |hash: u64, &byte: &u8| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
    let found = bytes.iter().fold(0xcbf2_9ce4_8422_2325, hash);
    assert_eq!((bytes.len(), found), (762, 2_231_483_215_729_786_707));
}

#[test]
fn the_same_mesh_gives_the_same_bytes() {
    let model = sheet(10);
    let encoded = || encode(&QuantisedMesh::new(&model, Precision::default()));
    assert_eq!(encoded(), encoded());
}

#[test]
fn a_mesh_without_triangles_is_whole_at_once() {
    let mesh = QuantisedMesh::new(&SourceModel::default(), Precision::default());
    let decoder = decoded(&encode(&mesh));
    assert!(decoder.is_complete());
    assert_eq!(decoder.snapshot().positions.len(), 0);
}

#[test]
fn numbers_that_no_header_takes_give_no_stream() {
    let changes: [fn(&mut Primitive); 4] = [
        |primitive| primitive.uvs[0][5] = [1e30, 1e30],
        |primitive| (primitive.uvs[0][5], primitive.uvs[0][9]) = ([3e38, -3e38], [-3e38, 3e38]),
        |primitive| {
            primitive.colors = vec![[1.0; 4]; primitive.positions.len()];
            primitive.colors[0][0] = 1e30;
        },
        |primitive| primitive.positions.iter_mut().for_each(|p| *p = p.map(|x| 1e27 * x)),
    ];
    for (i, change) in changes.into_iter().enumerate() {
        let mut model = sheet(8);
        change(&mut model.primitives[0]);
        let of = |precision| super::encode(&QuantisedMesh::new(&model, precision));
        assert_eq!(of(Precision::default()), None, "change {i}");
        assert_eq!(of(without_attributes()).is_some(), i < 3, "change {i}");
    }
}

#[test]
fn what_claims_too_much_is_refused_before_memory_is_taken() {
    let bytes = encode(&QuantisedMesh::new(&sheet(3), Precision::default()));
    let (mut header, length) = Header::read(&bytes).unwrap().unwrap();
    header.triangles = 100_000_000;
    header.cuts.last_mut().unwrap().triangles = header.triangles;
    let mut claims = header.to_bytes();
    assert_eq!(claims.len(), length);
    claims.extend(&bytes[length..]);
    let mut decoder = Decoder::new(1 << 30);
    assert!(matches!(decoder.push(&claims), Err(SmoothError::Memory { .. })));
    assert_eq!(Decoder::new(1 << 30).push(b"glTF"), Err(SmoothError::NotSmooth));
    assert_eq!(Decoder::new(1 << 30).push(b"SLOD\x01"), Err(SmoothError::Version(1)));
}

#[test]
fn a_header_that_says_what_the_stream_does_not_is_refused() {
    let bytes = encode(&QuantisedMesh::new(&sheet(3), Precision::default()));
    let bare = encode(&QuantisedMesh::new(&sheet(3), without_attributes()));
    let told = |bytes: &[u8], change: fn(&mut Header)| {
        let (mut header, length) = Header::read(bytes).unwrap().unwrap();
        change(&mut header);
        let changed = [&header.to_bytes(), &bytes[length..]].concat();
        Decoder::new(u64::MAX).push(&changed)
    };
    assert_eq!(told(&bytes, |_| ()), Ok(()));
    let changes: [fn(&mut Header); 7] = [
        |header| header.wedges += 1,
        |header| header.wedges -= 1,
        |header| header.vertices += 1,
        |header| header.step = -header.step,
        |header| header.cuts.last_mut().unwrap().triangles -= 1,
        |header| header.cuts.last_mut().unwrap().rms_error = -1.0,
        |header| header.cuts[0].rms_error = f32::NAN,
    ];
    for (i, change) in changes.into_iter().enumerate() {
        let refused = told(&bytes, change);
        assert!(
            matches!(refused, Err(SmoothError::Damaged(_))),
            "change {i}: {refused:?}"
        );
    }
    // Readers would differ in which of two they draw.
    for kind in [ChannelKind::Normal, ChannelKind::Colour] {
        let (mut header, _) = Header::read(&bytes).unwrap().unwrap();
        let [low, step] = [[0.0; 2]; 2];
        header.channels = vec![Channel { kind, low, step }; 2];
        let refused = Header::read(&header.to_bytes());
        let fault = "it has more than one normal or colour of a corner";
        assert_eq!(refused, Err(SmoothError::Damaged(fault)));
    }
    let refused = told(&bare, |header| header.wedges = 1);
    assert_eq!(refused, Err(SmoothError::Damaged("it has wedges without attributes")));
}

#[test]
fn what_goes_on_after_its_end_is_refused() {
    let mut bytes = encode(&QuantisedMesh::new(&sheet(3), Precision::default()));
    bytes.push(0);
    assert!(matches!(
        Decoder::new(u64::MAX).push(&bytes),
        Err(SmoothError::Damaged(_))
    ));
}

/// Triangles around one vertex, as a cone; textured, with a seam.
fn cone(n: u16) -> SourceModel {
    let mut cone = Primitive::default();
    let (mut around, mut uvs) = (vec![[0.0, 1.0, 0.0]; 2], vec![[0.0, 0.0], [1.0, 0.0]]);
    for i in 0..=n {
        let share = f32::from(i) / f32::from(n);
        let angle = std::f32::consts::TAU * share;
        around.push([angle.cos() * (1.0 + 0.1 * f32::from(i % 13)), 0.0, angle.sin()]);
        uvs.push([share, 1.0]);
    }
    let last = around.len() - 1;
    around[last] = around[2];
    for i in 0..u32::from(n) {
        cone.indices.extend([u32::from(2 * i > u32::from(n)), i + 3, i + 2]);
    }
    cone.positions = around;
    cone.uvs = vec![uvs];
    SourceModel {
        primitives: vec![cone],
        ..SourceModel::default()
    }
}

/// Pages that all hang on one edge.
fn book(n: u16) -> SourceModel {
    let mut book = Primitive {
        positions: vec![[0.0; 3], [0.0, 1.0, 0.0]],
        ..Primitive::default()
    };
    for i in 0..n {
        let angle = std::f32::consts::TAU * f32::from(i) / f32::from(n);
        book.positions.push([angle.cos(), 0.5, angle.sin()]);
        book.indices.extend([0, 1, 2 + u32::from(i)]);
    }
    SourceModel {
        primitives: vec![book],
        ..SourceModel::default()
    }
}

#[test]
fn nothing_is_written_that_readers_refuse() {
    let mut written = Vec::new();
    for (name, model) in [
        ("cone of 600", cone(600)),
        ("cone of 3,000", cone(3000)),
        ("cone of 30,000", cone(30_000)),
        ("book of 100", book(100)),
        ("book of 3,000", book(3000)),
    ] {
        let mesh = QuantisedMesh::new(&model, Precision::default());
        if let Some(bytes) = super::encode(&mesh) {
            assert_restored(&mesh, &decoded(&bytes));
            written.push(name);
        }
    }
    assert_eq!(written, ["cone of 600", "book of 100"]);
}
