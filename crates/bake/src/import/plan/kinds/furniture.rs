//! Seats, tables, shelves, lamps and show cases.

use super::Piece;
use crate::import::plan::finish::{
    BRONZE, CLOTH, Finish, GLASS, GOLD, IRON, LAMPLIGHT, LEATHER, LINEN, MARBLE, OAK, PAINT, Rgb, WALNUT,
};
use crate::import::plan::mesh::Mesh;
use crate::import::plan::rng::Rng;
use glam::{Affine3A, Vec3};
use std::f32::consts::TAU;

fn v(x: f32, y: f32, z: f32) -> Vec3 {
    Vec3::new(x, y, z)
}

/// Four legs under a rectangle.
fn legs(mesh: &mut Mesh, finish: &Finish, [width, depth]: [f32; 2], height: f32, thick: f32) {
    for x in [-1.0, 1.0] {
        for z in [-1.0, 1.0] {
            let foot = [x * (width - thick) / 2.0, 0.0, z * (depth - thick) / 2.0];
            mesh.block(finish, foot, [thick, height, thick]);
        }
    }
}

/// A cushion: a box with a rounded, slightly swollen surface.
fn cushion(mesh: &mut Mesh, finish: &Finish, middle: Vec3, half: Vec3) {
    mesh.grid(finish, (20, 10, true), |u, v| {
        let p = crate::import::plan::mesh::on_sphere(u, v);
        let square = |c: f32| c.signum() * c.abs().powf(0.3);
        middle + half * Vec3::new(square(p.x), square(p.y), square(p.z))
    });
}

pub(super) fn marker(mesh: &mut Mesh, piece: &Piece) {
    let (height, width) = (piece.height(1.2), piece.width(0.4));
    mesh.block(&piece.finish(CLAYISH), [0.0; 3], [width, height, width]);
}

const CLAYISH: Finish = Finish::matt("marker", 0xc8553d);

pub(super) fn bench(mesh: &mut Mesh, piece: &Piece) {
    let width = piece.width(1.8);
    let wood = piece.finish(OAK);
    let slats = 5;
    for i in 0..slats {
        let z = (i as f32 - (slats - 1) as f32 / 2.0) * 0.1;
        mesh.block(&wood, [0.0, 0.42, z], [width, 0.045, 0.085]);
    }
    for x in [-0.38, 0.38] {
        mesh.block(&IRON, [x * width, 0.0, 0.0], [0.06, 0.42, 0.46]);
        mesh.block(&IRON, [x * width, 0.0, 0.0], [0.12, 0.03, 0.5]);
    }
}

pub(super) fn sofa(mesh: &mut Mesh, piece: &Piece) {
    let width = piece.width(2.0);
    let cloth = piece.finish(LEATHER);
    let seats = (width / 0.7).round().max(1.0) as usize;
    legs(mesh, &WALNUT, [width - 0.1, 0.8], 0.14, 0.06);
    mesh.block(&cloth, [0.0, 0.14, 0.0], [width, 0.18, 0.86]);
    let inner = (width - 0.36) / seats as f32;
    for i in 0..seats {
        let x = (i as f32 - (seats - 1) as f32 / 2.0) * inner;
        cushion(mesh, &cloth, v(x, 0.4, 0.08), v(inner / 2.0, 0.1, 0.36));
        cushion(mesh, &cloth, v(x, 0.66, -0.26), v(inner / 2.0, 0.22, 0.12));
    }
    cushion(mesh, &cloth, v(0.0, 0.56, -0.37), v(width / 2.0, 0.3, 0.09));
    for x in [-1.0, 1.0] {
        cushion(mesh, &cloth, v(x * (width / 2.0 - 0.09), 0.42, 0.0), v(0.1, 0.22, 0.43));
    }
}

pub(super) fn chair(mesh: &mut Mesh, piece: &Piece) {
    let wood = piece.finish(OAK);
    legs(mesh, &wood, [0.44, 0.44], 0.44, 0.04);
    cushion(mesh, &LEATHER, v(0.0, 0.46, 0.0), v(0.23, 0.035, 0.23));
    for x in [-0.2, 0.2] {
        mesh.tube(
            &wood,
            &[
                (v(x, 0.42, -0.2), 0.02),
                (v(x, 0.7, -0.22), 0.02),
                (v(x, 0.95, -0.27), 0.018),
            ],
            8,
        );
    }
    for (y, z) in [(0.66, -0.22), (0.78, -0.235), (0.9, -0.26)] {
        mesh.block(&wood, [0.0, y, z], [0.4, 0.06, 0.022]);
    }
}

