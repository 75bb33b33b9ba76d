//! Where do grown models stand, in as few bytes as that takes? For clients that grow rules themselves.
//!
//! Rules are sent once, instances by parameters only (Schmalstieg, *The Remote Rendering Pipeline*, 1997, §8.4): a population (`.pop`)
//! holds, for a run of objects, what each was grown from and where it stands, as arrays. It stands beside the object index,
//! which says the same to the last digit and levels of detail besides, and it is shared by all cells that see a member: in
//! cell records it would travel once for each of them. `docs/FORMAT.md` specifies the bytes.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::{
    BlobName, ModelId, ObjectId,
    object::{Import, Procedural},
};

/// The largest number of objects of one population.
pub const POPULATION_OBJECTS: usize = 256;
const MAGIC: &[u8; 4] = b"BVPO";
const VERSION: u16 = 1;
/// What a number of a rotation is a multiple of.
const ROTATION_STEP: f64 = 1.0 / 32_767.0;
/// Bytes of one member in all arrays.
const MEMBER_BYTES: usize = 28;
/// Magic, version, two bytes of nothing, length of the head.
const FRONT_BYTES: usize = 12;

/// Some of the objects of a run of ids: those whose models can be grown alone and that are neither sheared, mirrored nor scaled
/// unevenly.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Population {
    /// Texts, and what they import.
    pub rules: Vec<Rules>,
    /// What members were grown from.
    pub recipes: Vec<Recipe>,
    /// Rising by object.
    pub members: Vec<Member>,
}

/// A file of rules.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct Rules {
    /// Its text (`.dcg`).
    pub url: BlobName,
    /// Its size as stored.
    pub bytes: u64,
    /// What it imports, by the names that it gives it.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub imports: BTreeMap<String, Import>,
}

/// What to make of rules, as [`Procedural`] says it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Recipe {
    /// Index into [`Population::rules`].
    pub rules: usize,
    /// The part of them; absent for the file as a whole.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub part: Option<String>,
    /// A number or a list for each parameter.
    pub parameters: BTreeMap<String, Value>,
    /// Where random numbers come from.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub seed: u32,
    /// The model that grows.
    pub model: ModelId,
    /// How many triangles level 0 of it has.
    pub triangles: u64,
}

fn is_zero(seed: &u32) -> bool {
    *seed == 0
}

/// One of a population.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Member {
    /// The object that it is.
    pub object: ObjectId,
    /// Index into [`Population::recipes`].
    pub recipe: usize,
    /// Where its model's origin is in the world, metres.
    pub position: [f64; 3],
    /// How it is turned: x, y, z, w, of length 1.
    pub rotation: [f64; 4],
    /// How large it is.
    pub scale: f64,
}

/// Bytes that are no population.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum PopulationError {
    /// It ends too early, or goes on.
    #[error("a population of {expected} bytes has {found}")]
    Length {
        /// What its head says.
        expected: usize,
        /// What there are.
        found: usize,
    },
    /// It does not begin as one, or is of another version.
    #[error("not a population of version {VERSION}")]
    Version,
    /// Its head is no JSON with the members that it should have.
    #[error("the head of a population: {0}")]
    Head(String),
    /// A member names a recipe, or a recipe rules, that are not there; or a member is nowhere, or no object of its run.
    #[error("{0} of a population is not sound")]
    Unsound(&'static str),
}

/// What stands before the arrays, as JSON.
#[derive(Serialize, Deserialize)]
struct Head {
    origin: [f64; 3],
    count: usize,
    rules: Vec<Rules>,
    recipes: Vec<Recipe>,
}

impl Procedural {
    /// The files alone.
    #[must_use]
    pub fn files(&self) -> Rules {
        Rules {
            url: self.rules.clone(),
            bytes: self.rules_bytes,
            imports: self.imports.clone(),
        }
    }
}

impl Population {
    /// What a client needs to grow a recipe's model.
    #[must_use]
    pub fn procedural(&self, recipe: usize) -> Option<Procedural> {
        let recipe = self.recipes.get(recipe)?;
        let rules = self.rules.get(recipe.rules)?;
        Some(Procedural {
            rules: rules.url.clone(),
            rules_bytes: rules.bytes,
            imports: rules.imports.clone(),
            part: recipe.part.clone(),
            parameters: recipe.parameters.clone(),
            seed: recipe.seed,
        })
    }

