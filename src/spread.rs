//! How do many threads count the same thing without waiting for each other? Each counts in a place of its own, in memory that
//! no other one touches, and whoever wants to know adds the places up. One shared number would travel between the processors at every
//! request.

use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};

/// Where there are more threads than that, some share a place.
const PLACES: usize = 16;

/// Two lines of a cache, since processors fetch them in pairs.
#[derive(Debug, Default)]
#[repr(align(128))]
struct Place<T>(T);

/// One of these for each thread.
#[derive(Debug, Default)]
pub(crate) struct Spread<T>([Place<T>; PLACES]);

impl<T> Spread<T> {
    /// This thread's own.
    pub(crate) fn own(&self) -> &T {
        static NEXT: AtomicUsize = AtomicUsize::new(0);
        thread_local! {
            static OWN: usize = NEXT.fetch_add(1, Ordering::Relaxed) % PLACES;
        }
        &self.0[OWN.with(|own| *own)].0
    }

    /// Those of all threads.
    pub(crate) fn all(&self) -> impl Iterator<Item = &T> {
        self.0.iter().map(|place| &place.0)
    }
}

impl Spread<AtomicU64> {
    /// Counts so many more.
    pub(crate) fn add(&self, more: u64) {
        self.own().fetch_add(more, Ordering::Relaxed);
    }

    /// How many were counted.
    pub(crate) fn sum(&self) -> u64 {
        self.all().map(|count| count.load(Ordering::Relaxed)).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_that_any_thread_counts_is_lost() {
        let count = Spread::default();
        std::thread::scope(|scope| {
            for _ in 0..2 * PLACES {
                scope.spawn(|| (0..1000).for_each(|_| count.add(3)));
            }
        });
        assert_eq!(count.sum(), 2 * PLACES as u64 * 3000);
        let touched = count.all().filter(|count| count.load(Ordering::Relaxed) > 0).count();
        assert!(touched > 1, "all of them count in one place");
    }
}