pub(super) fn table(mesh: &mut Mesh, piece: &Piece) {
    let width = piece.width(2.2);
    let wood = piece.finish(WALNUT);
    legs(mesh, &wood, [width - 0.1, 0.9], 0.7, 0.08);
    mesh.block(&wood, [0.0, 0.62, 0.0], [width - 0.14, 0.1, 0.86]);
    mesh.block(&wood, [0.0, 0.72, 0.0], [width, 0.04, 1.0]);
    let chairs = (width / 0.75) as usize;
    for i in 0..chairs {
        let x = (i as f32 - (chairs as f32 - 1.0) / 2.0) * 0.75;
        for (z, turn) in [(0.62, TAU / 2.0), (-0.62, 0.0)] {
            let pose = Affine3A::from_translation(v(x, 0.0, z)) * Affine3A::from_rotation_y(turn);
            mesh.posed(pose, |mesh| chair(mesh, piece));
        }
    }
    for x in [-width / 4.0, width / 4.0] {
        mesh.moved(v(x, 0.76, 0.0), reading_lamp);
    }
    let mut rng = Rng::new(piece.seed);
    for i in 0..6 {
        let x = (i as f32 - 2.5) * width / 6.5;
        let pose = Affine3A::from_translation(v(x, 0.76, rng.range(-0.3, 0.3)))
            * Affine3A::from_rotation_y(rng.range(-0.5, 0.5));
        let colour = BOOK_COLOURS[rng.below(BOOK_COLOURS.len())].linear();
        mesh.posed(pose, |mesh| book(mesh, colour, [0.2, 0.035, 0.28]));
    }
}

const BOOK_COLOURS: [Rgb; 9] = [
    Rgb::hex(0x6b2a22),
    Rgb::hex(0x2f4a3a),
    Rgb::hex(0x24364f),
    Rgb::hex(0x8a6a35),
    Rgb::hex(0x4a2d4f),
    Rgb::hex(0xb09a72),
    Rgb::hex(0x3b3630),
    Rgb::hex(0x7d4428),
    Rgb::hex(0x56707a),
];

fn book(mesh: &mut Mesh, colour: [f32; 3], size: [f32; 3]) {
    mesh.tint(Some(colour));
    mesh.block(&PAINT, [0.0; 3], size);
    mesh.tint(None);
}

fn reading_lamp(mesh: &mut Mesh) {
    mesh.lathe(
        &BRONZE,
        &[(0.1, 0.0), (0.1, 0.02), (0.02, 0.03), (0.015, 0.34), (0.0, 0.35)],
        16,
    );
    mesh.lathe(&LAMPLIGHT, &[(0.0, 0.29), (0.13, 0.29)].map(|(r, y)| (r, y)), 16);
    const SHADE: Finish = Finish::matt("lamp shade", 0x1f5a41).gloss(0.3);
    mesh.lathe(&SHADE, &[(0.15, 0.3), (0.14, 0.36), (0.09, 0.42), (0.0, 0.44)], 16);
}

pub(super) fn cafe_table(mesh: &mut Mesh, piece: &Piece) {
    let top = piece.finish(MARBLE);
    mesh.lathe(
        &IRON,
        &[
            (0.28, 0.0),
            (0.28, 0.02),
            (0.05, 0.06),
            (0.03, 0.1),
            (0.03, 0.68),
            (0.1, 0.71),
        ],
        20,
    );
    mesh.lathe(
        &top,
        &[
            (0.0, 0.71),
            (0.42, 0.71),
            (0.43, 0.72),
            (0.43, 0.74),
            (0.42, 0.75),
            (0.0, 0.75),
        ],
        32,
    );
    for i in 0..3 {
        let angle = TAU * (i as f32 + 0.25) / 3.0;
        let place = Affine3A::from_rotation_y(angle) * Affine3A::from_translation(v(0.0, 0.0, -0.68));
        mesh.posed(place, |mesh| chair(mesh, piece));
        let cup = Affine3A::from_rotation_y(angle) * Affine3A::from_translation(v(0.0, 0.75, -0.26));
        mesh.posed(cup, |mesh| {
            mesh.lathe(
                &LINEN,
                &[
                    (0.07, 0.0),
                    (0.075, 0.012),
                    (0.03, 0.01),
                    (0.036, 0.05),
                    (0.042, 0.07),
                    (0.036, 0.065),
                    (0.0, 0.02),
                ],
                14,
            );
        });
    }
}

