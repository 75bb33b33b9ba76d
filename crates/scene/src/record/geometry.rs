//! How are hull, portals and sizes written? With bincode, and only here: standard configuration (little-endian,
//! variable-length integers), so that `docs/FORMAT.md` can give the bytes and the crate can be replaced without
//! changing them.
//!
//! A coordinate stands once: corners are indices into the rising lists of the coordinates of each axis.

use super::{CellRecord, DecodeError, Guarantee, Hull, Portal, rounding::halved};
use crate::{Bounds, CellId, ObjectId};

/// A decoder never allocates more than this for one geometry section, whatever it claims.
const DECODE_LIMIT_BYTES: usize = 64 << 20;
/// The code of the smallest miss bound above 0.
const LEAST_MISS: u16 = 1000;
/// Methods that take one byte.
const METHODS: [&str; 4] = ["sampled", "occluders", "portals", "conservative"];

#[derive(bincode::Encode, bincode::Decode)]
struct Section {
    cell: u32,
    /// By axis, rising.
    coordinates: [Vec<f64>; 3],
    hull: HullForm,
    adjacent: Vec<u32>,
    portals: Vec<PortalForm>,
    method: MethodForm,
    conservative: bool,
    miss: u16,
    visible_level0_bytes: u64,
    visible_coarsest_bytes: u64,
}

/// Indices of coordinates.
type Corner = [u32; 3];

#[derive(bincode::Encode, bincode::Decode)]
enum HullForm {
    Box { min: Corner, max: Corner },
    Any { points: Vec<Corner>, faces: Vec<Vec<u32>> },
}

#[derive(bincode::Encode, bincode::Decode)]
struct PortalForm {
    to: u32,
    polygon: Vec<Corner>,
    door: Option<u32>,
}

#[derive(bincode::Encode, bincode::Decode)]
enum MethodForm {
    Known(u8),
    Other(String),
}

/// The section of a record. Coordinates must be finite.
pub(super) fn encode(record: &CellRecord) -> Vec<u8> {
    // There is one zero.
    let plain = |value: f64| value + 0.0;
    let mut coordinates: [Vec<f64>; 3] = Default::default();
    for point in record
        .hull
        .points
        .iter()
        .chain(record.portals.iter().flat_map(|p| &p.polygon))
    {
        for (list, value) in coordinates.iter_mut().zip(point) {
            list.push(plain(*value));
        }
    }
    for list in &mut coordinates {
        list.sort_by(f64::total_cmp);
        list.dedup();
    }
    let corner = |point: &[f64; 3]| -> Corner {
        std::array::from_fn(|axis| coordinates[axis].partition_point(|c| *c < point[axis]) as u32)
    };
    let bounds = Bounds::around(record.hull.points.iter().copied());
    let hull = if record.hull == Hull::of_box(&bounds) {
        HullForm::Box {
            min: corner(&record.hull.points[0]),
            max: corner(&record.hull.points[7]),
        }
    } else {
        HullForm::Any {
            points: record.hull.points.iter().map(corner).collect(),
            faces: record.hull.faces.clone(),
        }
    };
    let portal = |portal: &Portal| PortalForm {
        to: portal.to.0,
        polygon: portal.polygon.iter().map(corner).collect(),
        door: portal.door.map(|door| door.0),
    };
    let portals = record.portals.iter().map(portal).collect();
    let known = METHODS.iter().position(|method| *method == record.method);
    let section = Section {
        cell: record.cell.0,
        hull,
        adjacent: record.adjacent.iter().map(|cell| cell.0).collect(),
        portals,
        method: known.map_or_else(
            || MethodForm::Other(record.method.clone()),
            |at| MethodForm::Known(at as u8),
        ),
        conservative: record.guarantee == Guarantee::Conservative,
        miss: miss_code(record.miss_bound),
        visible_level0_bytes: record.visible_level0_bytes,
        visible_coarsest_bytes: record.visible_coarsest_bytes,
        coordinates,
    };
    bincode::encode_to_vec(section, bincode::config::standard()).expect("writing plain values into memory cannot fail")
}

/// The record of a section, without what is visible.
pub(super) fn decode(bytes: &[u8]) -> Result<CellRecord, DecodeError> {
    let config = bincode::config::standard().with_limit::<DECODE_LIMIT_BYTES>();
    let (section, read): (Section, usize) =
        bincode::decode_from_slice(bytes, config).map_err(|e| DecodeError::Damaged(e.to_string()))?;
    if read < bytes.len() {
        return Err(DecodeError::damaged("bytes follow the end of its geometry"));
    }
    if !section.coordinates.iter().flatten().all(|value| value.is_finite()) {
        return Err(DecodeError::damaged("a coordinate is not finite"));
    }
    let coordinates = &section.coordinates;
    let point = |corner: &Corner| -> Result<[f64; 3], DecodeError> {
        let mut point = [0.0; 3];
        for axis in 0..3 {
            let value = coordinates[axis].get(corner[axis] as usize);
            point[axis] =
                *value.ok_or_else(|| DecodeError::damaged("a corner names a coordinate that is not there"))?;
        }
        Ok(point)
    };
    let hull = match &section.hull {
        HullForm::Box { min, max } => Hull::of_box(&Bounds {
            min: point(min)?,
            max: point(max)?,
        }),
        HullForm::Any { points, faces } => {
            if faces.iter().flatten().any(|index| *index as usize >= points.len()) {
                return Err(DecodeError::damaged("a hull face names a point that is not there"));
            }
            Hull {
                points: points.iter().map(point).collect::<Result<_, _>>()?,
                faces: faces.clone(),
            }
        }
    };
    let portal = |portal: &PortalForm| {
        Ok(Portal {
            to: CellId(portal.to),
            polygon: portal.polygon.iter().map(point).collect::<Result<_, _>>()?,
            door: portal.door.map(ObjectId),
        })
    };
    if section.miss > LEAST_MISS {
        return Err(DecodeError::damaged("its miss bound has no meaning"));
    }
    let method = match section.method {
        MethodForm::Known(at) => {
            let method = METHODS.get(usize::from(at)).copied();
            method
                .ok_or_else(|| DecodeError::damaged("its method is unknown"))?
                .to_owned()
        }
        MethodForm::Other(method) => method,
    };
    Ok(CellRecord {
        cell: CellId(section.cell),
        hull,
        adjacent: section.adjacent.iter().copied().map(CellId).collect(),
        portals: section.portals.iter().map(portal).collect::<Result<_, DecodeError>>()?,
        cpvs: Vec::new(),
        opvs: Vec::new(),
        lpvs: Vec::new(),
        method,
        guarantee: if section.conservative {
            Guarantee::Conservative
        } else {
            Guarantee::Sampled
        },
        miss_bound: miss_bound(section.miss),
        visible_level0_bytes: section.visible_level0_bytes,
        visible_coarsest_bytes: section.visible_coarsest_bytes,
    })
}

/// The code of the smallest bound that is not below this one.
fn miss_code(bound: f64) -> u16 {
    if bound <= 0.0 {
        return 0;
    }
    (1..=LEAST_MISS)
        .rev()
        .find(|code| miss_bound(*code) >= bound)
        .unwrap_or(1)
}

/// 0 for 0; else eight steps to each halving, from 1 down.
fn miss_bound(code: u16) -> f64 {
    let Some(step) = code.checked_sub(1) else {
        return 0.0;
    };
    f64::from(16 - step % 8) / 16.0 * halved(u32::from(step / 8))
}
