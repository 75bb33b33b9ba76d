//! How does one keep listening? Reads the stream of a session, and comes back after the last event that came whole when it is
//! cut, each time in vain twice as late.

use std::time::Duration;

use reqwest::Response;

use super::{
    state::sse::{Message, Parser},
    wire::{Opened, Wire},
};
use crate::{
    Error,
    source::{about, failed},
};

/// Before coming back, unless the stream says otherwise.
const FIRST_WAIT_MS: u64 = 1000;
/// A stream that says less is not believed.
const SHORTEST_WAIT_MS: u64 = 100;
/// With what [`about`] adds it is shorter than a lease.
const LONGEST_WAIT: Duration = Duration::from_secs(10);

/// Why nothing was heard.
#[derive(Debug)]
pub(super) enum Silence {
    /// The stream was cut; one may come back.
    Cut(Error),
    /// There is no such session any more.
    Ended(Error),
}

/// Listens to one session.
#[derive(Debug)]
pub(super) struct Ear {
    stream: Option<Response>,
    parser: Parser,
    /// So many streams were cut before anything came, beats too.
    in_vain: u32,
}

impl Ear {
    pub(super) fn new() -> Self {
        Self {
            stream: None,
            parser: Parser::new(),
            in_vain: 0,
        }
    }

    /// Waits for the next events, at least one.
    pub(super) async fn hear(&mut self, wire: &Wire, opened: &Opened) -> Result<Vec<Message>, Silence> {
        let heard = self.read(wire, opened).await;
        if heard.is_err() {
            self.in_vain += 1;
            self.stream = None;
        }
        heard
    }

    async fn read(&mut self, wire: &Wire, opened: &Opened) -> Result<Vec<Message>, Silence> {
        let stream = match &mut self.stream {
            Some(stream) => stream,
            None => {
                if self.in_vain > 0 {
                    tokio::time::sleep(self.wait(opened)).await;
                }
                let answer = wire.listen(opened, self.parser.last_id()).await;
                let stream = answer.map_err(|cause| match cause.is_transient() {
                    true => Silence::Cut(cause),
                    false => Silence::Ended(cause),
                })?;
                // What was half here is sent again.
                self.parser = self.parser.resumed();
                self.stream.insert(stream)
            }
        };
        loop {
            let chunk = stream.chunk().await;
            let path = || opened.events_url.clone();
            let chunk = chunk.map_err(|cause| Silence::Cut(failed(&opened.events_url, &cause)))?;
            let Some(bytes) = chunk else {
                return Err(Silence::Cut(Error::Fetch {
                    path: path(),
                    cause: "the stream of events has ended".to_owned(),
                }));
            };
            self.in_vain = 0;
            let messages = self.parser.read(&bytes).map_err(|cause| {
                Silence::Ended(Error::Document {
                    path: path(),
                    cause: cause.to_string(),
                })
            })?;
            if !messages.is_empty() {
                return Ok(messages);
            }
        }
    }

    fn wait(&self, opened: &Opened) -> Duration {
        let mean = mean_wait(self.parser.retry_ms(), self.in_vain);
        about(mean, (&opened.session, self.in_vain))
    }
}

/// How long to wait, give or take half of it, after so many streams in vain, where the stream has asked for so long.
fn mean_wait(asked_ms: Option<u64>, in_vain: u32) -> Duration {
    let first = Duration::from_millis(asked_ms.unwrap_or(FIRST_WAIT_MS).max(SHORTEST_WAIT_MS));
    let doubled = first.saturating_mul(1 << in_vain.saturating_sub(1).min(10));
    doubled.min(LONGEST_WAIT)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_time_in_vain_doubles_the_wait_within_bounds() {
        let waits_ms = |asked_ms, in_vain: [u32; 4]| in_vain.map(|n| mean_wait(asked_ms, n).as_millis());
        assert_eq!(waits_ms(None, [1, 2, 3, 9]), [1000, 2000, 4000, 10_000]);
        assert_eq!(waits_ms(Some(3000), [1, 2, 3, u32::MAX]), [3000, 6000, 10_000, 10_000]);
        assert_eq!(waits_ms(Some(0), [1, 2, 3, 4]), [100, 200, 400, 800]);
        assert_eq!(waits_ms(Some(u64::MAX), [1, 2, 3, 4]), [10_000; 4]);
    }
}
