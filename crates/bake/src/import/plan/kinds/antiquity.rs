//! Stone and gold of the ancients.

use super::Piece;
use crate::import::plan::finish::{BRONZE, CLAY, GOLD, GRANITE, LIMESTONE, MARBLE, PAINT, Rgb};
use crate::import::plan::mesh::{Mesh, curve, on_sphere};
use crate::import::plan::rng::noise;
use glam::{Affine3A, Vec3};
use std::f32::consts::TAU;

fn v(x: f32, y: f32, z: f32) -> Vec3 {
    Vec3::new(x, y, z)
}

/// Fluting of a shaft with 20 channels.
fn fluted(angle: f32) -> f32 {
    1.0 - 0.05 * (angle * 10.0).sin().abs().sqrt()
}

pub(super) fn column(mesh: &mut Mesh, piece: &Piece) {
    let stone = piece.finish(MARBLE);
    let height = piece.height(piece.ceiling_m);
    let r = piece.width(0.8) / 2.0;
    mesh.block(&stone, [0.0; 3], [r * 2.5, 0.12, r * 2.5]);
    mesh.lathe(
        &stone,
        &[
            (r * 1.22, 0.12),
            (r * 1.24, 0.18),
            (r * 1.2, 0.24),
            (r * 1.04, 0.27),
            (r * 1.1, 0.32),
            (r * 1.02, 0.37),
            (r, 0.38),
        ],
        40,
    );
    let (low, high) = (0.38, height - 0.5);
    let shaft: Vec<_> = (0..=6)
        .map(|i| {
            let t = i as f32 / 6.0;
            (r * (1.0 - 0.16 * t * t), low + (high - low) * t)
        })
        .collect();
    mesh.fluted_lathe(&stone, &shaft, 80, |angle, _| fluted(angle));
    mesh.moved(v(0.0, high, 0.0), |mesh| {
        mesh.lathe(
            &stone,
            &[
                (r * 0.84, 0.0),
                (r * 0.95, 0.03),
                (r * 0.88, 0.06),
                (r * 0.9, 0.1),
                (r * 1.3, 0.3),
                (r * 1.34, 0.34),
            ],
            40,
        );
        mesh.block(&stone, [0.0, 0.34, 0.0], [r * 2.8, 0.155, r * 2.8]);
    });
}

pub(super) fn broken_column(mesh: &mut Mesh, piece: &Piece) {
    let stone = piece.finish(LIMESTONE);
    let (height, r) = (piece.height(1.5), piece.width(0.8) / 2.0);
    mesh.block(&stone, [0.0; 3], [r * 2.5, 0.14, r * 2.5]);
    mesh.lathe(
        &stone,
        &[(r * 1.2, 0.14), (r * 1.22, 0.2), (r * 1.05, 0.26), (r, 0.3)],
        36,
    );
    let seed = piece.seed;
    mesh.grid(&stone, (80, 18, true), |a, b| {
        let angle = a * TAU;
        let edge = height * (0.86 + 0.16 * noise(v(angle.sin() * 1.7, 0.0, angle.cos() * 1.7), seed + 3));
        let (out, y) = if b <= 0.67 {
            (1.0, 0.3 + (edge - 0.3) * b / 0.67)
        } else {
            ((1.0 - b) / 0.33, edge)
        };
        let p = v(
            r * out * fluted(angle) * angle.sin(),
            y,
            r * out * fluted(angle) * angle.cos(),
        );
        if out < 1.0 {
            v(
                p.x,
                height * 0.8 + (y - height * 0.8) * out + 0.05 * noise(p * 7.0, seed),
                p.z,
            )
        } else {
            p
        }
    });
}

pub(super) fn obelisk(mesh: &mut Mesh, piece: &Piece) {
    let (stone, height) = (piece.finish(GRANITE), piece.height(3.6));
    let w = height * 0.075;
    mesh.block(&LIMESTONE, [0.0; 3], [w * 4.0, 0.2, w * 4.0]);
    mesh.block(&LIMESTONE, [0.0, 0.2, 0.0], [w * 3.0, 0.3, w * 3.0]);
    let square = |half: f32, y: f32| [v(-half, y, -half), v(half, y, half)];
    mesh.hexahedron(&stone, square(w, 0.5), square(w * 0.68, height * 0.92));
    mesh.hexahedron(&GOLD, square(w * 0.68, height * 0.92), square(0.004, height));
    for i in 0..14 {
        for turn in 0..4 {
            let y = 0.7 + i as f32 * (height * 0.92 - 0.9) / 14.0;
            let half = w * (1.0 - 0.32 * (y - 0.5) / (height * 0.92 - 0.5));
            mesh.posed(Affine3A::from_rotation_y(TAU * turn as f32 / 4.0), |mesh| {
                let mut sign = |x: f32, dy: f32, size: [f32; 2]| {
                    mesh.block(
                        &GOLD,
                        [x * half, y + dy, half - 0.002],
                        [size[0] * half, size[1], 0.016],
                    );
                };
                match (i * 7 + turn * 3) % 4 {
                    0 => {
                        sign(0.0, 0.0, [0.9, 0.03]);
                        sign(-0.3, 0.05, [0.2, 0.1]);
                    }
                    1 => {
                        sign(0.2, 0.0, [0.3, 0.14]);
                        sign(-0.35, 0.04, [0.3, 0.05]);
                    }
                    2 => {
                        sign(-0.3, 0.0, [0.15, 0.15]);
                        sign(0.0, 0.0, [0.15, 0.15]);
                        sign(0.3, 0.0, [0.15, 0.15]);
                    }
                    _ => {
                        sign(0.0, 0.1, [0.8, 0.04]);
                        sign(0.0, 0.0, [0.25, 0.07]);
                    }
                }
            });
        }
    }
}

