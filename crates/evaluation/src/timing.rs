//! How long does something take? CPU time of this thread, because the machine may be busy with other things.

use std::fs;

/// CPU time of this thread so far, in seconds.
#[must_use]
pub fn cpu_s() -> f64 {
    let stat = fs::read_to_string("/proc/thread-self/schedstat").unwrap_or_default();
    let nanoseconds = stat.split(' ').next().and_then(|n| n.parse::<f64>().ok());
    nanoseconds.unwrap_or(0.0) * 1e-9
}

/// The least of a few runs, in milliseconds, and what the last one gave.
pub fn timed<T>(mut run: impl FnMut() -> T) -> (f64, T) {
    let start_s = cpu_s();
    let mut result = run();
    let mut least_s = cpu_s() - start_s;
    for _ in 0..2 {
        let start_s = cpu_s();
        result = run();
        least_s = least_s.min(cpu_s() - start_s);
    }
    (1e3 * least_s, result)
}