    /// The bytes of members with ids from `first` on. Positions are kept to 2⁻²⁴ of how far members lie apart, rotations to 2⁻¹⁶.
    ///
    /// # Panics
    /// When ids, recipes or rules do not fit.
    #[must_use]
    pub fn encode(&self, first: ObjectId) -> Vec<u8> {
        let origin = self.members.first().map_or([0.0; 3], |member| member.position);
        let head = Head {
            origin,
            count: self.members.len(),
            rules: self.rules.clone(),
            recipes: self.recipes.clone(),
        };
        let mut head = serde_json::to_vec(&head).expect("numbers are finite and keys are texts");
        head.resize(head.len().next_multiple_of(4), b' ');
        let mut bytes = Vec::with_capacity(FRONT_BYTES + head.len() + MEMBER_BYTES * self.members.len());
        bytes.extend(MAGIC);
        bytes.extend(VERSION.to_le_bytes());
        bytes.extend([0; 2]);
        bytes.extend(u32::try_from(head.len()).expect("a head is short").to_le_bytes());
        bytes.extend(head);
        let members = &self.members;
        for member in members {
            let from_origin = [0, 1, 2].map(|axis| (member.position[axis] - origin[axis]) as f32);
            bytes.extend(from_origin.iter().flat_map(|x| x.to_le_bytes()));
        }
        bytes.extend(members.iter().flat_map(|member| (member.scale as f32).to_le_bytes()));
        let turned = members.iter().flat_map(|member| member.rotation);
        bytes.extend(turned.flat_map(|x| ((x / ROTATION_STEP).round() as i16).to_le_bytes()));
        let short = |number: usize| u16::try_from(number).expect("a population is small").to_le_bytes();
        bytes.extend(members.iter().flat_map(|member| short(member.recipe)));
        let number = |member: &Member| (member.object.0 - first.0) as usize;
        bytes.extend(members.iter().flat_map(|member| short(number(member))));
        bytes
    }

    /// The population that these bytes are, of some of `count` objects with ids from `first` on, as the index says.
    ///
    /// # Errors
    /// When they are none.
    pub fn decode(bytes: &[u8], first: ObjectId, count: u32) -> Result<Self, PopulationError> {
        let front = bytes.first_chunk::<FRONT_BYTES>().ok_or(PopulationError::Version)?;
        if !front.starts_with(MAGIC) || front[4..6] != VERSION.to_le_bytes() {
            return Err(PopulationError::Version);
        }
        let [.., a, b, c, d] = *front;
        let arrays_at = FRONT_BYTES.saturating_add(u32::from_le_bytes([a, b, c, d]) as usize);
        let wrong_length = |expected| PopulationError::Length {
            expected,
            found: bytes.len(),
        };
        let (head, arrays) = bytes.split_at_checked(arrays_at).ok_or(wrong_length(arrays_at))?;
        let head: Head =
            serde_json::from_slice(&head[FRONT_BYTES..]).map_err(|cause| PopulationError::Head(cause.to_string()))?;
        let expected = head.count.saturating_mul(MEMBER_BYTES);
        if arrays.len() != expected {
            return Err(wrong_length(arrays_at.saturating_add(expected)));
        }
        let population = Self {
            members: members(&head, arrays, first, count)?,
            rules: head.rules,
            recipes: head.recipes,
        };
        let known = |recipe: &Recipe| recipe.rules < population.rules.len();
        if !population.recipes.iter().all(known) {
            return Err(PopulationError::Unsound("a recipe"));
        }
        Ok(population)
    }
}

/// Reads the arrays, whose length is right.
fn members(head: &Head, arrays: &[u8], first: ObjectId, run: u32) -> Result<Vec<Member>, PopulationError> {
    let count = head.count;
    let [positions, scales, rotations, recipes] = [12, 16, 24, 26].map(|bytes| bytes * count);
    let float = |at: usize| f64::from(f32::from_le_bytes([0, 1, 2, 3].map(|i| arrays[at + i])));
    let short = |at: usize| u16::from_le_bytes([arrays[at], arrays[at + 1]]);
    let member = |i: usize| {
        let turned = [0, 1, 2, 3].map(|axis| f64::from(short(scales + 8 * i + 2 * axis).cast_signed()));
        let length = turned.iter().map(|x| x * x).sum::<f64>().sqrt();
        Member {
            object: ObjectId(first.0.saturating_add(u32::from(short(recipes + 2 * i)))),
            recipe: usize::from(short(rotations + 2 * i)),
            position: [0, 1, 2].map(|axis| head.origin[axis] + float(12 * i + 4 * axis)),
            rotation: turned.map(|x| x / length),
            scale: float(positions + 4 * i),
        }
    };
    let members: Vec<Member> = (0..count).map(member).collect();
    let is_sound = |member: &Member| {
        let [x, y, z, w] = member.rotation;
        let numbers = [x, y, z, w].into_iter().chain(member.position);
        member.scale > 0.0
            && member.scale.is_finite()
            && numbers.into_iter().all(f64::is_finite)
            && member.recipe < head.recipes.len()
            && member.object.0 - first.0 < run
    };
    if !members.iter().all(is_sound) || !members.is_sorted_by(|a, b| a.object < b.object) {
        return Err(PopulationError::Unsound("a member"));
    }
    Ok(members)
}

