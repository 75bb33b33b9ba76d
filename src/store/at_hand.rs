//! Can a file be read without waiting for the disk? Linux says so of each step: its name is looked up, and its bytes are copied,
//! only if both are in memory (`RESOLVE_CACHED`, `RWF_NOWAIT`). Elsewhere nobody knows, so nothing is.

use std::fs::File;

/// So many bytes of a file in this folder, if they are in the system's memory.
#[cfg(target_os = "linux")]
pub(super) fn read(folder: &File, file: &str, length: usize) -> Option<Vec<u8>> {
    use std::io::IoSliceMut;

    use rustix::{
        fs::{Mode, OFlags, ResolveFlags, openat2},
        io::{ReadWriteFlags, preadv2},
    };

    let flags = OFlags::RDONLY | OFlags::CLOEXEC;
    let opened = openat2(folder, file, flags, Mode::empty(), ResolveFlags::CACHED).ok()?;
    let mut bytes = vec![0; length];
    let mut read = 0;
    while read < length {
        let rest = &mut [IoSliceMut::new(&mut bytes[read..])];
        match preadv2(&opened, rest, read as u64, ReadWriteFlags::NOWAIT) {
            Ok(0) | Err(_) => return None,
            Ok(more) => read += more,
        }
    }
    Some(bytes)
}

/// Nothing.
#[cfg(not(target_os = "linux"))]
pub(super) fn read(_: &File, _: &str, _: usize) -> Option<Vec<u8>> {
    None
}
