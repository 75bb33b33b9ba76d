//! Events go in, and those who can be seen come out, where they stand.

use belvedere_scene::ObjectId;

use super::super::{
    company::Company,
    event::{self, Gone, LiveEvent},
};

const FIRST: u32 = 100_000_000;

fn told(name: &str, data: &str) -> LiveEvent {
    event::read(name, data).unwrap().expect("an event that is understood")
}

fn pose(t_ms: i64, x: f64, v: f64, a: f64) -> String {
    format!(
        r#""t_ms": {t_ms}, "position": [{x}, 0, 0], "orientation": [0, 0, 0, 1], "velocity": [{v}, 0, 0], "acceleration": [{a}, 0, 0]"#
    )
}

fn info(mover: u32, pose: &str) -> LiveEvent {
    let data = format!(
        r#"{{"object": "o{mover}", "source_node": "Ann", "part": 0, "bounds": {{"min": [0, 0, 0], "max": [1, 1, 1]}},
            "transform": [1,0,0,0, 0,1,0,0, 0,0,1,0, 0,0,0,1], "model": null, "procedural": null, "mover": true,
            "levels": [], "smooth": null, "pose": {{{pose}}}, "radius_m": 0.5, "period_ms": 100}}"#
    );
    told("object-info", &data)
}

