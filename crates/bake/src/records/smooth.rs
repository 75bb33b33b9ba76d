//! What does each model cost as a smooth LOD? Writes the streams of those models for which that pays, and the materials
//! that they name.

use std::collections::BTreeSet;

use belvedere_scene::{
    object::TextureRef,
    rung::{Rung, RungName, SLOD, SmoothLod},
    smooth::Header,
};
use rayon::prelude::*;

use super::{BakeError, sink::Ledger, sizes::Pictures};
use crate::{
    glb,
    lod::LodSettings,
    progress::{Progress, Stage},
    smooth::{
        self, publish,
        quantise::{QuantisedMesh, materials},
    },
    source::SourceModel,
};

/// The smooth LOD of each model, stored.
pub(super) fn write(
    pictures: &Pictures<'_>,
    settings: &LodSettings,
    ledger: &Ledger<'_>,
    progress: &dyn Progress,
) -> Result<Vec<Option<SmoothLod>>, BakeError> {
    let scene = pictures.scene;
    let mut scales = vec![0.0f64; scene.models.len()];
    for object in &scene.objects {
        let scale = &mut scales[object.model];
        *scale = scale.max(object.largest_scale());
    }
    // The triangles of each that gets one.
    let costs = scene.models.iter().map(|model| {
        let triangles = model.triangle_count() as u64;
        publish::is_worthwhile(model, &scene.materials).then_some(triangles)
    });
    let costs: Vec<Option<u64>> = costs.collect();
    progress.start(Stage::Smooth, costs.iter().flatten().sum());
    let written = scene
        .models
        .par_iter()
        .zip(scales)
        .zip(&costs)
        .map(|((model, scale), cost)| {
            if progress.cancelled() {
                return Err(BakeError::Cancelled);
            }
            let Some(triangles) = cost else { return Ok(None) };
            let mesh = QuantisedMesh::new(model, publish::precision(model, &scene.materials, scale));
            let bytes = smooth::encode(&mesh).filter(|bytes| bytes.len() < publish::plain_bytes(model));
            let smooth = bytes.map(|bytes| write_one((model, &mesh), bytes, (pictures, settings), ledger));
            progress.advance(*triangles);
            Ok(smooth.transpose()?.flatten())
        });
    written.collect()
}

/// `None` where the stream would lack something.
fn write_one(
    (model, mesh): (&SourceModel, &QuantisedMesh),
    bytes: Vec<u8>,
    (pictures, settings): (&Pictures<'_>, &LodSettings),
    ledger: &Ledger<'_>,
) -> Result<Option<SmoothLod>, BakeError> {
    const READS: &str = "a reader reads what was just written";
    let scene = pictures.scene;
    let (header, _) = Header::read(&bytes).expect(READS).expect(READS);
    let errors = publish::geometric_errors(model, mesh, &bytes, settings).expect(READS);
    if !errors
        .last()
        .is_some_and(|error| publish::is_whole(model, mesh, *error, settings.error_limits))
    {
        return Ok(None);
    }
    let (url, bytes) = ledger.put(SLOD, bytes)?;
    let rungs = header
        .cuts
        .iter()
        .zip(errors)
        .enumerate()
        .map(|(number, (cut, error))| Rung {
            url: RungName {
                hash: url.hash(),
                number: number as u8,
            },
            from: number
                .checked_sub(1)
                .map_or(0, |before| u64::from(header.cuts[before].bytes)),
            to: u64::from(cut.bytes),
            triangles: u64::from(cut.triangles),
            geometric_error_m: error,
            rms_error_m: f64::from(cut.rms_error),
        });
    let rungs = rungs.collect();
    let listed = glb::write_materials(
        &glb::GlbInput {
            primitives: &model.primitives,
            materials: &scene.materials,
            textures: &scene.textures,
            image_uri: &|image| pictures.whole(image).url.to_string(),
        },
        &materials(model),
    );
    let (materials, materials_bytes) = ledger.put("gltf", listed)?;
    let textures: BTreeSet<TextureRef> = glb::used_textures(&model.primitives, &scene.materials)
        .into_iter()
        .map(|texture| pictures.whole(scene.textures[texture].image).clone())
        .collect();
    Ok(Some(SmoothLod {
        url,
        bytes,
        materials,
        materials_bytes,
        textures: textures.into_iter().collect(),
        rungs,
    }))
}
