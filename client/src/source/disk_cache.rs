//! What need not be fetched again, also by the next visit? Immutable objects that are on disk, and rungs and ranges of them, within a
//! limit.

use std::{ops::Range, path::PathBuf, sync::Arc};

use belvedere_scene::BlobName;
use bytes::Bytes;

use super::{Ask, ByteSource, Part, Watch, label::Label, part_of, shelf::Shelf, unwatched};
use crate::Error;

/// A source in front of which what was fetched is kept in a folder. What was used longest ago makes room for what is new. An object
/// that has not the hash in its name is neither kept nor believed. A rung or a range has no hash of its own: it is kept where it is
/// as long as it is known to be, and believed where it is what was put there. Whether it is right shows when all of its
/// object is there; where it is not, all that is kept of its parts [goes](ByteSource::forget_parts).
#[derive(Debug)]
pub struct DiskCache<S> {
    shelf: Arc<Shelf>,
    source: S,
}

impl<S> DiskCache<S> {
    /// Keeps at most so many bytes of this source in a folder, which is made when it is not there, and goes on with what is
    /// in it.
    ///
    /// # Errors
    /// When there can be no such folder, or it cannot be read.
    pub fn open(folder: impl Into<PathBuf>, most_bytes: u64, source: S) -> Result<Self, Error> {
        let folder = folder.into();
        match Shelf::open(folder.clone(), most_bytes) {
            Ok(shelf) => Ok(Self {
                shelf: Arc::new(shelf),
                source,
            }),
            Err(cause) => Err(Error::Cache { folder, cause }),
        }
    }

    /// How many bytes are kept.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        self.shelf.bytes()
    }

    async fn put(&self, label: Label, bytes: &Bytes) {
        let kept = bytes.clone();
        self.with_shelf(move |shelf| shelf.put(&label, &kept)).await;
    }

    /// Asks the folder where it may block.
    async fn with_shelf<T: Send + 'static>(&self, ask: impl FnOnce(&Shelf) -> T + Send + 'static) -> Option<T> {
        let shelf = Arc::clone(&self.shelf);
        tokio::task::spawn_blocking(move || ask(&shelf)).await.ok()
    }
}

impl<S: ByteSource> ByteSource for DiskCache<S> {
    async fn get(&self, path: &str) -> Result<Bytes, Error> {
        Ok(self.get_carried(path).await?.0)
    }

    async fn get_carried(&self, path: &str) -> Result<(Bytes, u64), Error> {
        self.get_watched(Ask::of(path), &mut unwatched).await
    }

    async fn get_watched(&self, ask: Ask<'_>, watch: &mut Watch<'_>) -> Result<(Bytes, u64), Error> {
        let (Some(label), false) = (Label::of_path(ask.path), ask.fresh) else {
            return self.source.get_watched(ask, watch).await;
        };
        let (asked, expected) = (label.clone(), ask.bytes);
        if let Some(bytes) = self
            .with_shelf(move |shelf| shelf.take(&asked, expected))
            .await
            .flatten()
        {
            watch(&bytes);
            return Ok((bytes, 0));
        }
        let (bytes, carried) = self.source.get_watched(ask, watch).await?;
        // How long it is says little of a part, and is all that is known of it.
        if matches!(label, Label::Whole(_)) || expected == Some(bytes.len() as u64) {
            self.put(label, &bytes).await;
        }
        Ok((bytes, carried))
    }

    /// A part of what is in the folder, alone or whole, or of what the source has.
    async fn get_range(&self, ask: Ask<'_>, range: Range<u64>) -> Result<(Part, u64), Error> {
        let path = ask.path;
        let Ok(name) = BlobName::from_url(path) else {
            return self.source.get_range(ask, range).await;
        };
        let part = Label::Part(name.clone(), range.clone());
        let (asked, expected) = (part.clone(), range.end.checked_sub(range.start));
        if let Some(bytes) = self
            .with_shelf(move |shelf| shelf.take(&asked, expected))
            .await
            .flatten()
        {
            return Ok((Part::Asked(bytes), 0));
        }
        let whole = Label::Whole(name);
        let asked = whole.clone();
        if let Some(whole) = self.with_shelf(move |shelf| shelf.take(&asked, None)).await.flatten() {
            return Ok((Part::Asked(part_of(path, &whole, range)?), 0));
        }
        let (answer, carried) = self.source.get_range(ask, range).await?;
        match &answer {
            Part::Whole(bytes) => self.put(whole, bytes).await,
            Part::Asked(bytes) if expected == Some(bytes.len() as u64) => self.put(part, bytes).await,
            Part::Asked(_) => {}
        }
        Ok((answer, carried))
    }

    fn offers_bundles(&self) -> bool {
        self.source.offers_bundles()
    }

    async fn keep(&self, path: &str, bytes: &Bytes) {
        if let Some(label) = Label::of_path(path) {
            self.put(label, bytes).await;
        }
    }

