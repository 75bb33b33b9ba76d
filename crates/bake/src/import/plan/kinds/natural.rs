//! Natural history: bones, shells, crystals, plants.

use super::Piece;
use crate::import::plan::finish::{BONE, CLAY, Finish, GRANITE, IRON, LEAF, PAINT, Rgb};
use crate::import::plan::mesh::{Mesh, curve, on_sphere};
use crate::import::plan::rng::{Rng, noise};
use glam::{Affine3A, Vec3};
use std::f32::consts::TAU;

fn v(x: f32, y: f32, z: f32) -> Vec3 {
    Vec3::new(x, y, z)
}

/// The skeleton of a striding hunter of 8 m (at the usual width), its head towards +Z.
pub(super) fn dinosaur(mesh: &mut Mesh, piece: &Piece) {
    let length = piece.width(8.0);
    let bone = piece.finish(BONE);
    mesh.block(&GRANITE, [0.0; 3], [length * 0.26, 0.16, length * 0.62]);
    mesh.posed(
        Affine3A::from_scale_rotation_translation(Vec3::splat(length / 8.0), Default::default(), Vec3::Y * 0.16),
        |mesh| {
            let spine = curve(
                &[
                    (v(0.5, 2.2, -4.4), 0.02),
                    (v(0.2, 2.3, -3.2), 0.05),
                    (v(0.0, 2.25, -1.9), 0.08),
                    (v(0.0, 2.3, -0.6), 0.12),
                    (v(0.0, 2.45, 0.5), 0.11),
                    (v(0.0, 2.8, 1.4), 0.1),
                    (v(0.0, 3.35, 2.0), 0.09),
                    (v(0.0, 3.6, 2.5), 0.09),
                ],
                56,
            );
            for (i, &(at, r)) in spine.iter().enumerate() {
                let next = spine[(i + 1).min(spine.len() - 1)].0;
                let toward = (next - spine[i.saturating_sub(1)].0).normalize_or(Vec3::Z);
                let half = toward * 0.055;
                mesh.tube(&bone, &[(at - half, r), (at, r * 0.75), (at + half, r)], 8);
                mesh.tube(
                    &bone,
                    &[(at, r * 0.4), (at + Vec3::Y * r * 2.6 - toward * r * 0.6, r * 0.22)],
                    5,
                );
            }
            for i in 0..13 {
                let (at, _) = spine[26 + i];
                let t = i as f32 / 12.0;
                let belly = 0.75 + 0.45 * (t * 2.8).sin();
                for side in [-1.0, 1.0] {
                    let rib = [
                        (at, 0.035),
                        (at + v(side * 0.42 * belly, -0.1, -0.05), 0.034),
                        (at + v(side * 0.52 * belly, -0.62 * belly, 0.0), 0.03),
                        (at + v(side * 0.22 * belly, -1.12 * belly, 0.14), 0.018),
                    ];
                    mesh.tube(&bone, &curve(&rib, 10), 6);
                }
            }
            mesh.ellipsoid(&bone, v(0.0, 2.2, -0.75), v(0.2, 0.32, 0.5), 16);
            for (side, stride) in [(-1.0, 0.55), (1.0, -0.5)] {
                let (hip, knee) = (v(side * 0.26, 2.15, -0.65), v(side * 0.42, 1.35, -0.25 + stride * 0.6));
                let (ankle, ball) = (
                    v(side * 0.42, 0.62, -0.75 + stride * 0.8),
                    v(side * 0.42, 0.12, -0.45 + stride),
                );
                for (a, b, r) in [(hip, knee, 0.1), (knee, ankle, 0.075), (ankle, ball, 0.06)] {
                    let middle = (a + b) / 2.0;
                    mesh.tube(
                        &bone,
                        &curve(
                            &[
                                (a, r * 1.4),
                                (a.lerp(middle, 0.5), r * 0.8),
                                (middle, r * 0.7),
                                (b.lerp(middle, 0.5), r * 0.8),
                                (b, r * 1.3),
                            ],
                            12,
                        ),
                        10,
                    );
                }
                for toe in [-0.35, 0.0, 0.35] {
                    let tip = ball + v(toe, -0.08, 0.45 - 0.3 * toe.abs());
                    mesh.tube(
                        &bone,
                        &curve(
                            &[
                                (ball, 0.055),
                                (ball.lerp(tip, 0.5) + Vec3::Y * 0.06, 0.045),
                                (tip, 0.012),
                            ],
                            8,
                        ),
                        7,
                    );
                }
                let shoulder = v(side * 0.3, 2.2, 1.35);
                let arm = [
                    (shoulder + v(0.0, 0.5, -0.3), 0.04),
                    (shoulder, 0.05),
                    (shoulder + v(side * 0.06, -0.4, 0.1), 0.035),
                    (shoulder + v(0.0, -0.5, 0.42), 0.025),
                    (shoulder + v(0.0, -0.65, 0.52), 0.01),
                ];
                mesh.tube(&bone, &curve(&arm, 16), 7);
            }
            // Skull and jaws with teeth.
            mesh.posed(
                Affine3A::from_translation(v(0.0, 3.62, 2.5)) * Affine3A::from_rotation_x(0.22),
                |mesh| {
                    for side in [-1.0, 1.0] {
                        let upper = [
                            (v(side * 0.2, 0.05, 0.0), 0.1),
                            (v(side * 0.25, 0.02, 0.35), 0.09),
                            (v(side * 0.18, -0.04, 0.85), 0.08),
                            (v(side * 0.05, -0.1, 1.2), 0.07),
                        ];
                        let crest = [
                            (v(side * 0.15, 0.25, -0.05), 0.07),
                            (v(side * 0.18, 0.32, 0.3), 0.07),
                            (v(side * 0.12, 0.16, 0.8), 0.06),
                            (v(side * 0.03, -0.02, 1.22), 0.05),
                        ];
                        let lower = [
                            (v(side * 0.22, -0.1, -0.02), 0.08),
                            (v(side * 0.23, -0.42, 0.3), 0.085),
                            (v(side * 0.15, -0.52, 0.75), 0.065),
                            (v(side * 0.03, -0.5, 1.08), 0.055),
                        ];
                        for path in [upper, crest, lower] {
                            mesh.tube(&bone, &curve(&path, 14), 9);
                        }
                        mesh.tube(
                            &bone,
                            &[(v(side * 0.2, 0.3, 0.12), 0.05), (v(side * 0.24, 0.0, 0.16), 0.05)],
                            8,
                        );
                        mesh.tube(
                            &bone,
                            &[(v(side * 0.17, 0.28, 0.48), 0.045), (v(side * 0.22, 0.0, 0.55), 0.045)],
                            8,
                        );
                        for i in 0..8 {
                            let t = 0.3 + 0.09 * i as f32;
                            let x = side * (0.26 - 0.2 * (t - 0.3) / 0.8);
                            mesh.tube(
                                &bone,
                                &[
                                    (v(x, -0.06 - 0.06 * t, t + 0.08), 0.026),
                                    (v(x, -0.23 - 0.05 * t, t + 0.05), 0.003),
                                ],
                                6,
                            );
                            mesh.tube(&bone, &[(v(x * 0.9, -0.43, t), 0.022), (v(x * 0.9, -0.3, t), 0.003)], 6);
                        }
                    }
                    mesh.ellipsoid(&bone, v(0.0, 0.2, 0.08), v(0.17, 0.16, 0.24), 14);
                },
            );
            for z in [-1.4, 0.9] {
                mesh.tube(&IRON, &[(v(0.0, 0.0, z), 0.04), (v(0.0, 2.35, z), 0.03)], 8);
            }
        },
    );
}

