//! Turned things: vases, bowls, glass, the fountain and the globe.

use super::Piece;
use crate::import::plan::finish::{
    BRONZE, CLAY, Finish, GOLD, GRANITE, IRON, LIMESTONE, MARBLE, PAINT, Rgb, WALNUT, WATER,
};
use crate::import::plan::mesh::{Mesh, curve, on_sphere};
use crate::import::plan::rng::{Rng, noise};
use glam::{Affine3A, Vec3};
use std::f32::consts::TAU;

/// A smooth profile through (radius, height) knots given as fractions, scaled.
fn profile(knots: &[(f32, f32)], width: f32, height: f32, count: usize) -> Vec<(f32, f32)> {
    let knots: Vec<_> = knots
        .iter()
        .map(|&(r, y)| (Vec3::new(r * width, y * height, 0.0), 1.0))
        .collect();
    curve(&knots, count)
        .into_iter()
        .map(|(p, _)| (p.x.max(0.0), p.y))
        .collect()
}

/// Profiles of vases; the last points turn into the mouth.
const VASES: [&[(f32, f32)]; 5] = [
    &[
        (0.0, 0.0),
        (0.2, 0.0),
        (0.24, 0.03),
        (0.42, 0.3),
        (0.5, 0.55),
        (0.36, 0.78),
        (0.17, 0.88),
        (0.2, 1.0),
        (0.16, 0.98),
        (0.12, 0.86),
        (0.0, 0.8),
    ],
    &[
        (0.0, 0.0),
        (0.28, 0.0),
        (0.3, 0.04),
        (0.2, 0.1),
        (0.34, 0.3),
        (0.5, 0.48),
        (0.48, 0.62),
        (0.2, 0.74),
        (0.13, 0.9),
        (0.22, 1.0),
        (0.18, 0.98),
        (0.08, 0.86),
        (0.0, 0.8),
    ],
    &[
        (0.0, 0.0),
        (0.3, 0.0),
        (0.42, 0.12),
        (0.5, 0.3),
        (0.46, 0.46),
        (0.24, 0.58),
        (0.12, 0.68),
        (0.1, 0.92),
        (0.15, 1.0),
        (0.11, 0.98),
        (0.06, 0.9),
        (0.0, 0.8),
    ],
    &[
        (0.0, 0.0),
        (0.22, 0.0),
        (0.26, 0.05),
        (0.3, 0.4),
        (0.4, 0.8),
        (0.5, 1.0),
        (0.46, 0.99),
        (0.35, 0.78),
        (0.25, 0.4),
        (0.0, 0.2),
    ],
    &[
        (0.0, 0.0),
        (0.34, 0.0),
        (0.48, 0.2),
        (0.5, 0.4),
        (0.36, 0.58),
        (0.4, 0.7),
        (0.3, 0.84),
        (0.2, 0.9),
        (0.26, 1.0),
        (0.2, 0.98),
        (0.15, 0.88),
        (0.0, 0.8),
    ],
];

pub(super) fn vase(mesh: &mut Mesh, piece: &Piece) {
    let height = piece.height(0.7);
    let shape = VASES[piece.entry.variant as usize % VASES.len()];
    let outline = profile(shape, height * 0.75, height, 44);
    let glaze = piece.finish(Finish::matt("glaze", 0x2f6f86).gloss(0.2));
    let lobes = [0.0, 0.0, 0.03, 0.05][piece.entry.variant as usize / VASES.len() % 4];
    mesh.fluted_lathe(&glaze, &outline, 40, |angle, y| {
        1.0 + lobes * (angle * 10.0 + y * 6.0).sin()
    });
}

