//! Small worlds for tests.

use belvedere_scene::ObjectId;
use glam::{DMat4, Vec3};

use crate::scene::{Model, Object, Scene, Surface};

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
    }
}
