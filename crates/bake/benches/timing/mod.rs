//! How long does something take? CPU time of this thread, because the machine may be busy with other things.

use std::fs;

/// CPU time of this thread so far, in seconds.
pub(crate) fn cpu_s() -> f64 {
    let stat = fs::read_to_string("/proc/thread-self/schedstat").unwrap_or_default();
    let nanoseconds = stat.split(' ').next().and_then(|n| n.parse::<f64>().ok());
    nanoseconds.unwrap_or(0.0) * 1e-9
}

/// The kernel counts in steps of some milliseconds.
const LEAST_S: f64 = 0.03;

/// The least of a few measurements, in seconds, and what the last run gave. What is quick is run many times for each.
pub(crate) fn timed<T>(mut run: impl FnMut() -> T) -> (f64, T) {
    let mut least_s = f64::INFINITY;
    let mut result = None;
    for _ in 0..3 {
        let start_s = cpu_s();
        let (mut runs, mut spent_s) = (0, 0.0);
        while spent_s < LEAST_S {
            result = Some(run());
            runs += 1;
            spent_s = cpu_s() - start_s;
        }
        least_s = least_s.min(spent_s / f64::from(runs));
    }
    (least_s, result.unwrap())
}