pub(super) fn counter(mesh: &mut Mesh, piece: &Piece) {
    let width = piece.width(3.0);
    let wood = piece.finish(WALNUT);
    mesh.block(&wood, [0.0, 0.08, 0.0], [width - 0.1, 0.9, 0.6]);
    mesh.block(&IRON, [0.0, 0.0, 0.0], [width - 0.2, 0.08, 0.52]);
    mesh.block(&MARBLE, [0.0, 0.98, 0.0], [width, 0.04, 0.7]);
    let panels = (width / 0.6) as usize;
    for i in 0..panels {
        let x = (i as f32 - (panels as f32 - 1.0) / 2.0) * 0.58;
        mesh.block(&OAK, [x, 0.2, 0.305], [0.46, 0.64, 0.02]);
    }
    mesh.moved(v(-width * 0.3, 1.02, 0.0), |mesh| {
        mesh.block(&BRONZE, [0.0; 3], [0.55, 0.42, 0.4]);
        mesh.lathe(&BRONZE, &[(0.16, 0.42), (0.16, 0.5), (0.08, 0.56), (0.0, 0.58)], 20);
    });
    for i in 0..4 {
        mesh.moved(v(width * (0.05 + 0.1 * i as f32), 1.02, 0.05), |mesh| {
            mesh.lathe(
                &LINEN,
                &[(0.05, 0.0), (0.14, 0.03), (0.15, 0.04), (0.1, 0.025), (0.0, 0.02)],
                18,
            );
        });
    }
}

pub(super) fn desk(mesh: &mut Mesh, piece: &Piece) {
    let width = piece.width(1.6);
    let wood = piece.finish(WALNUT);
    mesh.block(&wood, [0.0, 0.74, 0.0], [width, 0.04, 0.8]);
    for x in [-1.0, 1.0] {
        mesh.block(&wood, [x * (width / 2.0 - 0.24), 0.06, 0.0], [0.42, 0.68, 0.72]);
        for i in 0..3 {
            mesh.block(
                &OAK,
                [x * (width / 2.0 - 0.24), 0.1 + i as f32 * 0.21, 0.365],
                [0.36, 0.18, 0.015],
            );
            mesh.ellipsoid(
                &BRONZE,
                v(x * (width / 2.0 - 0.24), 0.19 + i as f32 * 0.21, 0.385),
                Vec3::splat(0.016),
                8,
            );
        }
    }
    mesh.moved(v(-width * 0.33, 0.78, 0.1), reading_lamp);
    let mut rng = Rng::new(3);
    for i in 0..4 {
        let colour = BOOK_COLOURS[rng.below(BOOK_COLOURS.len())].linear();
        mesh.moved(v(width * 0.3, 0.78 + 0.04 * i as f32, 0.0), |mesh| {
            book(mesh, colour, [0.22, 0.04, 0.3])
        });
    }
    mesh.moved(v(0.0, 0.0, -0.65), |mesh| chair(mesh, piece));
}

pub(super) fn bookshelf(mesh: &mut Mesh, piece: &Piece) {
    let (width, height) = (piece.width(1.5), piece.height(2.6));
    let wood = piece.finish(WALNUT);
    let depth = 0.34;
    for x in [-1.0, 1.0] {
        mesh.block(&wood, [x * (width - 0.05) / 2.0, 0.0, 0.0], [0.05, height, depth]);
    }
    mesh.block(&wood, [0.0, 0.0, -depth / 2.0 + 0.01], [width - 0.1, height, 0.02]);
    mesh.block(&wood, [0.0, height, 0.0], [width + 0.1, 0.08, depth + 0.06]);
    let levels = ((height - 0.1) / 0.38) as usize;
    let pitch = (height - 0.1) / levels as f32;
    let mut rng = Rng::new(piece.seed + 11);
    for level in 0..levels {
        let y = 0.08 + level as f32 * pitch;
        mesh.block(&wood, [0.0, y - 0.03, 0.01], [width - 0.1, 0.03, depth - 0.02]);
        let mut x = -width / 2.0 + 0.06;
        while x < width / 2.0 - 0.12 {
            let thick = rng.range(0.035, 0.075);
            let (tall, deep) = (pitch * rng.range(0.6, 0.86), rng.range(0.2, 0.27));
            let colour = BOOK_COLOURS[rng.below(BOOK_COLOURS.len())].linear();
            if rng.unit() > 0.08 {
                let place = v(x + thick / 2.0, y, 0.13 - deep / 2.0);
                mesh.moved(place, |mesh| book(mesh, colour, [thick * 0.95, tall, deep]));
            }
            x += thick;
        }
    }
}

