//! In which ways can a model be drawn, and which of them costs least? A *grade* is a level of detail, or the mesh that a
//! smooth LOD gives up to a rung, or level 0 grown here out of the rules that it has come from (Schmalstieg, *The Remote
//! Rendering Pipeline*, 1997, §8).
//!
//! The rule, in one place for first pictures and for refining, as in `viewer/core/strategy/grade.ts`: of the grades that are good
//! enough for an error, the one for which the fewest bytes have still to travel. What is here, or on its way, is not paid
//! again; so rungs are appended, and smooth LODs are left alone where the coarsest levels of many models come in one
//! compressed pack, or where a model is too small to pay for its materials. Rules for which many wait cost each its share. Rules that are here would cost nothing for any
//! model, and fill the picture with triangles that nobody sees: so each triangle that grows counts as a byte.

use std::fmt;

use belvedere_scene::{
    BlobName,
    object::{Level, Model, PackRef, Procedural, TextureRef},
    rung::{RungName, SLOD},
};

use super::file::{FileName, FileRef, Key, REQUEST_BYTES, compressed_bytes};

/// Which kind of mesh.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Form {
    /// A level of detail.
    Level,
    /// A smooth LOD up to a rung.
    Rung,
    /// Level 0, grown out of rules.
    Grown,
}

/// One way to draw a model.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Grade {
    /// Level or rung.
    pub form: Form,
    /// Of the level, 0 the finest; of the last rung that was taken in, 0 the coarsest; 0 of what has grown.
    pub number: usize,
    /// Triangles of the mesh; 0 where nobody knows before it has grown.
    pub triangles: u64,
    /// How far its surface may be from the source's, in the model's space.
    pub error: f64,
}

impl fmt::Display for Grade {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.form {
            Form::Level => write!(f, "level {}", self.number),
            Form::Rung => write!(f, "rung {}", self.number),
            Form::Grown => f.write_str("grown from rules"),
        }
    }
}

/// What a triangle counts that is grown here …
const GROWN_TRIANGLE_BYTES: f64 = 1.0;
/// … and where nothing of the model is here yet, so that somebody waits for each byte. The viewer, which has them all to draw,
/// counts as much as above.
const FIRST_TRIANGLE_BYTES: f64 = 0.25;
/// Rungs come together up to so many bytes, so that small models take one step and large ones show each.
const STEP_BYTES: u64 = 16 * 1024;

/// A file of a grade.
#[derive(Debug, Clone, Copy)]
pub struct Part<'a> {
    name: Name<'a>,
    /// Its size as stored.
    pub bytes: u64,
    /// The same bytes among others.
    pub pack: Option<&'a PackRef>,
    /// Whether the model can be drawn without it, but plainly: a picture.
    pub spare: bool,
}

#[derive(Debug, Clone, Copy)]
enum Name<'a> {
    Object(&'a BlobName),
    Rung(&'a RungName),
}

/// How a file stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum State {
    /// Nobody has asked for it.
    Away,
    /// It is on its way.
    Asked,
    /// It is here.
    Here,
    /// It cannot be had.
    Lost,
}

/// What is known of files while one chooses.
pub trait Stock {
    /// How a file stands.
    fn state(&self, file: Key) -> State;

    /// How many models wait for a file, each of which counts its share of it.
    fn waiting(&self, _file: Key) -> usize {
        1
    }

    /// Whether nobody need ask for a file.
    fn is_begun(&self, file: Key) -> bool {
        matches!(self.state(file), State::Here | State::Asked)
    }
}

impl Grade {
    pub(crate) fn of_level(number: usize, level: &Level) -> Self {
        Self {
            form: Form::Level,
            number,
            triangles: level.triangles,
            error: level.geometric_error_m,
        }
    }

    fn of_rung(model: &Model, number: usize) -> Option<Self> {
        let rung = model.smooth.as_ref()?.rungs.get(number)?;
        Some(Self {
            form: Form::Rung,
            number,
            triangles: rung.triangles,
            error: rung.geometric_error_m,
        })
    }

    fn of_rules(model: &Model) -> Option<Self> {
        model.procedural.as_ref()?;
        let finest = model.levels.first();
        Some(Self {
            form: Form::Grown,
            number: 0,
            triangles: finest.map_or(0, |level| level.triangles),
            error: finest.map_or(0.0, |level| level.geometric_error_m),
        })
    }