fn moved(mover: u32, pose: &str) -> LiveEvent {
    told(
        "object-pos",
        &format!(r#"{{"t_ms": 0, "objects": [{{"object": "o{mover}", {pose}}}]}}"#),
    )
}

fn gone(mover: u32, reason: &str) -> LiveEvent {
    told(
        "object-gone",
        &format!(r#"{{"objects": ["o{mover}"], "reason": "{reason}"}}"#),
    )
}

/// Its clock is 1,000 ms ahead of the server's.
fn company() -> Company {
    let mut company = Company::default();
    let hello = r#"{"session": "s1", "object": "o100000009", "scene": "rooms", "revision": "0123456789abcdef", "cell": "c0",
        "now_ms": 4000, "tick_ms": 100, "lease_ms": 30000, "extrapolate_ms": 2000}"#;
    company.take(&told("hello", hello), 5000.0);
    company
}

fn x_of(company: &Company, now_ms: f64) -> Vec<f64> {
    company.movers(now_ms).map(|mover| mover.stand.position[0]).collect()
}

#[test]
fn what_came_quickest_says_how_far_the_clocks_are_apart() {
    let mut company = company();
    // A greeting that was 400 ms on its way makes the clocks look further apart than they are.
    company.take(&info(FIRST, &pose(4500, 1.0, 1.0, 0.0)), 5100.0);
    assert!((x_of(&company, 5100.0)[0] - 1.0).abs() < 1e-9, "it was true only now");
    company.take(&moved(FIRST, &pose(5000, 1.5, 1.0, 0.0)), 5700.0);
    let [x] = x_of(&company, 60_000.0)[..] else { panic!() };
    assert!(
        (x - 3.5).abs() < 1e-9,
        "what comes later does not set them apart again: {x}"
    );
}

#[test]
fn movers_go_on_as_they_were_going_for_a_while() {
    let mut company = company();
    company.take(&info(FIRST, &pose(4000, 1.0, 2.0, 0.0)), 5000.0);
    company.take(&info(FIRST + 1, &pose(4000, 1.0, 2.0, 4.0)), 5000.0);
    // p + v·t + a·t²/2, from the time at which the pose was true and for two seconds.
    assert_eq!(x_of(&company, 4500.0), [1.0, 1.0]);
    assert_eq!(x_of(&company, 5500.0), [2.0, 2.5]);
    assert_eq!(x_of(&company, 7000.0), [5.0, 13.0]);
    assert_eq!(x_of(&company, 9000.0), [5.0, 13.0]);
    assert_eq!(company.movers(0.0).next().unwrap().info.source_node, "Ann");
}

#[test]
fn what_was_wrong_fades_and_what_is_far_off_jumps() {
    let mut company = company();
    company.take(&info(FIRST, &pose(4000, 0.0, 0.0, 0.0)), 5000.0);
    company.take(&moved(FIRST, &pose(4200, 1.0, 0.0, 0.0)), 5200.0);
    assert_eq!(x_of(&company, 5200.0), [0.0]);
    assert_eq!(x_of(&company, 5290.0), [0.5]);
    assert_eq!(x_of(&company, 5380.0), [0.75]);
    // Older news is none.
    company.take(&moved(FIRST, &pose(4100, 9.0, 0.0, 0.0)), 5380.0);
    assert_eq!(x_of(&company, 5380.0), [0.75]);
    company.take(&moved(FIRST, &pose(4400, 7.0, 0.0, 0.0)), 5400.0);
    assert_eq!(x_of(&company, 5400.0), [7.0]);
}

#[test]
fn whoever_was_hidden_comes_back_without_an_info_and_who_left_does_not() {
    let mut company = company();
    for mover in [FIRST, FIRST + 1, FIRST + 2] {
        company.take(&info(mover, &pose(4000, 1.0, 0.0, 0.0)), 5000.0);
    }
    for (mover, reason) in [(FIRST, "hidden"), (FIRST + 1, "left"), (FIRST + 2, "destroyed")] {
        company.take(&gone(mover, reason), 5000.0);
    }
    assert_eq!(company.movers(5000.0).count(), 0);
    for mover in [FIRST, FIRST + 1, FIRST + 2] {
        company.take(&moved(mover, &pose(4500, 3.0, 0.0, 0.0)), 5500.0);
    }
    let back: Vec<_> = company.movers(5500.0).collect();
    assert_eq!(back.len(), 1);
    // It has not slid there from where it was last seen.
    assert_eq!((back[0].info.object, back[0].stand.position[0]), (ObjectId(FIRST), 3.0));
}

#[test]
fn infos_of_the_longest_hidden_are_forgotten() {
    let mut company = company();
    for mover in FIRST..FIRST + 257 {
        company.take(&info(mover, &pose(4000, 1.0, 0.0, 0.0)), 5000.0);
        company.take(&gone(mover, "hidden"), 5000.0);
    }
    for mover in [FIRST, FIRST + 1] {
        company.take(&moved(mover, &pose(4500, 3.0, 0.0, 0.0)), 5500.0);
    }
    let back: Vec<_> = company.movers(5500.0).map(|mover| mover.info.object).collect();
    assert_eq!(back, [ObjectId(FIRST + 1)]);
}

#[test]
fn doors_rates_and_a_new_beginning() {
    let mut company = company();
    company.take(&info(FIRST, &pose(4000, 1.0, 0.0, 0.0)), 5000.0);
    let rate =
        format!(r#"{{"objects": [{{"object": "o{FIRST}", "period_ms": 400, "visibility": 0.25, "level": 2}}]}}"#);
    company.take(&told("rate", &rate), 5000.0);
    let attention = company.movers(5000.0).next().unwrap().attention;
    assert_eq!(
        (attention.period_ms, attention.visibility, attention.level),
        (400, Some(0.25), Some(2))
    );
    for (door, open) in [(1, false), (2, false), (1, true)] {
        let data = format!(r#"{{"object": "o{door}", "open": {open}}}"#);
        company.take(&told("door", &data), 5000.0);
    }
    assert!(company.closed_doors().iter().eq([&ObjectId(2)]));
    company.take(&told("revision", r#"{"revision": "0011223344556677"}"#), 5000.0);
    assert!(
        company.closed_doors().is_empty(),
        "a new revision begins with open doors"
    );
    company.take(&told("door", r#"{"object": "o3", "open": false}"#), 5000.0);
    company.take(&told("resync", r#"{"reason": "missed"}"#), 5000.0);
    assert!(company.closed_doors().is_empty() && company.movers(5000.0).next().is_none());
}

#[test]
fn events_are_read_as_far_as_they_are_understood() {
    let parts = gone(FIRST, "hidden");
    let expected = LiveEvent::Vanish {
        objects: vec![ObjectId(FIRST)],
        reason: Gone::Hidden,
    };
    assert_eq!(parts, expected);
    assert_eq!(
        told("cell", r#"{"cell": "c7", "more": 1}"#).to_owned(),
        LiveEvent::Cell("c7".parse().unwrap())
    );
    assert_eq!(
        told("network", r#"{"network": "cut-off"}"#),
        LiveEvent::Network("cut-off".to_owned())
    );
    // Of what does not move, records tell; kinds that are not known are no mistake, and damage is one.
    assert_eq!(event::read("object-info", r#"{"object": "o1"}"#).unwrap(), None);
    assert_eq!(event::read("tomorrow", "?").unwrap(), None);
    event::read("door", r#"{"object": "o1"}"#).unwrap_err();
    event::read("object-gone", r#"{"objects": ["s1"], "reason": "hidden"}"#).unwrap_err();
}
