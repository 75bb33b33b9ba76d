//! How fast do rules become triangles? One core, CPU time of this thread; prints Markdown. `cargo bench -p belvedere-scene`, for
//! one model alone with its name: `cargo bench -p belvedere-scene --bench growing -- tree.dcg`.

#![allow(clippy::print_stdout, reason = "that is what a bench is for")]

use std::{env, fs, path::Path};

use belvedere_scene::procedural::{Loader, Program, Settings, grow};

/// Each model is grown again until so much time has passed.
const LEAST_S: f64 = 1.0;
/// So many triangles grow between looks at the clock, which take longer than some models.
const UNWATCHED: u64 = 100_000;

const POSTS: &str = "for i in 400 for j in 400 move(i, 0, j) box(0.5, 1, 0.5)";
const COLUMNS: &str = "for i in 200 for j in 200 move(i, 0, j) turn(i) cylinder(0.4, 3)";
const BALLS: &str = "for i in 60 for j in 60 move(i, 0, j) sphere(0.4, sides = 24)";
const WAVES: &str = "heights x, z in 100 by 100 steps 1000 by 1000 = x * z / 100";

struct Content;

impl Loader for Content {
    fn load(&self, path: &str) -> Result<String, String> {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../content");
        fs::read_to_string(folder.join(path)).map_err(|cause| cause.to_string())
    }
}

/// CPU time of this thread so far, in seconds: the machine may be busy with other things.
fn cpu_s() -> f64 {
    let stat = fs::read_to_string("/proc/thread-self/schedstat").unwrap_or_default();
    let nanoseconds = stat.split(' ').next().and_then(|n| n.parse::<f64>().ok());
    nanoseconds.unwrap_or(0.0) * 1e-9
}

fn main() {
    println!("| model | triangles | steps | triangles/s |\n|---|---|---|---|");
    let texts = [
        ("boxes", POSTS),
        ("cylinders", COLUMNS),
        ("spheres", BALLS),
        ("a height field", WAVES),
    ];
    let own = texts.map(|(name, text)| (name.to_owned(), text.to_owned()));
    let content = ["tree.dcg", "conifer.dcg", "terrain.dcg", "town.dcg"];
    let content = content.map(|file| (file.to_owned(), Content.load(file).expect("the content is there")));
    let wanted = env::args().skip(1).find(|argument| !argument.starts_with('-'));
    let models = own.into_iter().chain(content);
    for (name, text) in models.filter(|(name, _)| wanted.as_ref().is_none_or(|wanted| wanted == name)) {
        let program = Program::read(&name, text, &Content).expect("the rules are sound");
        let (mut triangles, mut times) = (0, 0);
        let start = cpu_s();
        let mut usage = belvedere_scene::procedural::Usage::default();
        let mut last = None;
        while cpu_s() - start < LEAST_S {
            let watched = triangles;
            while triangles - watched < UNWATCHED {
                let grown = grow(&program, &Settings::default()).expect("the rules grow");
                usage = grown.usage;
                triangles += usage.triangles;
                times += 1;
                // The last model stays until the next has grown: else its memory would go back to the system, page by page,
                // and be asked for again.
                last.replace(grown);
            }
        }
        let rate = triangles as f64 / (cpu_s() - start) / 1e6;
        println!(
            "| {name} | {} | {} | {rate:.1} M, {times} times |",
            usage.triangles, usage.steps
        );
    }
}
