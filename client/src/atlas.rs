//! What is known of the cells around? Entries, openings, and what can be seen from where, as far as it was learnt; what
//! could not be read is told, and all else used without it.

use std::{collections::HashMap, sync::Arc};

use belvedere_scene::{
    CellId,
    index::CellEntry,
    record::{CellRecord, Portal},
};

use crate::{
    ByteSource, Error, Scene,
    stand_ins::StandIns,
    strategy::{ahead::Cells, sight::Seen},
};

/// What is used besides levels.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Uses {
    /// Smooth LODs, where they cost less.
    pub(crate) smooth: bool,
    /// Rules, where growing costs less.
    pub(crate) rules: bool,
}

/// A cell that was read of.
#[derive(Debug)]
pub(crate) struct Place {
    pub(crate) entry: CellEntry,
    pub(crate) portals: Vec<Portal>,
    /// Largest solid angle first.
    pub(crate) seen: Vec<Seen>,
    /// What could not be read: objects, or 1 for the record itself, or for what nobody knows of. It is never there.
    pub(crate) lost: usize,
    /// Whether nothing says what can be seen from there.
    pub(crate) is_unknown: bool,
}

impl Place {
    /// Whether neither a record nor anything around could be read.
    pub(crate) fn is_blank(&self) -> bool {
        self.is_unknown && self.seen.is_empty()
    }

    /// Whether it says less of a cell than what is known of it, as what was read while the server was away.
    pub(crate) fn says_less_than(&self, known: &Self) -> bool {
        self.is_unknown && !known.is_unknown || self.is_blank() && !known.is_blank()
    }

    /// Whether some objects are known only as far as they can be grown.
    pub(crate) fn has_stand_ins(&self) -> bool {
        self.seen.iter().any(Seen::is_stand_in)
    }
}

/// All cells that were read of.
#[derive(Debug, Default)]
pub(crate) struct Atlas {
    places: HashMap<CellId, Place>,
}

impl Atlas {
    pub(crate) fn place(&self, cell: CellId) -> Option<&Place> {
        self.places.get(&cell)
    }

    pub(crate) fn seen_from(&self, cell: CellId) -> &[Seen] {
        self.place(cell).map_or(&[], |place| &place.seen)
    }

    /// What can be seen from a cell and, as far as that is known, from the cells next door.
    pub(crate) fn seen_around(&self, cell: CellId) -> impl Iterator<Item = &Seen> {
        let next_door = self.place(cell).map_or(&[][..], |place| &place.entry.adjacent);
        let around = next_door.iter().flat_map(|cell| self.seen_from(*cell));
        self.seen_from(cell).iter().chain(around)
    }

    /// Forgets what is known only as far as it can be grown; says of which cells.
    pub(crate) fn forget_stand_ins(&mut self) -> Vec<CellId> {
        let places = self.places.values().filter(|place| place.has_stand_ins());
        let forgotten: Vec<_> = places.map(|place| place.entry.cell).collect();
        for cell in &forgotten {
            self.places.remove(cell);
        }
        forgotten
    }

    /// Cells of which something could not be read.
    pub(crate) fn lacking(&self) -> impl Iterator<Item = CellId> {
        let lacking = self.places.values().filter(|place| place.lost > 0);
        lacking.map(|place| place.entry.cell)
    }

    pub(crate) fn add(&mut self, place: Place) {
        self.places.insert(place.entry.cell, place);
    }
}

impl Cells for Atlas {
    fn entry(&self, cell: CellId) -> Option<&CellEntry> {
        self.place(cell).map(|place| &place.entry)
    }

    fn portals(&self, cell: CellId) -> &[Portal] {
        self.place(cell).map_or(&[], |place| &place.portals)
    }
}

/// Reads what can be seen from a cell, as its record says; where that could not be had, all that is around. Says what could
/// not be read.
pub(crate) async fn look<S: ByteSource>(
    scene: &Scene<S>,
    entry: CellEntry,
    record: Option<CellRecord>,
    uses: Uses,
) -> (Place, Vec<Error>) {
    let mut place = Place {
        entry,
        portals: Vec::new(),
        seen: Vec::new(),
        lost: 0,
        is_unknown: false,
    };
    let mut failures = Vec::new();
    let record = match record {
        Some(record) => record,
        None => {
            (place.lost, place.is_unknown) = (1, true);
            let (surroundings, others) = scene.surroundings(&place.entry).await;
            failures.extend(others);
            surroundings
        }
    };
    let all = record.visible();
    let mut stand_ins = StandIns::default();
    if uses.rules {
        let objects: Vec<_> = all.iter().map(|visible| visible.object).collect();
        stand_ins = StandIns::read(scene, &objects).await;
        failures.append(&mut stand_ins.failures);
    }
    for visible in all {
        let solid_angle_sr = f64::from(visible.solid_angle_sr);
        if let Some(seen) = stand_ins.seen(scene, visible.object, solid_angle_sr).await {
            place.seen.push(seen);
            continue;
        }
        match seen(scene, visible.object, solid_angle_sr, uses).await {
            Ok(seen) => place.seen.push(seen),
            Err(cause) => {
                failures.push(cause);
                place.lost += 1;
            }
        }
    }
    place.portals = record.portals;
    (place, failures)
}

async fn seen<S: ByteSource>(
    scene: &Scene<S>,
    object: belvedere_scene::ObjectId,
    solid_angle_sr: f64,
    uses: Uses,
) -> Result<Seen, Error> {
    let entry = scene.entry(object).await?;
    let mut model = scene.model(&entry).await?;
    if !uses.smooth && model.smooth.is_some() {
        Arc::make_mut(&mut model).smooth = None;
    }
    if !uses.rules && model.procedural.is_some() {
        Arc::make_mut(&mut model).procedural = None;
    }
    Ok(Seen::new(&entry, model, solid_angle_sr))
}
