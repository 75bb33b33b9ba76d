use std::f32::consts::{PI, TAU};

use glam::DVec3;
use proptest::prelude::*;

use super::error::hausdorff_bound_of;
use super::octree::{Locked, Octree};
use super::proximity::{ShapeTree, point_distance_squared};
use super::reduction::Reduction;
use super::*;

/// A row of pseudo-random numbers in 0..1.
struct Dice(u64);

impl Dice {
    fn roll(&mut self) -> f32 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 40) as f32 / (1u64 << 24) as f32
    }
}

/// A sheet of `across × along` quads, each vertex placed by a function of its place in 0..1 × 0..1.
fn sheet(across: u32, along: u32, vertex: impl Fn(f32, f32) -> ([f32; 3], [f32; 3])) -> Primitive {
    let mut primitive = Primitive {
        uvs: vec![Vec::new()],
        ..Primitive::default()
    };
    for y in 0..=along {
        for x in 0..=across {
            let (u, v) = (x as f32 / across as f32, y as f32 / along as f32);
            let (position, normal) = vertex(u, v);
            primitive.positions.push(position);
            primitive.normals.push(normal);
            primitive.uvs[0].push([u, v]);
        }
    }
    for y in 0..along {
        for x in 0..across {
            let a = y * (across + 1) + x;
            let b = a + across + 1;
            primitive.indices.extend([a, b, a + 1, a + 1, b, b + 1]);
        }
    }
    primitive
}

pub(super) fn sphere(across: u32, along: u32) -> Primitive {
    sheet(across, along, |u, v| {
        let (around, down) = (TAU * u, PI * v);
        let n = [down.sin() * around.cos(), down.cos(), down.sin() * around.sin()];
        (n, n)
    })
}

fn torus(across: u32, along: u32) -> Primitive {
    sheet(across, along, |u, v| {
        let (big, small) = (TAU * u, TAU * v);
        let n = [small.cos() * big.cos(), small.sin(), small.cos() * big.sin()];
        ([n[0] * 0.3 + big.cos(), n[1] * 0.3, n[2] * 0.3 + big.sin()], n)
    })
}

pub(super) fn terrain(across: u32) -> Primitive {
    sheet(across, across, |u, v| {
        let height = (9.0 * u).sin() * (7.0 * v).cos() + 0.1 * (61.0 * u).sin() * (57.0 * v).sin();
        ([100.0 * u, 4.0 * height, 100.0 * v], [0.0, 1.0, 0.0])
    })
}

fn boxes(side: u32) -> Primitive {
    let mut primitive = Primitive::default();
    for i in 0..side * side {
        let (x, z) = ((i % side) as f32 * 3.0, (i / side) as f32 * 3.0);
        for face in 0..6usize {
            let (axis, sign) = (face / 2, if face % 2 == 0 { 1.0 } else { -1.0 });
            let first = primitive.positions.len() as u32;
            for corner in 0..4 {
                let mut p = [0.0; 3];
                p[axis] = sign;
                p[(axis + 1) % 3] = if corner & 1 == 0 { -1.0 } else { 1.0 };
                p[(axis + 2) % 3] = if corner & 2 == 0 { -sign } else { sign };
                let mut n = [0.0; 3];
                n[axis] = sign;
                primitive.positions.push([p[0] + x, p[1], p[2] + z]);
                primitive.normals.push(n);
            }
            primitive.indices.extend([0, 1, 2, 2, 1, 3].map(|i| first + i));
        }
    }
    primitive
}

/// Small triangles anywhere in a unit cube, none joined to another.
pub(super) fn soup(triangles: usize) -> Primitive {
    let mut dice = Dice(7);
    let mut primitive = Primitive::default();
    for i in 0..3 * triangles as u32 {
        if i % 3 == 0 {
            primitive.positions.push(std::array::from_fn(|_| dice.roll()));
        } else {
            let first = primitive.positions[i as usize / 3 * 3];
            primitive.positions.push(first.map(|x| x + 0.05 * (dice.roll() - 0.5)));
        }
        primitive.indices.push(i);
    }
    primitive
}

