//! Is every event written as before, and does each side know all of them? `tests/golden/live/events.json` holds every kind of
//! event, with and without each member that may be absent, as the server writes it. `client/src/live/state/tests/golden.rs` writes
//! beside it what is understood of that, and `viewer/core/live/golden.test.ts` reads both. `make bless` writes them.

#![allow(clippy::unwrap_used, reason = "a test may fail at any step")]

use std::{collections::BTreeSet, env, fs, path::PathBuf, sync::Arc};

use belvedere_live::{
    event::{
        Attention, Event, Gone, Hello, Hush, Manifest, Moving, Network, ObjectPose, Period, SessionId, Told, Void,
    },
    motion::Pose,
    tbv::Tbv,
};
use belvedere_scene::{BlobName, CellId, ObjectId, Revision, object::ObjectInfo};
use serde_json::json;

/// The largest whole number that every reader of JSON knows.
const MOST: i64 = (1 << 53) - 1;
const MOVER: ObjectId = ObjectId(100_000_000);
const LAST: ObjectId = ObjectId(u32::MAX);
const UPRIGHT: [f64; 4] = [0.0, 0.0, 0.0, 1.0];

fn blob(ext: &str) -> BlobName {
    BlobName::of(ext.as_bytes(), ext).unwrap()
}

fn revision() -> Revision {
    Revision::of_manifest(blob("json").hash())
}

fn hello(network: Option<Network>) -> Event {
    Event::Hello(Hello {
        session: SessionId(7),
        object: MOVER,
        scene: "town-2".parse().unwrap(),
        revision: revision(),
        cell: CellId(0),
        now_ms: 1_764_000_000_123,
        tick_ms: 100,
        lease_ms: 30_000,
        extrapolate_ms: 2_000,
        network,
    })
}

/// A mover that wears no model, or what is not a mover at all.
fn bare(object: ObjectId, mover: bool, door: bool) -> ObjectInfo {
    serde_json::from_value(json!({
        "object": object, "source_node": "Ann \"A.\" \\ Ünï\u{1f600}\n", "part": 0,
        "bounds": { "min": [-1.5, 0, -0.0], "max": [1e21, 0.1, 1e-7] },
        "transform": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0.25, 0, -3, 1],
        "model": null, "mover": mover, "door": door, "levels": [],
    }))
    .unwrap()
}

/// One that wears a model with all that a model may have.
fn dressed() -> ObjectInfo {
    let rung = |number: u32, from: u64, to: u64| {
        let url = blob("slod").url().replace(".slod", &format!(".r{number}.slod"));
        json!({ "url": url, "from": from, "to": to, "triangles": 12, "geometric_error_m": 0.5, "rms_error_m": 0.25 })
    };
    let picture = json!({ "url": blob("png"), "bytes": 1 });
    serde_json::from_value(json!({
        "object": MOVER, "source_node": "", "part": 3,
        "bounds": { "min": [0, 0, 0], "max": [2, 2, 2] },
        "transform": [2, 0, 0, 0, 0, 0, -4, 0, 0, 0.5, 0, 0, 8, 16, 32, 1],
        "model": "m4294967295", "mover": true, "door": false,
        "procedural": {
            "rules": blob("dcg"), "rules_bytes": 9, "imports": { "post": { "url": blob("dcg"), "bytes": 4 } },
            "part": "barn", "parameters": { "floors": 4, "footprint": [[0, 0], [8.5, 0]] }, "seed": 5,
        },
        "levels": [
            {
                "level": 0, "url": blob("glb"), "bytes": 100, "triangles": 12, "geometric_error_m": 0, "switch_distance_m": 0,
                "textures": [picture], "pack": { "url": blob("pack"), "bytes": 300, "from": 200 },
            },
            {
                "level": 1, "url": blob("glb"), "bytes": 50, "triangles": 2, "geometric_error_m": 0.125,
                "switch_distance_m": 116.9,
            },
        ],
        "smooth": {
            "url": blob("slod"), "bytes": 30, "materials": blob("gltf"), "materials_bytes": 3, "textures": [picture],
            "rungs": [rung(0, 0, 10), rung(1, 10, 30)],
        },
        "impostor": {
            "colour": picture, "shape": picture, "mapping": "hemi-octahedral", "views": 8, "size_px": 64,
            "centre": [0, 0.875, 0], "radius": 1.25, "error_m": 0.0625, "switch_distance_m": 58, "frames": 4, "stride_m": 1.5,
        },
    }))
    .unwrap()
}

