//! Do the same rules give the same bits every day, and in TypeScript? `tests/golden/procedural` holds rules, the settings
//! with which each is grown (`cases.json`) and what they give (`grown.json`), and wrong rules with what is said of them
//! (`mistakes.json`; to add one, its `text` is enough). `viewer/core/procedural/golden.test.ts` reads the same files. `make
//! bless` writes what is given and said in the two last ones.

#![allow(clippy::unwrap_used, reason = "a test may fail at any step")]

use std::fs;
use std::path::{Path, PathBuf};

use belvedere_scene::procedural::{
    Grown, Loader, Mesh, NoImports, Program, Settings, Surface, Value, affine::Affine, grow, grow_part,
};
use serde_json::{Value as Json, json};
use sha2::{Digest, Sha256};

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/golden/procedural")
}

struct Beside(PathBuf);

impl Loader for Beside {
    fn load(&self, path: &str) -> Result<String, String> {
        fs::read_to_string(self.0.join(path)).map_err(|cause| cause.to_string())
    }
}

fn program(case: &Json) -> Program {
    let path = folder().join(format!("{}.dcg", case["file"].as_str().unwrap()));
    let text = fs::read_to_string(&path).unwrap();
    let name = path.file_name().unwrap().to_str().unwrap();
    Program::read(name, text, &Beside(path.parent().unwrap().to_owned())).unwrap()
}

fn grown(case: &Json) -> Grown {
    let parameters = case["parameters"].as_object().into_iter().flatten();
    let settings = Settings {
        seed: case["seed"].as_u64().unwrap_or(0) as u32,
        detail: case["detail"].as_u64().unwrap_or(4) as u32,
        parameters: parameters
            .map(|(name, value)| (name.clone(), Value::from_json(value).unwrap()))
            .collect(),
        ..Settings::default()
    };
    grow(&program(case), &settings).unwrap()
}

/// Everything that was grown, as little-endian bytes in order.
fn hash(grown: &Grown) -> String {
    let mut sum = Sha256::new();
    let count = |sum: &mut Sha256, count: usize| sum.update((count as u32).to_le_bytes());
    let frame = |sum: &mut Sha256, frame: &Affine| frame.columns().iter().for_each(|v| sum.update(v.to_le_bytes()));
    for part in &grown.parts {
        sum.update(part.name.as_bytes());
        count(&mut sum, part.meshes.len());
        for Mesh {
            material,
            positions,
            normals,
            indices,
        } in &part.meshes
        {
            count(&mut sum, *material);
            count(&mut sum, positions.len());
            count(&mut sum, indices.len());
            positions
                .iter()
                .chain(normals)
                .flatten()
                .for_each(|v| sum.update(v.to_le_bytes()));
            indices.iter().for_each(|i| sum.update(i.to_le_bytes()));
        }
        count(&mut sum, part.placements.len());
        for placement in &part.placements {
            count(&mut sum, placement.part);
            frame(&mut sum, &placement.frame);
        }
        let asked = part.impostor.iter();
        let asked = asked.flat_map(|wish| [wish.views, wish.size_px, u32::from(wish.below)]);
        asked.for_each(|number| count(&mut sum, number as usize));
        for wish in part.impostor.iter().filter(|wish| wish.frames > 1) {
            count(&mut sum, wish.frames as usize);
            sum.update(wish.stride.to_le_bytes());
        }
        for (name, place) in part.viewpoints.iter().chain(&part.models) {
            sum.update(name.as_bytes());
            frame(&mut sum, place);
        }
    }
    for instance in grown.instances() {
        sum.update(instance.name.as_bytes());
        frame(&mut sum, &instance.world_from_part);
    }
    for surface in &grown.materials {
        sum.update(surface.name.as_bytes());
        let shares = [
            surface.roughness,
            surface.metallic,
            surface.opacity,
            f64::from(surface.double_sided),
        ];
        let numbers = surface.colour.iter().chain(&surface.emissive).chain(&shares);
        numbers.for_each(|v| sum.update(v.to_le_bytes()));
        if surface.recolour {
            sum.update(b"recolour");
        }
    }
    sum.finalize().iter().map(|byte| format!("{byte:02x}")).collect()
}

