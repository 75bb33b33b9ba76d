//! What do the nodes of a scene tell each other, so that people meet who are connected to different ones?
//!
//! Schmalstieg (*The Remote Rendering Pipeline*, 1997, §3.2) has each user talk to one server, and servers to each other by
//! multicast, a group for each region. Here a group is a view cell, and a node listens to the cells that its sessions
//! watch: the potentially visible set *is* the subscription.
//!
//! * [`message`]: what is said, and to whom. `docs/NODES.md` gives its form for others.
//! * [`Exchange`]: the state machine of one node: messages and the time go in, messages come out.
//! * `peer`: what it keeps of another node. `export`: what it tells of its own movers. `import`: what it believes of others'.
//! * `doors`: whose word counts when two nodes move a door. `keeping`: which node has the movers that outlive nodes.
//! * [`homes`]: which runs of servers are gone, so that others may go on with their sessions.
//!
//! What is lost, comes twice or in another order on the way makes a difference for a beat or two and no longer: interest is
//! told whole with each beat; introductions are counted, and whoever lacks one asks for all; a pose is told again
//! after [`REFRESH_MS`]. A node that nothing is heard of for [`LEASE_MS`] is forgotten, and its movers have left.

mod doors;
mod exchange;
mod export;
pub mod homes;
mod import;
mod keeping;
pub mod message;
mod peer;

pub use self::{exchange::Exchange, message::NodeId};
use crate::Ms;

/// A node tells all others that it lives, and all that it watches, so often.
pub const BEAT_MS: Ms = 1_000;
/// A node of which nothing is heard for so long is gone.
pub const LEASE_MS: Ms = 3_500;
/// The pose of a mover that others watch is told at least so often.
pub const REFRESH_MS: Ms = 2_000;
