//! Does what `docs/PROCEDURAL.md` shows work? Every example in it is grown.

#![allow(clippy::unwrap_used, reason = "a test may fail at any step")]

use std::fs;
use std::path::{Path, PathBuf};

use belvedere_scene::procedural::{Loader, Program, Settings, grow};

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