pub(super) fn rug(mesh: &mut Mesh, piece: &Piece) {
    let (width, length) = (piece.width(2.4), piece.height(3.6));
    let base = piece.entry.colour.unwrap_or(Rgb::hex(0x7c2328)).linear();
    let cream = Rgb::hex(0xd9c79c).linear();
    let dark = base.map(|c| c * 0.35);
    let bands = [(0.0, cream), (0.06, base), (0.12, dark), (0.3, cream), (0.34, base)];
    for (i, (inset, colour)) in bands.into_iter().enumerate() {
        mesh.tint(Some(colour));
        let (w, l) = (width / 2.0 - inset, length / 2.0 - inset);
        let y = 0.012 + 0.002 * i as f32;
        mesh.polygon(&CLOTH, &[v(-w, y, l), v(w, y, l), v(w, y, -l), v(-w, y, -l)]);
    }
    let medallion = |mesh: &mut Mesh, radius: f32, points: usize, y: f32, colour: [f32; 3]| {
        mesh.tint(Some(colour));
        let corner = |i: usize| {
            let angle = TAU * i as f32 / (2 * points) as f32;
            let r = if i.is_multiple_of(2) { radius } else { radius * 0.72 };
            v(r * angle.sin(), y, r * angle.cos() * length / width)
        };
        for i in 0..2 * points {
            mesh.polygon(&CLOTH, &[v(0.0, y, 0.0), corner(i), corner(i + 1)]);
        }
    };
    medallion(mesh, width * 0.3, 8, 0.024, cream);
    medallion(mesh, width * 0.27, 8, 0.027, dark);
    medallion(mesh, width * 0.17, 6, 0.03, base.map(|c| (c * 1.5).min(1.0)));
    medallion(mesh, width * 0.07, 4, 0.033, cream);
    mesh.tint(None);
}

pub(super) fn barrier(mesh: &mut Mesh, piece: &Piece) {
    const ROPE: Finish = Finish::matt("rope", 0x8f1f2b);
    let width = piece.width(1.6);
    for x in [-width / 2.0, width / 2.0] {
        mesh.moved(v(x, 0.0, 0.0), |mesh| {
            let profile = [
                (0.16, 0.0),
                (0.16, 0.02),
                (0.05, 0.05),
                (0.022, 0.07),
                (0.022, 0.9),
                (0.04, 0.92),
                (0.04, 0.96),
                (0.0, 1.0),
            ];
            mesh.lathe(&GOLD, &profile, 18);
        });
    }
    let path: Vec<_> = (0..=12)
        .map(|i| {
            let t = i as f32 / 6.0 - 1.0;
            (v(t * width / 2.0, 0.62 + 0.26 * t * t, 0.0), 0.022)
        })
        .collect();
    mesh.tube(&piece.finish(ROPE), &path, 8);
}

pub(super) fn lamp(mesh: &mut Mesh, piece: &Piece) {
    let height = piece.height(1.7);
    mesh.lathe(
        &BRONZE,
        &[
            (0.17, 0.0),
            (0.17, 0.02),
            (0.03, 0.06),
            (0.016, 0.12),
            (0.016, height - 0.3),
        ],
        18,
    );
    mesh.lathe(
        &piece.finish(LAMPLIGHT),
        &[
            (0.0, height - 0.36),
            (0.24, height - 0.34),
            (0.15, height),
            (0.0, height),
        ],
        24,
    );
}

