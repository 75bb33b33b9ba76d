//! Which poses does a skinned mesh go through whose impostor is to move? Its skin, at equidistant moments of an animation.

use std::collections::BTreeMap;

use belvedere_scene::impostor::Wish;
use glam::{DMat4, DVec3};

use super::ImportError;
use super::animation::Movement;
use super::impostor::Asked;
use super::nodes::{Hierarchy, PlacedNode};
use super::primitives::ReadPrimitive;
use super::reader::Reader;
use super::skin::Skin;
use crate::source::{Primitive, SourceModel};

/// What posing a vertex takes: its matrix, its position in f64, and what is kept of it.
const POSED_VERTEX_BYTES: usize = 400;

/// What the animations do, each sampled once for each number of frames; `None` for what is none.
#[derive(Default)]
pub(super) struct Movements(BTreeMap<(Option<String>, u32), Option<Movement>>);

/// A skinned mesh, at the node that asks for its frames.
pub(super) struct Skinned<'s> {
    pub(super) node: &'s PlacedNode,
    pub(super) skin: usize,
    pub(super) read: &'s [ReadPrimitive],
    /// Where the model's origin is in the world.
    pub(super) origin: DVec3,
}

/// What a node asks for, when it asks for frames.
pub(super) fn moving(node: &PlacedNode) -> Option<&Asked> {
    node.impostor.as_ref().filter(|asked| asked.wish.frames > 1)
}

impl Movements {
    /// Gives a model the poses that are asked for, and its stride. Where there are none it has one pose, and the reason is
    /// counted.
    pub(super) fn give(
        &mut self,
        model: &mut SourceModel,
        skinned: &Skinned<'_>,
        (reader, hierarchy): (&mut Reader, &Hierarchy),
    ) -> Result<(), ImportError> {
        let Some(asked) = moving(skinned.node) else {
            return Ok(());
        };
        let frames = asked.wish.frames;
        let key = (asked.animation.clone(), frames);
        if !self.0.contains_key(&key) {
            let sampled = Movement::sample(reader, hierarchy, (asked.animation.as_deref(), frames));
            let sampled = reader.settle(sampled)?;
            self.0.insert(key.clone(), sampled);
        }
        let Some(movement) = &self.0[&key] else { return Ok(()) };
        let mut poses = Vec::new();
        for worlds in &movement.worlds {
            let Some(pose) = pose(skinned, worlds, (reader, hierarchy))? else {
                return Ok(());
            };
            poses.push(pose);
        }
        model.poses = poses;
        model.impostor = model.impostor.map(|wish| Wish {
            stride: asked.stride(movement.duration_s),
            ..wish
        });
        Ok(())
    }
}

/// The mesh in one pose, relative to its origin.
fn pose(
    skinned: &Skinned<'_>,
    worlds: &[DMat4],
    (reader, hierarchy): (&mut Reader, &Hierarchy),
) -> Result<Option<Vec<Primitive>>, ImportError> {
    let place = &skinned.node.name;
    let vertices: usize = skinned.read.iter().map(|r| r.primitive.positions.len()).sum();
    reader.budget.claim(vertices, POSED_VERTEX_BYTES, || place.clone())?;
    let opened = Skin::open(reader, (hierarchy, &|position| worlds[position]), skinned.skin);
    let Some(skin) = reader.settle(opened)? else {
        return Ok(None);
    };
    let placed = skin.pose(skinned.read, Some(skinned.origin), (&mut reader.defects, place));
    Ok(reader.settle(placed)?.map(|placed| placed.primitives))
}

#[cfg(test)]
mod tests {
    use serde_json::{Value, json};

    use super::*;
    use crate::import::testing::Gltf;