fn attention(period_ms: i64, visibility: Option<f64>, level: Option<u32>) -> Attention {
    Attention {
        period_ms,
        visibility,
        level,
    }
}

fn told(info: ObjectInfo, moving: Option<(Pose, f64, Attention)>) -> Event {
    let moving = moving.map(|(pose, radius_m, attention)| Moving {
        pose,
        radius_m,
        attention,
    });
    let info = Arc::new(info);
    Event::ObjectInfo(Box::new(Told { info, moving }))
}

fn pose(object: ObjectId, pose: Pose) -> ObjectPose {
    ObjectPose { object, pose }
}

fn poses(t_ms: i64, objects: &[ObjectPose]) -> Event {
    let objects = objects.into();
    Event::ObjectPos { t_ms, objects }
}

fn gone(objects: &[ObjectId], reason: Gone) -> Event {
    let objects = objects.to_vec();
    Event::ObjectGone { objects, reason }
}

fn hush(object: ObjectId, center: [f64; 3], radius_m: f64, until_ms: i64) -> Event {
    let tbv = Tbv { center, radius_m };
    Event::Hush(Hush { object, tbv, until_ms })
}

fn rate(objects: &[(ObjectId, Attention)]) -> Event {
    let period = |&(object, attention): &_| Period { object, attention };
    let objects = objects.iter().map(period).collect();
    Event::Rate { objects }
}

/// Every kind of event; each member that may be absent is there in one and is not in another.
fn cases() -> Vec<(&'static str, Event)> {
    let resting = Pose::resting(1_764_000_000_100, [8.0, 1.5, -4.25], UPRIGHT);
    let moving = Pose {
        t_ms: -1,
        position: [-0.0, 1e21, 1e-7],
        orientation: [0.5, -0.5, 0.5, -0.5],
        velocity: [0.1, 123_456_789.125, -1e300],
        acceleration: [0.0, -9.81, 0.0],
    };
    let late = Pose::resting(MOST, [0.0; 3], UPRIGHT);
    let manifest = Manifest(blob("json"));
    vec![
        ("hello of a server alone", hello(None)),
        ("hello among nodes", hello(Some(Network::Whole))),
        ("hello while nodes are cut off", hello(Some(Network::CutOff))),
        (
            "resync after something was missed",
            Event::Resync { reason: Void::Missed },
        ),
        (
            "resync of a reader that knows nothing",
            Event::Resync { reason: Void::Unknown },
        ),
        ("the first cell", Event::Cell { cell: CellId(0) }),
        ("the last cell", Event::Cell { cell: CellId(u32::MAX) }),
        (
            "a mover without a model",
            told(bare(MOVER, true, false), Some((resting, 0.5, attention(0, None, None)))),
        ),
        (
            "a mover with a model in a crowd",
            told(dressed(), Some((moving, 1e-7, attention(100, Some(0.125), Some(1))))),
        ),
        (
            "a mover that is seen at all and no more",
            told(
                bare(LAST, true, false),
                Some((late, 0.0, attention(MOST, Some(0.0), None))),
            ),
        ),
        ("a static object", told(bare(ObjectId(0), false, false), None)),
        ("a door", told(bare(ObjectId(12), false, true), None)),
        ("no poses", poses(0, &[])),
        ("one pose", poses(1_764_000_000_200, &[pose(MOVER, resting)])),
        ("poses of two", poses(-1, &[pose(LAST, moving), pose(MOVER, late)])),
        ("hidden", gone(&[MOVER, LAST], Gone::Hidden)),
        ("left", gone(&[MOVER], Gone::Left)),
        ("destroyed", gone(&[MOVER], Gone::Destroyed)),
        ("nobody gone", gone(&[], Gone::Left)),
        ("a promise", hush(MOVER, [1.5, -0.0, 1e21], 6.25, 1_764_000_003_600)),
        ("a promise of a clock before 1970", hush(LAST, [0.0; 3], 0.0, -MOST)),
        ("a wake", Event::Wake { object: MOVER }),
        (
            "rates",
            rate(&[
                (MOVER, attention(0, None, None)),
                (LAST, attention(MOST, Some(1.0), Some(0))),
                (ObjectId(100_000_001), attention(250, Some(1e-7), None)),
                (ObjectId(100_000_002), attention(250, None, Some(u32::MAX))),
            ]),
        ),
        ("no rates", rate(&[])),
        (
            "an open door",
            Event::Door {
                object: ObjectId(0),
                open: true,
            },
        ),
        (
            "a closed door",
            Event::Door {
                object: ObjectId(12),
                open: false,
            },
        ),
        (
            "a new revision",
            Event::Revision {
                revision: revision(),
                manifest,
            },
        ),
        (
            "nodes are heard again",
            Event::Network {
                network: Network::Whole,
            },
        ),
        (
            "nodes are not heard",
            Event::Network {
                network: Network::CutOff,
            },
        ),
    ]
}