pub(super) fn amphora(mesh: &mut Mesh, piece: &Piece) {
    let height = piece.height(0.8);
    let clay = piece.finish(CLAY);
    let dark = Finish::matt("black figure", 0x231a17).gloss(0.4);
    let knots = [
        (0.0, 0.0),
        (0.16, 0.0),
        (0.2, 0.04),
        (0.12, 0.1),
        (0.32, 0.3),
        (0.46, 0.52),
        (0.44, 0.66),
        (0.2, 0.8),
        (0.16, 0.92),
        (0.24, 1.0),
        (0.2, 0.99),
        (0.12, 0.9),
        (0.0, 0.85),
    ];
    let outline = profile(&knots, height * 0.7, height, 52);
    for (i, band) in outline.windows(2).enumerate() {
        let figured = matches!(i, 8..=9 | 16..=17 | 22..=24 | 30..=33 | 38..=60);
        mesh.lathe(if figured { &dark } else { &clay }, band, 36);
    }
    for side in [-1.0, 1.0] {
        let knots = [(0.11, 0.92), (0.26, 0.95), (0.32, 0.84), (0.27, 0.7)];
        let path: Vec<_> = knots
            .iter()
            .map(|&(x, y)| (Vec3::new(side * x * height, y * height, 0.0), 0.02 * height))
            .collect();
        mesh.tube(&dark, &curve(&path, 14), 8);
    }
}

pub(super) fn bowl(mesh: &mut Mesh, piece: &Piece) {
    let height = piece.height(0.25);
    let knots = [
        (0.0, 0.0),
        (0.3, 0.0),
        (0.28, 0.1),
        (0.6, 0.4),
        (0.9, 0.9),
        (1.0, 1.0),
        (0.94, 0.99),
        (0.8, 0.75),
        (0.4, 0.3),
        (0.0, 0.22),
    ];
    mesh.lathe(&piece.finish(GOLD), &profile(&knots, height * 1.1, height, 36), 44);
}

pub(super) fn urn(mesh: &mut Mesh, piece: &Piece) {
    let height = piece.height(1.3);
    let stone = piece.finish(MARBLE);
    let knots = [
        (0.0, 0.0),
        (0.3, 0.0),
        (0.3, 0.06),
        (0.12, 0.12),
        (0.1, 0.22),
        (0.34, 0.34),
        (0.42, 0.6),
        (0.36, 0.72),
        (0.4, 0.8),
        (0.5, 0.84),
        (0.42, 0.86),
        (0.2, 0.92),
        (0.06, 0.95),
        (0.07, 0.98),
        (0.0, 1.0),
    ];
    let outline = profile(&knots, height * 0.62, height, 56);
    mesh.fluted_lathe(&stone, &outline, 48, |angle, y| {
        let belly = (1.0 - ((y / height - 0.48) / 0.16).powi(2)).max(0.0);
        1.0 + 0.05 * belly * (angle * 12.0).cos()
    });
    for side in [-1.0, 1.0] {
        let knots = [(0.22, 0.72), (0.36, 0.76), (0.36, 0.6), (0.25, 0.5)];
        let path: Vec<_> = knots
            .iter()
            .map(|&(x, y)| (Vec3::new(side * x * height, y * height, 0.0), 0.022 * height))
            .collect();
        mesh.tube(&stone, &curve(&path, 14), 8);
    }
}

pub(super) fn glass_vessel(mesh: &mut Mesh, piece: &Piece) {
    let height = piece.height(0.5);
    let shape = VASES[(piece.entry.variant as usize + 2) % VASES.len()];
    let outline = profile(shape, height * 0.6, height, 40);
    let glass = piece.finish(Finish::matt("coloured glass", 0x3aa0c8)).glass(0.55);
    let twist = 2.0 + piece.entry.variant as f32;
    mesh.fluted_lathe(&glass, &outline, 40, |angle, y| {
        1.0 + 0.06 * (angle * 6.0 + y / height * twist).sin()
    });
}

