//! Does it work with real services? PostgreSQL and an S3 server, which `make test-services` starts.

#![allow(clippy::unwrap_used, reason = "a test may fail at any step")]

mod away;
mod catalogue;
mod faulty;
#[path = "../http/live_wire.rs"]
mod live_wire;
mod nodes;
#[path = "../e2e/program.rs"]
mod program;
#[path = "../http/scene.rs"]
mod scene;
mod shared;
mod store;
#[path = "../http/wire.rs"]
mod wire;
