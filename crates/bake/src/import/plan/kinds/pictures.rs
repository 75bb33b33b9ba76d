//! What hangs on walls: pictures that nobody painted before, cloth, a clock.

use super::Piece;
use crate::import::plan::finish::{BRONZE, CLOTH, GOLD, IRON, LINEN, PAINT, Rgb, WALNUT};
use crate::import::plan::mesh::Mesh;
use crate::import::plan::rng::{Rng, noise};
use glam::{Affine3A, Vec3};
use std::f32::consts::TAU;

/// Five colours that go together: ground, then four for shapes.
const PALETTES: [[u32; 5]; 8] = [
    [0xeae0c8, 0xc8402f, 0x1f3a5f, 0xe0a93b, 0x26221f],
    [0x22313f, 0xd9b26f, 0x8fb3a5, 0xe9e2cf, 0xa84b3a],
    [0xd8c3a5, 0x8e8d8a, 0xe98074, 0xe85a4f, 0x3d405b],
    [0xf2efe6, 0x2a9d8f, 0xe9c46a, 0xf4a261, 0x264653],
    [0x2b1d2a, 0x7a3e5c, 0xd9846b, 0xf0c987, 0x4d6a8a],
    [0xb9c9b4, 0x3b5d50, 0xf0ead6, 0x8c5a3c, 0xd9a441],
    [0x15202b, 0x365d8d, 0xa9c8d8, 0xf1f3e8, 0xd96c3b],
    [0xe7d7c1, 0x735751, 0xa78a7f, 0xbf4342, 0x8c1c13],
];

const HANG_MIDDLE_M: f32 = 1.65;

/// A picture plane that takes flat shapes, each a hair's breadth in front of the one before.
struct Canvas<'a> {
    mesh: &'a mut Mesh,
    half: [f32; 2],
    depth: f32,
}

impl Canvas<'_> {
    fn polygon(&mut self, colour: Rgb, points: &[[f32; 2]]) {
        self.depth += 0.0006;
        self.mesh.tint(Some(colour.linear()));
        let inside = |c: f32, half: f32| c.clamp(-half, half);
        let corners: Vec<Vec3> = points
            .iter()
            .map(|p| Vec3::new(inside(p[0], self.half[0]), inside(p[1], self.half[1]), self.depth))
            .collect();
        self.mesh.polygon(&PAINT, &corners);
    }

    fn rectangle(&mut self, colour: Rgb, [x0, y0]: [f32; 2], [x1, y1]: [f32; 2]) {
        self.polygon(colour, &[[x0, y0], [x1, y0], [x1, y1], [x0, y1]]);
    }

    fn disc(&mut self, colour: Rgb, [x, y]: [f32; 2], r: f32) {
        let points: Vec<_> = (0..22)
            .map(|i| {
                let (sin, cos) = (TAU * i as f32 / 22.0).sin_cos();
                [x + r * cos, y + r * sin]
            })
            .collect();
        self.polygon(colour, &points);
    }
}

