//! Does it work with real services? PostgreSQL, an S3 server and NATS, which `make test-services` starts. Runs the real binary on
//! free ports of this machine.

#![allow(clippy::unwrap_used, reason = "a test may fail at any step")]

mod away;
#[path = "../e2e/boxes.rs"]
mod boxes;
mod catalogue;
mod faulty;
#[path = "../http/live_wire.rs"]
mod live_wire;
mod nats;
mod nodes;
mod pool;
#[path = "../e2e/program.rs"]
mod program;
mod resuming;
#[path = "../http/scene.rs"]
mod scene;
mod shared;
mod store;
#[path = "../http/wire.rs"]
mod wire;
