//! How long does something take? CPU time of this thread, because the machine may be busy with other things.

use std::fs;

/// CPU time of this thread so far, in seconds.
pub(crate) fn cpu_s() -> f64 {
    let stat = fs::read_to_string("/proc/thread-self/schedstat").unwrap_or_default();
    let nanoseconds = stat.split(' ').next().and_then(|n| n.parse::<f64>().ok());
    nanoseconds.unwrap_or(0.0) * 1e-9
}

/// The least of a few runs, in seconds, and what the last one gave.
pub(crate) fn timed<T>(mut run: impl FnMut() -> T) -> (f64, T) {
    let mut least_s = f64::INFINITY;
    let mut result = None;
    for _ in 0..3 {
        let start_s = cpu_s();
        result = Some(run());
        least_s = least_s.min(cpu_s() - start_s);
    }
    (least_s, result.unwrap())
}