pub(super) fn sphinx(mesh: &mut Mesh, piece: &Piece) {
    let stone = piece.finish(LIMESTONE);
    let scale = piece.width(2.4) / 2.4;
    mesh.posed(Affine3A::from_scale(Vec3::splat(scale)), |mesh| {
        mesh.block(&GRANITE, [0.0; 3], [1.1, 0.35, 2.7]);
        mesh.moved(v(0.0, 0.35, 0.0), |mesh| {
            let body = [
                (v(0.0, 0.3, -1.15), 0.2),
                (v(0.0, 0.36, -0.9), 0.34),
                (v(0.0, 0.36, -0.3), 0.32),
                (v(0.0, 0.42, 0.25), 0.33),
                (v(0.0, 0.58, 0.55), 0.3),
                (v(0.0, 0.8, 0.62), 0.2),
            ];
            mesh.tube(&stone, &curve(&body, 30), 28);
            for side in [-1.0, 1.0] {
                let paw = [
                    (v(side * 0.26, 0.22, 0.3), 0.17),
                    (v(side * 0.27, 0.14, 0.7), 0.12),
                    (v(side * 0.27, 0.11, 1.1), 0.11),
                    (v(side * 0.27, 0.1, 1.22), 0.12),
                ];
                mesh.tube(&stone, &curve(&paw, 16), 16);
                mesh.ellipsoid(&stone, v(side * 0.3, 0.26, -0.75), v(0.18, 0.27, 0.38), 20);
                let foot = [(v(side * 0.42, 0.1, -0.8), 0.11), (v(side * 0.42, 0.09, -0.35), 0.1)];
                mesh.tube(&stone, &foot, 14);
            }
            let tail = [
                (v(0.0, 0.35, -1.3), 0.05),
                (v(0.3, 0.12, -1.28), 0.05),
                (v(0.47, 0.1, -1.0), 0.045),
                (v(0.5, 0.2, -0.6), 0.06),
            ];
            mesh.tube(&stone, &curve(&tail, 14), 10);
            // Head-cloth, striped, and face.
            mesh.moved(v(0.0, 0.78, 0.62), |mesh| {
                let (blue, gold) = (Rgb::hex(0x35557a).linear(), Rgb::hex(0xc79a45).linear());
                mesh.coloured_grid(&PAINT, (40, 36, true), |a, b| {
                    let p = on_sphere(a, b);
                    let low = (-p.y).max(0.0);
                    let flare = 1.0 + 0.5 * low;
                    let stripe = ((b * 36.0) as i32) % 2 == 0;
                    (
                        v(p.x * 0.3 * flare, 0.28 + p.y * 0.36, p.z * 0.22 - 0.08),
                        Some(if stripe { blue } else { gold }),
                    )
                });
                mesh.grid(&stone, (28, 20, true), |a, b| {
                    let p = on_sphere(a, b);
                    let nose = 0.25 * (-(p.x * 6.0).powi(2) - ((p.y + 0.1) * 4.0).powi(2)).exp() * p.z.max(0.0);
                    v(p.x * 0.17, 0.26 + p.y * 0.24, 0.06 + p.z * (0.18 + nose * 0.25))
                });
                mesh.block(&GOLD, [0.0, -0.1, 0.2], [0.06, 0.16, 0.05]);
            });
        });
    });
}

