//! How does a program walk through a published scene?
//!
//! ```no_run
//! # async fn walk() -> Result<(), belvedere_client::Error> {
//! use belvedere_client::{Client, HttpSource};
//!
//! let client = Client::new(HttpSource::new("http://127.0.0.1:8080")?);
//! let scene = client.open(&"museum".parse().expect("a scene name")).await?;
//! let eye = scene.pointer().viewpoints[0].position;
//! let located = scene.begin(eye, false).await?;
//! let record = scene.record(&located.cell).await?;
//! let objects = scene.visible(&record).await?;
//! let coarsest: Vec<_> = objects.iter().filter_map(|object| object.levels.last()).collect();
//! for (object, glb) in objects.iter().zip(scene.glbs(&coarsest).await?) {
//!     println!("{} in {} bytes", object.object, glb.len());
//! }
//! # Ok(())
//! # }
//! ```
//!
//! The client reads the published tree and nothing else, so a plain folder behind a web server is as good as a
//! Belvedere server. A source may keep what it fetched on disk ([`DiskCache`]) and ask again ([`Retrying`]). Every
//! immutable object is verified against the hash in its name; slices of a smooth LOD when all of them are here. Three things hand to each other: a [`Client`] follows
//! pointers and opens a [`Scene`], which is one revision and never changes under its reader; a [`Walk`] goes through it from
//! cell to cell and fetches what changes. An [`Explorer`] needs to be told only where the eye is: it carries out the
//! [`strategy`]. [`tour`] measures what visitors get to see by it. A [`live::Session`] meets who else is in the scene, where a
//! server offers that.
//!
//! Two examples run against any server: `cargo run -p belvedere-client --example stroll` walks through a scene, and
//! `--example meet` says who else walks there.

mod atlas;
mod document;
mod error;
mod explorer;
mod fetch;
pub mod live;
mod opening;
mod packs;
mod records;
mod scene;
mod source;
mod stand_ins;
mod start;
pub mod strategy;
#[cfg(test)]
mod testing;
pub mod tour;
mod walk;
mod whereabouts;

pub use error::Error;
pub use explorer::{Event, Explorer, ExplorerOptions, Geometry, Mesh, Seedling};
pub use opening::Client;
pub use scene::Scene;
pub use source::{
    Ask, ByteSource, Carried, DiskCache, FolderSource, HttpSource, Lateness, Part, Pulse, Retrying, Watch,
};
pub use walk::Walk;