pub(super) fn chandelier(mesh: &mut Mesh, piece: &Piece) {
    let radius = piece.width(1.8) / 2.0;
    let drop = piece.height((piece.ceiling_m * 0.3).clamp(0.8, 2.5));
    mesh.tube(&BRONZE, &[(v(0.0, 0.0, 0.0), 0.015), (v(0.0, -drop, 0.0), 0.015)], 8);
    mesh.moved(v(0.0, -drop, 0.0), |mesh| {
        mesh.lathe(
            &BRONZE,
            &[
                (0.0, -0.3),
                (0.05, -0.26),
                (0.14, -0.12),
                (0.06, -0.02),
                (0.1, 0.06),
                (0.03, 0.2),
                (0.0, 0.24),
            ],
            20,
        );
        for (count, reach, rise) in [(8, radius, 0.0), (6, radius * 0.6, 0.28)] {
            for i in 0..count {
                let angle = TAU * i as f32 / count as f32;
                mesh.posed(Affine3A::from_rotation_y(angle), |mesh| {
                    let arm = [(0.06, 0.0), (0.4, -0.14), (0.8, -0.1), (1.0, 0.04)];
                    let knots: Vec<_> = arm.iter().map(|&(r, y)| (v(0.0, rise + y, r * reach), 0.016)).collect();
                    mesh.tube(&BRONZE, &crate::import::plan::mesh::curve(&knots, 9), 6);
                    mesh.moved(v(0.0, rise + 0.04, reach), |mesh| {
                        mesh.lathe(&GOLD, &[(0.0, 0.0), (0.05, 0.02), (0.06, 0.04), (0.0, 0.04)], 10);
                        mesh.ellipsoid(&LAMPLIGHT, v(0.0, 0.12, 0.0), v(0.05, 0.085, 0.05), 12);
                    });
                });
            }
        }
    });
}

pub(super) fn pendant(mesh: &mut Mesh, piece: &Piece) {
    let drop = piece.height((piece.ceiling_m - 2.5).clamp(0.5, 3.0));
    let radius = piece.width(0.5) / 2.0;
    mesh.tube(&IRON, &[(Vec3::ZERO, 0.008), (v(0.0, -drop, 0.0), 0.008)], 6);
    mesh.ellipsoid(
        &piece.finish(LAMPLIGHT),
        v(0.0, -drop - radius * 0.8, 0.0),
        v(radius, radius * 0.8, radius),
        20,
    );
    mesh.moved(v(0.0, -drop - 0.05, 0.0), |mesh| {
        mesh.lathe(&BRONZE, &[(0.07, 0.0), (0.05, 0.06), (0.0, 0.08)], 14)
    });
}

pub(super) fn plinth(mesh: &mut Mesh, piece: &Piece) {
    let (height, width) = (piece.height(0.95), piece.width(0.56));
    let stone = piece.finish(STONE);
    mesh.block(&stone, [0.0; 3], [width + 0.1, 0.1, width + 0.1]);
    mesh.block(&stone, [0.0, 0.1, 0.0], [width - 0.06, height - 0.18, width - 0.06]);
    mesh.block(&stone, [0.0, height - 0.08, 0.0], [width, 0.08, width]);
}

const STONE: Finish = Finish::matt("plinth", 0xdcd8d0).gloss(0.7);

pub(super) fn vitrine(mesh: &mut Mesh, piece: &Piece) {
    let width = piece.width(0.9);
    let wood = piece.finish(WALNUT);
    let depth = 0.7;
    mesh.block(&wood, [0.0; 3], [width - 0.08, 0.08, depth - 0.08]);
    mesh.block(&wood, [0.0, 0.08, 0.0], [width, 0.8, depth]);
    mesh.block(&LINEN, [0.0, 0.88, 0.0], [width - 0.03, 0.035, depth - 0.03]);
    let top = 1.62;
    for x in [-1.0, 1.0] {
        for z in [-1.0, 1.0] {
            let foot = [x * (width / 2.0 - 0.012), 0.88, z * (depth / 2.0 - 0.012)];
            mesh.block(&BRONZE, foot, [0.024, top - 0.88, 0.024]);
        }
        mesh.block(&BRONZE, [x * (width / 2.0 - 0.012), top, 0.0], [0.024, 0.024, depth]);
        mesh.block(
            &BRONZE,
            [0.0, top, x * (depth / 2.0 - 0.012)],
            [width - 0.048, 0.024, 0.024],
        );
    }
    mesh.cuboid(
        &GLASS,
        v(-width / 2.0 + 0.006, 0.92, -depth / 2.0 + 0.006),
        v(width / 2.0 - 0.006, top - 0.002, depth / 2.0 - 0.006),
    );
}
