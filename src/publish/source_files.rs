//! Which files beside the source did the importer read? Reads them from one folder, never from outside it, or from what
//! is built into the program, and remembers their hashes so that an unchanged source is not baked again.
//! And what is a file without an extension, and how much of a file that somebody names is read?

use std::{
    borrow::Cow,
    fs::Metadata,
    io::{ErrorKind, Read},
    path::{Path, PathBuf},
    sync::Mutex,
};

use anyhow::Context;
use belvedere_bake::import::{FileError, SourceFiles, plan};
use belvedere_scene::{
    BlobHash,
    procedural::{cut, nearest},
};

use crate::worlds;

/// The folder beside a source file.
#[derive(Debug)]
pub(crate) struct SourceFolder {
    /// `None`: what is built into the program.
    root: Option<PathBuf>,
    read: Mutex<Vec<ReadFile>>,
}

/// A file that was asked for.
#[derive(Debug, Clone)]
pub(crate) struct ReadFile {
    pub(crate) name: String,
    /// `None` when it could not be read: adding it later changes the result.
    pub(crate) hash: Option<BlobHash>,
    pub(crate) bytes: u64,
}

impl SourceFolder {
    /// The folder in which this file stands.
    pub(crate) fn beside(file: &Path) -> Self {
        Self {
            root: Some(folder_of(file).to_owned()),
            read: Mutex::default(),
        }
    }

    /// What is built into the program.
    pub(crate) fn built_in() -> Self {
        Self {
            root: None,
            read: Mutex::default(),
        }
    }

    /// Every file that was asked for, in order.
    pub(crate) fn into_read(self) -> Vec<ReadFile> {
        self.read
            .into_inner()
            .expect("no thread panics while it holds this lock")
    }

    /// The hash of a file as it is now; `None` when it cannot be read.
    pub(crate) fn hash_of(&self, relative: &str) -> Option<BlobHash> {
        self.open(relative, u64::MAX).ok().map(|bytes| BlobHash::of(&bytes))
    }

    fn open(&self, relative: &str, max_bytes: u64) -> Result<Vec<u8>, FileError> {
        let Some(root) = &self.root else {
            let text = worlds::text(relative).ok_or(FileError::Missing)?;
            return Ok(text.as_bytes().to_vec());
        };
        let unreadable = |cause: std::io::Error| match cause.kind() {
            std::io::ErrorKind::NotFound => FileError::Missing,
            _ => FileError::Io(cause.to_string()),
        };
        // A link may lead out of the folder though the name does not.
        let root = root.canonicalize().map_err(unreadable)?;
        let path = root.join(relative).canonicalize().map_err(unreadable)?;
        if !path.starts_with(&root) {
            return Err(FileError::Io("a link leads out of the source's folder".to_owned()));
        }
        if !path.is_file() {
            return Err(FileError::Io("it is not a regular file".to_owned()));
        }
        let mut bytes = Vec::new();
        let file = std::fs::File::open(&path).map_err(unreadable)?;
        file.take(max_bytes.saturating_add(1))
            .read_to_end(&mut bytes)
            .map_err(unreadable)?;
        if bytes.len() as u64 > max_bytes {
            Err(FileError::TooLarge(max_bytes))
        } else {
            Ok(bytes)
        }
    }
}

impl SourceFiles for SourceFolder {
    fn read(&self, relative: &str, max_bytes: u64) -> Result<Vec<u8>, FileError> {
        let opened = self.open(relative, max_bytes);
        let bytes = opened.as_deref().unwrap_or_default();
        let file = ReadFile {
            name: relative.to_owned(),
            hash: opened.is_ok().then(|| BlobHash::of(bytes)),
            bytes: bytes.len() as u64,
        };
        self.read
            .lock()
            .expect("no thread panics while it holds this lock")
            .push(file);
        opened
    }

    fn names(&self, relative: &str) -> Vec<String> {
        let inside = || {
            let root = self.root.as_ref()?.canonicalize().ok()?;
            let folder = root.join(relative).canonicalize().ok()?;
            folder.starts_with(&root).then_some(folder)?.read_dir().ok()
        };
        let files = inside().into_iter().flatten().take(MOST_NAMES).flatten();
        files.filter_map(|file| file.file_name().into_string().ok()).collect()
    }
}

/// Most files of a folder that are looked at to find one that was meant.
const MOST_NAMES: usize = 4096;

/// What sets the limit of a source where no option does.
pub(crate) const MOST_OF_A_SOURCE: &str = "the most that a source may have";

/// A file has more bytes than it may.
#[derive(Debug, thiserror::Error)]
#[error("{file} has {found} bytes; the limit is {limit} ({of})")]
pub(crate) struct TooLarge {
    file: String,
    found: String,
    limit: u64,
    of: &'static str,
}

impl TooLarge {
    /// The same of a file that is told of by another name.
    pub(crate) fn of_file(self, file: String) -> Self {
        Self { file, ..self }
    }
}

/// That a file which somebody named is there and a regular one; what else is known of it.
pub(crate) fn find_named(path: &Path) -> anyhow::Result<Metadata> {
    // Asked before it is opened, which would wait for who writes into a pipe.
    let about = std::fs::metadata(path).map_err(|cause| {
        let neighbours = if cause.kind() == ErrorKind::NotFound {
            neighbours(path)
        } else {
            String::new()
        };
        let shown = path.display().to_string();
        // A path that the system takes for too long may be of any length.
        let shown = match cause.kind() {
            ErrorKind::InvalidFilename => cut(&shown),
            _ => shown.as_str().into(),
        };
        let told = format!("cannot read {shown}{neighbours}");
        anyhow::Error::from(cause).context(told)
    })?;
    anyhow::ensure!(!about.is_dir(), "{} is a folder: name the file in it", path.display());
    anyhow::ensure!(about.is_file(), "{} is not a regular file", path.display());
    Ok(about)
}

