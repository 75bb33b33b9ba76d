//! What may a bake take that nobody trusts? Limits that the process sets itself before it reads its first byte, and
//! cannot raise again: the system enforces them.

use std::time::Duration;

/// Limits of this process.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Limits {
    /// Address space.
    pub(crate) memory_bytes: Option<u64>,
    /// Wall time on all cores.
    pub(crate) time: Option<Duration>,
}

/// The largest file that a bake writes is a blob or the catalogue.
#[cfg(unix)]
const MAX_FILE_BYTES: u64 = 4 << 30;
#[cfg(unix)]
const MAX_OPEN_FILES: u64 = 256;
/// Whoever is served goes first.
#[cfg(unix)]
const NICENESS: i32 = 10;

/// Sets the limits.
///
/// # Errors
/// When the system does not take them.
#[cfg(unix)]
pub(crate) fn confine(limits: &Limits) -> anyhow::Result<()> {
    use anyhow::Context;
    use rustix::process::{Resource, Rlimit, getrlimit, setpriority_process, setrlimit};

    let set = |resource: Resource, most: u64| {
        let now = getrlimit(resource);
        let most = now.maximum.map_or(most, |allowed| allowed.min(most));
        let limit = Rlimit {
            current: Some(most),
            maximum: Some(most),
        };
        setrlimit(resource, limit).with_context(|| format!("cannot set the limit {resource:?} to {most}"))
    };
    if let Some(bytes) = limits.memory_bytes {
        set(Resource::As, bytes)?;
    }
    if let Some(time) = limits.time {
        let cores = std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
        set(Resource::Cpu, time.as_secs().saturating_mul(cores as u64).max(1))?;
    }
    set(Resource::Fsize, MAX_FILE_BYTES)?;
    set(Resource::Nofile, MAX_OPEN_FILES)?;
    // What a crash would write holds the scene.
    set(Resource::Core, 0)?;
    setpriority_process(None, NICENESS).context("cannot step back behind other processes")?;
    Ok(())
}

/// There are no such limits here.
///
/// # Errors
/// When some were asked for.
#[cfg(not(unix))]
pub(crate) fn confine(limits: &Limits) -> anyhow::Result<()> {
    anyhow::ensure!(
        limits.memory_bytes.is_none() && limits.time.is_none(),
        "this system has no limits for processes; bake on Linux, or without --limit-memory-mib and --limit-minutes"
    );
    Ok(())
}

/// Whether this process has come near its limit of memory. Not every library tells that from other failures.
pub(crate) fn was_short_of_memory(limits: &Limits) -> bool {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let peak = status.lines().find_map(|line| line.strip_prefix("VmPeak:"));
    let peak_kib = peak.and_then(|text| text.trim().strip_suffix("kB")?.trim().parse::<u64>().ok());
    match (peak_kib, limits.memory_bytes) {
        (Some(peak_kib), Some(most)) => (peak_kib << 10) >= most / 4 * 3,
        _ => false,
    }
}