pub(super) fn ammonite(mesh: &mut Mesh, piece: &Piece) {
    let size = piece.height(0.5);
    let stone = piece.finish(Finish::matt("fossil", 0x9a7a55).gloss(0.4));
    let turns = 3.2;
    mesh.moved(Vec3::Y * size * 0.52, |mesh| {
        let path: Vec<_> = (0..=150)
            .map(|i| {
                let t = i as f32 / 150.0;
                let angle = t * turns * TAU;
                let r = 0.33 * size * ((t - 1.0) * 2.4).exp();
                let rib = 1.0 + 0.09 * (angle * 12.0).sin();
                (v(r * angle.cos(), r * angle.sin(), 0.0), (r * 0.52 * rib).max(0.002))
            })
            .collect();
        mesh.tube(&stone, &path, 14);
    });
    mesh.block(&IRON, [0.0; 3], [size * 0.3, size * 0.05, size * 0.3]);
    mesh.tube(
        &IRON,
        &[(Vec3::ZERO, 0.012 * size), (v(0.0, size * 0.2, 0.0), 0.012 * size)],
        6,
    );
}

pub(super) fn crystal(mesh: &mut Mesh, piece: &Piece) {
    let size = piece.height(0.6);
    let colour = piece.entry.colour.unwrap_or(Rgb::hex(0x7d4fb0));
    let gem = Finish::matt("crystal", 0xffffff).dyed(Some(colour)).gloss(0.08);
    let mut rng = Rng::new(piece.seed + 31);
    let seed = piece.seed;
    mesh.grid(&GRANITE, (24, 10, true), |a, b| {
        let p = on_sphere(a, b);
        (p * v(0.42, 0.2, 0.36) * (1.0 + 0.25 * noise(p * 3.0, seed)) + Vec3::Y * 0.16) * size
    });
    for i in 0..22 {
        let lean = Affine3A::from_rotation_y(i as f32 * 2.4) * Affine3A::from_rotation_x(rng.range(0.0, 0.95));
        let (length, r) = (size * rng.range(0.3, 0.78), size * rng.range(0.035, 0.085));
        mesh.posed(Affine3A::from_translation(Vec3::Y * size * 0.16) * lean, |mesh| {
            let ring = |i: usize, y: f32, r: f32| {
                let (sin, cos) = (TAU * i as f32 / 6.0).sin_cos();
                v(r * sin, y, r * cos)
            };
            for i in 0..6 {
                mesh.polygon(
                    &gem,
                    &[
                        ring(i, 0.0, r),
                        ring(i + 1, 0.0, r),
                        ring(i + 1, length, r),
                        ring(i, length, r),
                    ],
                );
                mesh.polygon(
                    &gem,
                    &[
                        ring(i, length, r),
                        ring(i + 1, length, r),
                        v(0.0, length + r * 1.6, 0.0),
                    ],
                );
            }
        });
    }
}

