//! How is a folder made in which nobody else may read? The catalogue holds the keys by which links are signed, so the data
//! folder is its owner's alone where the program makes it; one that is there stays as it is, and the catalogue's files in it are
//! their owner's alone anyway.

use std::{io, path::Path};

use anyhow::Context;

/// Makes a folder for its owner alone, and those above it as folders are made here.
pub(crate) fn make_private(folder: &Path) -> io::Result<()> {
    if let Some(above) = folder.parent() {
        std::fs::create_dir_all(above)?;
    }
    let mut making = std::fs::DirBuilder::new();
    #[cfg(unix)]
    std::os::unix::fs::DirBuilderExt::mode(&mut making, 0o700);
    match making.create(folder) {
        Err(error) if error.kind() == io::ErrorKind::AlreadyExists && folder.is_dir() => Ok(()),
        made => made,
    }
}

/// Makes a file for its owner alone, empty where none is there; takes it, and those that SQLite puts beside it, from everybody
/// else. What belongs to another user stays as it is.
pub(crate) fn make_private_file(file: &Path) -> io::Result<()> {
    // One that is there is not opened: to close it would drop the locks that this process holds on it.
    let mut making = std::fs::OpenOptions::new();
    making.write(true).create_new(true);
    #[cfg(unix)]
    std::os::unix::fs::OpenOptionsExt::mode(&mut making, 0o600);
    match making.open(file) {
        Err(error) if error.kind() != io::ErrorKind::AlreadyExists => return Err(error),
        _ => {}
    }
    #[cfg(unix)]
    for beside in ["", "-wal", "-shm"] {
        use std::{fs, os::unix::fs::PermissionsExt};
        let mut name = file.as_os_str().to_owned();
        name.push(beside);
        match fs::metadata(&name).map(|about| about.permissions().mode()) {
            Ok(mode) if mode & 0o077 != 0 => {
                let closed = fs::set_permissions(&name, fs::Permissions::from_mode(mode & 0o700));
                if let Err(error) = closed
                    && error.kind() != io::ErrorKind::PermissionDenied
                {
                    return Err(error);
                }
            }
            _ => {}
        }
    }
    Ok(())
}

/// [`make_private`] for the data folder, where it is opened.
pub(crate) fn make_data(folder: &Path) -> anyhow::Result<()> {
    make_private(folder).with_context(|| format!("cannot make the data folder {}", folder.display()))
}

#[cfg(all(test, unix))]
mod tests {
    use std::{fs, os::unix::fs::PermissionsExt};

    use super::*;

    #[test]
    fn what_is_made_is_its_owners_and_what_is_there_stays_as_it_is() {
        let place = tempfile::tempdir().unwrap();
        let mode = |folder: &Path| fs::metadata(folder).unwrap().permissions().mode() & 0o777;
        let made = place.path().join("above/data");
        make_private(&made).unwrap();
        assert_eq!(mode(&made), 0o700);
        fs::set_permissions(&made, fs::Permissions::from_mode(0o750)).unwrap();
        make_private(&made).unwrap();
        assert_eq!(mode(&made), 0o750);
        fs::write(made.join("file"), "").unwrap();
        assert!(make_private(&made.join("file")).is_err());
    }

    #[test]
    fn a_private_file_is_its_owners_also_where_it_was_for_everybody() {
        let place = tempfile::tempdir().unwrap();
        let file = place.path().join("file");
        let mode = |name: &str| fs::metadata(place.path().join(name)).unwrap().permissions().mode() & 0o777;
        make_private_file(&file).unwrap();
        assert_eq!(mode("file"), 0o600);
        for name in ["file", "file-wal", "file-shm"] {
            fs::write(place.path().join(name), "what is in it").unwrap();
            fs::set_permissions(place.path().join(name), fs::Permissions::from_mode(0o644)).unwrap();
        }
        make_private_file(&file).unwrap();
        assert_eq!(["file", "file-wal", "file-shm"].map(mode), [0o600; 3]);
        assert_eq!(fs::read(&file).unwrap(), b"what is in it");
    }
}
