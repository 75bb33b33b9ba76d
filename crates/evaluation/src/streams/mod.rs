//! What do event streams reach, beside nchan under nginx in the same run? `make streams` prints it as tables.
//!
//! Readers are raw HTTP/1.1 connections on loopback, held by one thread over epoll, which also publishes. What both
//! servers deliver is the same text: an `object-pos` whose first position says which message it is. Ours is told of in
//! ticks, so one message in flight is bound by the tick; nchan sends each message as it comes.
//!
//! * [`booths`]: the world: everybody sees the movers, few see each other. [`servers`]: the two servers, started and fed.
//! * [`readers`]: those who listen. [`runs`]: what is measured with them. [`table`]: medians and ratios.
//! * [`process`]: CPU time and memory of a server. `http`: requests that wait for their answer.

pub mod booths;
mod http;
pub mod process;
pub mod readers;
pub mod runs;
pub mod servers;
pub mod table;
