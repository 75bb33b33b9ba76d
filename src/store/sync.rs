//! How do many files outlive a loss of power at the cost of one? Linux writes a whole file system out at one request
//! (`syncfs`); elsewhere each file is synced when it is written.

use std::{io, path::Path};

/// Whether [`all`] does it, so that files need not be synced one by one.
pub(super) const AT_ONCE: bool = cfg!(target_os = "linux");

/// Writes out everything on the file system of this folder.
#[cfg(target_os = "linux")]
pub(super) fn all(folder: &Path) -> io::Result<()> {
    Ok(rustix::fs::syncfs(std::fs::File::open(folder)?)?)
}

/// Has nothing to do.
#[cfg(not(target_os = "linux"))]
pub(super) fn all(_: &Path) -> io::Result<()> {
    Ok(())
}