pub(super) fn model(primitives: impl IntoIterator<Item = Primitive>) -> SourceModel {
    SourceModel {
        name: String::from("test"),
        primitives: primitives.into_iter().collect(),
        ..SourceModel::default()
    }
}

/// Points all over some primitives.
fn samples(primitives: &[Primitive], each: usize) -> Vec<DVec3> {
    let mut dice = Dice(3);
    let mut points = Vec::new();
    for [a, b, c] in &ShapeTree::of(primitives).shapes {
        points.extend([*a, *b, *c]);
        for _ in 0..each {
            let (mut u, mut v) = (f64::from(dice.roll()), f64::from(dice.roll()));
            if u + v > 1.0 {
                (u, v) = (1.0 - u, 1.0 - v);
            }
            points.push(a + (b - a) * u + (c - a) * v);
        }
    }
    points
}

/// The largest distance of a sample of one side from the other side, by looking at every shape.
fn measured_error(a: &[Primitive], b: &[Primitive], each: usize) -> f64 {
    let one_sided = |from: &[Primitive], to: &[Primitive], each: usize| {
        let shapes = ShapeTree::of(to).shapes;
        let boxes: Vec<_> = shapes
            .iter()
            .map(|[a, b, c]| [a.min(*b).min(*c), a.max(*b).max(*c)])
            .collect();
        let distance = |p: DVec3| {
            let mut nearest = f64::INFINITY;
            for (shape, [low, high]) in shapes.iter().zip(&boxes) {
                // No shape is nearer than its box, but for rounding.
                let to_box = (low - p).max(p - high).max(DVec3::ZERO).length_squared();
                if to_box <= 1.001 * nearest {
                    nearest = nearest.min(point_distance_squared(p, shape));
                }
            }
            nearest
        };
        samples(from, each).into_iter().map(distance).fold(0.0, f64::max).sqrt()
    };
    one_sided(a, b, 1).max(one_sided(b, a, each))
}

pub(super) fn check_chain(name: &str, model: &SourceModel, chain: &LodChain) {
    assert_eq!(
        chain.levels[0].primitives, model.primitives,
        "{name}: level 0 is the source"
    );
    assert_eq!(chain.levels[0].geometric_error, 0.0);
    for pair in chain.levels.windows(2) {
        let share = geometry_bytes(&pair[1].primitives) as f64 / geometry_bytes(&pair[0].primitives) as f64;
        assert!(
            share <= 0.6,
            "{name}: a level with {share} of the bytes is not worth having"
        );
        assert!(
            pair[1].geometric_error >= pair[0].geometric_error,
            "{name}: error falls"
        );
    }
    let positions = || model.primitives.iter().flat_map(|p| &p.positions);
    let low = [0, 1, 2].map(|axis| positions().map(|p| p[axis]).fold(f32::MAX, f32::min));
    let high = [0, 1, 2].map(|axis| positions().map(|p| p[axis]).fold(f32::MIN, f32::max));
    for level in &chain.levels[1..] {
        assert!(shape_count(&level.primitives) > 0, "{name}: vanished");
        assert!(
            model.triangle_count() == 0 || level.triangles > 0,
            "{name}: all triangles vanished"
        );
        let mut seen = BTreeSet::new();
        for primitive in &level.primitives {
            check_primitive(name, primitive);
            for position in &primitive.positions {
                assert!(
                    (0..3).all(|axis| (low[axis]..=high[axis]).contains(&position[axis])),
                    "{name}: out of the source's box"
                );
            }
            for shape in primitive.indices.chunks_exact(primitive.topology.arity()) {
                let mut corners: Vec<[u32; 3]> = shape
                    .iter()
                    .map(|&i| primitive.positions[i as usize].map(f32::to_bits))
                    .collect();
                if primitive.topology == Topology::Triangles {
                    let first = (0..3).min_by_key(|&i| corners[i]).unwrap();
                    corners.rotate_left(first);
                } else {
                    corners.sort_unstable();
                }
                assert!(seen.insert((primitive.material, corners)), "{name}: a doublet");
            }
        }
    }
}

