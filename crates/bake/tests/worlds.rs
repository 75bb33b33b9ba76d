//! Are the worlds in `content/` what they claim to be? Each grows with the parts that one comes to see, on cells that
//! hold together, and a small town is baked to the end.

use std::{collections::BTreeMap, path::PathBuf, sync::Mutex};

use belvedere_bake::{
    BakeSettings, Host, Source, bake,
    defect::Defects,
    import::{FileError, Imported, Limits, SourceFiles, import},
    progress::Silent,
    records::{BlobSink, SinkError},
    source::{Role, SourceScene},
    visibility::{Method, SampledSettings, VisibilitySettings},
};
use belvedere_scene::BlobName;

/// `content/`, and one file that stands for its own in front of it.
struct Content(&'static str);

impl SourceFiles for Content {
    fn read(&self, relative: &str, _: u64) -> Result<Vec<u8>, FileError> {
        let folder = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../content");
        std::fs::read(folder.join(relative)).map_err(|_| FileError::Missing)
    }
}

fn grown(main: &'static str) -> SourceScene {
    let files = Content(main);
    let imported = import("world.dcg", main.into(), &files, &Limits::default(), &Silent);
    let Imported { scene, defects } = imported.expect("sound rules");
    assert_eq!(defects.iter().count(), 0, "{main}");
    scene
}
