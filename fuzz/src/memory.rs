//! How much memory does a call take at most? An allocator that counts, for whoever installs it.
//!
//! Only one call may be looked at in a time: the count is that of the whole program.

#![allow(unsafe_code, reason = "an allocator is unsafe; it only counts and hands on")]

use std::alloc::{GlobalAlloc, Layout, System};
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};

static HELD: AtomicUsize = AtomicUsize::new(0);
static MOST: AtomicUsize = AtomicUsize::new(0);

/// The system's allocator with a count: `#[global_allocator] static ALLOCATOR: Counting = Counting;`.
#[derive(Debug)]
pub struct Counting;

fn add(bytes: usize) {
    let held = HELD.fetch_add(bytes, Relaxed).wrapping_add(bytes);
    MOST.fetch_max(held, Relaxed);
}

// SAFETY: all is done by the system's allocator, with the arguments as they came.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        add(layout.size());
        // SAFETY: the caller's promises are the same.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        HELD.fetch_sub(layout.size(), Relaxed);
        // SAFETY: the caller's promises are the same.
        unsafe { System.dealloc(pointer, layout) }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        add(layout.size());
        // SAFETY: the caller's promises are the same.
        unsafe { System.alloc_zeroed(layout) }
    }

    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        // While it moves, both are there.
        add(size);
        HELD.fetch_sub(layout.size(), Relaxed);
        // SAFETY: the caller's promises are the same.
        unsafe { System.realloc(pointer, layout, size) }
    }
}

/// Does something, and says how much memory it held at the same time beyond what was held before: 0 when nobody counts.
pub fn most_bytes<T>(act: impl FnOnce() -> T) -> (T, u64) {
    let before = HELD.load(Relaxed);
    MOST.store(before, Relaxed);
    let done = act();
    (done, MOST.load(Relaxed).saturating_sub(before) as u64)
}

/// Does something that may hold so much memory.
///
/// # Panics
/// When it holds more.
pub fn within<T>(allowed_bytes: u64, act: impl FnOnce() -> T) -> T {
    let (done, taken_bytes) = most_bytes(act);
    assert!(
        taken_bytes <= allowed_bytes,
        "it took {taken_bytes} bytes of memory where {allowed_bytes} are allowed"
    );
    done
}
