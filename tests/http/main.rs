//! What does the server do over the wire? A real server on a free port over a tiny hand-made scene.

mod immutable;
mod pages;
mod robustness;
mod scene;
mod wire;
