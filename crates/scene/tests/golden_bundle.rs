//! Do Rust and TypeScript write and read the same bundles? `tests/golden/bundle/cases.json` holds what is asked for, answers,
//! sound and damaged ones, and what comes out of them while they come; `viewer/core/strategy/golden.bundles.test.ts` and
//! `client/src/strategy/bundles.rs` read it. `make bless` writes it.

#![allow(clippy::unwrap_used, reason = "a test may fail at any step")]

use std::{env, fs, path::Path};

use belvedere_scene::{
    BlobHash, BlobName,
    bundle::{self, Head, Member},
    rung::RungName,
};
use serde_json::{Value as Json, json};

/// The answer with members of these bytes.
fn answer(members: &[&[u8]]) -> Vec<u8> {
    let mut head = Head::of(members.len());
    members.iter().for_each(|member| head.add(member.len() as u64).unwrap());
    [head.into_bytes(), members.concat()].concat()
}

/// What comes out of an answer: each member once it is here, and whether that was all and nothing else.
fn read(name: &str, answer: &[u8], members: usize) -> Json {
    let mut given = Vec::new();
    for end in 0..=answer.len() {
        let so_far = &answer[..end];
        for place in bundle::places(so_far, members)
            .unwrap_or_default()
            .into_iter()
            .skip(given.len())
        {
            let Some(member) = so_far.get(place) else { break };
            given.push(json!({ "after_bytes": end, "hex": hex(member) }));
        }
    }
    let whole = bundle::whole_places(answer, members).is_some();
    json!({ "name": name, "members": members, "answer_hex": hex(answer), "given": given, "whole": whole })
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

/// Objects and rungs, in the order in which an address names them.
fn asked() -> Vec<Member> {
    let object = |text: &str, ext| Member::Whole(BlobName::of(text.as_bytes(), ext).unwrap());
    let rung = |number| {
        let hash = BlobHash::of(b"a stream");
        Member::Rung(RungName { hash, number })
    };
    let mut asked = vec![object("a", "glb"), object("b", "png"), object("c", "a1b2c3d4")];
    asked.extend([0, 2, 10, 255].map(rung));
    asked.sort_by_key(Member::to_string);
    asked
}

/// A sound answer in which these bytes stand at a place.
fn damaged(at: usize, bytes: &[u8]) -> Vec<u8> {
    let mut damaged = answer(&[b"abc", b"", b"de"]);
    damaged[at..at + bytes.len()].copy_from_slice(bytes);
    damaged
}

#[test]
fn bundles_are_as_before() {
    let sound = answer(&[b"abc", b"", b"de"]);
    let most = vec![&b"x"[..]; bundle::MOST_MEMBERS];
    let beyond = (bundle::MOST_BYTES as u32 + 1).to_le_bytes();
    let answers = [
        read("sound", &sound, 3),
        read("one alone", &answer(&[b"a"]), 1),
        read("nothing but empty ones", &answer(&[b"", b""]), 2),
        read("as many as there can be", &answer(&most), bundle::MOST_MEMBERS),
        read("cut short", &sound[..sound.len() - 1], 3),
        read("going on", &[&sound[..], b"f"].concat(), 3),
        read("of fewer than were asked for", &sound, 4),
        read("of more than were asked for", &sound, 2),
        read("of another kind", &damaged(0, b"BVBM"), 3),
        read("of another version", &damaged(4, &[2]), 3),
        read("of a version with two bytes", &damaged(5, &[1]), 3),
        read("the second ends before it begins", &damaged(12, &[2]), 3),
        read("the last ends before it begins", &damaged(16, &[2]), 3),
        read("the last ends beyond 8 MiB", &damaged(16, &beyond), 3),
        read("the first ends beyond all numbers", &damaged(8, &[255; 4]), 3),
        read("nothing", &[], 1),
    ];
    let asked = asked();
    let urls: Vec<_> = asked.iter().map(|member| format!("/o/{member}")).collect();
    let cases = json!({
        "offer": bundle::OFFER,
        "asked": { "urls": urls, "path": bundle::path(&asked) },
        "answers": answers,
    });
    let text = format!("{cases:#}\n");
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/golden/bundle/cases.json");
    if env::var_os("BELVEDERE_BLESS").is_some() {
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(&path, &text).unwrap();
    }
    let same = fs::read_to_string(&path).unwrap() == text;
    assert!(same, "cases.json differs; if that is meant, `make bless`");
}
