//! Which bytes does each model cost at each level? Makes the levels of every model and hands them to the sink as GLBs;
//! `smooth` adds smooth LODs and `impostors` pictures for far away, later: a first revision does without.

use std::collections::{BTreeMap, BTreeSet};

use belvedere_scene::{
    BlobName,
    object::{Level, Model, TextureRef, switch_distance_m},
};
use rayon::prelude::*;

use super::{
    BakeError, impostors,
    packs::MOST_PACK_BYTES,
    rules,
    sink::{BlobSink, Ledger, SinkError},
    sizes::{Pictures, PicturesOnModel, pictures_of},
    smooth,
};
use crate::{
    glb::{self, lattice::Lattice},
    lod::{self, LodLevel, LodSettings},
    progress::{Progress, Stage},
    source::{SourceModel, SourceObject, SourceScene},
};

/// The levels of every model, stored; models keep their order.
pub struct Models<'a> {
    pictures: Pictures<'a>,
    pub(super) models: Vec<Model>,
    /// The GLB of each one's coarsest level; nothing where it is too large for a pack.
    pub(super) coarsest_glb: Vec<Vec<u8>>,
    /// Every object that they are made of with its size.
    pub(super) blobs: Vec<(BlobName, u64)>,
}

impl<'a> Models<'a> {
    /// Makes and stores the levels of every model, and the pictures that they use.
    ///
    /// # Errors
    /// When the sink refuses an object, or the caller cancels.
    pub fn write(
        scene: &'a SourceScene,
        settings: &LodSettings,
        sink: &dyn BlobSink,
        progress: &dyn Progress,
    ) -> Result<Self, BakeError> {
        let ledger = Ledger::new(sink, &[]);
        let triangles: u64 = scene.models.iter().map(cost).sum();
        progress.start(Stage::Lod, triangles);
        let pictures = Pictures::write(scene, &ledger)?;
        let lattices = Lattice::of_models(scene);
        let levels = scene.models.par_iter().zip(lattices).map(|(model, lattice)| {
            if progress.cancelled() {
                return Err(BakeError::Cancelled);
            }
            let mut chain = lod::chain(model, settings);
            let pictures = pictures.on(model);
            let mut written = Vec::with_capacity(chain.levels.len());
            let mut coarsest_glb = Vec::new();
            let mut write = |level: &LodLevel| {
                // What lies on a cut stands in the same place in every level of either part.
                let lattice = if model.cut_positions.is_empty() {
                    lattice.of_error(level.geometric_error)
                } else {
                    lattice
                };
                let written = (&mut written, &mut coarsest_glb);
                write_level(level, scene, lattice, &pictures, &ledger, written)
            };
            chain.levels.iter().try_for_each(&mut write)?;
            // Nobody far away wants the finest pictures of what has no coarser mesh.
            let mut last = chain.levels.pop();
            while let Some(level) = last {
                last = pictures.with_smaller(level, scene);
                last.as_ref().map_or(Ok(()), &mut write)?;
            }
            progress.advance(cost(model));
            Ok((no_finer_level_worse(written), coarsest_glb))
        });
        let written: Vec<_> = levels.collect::<Result<_, BakeError>>()?;
        let (levels, coarsest_glb): (Vec<_>, Vec<_>) = written.into_iter().unzip();
        let rules = scene.models.iter().map(|model| rules::write(model, &ledger));
        let rules = rules.collect::<Result<Vec<_>, SinkError>>()?;
        let models = levels.into_iter().zip(rules).map(|(levels, procedural)| Model {
            levels,
            smooth: None,
            impostor: None,
            procedural,
        });
        Ok(Self {
            models: models.collect(),
            pictures,
            coarsest_glb,
            blobs: ledger.into_blobs(),
        })
    }

    /// Adds smooth LODs where they pay.
    ///
    /// # Errors
    /// As [`write`](Self::write).
    pub fn add_smooth(
        &mut self,
        settings: &LodSettings,
        sink: &dyn BlobSink,
        progress: &dyn Progress,
    ) -> Result<(), BakeError> {
        let ledger = Ledger::new(sink, &self.blobs);
        let smooth = smooth::write(&self.pictures, settings, &ledger, progress)?;
        for (model, smooth) in self.models.iter_mut().zip(smooth) {
            model.smooth = smooth;
        }
        self.blobs = ledger.into_blobs();
        Ok(())
    }

