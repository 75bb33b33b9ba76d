//! What has a deployment failed to answer so far, and does it answer at all? A source that counts, and says so now and then on standard
//! error: a broken tree takes its time, and so does a line on which nothing comes.

use std::{
    collections::BTreeSet,
    ops::Range,
    sync::{Arc, Mutex, MutexGuard},
    time::Duration,
};

use belvedere_client::{Ask, ByteSource, Error, Part, Watch};
use belvedere_scene::{BlobName, rung::RungName};
use bytes::Bytes;

/// Between two looks at whether there is something to say.
const PAUSE: Duration = Duration::from_secs(5);

/// A source whose answers are counted.
#[derive(Debug, Clone)]
pub(super) struct Counted<S> {
    source: S,
    tally: Arc<Mutex<Tally>>,
}

/// What has come so far, and what has not.
#[derive(Debug, Default)]
struct Tally {
    asked: u64,
    answered: u64,
    /// A range was answered with something else: no other is asked for.
    refuses_ranges: bool,
    /// Files that have failed, however often.
    failed: BTreeSet<String>,
    first: String,
    /// How many had been answered, and had failed, when one looked last.
    answered_before: u64,
    failed_before: usize,
    silent_looks: u32,
}

impl Tally {
    /// What there is to say that was not said yet; to be asked after each pause.
    fn news(&mut self) -> Option<String> {
        let failed_before = std::mem::replace(&mut self.failed_before, self.failed.len());
        let answered_before = std::mem::replace(&mut self.answered_before, self.answered);
        let waiting = self.asked - self.answered;
        let is_silent = waiting > 0 && self.answered == answered_before;
        self.silent_looks = if is_silent { self.silent_looks + 1 } else { 0 };
        let (failed, first) = (self.failed.len(), &self.first);
        if failed > failed_before {
            let files = if failed == 1 { "file has" } else { "files have" };
            return Some(format!("{failed} {files} failed so far, first: {first}"));
        }
        is_silent.then(|| {
            let requests = if waiting == 1 {
                "1 request waits"
            } else {
                &format!("{waiting} requests wait")
            };
            let seconds = PAUSE.as_secs() * u64::from(self.silent_looks);
            format!("{requests}, and no answer has come to its end for {seconds} s")
        })
    }
}

impl<S> Counted<S> {
    pub(super) fn new(source: S) -> Self {
        Self {
            source,
            tally: Arc::default(),
        }
    }

    /// Says every few seconds what has failed meanwhile, or that nothing comes, for as long as this is waited for.
    pub(super) async fn tell(&self) {
        loop {
            tokio::time::sleep(PAUSE).await;
            let news = self.tally().news();
            if let Some(news) = news {
                eprintln!("belvedere: {news}");
            }
        }
    }

    fn tally(&self) -> MutexGuard<'_, Tally> {
        self.tally.lock().expect("nothing panics while it holds this lock")
    }

    async fn count<T>(&self, path: &str, answer: impl Future<Output = Result<T, Error>>) -> Result<T, Error> {
        self.tally().asked += 1;
        let answer = answer.await;
        let mut tally = self.tally();
        tally.answered += 1;
        tally.refuses_ranges |= matches!(answer, Err(Error::Range { .. }));
        if let Err(cause) = &answer
            && (tally.refuses_ranges || !comes_otherwise(path, cause))
        {
            if tally.failed.is_empty() {
                tally.first = cause.to_string();
            }
            tally.failed.insert(path.to_owned());
        }
        drop(tally);
        answer
    }
}

/// Whether a part of something else is asked for next, as long as ranges are: a rung that is not there stands in its stream, and what
/// becomes of that counts.
fn comes_otherwise(path: &str, cause: &Error) -> bool {
    let is_absent = matches!(cause, Error::Missing(_) | Error::Refused { .. });
    is_absent && path.parse::<RungName>().is_ok()
}

impl<S: ByteSource> ByteSource for Counted<S> {
    async fn get(&self, path: &str) -> Result<Bytes, Error> {
        self.count(path, self.source.get(path)).await
    }

    async fn get_carried(&self, path: &str) -> Result<(Bytes, u64), Error> {
        self.count(path, self.source.get_carried(path)).await
    }

    async fn get_watched(&self, ask: Ask<'_>, watch: &mut Watch<'_>) -> Result<(Bytes, u64), Error> {
        self.count(ask.path, self.source.get_watched(ask, watch)).await
    }

    async fn get_range(&self, ask: Ask<'_>, range: Range<u64>) -> Result<(Part, u64), Error> {
        self.count(ask.path, self.source.get_range(ask, range)).await
    }

    fn offers_bundles(&self) -> bool {
        self.source.offers_bundles()
    }

    fn keep(&self, path: &str, bytes: &Bytes) -> impl Future<Output = ()> + Send {
        self.source.keep(path, bytes)
    }

    fn kept(&self, path: &str, bytes: u64) -> impl Future<Output = Option<Bytes>> + Send {
        self.source.kept(path, bytes)
    }

