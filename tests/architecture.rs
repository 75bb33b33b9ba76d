//! Does data still flow one way? Reads the crate graph and the sources, and fails on an edge that nobody decided on.

use std::{
    collections::BTreeMap,
    fs,
    path::{Path, PathBuf},
    process::Command,
};

/// Which of our crates each of our crates may know.
const ALLOWED: &[(&str, &[&str])] = &[
    (
        "belvedere",
        &[
            "belvedere-bake",
            "belvedere-client",
            "belvedere-live",
            "belvedere-scene",
            "belvedere-verify",
        ],
    ),
    ("belvedere-bake", &["belvedere-scene"]),
    ("belvedere-client", &["belvedere-scene"]),
    ("belvedere-fuzz", &["belvedere-bake", "belvedere-scene"]),
    (
        "belvedere-evaluation",
        &[
            "belvedere-bake",
            "belvedere-client",
            "belvedere-live",
            "belvedere-scene",
        ],
    ),
    ("belvedere-live", &["belvedere-scene"]),
    ("belvedere-scene", &[]),
    ("belvedere-verify", &["belvedere-scene"]),
];

/// Words that a folder's sources must not hold outside their tests, and why.
const FORBIDDEN: &[(&str, &[&str], &str)] = &[
    (
        "src/http",
        &["sqlx", "object_store"],
        "http asks the catalogue and the store; it knows neither SQL nor backends",
    ),
    (
        "src/db",
        &["axum", "object_store"],
        "the catalogue knows no HTTP and no blobs",
    ),
    ("src/store", &["axum", "sqlx"], "the store knows no HTTP and no SQL"),
    (
        "src/jobs",
        &["axum", "sqlx", "object_store"],
        "jobs know no HTTP, no SQL and no backends",
    ),
    (
        "src",
        &["env::var(", "env::var_os("],
        "settings are read in one place, by clap",
    ),
    (
        "src/commands",
        &["std::env"],
        "what stands in the environment is for the room of settings to know",
    ),
    (
        "crates/scene/src",
        &["tokio", "async fn", "std::fs", "std::time"],
        "the format does no I/O",
    ),
    (
        "crates/bake/src",
        &["tokio", "async fn", "std::fs", "std::time", "std::env", "println!"],
        "the bake is pure",
    ),
    (
        "crates/live/src",
        &[
            "tokio",
            "async fn",
            "std::fs",
            "std::time",
            "std::env",
            "println!",
            "tracing",
        ],
        "the online rules are a function of their inputs and the time",
    ),
    (
        "src/live",
        &["axum", "sqlx", "object_store", "belvedere_bake"],
        "live sessions know no wire and read what was published",
    ),
    (
        "client/src/strategy",
        &[
            "tokio",
            "reqwest",
            "async fn",
            "std::fs",
            "std::time",
            "std::env",
            "println!",
        ],
        "the strategy is a function of what it is told, so that a simulated line and a real one carry out the same",
    ),
    (
        "client/src/live/state",
        &[
            "tokio",
            "reqwest",
            "async fn",
            "std::fs",
            "std::time",
            "std::env",
            "println!",
        ],
        "what a session is told adds up without a server",
    ),
    (
        "crates/verify/src",
        &[
            "belvedere_bake",
            "obvhs",
            "tokio",
            "async fn",
            "std::fs",
            "std::time",
            "std::env",
            "println!",
        ],
        "the oracle is pure, and an oracle that shares code with the bake shares its errors",
    ),
    (
        "viewer/core",
        &["from 'three", "from \"three", "../three/", "../ui/"],
        "core knows no renderer and no page",
    ),
];

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

#[test]
fn crates_know_only_what_the_plan_allows() {
    let output = Command::new(env!("CARGO"))
        .args(["metadata", "--no-deps", "--format-version", "1", "--offline"])
        .current_dir(root())
        .output()
        .expect("cargo runs");
    let metadata: serde_json::Value = serde_json::from_slice(&output.stdout).expect("cargo metadata prints JSON");
    let mut found = BTreeMap::new();
    for package in metadata["packages"].as_array().expect("packages") {
        let ours = package["dependencies"]
            .as_array()
            .expect("dependencies")
            .iter()
            .filter(|d| d["kind"] != "dev" && d["name"].as_str().is_some_and(|n| n.starts_with("belvedere")));
        let mut names: Vec<_> = ours.map(|d| d["name"].as_str().expect("a name").to_owned()).collect();
        names.sort();
        found.insert(package["name"].as_str().expect("a name").to_owned(), names);
    }
    let allowed: BTreeMap<_, Vec<_>> = ALLOWED
        .iter()
        .map(|(name, known)| ((*name).to_owned(), known.iter().map(|k| (*k).to_owned()).collect()))
        .collect();
    assert_eq!(found, allowed);
}

#[test]
fn rooms_do_not_reach_for_what_is_not_theirs() {
    let mut wrong = Vec::new();
    for (folder, words, reason) in FORBIDDEN {
        let mut files = sources(&root().join(folder));
        files.retain(|file| !is_test(file));
        assert!(!files.is_empty(), "{folder} has no sources; mend this table");
        for file in files {
            let text = fs::read_to_string(&file).expect("a source file is text");
            let code = text.split("#[cfg(test)]").next().unwrap_or_default();
            for word in words.iter().filter(|word| code.contains(**word)) {
                wrong.push(format!("{} holds `{word}`: {reason}", file.display()));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn nothing_imports_http_or_the_commands() {
    for folder in ["src/db", "src/jobs", "src/live", "src/store", "src/publish"] {
        for file in sources(&root().join(folder)) {
            let text = fs::read_to_string(&file).expect("a source file is text");
            assert!(
                !text.contains("crate::http") && !text.contains("crate::commands"),
                "{}",
                file.display()
            );
        }
    }
}

#[test]
fn no_file_grows_past_what_one_can_hold_in_mind() {
    let folders = ["src", "crates", "client", "viewer/core", "viewer/three", "viewer/ui"];
    let long: Vec<_> = folders
        .iter()
        .flat_map(|folder| sources(&root().join(folder)))
        .map(|file| {
            (
                fs::read_to_string(&file)
                    .expect("a source file is text")
                    .lines()
                    .count(),
                file,
            )
        })
        .filter(|(lines, _)| *lines > 600)
        .collect();
    assert!(long.is_empty(), "over 600 lines: {long:?}");
}

/// Whether a source holds only tests.
fn is_test(file: &Path) -> bool {
    let stem = file.file_stem().unwrap_or_default().to_string_lossy();
    stem == "tests" || stem.ends_with("_tests") || stem.ends_with(".test")
}

fn sources(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    let Ok(entries) = fs::read_dir(folder) else {
        return found;
    };
    for entry in entries {
        let path = entry.expect("a folder can be listed").path();
        if path.is_dir()
            && path
                .file_name()
                .is_none_or(|name| name != "node_modules" && name != "dist")
        {
            found.extend(sources(&path));
        } else if path.extension().is_some_and(|ext| ext == "rs" || ext == "ts") {
            found.push(path);
        }
    }
    found
}
