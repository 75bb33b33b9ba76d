//! What is visible from one view cell?
//!
//! A [`CellRecord`] travels in two forms: compact binary ([`CellRecord::encode`], extension `.cell`) for clients of
//! ours and JSON for everybody else. The binary form is a header of six bytes and a bincode 2 payload; only the module
//! at the end of this file knows bincode, and `docs/FORMAT.md` gives the bytes.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::{BlobName, CellId, ObjectId, convex::HalfSpace, index::CellEntry};

/// Everything that a record says of one cell. Ids are those of its revision.
#[derive(Debug, Clone, PartialEq)]
pub struct CellRecord {
    /// The cell.
    pub cell: CellId,
    /// Its convex hull.
    pub hull: Hull,
    /// Cells that share an opening with it, rising.
    pub adjacent: Vec<CellId>,
    /// The openings.
    pub portals: Vec<Portal>,
    /// Cells that can be seen into from here, rising, without the cell itself. Movers in any other cell are hidden.
    pub cpvs: Vec<CellId>,
    /// Objects that can be seen and do not lie wholly inside the cell, largest visible solid angle first.
    pub opvs: Vec<Visible>,
    /// Objects that can be seen and lie wholly inside the cell, largest visible solid angle first.
    pub lpvs: Vec<Visible>,
    /// How the sets were computed.
    pub method: String,
    /// Whether they may miss something.
    pub guarantee: Guarantee,
    /// Estimated chance that a sight line from the cell ends on an object that is missing; 0 when conservative.
    pub miss_bound: f64,
    /// Bytes of the level 0 of everything visible, each model once, with textures.
    pub visible_level0_bytes: u64,
    /// Bytes of the coarsest level of everything visible, each model once, with textures.
    pub visible_coarsest_bytes: u64,
}

/// A convex polyhedron in world space, metres.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, bincode::Encode, bincode::Decode)]
pub struct Hull {
    /// Corners.
    pub points: Vec<[f64; 3]>,
    /// Each face as indices into `points`, counter-clockwise seen from outside.
    pub faces: Vec<Vec<u32>>,
}

impl Hull {
    /// The hull of a box.
    #[must_use]
    pub fn of_box(bounds: &crate::Bounds) -> Self {
        let faces = [
            [0, 4, 6, 2],
            [1, 3, 7, 5],
            [0, 1, 5, 4],
            [2, 6, 7, 3],
            [0, 2, 3, 1],
            [4, 5, 7, 6],
        ];
        Self {
            points: bounds.corners().to_vec(),
            faces: faces.map(Vec::from).to_vec(),
        }
    }
}

/// An opening between two cells.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Portal {
    /// The cell on the other side.
    pub to: CellId,
    /// A convex polygon in world space, metres.
    pub polygon: Vec<[f64; 3]>,
    /// The door that closes it.
    pub door: Option<ObjectId>,
}

/// An object that can be seen from somewhere in the cell.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Visible {
    /// The object.
    pub object: ObjectId,
    /// The share of sight lines from the cell to the object that arrive, in (0, 1].
    pub fraction: f32,
    /// What is visible of it fills this solid angle on average over all eyes in the cell, in steradians, in (0, 4π].
    pub solid_angle_sr: f32,
    /// Doors that hide it when they are closed.
    pub doors: Vec<ObjectId>,
}

/// Whether a visible set may miss something.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Guarantee {
    /// Never misses anything.
    Conservative,
    /// May miss with at most the stated estimate.
    Sampled,
}

impl CellRecord {
    /// Objects of both sets, largest visible solid angle first: the order in which a client fetches them.
    #[must_use]
    pub fn visible(&self) -> Vec<&Visible> {
        let mut all: Vec<_> = self.lpvs.iter().chain(&self.opvs).collect();
        all.sort_by(|a, b| {
            b.solid_angle_sr
                .total_cmp(&a.solid_angle_sr)
                .then(a.object.cmp(&b.object))
        });
        all
    }
}