/// Everything that a part looks like: its meshes, with their materials spelt out.
fn looks(grown: &Grown, part: usize) -> Vec<(Mesh, Surface)> {
    let meshes = grown.parts[part].meshes.iter();
    let looks = meshes.map(|mesh| {
        (
            Mesh {
                material: 0,
                ..mesh.clone()
            },
            grown.materials[mesh.material].clone(),
        )
    });
    looks.collect()
}

/// Compares with a golden file, or writes it when blessing.
fn check(name: &str, found: &Json) {
    let path = folder().join(name);
    let text = format!("{found:#}\n");
    if std::env::var_os("BELVEDERE_BLESS").is_some() {
        fs::write(&path, &text).unwrap();
    }
    let golden = fs::read_to_string(&path).unwrap();
    assert_eq!(golden, text, "{name} differs; if that is meant, `make bless`");
}

#[test]
fn what_grows_is_what_grew_before() {
    let cases: Vec<Json> = serde_json::from_slice(&fs::read(folder().join("cases.json")).unwrap()).unwrap();
    let found = cases.iter().map(|case| {
        let grown = grown(case);
        let usage = grown.usage;
        json!({
            "case": case,
            "hash": hash(&grown),
            "triangles": usage.triangles,
            "steps": usage.steps,
            "levels": usage.levels,
            "nesting": usage.nesting,
            "parts": usage.parts,
            "placements": usage.placements,
            "materials": usage.materials,
            "kept": usage.kept,
            "files": usage.files,
            "bounds": grown.parts[0].bounds,
        })
    });
    check("grown.json", &found.collect());
}

#[test]
fn parts_that_can_be_made_alone_are_the_same_alone() {
    let town = json!({"file": "../../../content/town", "seed": 3, "parameters": {"reach": 2}});
    let town_parts = grown(&town).parts;
    let drawn = town_parts
        .iter()
        .filter(|part| !part.meshes.is_empty() && part.called.is_none());
    let alone = town_parts.iter().filter(|part| part.recipe.is_some());
    assert!(alone.count() > drawn.count() * 3 / 4);
    for case in [&town, &json!({"file": "modules", "seed": 5})] {
        let (whole, program) = (grown(case), program(case));
        let settings = Settings {
            seed: case["seed"].as_u64().unwrap() as u32,
            ..Settings::default()
        };
        let folder = folder()
            .join(case["file"].as_str().unwrap())
            .parent()
            .unwrap()
            .to_owned();
        let mut alone = 0;
        for (index, part) in whole.parts.iter().enumerate() {
            let Some(recipe) = &part.recipe else { continue };
            let published = Program::read("alone", recipe.text(), &Beside(folder.clone())).unwrap();
            let again = grow(&published, &settings).unwrap();
            assert_eq!(looks(&again, 1), looks(&whole, index), "{}", recipe.text());
            let again = grow_part(&program, (recipe, None), &settings).unwrap();
            assert_eq!(looks(&again, 1), looks(&whole, index), "{}", recipe.text());
            alone += 1;
        }
        assert!(alone > 2, "{alone} parts");
    }
}

#[test]
fn mistakes_are_called_what_they_were_called_before() {
    let mistakes: Vec<Json> = serde_json::from_slice(&fs::read(folder().join("mistakes.json")).unwrap()).unwrap();
    let said = mistakes.iter().map(|mistake| {
        let text = mistake["text"].as_str().unwrap();
        let program = Program::read("test.dcg", text.to_owned(), &NoImports);
        let error = program
            .and_then(|program| grow(&program, &Settings::default()))
            .expect_err(text);
        json!({"text": text, "said": error.to_string()})
    });
    check("mistakes.json", &said.collect());
}
