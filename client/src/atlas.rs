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
    strategy::{ahead::Cells, sight::Seen},
};

/// A cell that was read of.
#[derive(Debug)]
pub(crate) struct Place {
    pub(crate) entry: CellEntry,
    pub(crate) portals: Vec<Portal>,
    /// Largest solid angle first.
    pub(crate) seen: Vec<Seen>,
    /// What could not be read: objects, or 1 for the record itself. It is never there.
    pub(crate) lost: usize,
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

/// Reads what can be seen from a cell whose record came, or not; says what could not be read.
pub(crate) async fn look<S: ByteSource>(
    scene: &Scene<S>,
    entry: CellEntry,
    record: Result<CellRecord, Error>,
    smooth: bool,
) -> (Place, Vec<Error>) {
    let mut place = Place {
        entry,
        portals: Vec::new(),
        seen: Vec::new(),
        lost: 0,
    };
    let mut failures = Vec::new();
    let record = match record {
        Ok(record) => record,
        Err(cause) => {
            place.lost = 1;
            return (place, vec![cause]);
        }
    };
    for visible in record.visible() {
        match seen(scene, visible.object, f64::from(visible.solid_angle_sr), smooth).await {
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
    smooth: bool,
) -> Result<Seen, Error> {
    let entry = scene.entry(object).await?;
    let mut model = scene.model(&entry).await?;
    if !smooth && model.smooth.is_some() {
        Arc::make_mut(&mut model).smooth = None;
    }
    Ok(Seen::new(&entry, model, solid_angle_sr))
}
