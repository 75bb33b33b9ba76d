//! How do many files outlive a loss of power at the cost of one? Linux writes a whole file system out at one request
//! (`syncfs`); elsewhere each file is synced when it is written.

use std::{fs::File, io};

/// Whether [`all`] does it, so that files need not be synced one by one.
pub(super) const AT_ONCE: bool = cfg!(target_os = "linux");

/// Writes out everything on the file system of this folder. Tells of whatever could not be written since it was opened, so it
/// must have been opened before the files were written.
#[cfg(target_os = "linux")]
pub(super) fn all(folder: &File) -> io::Result<()> {
    Ok(rustix::fs::syncfs(folder)?)
}

/// Has nothing to do.
#[cfg(not(target_os = "linux"))]
pub(super) fn all(_: &File) -> io::Result<()> {
    Ok(())
}
