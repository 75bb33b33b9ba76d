//! Does every limit end what goes beyond it, and in the words of `docs/PROCEDURAL.md`? For each row of its table there is a
//! model that takes more, and no limit of the evaluation is missing there.

#![allow(clippy::unwrap_used, reason = "a test may fail at any step")]

use std::fs;
use std::path::Path;

use belvedere_scene::procedural::{Limits, Loader, Program, Settings, Usage, grow};

/// Each file imports the next one; those that are called long have a long comment before.
struct Chain;

impl Loader for Chain {
    fn load(&self, path: &str) -> Result<String, String> {
        let (kind, number) = path.rsplit_once(' ').unwrap_or(("short", path));
        let number: u32 = number.parse().map_err(|_| "there is no such file".to_owned())?;
        let comment = "/".repeat(if kind == "long" { 1 << 19 } else { 0 });
        Ok(format!("{comment}\nimport \"{kind} {}\" as next", number + 1))
    }
}

/// Rows `what`, `at most` and `what is said of more`.
fn rows() -> Vec<[String; 3]> {
    let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/PROCEDURAL.md");
    let page = fs::read_to_string(page).unwrap();
    let (_, table) = page
        .split_once("| what | at most | what is said of more |\n|---|---|---|\n")
        .unwrap();
    let rows = table.lines().take_while(|line| line.starts_with('|'));
    rows.map(|row| {
        let cells: Vec<String> = row
            .trim_matches('|')
            .split('|')
            .map(|cell| cell.trim().to_owned())
            .collect();
        cells.try_into().unwrap()
    })
    .collect()
}

