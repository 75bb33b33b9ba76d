//! Does what `docs/PROCEDURAL.md` shows work, and what `content/` holds? Every example is grown, every model at every level
//! of detail.

#![allow(clippy::unwrap_used, reason = "a test may fail at any step")]

use std::fs;
use std::path::{Path, PathBuf};

use belvedere_scene::procedural::{Loader, Program, Settings, Value, bounds, grow};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

struct Content;

impl Loader for Content {
    fn load(&self, path: &str) -> Result<String, String> {
        fs::read_to_string(root().join("content").join(path)).map_err(|cause| cause.to_string())
    }
}

#[test]
fn every_example_grows() {
    let page = fs::read_to_string(root().join("docs/PROCEDURAL.md")).unwrap();
    let examples: Vec<&str> = page
        .split("```dcg\n")
        .skip(1)
        .filter_map(|rest| rest.split("```").next())
        .collect();
    assert!(examples.len() >= 12, "{} examples", examples.len());
    for example in examples {
        let program = Program::read("example.dcg", example.to_owned(), &Content);
        let grown = program.and_then(|program| grow(&program, &Settings::default()));
        match grown {
            Ok(grown) => assert!(grown.triangles() > 10, "draws nothing:\n{example}"),
            Err(error) => panic!("{error}\nin\n{example}"),
        }
    }
}

#[test]
fn the_content_has_more_triangles_the_more_detail_it_has_and_keeps_within_its_bounds() {
    let small = |name: &str| match name {
        "terrain.dcg" => vec![("tiles", 2.0), ("steps", 16.0)],
        "town.dcg" => vec![("reach", 2.0)],
        "forest.dcg" => vec![("side", 160.0)],
        _ => vec![],
    };
    for name in [
        "tree.dcg",
        "conifer.dcg",
        "terrain.dcg",
        "town.dcg",
        "museum.dcg",
        "forest.dcg",
    ] {
        let program = Program::read(name, Content.load(name).unwrap(), &Content).unwrap();
        let parameters = small(name)
            .into_iter()
            .map(|(name, value)| (name.to_owned(), Value::Number(value)));
        let mut settings = Settings {
            parameters: parameters.collect(),
            ..Settings::default()
        };
        let mut triangles = 0;
        for detail in 0..=4 {
            settings.detail = detail;
            let grown = grow(&program, &settings).unwrap();
            assert!(grown.triangles() > triangles, "{name} at {detail}");
            triangles = grown.triangles();
            let declared = bounds(&program, &settings, &|_| None).unwrap();
            let exact = grown.parts[0].bounds;
            assert!(
                (0..3).all(|a| declared.min[a] <= exact.min[a] && exact.max[a] <= declared.max[a]),
                "{name}"
            );
        }
    }
}
