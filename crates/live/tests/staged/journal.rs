//! What of a journal is believed?

use crate::plan::Stage;
use belvedere_live::journal::{
    Input,
    replay::{Replay, ReplayError},
};

/// Two who meet, a tram and a door.
fn written() -> Vec<(String, String)> {
    let mut stage = Stage::rooms(6);
    let (a, b) = (stage.enter(0.5), stage.enter(3.5));
    stage.tram(5.5, 0.5, 3_000);
    stage.walk(b, 1.5, 2.0);
    stage.gate(1, false);
    stage.set_aoi(a, 3.0, 4.0);
    stage.silence(2_000);
    stage.resync(a);
    stage.leave(b);
    stage.silence(500);
    stage.journal()
}

#[test]
fn all_kinds_of_things_are_lived_through_again() {
    let mut replay = Replay::default();
    let mut ticks = 0;
    for (input, output) in written() {
        let again = replay.take(&input).unwrap();
        assert_eq!(again.output, output, "{input}");
        ticks += usize::from(again.input == Input::Tick);
    }
    assert!(ticks > 25);
}

#[test]
fn what_goes_in_otherwise_comes_out_otherwise() {
    let mut replay = Replay::default();
    let differs = written().into_iter().any(|(input, output)| {
        let other = input.replace("\"position\":[3.5,", "\"position\":[2.5,");
        replay.take(&other).unwrap().output != output
    });
    assert!(differs);
}

#[test]
fn what_cannot_have_happened_is_refused() {
    let entries = written();
    let begin = &entries[0].0;
    let open = entries.iter().find(|(input, _)| input.contains("\"open\":{")).unwrap();
    let refused = |lines: &[&str]| {
        let mut replay = Replay::default();
        let (last, before) = lines.split_last().unwrap();
        before.iter().for_each(|line| drop(replay.take(line).unwrap()));
        replay.take(last).unwrap_err()
    };
    for line in [
        "",
        "[]",
        "[0, \"dance\"]",
        "[1.5, \"tick\"]",
        "[0, {\"pose\": {\"session\": \"s1\"}}]",
    ] {
        assert!(matches!(refused(&[line]), ReplayError::Malformed(_)), "{line}");
    }
    let avatar = open.0.split("\"object\":\"").nth(1).unwrap().split('"').next().unwrap();
    let destroy = format!("[9000000, {{\"destroy\": {{\"object\": \"{avatar}\"}}}}]");
    for lines in [
        vec![r#"[0, "tick"]"#],
        vec![begin, r#"[5, "tick"]"#],
        vec![begin, "[9007199254740993, \"tick\"]"],
        vec![begin, &open.0, &open.0],
        vec![begin, &open.0, &destroy],
    ] {
        assert!(matches!(refused(&lines), ReplayError::Impossible(_)), "{lines:?}");
    }
}

#[test]
fn rules_and_scenes_that_no_server_has_are_refused() {
    let begin = written().swap_remove(0).0;
    let whole: serde_json::Value = serde_json::from_str(&begin).unwrap();
    for (at, wrong) in [
        ("/1/begin/rules/tick_ms", serde_json::json!(i64::MAX)),
        ("/1/begin/rules/tick_ms", serde_json::json!(0)),
        ("/1/begin/rules/crowd/cull_below", serde_json::json!(-1.0)),
        ("/1/begin/ground/bounds/max/0", serde_json::json!(1e308)),
        ("/1/begin/ground/bounds/min/2", serde_json::json!(-1e308)),
        ("/1/begin/ground/cells/0/bounds/max/1", serde_json::json!(-1e8)),
    ] {
        let mut damaged = whole.clone();
        *damaged.pointer_mut(at).unwrap() = wrong;
        let refused = Replay::default().take(&damaged.to_string());
        assert!(
            matches!(refused, Err(ReplayError::OutOfRange { .. })),
            "{at}: {refused:?}"
        );
    }
}