pub(super) fn sarcophagus(mesh: &mut Mesh, piece: &Piece) {
    let gold = piece.finish(GOLD);
    mesh.block(&GRANITE, [0.0; 3], [1.1, 0.5, 2.5]);
    let bands = [
        Rgb::hex(0x1f3f66),
        Rgb::hex(0xc9992f),
        Rgb::hex(0xa0392b),
        Rgb::hex(0xc9992f),
        Rgb::hex(0x2d6b5a),
    ];
    // Half-width by distance from the feet.
    let outline = [
        (0.0, 0.2),
        (0.1, 0.25),
        (0.35, 0.24),
        (0.6, 0.3),
        (0.74, 0.4),
        (0.8, 0.36),
        (0.84, 0.22),
        (0.93, 0.23),
        (1.0, 0.1),
    ];
    let knots: Vec<_> = outline.iter().map(|&(t, w)| (v(w, t, 0.0), 1.0)).collect();
    let shape = curve(&knots, 60);
    mesh.posed(
        Affine3A::from_translation(v(0.0, 0.5, 1.1)) * Affine3A::from_rotation_x(-TAU / 4.0),
        |mesh| {
            mesh.coloured_grid(&PAINT.gloss(0.3), (32, 60, true), |a, b| {
                let p = shape[(b * 60.0).round() as usize].0;
                let (sin, cos) = (a * TAU).sin_cos();
                let close = (b * (1.0 - b) * 40.0).min(1.0).sqrt();
                let depth = if cos > 0.0 { 0.36 } else { 0.0 };
                (
                    v(p.x * sin * close, p.y * 2.2, depth * cos * close * (0.6 + p.x) + 0.02),
                    Some(bands[((b * 60.0) as usize / 3) % bands.len()].linear()),
                )
            });
            mesh.ellipsoid(&gold, v(0.0, 1.95, 0.28), v(0.15, 0.19, 0.13), 28);
            for side in [-1.0, 1.0] {
                let arm = [
                    (v(side * 0.34, 1.6, 0.22), 0.05),
                    (v(side * 0.2, 1.4, 0.34), 0.05),
                    (v(-side * 0.12, 1.5, 0.38), 0.045),
                ];
                mesh.tube(&gold, &curve(&arm, 14), 12);
            }
        },
    );
}

pub(super) fn canopic_jar(mesh: &mut Mesh, piece: &Piece) {
    let height = piece.height(0.45);
    let stone = piece.finish(LIMESTONE);
    mesh.posed(Affine3A::from_scale(Vec3::splat(height)), |mesh| {
        mesh.lathe(
            &stone,
            &[
                (0.0, 0.0),
                (0.18, 0.0),
                (0.2, 0.04),
                (0.27, 0.3),
                (0.3, 0.5),
                (0.27, 0.6),
                (0.2, 0.66),
                (0.2, 0.68),
            ],
            36,
        );
        mesh.lathe(&CLAY, &[(0.22, 0.66), (0.22, 0.7), (0.15, 0.72)], 30);
        mesh.ellipsoid(&stone, v(0.0, 0.84, 0.0), v(0.17, 0.18, 0.17), 26);
        mesh.tube(&stone, &[(v(0.0, 0.82, 0.12), 0.08), (v(0.0, 0.78, 0.27), 0.04)], 12);
        for side in [-1.0, 1.0] {
            mesh.tube(
                &stone,
                &[(v(side * 0.1, 0.95, 0.0), 0.05), (v(side * 0.13, 1.08, -0.01), 0.012)],
                10,
            );
        }
    });
}

pub(super) fn shield(mesh: &mut Mesh, piece: &Piece) {
    let field = piece.entry.colour.unwrap_or(Rgb::hex(0x7a1f26)).linear();
    let other = Rgb::hex(0xd8c48a).linear();
    let radius = piece.width(0.8) / 2.0;
    let up = Affine3A::from_translation(v(0.0, 1.9, 0.06)) * Affine3A::from_rotation_x(TAU / 4.0);
    mesh.posed(up, |mesh| {
        mesh.coloured_grid(&PAINT.gloss(0.5), (32, 8, true), |a, b| {
            let r = radius * (1.0 - b);
            let quarter = ((a * 4.0 + piece.entry.variant as f32 * 0.5) as usize).is_multiple_of(2);
            let (sin, cos) = (a * TAU).sin_cos();
            (
                v(r * sin, 0.16 * radius * (1.0 - (r / radius).powi(2)), r * cos),
                Some(if quarter { field } else { other }),
            )
        });
        let ring: Vec<_> = (0..=36)
            .map(|i| {
                let (sin, cos) = (TAU * i as f32 / 36.0).sin_cos();
                (v(radius * sin, 0.0, radius * cos), 0.03)
            })
            .collect();
        mesh.tube(&BRONZE, &ring, 8);
        mesh.ellipsoid(&BRONZE, v(0.0, 0.16 * radius, 0.0), v(0.1, 0.07, 0.1), 20);
        for turn in [0.6, -0.6] {
            mesh.posed(Affine3A::from_rotation_y(turn), |mesh| {
                mesh.tube(
                    &BRONZE,
                    &[
                        (v(0.0, -0.03, -radius * 1.5), 0.015),
                        (v(0.0, -0.03, radius * 1.5), 0.015),
                    ],
                    8,
                );
            });
        }
    });
}
