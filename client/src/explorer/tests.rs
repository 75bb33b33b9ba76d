//! What becomes of a walk when rules, or a cell ahead, are lost under way? Places are handed over by hand, from a tree that answers nothing.

use belvedere_scene::{BlobName, Bounds, SceneName};
use serde_json::json;

use super::*;
use crate::{
    Client,
    atlas::{Place, Uses},
    strategy::{
        grade::Form,
        tests::{grown, seen_at},
    },
};

/// A scene's pointer and manifest, and nothing else.
struct Bare {
    pointer: Bytes,
    manifest: Bytes,
}

impl ByteSource for Bare {
    async fn get(&self, path: &str) -> Result<Bytes, Error> {
        match path {
            "/v1/scenes/bare/index.json" => Ok(self.pointer.clone()),
            _ if BlobName::of(&self.manifest, "json").is_ok_and(|name| path == name.url()) => Ok(self.manifest.clone()),
            _ => Err(Error::Missing(path.to_owned())),
        }
    }
}

async fn explorer() -> Explorer<Bare> {
    let bounds = json!({"min": [0, 0, 0], "max": [1, 1, 1]});
    let [nothing, root] = [json!({}), json!({"entries": []})];
    let manifest = json!({
        "format": belvedere_scene::manifest::FORMAT, "title": "Bare", "bounds": bounds, "up": "+Y", "unit": "m",
        "counts": {"cells": 0, "objects": 0, "models": 0, "triangles": 0}, "bytes": nothing, "viewpoints": [],
        "visibility": {"method": "portals", "guarantee": "conservative", "mean_visible": 0, "mean_seen": 0,
            "mean_not_hidden": null, "reason": "none"},
        "occluders": null,
        "records": {"records": 0, "record_bytes": 0, "record_set_bytes": 0, "hybrid_set_bytes": 0, "steps": 0,
            "step_bytes": 0, "step_set_bytes": 0},
        "cells": root, "objects": root, "models": root, "whole": null,
    });
    let manifest = Bytes::from(manifest.to_string());
    let pointer = json!({
        "scene": "bare", "title": "Bare", "revision": "0011223344556677",
        "manifest": BlobName::of(&manifest, "json").expect("a name"), "bounds": bounds, "up": "+Y", "unit": "m",
        "cells": 0, "objects": 0, "models": 0, "triangles": 0, "bytes": nothing, "viewpoints": [],
    });
    let pointer = Bytes::from(pointer.to_string());
    let bare: SceneName = "bare".parse().expect("a name");
    let scene = Client::new(Bare { pointer, manifest })
        .open(&bare)
        .await
        .expect("a scene");
    let options = ExplorerOptions {
        rules: true,
        ..ExplorerOptions::default()
    };
    Explorer::new(scene, options)
}

/// A cell from which one sees an object that grows, of which levels are known or not.
fn place(cell: u32, knows_levels: bool) -> Place {
    let mut model = grown(1);
    if !knows_levels {
        model.levels.clear();
    }
    let name = |ext| BlobName::of(b"record", ext).expect("a name");
    Place {
        entry: CellEntry {
            cell: CellId(cell),
            bounds: Bounds {
                min: [0.0; 3],
                max: [4.0; 3],
            },
            planes: Vec::new(),
            adjacent: Vec::new(),
            record: name("cell"),
            record_bytes: 1,
            steps: None,
            steps_bytes: None,
            record_json: name("json"),
        },
        portals: Vec::new(),
        seen: vec![seen_at(1, 1, 9.0, 1.0, model)],
        lost: 0,
        is_unknown: false,
    }
}

impl Explorer<Bare> {
    /// One stands in a cell that was read of.
    fn stand_in(&mut self, place: Place) {
        (self.at, self.shown) = (Some(place.entry.clone()), Some(place.entry.cell));
        self.eye = Some(Eye::at([1.0; 3]));
        self.asked.insert(place.entry.cell);
        self.atlas.add(place);
    }

    /// A place comes that was read while rules were used.
    fn bring(&mut self, place: Place) {
        let uses = Uses {
            smooth: true,
            rules: true,
        };
        let id = tokio::spawn(async {}).id();
        self.take(id, Brought::Place(Box::new(place), Vec::new(), uses));
    }
}

#[tokio::test]
async fn what_comes_full_of_stand_ins_after_rules_were_lost_is_read_again() {
    let mut explorer = explorer().await;
    explorer.without_rules();
    explorer.bring(place(1, true));
    assert!(explorer.atlas.place(CellId(1)).is_some() && explorer.tasks.is_empty());
    explorer.bring(place(2, false));
    assert!(explorer.atlas.place(CellId(2)).is_none());
    assert_eq!(explorer.tasks.len(), 1);
    // This time it comes as it can be had without rules, and so it stays.
    while explorer.advance().await.is_some() {}
    assert!(explorer.atlas.place(CellId(2)).is_some());
}

#[tokio::test]
async fn levels_are_asked_for_as_soon_as_rules_are_lost() {
    let mut explorer = explorer().await;
    explorer.stand_in(place(1, true));
    assert!(explorer.tasks.is_empty());
    explorer.without_rules();
    assert_eq!(explorer.planner.wishes()[0].grade.form, Form::Level);
    assert_eq!(explorer.tasks.len(), 1);
}

#[tokio::test]
async fn a_cell_that_could_not_be_found_from_afar_is_read_of_once_one_is_there() {
    let mut explorer = explorer().await;
    explorer.asked.insert(CellId(1));
    let id = tokio::spawn(async {}).id();
    explorer.take(id, Brought::NoPlace(CellId(1), Error::NoCells));
    assert!(explorer.tasks.is_empty());
    explorer.at = Some(place(1, true).entry);
    for reads in [1, 0] {
        explorer.follow(Eye::at([1.0; 3])).await;
        assert_eq!(explorer.tasks.len(), reads);
        while explorer.advance().await.is_some() {}
    }
}