    /// Adds impostors of those that ask for one.
    ///
    /// # Errors
    /// As [`write`](Self::write).
    pub fn add_impostors(&mut self, sink: &dyn BlobSink, progress: &dyn Progress) -> Result<(), BakeError> {
        let ledger = Ledger::new(sink, &self.blobs);
        let drawn = impostors::write(self.pictures.scene, &ledger, progress)?;
        for (model, impostor) in self.models.iter_mut().zip(drawn) {
            model.impostor = impostor;
        }
        self.blobs = ledger.into_blobs();
        Ok(())
    }
}

/// Steps of progress that a model is worth: its shapes, and one for itself.
fn cost(model: &SourceModel) -> u64 {
    1 + model.primitives.iter().map(|p| p.count() as u64).sum::<u64>()
}

/// Stores a level behind the finer ones, and leaves its GLB in `last_glb`; not one that takes no fewer bytes than the last of
/// them.
fn write_level(
    level: &LodLevel,
    scene: &SourceScene,
    lattice: Lattice,
    pictures: &PicturesOnModel<'_>,
    ledger: &Ledger<'_>,
    (finer, last_glb): (&mut Vec<Level>, &mut Vec<u8>),
) -> Result<(), SinkError> {
    let rounded = lod::rounded(level, lattice);
    let input = glb::GlbInput {
        primitives: &rounded.primitives,
        materials: &scene.materials,
        textures: &scene.textures,
        image_uri: &|image| pictures.at(image, level.geometric_error).url.to_string(),
    };
    let glb = glb::write(&input, lattice);
    let textures: BTreeSet<_> = pictures_of(level, scene)
        .into_iter()
        .map(|image| pictures.at(image, level.geometric_error).clone())
        .collect();
    let textures: Vec<_> = textures.into_iter().collect();
    let bytes = with_pictures(glb.bytes.len() as u64, &textures);
    if finer
        .last()
        .is_some_and(|last| bytes >= with_pictures(last.bytes, &last.textures))
    {
        return Ok(());
    }
    last_glb.clear();
    if glb.bytes.len() as u64 <= MOST_PACK_BYTES {
        last_glb.extend_from_slice(&glb.bytes);
    }
    let (url, bytes) = ledger.put("glb", glb.bytes)?;
    finer.push(Level {
        level: finer.len() as u32,
        url,
        bytes,
        triangles: rounded.triangles,
        geometric_error_m: rounded.geometric_error,
        switch_distance_m: switch_distance_m(rounded.geometric_error),
        textures,
        pack: None,
    });
    Ok(())
}

/// What a level costs who has nothing yet: its GLB and its pictures.
fn with_pictures(glb_bytes: u64, textures: &[TextureRef]) -> u64 {
    glb_bytes + textures.iter().map(|texture| texture.bytes).sum::<u64>()
}

/// States no smaller bound for a coarser level than for a finer one, as rounding alone might.
fn no_finer_level_worse(mut levels: Vec<Level>) -> Vec<Level> {
    for i in 1..levels.len() {
        let finer = (levels[i - 1].geometric_error_m, levels[i - 1].switch_distance_m);
        let level = &mut levels[i];
        if level.geometric_error_m < finer.0 {
            (level.geometric_error_m, level.switch_distance_m) = finer;
        }
    }
    levels
}

impl Models<'_> {
    /// How many bytes draw each object: those of its model's finest level, shared out among all that use it.
    #[must_use]
    pub fn bytes_of_objects(&self, scene: &SourceScene) -> Vec<f64> {
        let mut uses = vec![0u32; self.models.len()];
        scene.objects.iter().for_each(|object| uses[object.model] += 1);
        let bytes = |object: &SourceObject| {
            let mut level0 = UniqueBytes::default();
            level0.add(&self.models[object.model].levels[0]);
            level0.total() as f64 / f64::from(uses[object.model])
        };
        scene.objects.iter().map(bytes).collect()
    }
}

/// Adds up the bytes of some levels, each GLB and each texture once.
#[derive(Debug, Default)]
pub(super) struct UniqueBytes(BTreeMap<BlobName, u64>);

