//! Do records and steps say what they were given, and survive what they were not?

use proptest::prelude::*;

use super::{binary::VERSION, *};
use crate::{Bounds, CellId};

fn bounds() -> Bounds {
    Bounds {
        min: [0.0; 3],
        max: [1.0, 2.0, 3.0],
    }
}

fn visible(object: u32, fraction: f32, solid_angle_sr: f32, doors: &[u32]) -> Visible {
    Visible {
        object: ObjectId(object),
        fraction,
        solid_angle_sr,
        doors: doors.iter().map(|door| ObjectId(*door)).collect(),
    }
}

fn sample() -> CellRecord {
    CellRecord {
        cell: CellId(12),
        hull: Hull::of_box(&bounds()),
        adjacent: vec![CellId(11), CellId(300)],
        portals: vec![Portal {
            to: CellId(11),
            polygon: vec![[0.0, 0.0, 1.0], [0.0, 2.0, 1.0], [0.0, 2.0, 2.0]],
            door: Some(ObjectId(7)),
        }],
        cpvs: vec![CellId(11), CellId(70_000)],
        opvs: vec![visible(9, 0.25, 0.5, &[7]), visible(40, 0.5, 0.4, &[7, 8])],
        lpvs: vec![visible(1, 1.0, 1e-6, &[])],
        method: "sampled".to_owned(),
        guarantee: Guarantee::Sampled,
        miss_bound: 1e-4,
        visible_level0_bytes: 123_456,
        visible_coarsest_bytes: 789,
    }
}

/// What is next door to [`sample`], with a hull that is no box.
fn next_door() -> CellRecord {
    CellRecord {
        cell: CellId(300),
        hull: Hull {
            points: vec![[1.0, 0.0, 0.0], [4.0, 0.0, 0.0], [1.0, 2.0, 0.0], [1.0, 0.0, 3.0]],
            faces: vec![vec![0, 2, 1], vec![0, 1, 3], vec![0, 3, 2], vec![1, 2, 3]],
        },
        adjacent: vec![CellId(12)],
        portals: Vec::new(),
        cpvs: vec![CellId(12), CellId(13), CellId(70_000)],
        opvs: vec![
            visible(1, 0.06, 0.001, &[]),
            visible(9, 0.5, 1.5, &[]),
            visible(41, 0.5, 0.4, &[8, 10]),
        ],
        lpvs: vec![visible(u32::MAX, 0.9, 2.0, &[])],
        method: "of our own".to_owned(),
        guarantee: Guarantee::Conservative,
        miss_bound: 0.0,
        visible_level0_bytes: 1 << 50,
        visible_coarsest_bytes: 0,
    }
}

#[test]
fn a_record_reads_what_it_writes() {
    for record in [sample(), next_door()] {
        let decoded = CellRecord::decode(&record.encode()).unwrap();
        assert_eq!(decoded, record.rounded());
        assert_eq!(decoded.encode(), record.encode());
        assert_eq!((&decoded.hull, &decoded.portals), (&record.hull, &record.portals));
        assert_eq!((&decoded.cpvs, &decoded.method), (&record.cpvs, &record.method));
        let seen = record.visible();
        assert_eq!(decoded.visible().len(), seen.len());
        for found in decoded.visible() {
            let given = seen.iter().find(|given| given.object == found.object).unwrap();
            assert_eq!(found.doors, given.doors);
            for ratio in [
                found.fraction / given.fraction,
                found.solid_angle_sr / given.solid_angle_sr,
            ] {
                assert!((0.7..1.5).contains(&ratio), "{found:?} was {given:?}");
            }
        }
    }
}

#[test]
fn the_miss_bound_never_promises_more_than_was_given() {
    for given in [0.0, 1e-300, 1e-9, 0.001, 0.5, 0.51, 0.999, 1.0] {
        let record = CellRecord {
            miss_bound: given,
            ..sample()
        };
        let rounded = record.rounded().miss_bound;
        assert!(
            rounded >= given && (rounded <= 1.15 * given || given < 1e-30),
            "{given} became {rounded}"
        );
    }
}

#[test]
fn a_step_leads_to_the_bytes_of_the_next_record() {
    for (from, to) in [(sample(), next_door()), (next_door(), sample()), (sample(), sample())] {
        let step = from.step_to(&to);
        let here = CellRecord::decode(&from.encode()).unwrap();
        assert_eq!(here.follow(&step).unwrap().encode(), to.encode());
    }
    assert!(sample().step_to(&sample()).len() < 12);
}

#[test]
fn steps_lead_where_they_say() {
    let steps = Steps::between(&sample(), [&next_door()]);
    let read = Steps::decode(&steps.encode()).unwrap();
    assert_eq!(read, steps);
    assert_eq!(read.from, CellId(12));
    assert_eq!(read.step(CellId(300)), Some(&*sample().step_to(&next_door())));
    assert_eq!(read.step(CellId(11)), None);
}

/// The viewer's tests read the same bytes.
const GOLDEN_RECORD: &str = concat!(
    "4256435202004102a7cfeed93036be46a49f20e079ba2ae2af07db43bde9ce0326af93d092717a879860677c093a7fec8e88515490658c64",
    "3bd2da849def81eabed327b09442887b",
);
/// From that record to the one next door.
const GOLDEN_STEPS: &str = concat!(
    "4256535402000c01ac024d027413cf154c47b5bd2a9321629b4333d6f4663ca3b6ebd640eb269d786e5f0ac99282b61cef2b113a35ffb378",
    "c70119c3872ec1272ae8317f44669e31e0026156e0c4d4f4501b2463bc251a59",
);

