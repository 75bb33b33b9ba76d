//! Host a huge 3-D world behind a CDN; walk through it while downloading only what you can see.
#![allow(dead_code)]

mod db;

fn main() {}