/// The JSON twin of a record.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CellJson {
    /// The cell.
    pub cell: CellId,
    /// Its convex hull.
    pub hull: Hull,
    /// Cells that share an opening with it.
    pub adjacent: Vec<CellId>,
    /// The openings.
    pub portals: Vec<Portal>,
    /// Cells that can be seen into from here.
    pub cpvs: Vec<CellId>,
    /// Visible objects that do not lie wholly inside the cell.
    pub opvs: Vec<Visible>,
    /// Visible objects that lie wholly inside the cell.
    pub lpvs: Vec<Visible>,
    /// How the sets were computed.
    pub method: String,
    /// Whether they may miss something.
    pub guarantee: Guarantee,
    /// Estimated chance that a sight line ends on a missing object.
    pub miss_bound: f64,
    /// Sizes.
    pub bytes: CellBytes,
}

/// Sizes that a client can plan with.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CellBytes {
    /// The binary record.
    pub record: u64,
    /// The delta from each adjacent cell; format 1 has none.
    pub delta: BTreeMap<CellId, u64>,
    /// Level 0 of everything visible, each model and texture once.
    pub visible_level0: u64,
    /// The coarsest level of everything visible, each model and texture once.
    pub visible_coarsest: u64,
}

impl CellJson {
    /// The twin of a record whose binary form has `record_bytes` bytes.
    #[must_use]
    pub fn of(record: &CellRecord, record_bytes: u64) -> Self {
        let record = record.clone();
        Self {
            cell: record.cell,
            hull: record.hull,
            adjacent: record.adjacent,
            portals: record.portals,
            cpvs: record.cpvs,
            opvs: record.opvs,
            lpvs: record.lpvs,
            method: record.method,
            guarantee: record.guarantee,
            miss_bound: record.miss_bound,
            bytes: CellBytes {
                record: record_bytes,
                delta: BTreeMap::new(),
                visible_level0: record.visible_level0_bytes,
                visible_coarsest: record.visible_coarsest_bytes,
            },
        }
    }
}

/// What the index says of a record that was written; `planes` are those of a cell that is not a box.
#[must_use]
pub fn index_entry(record: &CellRecord, planes: &[HalfSpace], binary: (BlobName, u64), json: BlobName) -> CellEntry {
    CellEntry {
        cell: record.cell,
        bounds: crate::Bounds::around(record.hull.points.iter().copied()),
        planes: planes.to_vec(),
        adjacent: record.adjacent.clone(),
        record: binary.0,
        record_bytes: binary.1,
        record_json: json,
    }
}

/// Why bytes are not a cell record.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum DecodeError {
    /// The first four bytes are not `BVCR`.
    #[error("not a cell record: it does not start with `BVCR`")]
    Magic,
    /// Written by a newer build.
    #[error("cell record of version {found}; this build reads version {newest}")]
    TooNew {
        /// The version that it claims.
        found: u16,
        /// The version that this build reads.
        newest: u16,
    },
    /// The payload ends early, claims too much, or holds values that make no sense.
    #[error("cell record is damaged: {0}")]
    Damaged(String),
}

/// The first bytes of a binary record.
pub const MAGIC: [u8; 4] = *b"BVCR";
/// The version of the binary record.
pub const VERSION: u16 = 1;
/// A decoder never allocates more than this for one record, whatever it claims.
pub const DECODE_LIMIT_BYTES: usize = 64 << 20;

impl CellRecord {
    /// The binary form: `BVCR`, the version as u16 little-endian, then the payload.
    #[must_use]
    pub fn encode(&self) -> Vec<u8> {
        let mut bytes = MAGIC.to_vec();
        bytes.extend(VERSION.to_le_bytes());
        binary::encode(self, &mut bytes);
        bytes
    }

