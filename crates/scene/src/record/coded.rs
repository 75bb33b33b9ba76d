//! How few bytes say what a cell sees? Every record is written as what has changed since another one.
//!
//! A `.cell` changes from nothing, a step from the record of an adjacent cell (Marvie & Bouatouch, *A VRML97-X3D
//! extension for massive scenery management in virtual worlds*, 2004, give each cell its sets; that neighbours share
//! most of them is what [`step`] uses). Sets are gaps between rising ids, which are small because ids follow space.
//! Solid angles and fractions are powers of two. Order is not stored: it follows from the solid angles.

use super::{
    DecodeError,
    range::{Bit, Change, Coder, Decoder, Encoder, Number, Symbol},
    text::Text,
};

/// Solid angles are 4π · 2⁻ⁿ sr with n up to this.
pub(super) const SMALLEST_ANGLE: u8 = 63;
/// Fractions are 2⁻ⁿ with n up to this.
pub(super) const SMALLEST_FRACTION: u8 = 7;

/// A record as it is coded. Its lists rise.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(super) struct Coded {
    /// Hull, portals and sizes, see [`super::geometry`].
    pub(super) geometry: Vec<u8>,
    /// What is visible.
    pub(super) objects: Vec<Entry>,
    /// Doors that hide any of it.
    pub(super) doors: Vec<u32>,
    /// Cells that can be seen into.
    pub(super) cells: Vec<u32>,
}

/// A visible object.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(super) struct Entry {
    pub(super) object: u32,
    /// Its solid angle is 4π · 2⁻ⁿ sr.
    pub(super) angle: u8,
    /// Its fraction is 2⁻ⁿ.
    pub(super) fraction: u8,
    /// Whether it lies wholly inside the cell.
    pub(super) local: bool,
    /// Doors that hide it.
    pub(super) doors: Vec<u32>,
}

impl Coded {
    fn entry(&self, object: u32) -> Option<&Entry> {
        let at = self.objects.binary_search_by_key(&object, |entry| entry.object).ok()?;
        Some(&self.objects[at])
    }

    fn ids(&self) -> Vec<u32> {
        self.objects.iter().map(|entry| entry.object).collect()
    }
}

/// What turns `before` into `after`.
pub(super) fn step(before: &Coded, after: &Coded) -> Vec<u8> {
    let mut encoder = Encoder::new();
    code(&mut encoder, before, after).expect("writing into memory cannot fail");
    encoder.finish()
}

/// What a step makes of `before`.
pub(super) fn follow(before: &Coded, step: &[u8]) -> Result<Coded, DecodeError> {
    let mut decoder = Decoder::new(step);
    let after = code(&mut decoder, before, &Coded::default())?;
    decoder.finish()?;
    Ok(after)
}

/// How many bytes say which objects are visible after `known`, which rises.
pub(super) fn set_bytes(known: &[u32], after: &Coded) -> usize {
    let mut encoder = Encoder::new();
    let coded = Set::default().code(&mut encoder, known, &after.ids());
    coded.expect("writing into memory cannot fail");
    encoder.finish().len()
}

/// Both directions, see [`Coder`].
fn code(coder: &mut impl Coder, before: &Coded, after: &Coded) -> Result<Coded, DecodeError> {
    let geometry = Text::default().code(coder, &before.geometry, &after.geometry)?;
    let objects = Set::default().code(coder, &before.ids(), &after.ids())?;
    let doors = Set::default().code(coder, &before.doors, &after.doors)?;
    let objects = Entries::new(coder, after, doors.len())?.code(coder, before, after, &objects, &doors)?;
    let cells = Set::default().code(coder, &before.cells, &after.cells)?;
    Ok(Coded {
        geometry,
        objects,
        doors,
        cells,
    })
}

/// Learns how sets change: which members go, and the gaps between those that come, counted without members.
#[derive(Default)]
struct Set {
    goes: [Bit; 2],
    count: Number,
    gap: Number,
}

