//! What has a deployment failed to answer so far? A source that counts it, and says so now and then on standard error: a broken tree
//! takes its time.

use std::{
    ops::Range,
    sync::{Arc, Mutex},
    time::Duration,
};

use belvedere_client::{ByteSource, Error};
use bytes::Bytes;

/// Between two lines that say what has failed.
const PAUSE: Duration = Duration::from_secs(5);

/// A source whose failures are counted.
#[derive(Debug, Clone)]
pub(super) struct Counted<S> {
    source: S,
    losses: Arc<Mutex<Losses>>,
}

/// What has failed so far.
#[derive(Debug, Default)]
struct Losses {
    count: u64,
    first: String,
    /// How many there were when it was said last.
    told: u64,
}

impl Losses {
    /// What there is to say that was not said yet.
    fn news(&mut self) -> Option<String> {
        let before = std::mem::replace(&mut self.told, self.count);
        let Self { count, first, .. } = self;
        let files = if *count == 1 { "file has" } else { "files have" };
        (*count > before).then(|| format!("{count} {files} failed so far, first: {first}"))
    }
}

impl<S> Counted<S> {
    pub(super) fn new(source: S) -> Self {
        Self {
            source,
            losses: Arc::default(),
        }
    }

    /// Says every few seconds what has failed meanwhile, for as long as this is waited for.
    pub(super) async fn tell(&self) {
        loop {
            tokio::time::sleep(PAUSE).await;
            let news = self
                .losses
                .lock()
                .expect("nothing panics while it holds this lock")
                .news();
            if let Some(news) = news {
                eprintln!("belvedere: {news}");
            }
        }
    }

    fn note<T>(&self, answer: Result<T, Error>) -> Result<T, Error> {
        if let Err(cause) = &answer {
            let mut losses = self.losses.lock().expect("nothing panics while it holds this lock");
            if losses.count == 0 {
                losses.first = cause.to_string();
            }
            losses.count += 1;
        }
        answer
    }
}

impl<S: ByteSource> ByteSource for Counted<S> {
    async fn get(&self, path: &str) -> Result<Bytes, Error> {
        self.note(self.source.get(path).await)
    }

    async fn get_carried(&self, path: &str) -> Result<(Bytes, u64), Error> {
        self.note(self.source.get_carried(path).await)
    }

    async fn get_fresh(&self, path: &str) -> Result<(Bytes, u64), Error> {
        self.note(self.source.get_fresh(path).await)
    }

    async fn get_range(&self, path: &str, range: Range<u64>) -> Result<(Bytes, u64), Error> {
        self.note(self.source.get_range(path, range).await)
    }

    fn offers_bundles(&self) -> bool {
        self.source.offers_bundles()
    }

    fn keep(&self, path: &str, bytes: &Bytes) -> impl Future<Output = ()> + Send {
        self.source.keep(path, bytes)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[tokio::test]
    async fn what_has_failed_is_said_once_with_the_first_of_it() {
        let source = Counted::new(belvedere_client::FolderSource::new("nowhere"));
        let news = || source.losses.lock().unwrap().news();
        assert_eq!(news(), None);
        source.get("/a").await.unwrap_err();
        assert_eq!(
            news().as_deref(),
            Some("1 file has failed so far, first: there is nothing at /a")
        );
        assert_eq!(news(), None);
        source.get("/b").await.unwrap_err();
        let said = news().unwrap();
        assert!(said.starts_with("2 files have failed so far, first: there is nothing at /a"));
    }
}