    /// A triangle on a joint below another, at a node that stands at x = 5 and asks for this.
    fn skinned(impostor: Value) -> Gltf {
        let mut gltf = Gltf::triangle();
        let joints = gltf.accessor("VEC4", 5121, (3, &[0; 12]));
        let weights = gltf.floats("VEC4", &[[1.0, 0.0, 0.0, 0.0]; 3]);
        let attributes = &mut gltf.json["meshes"][0]["primitives"][0]["attributes"];
        attributes["JOINTS_0"] = joints.into();
        attributes["WEIGHTS_0"] = weights.into();
        gltf.json["skins"] = json!([{"joints": [2]}]);
        gltf.json["nodes"] = json!([
            {"mesh": 0, "skin": 0, "name": "n", "translation": [5, 0, 0], "extras": {"belvedere": {"impostor": impostor}}},
            {"children": [2], "translation": [0, 1, 0]},
            {},
        ]);
        gltf.json["scenes"][0]["nodes"] = json!([0, 1]);
        gltf
    }

    /// Adds an animation of one channel.
    fn animate<const N: usize>(
        gltf: &mut Gltf,
        (name, interpolation): (&str, &str),
        (node, path): (usize, &str),
        (times, kind, values): (&[[f32; 1]], &str, &[[f32; N]]),
    ) {
        let input = gltf.floats("SCALAR", times);
        let output = gltf.floats(kind, values);
        gltf.push(
            "animations",
            json!({"name": name,
                "samplers": [{"input": input, "output": output, "interpolation": interpolation}],
                "channels": [{"sampler": 0, "target": {"node": node, "path": path}}]}),
        );
    }

    /// The second corner of the triangle in each pose, and what was asked for.
    fn corners(gltf: &Gltf) -> (Vec<[f32; 3]>, Option<Wish>) {
        let scene = gltf.import().unwrap().scene;
        let model = &scene.models[0];
        let corner = |pose: &Vec<Primitive>| pose[0].positions[1].map(|x| (x * 1e4).round() / 1e4);
        (model.poses.iter().map(corner).collect(), model.impostor)
    }

    #[test]
    fn joints_go_as_each_interpolation_says_and_the_origin_is_that_of_the_node() {
        let ends = [[0.0], [2.0]];
        let mut gltf = skinned(json!({"frames": 4}));
        animate(
            &mut gltf,
            ("a", "LINEAR"),
            (1, "translation"),
            (&ends, "VEC3", &[[0.0, 1.0, 0.0], [8.0, 1.0, 0.0]]),
        );
        let (found, wish) = corners(&gltf);
        assert_eq!(found, [0.0, 2.0, 4.0, 6.0].map(|x| [x + 1.0 - 5.0, 1.0, 0.0]));
        let wish = wish.unwrap();
        assert_eq!((wish.frames, wish.views), (4, Wish::VIEWS_OF_FRAMES));
        assert!((wish.stride - 2.8).abs() < 1e-9, "{}", wish.stride);

        let mut gltf = skinned(json!({"frames": 4, "stride": 0.9}));
        let times = [[1.0], [2.0], [3.0]];
        animate(
            &mut gltf,
            ("a", "STEP"),
            (2, "scale"),
            (&times, "VEC3", &[[1.0; 3], [3.0; 3], [9.0; 3]]),
        );
        let (found, wish) = corners(&gltf);
        assert_eq!(found, [1.0, 1.0, 3.0, 3.0].map(|x| [x - 5.0, 1.0, 0.0]));
        assert_eq!(wish.unwrap().stride, 0.9);

        let mut gltf = skinned(json!({"frames": 2}));
        let quarter = std::f32::consts::FRAC_1_SQRT_2;
        // The far way round is not taken.
        let turns = [[0.0, 0.0, 0.0, 1.0], [0.0, -quarter, 0.0, -quarter]];
        animate(&mut gltf, ("a", "LINEAR"), (2, "rotation"), (&ends, "VEC4", &turns));
        let half = (quarter * 1e4).round() / 1e4;
        assert_eq!(corners(&gltf).0, [[-4.0, 1.0, 0.0], [half - 5.0, 1.0, -half]]);

        let mut gltf = skinned(json!({"frames": 4}));
        // In-tangent, value and out-tangent at each time; it leaves with a speed of 4 and arrives at rest.
        let spline = [[0.0; 3], [0.0; 3], [4.0, 0.0, 0.0], [0.0; 3], [8.0, 0.0, 0.0], [0.0; 3]];
        animate(
            &mut gltf,
            ("a", "CUBICSPLINE"),
            (2, "translation"),
            (&ends, "VEC3", &spline),
        );
        let way = |t: f32| 8.0 * (3.0 * t * t - 2.0 * t * t * t) + 2.0 * 4.0 * (t * t * t - 2.0 * t * t + t);
        assert_eq!(
            corners(&gltf).0,
            [0.0, 0.25, 0.5, 0.75].map(|t| [way(t) - 4.0, 1.0, 0.0])
        );
    }