impl Member {
    /// `world_from_object`, column-major.
    #[must_use]
    pub fn transform(&self) -> [f64; 16] {
        let [x, y, z, w] = self.rotation;
        let s = self.scale;
        let [px, py, pz] = self.position;
        [
            s * (1.0 - 2.0 * (y * y + z * z)),
            s * 2.0 * (x * y + z * w),
            s * 2.0 * (x * z - y * w),
            0.0,
            s * 2.0 * (x * y - z * w),
            s * (1.0 - 2.0 * (x * x + z * z)),
            s * 2.0 * (y * z + x * w),
            0.0,
            s * 2.0 * (x * z + y * w),
            s * 2.0 * (y * z - x * w),
            s * (1.0 - 2.0 * (x * x + y * y)),
            0.0,
            px,
            py,
            pz,
            1.0,
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn village() -> Population {
        let text = |text: &str| BlobName::of(text.as_bytes(), "dcg").unwrap();
        let import = Import {
            url: text("b"),
            bytes: 1,
        };
        let recipe = |part: Option<&str>, width: f64| Recipe {
            rules: 0,
            part: part.map(str::to_owned),
            parameters: BTreeMap::from([("width".to_owned(), width.into())]),
            seed: 7,
            model: ModelId(3),
            triangles: 12,
        };
        let member = |object: u32, recipe: usize, turn: f64, scale: f64| Member {
            object: ObjectId(object),
            recipe,
            position: [1e6 + f64::from(object), 0.25, -3.5],
            rotation: [0.0, turn.sin(), 0.0, turn.cos()],
            scale,
        };
        Population {
            rules: vec![Rules {
                url: text("a"),
                bytes: 1,
                imports: BTreeMap::from([("b.dcg".to_owned(), import)]),
            }],
            recipes: vec![recipe(Some("hut"), 2.5), recipe(None, 0.1)],
            members: vec![
                member(70, 0, 0.3, 1.0),
                member(71, 1, 1.6, 0.5),
                member(99, 0, -2.0, 3.0),
            ],
        }
    }

    #[test]
    fn what_is_written_is_read_again() {
        let village = village();
        let bytes = village.encode(ObjectId(64));
        let read = Population::decode(&bytes, ObjectId(64), 36).unwrap();
        assert_eq!((&read.rules, &read.recipes), (&village.rules, &village.recipes));
        assert_eq!(read.procedural(1).unwrap().imports.len(), 1);
        assert_eq!(read.members.len(), 3);
        for (read, written) in read.members.iter().zip(&village.members) {
            assert_eq!((read.object, read.recipe), (written.object, written.recipe));
            for (a, b) in read.transform().iter().zip(written.transform()) {
                assert!((a - b).abs() < 2e-4, "{a} and {b}");
            }
        }
        let nobody = Population::default();
        assert_eq!(
            Population::decode(&nobody.encode(ObjectId(5)), ObjectId(5), 0),
            Ok(nobody)
        );
    }

    #[test]
    fn damage_is_an_error_and_never_a_panic() {
        let bytes = village().encode(ObjectId(64));
        for end in 0..bytes.len() {
            assert!(
                Population::decode(&bytes[..end], ObjectId(64), 36).is_err(),
                "cut to {end}"
            );
        }
        let longer = [&bytes[..], &[0]].concat();
        assert!(matches!(
            Population::decode(&longer, ObjectId(64), 36),
            Err(PopulationError::Length { .. })
        ));
        for at in 0..bytes.len() {
            for bit in 0..8 {
                let mut wrong = bytes.clone();
                wrong[at] ^= 1 << bit;
                if let Ok(read) = Population::decode(&wrong, ObjectId(64), 36) {
                    assert!(
                        read.members
                            .iter()
                            .all(|member| read.procedural(member.recipe).is_some())
                    );
                }
            }
        }
        let mut nowhere = village();
        nowhere.members[1].rotation = [0.0; 4];
        let refused = Population::decode(&nowhere.encode(ObjectId(64)), ObjectId(64), 36);
        assert_eq!(refused, Err(PopulationError::Unsound("a member")));
        // The last of them is o99.
        let beyond = Population::decode(&village().encode(ObjectId(64)), ObjectId(64), 35);
        assert_eq!(beyond, Err(PopulationError::Unsound("a member")));
        let mut unknown = village();
        unknown.recipes[1].rules = 1;
        let refused = Population::decode(&unknown.encode(ObjectId(64)), ObjectId(64), 36);
        assert_eq!(refused, Err(PopulationError::Unsound("a recipe")));
    }
}
