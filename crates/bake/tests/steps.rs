//! Does each stage of a bake make as many steps as it announces, so that what is shown goes on to its end?

use std::sync::Mutex;

use belvedere_bake::{
    BakeSettings, Host, Source, bake,
    defect::Defects,
    import::{FileError, Limits, SourceFiles, import},
    progress::{Progress, Silent, Stage},
    records::{BlobSink, SinkError},
    visibility::{SampledSettings, VisibilitySettings},
};
use belvedere_scene::BlobName;

/// Each stage in the order in which they began, with the steps that it announced and made.
#[derive(Default)]
struct Stages(Mutex<Vec<(Stage, u64, u64)>>);

impl Progress for Stages {
    fn start(&self, stage: Stage, steps: u64) {
        self.0
            .lock()
            .expect("no other thread has panicked")
            .push((stage, steps, 0));
    }

    fn advance(&self, steps: u64) {
        if let Some((_, _, made)) = self.0.lock().expect("no other thread has panicked").last_mut() {
            *made += steps;
        }
    }
}

struct Nothing;

impl SourceFiles for Nothing {
    fn read(&self, _: &str, _: u64) -> Result<Vec<u8>, FileError> {
        Err(FileError::Missing)
    }
}

impl BlobSink for Nothing {
    fn put(&self, _: &BlobName, _: Vec<u8>) -> Result<(), SinkError> {
        Ok(())
    }
}

/// The stages of a bake with a preview.
fn stages(name: &str, text: &str) -> Vec<(Stage, u64, u64)> {
    let imported =
        import(name, text.as_bytes().to_vec(), &Nothing, &Limits::default(), &Silent).expect("rules that grow");
    let settings = BakeSettings {
        visibility: VisibilitySettings {
            sampled: Some(SampledSettings {
                rays_per_cell: 2048,
                ..SampledSettings::default()
            }),
            ..VisibilitySettings::default()
        },
        ..BakeSettings::default()
    };
    let source = Source {
        scene: imported.scene,
        title: name.to_owned(),
        bytes: 0,
    };
    let stages = Stages::default();
    let host = Host {
        progress: &stages,
        first: Some(&|_| Ok(())),
        ..Host::taking(&Nothing)
    };
    bake(source, &settings, &mut Defects::default(), &host).expect("a scene that bakes");
    stages.0.into_inner().expect("no thread has panicked")
}

#[test]
fn every_stage_makes_the_steps_that_it_announces() {
    let rooms = "
        part wall() { move(0, 0, -1.25) box(0.2, 3, 1.5) move(0, 0, 1.25) box(0.2, 3, 1.5) move(0, 2.2, 0) box(0.2, 0.8, 1) }
        part leaf() { box(0.05, 2.2, 1) }
        move(0, -0.2, 0) box(20, 0.2, 20)
        for i in 4 for j in 4 move(4 * i - 6, 0, 4 * j - 6) {
          called \"cell:room\" box(4, 3, 4)
          move(2, 0, 0) { wall() called \"door:d\" leaf() called \"occluder:o\" move(0, 0.1, -1.25) box(0.1, 2.8, 1.3) }
          move(0, 0, 2) turn(90) wall()
        }";
    let own = "move(0, -0.2, 0) box(30, 0.2, 30) for i in 4 for j in 4 move(6 * i - 9, 0, 6 * j - 9) box(3, 4, 3)";
    for (text, cells) in [(rooms, 16), (own, 0)] {
        let stages = stages("test.dcg", text);
        for (stage, announced, made) in &stages {
            assert_eq!(announced, made, "{stage} of {stages:?}");
        }
        for stage in [
            Stage::Occluders,
            Stage::Cells,
            Stage::Preview,
            Stage::Visibility,
            Stage::Publish,
        ] {
            assert!(
                stages.iter().any(|(other, made, _)| *other == stage && *made > 0),
                "{stage} of {stages:?}"
            );
        }
        let of = |stage: Stage| stages.iter().filter(move |(other, ..)| *other == stage);
        assert_eq!(of(Stage::Glance).count() > 0, cells == 0, "{stages:?}");
        if cells > 0 {
            assert!(of(Stage::Cells).any(|(_, made, _)| *made == cells), "{stages:?}");
        }
    }
}
