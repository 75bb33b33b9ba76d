//! What can the program be told to do?

pub mod serve;