    /// Reads the binary form.
    ///
    /// # Errors
    /// When the bytes are cut short, damaged, newer than this build, or hold indices out of range or numbers that are
    /// not finite. Allocates at most [`DECODE_LIMIT_BYTES`].
    pub fn decode(bytes: &[u8]) -> Result<Self, DecodeError> {
        let rest = bytes.strip_prefix(&MAGIC).ok_or(DecodeError::Magic)?;
        let (version, payload) = rest
            .split_first_chunk()
            .ok_or_else(|| DecodeError::Damaged("no version".to_owned()))?;
        let found = u16::from_le_bytes(*version);
        if found != VERSION {
            return Err(DecodeError::TooNew { found, newest: VERSION });
        }
        let record = binary::decode(payload)?;
        record.check()?;
        Ok(record)
    }

    fn check(&self) -> Result<(), DecodeError> {
        let damaged = |what: &str| Err(DecodeError::Damaged(what.to_owned()));
        let finite = |p: &[f64; 3]| p.iter().all(|x| x.is_finite());
        if !self.hull.points.iter().all(finite) || !self.portals.iter().all(|p| p.polygon.iter().all(finite)) {
            return damaged("a coordinate is not finite");
        }
        if self
            .hull
            .faces
            .iter()
            .flatten()
            .any(|i| *i as usize >= self.hull.points.len())
        {
            return damaged("a hull face names a point that is not there");
        }
        if !self.visible().iter().all(|v| v.fraction > 0.0 && v.fraction <= 1.0) {
            return damaged("a visible fraction is not in (0, 1]");
        }
        if !(self.miss_bound >= 0.0 && self.miss_bound <= 1.0) {
            return damaged("the miss bound is not in [0, 1]");
        }
        Ok(())
    }
}

/// The only place that knows bincode: standard configuration (little-endian, variable-length integers), so that
/// `docs/FORMAT.md` can give the bytes and the crate can be replaced without changing them.
mod binary {
    use super::{CellRecord, DECODE_LIMIT_BYTES, DecodeError, Guarantee, Hull, Portal, Visible};
    use crate::{CellId, ObjectId};

    /// Fractions are stored as u16, rounded up so that what is visible never becomes 0.
    const FRACTION_STEPS: f32 = 65535.0;
    /// Solid angles are stored as the u16 n that stands for 4π · 2^(−n/256) steradians: 0.3 % apart, down to 2^−255.
    const STEPS_PER_HALVING: f64 = 256.0;

    fn solid_angle_code(solid_angle_sr: f32) -> u16 {
        let halvings = -(f64::from(solid_angle_sr) / (4.0 * std::f64::consts::PI)).log2();
        (halvings * STEPS_PER_HALVING).round().clamp(0.0, f64::from(u16::MAX)) as u16
    }

    fn solid_angle_sr(code: u16) -> f32 {
        (4.0 * std::f64::consts::PI * (-f64::from(code) / STEPS_PER_HALVING).exp2()) as f32
    }

    #[derive(bincode::Encode, bincode::Decode)]
    struct Payload {
        cell: u32,
        hull: Hull,
        adjacent: Vec<u32>,
        portals: Vec<PortalPayload>,
        cpvs: Vec<u32>,
        opvs: Vec<VisiblePayload>,
        lpvs: Vec<VisiblePayload>,
        method: String,
        conservative: bool,
        miss_bound: f64,
        visible_level0_bytes: u64,
        visible_coarsest_bytes: u64,
    }

    #[derive(bincode::Encode, bincode::Decode)]
    struct PortalPayload {
        to: u32,
        polygon: Vec<[f64; 3]>,
        door: Option<u32>,
    }

    #[derive(bincode::Encode, bincode::Decode)]
    struct VisiblePayload {
        object: u32,
        fraction: u16,
        solid_angle: u16,
        doors: Vec<u32>,
    }

