//! Is of every event understood what the server means? `tests/golden/live/events.json` is what it writes
//! (`crates/live/tests/golden_events.rs`); what is understood of it stands in `understood.json`, with which
//! `viewer/core/live/golden.test.ts` compares what it understands itself. `make bless` writes that.

use std::{env, fs, path::PathBuf};

use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

use crate::live::state::event::{Attention, Gone, Hello, LiveEvent, read};

#[derive(Deserialize)]
struct Written {
    case: String,
    event: String,
    data: String,
}

#[derive(Serialize)]
struct Understood {
    case: String,
    /// Null for what is passed over.
    event: Value,
}

fn file(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
        .join("../tests/golden/live")
        .join(name)
}

fn written() -> Vec<Written> {
    let text = fs::read(file("events.json")).expect("the golden set");
    serde_json::from_slice(&text).expect("a list of events")
}

fn attention(
    Attention {
        period_ms,
        visibility,
        level,
    }: Attention,
) -> Value {
    json!({ "period_ms": period_ms, "visibility": visibility, "level": level })
}

fn told(event: &LiveEvent) -> Value {
    match event {
        LiveEvent::Hello(Hello {
            object,
            revision,
            cell,
            now_ms,
            tick_ms,
            lease_ms,
            extrapolate_ms,
            network,
        }) => json!({ "kind": "hello", "object": object, "revision": revision, "cell": cell, "now_ms": now_ms,
            "tick_ms": tick_ms, "lease_ms": lease_ms, "extrapolate_ms": extrapolate_ms, "network": network }),
        LiveEvent::Cell(cell) => json!({ "kind": "cell", "cell": cell }),
        LiveEvent::Appear(who) => {
            json!({ "kind": "appear", "info": who.info, "pose": who.pose, "radius_m": who.radius_m,
            "attention": attention(who.attention) })
        }
        LiveEvent::Move(poses) => {
            let pose = |(object, pose): &_| json!({ "object": object, "pose": pose });
            json!({ "kind": "move", "poses": poses.iter().map(pose).collect::<Vec<_>>() })
        }
        LiveEvent::Vanish { objects, reason } => {
            let reason = match reason {
                Gone::Hidden => "hidden",
                Gone::Left => "left",
                Gone::Destroyed => "destroyed",
            };
            json!({ "kind": "vanish", "objects": objects, "reason": reason })
        }
        LiveEvent::Rate(rates) => {
            let rate = |&(object, how): &_| json!({ "object": object, "attention": attention(how) });
            json!({ "kind": "rate", "rates": rates.iter().map(rate).collect::<Vec<_>>() })
        }
        LiveEvent::Hush(hush) => json!({ "kind": "hush", "object": hush.object, "center": hush.tbv.center,
            "radius_m": hush.tbv.radius_m, "until_ms": hush.until_ms }),
        LiveEvent::Wake => json!({ "kind": "wake" }),
        LiveEvent::Door { object, open } => json!({ "kind": "door", "object": object, "open": open }),
        LiveEvent::Revision(revision) => json!({ "kind": "revision", "revision": revision }),
        LiveEvent::Network(network) => json!({ "kind": "network", "network": network }),
        LiveEvent::Resync => json!({ "kind": "resync" }),
    }
}

#[test]
fn events_are_understood_as_before() {
    let understood = written().into_iter().map(|Written { case, event, data }| {
        let read = read(&event, &data).unwrap_or_else(|cause| panic!("{case}: {cause}"));
        let event = read.as_ref().map_or(Value::Null, told);
        Understood { case, event }
    });
    let understood = json!(understood.collect::<Vec<_>>());
    let text = format!("{understood:#}\n");
    if env::var_os("BELVEDERE_BLESS").is_some() {
        fs::write(file("understood.json"), &text).expect("it is written");
    }
    let same = fs::read_to_string(file("understood.json")).expect("the golden set") == text;
    assert!(same, "understood.json differs; if that is meant, `make bless`");
}

#[test]
fn only_what_does_not_move_is_passed_over() {
    let passed_over: Vec<_> = written()
        .into_iter()
        .filter(|written| matches!(read(&written.event, &written.data), Ok(None)))
        .map(|written| written.case)
        .collect();
    assert_eq!(passed_over, ["a static object", "a door"]);
}

#[test]
fn what_is_cut_off_is_no_event() {
    for Written { case, event, data } in written() {
        for end in 0..data.len() {
            let Some(cut) = data.get(..end) else { continue };
            let fails = read(&event, cut).is_err();
            assert!(fails || matches!(event.as_str(), "wake" | "resync"), "{case}: {cut}");
        }
    }
}