    async fn kept(&self, path: &str, bytes: u64) -> Option<Bytes> {
        let label = Label::of_path(path)?;
        self.with_shelf(move |shelf| shelf.take(&label, Some(bytes)))
            .await
            .flatten()
    }

    fn forget_parts(&self, whole: &BlobName) {
        let parts = self.shelf.forget_parts(whole);
        let shelf = Arc::clone(&self.shelf);
        // Nobody asks for them any more, so nobody waits until they are gone.
        drop(tokio::task::spawn_blocking(move || shelf.remove(&parts)));
    }
}

#[cfg(test)]
mod tests {
    use std::{
        fs::{self, File},
        sync::atomic::{AtomicU64, Ordering},
        time::{Duration, SystemTime},
    };

    use super::*;

    /// Answers each path with 100 bytes of its own, and counts.
    #[derive(Debug, Default)]
    struct Origin(AtomicU64);

    fn content(number: u8) -> Vec<u8> {
        vec![number; 100]
    }

    fn path(number: u8) -> String {
        BlobName::of(&content(number), "glb").unwrap().url()
    }

    impl ByteSource for Origin {
        async fn get(&self, asked: &str) -> Result<Bytes, Error> {
            self.0.fetch_add(1, Ordering::Relaxed);
            let number = (0..=255).find(|number| path(*number) == asked);
            Ok(number.map_or_else(|| Bytes::from_static(b"a pointer"), |number| content(number).into()))
        }
    }

    /// Gets these, and answers what of it the origin had to be asked for.
    async fn asked(cache: &DiskCache<Origin>, numbers: &[u8]) -> Vec<u8> {
        let mut asked = Vec::new();
        for number in numbers {
            let before = cache.source.0.load(Ordering::Relaxed);
            assert_eq!(cache.get(&path(*number)).await.unwrap(), content(*number));
            if cache.source.0.load(Ordering::Relaxed) > before {
                asked.push(*number);
            }
        }
        asked
    }

    #[tokio::test]
    async fn what_was_used_longest_ago_makes_room_also_after_a_restart() {
        let folder = tempfile::tempdir().unwrap();
        let cache = DiskCache::open(folder.path(), 300, Origin::default()).unwrap();
        assert_eq!(asked(&cache, &[1, 2, 3, 1, 4, 1, 3]).await, [1, 2, 3, 4]);
        assert_eq!(cache.bytes(), 300);
        assert_eq!(asked(&cache, &[2]).await, [2], "it made room for 4");
        // Used in this order: 1, 3, 2; files tell times apart only roughly.
        for (ago, number) in [(30, 1), (20, 3), (10, 2)] {
            let file = folder.path().join(path(number).strip_prefix("/o/").unwrap());
            let used = SystemTime::now() - Duration::from_secs(ago);
            File::options()
                .append(true)
                .open(file)
                .unwrap()
                .set_modified(used)
                .unwrap();
        }
        let again = DiskCache::open(folder.path(), 200, Origin::default()).unwrap();
        assert_eq!(again.bytes(), 200);
        assert_eq!(asked(&again, &[2, 3, 1]).await, [1]);
    }

    #[tokio::test]
    async fn nothing_wrong_is_kept_or_believed() {
        let folder = tempfile::tempdir().unwrap();
        let cache = DiskCache::open(folder.path(), 1000, Origin::default()).unwrap();
        asked(&cache, &[1, 2]).await;
        let file = |number: u8| folder.path().join(path(number).strip_prefix("/o/").unwrap());
        fs::write(file(1), b"damaged").unwrap();
        fs::remove_file(file(2)).unwrap();
        assert_eq!(asked(&cache, &[1, 2, 1, 2]).await, [1, 2]);
        // An origin that answers a name with something else.
        let wrong = BlobName::of(b"something else", "glb").unwrap().url();
        assert_eq!(cache.get(&wrong).await.unwrap(), Bytes::from_static(b"a pointer"));
        cache.get("/v1/scenes/town/index.json").await.unwrap();
        assert_eq!(cache.bytes(), 200);
    }

