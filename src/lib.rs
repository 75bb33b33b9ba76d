//! Host a huge 3-D world behind a CDN; walk through it while downloading only what you can see.
//!
//! This crate is everything that does I/O. A tour, from the disk to the wire:
//!
//! * [`db`]: the catalogue: which scenes are published, and which revision of each is current.
//! * [`store`]: immutable objects by their content hash, with their content-coded variants.
//! * [`jobs`]: how an uploaded scene gets published.
//! * [`keys`]: who may change what is published. [`links`]: who may read what is not for everybody.
//! * [`published`]: a published scene, read just as a client reads it.
//! * [`live`]: who is in a scene right now, and what each hears of the others.
//! * [`http`]: routes, caching rules, limits and the accept loop; the only module that knows axum.
//! * [`publish`]: how a bake becomes what is served, and how a scene leaves as plain files.
//! * [`place`]: where catalogue and blobs live, in a folder or shared by several nodes. [`secret`]: what no log may show.
//! * [`config`]: the one list of settings.
//! * [`traces`]: where the time of requests and bakes goes, for a collector.
//! * `confine`: what a bake may take that nobody trusts.
//! * `epoch`: what time it is on the wall.
//! * `folder`: how a folder is made in which nobody else may read.
//! * `media`: of which kind published files are, and how long they may be kept.
//! * `open_files`: how many connections the system has room for.
//! * `page`: which files the viewer's page is made of, and their forms.
//! * `progress`: how whoever started a bake sees that it goes on.
//! * `seldom`: whether it is time to say or try the same again.
//! * `spelling`: which known name was meant.
//! * `spread`: how many threads count the same.
//! * `worlds`: the worlds that are built into the program.
//! * `dashboard`: what a terminal shows of a server that runs in it.
//! * [`commands`]: what the program can be told to do.

pub mod commands;
pub mod config;
mod confine;
mod dashboard;
pub mod db;
mod epoch;
mod folder;
pub mod http;
pub mod jobs;
pub mod keys;
pub mod links;
pub mod live;
mod media;
mod open_files;
mod page;
pub mod place;
mod progress;
pub mod publish;
pub mod published;
pub mod secret;
mod seldom;
mod spelling;
mod spread;
pub mod store;
pub mod traces;
mod worlds;