fn check_primitive(name: &str, primitive: &Primitive) {
    let count = primitive.positions.len();
    assert!(
        primitive.indices.iter().all(|&i| (i as usize) < count),
        "{name}: index out of range"
    );
    assert!([0, count].contains(&primitive.normals.len()) && [0, count].contains(&primitive.colors.len()));
    assert!(primitive.uvs.iter().all(|set| [0, count].contains(&set.len())));
    for [a, b, c] in primitive.triangles() {
        let [a, b, c] = [a, b, c].map(|p| DVec3::from_array(p.map(f64::from)));
        assert!((b - a).cross(c - a).length() > 0.0, "{name}: a triangle without area");
    }
    if primitive.topology == Topology::Lines {
        for line in primitive.indices.as_chunks::<2>().0 {
            assert_ne!(
                primitive.positions[line[0] as usize], primitive.positions[line[1] as usize],
                "{name}: a line without length"
            );
        }
    }
}

/// The usual settings with one method.
pub(super) fn by(method: Method) -> LodSettings {
    LodSettings {
        method,
        ..LodSettings::default()
    }
}

fn samples_per_triangle(level: &LodLevel) -> usize {
    (6_000 / (level.triangles + level.lines).max(1) as usize).max(1)
}

#[test]
fn the_stated_error_bounds_what_brute_force_measures_and_is_not_loose() {
    let meshes = [
        ("sphere", sphere(32, 16)),
        ("torus", torus(32, 16)),
        ("terrain", terrain(32)),
        ("boxes", boxes(9)),
        ("soup", soup(800)),
    ];
    for (name, mesh) in meshes {
        let model = model([mesh]);
        for method in [Method::Octree, Method::Quadric, Method::Best] {
            let chain = chain(&model, &by(method));
            check_chain(name, &model, &chain);
            assert!(chain.levels.len() > 2, "{name}: no coarser levels");
            let mut worst = 0.0f64;
            for level in &chain.levels[1..] {
                let measured = measured_error(&model.primitives, &level.primitives, samples_per_triangle(level));
                worst = worst.max(measured);
                let stated = level.geometric_error;
                assert!(measured <= stated, "{name}: measured {measured}, stated only {stated}");
                assert!(
                    stated <= 2.0 * worst,
                    "{name}: measured {worst}, stated as much as {stated}"
                );
            }
        }
    }
}

/// A wall of 20,000 triangles is where a wall of two is, and not where it has a hole or a bump.
#[test]
fn a_flat_wall_is_no_further_from_a_coarse_one_than_it_is() {
    let side = 100;
    let wall = |is_open: &dyn Fn(u32, u32) -> bool, bump: f64| {
        let at = |x: u32, y: u32| {
            let z = if (x, y) == (30, 30) { bump } else { 0.0 };
            DVec3::new(f64::from(x), f64::from(y), z)
        };
        let mut shapes = Vec::new();
        for (x, y) in (0..side).flat_map(|x| (0..side).map(move |y| (x, y))) {
            if !is_open(x, y) {
                shapes.push([at(x, y), at(x + 1, y), at(x + 1, y + 1)]);
                shapes.push([at(x, y), at(x + 1, y + 1), at(x, y + 1)]);
            }
        }
        ShapeTree::new(shapes)
    };
    let corner = |x: f64, y: f64| DVec3::new(x * f64::from(side), y * f64::from(side), 0.0);
    let [a, b, c, d] = [corner(0.0, 0.0), corner(1.0, 0.0), corner(1.0, 1.0), corner(0.0, 1.0)];
    let coarse = ShapeTree::new(vec![[a, b, c], [a, c, d]]);
    let error = |wall: ShapeTree| hausdorff_bound_of(&wall, &coarse, HausdorffLimits::default());
    let diagonal = coarse.diagonal();
    let whole = error(wall(&|_, _| false, 0.0));
    assert!(whole <= 3e-4 * diagonal, "{whole}");
    let bumpy = error(wall(&|_, _| false, 2.0));
    assert!((2.0..2.8).contains(&bumpy), "{bumpy}");
    // The middle of the hole is five from its rim.
    let holed = error(wall(&|x, y| (40..50).contains(&x) && (40..60).contains(&y), 0.0));
    assert!((5.0..7.0).contains(&holed), "{holed}");
}