#[test]
fn the_bytes_are_those_that_the_viewer_tests_with() {
    let hex = |bytes: Vec<u8>| bytes.iter().map(|byte| format!("{byte:02x}")).collect::<String>();
    assert_eq!(hex(sample().encode()), GOLDEN_RECORD);
    assert_eq!(hex(Steps::between(&sample(), [&next_door()]).encode()), GOLDEN_STEPS);
}

#[test]
fn a_record_or_steps_cut_short_are_refused() {
    let record = sample().encode();
    let steps = Steps::between(&sample(), [&next_door()]).encode();
    for end in 0..record.len() {
        assert!(CellRecord::decode(&record[..end]).is_err(), "accepted {end} bytes");
    }
    for end in 0..steps.len() {
        assert!(Steps::decode(&steps[..end]).is_err(), "accepted {end} bytes");
    }
}

#[test]
fn bytes_after_the_end_are_refused() {
    let (mut record, mut steps) = (sample().encode(), Steps::between(&sample(), []).encode());
    record.push(0);
    steps.push(0);
    assert!(matches!(CellRecord::decode(&record), Err(DecodeError::Damaged(_))));
    assert!(matches!(Steps::decode(&steps), Err(DecodeError::Damaged(_))));
}

#[test]
fn a_record_of_another_version_says_so() {
    for found in [1, 9] {
        let mut bytes = sample().encode();
        bytes[4] = found as u8;
        let known = VERSION;
        assert_eq!(CellRecord::decode(&bytes), Err(DecodeError::Version { found, known }));
    }
}

/// A damaged record is refused, or is one that can be written again.
fn survives(decoded: Result<CellRecord, DecodeError>) {
    if let Ok(record) = decoded {
        assert!(record.hull.points.iter().flatten().all(|x| x.is_finite()));
        let corners = record.hull.points.len();
        assert!(record.hull.faces.iter().flatten().all(|i| (*i as usize) < corners));
        assert!(record.visible().iter().all(|v| v.fraction > 0.0 && v.fraction <= 1.0));
        assert!((0.0..=1.0).contains(&record.miss_bound));
        assert_eq!(CellRecord::decode(&record.encode()).unwrap(), record);
    }
}

#[test]
fn a_flipped_bit_never_panics() {
    let bytes = sample().encode();
    let step = sample().step_to(&next_door());
    for bit in 0..bytes.len() * 8 {
        let mut flipped = bytes.clone();
        flipped[bit / 8] ^= 1 << (bit % 8);
        survives(CellRecord::decode(&flipped));
    }
    for bit in 0..step.len() * 8 {
        let mut flipped = step.clone();
        flipped[bit / 8] ^= 1 << (bit % 8);
        survives(sample().follow(&flipped));
    }
}

fn any_record() -> impl Strategy<Value = CellRecord> {
    let ids = prop_oneof![0u32..200, any::<u32>()];
    let doors = prop::collection::vec(0u32..5, 0..3);
    let seen = (ids.clone(), 1e-4f32..1.0, -30f32..3.6, any::<bool>(), doors);
    let points = prop::collection::vec(prop::array::uniform3(-1e3f64..1e3), 4..12);
    let portals = prop::collection::vec((0u32..300, points.clone(), prop::option::of(0u32..9)), 0..4);
    let sizes = (any::<u64>(), any::<u64>(), 0f64..1.0);
    let lists = (prop::collection::vec(seen, 0..80), prop::collection::vec(ids, 0..40));
    (lists, prop::option::of(points), portals, sizes).prop_map(|((seen, cells), points, portals, sizes)| {
        let list = |inside: bool| {
            let kept = seen.iter().filter(|(_, _, _, local, _)| *local == inside);
            kept.map(|(id, fraction, angle, _, doors)| visible(*id, *fraction, angle.exp2(), doors))
                .collect()
        };
        let faces = vec![vec![0, 1, 2], vec![1, 2, 3]];
        CellRecord {
            hull: points.map_or_else(|| Hull::of_box(&bounds()), |points| Hull { points, faces }),
            portals: portals
                .into_iter()
                .map(|(to, polygon, door)| Portal {
                    to: CellId(to),
                    polygon,
                    door: door.map(ObjectId),
                })
                .collect(),
            cpvs: cells.into_iter().map(CellId).collect(),
            opvs: list(false),
            lpvs: list(true),
            miss_bound: sizes.2,
            visible_level0_bytes: sizes.0,
            visible_coarsest_bytes: sizes.1,
            ..sample()
        }
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn any_record_reads_what_it_writes(record in any_record()) {
        let bytes = record.encode();
        let decoded = CellRecord::decode(&bytes).unwrap();
        prop_assert_eq!(&decoded, &record.rounded());
        prop_assert_eq!(decoded.encode(), bytes);
    }

    #[test]
    fn any_step_leads_to_the_bytes_of_the_next_record(from in any_record(), to in any_record()) {
        let step = from.step_to(&to);
        prop_assert_eq!(from.rounded().follow(&step).unwrap().encode(), to.encode());
    }

    #[test]
    fn a_damaged_record_or_step_never_panics(
        from in any_record(),
        to in any_record(),
        damage in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..4),
    ) {
        let (mut record, mut step) = (to.encode(), from.step_to(&to));
        for (at, byte) in &damage {
            *at.get_mut(&mut record) = *byte;
            *at.get_mut(&mut step) = *byte;
        }
        survives(CellRecord::decode(&record));
        survives(from.follow(&step));
    }

    #[test]
    fn anything_at_all_never_panics(bytes in prop::collection::vec(any::<u8>(), 0..400)) {
        let _ = Steps::decode(&bytes);
        let _ = CellRecord::decode(&bytes);
        survives(sample().follow(&bytes));
        let mut record = binary::header("BVCR");
        binary::push_integer(&mut record, bytes.len() as u64);
        record.extend(bytes);
        survives(CellRecord::decode(&record));
    }
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