/// A blade that rises and bends over, seen from both sides.
fn blade(mesh: &mut Mesh, length: f32, width: f32, droop: f32, colour: [f32; 3]) {
    mesh.coloured_grid(&LEAF, (2, 6, false), |a, b| {
        let w = width * (b * 2.6).sin().max(0.05) * (1.0 - b).powf(0.3);
        let x = (a - 0.5) * 2.0;
        let shade = 0.6 + 0.5 * b;
        (
            v(
                x * w,
                length * (b - droop * b * b),
                length * 0.75 * b * b + x * x * w * 0.3,
            ),
            Some(colour.map(|c| c * shade)),
        )
    });
}

pub(super) fn plant(mesh: &mut Mesh, piece: &Piece) {
    let height = piece.height(1.5);
    let pot = piece.finish(CLAY);
    mesh.lathe(
        &pot,
        &[
            (0.0, 0.0),
            (0.17, 0.0),
            (0.25, 0.36),
            (0.28, 0.36),
            (0.28, 0.43),
            (0.24, 0.43),
            (0.23, 0.38),
            (0.0, 0.38),
        ],
        28,
    );
    let mut rng = Rng::new(piece.seed + 41);
    let green = [Rgb::hex(0x3f7a35), Rgb::hex(0x2f6440), Rgb::hex(0x5d8a3a)][piece.entry.variant as usize % 3].linear();
    for i in 0..26 {
        let turn = Affine3A::from_rotation_y(i as f32 * 2.39996);
        let lean = Affine3A::from_rotation_x(rng.range(0.0, 0.5));
        let length = (height - 0.38) * rng.range(0.7, 1.25);
        let droop = rng.range(0.1, 0.6);
        mesh.posed(Affine3A::from_translation(Vec3::Y * 0.38) * turn * lean, |mesh| {
            blade(mesh, length, 0.055 + 0.03 * height, droop, green);
        });
    }
}

pub(super) fn tree(mesh: &mut Mesh, piece: &Piece) {
    let height = piece.height(4.0);
    const BARK: Finish = Finish::matt("bark", 0x5f4a38);
    let mut rng = Rng::new(piece.seed + 53);
    mesh.lathe(&GRANITE, &[(0.75, 0.0), (0.75, 0.35), (0.62, 0.35), (0.62, 0.28)], 32);
    mesh.lathe(&Finish::matt("soil", 0x3a2a1e), &[(0.63, 0.29), (0.0, 0.31)], 24);
    mesh.tube(
        &BARK,
        &curve(
            &[
                (Vec3::Y * 0.25, 0.13),
                (v(0.06, height * 0.25, 0.03), 0.1),
                (v(-0.05, height * 0.5, 0.0), 0.08),
                (v(0.0, height * 0.75, 0.05), 0.04),
            ],
            14,
        ),
        12,
    );
    for i in 0..5 {
        let angle = i as f32 * 2.4;
        let tip = v(
            angle.sin() * height * 0.2,
            height * rng.range(0.62, 0.82),
            angle.cos() * height * 0.2,
        );
        mesh.tube(
            &BARK,
            &curve(
                &[
                    (v(0.0, height * 0.42, 0.0), 0.06),
                    (tip * v(0.5, 0.85, 0.5), 0.045),
                    (tip, 0.02),
                ],
                8,
            ),
            8,
        );
    }
    let green = piece.entry.colour.unwrap_or(Rgb::hex(0x4a7a36)).linear();
    for i in 0..9_u64 {
        let angle = i as f32 * 2.39996;
        let out = if i == 0 { 0.0 } else { height * 0.17 };
        let middle = v(angle.sin() * out, height * rng.range(0.66, 0.86), angle.cos() * out);
        let size = height * rng.range(0.13, 0.19);
        mesh.coloured_grid(&PAINT, (22, 14, true), |a, b| {
            let p = on_sphere(a, b);
            let rough = 1.0 + 0.3 * noise(p * 3.3, i + 61) + 0.14 * noise(p * 8.0, i + 71);
            let shade = 0.55 + 0.4 * b + 0.25 * noise(p * 5.0, i + 81);
            (
                middle + p * v(1.0, 0.8, 1.0) * size * rough,
                Some(green.map(|c| c * shade)),
            )
        });
    }
}
