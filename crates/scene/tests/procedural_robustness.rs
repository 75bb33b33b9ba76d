//! Does any text give a model or an error? Random bytes, random words and damaged rules; small limits keep it quick.

#![allow(clippy::unwrap_used, reason = "a test may fail at any step")]

use std::fs;
use std::path::Path;

use belvedere_scene::procedural::{Limits, Loader, NoImports, Program, Settings, Value, bounds, grow};
use proptest::prelude::*;

/// Words of the language and of the golden rules, so that much of what is made up can be read.
const WORDS: [&str; 60] = [
    "rule",
    "part",
    "let",
    "if",
    "else",
    "then",
    "for",
    "in",
    "choose",
    "scatter",
    "as",
    "by",
    "edges",
    "heights",
    "steps",
    "paint",
    "called",
    "move",
    "turn",
    "scale",
    "box",
    "cone",
    "sphere",
    "prism",
    "lathe",
    "mesh",
    "material",
    "function",
    "parameter",
    "levels",
    "within",
    "from",
    "to",
    "import",
    "a",
    "b",
    "f",
    "random",
    "mix",
    "count",
    "noise",
    "(",
    ")",
    "{",
    "}",
    "[",
    "]",
    ",",
    "=",
    "+",
    "-",
    "*",
    "/",
    "<",
    "==",
    "0",
    "1",
    "2.5",
    "1e9",
    "\"a\"",
];

fn settings() -> Settings {
    let limits = Limits {
        steps: 200_000,
        triangles: 50_000,
        placements: 10_000,
        parts: 1_000,
        ..Limits::default()
    };
    Settings {
        limits,
        ..Settings::default()
    }
}

/// Every import leads to the same file.
struct Always(String);

impl Loader for Always {
    fn load(&self, _: &str) -> Result<String, String> {
        Ok(self.0.clone())
    }
}

/// Reads and grows; what grew is sound, and within the box that is found without growing.
fn try_text(text: &str, loader: &dyn Loader) -> Result<(), TestCaseError> {
    let Ok(program) = Program::read("test.dcg", text.to_owned(), loader) else {
        return Ok(());
    };
    let declared = bounds(&program, &settings(), &|_| None);
    let Ok(grown) = grow(&program, &settings()) else {
        return Ok(());
    };
    for mesh in grown.parts.iter().flat_map(|part| &part.meshes) {
        prop_assert_eq!(mesh.positions.len(), mesh.normals.len());
        prop_assert!(mesh.indices.iter().all(|i| (*i as usize) < mesh.positions.len()));
        prop_assert!(
            mesh.positions
                .iter()
                .chain(&mesh.normals)
                .flatten()
                .all(|v| v.is_finite())
        );
    }
    let (declared, exact) = (declared.expect("what grows has bounds"), grown.parts[0].bounds);
    let slack = |value: f64| 1e-5 * (1.0 + value.abs());
    let holds = (0..3).all(|a| {
        declared.min[a] <= exact.min[a] + slack(exact.min[a]) && declared.max[a] >= exact.max[a] - slack(exact.max[a])
    });
    prop_assert!(holds || exact.is_empty());
    Ok(())
}

fn golden(name: &str) -> String {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/golden/procedural");
    fs::read_to_string(folder.join(name)).unwrap()
}

#[test]
fn lists_that_are_too_deep_are_refused_however_they_were_put_together() {
    let lets: String = (0..40_000).map(|i| format!("let a{} = [a{i}]\n", i + 1)).collect();
    let program = Program::read("test.dcg", format!("let a0 = 1\n{lets}"), &NoImports).unwrap();
    let error = grow(&program, &settings()).unwrap_err().to_string();
    let said = "test.dcg, line 66, column 11: more than 64 lists inside each other; make it smaller";
    assert!(error.starts_with(said), "{error}");
    let nested = |depth| format!("{}1{}", "[".repeat(depth), "]".repeat(depth)).parse().unwrap();
    assert!(Value::from_json(&nested(64)).is_some());
    assert!(Value::from_json(&nested(65)).is_none());
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 300, ..ProptestConfig::default() })]

    #[test]
    fn any_characters(text in ".{0,200}") {
        try_text(&text, &NoImports)?;
    }

    #[test]
    fn any_words(words in prop::collection::vec(prop::sample::select(WORDS.to_vec()), 0..80)) {
        let text = words.join(" ");
        try_text(&text, &Always(text.clone()))?;
    }

    #[test]
    fn damaged_rules(
        file in prop::sample::select(vec!["worm.dcg", "solids.dcg", "numbers.dcg", "fence.dcg", "modules.dcg"]),
        changes in prop::collection::vec((0.0..1.0f64, 0usize..6, prop::sample::select(WORDS.to_vec())), 1..6),
    ) {
        let mut text: Vec<char> = golden(file).chars().collect();
        for (place, removed, word) in changes {
            let at = (place * text.len() as f64) as usize;
            let end = (at + removed).min(text.len());
            text.splice(at..end, word.chars());
        }
        let text: String = text.into_iter().collect();
        try_text(&text, &Always(golden("fence.dcg")))?;
    }

    #[test]
    fn the_same_seed_gives_the_same_and_detail_never_takes_away(seed: u32) {
        let program = Program::read("modules.dcg", golden("modules.dcg"), &Always(golden("fence.dcg"))).unwrap();
        let at = |detail| grow(&program, &Settings { seed, detail, ..Settings::default() }).unwrap();
        prop_assert_eq!(at(2), at(2));
        let triangles: Vec<u64> = (0..=4).map(|detail| at(detail).triangles()).collect();
        prop_assert!(triangles.is_sorted(), "{:?}", triangles);
    }
}
