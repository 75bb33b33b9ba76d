//! Was this machine too busy to walk? What a walk says of a server holds only where the machine that walks had time to listen.

use belvedere_client::Lateness;

/// How late this machine came to what it had to do.
#[derive(Debug, serde::Serialize)]
pub(super) struct Machine {
    /// Whether that was so much that latencies are its own, and files may be lost for it.
    too_busy: bool,
    /// The share of the time that was nothing but delay, 0 to 1 …
    late_share: f64,
    /// … and the longest, in milliseconds.
    most_late_ms: f64,
}

impl Machine {
    pub(super) fn of(lateness: &Lateness) -> Self {
        Self {
            too_busy: lateness.is_much(),
            late_share: lateness.share(),
            most_late_ms: 1000.0 * lateness.most_late.as_secs_f64(),
        }
    }

    /// What is said of it, if anything.
    pub(super) fn warning(&self) -> Option<String> {
        self.too_busy.then(|| {
            format!(
                "this machine was too busy: for {:.0} % of the time it came too late to what it had to do, by up to {:.1} s; so latencies are its own, and what was lost may be there. Walk with fewer --sessions, or from another machine than the server's",
                100.0 * self.late_share,
                self.most_late_ms / 1000.0
            )
        })
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    #[test]
    fn a_busy_machine_is_told_of_and_a_calm_one_is_not() {
        let late = |late_ms: u64| Lateness {
            waited: Duration::from_secs(10),
            late: Duration::from_millis(late_ms),
            most_late: Duration::from_millis(late_ms / 2),
        };
        assert_eq!(Machine::of(&late(500)).warning(), None);
        let told = Machine::of(&late(10_000)).warning().unwrap_or_default();
        assert!(
            told.starts_with("this machine was too busy: for 50 % of the time"),
            "{told}"
        );
        assert!(told.contains("by up to 5.0 s"), "{told}");
    }
}
