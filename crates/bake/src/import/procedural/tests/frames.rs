//! How do parts move whose impostors have frames, and what is told of a frame that is wrong?

use std::sync::atomic::{AtomicU64, Ordering};

use belvedere_scene::procedural::Value;
use serde_json::json;

use super::{Beside, rules};
use crate::import::procedural::{Ground, Sowing};
use crate::import::testing::Gltf;
use crate::import::{ImportError, Imported, Limits, import, import_sown};
use crate::progress::{Progress, Silent, Stage};
use crate::source::Primitive;

#[test]
fn a_part_with_a_phase_is_grown_for_each_of_its_frames() {
    let walker = "material coat(phase) { colour = mix(#fff, #000, phase), recolour = 1 }
        part walker(phase, width = 1) {
          impostor(frames = 4, stride = 0.8)
          move(phase, 0, 0) paint coat(phase) box(width, 1, 1)
        }
        walker(0.25, 2)";
    let scene = rules(walker, &[]).unwrap().scene;
    let model = &scene.models[0];
    let least = |primitives: &[Primitive]| {
        let along = primitives[0].positions.iter().map(|[x, ..]| *x);
        along.fold(f32::INFINITY, f32::min)
    };
    assert_eq!(least(&model.primitives), -0.75);
    let poses: Vec<f32> = model.poses.iter().map(|pose| least(pose)).collect();
    assert_eq!(poses, [-1.0, -0.75, -0.5, -0.25]);
    let wish = model.impostor.unwrap();
    assert_eq!((wish.frames, wish.stride), (4, 0.8));
    let colour = |pose: &Vec<Primitive>| &scene.materials[pose[0].material.unwrap()].gltf;
    assert_eq!(colour(&model.poses[1]), colour(&model.primitives));
    assert_ne!(colour(&model.poses[2]), colour(&model.poses[3]));
    assert_eq!(colour(&model.poses[3])["extras"]["belvedere"]["recolour"], true);
}

#[test]
fn frames_in_which_nothing_moves_are_told() {
    let told = |text: &str| rules(text, &[]).unwrap().defects.iter().next();
    let still = told("part post(phase) { impostor(frames = 4) box(1, 1, 1) } post(0)").unwrap();
    assert!(still.kind.contains("looks the same at each `phase`"), "{}", still.kind);
    assert_eq!((still.count, &*still.first), (1, "post"));
    // Only its colour changes.
    let lamp = "material m(phase) { emissive = [phase, 0, 0] } part lamp(phase) { impostor(frames = 4) paint m(phase) box(1, 1, 1) } lamp(0)";
    assert_eq!(told(lamp), None);
}

#[test]
fn a_part_that_cannot_be_grown_alone_has_one_pose_and_one_without_a_phase_none() {
    let painted =
        "material red { colour = #f00 } part walker(phase) { impostor(frames = 4) box(1, 1, 1) } paint red walker(0)";
    let imported = rules(painted, &[]).unwrap();
    assert!(imported.scene.models[0].poses.is_empty());
    let defect = imported.defects.iter().next().unwrap();
    assert!(defect.kind.contains("cannot be grown alone"), "{}", defect.kind);
    assert_eq!(defect.first, "walker");
    let refused = rules(
        "part walker(turn) {\n  impostor(frames = 4) box(1, 1, 1) } walker(0)",
        &[],
    );
    let said = refused.map(|_| ()).unwrap_err().to_string();
    assert!(
        said.contains("line 2, column 12: `frames` needs a parameter `phase`"),
        "{said}"
    );
}