    /// The coarsest level of a model, or what grows where nobody knows of levels: what a first picture is at least as good as.
    #[must_use]
    pub fn coarsest(model: &Model) -> Option<Self> {
        let coarsest = model.levels.iter().enumerate().next_back();
        let level = coarsest.map(|(number, level)| Self::of_level(number, level));
        level.or_else(|| Self::of_rules(model))
    }

    /// All ways to draw a model: what grows here, levels, finest first, then rungs, coarsest first.
    pub fn all(model: &Model) -> impl Iterator<Item = Self> {
        let levels = model.levels.iter().enumerate();
        let rungs = model.smooth.iter().flat_map(|smooth| 0..smooth.rungs.len());
        Self::of_rules(model)
            .into_iter()
            .chain(levels.map(|(number, level)| Self::of_level(number, level)))
            .chain(rungs.filter_map(|number| Self::of_rung(model, number)))
    }

    /// Whether it will do where errors up to this, in the model's space, do; the finest of a kind always will.
    #[must_use]
    pub fn will_do(&self, model: &Model, most_error: f64) -> bool {
        let finest = match self.form {
            Form::Level | Form::Grown => 0,
            Form::Rung => model.smooth.as_ref().map_or(0, |smooth| smooth.rungs.len() - 1),
        };
        self.error <= most_error || self.number == finest
    }

    /// All files of it.
    pub fn parts<'a, S: Stock>(self, model: &'a Model, stock: &S) -> impl Iterator<Item = Part<'a>> + use<'a, S> {
        let level = model.levels.get(self.number).filter(|_| self.form == Form::Level);
        let smooth = model.smooth.as_ref().filter(|_| self.form == Form::Rung);
        let glb = level.map(|level| Part {
            pack: level.pack.as_ref(),
            ..Part::object(&level.url, level.bytes)
        });
        let (mut whole, mut taken) = (None, 0);
        if let Some(smooth) = smooth {
            taken = self.number + 1;
            let begun = smooth
                .rungs
                .iter()
                .take(taken)
                .any(|rung| stock.is_begun((&rung.url).into()));
            // All of it is one file, where none of it is here.
            if (taken == smooth.rungs.len() && !begun) || stock.is_begun((&smooth.url).into()) {
                (whole, taken) = (Some(Part::object(&smooth.url, smooth.bytes)), 0);
            }
        }
        let rungs = smooth
            .into_iter()
            .flat_map(move |smooth| smooth.rungs.iter().take(taken))
            .map(|rung| Part {
                name: Name::Rung(&rung.url),
                bytes: rung.to - rung.from,
                pack: None,
                spare: false,
            });
        let materials = smooth.map(|smooth| Part::object(&smooth.materials, smooth.materials_bytes));
        let textures = level
            .map(|level| &level.textures)
            .or(smooth.map(|smooth| &smooth.textures));
        let textures = textures.into_iter().flatten().map(Part::picture);
        let rules = model.procedural.as_ref().filter(|_| self.form == Form::Grown);
        glb.into_iter()
            .chain(rules.into_iter().flat_map(Part::texts))
            .chain(whole)
            .chain(rungs)
            .chain(materials)
            .chain(textures)
    }

    /// Whether it cannot be had.
    #[must_use]
    pub fn is_lost(&self, model: &Model, stock: &impl Stock) -> bool {
        let has_no_rules = self.form == Form::Grown && model.procedural.is_none();
        has_no_rules || self.parts(model, stock).any(|part| !part.spare && part.is_lost(stock))
    }

    /// Bytes that have still to travel until a model can be drawn so.
    #[must_use]
    pub fn cost_bytes(&self, model: &Model, stock: &impl Stock) -> f64 {
        self.parts(model, stock).map(|part| part.cost_bytes(stock)).sum()
    }

    /// The same with what each triangle counts that has to be grown.
    fn counts_bytes(&self, model: &Model, stock: &impl Stock, triangle_bytes: f64) -> f64 {
        let grown = if self.form == Form::Grown { self.triangles } else { 0 };
        self.cost_bytes(model, stock) + triangle_bytes * grown as f64
    }
}

impl<'a> Part<'a> {
    fn object(name: &'a BlobName, bytes: u64) -> Self {
        Self {
            name: Name::Object(name),
            bytes,
            pack: None,
            spare: false,
        }
    }

    /// Rules, and what they import.
    fn texts(rules: &'a Procedural) -> impl Iterator<Item = Self> {
        let imports = rules.imports.values();
        std::iter::once(Self::object(&rules.rules, rules.rules_bytes))
            .chain(imports.map(|import| Self::object(&import.url, import.bytes)))
    }

