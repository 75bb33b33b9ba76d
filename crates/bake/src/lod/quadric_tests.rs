use std::collections::{BTreeMap, BTreeSet};
use std::f32::consts::TAU;

use glam::Vec3;

use super::octree::{position_bits, to_f64};
use super::tests::{by, model, terrain};
use super::*;

const TARGETS: [f64; 4] = [0.5, 0.25, 0.1, 0.03];

fn levels(model: &SourceModel) -> Vec<Vec<Primitive>> {
    let settings = by(Method::Quadric);
    let mut generator = Generator::new(model, &settings);
    let all = shape_count(&model.primitives) as f64;
    TARGETS
        .into_iter()
        .filter_map(|share| generator.quadric_mesh((share * all) as usize))
        .collect()
}

pub(super) fn places(primitives: &[Primitive]) -> BTreeSet<[u32; 3]> {
    let positions = primitives.iter().flat_map(|p| &p.positions);
    positions.map(|p| position_bits(*p)).collect()
}

/// A closed torus with bumps. Each quad asks `patch_of` where it belongs: what is of one patch shares its vertices, and
/// `dress` tells what these carry.
fn patched_torus(
    side: u32,
    patch_of: impl Fn(u32, u32) -> usize,
    dress: impl Fn(&mut Primitive, usize, [f32; 2]),
) -> Primitive {
    let mut torus = Primitive::default();
    let mut numbers = BTreeMap::new();
    for (y, x) in (0..side).flat_map(|y| (0..side).map(move |x| (y, x))) {
        let patch = patch_of(x, y);
        let mut corner = |x: u32, y: u32| {
            let place = [x % side, y % side];
            *numbers.entry((patch, place)).or_insert_with(|| {
                let [u, v] = place.map(|i| i as f32 / side as f32);
                let (big, small) = (TAU * u, TAU * v);
                let radius = 0.3 + 0.03 * (5.0 * big).sin() * (3.0 * small).cos();
                let out = [small.cos() * big.cos(), small.sin(), small.cos() * big.sin()];
                let middle = [big.cos(), 0.0, big.sin()];
                torus.positions.push([0, 1, 2].map(|i| middle[i] + radius * out[i]));
                torus.normals.push(out);
                dress(&mut torus, patch, [u, v]);
                torus.positions.len() as u32 - 1
            })
        };
        let [a, b, c, d] = [corner(x, y), corner(x + 1, y), corner(x, y + 1), corner(x + 1, y + 1)];
        torus.indices.extend([a, c, b, b, c, d]);
    }
    torus
}

/// Edges that not as many triangles run along as against, by the places of their ends.
fn open_edges(primitives: &[Primitive]) -> usize {
    let mut edges: BTreeMap<_, i32> = BTreeMap::new();
    for triangle in primitives.iter().flat_map(Primitive::triangles) {
        let [a, b, c] = triangle.map(position_bits);
        for (from, to) in [(a, b), (b, c), (c, a)] {
            *edges.entry((from.min(to), from.max(to))).or_default() += if from < to { 1 } else { -1 };
        }
    }
    edges.values().filter(|balance| **balance != 0).count()
}

fn area(primitives: &[Primitive], material: Option<usize>) -> f64 {
    let own = primitives.iter().filter(|p| p.material == material);
    let twice = |[a, b, c]: [[f32; 3]; 3]| (to_f64(b) - to_f64(a)).cross(to_f64(c) - to_f64(a)).length();
    own.flat_map(Primitive::triangles).map(twice).sum()
}

#[test]
fn what_is_in_one_place_never_comes_apart() {
    let side = 48;
    // Charts of texture coordinates in squares of twelve quads, hard edges along rings of sixteen, and three materials.
    let chart = |x: u32, y: u32| (x / 12 + 4 * (y / 12)) as usize;
    let ring = |x: u32, _: u32| (x / 16) as usize;
    let uncharted = |_: u32, _: u32| 0;
    let with_charts = |mesh: &mut Primitive, chart: usize, uv: [f32; 2]| {
        mesh.uvs.resize(1, Vec::new());
        mesh.uvs[0].push([uv[0] + chart as f32, uv[1] - chart as f32]);
    };
    let with_edges = |mesh: &mut Primitive, ring: usize, _: [f32; 2]| {
        let normal = mesh.normals.last_mut().unwrap();
        *normal = (Vec3::from_array(*normal) + 0.3 * ring as f32).normalize().to_array();
    };
    let smooth = patched_torus(side, uncharted, |_, _, _| ());
    let charted = patched_torus(side, chart, with_charts);
    let creased = patched_torus(side, ring, with_edges);
    let parts = |whole: &Primitive| -> Vec<Primitive> {
        let third = whole.indices.len() / 3;
        let part = |i: usize| Primitive {
            material: Some(i),
            ..whole.subset(whole.indices[i * third..(i + 1) * third].to_vec())
        };
        (0..3).map(part).collect()
    };
    let models = [
        ("smooth", vec![smooth.clone()]),
        ("smooth in parts", parts(&smooth)),
        ("charted", vec![charted.clone()]),
        ("charted in parts", parts(&charted)),
        ("creased", vec![creased.clone()]),
        ("creased in parts", parts(&creased)),
    ];
    for (name, primitives) in models {
        assert_eq!(open_edges(&primitives), 0, "{name}: the source is closed");
        let levels = levels(&model(primitives.clone()));
        assert!(levels.len() >= 3, "{name}: targets are missed");
        let known = places(&primitives);
        for level in levels {
            assert!(!places(&level).is_subset(&known), "{name}: nothing moved");
            assert_eq!(open_edges(&level), 0, "{name}: a crack");
            for material in primitives.iter().map(|p| p.material) {
                let share = area(&level, material) / area(&primitives, material);
                assert!(
                    (0.8..1.2).contains(&share),
                    "{name}: a material has {share} of its area"
                );
            }
        }
    }
}

