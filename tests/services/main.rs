//! Does the server work with services of others? Runs the real binary against the real services, on free ports of this
//! machine. Nothing here runs unless asked for: `make test-services`.

#[path = "../e2e/boxes.rs"]
mod boxes;
#[path = "../http/live_wire.rs"]
mod live_wire;
mod nats;
#[path = "../e2e/program.rs"]
#[allow(dead_code, reason = "each test binary uses a part")]
mod program;
#[path = "../http/wire.rs"]
mod wire;
