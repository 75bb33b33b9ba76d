//! Where does a piece of furniture stand, and which way does it face?
//!
//! A piece that belongs to a wall (a picture, a bookcase, a sofa) finds the nearest wall along the four directions and
//! turns its back to it; everything else stands in the middle of its tile and faces south unless the legend says
//! otherwise.

use super::error::Problem;
use super::kinds::{Kind, Stance, draw};
use super::layout::{Layout, Tile};
use super::legend::{Entry, Facing, Support};
use super::{EYE_HEIGHT_M, Plan, SceneBuilder};
use glam::{DMat4, DQuat, DVec3};

/// How far a piece looks for its wall, metres.
const WALL_REACH_M: f32 = 1.6;
/// Gap between a wall and what stands against it, metres: room for the skirting board.
const WALL_GAP_M: f32 = 0.03;
const PLINTH_HEIGHT_M: f32 = 0.95;
const VITRINE_FLOOR_M: f32 = 0.92;

/// What a character of the drawing stands for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Symbol {
    Viewpoint(Facing),
    Furniture(Entry),
}

/// A place to look from.
#[derive(Debug, Clone)]
pub(super) struct Viewpoint {
    pub(super) name: String,
    /// x, z in metres.
    pub(super) position: [f32; 2],
    pub(super) facing: Facing,
}

impl Viewpoint {
    pub(super) fn world_from_camera(&self) -> DMat4 {
        let turn = self.facing.turn_from_south() + std::f64::consts::PI;
        let [x, z] = self.position.map(f64::from);
        DMat4::from_rotation_translation(DQuat::from_rotation_y(turn), DVec3::new(x, f64::from(EYE_HEIGHT_M), z))
    }
}

/// A piece of furniture in its place.
#[derive(Debug, Clone)]
pub(super) struct Piece {
    pub(super) room: usize,
    pub(super) entry: Entry,
    /// Its name in a bare drawing.
    pub(super) label: Option<char>,
    /// x, z in metres.
    pub(super) position: [f32; 2],
    pub(super) facing: Facing,
    /// Where it was drawn; makes pictures differ.
    pub(super) tile: (usize, usize),
}

/// Finds place and facing of what is drawn on a tile.
pub(super) fn settle(layout: &Layout, (column, row): (usize, usize), entry: Entry) -> Result<Piece, Problem> {
    let mut position = layout.tile_middle(column, row);
    let mut facing = entry.facing.unwrap_or(Facing::South);
    let stance = entry.kind.stance();
    if let Stance::AgainstWall { .. } | Stance::OnWall = stance {
        let reach = (WALL_REACH_M / layout.tile_m).ceil() as usize;
        let directions: &[Facing] = match &entry.facing {
            Some(facing) => &[facing.opposite()],
            None => &Facing::ALL,
        };
        let nearest = (1..=reach).find_map(|far| {
            directions
                .iter()
                .copied()
                .find(|d| {
                    let (dx, dy) = d.step();
                    let at = |i: usize| layout.tile(column as isize + dx * i as isize, row as isize + dy * i as isize);
                    at(far) == Tile::Wall && (1..far).all(|i| matches!(at(i), Tile::Room(_)))
                })
                .map(|d| (d, far))
        });
        match (nearest, stance) {
            (Some((towards_wall, far)), _) => {
                facing = towards_wall.opposite();
                let back_m = match stance {
                    Stance::AgainstWall { depth_m } => depth_m / 2.0 + WALL_GAP_M,
                    _ => 0.0,
                };
                let shift = (far as f32 - 0.5) * layout.tile_m - back_m;
                let (dx, dy) = towards_wall.step();
                position[0] += dx as f32 * shift;
                position[1] += dy as f32 * shift;
            }
            (None, Stance::OnWall) => {
                return Err(Problem::NothingToHangOn {
                    kind: entry.kind.name(),
                    reach,
                });
            }
            (None, _) => {}
        }
    }
    Ok(Piece {
        room: 0,
        entry,
        label: None,
        position,
        facing,
        tile: (column, row),
    })
}

/// Adds a piece, and what it is set on, to the scene.
pub(super) fn place_piece(plan: &Plan, piece: &Piece, builder: &mut SceneBuilder) {
    let room = &plan.rooms[piece.room];
    let ceiling_m = plan.layout.room_height_m[piece.room];
    let mut foot_m = match piece.entry.kind.stance() {
        Stance::FromCeiling => ceiling_m,
        _ => 0.0,
    };
    let pose = |y: f32| {
        let [x, z] = piece.position.map(f64::from);
        let turn = DQuat::from_rotation_y(piece.facing.turn_from_south());
        DMat4::from_rotation_translation(turn, DVec3::new(x, f64::from(y), z))
    };
    let mut entry = piece.entry;
    let support = match entry.support {
        Support::Floor => None,
        Support::Plinth => Some((Kind::Plinth, PLINTH_HEIGHT_M)),
        Support::Vitrine => Some((Kind::Vitrine, VITRINE_FLOOR_M)),
    };
    if let Some((kind, height_m)) = support {
        let plain = Entry::plain(kind);
        let model = builder.model(model_key(&plain, None, 0.0), |mesh| draw(mesh, &plain, 0, ceiling_m));
        let name = builder.numbered(format!("{}/{}", room.name, kind.name()));
        builder.place(name, model, pose(0.0));
        foot_m = height_m;
        let limit = if kind == Kind::Vitrine { 0.5 } else { 1.1 };
        entry.height_m = Some(entry.height_m.unwrap_or(limit).min(limit));
    }
    let seed = ((piece.tile.0 as u64) << 32) | piece.tile.1 as u64;
    let own = entry.kind.is_unique().then_some(seed);
    let key = model_key(&entry, own, if entry.kind.fills_height() { ceiling_m } else { 0.0 });
    let model = builder.model(key, |mesh| {
        draw(mesh, &entry, own.unwrap_or_else(|| u64::from(entry.variant)), ceiling_m)
    });
    let name = match piece.label {
        Some(letter) => {
            let count = builder.used_names.entry(letter.to_string()).or_insert(0);
            *count += 1;
            if *count > 1 {
                format!("{letter} {count}")
            } else {
                letter.to_string()
            }
        }
        None => builder.numbered(format!("{}/{}", room.name, entry.kind.name())),
    };
    builder.place(name, model, pose(foot_m));
}

/// Equal keys mean equal models.
fn model_key(entry: &Entry, seed: Option<u64>, ceiling_m: f32) -> String {
    let mut key = entry.kind.name().to_owned();
    for (name, value) in [("height", entry.height_m), ("width", entry.width_m)] {
        if let Some(value) = value {
            key += &format!(" {name} {value}");
        }
    }
    if let Some(stuff) = entry.stuff {
        key += &format!(" {stuff:?}").to_lowercase();
    }
    if let Some(colour) = entry.colour {
        let [r, g, b] = colour.0;
        key += &format!(" #{r:02x}{g:02x}{b:02x}");
    }
    if entry.variant > 0 {
        key += &format!(" variant {}", entry.variant);
    }
    if ceiling_m > 0.0 {
        key += &format!(" under {ceiling_m}");
    }
    if let Some(seed) = seed {
        key += &format!(" at {},{}", seed >> 32, seed & 0xffff_ffff);
    }
    key
}
