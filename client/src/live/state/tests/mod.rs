//! What others are told, and what is made of it, without a server.

mod company;
mod golden;
mod speaking;
mod sse;
