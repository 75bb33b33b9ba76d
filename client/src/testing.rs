//! Scenes for tests: a pointer, a manifest, and what one puts beside them.

use std::{
    collections::HashMap,
    sync::{
        Mutex,
        atomic::{AtomicBool, AtomicU32, Ordering},
    },
};

use belvedere_scene::{
    BlobName, SceneName,
    object::{Level, Model, PackRef},
    rung::SmoothLod,
};
use bytes::Bytes;
use serde_json::json;

use crate::{
    ByteSource, Client, Error, Scene,
    strategy::{
        sight::Seen,
        tests::{seen_at, smooth},
    },
};

/// What a request ends with whose server is silent.
pub(crate) fn silence(path: &str) -> Error {
    Error::Fetch {
        path: path.to_owned(),
        cause: "nobody listens".to_owned(),
    }
}

/// A scene of which nothing is known, some objects, and which of them were asked for.
pub(crate) struct Bare {
    pointer: Bytes,
    objects: HashMap<String, Bytes>,
    asked: Mutex<Vec<String>>,
}

impl Bare {
    pub(crate) fn new() -> Self {
        Self::mapped(&json!([]))
    }

    /// The same with one cell or more, of which only a page knows, which may be [put beside](Bare::with) or not.
    pub(crate) fn mapped_by(page: &BlobName, bytes: usize) -> Self {
        let bounds = json!({"min": [0, 0, 0], "max": [1, 1, 1]});
        Self::mapped(&json!([{"kind": "chunk", "url": page, "bytes": bytes, "first": 0, "count": 1, "bounds": bounds}]))
    }

    fn mapped(cells: &serde_json::Value) -> Self {
        let bounds = json!({"min": [0, 0, 0], "max": [1, 1, 1]});
        let [nothing, root] = [json!({}), json!({"entries": []})];
        let viewpoints =
            json!([{"name": "inside", "position": [0.5, 0.5, 0.5], "orientation": [0, 0, 0, 1], "cell": "c0"}]);
        let manifest = json!({
            "format": belvedere_scene::manifest::FORMAT, "title": "Bare", "bounds": bounds, "up": "+Y", "unit": "m",
            "counts": {"cells": 0, "objects": 0, "models": 0, "triangles": 0}, "bytes": nothing, "viewpoints": viewpoints,
            "visibility": {"method": "portals", "guarantee": "conservative", "mean_visible": 0, "mean_seen": 0,
                "mean_not_hidden": null, "reason": "none"},
            "occluders": null,
            "records": {"records": 0, "record_bytes": 0, "record_set_bytes": 0, "hybrid_set_bytes": 0, "steps": 0,
                "step_bytes": 0, "step_set_bytes": 0},
            "cells": {"entries": cells}, "objects": root, "models": root, "whole": null,
        });
        let manifest = Bytes::from(manifest.to_string());
        let name = BlobName::of(&manifest, "json").expect("a name");
        let pointer = json!({
            "scene": "bare", "title": "Bare", "revision": "0011223344556677",
            "manifest": name, "bounds": bounds, "up": "+Y", "unit": "m",
            "cells": 0, "objects": 0, "models": 0, "triangles": 0, "bytes": nothing, "viewpoints": viewpoints,
        });
        let bare = Self {
            pointer: Bytes::from(pointer.to_string()),
            objects: HashMap::new(),
            asked: Mutex::default(),
        };
        bare.with(&name, manifest)
    }

    pub(crate) fn with(mut self, name: &BlobName, bytes: impl Into<Bytes>) -> Self {
        self.objects.insert(name.url(), bytes.into());
        self
    }

    /// Where objects were asked for, documents apart.
    pub(crate) fn asked(&self) -> Vec<String> {
        let asked = self.asked.lock().expect("the notes");
        asked.clone()
    }
}

impl ByteSource for Bare {
    async fn get(&self, path: &str) -> Result<Bytes, Error> {
        if path == "/v1/scenes/bare/index.json" {
            return Ok(self.pointer.clone());
        }
        if !path.ends_with(".json") {
            self.asked.lock().expect("the notes").push(path.to_owned());
        }
        let known = self.objects.get(path).cloned();
        known.ok_or_else(|| Error::Missing(path.to_owned()))
    }
}

/// A tree whose map of cells is one page that fails in its way until all is well.
pub(crate) struct Faulty {
    tree: Bare,
    page: String,
    fault: fn(&BlobName) -> Error,
    pub(crate) is_well: AtomicBool,
    asked: AtomicU32,
}

