//! Carved and cast figures: robed statues, busts, suits of armour.

use super::Piece;
use crate::import::plan::finish::{Finish, GRANITE, IRON, LIMESTONE, MARBLE, STEEL};
use crate::import::plan::mesh::{Mesh, curve};
use crate::import::plan::rng::noise;
use glam::{Affine3A, Vec3};
use std::f32::consts::TAU;

fn v(x: f32, y: f32, z: f32) -> Vec3 {
    Vec3::new(x, y, z)
}

/// A head with brow, nose and hair, its chin at the origin, `size` from chin to crown.
fn head(mesh: &mut Mesh, stone: &Finish, size: f32, seed: u64) {
    mesh.grid(stone, (36, 24, true), |a, b| {
        let p = crate::import::plan::mesh::on_sphere(a, b);
        let face = p.z.max(0.0);
        let nose = 0.2 * (-(p.x * 7.0).powi(2) - ((p.y + 0.12) * 4.5).powi(2)).exp() * face;
        let brow = 0.06 * (-((p.y - 0.18) * 8.0).powi(2)).exp() * face;
        let eyes = -0.07 * (-((p.x.abs() - 0.32) * 7.0).powi(2) - ((p.y - 0.05) * 8.0).powi(2)).exp() * face;
        let jaw = if p.y < -0.2 { 1.0 + (p.y + 0.2) * 0.28 } else { 1.0 };
        let is_hair = (p.y - 0.55 * p.z - 0.12).max(0.0).min(0.25) * 4.0;
        let hair = is_hair * (0.07 + 0.06 * noise(p * 6.0, seed));
        let r = 1.0 + nose + brow + eyes + hair;
        v(
            p.x * 0.37 * jaw * r,
            0.5 + p.y * 0.52 * (1.0 + hair),
            p.z * 0.44 * jaw * r,
        ) * size
    });
}

pub(super) fn statue(mesh: &mut Mesh, piece: &Piece) {
    let stone = piece.finish(MARBLE);
    let height = piece.height(2.0);
    mesh.block(&GRANITE, [0.0; 3], [0.95, 0.5, 0.95]);
    mesh.block(&GRANITE, [0.0, 0.5, 0.0], [0.8, 0.06, 0.8]);
    let seed = piece.seed;
    let sway = if seed.is_multiple_of(2) { 1.0 } else { -1.0 };
    mesh.posed(
        Affine3A::from_scale_rotation_translation(Vec3::splat(height), Default::default(), v(0.0, 0.56, 0.0)),
        |mesh| {
            // Robe and torso: an oval whose folds fade towards the shoulders; half-widths and half-depths by height.
            let outline = [
                (0.0, 0.17, 0.15),
                (0.03, 0.175, 0.155),
                (0.25, 0.145, 0.12),
                (0.45, 0.13, 0.105),
                (0.56, 0.1, 0.08),
                (0.7, 0.125, 0.09),
                (0.78, 0.12, 0.075),
                (0.82, 0.06, 0.05),
                (0.86, 0.035, 0.035),
            ];
            let knots: Vec<_> = outline.iter().map(|&(y, w, d)| (v(w, y, d), 1.0)).collect();
            let shape = curve(&knots, 48);
            mesh.grid(&stone, (48, 48, true), |a, b| {
                let p = shape[(b * 48.0).round() as usize].0;
                let angle = a * TAU;
                let fall = (1.0 - p.y / 0.8).clamp(0.0, 1.0);
                let fold = 1.0
                    + 0.085 * fall * (angle * 11.0 + 2.2 * (p.y * 5.0 + seed as f32).sin()).sin()
                    + 0.04 * fall * (angle * 5.0 - p.y * 9.0).sin();
                let lean = sway * 0.025 * (p.y * 6.0).sin();
                v(p.x * angle.sin() * fold + lean, p.y, p.z * angle.cos() * fold)
            });
            let arm = |mesh: &mut Mesh, points: [(f32, f32, f32); 4]| {
                let radii = [0.04, 0.034, 0.028, 0.02];
                let knots: Vec<_> = points
                    .iter()
                    .zip(radii)
                    .map(|(&(x, y, z), r)| (v(x, y, z), r))
                    .collect();
                mesh.tube(&stone, &curve(&knots, 20), 14);
                mesh.ellipsoid(&stone, knots[3].0, v(0.024, 0.034, 0.022), 12);
            };
            match seed % 3 {
                0 => {
                    arm(
                        mesh,
                        [
                            (0.115, 0.77, 0.0),
                            (0.17, 0.66, 0.03),
                            (0.19, 0.55, 0.09),
                            (0.16, 0.57, 0.2),
                        ],
                    );
                    arm(
                        mesh,
                        [
                            (-0.115, 0.77, 0.0),
                            (-0.17, 0.66, 0.0),
                            (-0.17, 0.54, 0.03),
                            (-0.13, 0.45, 0.08),
                        ],
                    );
                }
                1 => {
                    arm(
                        mesh,
                        [
                            (0.115, 0.77, 0.0),
                            (0.2, 0.8, 0.02),
                            (0.24, 0.92, 0.04),
                            (0.22, 1.06, 0.06),
                        ],
                    );
                    arm(
                        mesh,
                        [
                            (-0.115, 0.77, 0.0),
                            (-0.18, 0.67, 0.0),
                            (-0.15, 0.58, 0.08),
                            (-0.05, 0.6, 0.12),
                        ],
                    );
                }
                _ => {
                    arm(
                        mesh,
                        [
                            (0.115, 0.77, 0.0),
                            (0.17, 0.67, 0.02),
                            (0.13, 0.6, 0.1),
                            (0.03, 0.64, 0.12),
                        ],
                    );
                    arm(
                        mesh,
                        [
                            (-0.115, 0.77, 0.0),
                            (-0.17, 0.67, 0.02),
                            (-0.13, 0.58, 0.1),
                            (-0.02, 0.61, 0.13),
                        ],
                    );
                }
            }
            mesh.moved(v(sway * -0.015, 0.855, 0.012), |mesh| head(mesh, &stone, 0.145, seed));
        },
    );
}

