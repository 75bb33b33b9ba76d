use std::f32::consts::{PI, TAU};

use glam::DVec3;
use proptest::prelude::*;

use super::proximity::point_distance_squared;
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

fn sphere(across: u32, along: u32) -> Primitive {
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

fn terrain(across: u32) -> Primitive {
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
fn soup(triangles: usize) -> Primitive {
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

fn model(primitives: impl IntoIterator<Item = Primitive>) -> SourceModel {
    SourceModel {
        name: String::from("test"),
        primitives: primitives.into_iter().collect(),
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
        let distance = |p: DVec3| {
            shapes
                .iter()
                .map(|s| point_distance_squared(p, s))
                .fold(f64::INFINITY, f64::min)
        };
        samples(from, each).into_iter().map(distance).fold(0.0, f64::max).sqrt()
    };
    one_sided(a, b, 1).max(one_sided(b, a, each))
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