impl UniqueBytes {
    pub(super) fn add(&mut self, level: &Level) {
        self.0.insert(level.url.clone(), level.bytes);
        self.0.extend(
            level
                .textures
                .iter()
                .map(|texture| (texture.url.clone(), texture.bytes)),
        );
    }

    /// What is not in the other sum.
    pub(super) fn without(mut self, other: &Self) -> Self {
        self.0.retain(|name, _| !other.0.contains_key(name));
        self
    }

    pub(super) fn total(&self) -> u64 {
        self.0.values().sum()
    }
}

/// The coarsest level of a model.
pub(super) fn coarsest(model: &Model) -> &Level {
    model.levels.last().expect("a model has at least level 0")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::source::{Primitive, Topology};

    struct Nowhere;

    impl BlobSink for Nowhere {
        fn put(&self, _: &BlobName, _: Vec<u8>) -> Result<(), SinkError> {
            Ok(())
        }
    }

    /// A second primitive costs more than what is left out with most corners of the first.
    #[test]
    fn a_coarser_level_that_takes_more_bytes_is_left_out() {
        let strip = |corners: u32| Primitive {
            positions: (0..corners).map(|i| [i as f32, (i % 2) as f32, 0.0]).collect(),
            indices: (2..corners).flat_map(|i| [i - 2, i - 1, i]).collect(),
            ..Primitive::default()
        };
        let line = Primitive {
            topology: Topology::Lines,
            positions: vec![[0.0; 3], [1.0, 0.0, 0.0]],
            indices: vec![0, 1],
            ..Primitive::default()
        };
        let level = |geometric_error: f64, primitives: Vec<Primitive>| LodLevel {
            geometric_error,
            triangles: 1,
            lines: 0,
            primitives,
        };
        let chain = [
            level(0.0, vec![strip(12)]),
            level(0.1, vec![strip(4), line]),
            level(0.2, vec![strip(3)]),
        ];
        let estimate = |level: &LodLevel| lod::geometry_bytes(&level.primitives);
        assert!(estimate(&chain[1]) < estimate(&chain[0]));
        let pictures = PicturesOnModel {
            ladders: &[],
            covered: BTreeMap::new(),
        };
        let (ledger, scene) = (Ledger::new(&Nowhere, &[]), SourceScene::default());
        let lattice = Lattice::alone(&chain[0].primitives);
        let (mut written, mut last_glb) = (Vec::new(), Vec::new());
        for level in &chain {
            write_level(
                level,
                &scene,
                lattice,
                &pictures,
                &ledger,
                (&mut written, &mut last_glb),
            )
            .unwrap();
        }
        let errors = written
            .iter()
            .map(|level| (level.level, (10.0 * level.geometric_error_m).round()));
        assert_eq!(errors.collect::<Vec<_>>(), [(0, 0.0), (1, 2.0)]);
        assert!(written[1].bytes < written[0].bytes && last_glb.len() as u64 == written[1].bytes);
    }

    #[test]
    fn what_rounding_makes_flat_is_published_as_a_line() {
        let corners: [[f32; 3]; 6] = [
            [0.0; 3],
            [1.0, 0.0, 0.0],
            [0.0, 1.0, 0.0],
            [0.0; 3],
            [0.0, 0.01, 0.0],
            [0.0, 0.0, 3.0],
        ];
        let level = LodLevel {
            geometric_error: 2.0,
            triangles: 2,
            lines: 0,
            primitives: vec![Primitive {
                positions: corners.to_vec(),
                indices: (0..6).collect(),
                ..Primitive::default()
            }],
        };
        let pictures = PicturesOnModel {
            ladders: &[],
            covered: BTreeMap::new(),
        };
        let (ledger, scene) = (Ledger::new(&Nowhere, &[]), SourceScene::default());
        let (mut written, mut glb) = (Vec::new(), Vec::new());
        let lattice = Lattice::alone(&level.primitives).of_error(2.0);
        write_level(&level, &scene, lattice, &pictures, &ledger, (&mut written, &mut glb)).unwrap();
        assert_eq!(written[0].triangles, 1);
        assert!(String::from_utf8_lossy(&glb).contains(r#""mode":1"#));
    }
}
