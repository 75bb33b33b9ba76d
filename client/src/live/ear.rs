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
const LONGEST_WAIT: Duration = Duration::from_secs(30);

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
    /// Since an event came.
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
        match &heard {
            Ok(_) => self.in_vain = 0,
            Err(_) => {
                self.in_vain += 1;
                self.stream = None;
            }
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
        let first = Duration::from_millis(self.parser.retry_ms().unwrap_or(FIRST_WAIT_MS));
        let mean = first.saturating_mul(1 << (self.in_vain - 1).min(10));
        about(mean.min(LONGEST_WAIT), (&opened.session, self.in_vain))
    }
}
