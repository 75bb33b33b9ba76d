//! What do readers of outside bytes do with bytes that nobody meant? One [`Target`] for each reader: a sound example to begin
//! with, and a function that must return whatever it is given.
//!
//! The same targets are run in two ways: `tests/bounded.rs` changes the examples with [`mutate`] a fixed number of times, on
//! a stable compiler, in every `cargo test`; `libfuzzer` is a folder for `cargo fuzz` with a nightly one, which
//! looks for new paths through the code for as long as one lets it.
//!
//! A target panics when a reader panics, gives something that is not sound, or takes more memory than its documentation or
//! its input's header says ([`memory`]).

mod bake;
pub mod memory;
pub mod mutate;
mod scene;
mod seeds;

/// A reader of outside bytes.
#[derive(Debug, Clone, Copy)]
pub struct Target {
    /// For messages, and the name of its file in `libfuzzer`.
    pub name: &'static str,
    /// Sound inputs.
    pub seeds: fn() -> Vec<Vec<u8>>,
    /// Reads the bytes. What it gives is the same for inputs that seem to go the same way: how far they were read, or why not.
    ///
    /// # Panics
    /// When the reader is at fault.
    pub check: fn(&[u8]) -> u64,
    /// How often it is run in `cargo test`: some seconds.
    pub rounds: u32,
}

/// All readers of bytes from elsewhere in `belvedere-scene` and `belvedere-bake`.
pub const TARGETS: &[Target] = &[
    scene::CELL_RECORD,
    scene::CELL_STEPS,
    scene::DOCUMENTS,
    scene::NAMES,
    scene::SMOOTH,
    scene::THESIS,
    scene::RULES,
    bake::GLB,
    bake::GLTF,
    bake::ZIP,
    bake::PLAN,
    bake::LEVEL,
    bake::OCCLUDERS,
];

/// Runs the target of this name.
///
/// # Panics
/// When there is none, or the reader is at fault.
pub fn check(name: &str, bytes: &[u8]) {
    let target = TARGETS.iter().find(|target| target.name == name);
    let target = target.unwrap_or_else(|| panic!("there is no target {name}"));
    (target.check)(bytes);
}

/// The class of an outcome: that of a message, less the numbers in it, or of a size.
pub(crate) fn class_of_message(message: &str) -> u64 {
    let letters = message.bytes().filter(|byte| !byte.is_ascii_digit());
    letters.fold(0xcbf2_9ce4_8422_2325, |hash, byte| {
        (hash ^ u64::from(byte)).wrapping_mul(0x100_0000_01b3)
    })
}

pub(crate) fn class_of_size(size: usize) -> u64 {
    u64::from(usize::BITS - size.leading_zeros())
}
