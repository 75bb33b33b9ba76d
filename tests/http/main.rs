//! What does the server do over the wire? A real server on a free port over a tiny hand-made scene.

#![allow(clippy::unwrap_used, reason = "a test may fail at any step")]

mod crowding;
mod direct;
mod immutable;
mod live;
mod live_inside;
mod live_odd;
mod live_wire;
mod pages;
mod private;
mod robustness;
mod scene;
mod tls;
mod traces;
mod uploads;
mod wire;