    #[test]
    fn the_animation_that_is_named_is_taken_and_else_the_first() {
        let ends = [[0.0], [2.0]];
        for (asked, x) in [
            (json!({"frames": 2}), 1.0),
            (json!({"frames": 2, "animation": "b"}), 3.0),
        ] {
            let mut gltf = skinned(asked);
            animate(
                &mut gltf,
                ("a", "LINEAR"),
                (2, "translation"),
                (&ends, "VEC3", &[[0.0; 3], [2.0, 0.0, 0.0]]),
            );
            animate(
                &mut gltf,
                ("b", "LINEAR"),
                (2, "translation"),
                (&ends, "VEC3", &[[0.0; 3], [6.0, 0.0, 0.0]]),
            );
            assert_eq!(corners(&gltf).0, [[-4.0, 1.0, 0.0], [x - 4.0, 1.0, 0.0]]);
        }
    }

    #[test]
    fn what_cannot_move_has_one_pose_and_the_reason_is_counted_with_its_place() {
        let ends = [[0.0], [2.0]];
        let walking = |asked: Value| {
            let mut gltf = skinned(asked);
            animate(
                &mut gltf,
                ("a", "LINEAR"),
                (2, "translation"),
                (&ends, "VEC3", &[[0.0; 3], [2.0, 0.0, 0.0]]),
            );
            gltf
        };
        let frames = json!({"frames": 2});
        let still = walking(frames.clone()).with("/animations/0/channels/0/target/path", json!("weights"));
        let backwards = walking(frames.clone()).with("/animations/0/samplers/0/interpolation", json!("BACK"));
        let nowhere = walking(frames.clone()).with("/animations/0/channels/0/sampler", json!(7));
        let fixed = walking(frames.clone()).with("/nodes/2", json!({"matrix": glam::Mat4::IDENTITY.to_cols_array()}));
        let mut unskinned = walking(frames);
        unskinned.json["nodes"][0].as_object_mut().unwrap().remove("skin");
        for (gltf, kind, place) in [
            (
                walking(json!({"frames": 2, "animation": "run"})),
                "no such animation",
                "/animations: \"run\"",
            ),
            (still, "animation in which nothing moves", "/animations/0"),
            (
                backwards,
                "unknown interpolation",
                "/animations/0/samplers/0/interpolation",
            ),
            (nowhere, "reference to something", "/animations/0/channels/0/sampler"),
            (fixed, "animated node with a matrix", "/animations/0/channels/0/target"),
            (unskinned, "`frames` for a mesh without a skin", "/nodes/0"),
        ] {
            let imported = gltf.import().unwrap();
            assert_eq!(imported.scene.models[0].poses, Vec::<Vec<Primitive>>::new(), "{kind}");
            let found = imported.defects.iter().find(|defect| defect.kind.starts_with(kind));
            assert_eq!(found.map(|defect| defect.first), Some(place.to_owned()), "{kind}");
        }
    }
}