pub(super) fn painting(mesh: &mut Mesh, piece: &Piece) {
    let mut rng = Rng::new(piece.seed.wrapping_mul(0x9e37) + u64::from(piece.entry.variant));
    let (width, height) = (piece.width(1.2), piece.height(0.9));
    let [w, h] = [width / 2.0, height / 2.0];
    let middle = HANG_MIDDLE_M.max(h + 0.5);
    let frame = if piece.entry.stuff.is_some() {
        piece.finish(GOLD)
    } else {
        [GOLD, WALNUT, GOLD, IRON][rng.below(4)].clone()
    };
    mesh.moved(Vec3::new(0.0, middle, 0.0), |mesh| {
        for (inner, outer, depth) in [(0.0, 0.05, 0.035), (0.05, 0.1, 0.06)] {
            let bar = |mesh: &mut Mesh, x: [f32; 2], y: [f32; 2]| {
                mesh.cuboid(&frame, Vec3::new(x[0], y[0], 0.002), Vec3::new(x[1], y[1], depth));
            };
            bar(mesh, [-w - outer, w + outer], [h + inner, h + outer]);
            bar(mesh, [-w - outer, w + outer], [-h - outer, -h - inner]);
            bar(mesh, [-w - outer, -w - inner], [-h - inner, h + inner]);
            bar(mesh, [w + inner, w + outer], [-h - inner, h + inner]);
        }
        let palette = PALETTES[rng.below(PALETTES.len())].map(Rgb::hex);
        let mut canvas = Canvas {
            mesh,
            half: [w, h],
            depth: 0.015,
        };
        canvas.rectangle(palette[0], [-w, -h], [w, h]);
        match rng.below(4) {
            0 => landscape(&mut canvas, &palette, &mut rng),
            1 => blocks(&mut canvas, &palette, &mut rng),
            2 => circles(&mut canvas, &palette, &mut rng),
            _ => shards(&mut canvas, &palette, &mut rng),
        }
        mesh.tint(None);
    });
}

/// A sun over ridges.
fn landscape(canvas: &mut Canvas<'_>, palette: &[Rgb; 5], rng: &mut Rng) {
    let [w, h] = canvas.half;
    canvas.disc(
        palette[3],
        [rng.range(-0.6, 0.6) * w, rng.range(0.2, 0.6) * h],
        h * rng.range(0.15, 0.3),
    );
    let seed = rng.below(1000) as u64;
    for ridge in 0..5 {
        let colour = palette[[1, 2, 4, 1, 4][ridge]];
        let base = h * (0.25 - 0.28 * ridge as f32);
        let y = |x: f32| base + h * 0.3 * noise(Vec3::new(x / w * 2.0, ridge as f32 * 9.0, 0.0), seed);
        let steps = 14;
        canvas.depth += 0.0006;
        for i in 0..steps {
            let (a, b) = (
                w * (2.0 * i as f32 / steps as f32 - 1.0),
                w * (2.0 * (i + 1) as f32 / steps as f32 - 1.0),
            );
            let depth = canvas.depth;
            canvas.polygon(colour, &[[a, -h], [b, -h], [b, y(b)], [a, y(a)]]);
            canvas.depth = depth;
        }
        canvas.depth += 0.0006;
    }
}

/// Rectangles between dark bars.
fn blocks(canvas: &mut Canvas<'_>, palette: &[Rgb; 5], rng: &mut Rng) {
    let [w, h] = canvas.half;
    let mut split = |half: f32| {
        let mut at = vec![-half, half];
        at.extend((0..4).map(|_| half * rng.range(-0.8, 0.8)));
        at.sort_by(f32::total_cmp);
        at
    };
    let (xs, ys) = (split(w), split(h));
    for y in ys.windows(2) {
        for x in xs.windows(2) {
            let colour = palette[[0, 0, 1, 2, 3, 0][rng.below(6)]];
            canvas.rectangle(colour, [x[0], y[0]], [x[1], y[1]]);
            canvas.depth -= 0.0006;
        }
    }
    canvas.depth += 0.0006;
    let bar = 0.012;
    for &x in &xs[1..5] {
        canvas.rectangle(palette[4], [x - bar, -h], [x + bar, h]);
    }
    for &y in &ys[1..5] {
        canvas.rectangle(palette[4], [-w, y - bar], [w, y + bar]);
    }
}

/// Rings within rings, some cut by lines.
fn circles(canvas: &mut Canvas<'_>, palette: &[Rgb; 5], rng: &mut Rng) {
    let [w, h] = canvas.half;
    for _ in 0..5 {
        let r = h * rng.range(0.15, 0.42);
        let at = [rng.range(-1.0, 1.0) * (w - r), rng.range(-1.0, 1.0) * (h - r)];
        let first = rng.below(4);
        for ring in 0..3 {
            canvas.disc(palette[1 + (first + ring) % 4], at, r * (1.0 - 0.32 * ring as f32));
        }
    }
    for _ in 0..4 {
        let (y0, y1) = (rng.range(-h, h), rng.range(-h, h));
        canvas.polygon(
            palette[4],
            &[[-w, y0], [w, y1 - 0.008], [w, y1 + 0.008], [-w, y0 + 0.012]],
        );
    }
}

