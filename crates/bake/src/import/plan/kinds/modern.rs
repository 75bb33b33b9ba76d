//! Abstract sculpture.

use super::Piece;
use crate::import::plan::finish::{BRONZE, Finish, GOLD, GRANITE, IRON, MARBLE, PAINT, Rgb, STEEL};
use crate::import::plan::mesh::{Mesh, on_sphere};
use crate::import::plan::rng::{Rng, noise};
use glam::{Affine3A, Vec3};
use std::f32::consts::TAU;

fn base(mesh: &mut Mesh, width: f32) {
    mesh.block(&GRANITE, [0.0; 3], [width, 0.35, width]);
}

/// A torus knot; the variant chooses how often it winds.
pub(super) fn knot(mesh: &mut Mesh, piece: &Piece) {
    let height = piece.height(1.7);
    let (p, q) = [(2.0, 3.0), (3.0, 2.0), (3.0, 5.0), (2.0, 5.0)][piece.entry.variant as usize % 4];
    base(mesh, height * 0.6);
    let r = height / 2.0;
    mesh.moved(Vec3::Y * (0.33 + r), |mesh| {
        let path: Vec<_> = (0..=160)
            .map(|i| {
                let t = TAU * i as f32 / 160.0;
                let ring = 0.62 + 0.26 * (q * t).cos();
                let at = Vec3::new(ring * (p * t).sin(), ring * (p * t).cos(), 0.26 * (q * t).sin());
                (at * r, 0.11 * r)
            })
            .collect();
        mesh.tube(&piece.finish(BRONZE), &path, 16);
    });
}

/// Balls of several sizes in balance.
pub(super) fn spheres(mesh: &mut Mesh, piece: &Piece) {
    let height = piece.height(2.0);
    base(mesh, 0.8);
    let finishes = [
        STEEL,
        GOLD,
        BRONZE,
        MARBLE,
        Finish::matt("red lacquer", 0xb3202a).gloss(0.2),
    ];
    let mut rng = Rng::new(piece.seed + 17);
    let mut y = 0.35;
    let mut radius = height * 0.2;
    let mut x = 0.0;
    for i in 0..6 {
        let finish = piece.finish(finishes[(i + piece.entry.variant as usize) % finishes.len()].clone());
        mesh.ellipsoid(&finish, Vec3::new(x, y + radius, 0.0), Vec3::splat(radius), 32);
        y += radius * 1.75;
        radius *= 0.76;
        x += rng.range(-0.3, 0.3) * radius;
    }
}

/// A polished, pierced-looking organic form.
pub(super) fn pebble(mesh: &mut Mesh, piece: &Piece) {
    let height = piece.height(1.5);
    base(mesh, 0.9);
    let seed = piece.seed + 5;
    mesh.grid(&piece.finish(MARBLE), (72, 40, true), |a, b| {
        let p = on_sphere(a, b);
        let bulge = 1.0 + 0.32 * noise(p * 1.3 + Vec3::splat(3.0), seed) + 0.1 * noise(p * 2.7, seed + 1);
        let twist = Affine3A::from_rotation_y(p.y * 0.9);
        let waist = 1.0 - 0.3 * (-(p.y * 2.6).powi(2)).exp();
        let form = twist.transform_point3(Vec3::new(p.x * 0.36 * waist, p.y * 0.52, p.z * 0.22 * waist) * bulge);
        form * height + Vec3::Y * (0.3 + height * 0.52)
    });
}

/// Coloured blades on wires.
pub(super) fn mobile(mesh: &mut Mesh, piece: &Piece) {
    let drop = piece.height((piece.ceiling_m - 2.9).clamp(0.4, 2.0));
    let colours = [0xc8302b, 0x1d1d1f, 0xe3b32c, 0x2556a0, 0xf1ece0].map(Rgb::hex);
    mesh.tube(&IRON, &[(Vec3::ZERO, 0.008), (Vec3::NEG_Y * drop, 0.008)], 6);
    let mut rng = Rng::new(piece.seed + 23);
    for i in 0..7 {
        let angle = TAU * i as f32 / 7.0 + rng.range(-0.3, 0.3);
        let reach = rng.range(0.5, 1.3);
        let y = -drop - 0.12 * i as f32;
        let tip = Vec3::new(angle.sin() * reach, y + 0.06, angle.cos() * reach);
        mesh.tube(&IRON, &[(Vec3::Y * y, 0.007), (tip, 0.006)], 6);
        mesh.tint(Some(colours[i % colours.len()].linear()));
        mesh.posed(
            Affine3A::from_translation(tip - Vec3::Y * 0.12) * Affine3A::from_rotation_y(angle),
            |mesh| {
                let size = rng.range(0.14, 0.3);
                mesh.ellipsoid(&PAINT.gloss(0.4), Vec3::ZERO, Vec3::new(0.012, size * 0.6, size), 20);
            },
        );
        mesh.tint(None);
    }
    mesh.tube(
        &IRON,
        &[(Vec3::NEG_Y * drop, 0.008), (Vec3::NEG_Y * (drop + 0.75), 0.008)],
        6,
    );
}