pub(super) fn bust(mesh: &mut Mesh, piece: &Piece) {
    let stone = piece.finish(LIMESTONE);
    let height = piece.height(0.7);
    mesh.posed(Affine3A::from_scale(Vec3::splat(height)), |mesh| {
        mesh.lathe(
            &stone,
            &[(0.17, 0.0), (0.17, 0.04), (0.1, 0.07), (0.08, 0.13), (0.12, 0.18)],
            28,
        );
        let outline = [
            (0.16, 0.1, 0.09),
            (0.24, 0.24, 0.15),
            (0.34, 0.33, 0.17),
            (0.42, 0.34, 0.16),
            (0.48, 0.22, 0.13),
            (0.52, 0.11, 0.11),
            (0.62, 0.1, 0.1),
        ];
        let knots: Vec<_> = outline.iter().map(|&(y, w, d)| (v(w, y, d), 1.0)).collect();
        let shape = curve(&knots, 24);
        mesh.grid(&stone, (40, 24, true), |a, b| {
            let p = shape[(b * 24.0).round() as usize].0;
            let angle = a * TAU;
            let fold = 1.0 + 0.03 * (angle * 9.0 + p.y * 14.0).sin() * (1.0 - b);
            v(p.x * angle.sin() * fold, p.y, p.z * angle.cos() * fold)
        });
        mesh.moved(v(0.0, 0.57, 0.02), |mesh| head(mesh, &stone, 0.42, piece.seed));
    });
}