#[test]
fn less_work_makes_the_bound_looser_and_never_wrong() {
    let model = model([sphere(48, 24)]);
    let hasty = LodSettings {
        error_limits: HausdorffLimits {
            pieces_per_shape: 0,
            extra_pieces: 0,
            ..HausdorffLimits::default()
        },
        ..LodSettings::default()
    };
    let (hasty, patient) = (chain(&model, &hasty), chain(&model, &LodSettings::default()));
    for (hasty, patient) in hasty.levels.iter().zip(&patient.levels).skip(1) {
        assert!(hasty.geometric_error >= 0.8 * patient.geometric_error);
        let measured = measured_error(&model.primitives, &hasty.primitives, 4);
        assert!(measured <= hasty.geometric_error);
    }
}

#[test]
fn no_coarser_level_has_more_to_draw() {
    let level = |triangles: usize, vertices: usize, error| {
        let mesh = Primitive {
            positions: vec![[0.0; 3]; vertices],
            indices: (0..3 * triangles).map(|i| (i % vertices) as u32).collect(),
            ..Primitive::default()
        };
        LodLevel::new(vec![mesh], error)
    };
    let levels = vec![
        level(127, 127, 0.0),
        level(23, 69, 1.0),
        level(26, 13, 2.0),
        level(15, 9, 3.0),
    ];
    assert!(geometry_bytes(&levels[2].primitives) < geometry_bytes(&levels[1].primitives) / 2);
    let kept: Vec<u64> = worthwhile(levels, 1.0).iter().map(|level| level.triangles).collect();
    assert_eq!(kept, [127, 23, 15]);
}

#[test]
fn a_small_model_has_level_0_only() {
    let chain = chain(&model([boxes(1)]), &LodSettings::default());
    assert_eq!(chain.levels.len(), 1);
}

#[test]
fn a_big_model_ends_with_a_handful_of_triangles() {
    let chain = chain(&model([sphere(120, 60)]), &LodSettings::default());
    let coarsest = chain.levels.last().unwrap();
    assert!((1..=100).contains(&coarsest.triangles), "{}", coarsest.triangles);
    assert!(chain.levels.len() <= LodSettings::default().max_levels);
}

#[test]
fn parts_of_different_materials_do_not_come_apart() {
    let whole = terrain(40);
    let half = whole.indices.len() / 2;
    let part = |material: usize, indices: &[u32]| Primitive {
        material: Some(material),
        indices: indices.to_vec(),
        ..whole.clone()
    };
    let parts = model([part(0, &whole.indices[..half]), part(1, &whole.indices[half..])]);
    let (parts, whole) = (
        chain(&parts, &by(Method::Octree)),
        chain(&model([whole.clone()]), &by(Method::Octree)),
    );
    let triangles = |level: &LodLevel| -> BTreeSet<[[u32; 3]; 3]> {
        let all = level.primitives.iter().flat_map(Primitive::triangles);
        all.map(|t| t.map(|p| p.map(f32::to_bits))).collect()
    };
    let of_whole: Vec<_> = whole.levels.iter().map(triangles).collect();
    assert!(parts.levels.len() > 2);
    assert!(parts.levels.iter().all(|level| of_whole.contains(&triangles(level))));
}

#[test]
fn both_sides_of_a_seam_keep_their_texture_coordinates() {
    let chain = chain(&model([sphere(96, 48)]), &LodSettings::default());
    let primitive = &chain.levels[1].primitives[0];
    for triangle in primitive.indices.as_chunks::<3>().0 {
        let u = triangle.map(|i| primitive.uvs[0][i as usize][0]);
        let at_a_pole = triangle
            .iter()
            .any(|&i| primitive.positions[i as usize][1].abs() > 0.95);
        let spread = u.iter().copied().fold(0.0, f32::max) - u.iter().copied().fold(1.0, f32::min);
        assert!(at_a_pole || spread < 0.5, "a triangle spans the whole picture: {u:?}");
    }
}

