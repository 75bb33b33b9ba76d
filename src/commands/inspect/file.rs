//! What is in a source file, before it is baked?

use std::{path::Path, time::Instant};

use anyhow::Context;
use belvedere_bake::{
    BakeSettings, as_published,
    defect::{Defect, Defects},
    growable::Growable,
    import::{
        self, Imported, Limits,
        procedural::{Ground, Growth, plant},
    },
    progress::Silent,
};
use serde::Serialize;

use super::super::{
    grow,
    growing::Growing,
    output::{bytes, counted, print, print_json},
    sowing::{GrowthArgs, refuse_given, told},
};
use crate::publish::source_files::{MOST_OF_A_SOURCE, SourceFolder, read_named};

/// What a source file holds, before anything is baked.
#[derive(Debug, Serialize)]
struct FileReport {
    objects: usize,
    models: usize,
    triangles: usize,
    materials: usize,
    textures: usize,
    image_bytes: usize,
    viewpoints: usize,
    /// Which of the models that a bake publishes of it clients can grow from rules.
    growable: Growable,
    /// Why a bake would refuse it.
    #[serde(skip_serializing_if = "Option::is_none")]
    refused: Option<String>,
    defects: Vec<Defect>,
    /// What growing it took, when it is a file of rules.
    #[serde(skip_serializing_if = "Option::is_none")]
    growth: Option<grow::Report>,
}

pub(super) fn inspect(file: &Path, given: GrowthArgs, json: bool) -> anyhow::Result<()> {
    let limits = Limits::default();
    let bytes_read = read_named(file, (limits.memory_bytes, MOST_OF_A_SOURCE))?;
    let name = file.file_name().unwrap_or_default().to_string_lossy();
    let ground = Ground {
        files: &SourceFolder::beside(file),
        limits: &limits,
        progress: &Growing::new(),
    };
    let (imported, mut growth) = if import::is_rules(&name) {
        let settings = given.try_into()?;
        let started = Instant::now();
        let growth = plant(&name, bytes_read, &settings, ground)
            .map_err(told)
            .with_context(|| format!("cannot grow {name}"))?;
        let report = grow::Report::of(&growth, &settings, started.elapsed());
        let Growth { scene, defects, .. } = growth;
        (Imported { scene, defects }, Some(report))
    } else {
        refuse_given(&given, &format!("{name} is none"))?;
        let imported = import::import(&name, bytes_read, ground.files, ground.limits, &Silent);
        (imported.with_context(|| format!("cannot import {name}"))?, None)
    };
    let Imported { scene, defects } = imported;
    // Told once, of rules as of any other file.
    let refused = match &mut growth {
        Some(growth) => growth.refused.take(),
        None => grow::refusal(&scene),
    };
    let mut report = FileReport {
        objects: scene.objects.len(),
        models: scene.models.len(),
        triangles: scene.placed_triangles(),
        materials: scene.materials.len(),
        textures: scene.textures.len(),
        image_bytes: scene.images.iter().map(|i| i.bytes.len()).sum(),
        viewpoints: scene.viewpoints.len(),
        growable: Growable::default(),
        refused,
        defects: defects.iter().collect(),
        growth,
    };
    let split = BakeSettings::default().split;
    report.growable = Growable::of(&as_published(scene, &split, &mut Defects::default()));
    if json {
        return print_json(&report);
    }
    print(&format!(
        "{name}: {} of {}, {} drawn, {}, {} ({}), {}",
        counted(report.objects, "object"),
        counted(report.models, "model"),
        counted(report.triangles, "triangle"),
        counted(report.materials, "material"),
        counted(report.textures, "texture"),
        bytes(report.image_bytes as u64),
        counted(report.viewpoints, "viewpoint"),
    ))?;
    if let Some(growth) = &report.growth {
        print(&growth.sentences(&name))?;
    }
    if let Some(refused) = &report.refused {
        print(&format!("  {refused}"))?;
    }
    if let Some(told) = report.growable.sentence() {
        print(&format!("  {told}"))?;
    }
    for defect in &report.defects {
        print(&format!("  {defect}"))?;
    }
    Ok(())
}