/// Which file may be meant by one that is not there: the one in its folder that is called nearly so, or those of its kind.
fn neighbours(path: &Path) -> String {
    let folder = folder_of(path);
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let files = folder.read_dir().into_iter().flatten().take(MOST_NAMES).flatten();
    let files = files.filter_map(|file| file.file_name().into_string().ok());
    // A link that leads nowhere is no neighbour of itself.
    let is_like = |file: &String| *file != name && Path::new(file).extension() == path.extension();
    let mut alike: Vec<String> = files.filter(is_like).collect();
    alike.sort_unstable();
    if let Some(meant) = nearest(&name, alike.iter().map(String::as_str)) {
        return format!(" (did you mean {}?)", path.with_file_name(meant).display());
    }
    let more = alike.len().saturating_sub(MOST_LISTED);
    alike.truncate(MOST_LISTED);
    match (alike.is_empty(), more) {
        (true, _) => String::new(),
        (_, 0) => format!(" (beside it: {})", alike.join(", ")),
        (_, more) => format!(" (beside it: {} and {more} more)", alike.join(", ")),
    }
}

/// Most files that a message lists.
const MOST_LISTED: usize = 12;

fn folder_of(file: &Path) -> &Path {
    let folder = file.parent().filter(|parent| !parent.as_os_str().is_empty());
    folder.unwrap_or(Path::new("."))
}

/// A file that somebody named: a regular one, of at most so many bytes; `of` says what sets that limit. [`TooLarge`] when it has more.
pub(crate) fn read_named(path: &Path, (limit, of): (u64, &'static str)) -> anyhow::Result<Vec<u8>> {
    let shown = path.display();
    let cannot = || format!("cannot read {shown}");
    let about = find_named(path)?;
    let too_large = |found: String| TooLarge {
        file: shown.to_string(),
        found,
        limit,
        of,
    };
    if about.len() > limit {
        return Err(too_large(about.len().to_string()).into());
    }
    let mut bytes = Vec::with_capacity(usize::try_from(about.len()).unwrap_or_default());
    let file = std::fs::File::open(path).with_context(cannot)?;
    file.take(limit.saturating_add(1))
        .read_to_end(&mut bytes)
        .with_context(cannot)?;
    if bytes.len() as u64 > limit {
        return Err(too_large(format!("more than {limit}")).into());
    }
    Ok(bytes)
}

/// The file's name, with an extension where it has none and its content does not begin as what glTF comes in: texts are
/// told apart by their names, and an upload may have come without one. Floor plans have headers or rows of walls, rules have
/// neither.
pub(crate) fn told_apart<'a>(file_name: &'a str, bytes: &[u8]) -> Cow<'a, str> {
    let text = str::from_utf8(bytes)
        .unwrap_or_default()
        .trim_start_matches(['\u{feff}', ' ', '\t', '\r', '\n']);
    let known = ["glTF", "PK", "{", "<"].iter().any(|start| text.starts_with(start));
    if file_name.contains('.') || text.is_empty() || known {
        return Cow::Borrowed(file_name);
    }
    let is_plan = plan::has_headers(text) || text.lines().any(|line| line.trim_start().starts_with("##"));
    Cow::Owned(format!("{file_name}.{}", if is_plan { "plan" } else { "dcg" }))
}

#[cfg(test)]
mod tests {
    use super::{read_named, told_apart};

    #[test]
    fn what_is_no_file_or_too_large_is_not_read() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("a.dcg");
        std::fs::write(&file, "box(1, 1, 1)").unwrap();
        assert_eq!(read_named(&file, (12, "a test")).unwrap(), b"box(1, 1, 1)");
        let error = read_named(&file, (11, "a test")).unwrap_err().to_string();
        assert!(
            error.ends_with("a.dcg has 12 bytes; the limit is 11 (a test)"),
            "{error}"
        );
        let endless = folder.path().join("endless.dcg");
        std::os::unix::fs::symlink("/dev/zero", &endless).unwrap();
        let refused = |path| read_named(path, (11, "a test")).unwrap_err().to_string();
        assert!(refused(&endless).ends_with("is not a regular file"));
        assert!(refused(folder.path()).ends_with("is a folder: name the file in it"));
        for (name, told) in [
            ("a.DCG", ""),
            ("b.dcg", "a.dcg?)"),
            ("other.dcg", "(beside it: a.dcg, endless.dcg)"),
            ("b.glb", ""),
        ] {
            let error = read_named(&folder.path().join(name), (11, "a test")).unwrap_err();
            let (error, cause) = (error.to_string(), error.root_cause().to_string());
            assert!(error.starts_with("cannot read") && error.ends_with(told), "{error}");
            assert!(cause.contains("No such file"), "{cause}");
        }
    }

    #[test]
    fn texts_without_an_extension_are_told_apart_by_their_content() {
        let plan = include_bytes!("../../tests/fixtures/museum.plan");
        let rules = include_bytes!("../../content/town.dcg");
        for (name, bytes, told) in [
            ("town", &plan[..], "town.plan"),
            // An upload that broke off before the drawing began.
            ("town", &plan[..700], "town.plan"),
            ("town", b"// A drawing.\n\nrooms:\n", "town.plan"),
            ("town", rules, "town.dcg"),
            ("town.dcg", plan, "town.dcg"),
            ("town", b"glTF\x02\0\0\0", "town"),
            ("town", b"PK\x03\x04", "town"),
            ("town", b"\n {\"asset\": {}}", "town"),
            ("town", b"\xff\xfe", "town"),
            ("town", b"", "town"),
        ] {
            assert_eq!(told_apart(name, bytes), told);
        }
    }
}