pub(super) fn armour(mesh: &mut Mesh, piece: &Piece) {
    const LEATHERN: Finish = Finish::matt("straps", 0x3a2418);
    let steel = piece.finish(STEEL);
    mesh.lathe(&LEATHERN, &[(0.45, 0.0), (0.45, 0.1), (0.42, 0.12), (0.0, 0.12)], 32);
    mesh.moved(v(0.0, 0.12, 0.0), |mesh| {
        for side in [-1.0, 1.0] {
            let x = side * 0.11;
            let leg = [
                (v(x, 0.08, 0.0), 0.055),
                (v(x, 0.3, -0.015), 0.075),
                (v(x, 0.48, 0.0), 0.06),
                (v(x * 0.95, 0.7, 0.0), 0.085),
                (v(x * 0.85, 0.9, 0.0), 0.1),
            ];
            mesh.tube(&steel, &curve(&leg, 24), 18);
            mesh.ellipsoid(&steel, v(x, 0.49, 0.045), v(0.07, 0.075, 0.05), 16);
            mesh.ellipsoid(&steel, v(x, 0.05, 0.06), v(0.055, 0.055, 0.15), 16);
            let arm = [
                (v(side * 0.24, 1.42, 0.0), 0.07),
                (v(side * 0.31, 1.22, 0.0), 0.055),
                (v(side * 0.33, 1.08, 0.02), 0.05),
                (v(side * 0.3, 0.9, 0.1), 0.045),
            ];
            mesh.tube(&steel, &curve(&arm, 20), 16);
            mesh.ellipsoid(&steel, v(side * 0.26, 1.44, 0.0), v(0.12, 0.09, 0.12), 18);
            mesh.ellipsoid(&steel, v(side * 0.33, 1.1, 0.0), v(0.065, 0.07, 0.065), 14);
            mesh.ellipsoid(&steel, v(side * 0.29, 0.86, 0.12), v(0.05, 0.06, 0.05), 14);
        }
        let body = [
            (0.86, 0.2, 0.15),
            (0.98, 0.19, 0.14),
            (1.08, 0.15, 0.12),
            (1.14, 0.16, 0.13),
            (1.3, 0.22, 0.17),
            (1.42, 0.21, 0.15),
            (1.5, 0.1, 0.09),
            (1.55, 0.075, 0.075),
        ];
        let knots: Vec<_> = body.iter().map(|&(y, w, d)| (v(w, y, d), 1.0)).collect();
        let shape = curve(&knots, 36);
        mesh.grid(&steel, (36, 36, true), |a, b| {
            let p = shape[(b * 36.0).round() as usize].0;
            let angle = a * TAU;
            let ridge = 1.0 + 0.1 * (1.0 - angle.sin().abs()).powi(4) * angle.cos().max(0.0);
            let plates = if p.y < 1.05 {
                1.0 + 0.03 * ((p.y * 70.0).sin())
            } else {
                1.0
            };
            v(p.x * angle.sin() * plates, p.y, p.z * angle.cos() * ridge * plates)
        });
        mesh.moved(v(0.0, 1.52, 0.0), |mesh| {
            mesh.grid(&steel, (32, 20, true), |a, b| {
                let p = crate::import::plan::mesh::on_sphere(a, b);
                let visor = 0.22 * (-((p.y + 0.15) * 3.0).powi(2)).exp() * p.z.max(0.0).powi(3);
                let comb = 0.12 * (-(p.x * 9.0).powi(2)).exp() * p.y.max(0.0);
                v(
                    p.x * 0.115,
                    0.15 + p.y * 0.16 * (1.0 + comb),
                    p.z * 0.135 * (1.0 + visor + comb),
                )
            });
            mesh.block(&IRON, [0.0, 0.165, 0.128], [0.14, 0.012, 0.03]);
            let plume = [
                (v(0.0, 0.3, -0.04), 0.03),
                (v(0.0, 0.42, -0.1), 0.06),
                (v(0.0, 0.38, -0.22), 0.05),
                (v(0.0, 0.22, -0.27), 0.02),
            ];
            const PLUME: Finish = Finish::matt("plume", 0x9c2430);
            mesh.tube(&PLUME.dyed(piece.entry.colour), &curve(&plume, 14), 12);
        });
        mesh.tube(
            &LEATHERN,
            &[(v(0.36, 0.0, 0.16), 0.018), (v(0.32, 2.1, 0.13), 0.016)],
            10,
        );
        mesh.tube(
            &steel,
            &[
                (v(0.32, 2.08, 0.13), 0.02),
                (v(0.318, 2.16, 0.13), 0.045),
                (v(0.315, 2.4, 0.13), 0.004),
            ],
            8,
        );
    });
}
