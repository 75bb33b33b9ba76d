//! What do the events of a session add up to, and what need one say? Functions of what is told and of the time: no I/O, no
//! clock.

pub(crate) mod company;
pub(crate) mod event;
pub(crate) mod motion;
pub(crate) mod speaker;
pub(crate) mod sse;

#[cfg(test)]
mod tests;
