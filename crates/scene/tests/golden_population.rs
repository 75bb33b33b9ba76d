//! Do Rust and TypeScript read the same of a population? `tests/golden/population/village.pop` is one, `village.json` what it
//! says; `viewer/core/documents/population.test.ts` reads both. `make bless` writes them.

#![allow(clippy::unwrap_used, reason = "a test may fail at any step")]

use std::{collections::BTreeMap, env, fs, path::Path};

use belvedere_scene::{
    BlobName, ModelId, ObjectId,
    object::Import,
    population::{Member, Population, Recipe, Rules},
};
use serde_json::{Value, json};

/// The first id of the run of objects that the village lies in.
const FIRST: ObjectId = ObjectId(512);

/// Two files of rules, of which one imports the other; recipes with and without a part, a list and a seed; members far from the
/// origin of the world, turned about every axis, small and large.
fn village() -> Population {
    let file = |text: &str| BlobName::of(text.as_bytes(), "dcg").unwrap();
    let rules = |text: &str, imports: &[&str]| Rules {
        url: file(text),
        bytes: text.len() as u64,
        imports: imports
            .iter()
            .map(|name| {
                let (url, bytes) = (file(name), name.len() as u64);
                ((*name).to_owned(), Import { url, bytes })
            })
            .collect(),
    };
    let recipe = |rules: usize, part: Option<&str>, parameters: Value, seed: u32, triangles: u64| Recipe {
        rules,
        part: part.map(str::to_owned),
        parameters: serde_json::from_value::<BTreeMap<String, Value>>(parameters).unwrap(),
        seed,
        model: ModelId(rules as u32 * 40 + seed),
        triangles,
    };
    let member = |object: u32, recipe: usize, axis: [f64; 3], turn: f64, scale: f64| {
        let along = turn.sin() / axis.iter().map(|x| x * x).sum::<f64>().sqrt();
        let [x, y, z] = axis.map(|x| x * along);
        let away = f64::from(object - FIRST.0);
        Member {
            object: ObjectId(object),
            recipe,
            position: [81_234.5 + 3.7 * away, 0.25 - away, -9_876.5 + away * away],
            rotation: [x, y, z, turn.cos()],
            scale,
        }
    };
    Population {
        rules: vec![rules("houses", &["timber.dcg", "roofs.dcg"]), rules("trees", &[])],
        recipes: vec![
            recipe(0, Some("townhouse"), json!({"width": 11.6, "floors": 4}), 0, 1204),
            recipe(
                0,
                Some("barn"),
                json!({"footprint": [[0, 0], [8.5, 0], [8.5, 6]]}),
                7,
                96,
            ),
            recipe(1, None, json!({}), 3, 20),
        ],
        members: vec![
            member(512, 0, [0.0, 1.0, 0.0], 0.3, 1.0),
            member(513, 2, [0.0, 1.0, 0.0], -1.5, 0.125),
            member(640, 1, [1.0, 2.0, -2.0], 0.7, 1.0),
            member(767, 0, [-3.0, 0.5, 1.0], 3.0, 40.0),
        ],
    }
}

#[test]
fn a_population_is_written_as_it_was_and_says_what_it_said() {
    let bytes = village().encode(FIRST);
    let read = Population::decode(&bytes, FIRST, 256).unwrap();
    let members = read.members.iter().map(|member| {
        let procedural = read.procedural(member.recipe).unwrap();
        let recipe = &read.recipes[member.recipe];
        json!({
            "object": member.object, "model": recipe.model, "triangles": recipe.triangles, "scale": member.scale,
            "transform": member.transform(), "procedural": procedural,
        })
    });
    let told = format!(
        "{:#}\n",
        json!({"first": FIRST.0, "members": members.collect::<Value>()})
    );
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/golden/population");
    let (population, says) = (folder.join("village.pop"), folder.join("village.json"));
    if env::var_os("BELVEDERE_BLESS").is_some() {
        fs::create_dir_all(&folder).unwrap();
        fs::write(&population, &bytes).unwrap();
        fs::write(&says, &told).unwrap();
    }
    let same = fs::read(&population).unwrap() == bytes && fs::read_to_string(&says).unwrap() == told;
    assert!(same, "other bytes than before; `make bless` if that is meant");
}
