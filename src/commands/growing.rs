//! How does whoever waits for a model see that it grows? A line on standard error, once that takes some seconds and then
//! again: most models grow sooner, and those that meet a limit take up to a minute before.

use std::{
    io::{Write, stderr},
    sync::{Mutex, MutexGuard, PoisonError},
    time::{Duration, Instant},
};

use belvedere_bake::progress::{Progress, Stage};

/// Between two lines, and before the first.
const INTERVAL: Duration = Duration::from_secs(3);

/// Hears of the steps of a growth and says how many there were.
#[derive(Debug)]
pub(super) struct Growing(Mutex<Steps>);

#[derive(Debug)]
struct Steps {
    began: Instant,
    told: Instant,
    done: u64,
    most: u64,
}

impl Growing {
    pub(super) fn new() -> Self {
        let now = Instant::now();
        Self(Mutex::new(Steps {
            began: now,
            told: now,
            done: 0,
            most: 0,
        }))
    }

    fn steps(&self) -> MutexGuard<'_, Steps> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Progress for Growing {
    fn start(&self, _: Stage, most: u64) {
        let mut steps = self.steps();
        (steps.done, steps.most) = (0, most);
    }

    fn advance(&self, more: u64) {
        let mut steps = self.steps();
        steps.done += more;
        // All of them are done at the end, however few it took.
        if steps.done < steps.most && steps.told.elapsed() >= INTERVAL {
            steps.told = Instant::now();
            // Whoever has closed the pipe does not want to know.
            _ = writeln!(stderr().lock(), "{}", steps.line());
        }
    }
}

impl Steps {
    fn line(&self) -> String {
        let millions = |steps: u64| steps / 1_000_000;
        format!(
            "growing for {} s: {} of at most {} million steps",
            self.began.elapsed().as_secs(),
            millions(self.done),
            millions(self.most)
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_says_how_many_steps_of_those_that_there_may_be_were_taken() {
        let growing = Growing::new();
        growing.start(Stage::Import, 1_000_000_000);
        growing.advance(4_000_000);
        growing.advance(4_200_000);
        let line = growing.steps().line();
        assert_eq!(line, "growing for 0 s: 8 of at most 1000 million steps");
    }
}