/// What takes more than a row of the table allows, by how the row begins.
fn too_much(what: &str) -> String {
    let polygon = |corners: usize| (0..corners).map(|i| format!("[{i}, {}],", i * i)).collect::<String>();
    match what {
        "calls inside each other" => "rule a() { a() } a()".to_owned(),
        "the same, where a function is called" => "function f(x) = f(x) let a = f(1)".to_owned(),
        "transforms, loops and conditions around one another in a text, `else if` too" => {
            format!("{}box(1, 1, 1)", "move(1, 0, 0) ".repeat(257))
        }
        "calls, blocks and expressions inside each other" => {
            format!("rule a() {} a() {} a()", "{".repeat(20), "}".repeat(20))
        }
        "nodes visited, and with them time" => "for i in 1e6 for j in 1e6 {}".to_owned(),
        "triangles, each part once" => "heights x, z in 1 by 1 steps 4096 by 4096 = 0".to_owned(),
        "parts" => "part a(n) {} for i in 1e6 a(i)".to_owned(),
        "parts, glTF files and viewpoints placed" => "part a(n) { if n > 0 { a(n - 1) a(n - 1) } } a(40)".to_owned(),
        "materials" => "material m(n) {} for i in 1e6 paint m(i) {}".to_owned(),
        "numbers in a list, with the lists in it and itself" => {
            "rule a(n, l) { a(n + 1, [l, l]) } a(0, [1])".to_owned()
        }
        "lists inside each other" => (0..70).fold("let a0 = 1".to_owned(), |text, i| {
            format!("{text} let a{} = [a{i}]", i + 1)
        }),
        "brackets, blocks and signs inside each other in a text" => format!("let a = {}1", "(".repeat(100)),
        "operators in a row" => format!("let a = 1{}", " + 1".repeat(65)),
        _ if what.starts_with("letters of a name") => format!("rule {}() {{}}", "x".repeat(256)),
        "bytes of a file" => " ".repeat((1 << 20) + 1),
        "bytes of all files" => "import \"long 1\" as next".to_owned(),
        "files" => "import \"1\" as next".to_owned(),
        "corners of a polygon or profile, and their coordinates" => format!("prism([{}], 1)", polygon(257)),
        "corners of a `polygon`, off its plane" => "polygon([[0, 0, 0], [2, 0, 0], [2, 2, 0.5], [0, 2, 0]])".to_owned(),
        "corners of a face" => format!("polygon([{}])", polygon(257).replace(']', ", 0]")),
        "coordinates of points" => "polygon([[0, 0, 0], [1, 0, 0], [0, 1000001, 0]])".to_owned(),
        "lengths of solids" => "box(1, 1, 1000001)".to_owned(),
        "sides" => "sphere(1, 257)".to_owned(),
        _ if what.starts_with("steps of a height field") => "heights x, z in 1 by 1 steps 4097 by 1 = 0".to_owned(),
        "width and depth of a height field" => "heights x, z in 0 by 1 steps 1 by 1 = 0".to_owned(),
        "heights of a field" => "heights x, z in 1 by 1 steps 1 by 1 = 1000001".to_owned(),
        "turns of a loop, points of `scatter`" => "scatter 1048577 as x, z in 1 by 1 {}".to_owned(),
        "width and depth of `scatter`" => "scatter 1 as x, z in 1 by 1000001 {}".to_owned(),
        "moves, angles and scales" => "turn(1000000001) {}".to_owned(),
        "scales, towards 0" => "scale(0.0000009) {}".to_owned(),
        "where moves and scales lead together" => "scale(1000) move(1000001, 0, 0) {}".to_owned(),
        "powers" => "let a = power(1, 65)".to_owned(),
        "octaves" => "let a = fractal(0, 0, 17)".to_owned(),
        "coordinates of noise" => "let a = noise(0, -1000000001)".to_owned(),
        "results" => "let a = 1e308 * 10".to_owned(),
        "roughness and the like, channels of colours" => "material m { roughness = 2 } paint m {}".to_owned(),
        "sizes of an impostor" => "impostor(size = -2)".to_owned(),
        "views of an impostor" => "impostor(views = 13)".to_owned(),
        "frames of an impostor" => "impostor(frames = 17)".to_owned(),
        "stride of an impostor" => "impostor(stride = 0)".to_owned(),
        "height of an impostor's atlas" => "impostor(size = 128, frames = 16)".to_owned(),
        "numbers of a face's corners" => "mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2], [0, 1, 3.5]])".to_owned(),
        _ if what.starts_with("numbers in lists that are needed at once") => {
            "function long(n) = if n < 1 then [0] else [long(n - 1), long(n - 1)] let big = long(14)
             rule r(n) { let l = mix(big, big, n) if n > 0 r(n - 1) } r(60)"
                .to_owned()
        }
        _ if what.starts_with("numbers kept") => format!("for i in 140000 viewpoint \"{}\"", "x".repeat(255)),
        _ => panic!("nothing takes more of this: {what}"),
    }
}

#[test]
fn what_goes_beyond_a_limit_is_told_in_the_words_of_the_documentation() {
    // A thousand million nodes take too long here.
    let limits = Limits {
        steps: 5_000_000,
        ..Limits::default()
    };
    let settings = Settings {
        limits,
        ..Settings::default()
    };
    let rows = rows();
    assert!(rows.len() > 30, "{} rows", rows.len());
    for [what, _, said] in rows {
        // Whoever bakes says that, and is asked whether in these words.
        if what.ends_with(", in a bake") {
            continue;
        }
        let said = said.replace("1000000000 steps", "5000000 steps");
        let program = Program::read("0", too_much(&what), &Chain);
        let error = program.and_then(|program| grow(&program, &settings)).expect_err(&what);
        assert_eq!(error.problem.to_string(), said, "{what}");
    }
}

#[test]
fn every_limit_of_the_evaluation_is_documented() {
    let rows = rows();
    for (name, _, limit) in Usage::default().of(&Limits::default()) {
        let told = format!("more than {limit} ");
        let row = rows
            .iter()
            .find(|[.., said]| said.starts_with(&told) && said.contains(name));
        let [_, most, _] = row.unwrap_or_else(|| panic!("{name}, {limit}"));
        assert_eq!(most.replace(',', ""), limit.to_string(), "{name}");
    }
}