#[test]
fn what_a_vertex_carries_comes_along_and_stays_valid() {
    // Far from the origin, where a step is 8 mm.
    let place = |p: &[f32; 3]| [p[0] + 1e5, p[1], p[2] - 7e4];
    let flat = terrain(48);
    let mut mesh = Primitive {
        positions: flat.positions.iter().map(place).collect(),
        ..flat
    };
    // As functions of the place: a light map, colours, and tangents that lean.
    let height = |p: &[f32; 3]| (p[1] + 5.0) / 10.0;
    mesh.uvs
        .push(mesh.uvs[0].iter().map(|uv| [0.5 * uv[0], 1.0 - uv[1]]).collect());
    mesh.colors = mesh.positions.iter().map(|p| [height(p), 1.0, 0.5, 1.0]).collect();
    mesh.tangents = vec![[1.0, 0.0, 0.0, -1.0]; mesh.positions.len()];
    let known = places(std::slice::from_ref(&mesh));
    let [low, high] = [f32::min, f32::max].map(|pick| {
        mesh.positions
            .iter()
            .copied()
            .reduce(|a, b| [0, 1, 2].map(|i| pick(a[i], b[i])))
            .unwrap()
    });
    let levels = levels(&model([mesh.clone()]));
    assert_eq!(levels.len(), TARGETS.len());
    for level in &levels {
        let [level] = level.as_slice() else {
            panic!("one material")
        };
        let mut moved = 0;
        for v in 0..level.positions.len() {
            let p = level.positions[v];
            assert!((0..3).all(|i| (low[i]..=high[i]).contains(&p[i])), "out of the box");
            let on_border = [0, 2].into_iter().any(|i| p[i] == low[i] || p[i] == high[i]);
            let is_known = known.contains(&position_bits(p));
            assert!(is_known || !on_border, "a border moved");
            moved += usize::from(!is_known);
            let (normal, tangent) = (Vec3::from_array(level.normals[v]), Vec3::from_slice(&level.tangents[v]));
            assert!(normal.is_normalized() && tangent.is_normalized());
            assert!(normal.dot(tangent).abs() < 1e-5 && level.tangents[v][3] == -1.0);
            let [along, across] = [(p[0] - 1e5) / 100.0, (p[2] + 7e4) / 100.0];
            for (set, expected) in [(0, [along, across]), (1, [0.5 * along, 1.0 - across])] {
                let uv = level.uvs[set][v];
                assert!(uv.iter().all(|x| (0.0..=1.0).contains(x)));
                assert!(
                    (0..2).all(|i| (uv[i] - expected[i]).abs() < 2e-3),
                    "{uv:?} for {expected:?}"
                );
            }
            let color = level.colors[v];
            assert!(
                (color[0] - height(&p)).abs() < 0.02 && color[1..] == [1.0, 0.5, 1.0],
                "{color:?}"
            );
        }
        assert!(moved > 0, "nothing moved");
    }
}

#[test]
fn what_moves_is_nearer_to_the_source() {
    // Half of the vertices of a paraboloid lie above their neighbours' planes and none below, so that none that stays is best.
    let bowl = terrain(48);
    let height = |p: &[f32; 3]| (to_f64(*p) - to_f64([50.0, p[1], 50.0])).length_squared() as f32 / 100.0;
    let bowl = Primitive {
        positions: bowl.positions.iter().map(|p| [p[0], height(p), p[2]]).collect(),
        ..bowl
    };
    let model = model([bowl]);
    let level = &levels(&model)[2];
    let known: Vec<[f32; 3]> = model.primitives[0].positions.clone();
    let back = Primitive {
        positions: level[0]
            .positions
            .iter()
            .map(|p| {
                let distance = |q: &&[f32; 3]| (to_f64(**q) - to_f64(*p)).length_squared();
                *known.iter().min_by(|a, b| distance(a).total_cmp(&distance(b))).unwrap()
            })
            .collect(),
        ..level[0].clone()
    };
    let rms = |level: &[Primitive]| error::rms(&model.primitives, level, 4000);
    assert!(
        rms(level) < 0.9 * rms(&[back]),
        "{} of {}",
        rms(level),
        rms(&[level[0].clone()])
    );
}

/// A flat disc of triangles that all have its middle as a corner.
fn disc(triangles: u32) -> Primitive {
    let mut disc = Primitive {
        positions: vec![[0.25, 0.0, 0.125]],
        ..Primitive::default()
    };
    for i in 0..triangles {
        let angle = TAU * i as f32 / triangles as f32;
        disc.positions.push([angle.cos(), 0.0, angle.sin()]);
        disc.indices.extend([0, 1 + (i + 1) % triangles, 1 + i]);
    }
    disc
}

#[test]
fn what_very_many_triangles_have_as_a_corner_does_not_move() {
    for (triangles, stays) in [(900, false), (1100, true)] {
        let disc = disc(triangles);
        let hub = position_bits(disc.positions[0]);
        let levels = levels(&model(vec![disc]));
        assert!(!levels.is_empty());
        let kept = levels.iter().filter(|level| places(level).contains(&hub)).count();
        assert_eq!(
            kept == levels.len(),
            stays,
            "{triangles}: {kept} of {} levels",
            levels.len()
        );
    }
}