/// Triangles thrown over each other.
fn shards(canvas: &mut Canvas<'_>, palette: &[Rgb; 5], rng: &mut Rng) {
    let [w, h] = canvas.half;
    for i in 0..34 {
        let size = h * rng.range(0.2, 0.7) * (1.0 - i as f32 / 60.0);
        let (x, y, turn) = (rng.range(-w, w) * 0.8, rng.range(-h, h) * 0.8, rng.range(0.0, TAU));
        let spread = [0.0, rng.range(1.4, 2.6), rng.range(3.2, 4.6)];
        let points = spread.map(|a| [x + size * (turn + a).cos(), y + size * (turn + a).sin()]);
        canvas.polygon(palette[1 + rng.below(4)], &points);
    }
}

pub(super) fn tapestry(mesh: &mut Mesh, piece: &Piece) {
    let (width, height) = (piece.width(2.0), piece.height(2.6));
    let ground = piece.entry.colour.unwrap_or(Rgb::hex(0x6d2230)).linear();
    let (gold, dark) = (Rgb::hex(0xc9a552).linear(), Rgb::hex(0x1f2a3a).linear());
    let top = 3.2_f32.min(height + 0.6);
    mesh.posed(
        Affine3A::from_translation(Vec3::new(0.0, top, 0.07)) * Affine3A::from_rotation_z(TAU / 4.0),
        |mesh| {
            let half = width / 2.0 + 0.15;
            mesh.tube(&BRONZE, &[(Vec3::NEG_Y * half, 0.025), (Vec3::Y * half, 0.025)], 10);
        },
    );
    mesh.coloured_grid(&CLOTH, (28, 36, false), |a, b| {
        let (x, y) = (a - 0.5, b - 0.5);
        let wave = 0.03 * (a * 19.0).sin() * (1.0 - b * 0.7);
        let diamond = (x.abs() * 4.0 + ((y * 3.0 + 0.5).rem_euclid(1.0) - 0.5).abs() * 2.0).rem_euclid(1.0);
        let colour = if x.abs() > 0.44 || y.abs() > 0.46 {
            gold
        } else if x.abs() > 0.4 || y.abs() > 0.43 {
            dark
        } else if diamond < 0.28 {
            gold.map(|c| c * 0.8)
        } else if diamond < 0.5 {
            dark
        } else {
            ground
        };
        (
            Vec3::new(x * width, top - height + b * height, 0.07 + wave),
            Some(colour),
        )
    });
}

pub(super) fn clock(mesh: &mut Mesh, piece: &Piece) {
    let r = piece.width(0.7) / 2.0;
    let up = Affine3A::from_translation(Vec3::new(0.0, 2.7, 0.0)) * Affine3A::from_rotation_x(TAU / 4.0);
    mesh.posed(up, |mesh| {
        mesh.lathe(
            &piece.finish(BRONZE),
            &[(r, 0.0), (r, 0.07), (r * 0.92, 0.09), (r * 0.88, 0.05)],
            40,
        );
        mesh.lathe(&LINEN, &[(r * 0.9, 0.05), (0.0, 0.05)], 40);
        for hour in 0..12 {
            mesh.posed(Affine3A::from_rotation_y(TAU * hour as f32 / 12.0), |mesh| {
                mesh.block(&IRON, [0.0, 0.051, r * 0.76], [0.02, 0.006, r * 0.14]);
            });
        }
        for (turn, length) in [(0.9, 0.5), (2.5, 0.72)] {
            mesh.posed(Affine3A::from_rotation_y(turn), |mesh| {
                mesh.block(&IRON, [0.0, 0.058, -r * length / 2.0], [0.02, 0.006, r * length]);
            });
        }
    });
}
