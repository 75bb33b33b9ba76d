//! How fine are solid angles and fractions? Powers of two: fine enough to fetch the important first and to weigh what is
//! half hidden, and a byte for both. Nothing here needs more than multiplication, so that every machine rounds alike.

use super::{
    CellRecord, DecodeError, Visible,
    coded::{Coded, Entry, SMALLEST_ANGLE, SMALLEST_FRACTION},
    geometry,
};
use crate::{CellId, ObjectId};

/// 2⁻ⁿ for n below 128.
pub(super) fn halved(n: u32) -> f64 {
    1.0 / (1u128 << n) as f64
}

/// The n for which 2⁻ⁿ is nearest to a share, by ratio.
fn halvings(share: f64, most: u8) -> u8 {
    let near = (0..most).find(|n| share * share >= halved(2 * u32::from(*n) + 1));
    near.unwrap_or(most)
}

/// A whole sphere, in steradians.
const SPHERE_SR: f64 = 4.0 * std::f64::consts::PI;

impl Coded {
    pub(super) fn of(record: &CellRecord) -> Self {
        let entry = |visible: &Visible, local: bool| {
            let mut doors: Vec<u32> = visible.doors.iter().map(|door| door.0).collect();
            doors.sort_unstable();
            doors.dedup();
            Entry {
                object: visible.object.0,
                angle: halvings(f64::from(visible.solid_angle_sr) / SPHERE_SR, SMALLEST_ANGLE),
                fraction: halvings(f64::from(visible.fraction), SMALLEST_FRACTION),
                local,
                doors,
            }
        };
        let local = record.lpvs.iter().map(|visible| entry(visible, true));
        let shared = record.opvs.iter().map(|visible| entry(visible, false));
        let mut objects: Vec<Entry> = local.chain(shared).collect();
        objects.sort_by_key(|entry| entry.object);
        objects.dedup_by_key(|entry| entry.object);
        let mut doors: Vec<u32> = objects.iter().flat_map(|entry| entry.doors.iter().copied()).collect();
        doors.sort_unstable();
        doors.dedup();
        let mut cells: Vec<u32> = record.cpvs.iter().map(|cell| cell.0).collect();
        cells.sort_unstable();
        cells.dedup();
        Self {
            geometry: geometry::encode(record),
            objects,
            doors,
            cells,
        }
    }

    pub(super) fn record(self) -> Result<CellRecord, DecodeError> {
        let mut record = geometry::decode(&self.geometry)?;
        record.cpvs = self.cells.into_iter().map(CellId).collect();
        let mut objects = self.objects;
        objects.sort_by_key(|entry| (entry.angle, entry.object));
        for entry in objects {
            let visible = Visible {
                object: ObjectId(entry.object),
                fraction: halved(entry.fraction.into()) as f32,
                solid_angle_sr: (SPHERE_SR * halved(entry.angle.into())) as f32,
                doors: entry.doors.into_iter().map(ObjectId).collect(),
            };
            if entry.local {
                record.lpvs.push(visible);
            } else {
                record.opvs.push(visible);
            }
        }
        Ok(record)
    }
}
