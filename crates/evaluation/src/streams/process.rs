//! What does a server take? CPU time and memory of its process and of those that it has started, from `/proc`.

use std::fs;

/// CPU time so far, in seconds.
#[must_use]
pub fn cpu_s(pid: u32) -> f64 {
    family(pid).into_iter().filter_map(of_one).sum()
}

fn of_one(pid: u32) -> Option<f64> {
    /// What Linux counts in, whatever the kernel was built with.
    const TICKS_PER_S: f64 = 100.0;
    let stat = fs::read_to_string(format!("/proc/{pid}/stat")).ok()?;
    // After the name, which may hold anything: user and system time are fields 14 and 15 of all.
    let fields: Vec<_> = stat.rsplit_once(')')?.1.split_whitespace().collect();
    let ticks = |i: usize| fields.get(i)?.parse::<f64>().ok();
    Some((ticks(11)? + ticks(12)?) / TICKS_PER_S)
}

/// Proportional set size, in bytes: what several processes share counts once.
#[must_use]
pub fn pss_bytes(pid: u32) -> u64 {
    let of_one = |pid: u32| {
        let rollup = fs::read_to_string(format!("/proc/{pid}/smaps_rollup")).ok()?;
        let line = rollup.lines().find_map(|line| line.strip_prefix("Pss:"))?;
        line.trim().strip_suffix("kB")?.trim().parse::<u64>().ok()
    };
    1024 * family(pid).into_iter().filter_map(of_one).sum::<u64>()
}

/// A process and its children.
fn family(pid: u32) -> Vec<u32> {
    let children = fs::read_to_string(format!("/proc/{pid}/task/{pid}/children")).unwrap_or_default();
    let children = children.split_whitespace().filter_map(|child| child.parse().ok());
    [pid].into_iter().chain(children).collect()
}

/// How many files this process may have open; its children may have as many.
#[must_use]
pub fn most_files() -> usize {
    let limits = fs::read_to_string("/proc/self/limits").unwrap_or_default();
    let line = limits.lines().find_map(|line| line.strip_prefix("Max open files"));
    let soft = line.and_then(|line| line.split_whitespace().next()?.parse().ok());
    soft.unwrap_or(1024)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn this_process_has_taken_something() {
        let pid = std::process::id();
        let begin_s = cpu_s(pid);
        let mut sum = 0u64;
        while cpu_s(pid) - begin_s < 0.02 {
            sum = (0..1_000_000u64).fold(sum, |sum, i| sum.wrapping_mul(31) ^ i);
        }
        assert!(pss_bytes(pid) > 100_000 && most_files() > 0, "{sum}");
    }
}
