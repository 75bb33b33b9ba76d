//! Which pictures stand for a model from far away? Draws and stores those of the models that ask for them.

use belvedere_scene::{
    impostor::Impostor,
    object::{TextureRef, switch_distance_m},
};
use rayon::prelude::*;

use super::{BakeError, sink::Ledger};
use crate::{
    impostors::{self, surface::Surfaces},
    progress::{Portion, Progress, Stage},
    source::SourceScene,
};

/// The impostor of each model, stored; none for those that do not ask or have too little to gain.
pub(super) fn write(
    scene: &SourceScene,
    ledger: &Ledger<'_>,
    progress: &dyn Progress,
) -> Result<Vec<Option<Impostor>>, BakeError> {
    let wishes = scene.models.iter().map(|model| {
        let wish = model.impostor.filter(|_| impostors::is_worthwhile(model));
        wish.map(|wish| {
            (
                wish,
                u64::from(wish.views * wish.views * wish.frames) * model.triangle_count() as u64,
            )
        })
    });
    let wishes: Vec<_> = wishes.collect();
    progress.start(Stage::Impostors, wishes.iter().flatten().map(|(_, cost)| cost).sum());
    let surfaces = Surfaces::new(scene);
    let written = scene.models.par_iter().zip(wishes).map(|(model, wish)| {
        let Some((wish, cost)) = wish else { return Ok(None) };
        let portion = Portion::of(progress, cost, model.pose_count().into());
        let baked = impostors::bake(model, &surfaces, wish, &portion)?;
        let Some(baked) = baked else { return Ok(None) };
        let put = |bytes: Vec<u8>| ledger.put("png", bytes).map(|(url, bytes)| TextureRef { url, bytes });
        Ok(Some(Impostor {
            colour: put(baked.colour)?,
            shape: put(baked.shape)?,
            mapping: wish.mapping(),
            views: wish.views,
            size_px: wish.size_px,
            centre: baked.centre,
            radius: baked.radius,
            error_m: baked.error,
            switch_distance_m: switch_distance_m(baked.error),
            frames: baked.frames,
            stride_m: (baked.frames > 1).then_some(wish.stride),
        }))
    });
    written.collect()
}
