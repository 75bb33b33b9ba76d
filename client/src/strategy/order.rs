//! What does a planner take and give? Budgets and what is known of a place go in; requests and changes come out.

use belvedere_scene::ModelId;

use super::{
    ahead::Approach,
    bundles,
    file::{FileRef, Key},
    priority::Wish,
    sight::{Eye, Seen},
};

/// What one does with bytes, and within which limits.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Budgets {
    /// Models are refined until their error covers at most so many pixels.
    pub target_px: f64,
    /// Memory of all files that are held or on their way.
    pub memory_bytes: u64,
    /// Triangles of all that is visible; refining stops where it would take more.
    pub triangles: u64,
    /// Whether what lies ahead is fetched before it is seen.
    pub prefetch: bool,
}

impl Default for Budgets {
    fn default() -> Self {
        Self {
            target_px: 1.0,
            memory_bytes: u64::MAX,
            triangles: u64::MAX,
            prefetch: true,
        }
    }
}

/// What is known of a place.
#[derive(Debug, Clone)]
pub struct View<'a> {
    /// Who looks.
    pub eye: Eye,
    /// What is known of what can be seen, largest solid angle first …
    pub here: &'a [Seen],
    /// … and whether that is all.
    pub is_all_known: bool,
    /// Cells that may be entered, in the order in which to care for them, with what can be seen from there.
    pub ahead: Vec<(Approach, &'a [Seen])>,
}

/// One request.
#[derive(Debug, Clone, PartialEq)]
pub struct Order {
    /// What comes: one file, or the members of a bundle in its order.
    pub files: Vec<FileRef>,
    /// For what, and why; the most urgent wish of those it serves.
    pub wish: Wish,
}

impl Order {
    /// Where it is asked for.
    #[must_use]
    pub fn path(&self) -> String {
        match &self.files[..] {
            [alone] => alone.name.path(),
            members => bundles::path_of(members),
        }
    }

    /// What comes takes so many bytes on the line, without a request; bundles are not compressed, whatever is in them.
    #[must_use]
    pub fn line_bytes(&self) -> f64 {
        match &self.files[..] {
            [alone] => alone.compressed_bytes(),
            _ => self.bytes() as f64,
        }
    }

    /// Bytes of all files in it, as stored.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        self.files.iter().map(|file| file.bytes).sum()
    }
}

/// What has changed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Change {
    /// A model can be drawn so.
    Held(Wish),
    /// A model is drawn by what came of it first again, for want of memory.
    Blunted(ModelId),
    /// A model went for want of memory.
    Dropped(ModelId),
    /// A file did.
    Gone(Key),
}

/// A file in a pack.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Member {
    /// The file alone.
    pub key: Key,
    /// Where in the pack it starts.
    pub from: u64,
    /// Its size.
    pub bytes: u64,
}

impl Member {
    /// Where in the pack it ends.
    #[must_use]
    pub fn to(&self) -> u64 {
        self.from.saturating_add(self.bytes)
    }

    /// Its bytes, where so much of the pack is here.
    #[must_use]
    pub fn out_of<'a>(&self, pack: &'a [u8]) -> Option<&'a [u8]> {
        let [from, to] = [self.from, self.to()].map(|at| usize::try_from(at).unwrap_or(usize::MAX));
        pack.get(from..to)
    }
}
