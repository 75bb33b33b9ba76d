//! Who listens? Raw connections, all read by the thread that asks, so that counting takes no more than it must.

use std::{
    io::{self, BufRead, Read, Write},
    time::{Duration, Instant},
};

use anyhow::Context;
use mio::{Events, Interest, Poll, Token, net::TcpStream};

use super::{
    http::Asking,
    servers::{Server, number_at},
};

const READ_BYTES: usize = 256 << 10;

/// Connections that listen to one server.
#[derive(Debug)]
pub struct Readers {
    poll: Poll,
    events: Events,
    all: Vec<Reader>,
    room: Vec<u8>,
}

#[derive(Debug)]
struct Reader {
    stream: TcpStream,
    /// The begin of an event whose end has not come.
    begun: Vec<u8>,
    stalled: bool,
    answered: bool,
}

/// What one reader has heard.
#[derive(Debug, Clone, Copy)]
pub(super) struct Heard {
    pub(super) reader: usize,
    /// Of the message, modulo [`super::servers::NUMBERS`].
    pub(super) number: u32,
    pub(super) at: Instant,
}

impl Readers {
    /// Opens streams; the first `stalled` of them are never read.
    ///
    /// # Errors
    /// When the server refuses one, or says nothing to those that are read.
    pub fn open(server: &Server, count: usize, stalled: usize, hears: bool) -> anyhow::Result<Self> {
        let mut readers = Self {
            poll: Poll::new()?,
            events: Events::with_capacity(4_096),
            all: Vec::with_capacity(count),
            room: vec![0; READ_BYTES],
        };
        let mut asking = Asking::connect(server.address())?;
        for i in 0..count {
            let head = server.subscription(&mut asking, i, hears)?;
            let mut stream = std::net::TcpStream::connect(server.address()).context("cannot connect")?;
            stream.write_all(head.as_bytes())?;
            stream.set_nonblocking(true)?;
            let mut stream = TcpStream::from_std(stream);
            readers
                .poll
                .registry()
                .register(&mut stream, Token(i), Interest::READABLE)?;
            readers.all.push(Reader {
                stream,
                begun: Vec::new(),
                stalled: i < stalled,
                answered: false,
            });
            if i % 64 == 0 {
                readers.listen(Duration::ZERO, |_| {})?;
            }
        }
        let until = Instant::now() + Duration::from_secs(60);
        while readers.all.iter().any(|reader| !reader.stalled && !reader.answered) {
            anyhow::ensure!(Instant::now() < until, "streams stay silent");
            readers.listen(Duration::from_millis(100), |_| {})?;
        }
        Ok(readers)
    }

    /// How many are read.
    #[must_use]
    pub fn live(&self) -> usize {
        self.all.iter().filter(|reader| !reader.stalled).count()
    }

    pub(super) fn len(&self) -> usize {
        self.all.len()
    }

    /// Listens for a while, whatever is said.
    ///
    /// # Errors
    /// When a stream ends.
    pub fn rest(&mut self, time: Duration) -> io::Result<()> {
        let until = Instant::now() + time;
        while let Some(left) = until.checked_duration_since(Instant::now()) {
            self.listen(left, |_| {})?;
        }
        Ok(())
    }

    /// Waits until somebody is told something, and tells of each message that is heard.
    pub(super) fn listen(&mut self, timeout: Duration, mut hear: impl FnMut(Heard)) -> io::Result<()> {
        match self.poll.poll(&mut self.events, Some(timeout)) {
            Err(error) if error.kind() == io::ErrorKind::Interrupted => return Ok(()),
            polled => polled?,
        }
        for event in &self.events {
            let number = event.token().0;
            let reader = &mut self.all[number];
            if !reader.stalled {
                reader.read(&mut self.room, |message, at| {
                    hear(Heard {
                        reader: number,
                        number: message,
                        at,
                    });
                })?;
            }
        }
        Ok(())
    }
}

impl Reader {
    fn read(&mut self, room: &mut [u8], mut hear: impl FnMut(u32, Instant)) -> io::Result<()> {
        loop {
            let length = match self.stream.read(room) {
                Ok(0) => return Err(io::ErrorKind::UnexpectedEof.into()),
                Ok(length) => length,
                Err(error) if error.kind() == io::ErrorKind::WouldBlock => return Ok(()),
                Err(error) => return Err(error),
            };
            let at = Instant::now();
            self.answered = true;
            if self.begun.is_empty() {
                let taken = messages(&room[..length], |number| hear(number, at));
                self.begun.extend_from_slice(&room[taken..length]);
            } else {
                self.begun.extend_from_slice(&room[..length]);
                let taken = messages(&self.begun, |number| hear(number, at));
                self.begun.drain(..taken);
            }
            // Less than there was room for: nothing more is there.
            if length < room.len() {
                return Ok(());
            }
        }
    }
}

/// The numbers of messages in a piece of a stream; gives how much of it is whole events.
fn messages(text: &[u8], mut hear: impl FnMut(u32)) -> usize {
    let (mut begin, mut at) = (0, 0);
    while at < text.len() {
        // It looks for a byte faster than anything that could be written here, and reading memory does not fail.
        at += (&text[at..]).skip_until(b'\n').unwrap_or(0);
        if text.get(at) == Some(&b'\n') {
            at += 1;
            if let Some(number) = message(&text[begin..at]) {
                hear(number);
            }
            begin = at;
        }
    }
    begin
}

/// The number of the message that an event is; other events are none.
fn message(event: &[u8]) -> Option<u32> {
    let data = &event[event.iter().position(|byte| *byte == b'{')?..];
    let objects = data.strip_prefix(b"{\"t_ms\":")?;
    // The list of objects, and in its first one the position.
    let objects = &objects[objects.iter().position(|byte| *byte == b'[')? + 1..];
    let position = &objects[objects.iter().position(|byte| *byte == b'[')? + 1..];
    let x = &position[..position.iter().position(|byte| *byte == b',')?];
    Some(number_at(str::from_utf8(x).ok()?.parse().ok()?))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::streams::servers::STEP_M;

    #[test]
    fn messages_are_told_from_other_events_however_they_are_cut() {
        let event = |number: u32| {
            let x = crate::streams::booths::middle()[0] + STEP_M * (f64::from(number) - 64.0);
            format!(
                "1f\r\nid: 7\nevent: object-pos\ndata: {{\"t_ms\":5,\"objects\":[{{\"object\":\"o1\",\"position\":[{x:?},1.0,2.0]}}]}}\n\n\r\n"
            )
        };
        let other = "id: 1\nevent: cell\ndata: {\"cell\":\"c1\"}\n\n: beat\n\n";
        let text = [event(3), other.to_owned(), event(127), event(0)].concat();
        for cut in 0..text.len() {
            let mut heard = Vec::new();
            let taken = messages(&text.as_bytes()[..cut], |number| heard.push(number));
            messages(&text.as_bytes()[taken..], |number| heard.push(number));
            assert_eq!(heard, [3, 127, 0], "{cut}");
        }
    }
}
