//! Does data still flow one way? Reads the crate graph and the sources, and fails on an edge that nobody decided on. Which
//! crates may know which is said here; for the rooms in `src`, it is the table of docs/ARCHITECTURE.md that says it.

use std::{
    collections::{BTreeMap, BTreeSet},
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
            let code = code_of(&read(&file));
            for word in words.iter().filter(|word| code.contains(**word)) {
                wrong.push(format!("{} holds `{word}`: {reason}", file.display()));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn rooms_import_what_the_table_says_and_stand_below_it() {
    let said = rooms_of_the_table();
    let found = imports();
    let mut wrong = Vec::new();
    let mut above = BTreeSet::from(["crates/bake", "crates/live", "crates/verify", "client"].map(str::to_owned));
    for (room, knows) in &said {
        let used = found.get(room).cloned().unwrap_or_default();
        // Who may know everything is held to nothing but its place in the table.
        if let Some(knows) = knows {
            let more = used
                .difference(knows)
                .map(|other| format!("`{room}` imports `{other}`, which nobody decided on"));
            let fewer = knows
                .difference(&used)
                .map(|other| format!("`{room}` does not use `{other}`"));
            wrong.extend(more.chain(fewer));
        }
        wrong.extend(
            used.difference(&above)
                .map(|other| format!("`{other}` stands below `{room}`")),
        );
        above.insert(room.clone());
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn every_room_has_its_line_in_the_table_and_in_the_tour() {
    let library = read(&root().join("src/lib.rs"));
    let modules: BTreeSet<_> = library
        .lines()
        .filter_map(|line| line.trim_start_matches("pub ").strip_prefix("mod ")?.strip_suffix(';'))
        .collect();
    let table = rooms_of_the_table();
    let rows: BTreeSet<_> = table.iter().map(|(room, _)| room.as_str()).collect();
    assert_eq!(rows, modules, "rows of the table, and modules of src/lib.rs");
    assert_eq!(table.len(), rows.len(), "a room has two rows");
    let tour: Vec<_> = library.lines().filter(|line| line.starts_with("//!")).collect();
    let toured = |module: &str| tour.iter().any(|line| line.contains(&format!("`{module}`")));
    let left_out: Vec<_> = modules.into_iter().filter(|module| !toured(module)).collect();
    assert!(left_out.is_empty(), "not in the tour of src/lib.rs: {left_out:?}");
}

#[test]
fn all_is_read_but_comments_and_the_bodies_of_tests() {
    let text = "\
//! Knows no axum.
#[cfg(test)]
mod tests;

use one::Thing;

#[cfg(test)]
#[allow(dead_code)]
mod inline {
    use two::Thing;
    fn nested() {
    }
}

fn last() {}
";
    let code = code_of(text);
    assert!(code.contains("one::Thing") && code.contains("fn last() {}"), "{code}");
    assert!(
        !code.contains("axum") && !code.contains("two::") && !code.contains("nested"),
        "{code}"
    );
    // A room's first file names its tests near the top; what follows is the room.
    for file in ["src/live/outbox/mod.rs", "crates/bake/src/visibility/mod.rs"] {
        let text = read(&root().join(file));
        let (_, after) = text
            .split_once("#[cfg(test)]\nmod tests;")
            .expect("a room with tests of its own");
        let last = after.lines().rfind(|line| line.contains("fn ")).expect("a function");
        assert!(code_of(&text).contains(last), "{file}: {last}");
    }
}

#[test]
fn imports_are_found_however_they_are_written() {
    let text = "use crate::{a::{X, b::Y}, c};\nuse super::super::{d, e as f};\nfn g(_: crate::h::I) {}\nuse super::j;\nuse belvedere_bake::K;\nuse belvedere_client::L;";
    let found = imports_of(text, 2);
    let expected = ["a", "c", "client", "crates/bake", "d", "e", "h"].map(str::to_owned);
    assert_eq!(found, BTreeSet::from(expected));
}

#[test]
fn no_file_grows_past_what_one_can_hold_in_mind() {
    let folders = ["src", "crates", "client", "viewer/core", "viewer/three", "viewer/ui"];
    let long: Vec<_> = folders
        .iter()
        .flat_map(|folder| sources(&root().join(folder)))
        .map(|file| (read(&file).lines().count(), file))
        .filter(|(lines, _)| *lines > 600)
        .collect();
    assert!(long.is_empty(), "over 600 lines: {long:?}");
}

/// The rooms in `src`, in the order of the table in docs/ARCHITECTURE.md, and what the table says they know, if that is not
/// everything: what stands in code up to the first semicolon.
fn rooms_of_the_table() -> Vec<(String, Option<BTreeSet<String>>)> {
    let page = read(&root().join("docs/ARCHITECTURE.md"));
    let rows = page.lines().filter_map(|line| line.strip_prefix("| `src/"));
    rows.map(|row| {
        let cells: Vec<_> = row.split(" | ").collect();
        let [room, _, knows] = cells[..] else {
            panic!("not three cells: {row}")
        };
        let names = knows.trim_end_matches(" |").split(';').next().unwrap_or_default();
        let known = names.split('`').skip(1).step_by(2).map(str::to_owned).collect();
        let known = (names != "everything").then_some(known);
        (room.trim_end_matches('`').to_owned(), known)
    })
    .collect()
}

/// What each room in `src` imports: other rooms, and our crates, but for that which is for everybody.
fn imports() -> BTreeMap<String, BTreeSet<String>> {
    let src = root().join("src");
    let mut found: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
    for file in sources(&src).into_iter().filter(|file| !is_test(file)) {
        let path = file.strip_prefix(&src).expect("a file in src").with_extension("");
        let mut module: Vec<_> = path.iter().map(|part| part.to_string_lossy()).collect();
        module.pop_if(|last| last == "mod");
        let room = module[0].clone().into_owned();
        let mut used = imports_of(&code_of(&read(&file)), module.len());
        used.remove(&room);
        used.remove("crates/scene");
        found.entry(room).or_default().extend(used);
    }
    found
}

/// What the code of a module that lies so deep below the root of its crate imports from there, and of our crates.
fn imports_of(code: &str, depth: usize) -> BTreeSet<String> {
    let from_the_root = ["crate::".to_owned(), "super::".repeat(depth)];
    let mut found = BTreeSet::new();
    for prefix in from_the_root {
        for (at, _) in code.match_indices(&prefix) {
            // Not the end of a longer path.
            if !code[..at].ends_with([':', '_']) && !code[..at].ends_with(char::is_alphanumeric) {
                found.extend(first_names(&code[at + prefix.len()..]));
            }
        }
    }
    for (at, ours) in code.match_indices("belvedere_") {
        let name = first_names(&code[at + ours.len()..]).concat();
        if code[at + ours.len() + name.len()..].starts_with("::") {
            let folder = if name == "client" {
                name
            } else {
                format!("crates/{name}")
            };
            found.insert(folder);
        }
    }
    found
}

/// The first name of a path, or of each path in braces.
fn first_names(paths: &str) -> Vec<String> {
    let name = |path: &str| -> String {
        let path = path.trim_start().chars();
        path.take_while(|c| c.is_alphanumeric() || *c == '_').collect()
    };
    let Some(inside) = paths.strip_prefix('{') else {
        return vec![name(paths)];
    };
    let (mut depth, mut names, mut begin) = (0, Vec::new(), 0);
    for (at, c) in inside.char_indices() {
        match c {
            '{' => depth += 1,
            '}' if depth == 0 => {
                names.push(name(&inside[begin..at]));
                break;
            }
            '}' => depth -= 1,
            ',' if depth == 0 => {
                names.push(name(&inside[begin..at]));
                begin = at + 1;
            }
            _ => {}
        }
    }
    names.retain(|name| !name.is_empty());
    names
}

/// A source without lines that are comments and without modules of tests that stand in it. What is laid out by rustfmt ends
/// where a brace stands as far left as it began.
fn code_of(text: &str) -> String {
    let mut code = String::new();
    let mut lines = text.lines().filter(|line| !line.trim_start().starts_with("//"));
    while let Some(line) = lines.next() {
        let indent = &line[..line.len() - line.trim_start().len()];
        let mut kept = vec![line];
        let begun = line.trim_start();
        if begun.starts_with("#[cfg(test)]") || begun.starts_with("#[cfg(all(test,") {
            let attribute = |line: &&str| line.trim_start().starts_with("#[");
            while kept.last().is_some_and(attribute)
                && let Some(next) = lines.next()
            {
                kept.push(next);
            }
            let item = kept.last().copied().unwrap_or_default();
            if item.contains("mod ") && item.ends_with('{') {
                lines.by_ref().find(|line| line.strip_prefix(indent) == Some("}"));
                kept.clear();
            }
        }
        for line in kept {
            code.push_str(line);
            code.push('\n');
        }
    }
    code
}

fn read(file: &Path) -> String {
    fs::read_to_string(file).unwrap_or_else(|e| panic!("{}: {e}", file.display()))
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