impl Faulty {
    pub(crate) fn new(fault: fn(&BlobName) -> Error) -> Self {
        let content = r#"{"cells": []}"#;
        let page = BlobName::of(content.as_bytes(), "json").expect("a name");
        Self {
            tree: Bare::mapped_by(&page, content.len()).with(&page, content),
            page: page.url(),
            fault,
            is_well: AtomicBool::new(false),
            asked: AtomicU32::new(0),
        }
    }

    /// How often the page was asked for.
    pub(crate) fn asked(&self) -> u32 {
        self.asked.load(Ordering::Relaxed)
    }
}

impl ByteSource for Faulty {
    async fn get(&self, path: &str) -> Result<Bytes, Error> {
        if path == self.page {
            self.asked.fetch_add(1, Ordering::Relaxed);
            if !self.is_well.load(Ordering::Relaxed) {
                let page = BlobName::from_url(path).expect("a name");
                return Err((self.fault)(&page));
            }
        }
        self.tree.get(path).await
    }
}

/// Every way in which a page may not come, each time it is asked for.
pub(crate) const FAULTS: [fn(&BlobName) -> Error; 5] = [
    |page| Error::Missing(page.url()),
    |page| Error::Corrupt(page.clone()),
    |page| Error::Garbled {
        path: page.url(),
        cause: "its gzip does not unpack".to_owned(),
    },
    |page| silence(&page.url()),
    |page| Error::Length {
        path: page.url(),
        found: 1,
        expected: 2,
    },
];

/// Opens the scene of a source in front of such a tree.
pub(crate) async fn open<S: ByteSource>(source: S) -> Scene<S> {
    let bare: SceneName = "bare".parse().expect("a name");
    Client::new(source).open(&bare).await.expect("a scene")
}

/// A level of a model, exact, with these bytes.
pub(crate) fn level(bytes: &[u8]) -> Level {
    Level {
        level: 0,
        url: BlobName::of(bytes, "glb").expect("a name"),
        bytes: bytes.len() as u64,
        triangles: 100,
        geometric_error_m: 0.0,
        switch_distance_m: 0.0,
        textures: Vec::new(),
        pack: None,
    }
}

/// Levels that stand in one pack.
pub(crate) struct Packed {
    pub(crate) pack: BlobName,
    pub(crate) bytes: Bytes,
    pub(crate) levels: Vec<(BlobName, Bytes)>,
    /// Objects from m0 on, each with one of these levels and no other.
    pub(crate) seen: Vec<Seen>,
}

pub(crate) fn packed(levels: &[&[u8]]) -> Packed {
    let bytes = Bytes::from(levels.concat());
    let pack = BlobName::of(&bytes, "pack").expect("a name");
    let named = |level: &&[u8]| {
        let name = BlobName::of(level, "glb").expect("a name");
        (name, Bytes::copy_from_slice(level))
    };
    let levels: Vec<_> = levels.iter().map(named).collect();
    let mut from = 0;
    let object = |(number, (name, level)): (u32, &(BlobName, Bytes))| {
        let place = PackRef {
            url: pack.clone(),
            bytes: bytes.len() as u64,
            from,
        };
        from += level.len() as u64;
        let level = Level {
            level: 0,
            url: name.clone(),
            bytes: level.len() as u64,
            triangles: 1,
            geometric_error_m: 0.0,
            switch_distance_m: 0.0,
            textures: Vec::new(),
            pack: Some(place),
        };
        let model = Model {
            levels: vec![level],
            smooth: None,
            impostor: None,
            procedural: None,
        };
        seen_at(number, number, 2.0, 1.0, model)
    };
    let seen = (0..).zip(&levels).map(object).collect();
    Packed {
        pack,
        bytes,
        levels,
        seen,
    }
}

/// A smooth LOD with these rungs and materials, and the bytes of its stream.
pub(crate) fn streamed(number: u8, ends: &[(u64, f64)], materials: &[u8]) -> (SmoothLod, Bytes) {
    let bytes = ends.last().map_or(0, |(end, _)| *end) as usize;
    let whole = Bytes::from(vec![number; bytes]);
    let url = BlobName::of(&whole, "slod").expect("a name");
    let mut smooth = smooth(u32::from(number), ends);
    for rung in &mut smooth.rungs {
        rung.url.hash = url.hash();
    }
    smooth.url = url;
    smooth.materials = BlobName::of(materials, "gltf").expect("a name");
    smooth.materials_bytes = materials.len() as u64;
    (smooth, whole)
}