impl Set {
    /// All three lists rise.
    fn code(&mut self, coder: &mut impl Coder, before: &[u32], after: &[u32]) -> Result<Vec<u32>, DecodeError> {
        let mut members = Vec::new();
        let mut went = false;
        for id in before {
            went = coder.bit(&mut self.goes[usize::from(went)], after.binary_search(id).is_err())?;
            if !went {
                members.push(*id);
            }
        }
        let new: Vec<u32> = after
            .iter()
            .copied()
            .filter(|id| before.binary_search(id).is_err())
            .collect();
        let rank = |id: u32| u64::from(id) - before.partition_point(|member| *member < id) as u64;
        let count = self.count.code(coder, new.len() as u64)?;
        let (mut next, mut passed) = (0, 0);
        for index in 0..count {
            let gap = new.get(index as usize).map_or(0, |id| rank(*id) - next);
            let found = next + self.gap.code(coder, gap)?;
            while before
                .get(passed)
                .is_some_and(|id| u64::from(*id) <= found + passed as u64)
            {
                passed += 1;
            }
            let id = u32::try_from(found + passed as u64);
            members.push(id.map_err(|_| DecodeError::damaged("an id has more than 32 bits"))?);
            next = found + 1;
        }
        members.sort_unstable();
        Ok(members)
    }
}

/// Learns what is said of each visible object.
struct Entries {
    /// Whether anything lies inside the cell at all.
    any_local: bool,
    angle: Symbol<64>,
    /// By a fourth of the solid angle.
    fraction: Vec<Symbol<8>>,
    angle_change: Change,
    fraction_change: Change,
    /// By what was before: nothing, not local, local.
    local: [Bit; 3],
    /// By what was before, and by what the same door did to the entry with the next lower id.
    door: [[Bit; 2]; 3],
    /// What each door did to that entry.
    last: Vec<bool>,
}

impl Entries {
    fn new(coder: &mut impl Coder, after: &Coded, doors: usize) -> Result<Self, DecodeError> {
        let any_local = coder.bit(&mut Bit::default(), after.objects.iter().any(|entry| entry.local))?;
        Ok(Self {
            any_local,
            angle: Symbol::default(),
            fraction: vec![Symbol::default(); usize::from(SMALLEST_ANGLE / 4) + 1],
            angle_change: Change::default(),
            fraction_change: Change::default(),
            local: Default::default(),
            door: Default::default(),
            last: vec![false; doors],
        })
    }

    fn code(
        &mut self,
        coder: &mut impl Coder,
        before: &Coded,
        after: &Coded,
        objects: &[u32],
        doors: &[u32],
    ) -> Result<Vec<Entry>, DecodeError> {
        let mut way = 0;
        let mut entries = Vec::new();
        for object in objects {
            let was = before.entry(*object);
            let given = after.entry(*object).cloned().unwrap_or_default();
            let mut entry = Entry {
                object: *object,
                ..Entry::default()
            };
            if let Some(was) = was {
                let (angle, went) = self
                    .angle_change
                    .code(coder, way, was.angle.into(), given.angle.into())?;
                way = went;
                let (was, given) = (was.fraction.into(), given.fraction.into());
                let (fraction, _) = self.fraction_change.code(coder, way, was, given)?;
                entry.angle = within(angle, SMALLEST_ANGLE)?;
                entry.fraction = within(fraction, SMALLEST_FRACTION)?;
            } else {
                entry.angle = self.angle.code(coder, given.angle)?;
                entry.fraction = self.fraction[usize::from(entry.angle / 4)].code(coder, given.fraction)?;
            }
            if self.any_local {
                let model = &mut self.local[context(was.map(|was| was.local))];
                entry.local = coder.bit(model, given.local)?;
            }
            for (door, last) in doors.iter().zip(&mut self.last) {
                let known = context(was.map(|was| was.doors.contains(door)));
                let model = &mut self.door[known][usize::from(*last)];
                *last = coder.bit(model, given.doors.contains(door))?;
                if *last {
                    entry.doors.push(*door);
                }
            }
            entries.push(entry);
        }
        Ok(entries)
    }
}

fn context(was: Option<bool>) -> usize {
    was.map_or(0, |was| 1 + usize::from(was))
}

fn within(number: i64, most: u8) -> Result<u8, DecodeError> {
    let number = u8::try_from(number).ok().filter(|number| *number <= most);
    number.ok_or_else(|| DecodeError::damaged("a class changes beyond its range"))
}