#[test]
fn a_thin_wall_keeps_both_faces_unless_one_is_drawn_from_both_sides() {
    let front = sheet(32, 32, |u, v| ([u, v, 0.0], [0.0, 0.0, 1.0]));
    let mut back = sheet(32, 32, |u, v| ([u, v, 0.001], [0.0, 0.0, -1.0]));
    back.indices
        .as_chunks_mut::<3>()
        .0
        .iter_mut()
        .for_each(|t| t.swap(1, 2));
    let parts = [front, back].map(|p| Primitive { material: Some(4), ..p });
    let wall = |double_sided: BTreeSet<usize>| {
        let deepest_first = OctreeSettings {
            order: Order::MostVertices,
            ..OctreeSettings::default()
        };
        let octree = Octree::new(&parts, &Locked::default(), &deepest_first);
        let clusters = Reduction::new(octree, &parts).clusters_for(500);
        let left = collapse::SourceShapes::new(&parts, &double_sided).collapse(&clusters);
        left.primitives.iter().map(Primitive::count).sum::<usize>()
    };
    assert_eq!(wall(BTreeSet::new()), 2 * wall(BTreeSet::from([4])));
}

#[test]
fn a_strip_of_slivers_collapses_to_lines_that_stay() {
    // Spikes on a ball: thin triangles whose tips are far from everything else.
    let mut mesh = sphere(48, 24);
    for i in 0..12 {
        let first = mesh.positions.len() as u32;
        let angle = TAU * i as f32 / 12.0;
        for (radius, turn) in [(1.0, 0.0), (1.0, 0.01), (4.0, 0.0)] {
            let n = [(angle + turn).cos(), 0.0, (angle + turn).sin()];
            mesh.positions.push(n.map(|x| x * radius));
            mesh.normals.push([0.0, 1.0, 0.0]);
            mesh.uvs[0].push([0.0, 0.0]);
        }
        mesh.indices.extend([first, first + 1, first + 2]);
    }
    let deepest_first = LodSettings {
        octree: OctreeSettings {
            order: Order::MostVertices,
            ..OctreeSettings::default()
        },
        ..by(Method::Octree)
    };
    let chain = chain(&model([mesh]), &deepest_first);
    assert!(chain.levels[1..].iter().any(|level| level.lines >= 6));
    // At 50 triangles the spikes are gone; before, they are not.
    assert!(chain.levels[1].geometric_error < 2.5);
}

#[test]
fn lines_and_points_are_clustered_and_never_vanish() {
    for topology in [Topology::Lines, Topology::Points] {
        let cloud = Primitive {
            topology,
            indices: (0..3_000).collect(),
            ..soup(1_000)
        };
        let model = model([cloud]);
        let chain = chain(&model, &LodSettings::default());
        assert!(chain.levels.len() > 2);
        check_chain("cloud", &model, &chain);
        for level in &chain.levels {
            let measured = measured_error(&model.primitives, &level.primitives, 4);
            assert!(measured <= level.geometric_error.max(1e-12));
        }
    }
}

#[test]
fn a_model_without_extent_in_some_axes_works() {
    for axes in 0..3 {
        let mut mesh = terrain(24);
        for position in &mut mesh.positions {
            position.iter_mut().skip(axes).for_each(|x| *x = 5.0);
        }
        let model = model([mesh]);
        check_chain("flat", &model, &chain(&model, &LodSettings::default()));
    }
}

#[test]
fn an_empty_model_has_an_empty_level_0() {
    for empty in [model([]), model([Primitive::default()])] {
        assert_eq!(chain(&empty, &LodSettings::default()).levels.len(), 1);
    }
}

