//! Small worlds for tests.

use belvedere_scene::{
    Bounds, CellId, ObjectId,
    record::{CellRecord, Guarantee, Hull, Visible},
};
use glam::{DMat4, Vec3};

use crate::{
    check::Cell,
    scene::{Model, Object, Scene, Surface},
};

/// A GLB of a JSON text and a binary chunk.
pub(crate) fn glb(json: &str, binary: &[u8]) -> Vec<u8> {
    let mut json = json.as_bytes().to_vec();
    json.resize(json.len().next_multiple_of(4), b' ');
    let mut bytes = b"glTF".to_vec();
    for word in [2, 28 + json.len() + binary.len(), json.len(), 0x4E4F_534A] {
        bytes.extend((word as u32).to_le_bytes());
    }
    bytes.extend(json);
    for word in [binary.len(), 0x004E_4942] {
        bytes.extend((word as u32).to_le_bytes());
    }
    bytes.extend(binary);
    bytes
}

pub(crate) const OPAQUE: Surface = Surface {
    double_sided: false,
    see_through: false,
};
pub(crate) const BOTH_SIDES: Surface = Surface {
    double_sided: true,
    see_through: false,
};
pub(crate) const GLASS: Surface = Surface {
    double_sided: true,
    see_through: true,
};

/// A box whose faces look outwards; inwards where `min` and `max` are the other way round.
pub(crate) fn block(min: [f32; 3], max: [f32; 3], surface: Surface) -> Model {
    let corner =
        |i: u32| Vec3::from_array([0, 1, 2].map(|axis| if i >> axis & 1 == 0 { min[axis] } else { max[axis] }));
    let mut model = Model {
        positions: (0..8).map(corner).collect(),
        ..Model::default()
    };
    let sides = [
        [0, 4, 6, 2],
        [1, 3, 7, 5],
        [0, 1, 5, 4],
        [2, 6, 7, 3],
        [0, 2, 3, 1],
        [4, 5, 7, 6],
    ];
    for [a, b, c, d] in sides {
        model.add_triangles(&[[a, b, c], [a, c, d]], surface);
    }
    model
}

/// A quad across the z axis, its front towards +z.
pub(crate) fn quad(min: [f32; 2], max: [f32; 2], z: f32, surface: Surface) -> Model {
    let mut model = Model {
        positions: vec![
            Vec3::new(min[0], min[1], z),
            Vec3::new(max[0], min[1], z),
            Vec3::new(max[0], max[1], z),
            Vec3::new(min[0], max[1], z),
        ],
        ..Model::default()
    };
    model.add_triangles(&[[0, 1, 2], [0, 2, 3]], surface);
    model
}

/// One object of each model, where the model stands.
pub(crate) fn scene(models: Vec<Model>) -> Scene {
    let objects = (0..models.len()).map(|i| object(i, DMat4::IDENTITY)).collect();
    Scene::new(models, objects)
}

pub(crate) fn object(model: usize, world_from_object: DMat4) -> Object {
    Object {
        id: ObjectId(model as u32),
        model,
        world_from_object,
        door: false,
        error_m: 0.0,
    }
}

/// The cell c4 from −1 to 1 m whose record lists objects.
pub(crate) fn cell(listed: &[u32], guarantee: Guarantee) -> Cell {
    let bounds = Bounds {
        min: [-1.0; 3],
        max: [1.0; 3],
    };
    Cell::of(&CellRecord {
        cell: CellId(4),
        hull: Hull::of_box(&bounds),
        adjacent: vec![],
        portals: vec![],
        cpvs: vec![],
        opvs: listed
            .iter()
            .map(|o| Visible {
                object: ObjectId(*o),
                fraction: 1.0,
                solid_angle_sr: 1.0,
                doors: vec![],
            })
            .collect(),
        lpvs: vec![],
        method: "by hand".to_owned(),
        guarantee,
        miss_bound: 0.0,
        visible_level0_bytes: 0,
        visible_coarsest_bytes: 0,
    })
}
