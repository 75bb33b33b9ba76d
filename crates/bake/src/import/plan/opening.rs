//! What does one see when passing through a doorway? Its jambs, lintel, threshold and frame; panes where it is glazed.

use super::finish::{BRONZE, Finish, GLASS};
use super::layout::{Layout, Opening, OpeningKind, Tile};
use super::mesh::Mesh;
use super::{Plan, SceneBuilder};
use glam::{Affine3A, Vec3};

const LINING: Finish = Finish::matt("door lining", 0xd9cfbb).gloss(0.6);
const THRESHOLD: Finish = Finish::matt("threshold", 0x8d8172).gloss(0.4);
const FRAME_WIDTH_M: f32 = 0.16;
const FRAME_DEPTH_M: f32 = 0.05;

/// Adds the lining of each opening.
pub(super) fn build_openings(plan: &Plan, builder: &mut SceneBuilder) {
    for opening in &plan.layout.openings {
        let kind = match opening.kind {
            OpeningKind::Doorway => "doorway",
            OpeningKind::GlassDoor => "glass door",
            OpeningKind::Window => "window",
        };
        let name = builder.numbered(format!("{}/{kind}", host_room(plan, opening)));
        let mut mesh = Mesh::new();
        let layout = &plan.layout;
        let tile_m = layout.tile_m;
        let (x, z) = (opening.column as f32 * tile_m, opening.row as f32 * tile_m);
        // In its own frame the wall runs along x, the hole from x = 0, its faces at z = 0 and z = tile.
        let pose = if opening.along_x {
            Affine3A::from_translation(Vec3::new(x, 0.0, z))
        } else {
            Affine3A::from_translation(Vec3::new(x, 0.0, z + opening.length as f32 * tile_m))
                * Affine3A::from_rotation_y(std::f32::consts::FRAC_PI_2)
        };
        mesh.posed(pose, |mesh| line(mesh, opening, layout));
        builder.place_once(name, mesh);
    }
}

/// The room on its north or west side, else the one on the other side.
fn host_room<'a>(plan: &'a Plan, opening: &Opening) -> &'a str {
    let (column, row) = opening.tile(0);
    let (dx, dy) = if opening.along_x { (0, 1) } else { (1, 0) };
    let sides = [(column - dx, row - dy), (column + dx, row + dy)];
    sides
        .into_iter()
        .find_map(|(c, r)| match plan.layout.tile(c, r) {
            Tile::Room(room) => Some(plan.rooms[room].name.as_str()),
            _ => None,
        })
        .unwrap_or("Outside")
}

fn line(mesh: &mut Mesh, opening: &Opening, layout: &Layout) {
    let (width, depth) = (opening.length as f32 * layout.tile_m, layout.tile_m);
    let (low, high) = (opening.bottom_m, opening.top_m);
    let v = Vec3::new;
    mesh.tint(Some([0.82; 3]));
    mesh.polygon(
        &LINING,
        &[
            v(0.0, low, depth),
            v(0.0, low, 0.0),
            v(0.0, high, 0.0),
            v(0.0, high, depth),
        ],
    );
    mesh.polygon(
        &LINING,
        &[
            v(width, low, 0.0),
            v(width, low, depth),
            v(width, high, depth),
            v(width, high, 0.0),
        ],
    );
    mesh.tint(Some([0.65; 3]));
    mesh.polygon(
        &LINING,
        &[
            v(0.0, high, 0.0),
            v(width, high, 0.0),
            v(width, high, depth),
            v(0.0, high, depth),
        ],
    );
    mesh.tint(None);
    let sole = if opening.kind == OpeningKind::Window {
        LINING
    } else {
        THRESHOLD
    };
    mesh.polygon(
        &sole,
        &[
            v(0.0, low, depth),
            v(width, low, depth),
            v(width, low, 0.0),
            v(0.0, low, 0.0),
        ],
    );
    // Frames around the hole on both faces of the wall.
    let (frame, out) = (FRAME_WIDTH_M, FRAME_DEPTH_M);
    let foot = if opening.kind == OpeningKind::Window {
        low - frame
    } else {
        low
    };
    for (near, far) in [(-out, 0.0), (depth, depth + out)] {
        mesh.cuboid(&LINING, v(-frame, foot, near), v(0.0, high, far));
        mesh.cuboid(&LINING, v(width, foot, near), v(width + frame, high, far));
        mesh.cuboid(
            &LINING,
            v(-frame - 0.03, high, near * 1.3),
            v(
                width + frame + 0.03,
                high + frame,
                depth.min(far) + (far - depth.min(far)) * 1.3,
            ),
        );
        if opening.kind == OpeningKind::Window {
            mesh.cuboid(&LINING, v(0.0, foot, near), v(width, low, far));
        }
    }
    if opening.kind != OpeningKind::Doorway {
        glaze(mesh, width, [low, high], depth / 2.0);
    }
}

/// Panes between bars in the middle of the wall.
fn glaze(mesh: &mut Mesh, width: f32, [low, high]: [f32; 2], z: f32) {
    let bars = if low > 0.0 { LINING } else { BRONZE };
    let v = Vec3::new;
    mesh.cuboid(
        &GLASS,
        v(0.02, low + 0.02, z - 0.01),
        v(width - 0.02, high - 0.02, z + 0.01),
    );
    let columns = (width / 0.9).round().clamp(1.0, 32.0) as usize;
    let thick = 0.03;
    for i in 0..=columns {
        let x = (width * i as f32 / columns as f32).clamp(thick, width - thick);
        mesh.cuboid(
            &bars,
            v(x - thick, low + 0.001, z - 0.035),
            v(x + thick, high - 0.001, z + 0.035),
        );
    }
    let levels = ((high - low) / 1.1).round().clamp(1.0, 8.0) as usize;
    for i in 0..=levels {
        let y = (low + (high - low) * i as f32 / levels as f32).clamp(low + thick, high - thick);
        mesh.cuboid(
            &bars,
            v(0.001, y - thick * 0.9, z - 0.03),
            v(width - 0.001, y + thick * 0.9, z + 0.03),
        );
    }
}
