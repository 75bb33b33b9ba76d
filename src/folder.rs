//! How is a folder made in which nobody else may read? The catalogue holds the keys by which links are signed, so the data
//! folder is its owner's alone where the program makes it; one that is there stays as it is.

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

/// The same for the data folder, where it is opened.
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
}