#[test]
fn the_chain_is_the_same_for_any_number_of_threads() {
    let model = model([soup(2_000), sphere(40, 20)]);
    let with_threads = |count| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(count).build().unwrap();
        pool.install(|| chain(&model, &LodSettings::default()))
    };
    assert_eq!(with_threads(1), with_threads(3));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]
    #[test]
    fn any_mesh_gives_sound_levels(
        // Few distinct coordinates: doublets, flat triangles and shared edges everywhere.
        positions in prop::collection::vec(prop::array::uniform3(-4i8..4), 1..60),
        scale in prop::sample::select(vec![1e-20f32, 1.0, 1e15]),
        shapes in prop::collection::vec(prop::array::uniform3(any::<prop::sample::Index>()), 1..150),
        topology in prop::sample::select(vec![Topology::Points, Topology::Lines, Topology::Triangles]),
    ) {
        let indices = shapes.iter().flatten().map(|i| i.index(positions.len()) as u32);
        let mut mesh = Primitive {
            topology,
            positions: positions.iter().map(|p| p.map(|x| f32::from(x) * scale)).collect(),
            normals: positions.iter().map(|p| [0.0, f32::from(p[0]).signum(), 0.0]).collect(),
            indices: indices.collect(),
            ..Primitive::default()
        };
        mesh.indices.truncate(mesh.indices.len() / topology.arity() * topology.arity());
        let model = model([mesh]);
        let settings = LodSettings { coarsest_shapes: 4, ..LodSettings::default() };
        let chain = chain(&model, &settings);
        check_chain("any", &model, &chain);
        // A level of the same surface with fewer doublets has no error; but a place on it is as exact as its numbers.
        let rounding = 4.0 * f64::EPSILON * 4.0 * f64::from(scale);
        for level in &chain.levels[1..] {
            let measured = measured_error(&model.primitives, &level.primitives, 8);
            prop_assert!(measured <= level.geometric_error + rounding, "{measured} > {}", level.geometric_error);
        }
    }
}

#[test]
#[ignore = "prints a table; run in release with --nocapture"]
#[expect(clippy::disallowed_types, reason = "a table for people, not part of the bake")]
fn table_of_levels() {
    let meshes = [
        ("sphere", sphere(316, 158)),
        ("torus", torus(316, 158)),
        ("terrain", terrain(316)),
        ("boxes", boxes(91)),
        ("soup", soup(100_000)),
    ];
    for (name, mesh) in meshes {
        let model = model([mesh]);
        let started = std::time::Instant::now();
        let chain = chain(&model, &LodSettings::default());
        println!("{name}: {:.2} s", started.elapsed().as_secs_f64());
        for level in &chain.levels {
            println!(
                "  {:>7} triangles {:>6} lines {:>8} bytes  error {:.5}",
                level.triangles,
                level.lines,
                geometry_bytes(&level.primitives),
                level.geometric_error
            );
        }
    }
}

#[test]
#[ignore = "writes files for other validators: set GLB_DIR"]
fn write_levels_to_disk() {
    let dir = std::path::PathBuf::from(std::env::var("GLB_DIR").unwrap());
    let cloud = |topology| Primitive {
        topology,
        indices: (0..3_000).collect(),
        ..soup(1_000)
    };
    let meshes = [
        ("sphere", sphere(96, 48)),
        ("torus", torus(300, 250)),
        ("terrain", terrain(64)),
        ("boxes", boxes(12)),
        ("soup", soup(3_000)),
        ("lines", cloud(Topology::Lines)),
        ("points", cloud(Topology::Points)),
    ];
    for (name, mesh) in meshes {
        for (i, level) in chain(&model([mesh]), &LodSettings::default()).levels.iter().enumerate() {
            let input = crate::glb::GlbInput {
                primitives: &level.primitives,
                materials: &[],
                textures: &[],
                image_uri: &|_| String::new(),
            };
            let glb = crate::glb::write(&input, crate::glb::lattice::Lattice::of_size(1.0, 1.0));
            std::fs::write(dir.join(format!("{name}{i}.glb")), glb.bytes).unwrap();
        }
    }
}