pub(super) fn fountain(mesh: &mut Mesh, piece: &Piece) {
    let radius = piece.width(3.2) / 2.0;
    let stone = piece.finish(LIMESTONE);
    let (rim, r) = (0.5, radius);
    mesh.lathe(
        &stone,
        &[
            (r, 0.0),
            (r, 0.08),
            (r - 0.06, 0.12),
            (r - 0.06, rim - 0.1),
            (r + 0.04, rim - 0.06),
            (r + 0.04, rim),
            (r - 0.22, rim),
            (r - 0.22, 0.1),
        ],
        56,
    );
    mesh.lathe(&GRANITE, &[(r - 0.2, 0.12), (0.0, 0.12)], 40);
    mesh.lathe(&WATER, &[(r - 0.2, rim - 0.12), (0.0, rim - 0.12)], 40);
    let stem = [
        (0.32, 0.12),
        (0.3, 0.3),
        (0.14, 0.5),
        (0.12, 0.9),
        (0.2, 1.0),
        (0.3, 1.04),
        (0.8, 1.24),
        (0.86, 1.3),
        (0.8, 1.29),
        (0.3, 1.12),
        (0.12, 1.12),
        (0.08, 1.5),
        (0.16, 1.62),
        (0.44, 1.74),
        (0.46, 1.78),
        (0.4, 1.76),
        (0.1, 1.68),
        (0.07, 1.68),
        (0.05, 1.9),
        (0.1, 1.98),
        (0.09, 2.08),
        (0.0, 2.16),
    ];
    let scale = radius / 1.6;
    let stem: Vec<_> = stem.iter().map(|&(r, y)| (r * scale, y * scale.min(1.2))).collect();
    mesh.fluted_lathe(&stone, &stem, 48, |angle, y| {
        1.0 + if y > 1.0 { 0.03 * (angle * 16.0).cos() } else { 0.0 }
    });
    mesh.lathe(
        &WATER,
        &[(0.7 * scale, 1.24 * scale.min(1.2)), (0.1, 1.24 * scale.min(1.2))],
        32,
    );
}

pub(super) fn globe(mesh: &mut Mesh, piece: &Piece) {
    let radius = piece.width(0.9) / 2.0;
    let middle = Vec3::Y * (0.55 + radius);
    for i in 0..4 {
        mesh.posed(Affine3A::from_rotation_y(TAU * i as f32 / 4.0), |mesh| {
            let path = [(0.12, 0.25), (0.3, 0.12), (0.42, 0.0)];
            let knots: Vec<_> = path.iter().map(|&(r, y)| (Vec3::new(r, y + 0.03, 0.0), 0.03)).collect();
            mesh.tube(&WALNUT, &curve(&knots, 8), 8);
        });
    }
    mesh.lathe(
        &WALNUT,
        &[(0.05, 0.2), (0.13, 0.25), (0.06, 0.34), (0.1, 0.44), (0.05, 0.55)],
        18,
    );
    let ring: Vec<_> = (0..=32)
        .map(|i| {
            let (sin, cos) = (TAU * i as f32 / 32.0).sin_cos();
            (middle + Vec3::new(sin, cos, 0.0) * (radius + 0.05), 0.016)
        })
        .collect();
    mesh.tube(&BRONZE, &ring, 8);
    let (sea, land, snow) = (
        Rgb::hex(0x5c8ba0).linear(),
        Rgb::hex(0xb59a5a).linear(),
        Rgb::hex(0xeee6d2).linear(),
    );
    mesh.coloured_grid(&PAINT.gloss(0.35), (64, 32, true), |u, v| {
        let p = on_sphere(u, v);
        let height = noise(p * 2.1, 5) + 0.5 * noise(p * 4.3, 6) + 0.25 * noise(p * 9.0, 7);
        let colour = if p.y.abs() > 0.93 {
            snow
        } else if height > 0.08 {
            land.map(|c| c * (1.0 - 0.5 * (height - 0.1).min(0.6)))
        } else {
            sea
        };
        (middle + p * radius, Some(colour))
    });
    mesh.tube(
        &IRON,
        &[
            (middle - Vec3::Y * (radius + 0.06), 0.012),
            (middle + Vec3::Y * (radius + 0.06), 0.012),
        ],
        6,
    );
    let mut rng = Rng::new(1);
    mesh.posed(
        Affine3A::from_translation(middle) * Affine3A::from_rotation_x(rng.range(0.1, 0.3)),
        |mesh| {
            mesh.lathe(
                &BRONZE,
                &[
                    (radius + 0.07, -0.012),
                    (radius + 0.07, 0.012),
                    (radius + 0.02, 0.012),
                    (radius + 0.02, -0.012),
                    (radius + 0.07, -0.012),
                ],
                40,
            );
        },
    );
}