    pub(super) fn encode(record: &CellRecord, out: &mut Vec<u8>) {
        let visible = |list: &[Visible]| {
            list.iter()
                .map(|v| VisiblePayload {
                    object: v.object.0,
                    fraction: (v.fraction * FRACTION_STEPS).ceil().clamp(1.0, FRACTION_STEPS) as u16,
                    solid_angle: solid_angle_code(v.solid_angle_sr),
                    doors: v.doors.iter().map(|d| d.0).collect(),
                })
                .collect()
        };
        let payload = Payload {
            cell: record.cell.0,
            hull: record.hull.clone(),
            adjacent: record.adjacent.iter().map(|c| c.0).collect(),
            portals: record
                .portals
                .iter()
                .map(|p| PortalPayload {
                    to: p.to.0,
                    polygon: p.polygon.clone(),
                    door: p.door.map(|d| d.0),
                })
                .collect(),
            cpvs: record.cpvs.iter().map(|c| c.0).collect(),
            opvs: visible(&record.opvs),
            lpvs: visible(&record.lpvs),
            method: record.method.clone(),
            conservative: record.guarantee == Guarantee::Conservative,
            miss_bound: record.miss_bound,
            visible_level0_bytes: record.visible_level0_bytes,
            visible_coarsest_bytes: record.visible_coarsest_bytes,
        };
        let encoded = bincode::encode_to_vec(payload, bincode::config::standard());
        out.extend(encoded.expect("encoding plain values into memory cannot fail"));
    }