/// How many kinds of event there are.
const KINDS: usize = 12;

/// Which of them it is: whoever adds one must add it here, and with it cases.
fn kind(event: &Event) -> usize {
    match event {
        Event::Hello(_) => 0,
        Event::Resync { .. } => 1,
        Event::Cell { .. } => 2,
        Event::ObjectInfo(_) => 3,
        Event::ObjectPos { .. } => 4,
        Event::ObjectGone { .. } => 5,
        Event::Hush(_) => 6,
        Event::Wake { .. } => 7,
        Event::Rate { .. } => 8,
        Event::Door { .. } => 9,
        Event::Revision { .. } => 10,
        Event::Network { .. } => 11,
    }
}

fn file(path: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../..").join(path)
}

#[test]
fn events_are_written_as_before() {
    let cases = cases().into_iter().map(|(case, event)| {
        let data = serde_json::to_string(&event).unwrap();
        json!({ "case": case, "event": event.name(), "data": data })
    });
    let text = format!("{:#}\n", serde_json::Value::from_iter(cases));
    let path = file("tests/golden/live/events.json");
    if env::var_os("BELVEDERE_BLESS").is_some() {
        fs::write(&path, &text).unwrap();
    }
    let same = fs::read_to_string(&path).unwrap() == text;
    assert!(same, "events.json differs; if that is meant, `make bless`");
}

#[test]
fn every_kind_of_event_has_cases_and_stands_in_the_table_of_events() {
    let cases = cases();
    let kinds: BTreeSet<_> = cases.iter().map(|(_, event)| kind(event)).collect();
    assert_eq!(kinds, (0..KINDS).collect());
    let names: BTreeSet<_> = cases.iter().map(|(_, event)| event.name()).collect();
    assert_eq!(names.len(), KINDS, "each kind has a name of its own");
    let page = fs::read_to_string(file("docs/LIVE.md")).unwrap();
    let (_, table) = page.split_once("| event | data | when |").unwrap();
    let rows = table
        .trim_start()
        .lines()
        .skip(1)
        .take_while(|line| line.starts_with('|'));
    let listed: Vec<_> = rows.filter_map(|row| row.split('`').nth(1)).collect();
    assert_eq!(listed.len(), KINDS);
    assert_eq!(listed.into_iter().collect::<BTreeSet<_>>(), names);
}