/// What is told of rules that are wrong.
fn refused(text: &str, files: &[(&'static str, Vec<u8>)]) -> String {
    rules(text, files).map(|_| ()).unwrap_err().to_string()
}

#[test]
fn a_mistake_in_a_frame_is_told_where_the_author_wrote_it() {
    let text =
        "part gate(phase) {\n  impostor(views = 4, frames = 4)\n  let a = 1 / (phase - 0.5) box(1, 1, 1)\n}\ngate(0)";
    assert_eq!(
        refused(text, &[]),
        "world.dcg, line 3, column 13: division by zero; test the divisor with `if` before\n    \
         let a = 1 / (phase - 0.5) box(1, 1, 1)\n    called from line 2, column 23 of world.dcg\n    \
         this is frame 3 of 4 of an impostor: `phase` is 0.5 in it"
    );
}

/// The rules that are published of a part whose file was given something are not what its author wrote.
#[test]
fn a_mistake_in_a_frame_of_a_file_that_was_given_something_is_told_where_its_author_wrote_it() {
    let gate = "parameter tall = 1 function f(x) = tall / (x - 0.5)\n\
                part gate(phase) { impostor(frames = 2) if phase > 0 box(f(phase), 1, 1) else box(1, 1, 1) }\ngate(0)";
    let told = refused(
        "import \"lib/gate.dcg\" as gate\n\ngate(tall = 2.25)",
        &[("lib/gate.dcg", gate.into())],
    );
    assert!(
        told.starts_with("lib/gate.dcg, line 1, column 41: division by zero"),
        "{told}"
    );
    let places = ["2, column 58", "2, column 29"].map(|place| format!("called from line {place} of lib/gate.dcg"));
    assert!(places.iter().all(|place| told.contains(place)), "{told}");
    assert!(
        told.ends_with("this is frame 2 of 2 of an impostor: `phase` is 0.5 in it"),
        "{told}"
    );
}

#[test]
fn a_phase_that_a_file_does_not_take_is_told_where_frames_are_asked_for() {
    let walker = "parameter phase = 0 from 0 to 0.6\nparameter tall = 1\n  impostor(frames = 4) box(1, tall, 1)";
    let wanted =
        "line 3, column 12: `phase` is 0.75; it must be from 0 to 0.6\n    impostor(frames = 4) box(1, tall, 1)";
    let told = refused(walker, &[]);
    assert!(told.starts_with(&format!("world.dcg, {wanted}")), "{told}");
    let files = [("walker.dcg", walker.into())];
    let told = refused("import \"walker.dcg\" as walker walker(tall = 3)", &files);
    assert!(told.starts_with(&format!("walker.dcg, {wanted}")), "{told}");
    let sowing = Sowing {
        parameters: [("tall".to_owned(), Value::Number(2.5))].into(),
        ..Sowing::default()
    };
    let limits = Limits {
        memory_bytes: 64 << 20,
        max_objects: 1000,
    };
    let ground = Ground {
        files: &Beside([].into()),
        limits: &limits,
        progress: &Silent,
    };
    let told = import_sown("world.dcg", walker.into(), &sowing, ground);
    let told = told.map(|_| ()).unwrap_err().to_string();
    assert!(told.starts_with(&format!("world.dcg, {wanted}")), "{told}");
}

/// What becomes of rules that may be large.
fn roomy(text: &str) -> Imported {
    let limits = Limits {
        memory_bytes: 4 << 30,
        max_objects: 1000,
    };
    import("world.dcg", text.into(), &Beside([].into()), &limits, &Silent).unwrap()
}

/// Frames of many triangles are not held, and grow again as they are drawn: with the materials that the scene has.
#[test]
fn large_frames_grow_again_when_they_are_drawn() {
    let field = |steps: usize| {
        format!(
            "material water(phase) {{ colour = mix(#00f, #fff, phase) }}
            part sea(phase) {{
              impostor(views = 2, size = 16, frames = 3)
              paint water(phase) heights x, z in 9 by 9 steps {steps} by {steps} = sin(x + 360 * phase)
            }}
            box(1, 1, 1) sea(0)"
        )
    };
    let scene = roomy(&field(20)).scene;
    let small = scene.models.iter().find(|model| model.name == "sea").unwrap();
    assert!(small.frames.is_none() && small.poses.len() == 3);
    let scene = roomy(&field(450)).scene;
    let large = scene.models.iter().find(|model| model.name == "sea").unwrap();
    assert!(large.poses.is_empty() && large.pose_count() == 3);
    assert_eq!(large.pose(0)[0].positions, large.primitives[0].positions);
    assert_ne!(large.pose(1)[0].positions, large.primitives[0].positions);
    let colours: Vec<_> = (0..3)
        .map(|number| scene.materials[large.pose(number)[0].material.unwrap()].gltf["pbrMetallicRoughness"].clone())
        .collect();
    assert_eq!(
        colours[0],
        scene.materials[large.primitives[0].material.unwrap()].gltf["pbrMetallicRoughness"]
    );
    assert!(colours[0] != colours[1] && colours[1] != colours[2]);
}

/// Two models that are small each would take twice as much together, however often a part is asked for.
#[test]
fn frames_are_held_up_to_a_sum_of_the_whole_source() {
    let sea = "part sea(phase, tall) {
          impostor(views = 2, size = 16, frames = 3)
          heights x, z in 9 by 9 steps 300 by 300 = tall * sin(x + 360 * phase)
        }";
    let of_rules = roomy(&format!("{sea} sea(0, 1) sea(0, 2)")).scene;
    let node = |tall: u32| json!({"extras": {"belvedere": {"procedural": "sea.dcg", "parameters": {"tall": tall}}}});
    let mut gltf = Gltf::triangle();
    for tall in [1, 2] {
        let node = gltf.push("nodes", node(tall));
        gltf.json["scenes"][0]["nodes"]
            .as_array_mut()
            .unwrap()
            .push(node.into());
    }
    let files = Beside([("sea.dcg", format!("{sea} parameter tall = 1 sea(0, tall)").into())].into());
    let of_nodes = import("world.glb", gltf.glb(), &files, &Limits::default(), &Silent).unwrap();
    for scene in [of_rules, of_nodes.scene] {
        let seas = scene.models.iter().filter(|model| model.impostor.is_some());
        let held: Vec<_> = seas.map(|model| (model.poses.len(), model.frames.is_some())).collect();
        assert_eq!(held, [(3, false), (0, true)]);
    }
}

/// No frame of it is grown.
#[test]
fn what_is_too_large_for_pictures_has_no_frames() {
    assert_eq!(
        pictureless("1000", "phase > 0"),
        (
            "`impostor` of a model of more than 1048576 triangles: no pictures, and cut into several objects; let parts that it is \
             made of ask for them",
            "sea".to_owned()
        )
    );
}

/// None is grown behind the first that is too large.
#[test]
fn what_is_too_large_in_a_frame_is_told_with_its_number() {
    assert_eq!(
        pictureless("10 + 990 * (phase > 0.3)", "phase > 0.5"),
        (
            "`impostor` of a part of which a frame has more than 1048576 triangles: no pictures; let it have fewer at that `phase`",
            "sea, frame 3 of 4".to_owned()
        )
    );
}

/// What is told of a sea of so many steps that gets no pictures, and of which a frame would be wrong.
fn pictureless(steps: &str, wrong: &str) -> (&'static str, String) {
    let imported = roomy(&format!(
        "part sea(phase) {{ impostor(frames = 4) let wrong = if {wrong} then 1 / 0 else 0 \
         heights x, z in 9 by 9 steps {steps} by 1000 = x * phase + wrong }} sea(0)"
    ));
    let model = &imported.scene.models[0];
    assert!(model.impostor.is_none() && model.poses.is_empty() && model.frames.is_none());
    let told: Vec<_> = imported.defects.iter().collect();
    assert_eq!((told.len(), told[0].count), (1, 1));
    (told[0].kind, told[0].first.clone())
}

/// Stops at the second frame.
#[derive(Default)]
struct AfterOneFrame(AtomicU64);

impl Progress for AfterOneFrame {
    fn start(&self, _: Stage, _: u64) {}
    fn advance(&self, _: u64) {}
    fn cancelled(&self) -> bool {
        self.0.fetch_add(1, Ordering::Relaxed) == 1
    }
}

#[test]
fn an_import_that_is_cancelled_grows_no_further_frame() {
    // The second would be wrong.
    let text = "part gate(phase) { impostor(frames = 4) box(1, 1, if phase > 0 then 1 / 0 else 1) } gate(0)";
    let (files, progress) = (Beside([].into()), AfterOneFrame::default());
    let imported = import("world.dcg", text.into(), &files, &Limits::default(), &progress);
    let told = imported.map(|_| ()).unwrap_err();
    assert!(matches!(told, ImportError::Cancelled), "{told}");
    assert_eq!(progress.0.into_inner(), 2);
}