    fn forget_parts(&self, whole: &BlobName) {
        self.source.forget_parts(whole);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[tokio::test]
    async fn what_has_failed_is_said_once_with_the_first_of_it() {
        let source = Counted::new(belvedere_client::FolderSource::new("nowhere"));
        let news = || source.tally().news();
        assert_eq!(news(), None);
        source.get("/a").await.unwrap_err();
        assert_eq!(
            news().as_deref(),
            Some("1 file has failed so far, first: there is nothing at /a")
        );
        source.get("/a").await.unwrap_err();
        assert_eq!(news(), None, "it is the same file");
        source.get("/b").await.unwrap_err();
        let said = news().unwrap();
        assert!(said.starts_with("2 files have failed so far, first: there is nothing at /a"));
    }

    #[tokio::test]
    async fn a_rung_that_is_not_there_is_a_failure_only_when_its_stream_has_no_part_of_it_either() {
        let folder = tempfile::tempdir().expect("a folder");
        let name = BlobName::of(b"a stream", "slod").expect("a name");
        let rung = RungName {
            hash: name.hash(),
            number: 0,
        };
        let path = name.url();
        let file = folder.path().join(path.trim_start_matches('/'));
        std::fs::create_dir_all(file.parent().expect("a folder")).expect("a folder");
        std::fs::write(&file, "a stream").expect("a stream");
        let source = Counted::new(belvedere_client::FolderSource::new(folder.path()));
        let news = || source.tally().news();
        source.get(&rung.to_string()).await.unwrap_err();
        source.get_range(Ask::of(&path), 0..3).await.expect("a part");
        assert_eq!(news(), None);
        std::fs::remove_file(file).expect("the tree loses it");
        source.get(&rung.to_string()).await.unwrap_err();
        source.get_range(Ask::of(&path), 0..3).await.unwrap_err();
        let said = format!("1 file has failed so far, first: there is nothing at {path}");
        assert_eq!(news(), Some(said));
    }

    #[tokio::test]
    async fn rungs_that_are_not_there_are_failures_once_no_range_is_asked_for() {
        let folder = tempfile::tempdir().expect("a folder");
        let source = Counted::new(belvedere_client::FolderSource::new(folder.path()));
        let hash = BlobName::of(b"a stream", "slod").expect("a name").hash();
        let rungs = [0, 1].map(|number| RungName { hash, number }.to_string());
        source.get(&rungs[0]).await.unwrap_err();
        let refused = async {
            Err::<(), _>(Error::Range {
                path: "/o/a.slod".to_owned(),
                cause: "with 418".to_owned(),
            })
        };
        source.count("/o/a.slod", refused).await.unwrap_err();
        assert_eq!(source.tally().failed.len(), 1);
        source.get(&rungs[1]).await.unwrap_err();
        assert_eq!(source.tally().failed.len(), 2);
    }

    /// A source that keeps one thing, until it is told to forget it.
    #[derive(Default)]
    struct Keeper(Mutex<Option<Bytes>>);

    impl ByteSource for Keeper {
        async fn get(&self, path: &str) -> Result<Bytes, Error> {
            Err(Error::Missing(path.to_owned()))
        }

        async fn keep(&self, _: &str, bytes: &Bytes) {
            *self.0.lock().expect("what is kept") = Some(bytes.clone());
        }

        async fn kept(&self, _: &str, _: u64) -> Option<Bytes> {
            self.0.lock().expect("what is kept").clone()
        }

        fn forget_parts(&self, _: &BlobName) {
            *self.0.lock().expect("what is kept") = None;
        }
    }

    #[tokio::test]
    async fn what_is_kept_is_kept_as_without_a_count() {
        let source = Counted::new(Keeper::default());
        let (name, bytes) = (BlobName::of(b"x", "slod").expect("a name"), Bytes::from_static(b"x"));
        source.keep("/o/x", &bytes).await;
        assert_eq!(source.kept("/o/x", 1).await, Some(bytes));
        source.forget_parts(&name);
        assert_eq!(source.kept("/o/x", 1).await, None);
    }

    #[tokio::test]
    async fn a_line_on_which_nothing_comes_is_told_of_until_something_does() {
        let source = Counted::new(belvedere_client::FolderSource::new("nowhere"));
        let (end, ended) = tokio::sync::oneshot::channel::<()>();
        let waits = async {
            ended.await.expect("it is let go");
            Ok(())
        };
        let mut waits = std::pin::pin!(source.count("/a", waits));
        let soon = tokio::time::timeout(Duration::from_millis(1), &mut waits).await;
        assert!(soon.is_err());
        for seconds in [5, 10] {
            let said = source.tally().news().expect("news");
            assert_eq!(
                said,
                format!("1 request waits, and no answer has come to its end for {seconds} s")
            );
        }
        end.send(()).expect("it waits");
        waits.await.expect("it came");
        assert_eq!(source.tally().news(), None);
    }
}
