//! What is a model drawn with? Bytes to decode: a GLB, or a smooth LOD up to a rung with its materials, and pictures; or rules,
//! out of which it grows.

use std::collections::HashMap;

use belvedere_scene::{BlobName, ModelId};
use bytes::Bytes;

use super::seedling::Seedling;

use crate::strategy::{
    file::{FileName, Key},
    grade::{Form, Grade, Part},
    plan::Held,
    planner::Planner,
};

/// Triangles, as they came.
#[derive(Debug, Clone, PartialEq)]
pub enum Geometry {
    /// A level: glTF 2.0.
    Glb(Bytes),
    /// A smooth LOD: what [`belvedere_scene::smooth::Decoder`] takes.
    Stream {
        /// Its beginning, piece by piece.
        pieces: Vec<Bytes>,
        /// A glTF document whose material *i* is the stream's.
        materials: Bytes,
    },
    /// Rules: [`Seedling::grow`] makes triangles of them, in tens of milliseconds for a tree.
    Rules(Seedling),
}

/// What a model is drawn with.
#[derive(Debug, Clone, PartialEq)]
pub struct Mesh {
    /// Which level or rung.
    pub grade: Grade,
    /// Its triangles.
    pub geometry: Geometry,
    /// The pictures that are here; without the others it is plain.
    pub pictures: Vec<(BlobName, Bytes)>,
}

/// Puts together what is here of a model.
pub(super) fn of(planner: &Planner, model: ModelId, files: &HashMap<Key, Bytes>) -> Option<Mesh> {
    let grade = planner.residency.held(model)?;
    let geometry = planner.model(model)?;
    let bytes_of = |part: &Part| {
        let packed = || {
            let pack = part.pack?;
            let [from, to] = [pack.from, pack.from + part.bytes].map(|at| at as usize);
            let whole = files.get(&(&pack.url).into())?;
            (to <= whole.len()).then(|| whole.slice(from..to))
        };
        files.get(&part.key()).cloned().or_else(packed)
    };
    let (mut pieces, mut pictures) = (Vec::new(), Vec::new());
    for part in grade.parts(geometry, &planner.residency) {
        match (part.spare, bytes_of(&part), part.file().name) {
            (false, bytes, _) => pieces.push(bytes?),
            (true, Some(bytes), FileName::Object(name)) => pictures.push((name, bytes)),
            (true, ..) => {}
        }
    }
    let geometry = match grade.form {
        Form::Level => Geometry::Glb(pieces.pop()?),
        Form::Rung => {
            let materials = pieces.pop()?;
            Geometry::Stream { pieces, materials }
        }
        Form::Grown => Geometry::Rules(Seedling::new(geometry.procedural.as_ref()?, &pieces)?),
    };
    Some(Mesh {
        grade,
        geometry,
        pictures,
    })
}