    fn picture(texture: &'a TextureRef) -> Self {
        Self {
            spare: true,
            ..Self::object(&texture.url, texture.bytes)
        }
    }

    /// What the file alone is looked up by.
    #[must_use]
    pub fn key(&self) -> Key {
        match self.name {
            Name::Object(name) => name.into(),
            Name::Rung(name) => name.into(),
        }
    }

    /// The file alone.
    #[must_use]
    pub fn file(&self) -> FileRef {
        let name = match self.name {
            Name::Object(name) => FileName::Object(name.clone()),
            Name::Rung(name) => FileName::Rung(*name),
        };
        FileRef {
            name,
            bytes: self.bytes,
        }
    }

    /// Bytes that it has still to travel; infinitely many where it cannot be had.
    #[must_use]
    pub fn cost_bytes(&self, stock: &impl Stock) -> f64 {
        let ext = match self.name {
            Name::Object(name) => name.ext(),
            Name::Rung(_) => SLOD,
        };
        let alone = match stock.state(self.key()) {
            State::Here | State::Asked => return 0.0,
            State::Lost if self.spare => return 0.0,
            State::Lost => f64::INFINITY,
            State::Away => (compressed_bytes(ext, self.bytes) + REQUEST_BYTES) / stock.waiting(self.key()) as f64,
        };
        let packed = self
            .pack
            .map_or(f64::INFINITY, |pack| match stock.state((&pack.url).into()) {
                State::Here | State::Asked => 0.0,
                State::Lost => f64::INFINITY,
                // A pack is asked for once, for many.
                State::Away => compressed_bytes(pack.url.ext(), self.bytes),
            });
        packed.min(alone)
    }

    fn is_lost(&self, stock: &impl Stock) -> bool {
        let lost = |key: Key| stock.state(key) == State::Lost;
        lost(self.key()) && self.pack.is_none_or(|pack| lost((&pack.url).into()))
    }

    /// Which file holds it, if it is here.
    #[must_use]
    pub fn holder(&self, stock: &impl Stock) -> Option<Key> {
        let here = |key: &Key| stock.state(*key) == State::Here;
        Some(self.key())
            .filter(here)
            .or_else(|| self.pack.map(|pack| (&pack.url).into()).filter(here))
    }
}

/// What to draw a model with in the end where errors up to this do; `None` when nothing that would do can be had.
#[must_use]
pub fn goal(model: &Model, most_error: f64, stock: &impl Stock) -> Option<Grade> {
    cheapest(model, most_error, stock, GROWN_TRIANGLE_BYTES)
}

/// The same for a model of which nothing is here.
#[must_use]
pub fn first(model: &Model, most_error: f64, stock: &impl Stock) -> Option<Grade> {
    cheapest(model, most_error, stock, FIRST_TRIANGLE_BYTES)
}

fn cheapest(model: &Model, most_error: f64, stock: &impl Stock, triangle_bytes: f64) -> Option<Grade> {
    let fit = Grade::all(model).filter(|grade| grade.will_do(model, most_error) && !grade.is_lost(model, stock));
    let mut best: Option<(f64, Grade)> = None;
    for grade in fit {
        let bytes = grade.counts_bytes(model, stock, triangle_bytes);
        if best.is_none_or(|(least, _)| bytes < least) {
            best = Some((bytes, grade));
        }
    }
    best.map(|(_, grade)| grade)
}

/// What to draw next on the way to a goal: a level at once, rungs in steps, none of them coarser than what is held.
#[must_use]
pub fn step_towards(model: &Model, goal: Grade, held: Option<Grade>) -> Grade {
    let Some(smooth) = model.smooth.as_ref().filter(|_| goal.form == Form::Rung) else {
        return goal;
    };
    let first = match held {
        Some(held) if held.form == Form::Rung => held.number + 1,
        _ => 0,
    };
    let from = smooth.rungs.get(first).map_or(0, |rung| rung.from);
    let most_error = held.map_or(f64::INFINITY, |held| held.error);
    let mut number = first;
    while number < goal.number
        && let (Some(now), Some(next)) = (smooth.rungs.get(number), smooth.rungs.get(number + 1))
        && (next.to - from <= STEP_BYTES || now.geometric_error_m >= most_error)
    {
        number += 1;
    }
    Grade::of_rung(model, number).unwrap_or(goal)
}