    /// Answers everything with the same bytes, and counts.
    #[derive(Debug)]
    struct Echo(&'static [u8], AtomicU64);

    impl ByteSource for Echo {
        async fn get(&self, _: &str) -> Result<Bytes, Error> {
            self.1.fetch_add(1, Ordering::Relaxed);
            Ok(Bytes::from_static(self.0))
        }

        async fn get_range(&self, ask: Ask<'_>, range: Range<u64>) -> Result<(Part, u64), Error> {
            let part = part_of(ask.path, &self.get(ask.path).await?, range)?;
            let carried = part.len() as u64;
            Ok((Part::Asked(part), carried))
        }
    }

    fn echo(folder: &tempfile::TempDir, most_bytes: u64, bytes: &'static [u8]) -> DiskCache<Echo> {
        DiskCache::open(folder.path(), most_bytes, Echo(bytes, AtomicU64::new(0))).unwrap()
    }

    impl DiskCache<Echo> {
        fn requests(&self) -> u64 {
            self.source.1.load(Ordering::Relaxed)
        }

        async fn rung(&self, number: u8, bytes: Option<u64>) -> Bytes {
            let path = rung(number);
            let asked = self.get_watched(Ask::of(&path).having(bytes), &mut unwatched).await;
            asked.unwrap().0
        }
    }

    const STREAM: &[u8] = b"0123456789";

    fn stream() -> BlobName {
        BlobName::of(STREAM, "slod").unwrap()
    }

    fn rung(number: u8) -> String {
        let hash = stream().hash();
        belvedere_scene::rung::RungName { hash, number }.to_string()
    }

    #[tokio::test]
    async fn rungs_and_ranges_are_kept_within_the_limit_also_for_the_next_visit() {
        let folder = tempfile::tempdir().unwrap();
        let url = stream().url();
        for fetched in [2, 0] {
            let cache = echo(&folder, 1000, STREAM);
            for _ in 0..2 {
                assert_eq!(cache.rung(1, Some(10)).await, STREAM);
                let (part, _) = cache.get_range(Ask::of(&url), 2..5).await.unwrap();
                assert_eq!(part, Part::Asked(Bytes::from_static(&STREAM[2..5])));
                assert_eq!(cache.kept(&rung(1), 10).await.as_deref(), Some(STREAM));
            }
            assert_eq!((cache.requests(), cache.bytes()), (fetched, 32 + 10 + 32 + 3));
        }
        let cache = echo(&folder, 50, STREAM);
        assert!((1..=50).contains(&cache.bytes()), "{}", cache.bytes());
    }

    #[tokio::test]
    async fn a_rung_of_another_length_than_it_has_or_that_was_damaged_on_disk_is_asked_for_again() {
        let folder = tempfile::tempdir().unwrap();
        let cache = echo(&folder, 1000, STREAM);
        for _ in 0..2 {
            cache.rung(1, Some(11)).await;
            cache.rung(2, None).await;
        }
        assert_eq!((cache.requests(), cache.bytes()), (4, 0));
        cache.rung(3, Some(10)).await;
        let file = folder.path().join(rung(3).strip_prefix("/o/").unwrap());
        for harm in [
            |written: &mut Vec<u8>| written[40] ^= 1,
            |written: &mut Vec<u8>| written.truncate(41),
        ] {
            let mut written = fs::read(&file).unwrap();
            harm(&mut written);
            fs::write(&file, written).unwrap();
            let before = cache.requests();
            assert_eq!(cache.rung(3, Some(10)).await, STREAM);
            assert_eq!(cache.rung(3, Some(10)).await, STREAM);
            assert_eq!(cache.requests() - before, 1);
        }
        // It is kept as what another revision of the client took for its length.
        assert_eq!(cache.kept(&rung(3), 9).await, None);
        assert_eq!(cache.bytes(), 0);
    }

    #[tokio::test]
    async fn what_proved_wrong_together_is_forgotten_part_by_part() {
        let folder = tempfile::tempdir().unwrap();
        let cache = echo(&folder, 1000, STREAM);
        cache.rung(0, Some(10)).await;
        cache.get_range(Ask::of(&stream().url()), 2..5).await.unwrap();
        cache.keep(&path(1), &content(1).into()).await;
        cache.forget_parts(&BlobName::of(b"another", "slod").unwrap());
        assert_eq!(cache.bytes(), 100 + 42 + 35);
        cache.forget_parts(&stream());
        assert_eq!(cache.bytes(), 100);
        cache.rung(0, Some(10)).await;
        assert_eq!(cache.requests(), 3);
    }

    #[test]
    fn a_folder_keeps_what_is_not_ours() {
        let folder = tempfile::tempdir().unwrap();
        let file = |name: &str, minutes: u64| {
            let path = folder.path().join(name);
            fs::write(&path, b"half").unwrap();
            let used = SystemTime::now() - Duration::from_mins(minutes);
            File::options()
                .append(true)
                .open(&path)
                .unwrap()
                .set_modified(used)
                .unwrap();
            path
        };
        let name = path(1).strip_prefix("/o/").unwrap().to_owned();
        let left = file(&format!("{name}.77"), 90);
        let others = [file("notes.txt", 90), file(&format!("{name}.78"), 30)];
        let cache = DiskCache::open(folder.path(), 1, Origin::default()).unwrap();
        assert_eq!(cache.bytes(), 0);
        assert!(!left.exists() && others.iter().all(|other| other.exists()));
        let error = DiskCache::open(&others[0], 1, Origin::default())
            .unwrap_err()
            .to_string();
        assert!(error.contains("notes.txt"), "{error}");
    }
}