    pub(super) fn decode(payload: &[u8]) -> Result<CellRecord, DecodeError> {
        let config = bincode::config::standard().with_limit::<DECODE_LIMIT_BYTES>();
        let (payload, read): (Payload, usize) = bincode::decode_from_slice(payload, config)
            .map_err(|e| DecodeError::Damaged(e.to_string()))
            .and_then(|(decoded, read)| {
                if read == payload.len() {
                    Ok((decoded, read))
                } else {
                    Err(DecodeError::Damaged(format!(
                        "{} bytes follow its end",
                        payload.len() - read
                    )))
                }
            })?;
        debug_assert!(read > 0);
        let visible = |list: Vec<VisiblePayload>| {
            list.into_iter()
                .map(|v| Visible {
                    object: ObjectId(v.object),
                    fraction: f32::from(v.fraction) / FRACTION_STEPS,
                    solid_angle_sr: solid_angle_sr(v.solid_angle),
                    doors: v.doors.into_iter().map(ObjectId).collect(),
                })
                .collect()
        };
        Ok(CellRecord {
            cell: CellId(payload.cell),
            hull: payload.hull,
            adjacent: payload.adjacent.into_iter().map(CellId).collect(),
            portals: payload
                .portals
                .into_iter()
                .map(|p| Portal {
                    to: CellId(p.to),
                    polygon: p.polygon,
                    door: p.door.map(ObjectId),
                })
                .collect(),
            cpvs: payload.cpvs.into_iter().map(CellId).collect(),
            opvs: visible(payload.opvs),
            lpvs: visible(payload.lpvs),
            method: payload.method,
            guarantee: if payload.conservative {
                Guarantee::Conservative
            } else {
                Guarantee::Sampled
            },
            miss_bound: payload.miss_bound,
            visible_level0_bytes: payload.visible_level0_bytes,
            visible_coarsest_bytes: payload.visible_coarsest_bytes,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Bounds;

    fn sample() -> CellRecord {
        CellRecord {
            cell: CellId(12),
            hull: Hull::of_box(&Bounds {
                min: [0.0; 3],
                max: [1.0, 2.0, 3.0],
            }),
            adjacent: vec![CellId(11), CellId(300)],
            portals: vec![Portal {
                to: CellId(11),
                polygon: vec![[0.0, 0.0, 1.0], [0.0, 2.0, 1.0], [0.0, 2.0, 2.0]],
                door: Some(ObjectId(7)),
            }],
            cpvs: vec![CellId(11), CellId(70_000)],
            opvs: vec![Visible {
                object: ObjectId(9),
                fraction: 0.25,
                solid_angle_sr: 0.5,
                doors: vec![ObjectId(7)],
            }],
            lpvs: vec![Visible {
                object: ObjectId(1),
                fraction: 1.0,
                solid_angle_sr: 1e-6,
                doors: vec![],
            }],
            method: "sampled".to_owned(),
            guarantee: Guarantee::Sampled,
            miss_bound: 1e-4,
            visible_level0_bytes: 123_456,
            visible_coarsest_bytes: 789,
        }
    }

    #[test]
    fn a_record_reads_what_it_writes() {
        let decoded = CellRecord::decode(&sample().encode()).unwrap();
        assert_eq!(decoded.encode(), sample().encode());
        assert_eq!(
            (decoded.cell, &decoded.adjacent, &decoded.cpvs),
            (sample().cell, &sample().adjacent, &sample().cpvs)
        );
        assert!((decoded.opvs[0].fraction - 0.25).abs() < 1e-4);
        for (decoded, given) in decoded.visible().iter().zip(sample().visible()) {
            assert!((decoded.solid_angle_sr / given.solid_angle_sr - 1.0).abs() < 0.002);
        }
    }

    /// The viewer's tests read the same bytes.
    const GOLDEN_HEX: &str = concat!(
        "4256435201000c08000000000000000000000000000000000000000000000000000000000000f03f00000000000000000000000000000000",
        "000000000000000000000000000000400000000000000000000000000000f03f000000000000004000000000000000000000000000000000",
        "00000000000000000000000000000840000000000000f03f0000000000000000000000000000084000000000000000000000000000000040",
        "0000000000000840000000000000f03f00000000000000400000000000000840060400040602040103070504000105040402060703040002",
        "03010404050706020bfb2c01010b0300000000000000000000000000000000000000000000f03f0000000000000000000000000000004000",
        "0000000000f03f0000000000000000000000000000004000000000000000400107020bfc701101000109fb0040fba70401070101fbfffffb",
        "9517000773616d706c6564002d431cebe2361a3ffc40e20100fb1503",
    );

    #[test]
    fn the_bytes_are_those_that_the_format_promises() {
        let hex: String = sample().encode().iter().map(|byte| format!("{byte:02x}")).collect();
        assert_eq!(hex, GOLDEN_HEX);
    }

    #[test]
    fn a_truncated_record_is_refused_at_every_length() {
        let bytes = sample().encode();
        for end in 0..bytes.len() {
            assert!(
                CellRecord::decode(&bytes[..end]).is_err(),
                "accepted {end} of {} bytes",
                bytes.len()
            );
        }
    }

    #[test]
    fn bytes_after_the_end_are_refused() {
        let mut bytes = sample().encode();
        bytes.push(0);
        assert!(matches!(CellRecord::decode(&bytes), Err(DecodeError::Damaged(_))));
    }

    #[test]
    fn a_flipped_bit_never_panics_nor_takes_much_memory() {
        let bytes = sample().encode();
        for bit in 0..bytes.len() * 8 {
            let mut flipped = bytes.clone();
            flipped[bit / 8] ^= 1 << (bit % 8);
            let _ = CellRecord::decode(&flipped);
        }
    }

    #[test]
    fn a_newer_record_says_so() {
        let mut bytes = sample().encode();
        bytes[4] = 9;
        assert_eq!(
            CellRecord::decode(&bytes),
            Err(DecodeError::TooNew {
                found: 9,
                newest: VERSION
            })
        );
    }

    #[test]
    fn the_faces_of_a_box_hull_point_outwards() {
        let bounds = Bounds {
            min: [-1.0; 3],
            max: [1.0; 3],
        };
        let hull = Hull::of_box(&bounds);
        for face in &hull.faces {
            let p: Vec<_> = face.iter().map(|i| hull.points[*i as usize]).collect();
            let edge = |a: [f64; 3], b: [f64; 3]| [b[0] - a[0], b[1] - a[1], b[2] - a[2]];
            let (u, v) = (edge(p[0], p[1]), edge(p[1], p[2]));
            let normal = [
                u[1] * v[2] - u[2] * v[1],
                u[2] * v[0] - u[0] * v[2],
                u[0] * v[1] - u[1] * v[0],
            ];
            let outwards: f64 = (0..3).map(|a| normal[a] * (p[0][a] + p[2][a])).sum();
            assert!(outwards > 0.0, "face {face:?} points inwards");
        }
    }
}
