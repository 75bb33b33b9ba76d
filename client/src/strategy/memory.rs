//! On which terms is memory promised, and what went for it?

use belvedere_scene::ModelId;

use super::file::Key;

/// On which terms memory is promised.
#[derive(Debug, Clone, Copy)]
pub struct Terms {
    /// So much must stay free beside it.
    pub spare_bytes: u64,
    /// Bases of what is needed within so many steps do not go for it; those of what is visible never do.
    pub within_steps: u32,
    /// Details of what is needed within so many steps do not go for it: those of what is visible at 0. Where there is none, any may.
    pub sharp_within_steps: Option<u32>,
}

/// What went for want of memory, and what of it came again.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Evictions {
    /// Files that went …
    pub files: u64,
    /// … and their bytes.
    pub bytes: u64,
    /// Files that went and were fetched again …
    pub again_files: u64,
    /// … and their bytes.
    pub again_bytes: u64,
    /// Files with which a model is drawn again that lost them although the cell or one adjacent to it saw it, and has seen it
    /// since …
    pub cycle_files: u64,
    /// … and their bytes.
    pub cycle_bytes: u64,
}

/// What went for want of memory.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Gone {
    /// Models that are drawn with their base again.
    pub details: Vec<ModelId>,
    /// Models that are not drawn with anything any more.
    pub models: Vec<ModelId>,
    /// Files that are not here any more.
    pub files: Vec<Key>,
}
