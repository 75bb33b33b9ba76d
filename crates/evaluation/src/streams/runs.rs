//! What is measured? Delivery with one message in flight, delivery at a rate, and what a stream takes that is idle.

use std::{
    io::{self, Read, Write},
    net::TcpStream,
    time::{Duration, Instant},
};

use super::{
    booths::SIDE,
    process::{cpu_s, pss_bytes},
    readers::{Heard, Readers},
    servers::{NUMBERS, Server},
};

/// So long a message is waited for.
const PATIENCE: Duration = Duration::from_secs(10);
/// Messages before those that count.
const WARM_UP: u32 = 5;
/// In this time the server says what it has to say first.
const SETTLING: Duration = Duration::from_millis(1_500);

/// So many streams are there before idle ones are weighed.
pub const EACH_BOOTH: usize = SIDE * SIDE;

/// What came of a run.
#[derive(Debug, Clone, Copy)]
pub struct Outcome {
    /// Events delivered a second.
    pub events_per_s: f64,
    /// From the begin of the request to the event in the reader's hands, milliseconds.
    pub p50_ms: f64,
    /// The same of the slowest hundredth.
    pub p99_ms: f64,
    /// Readers that did not hear the newest message, or where none is merged, messages that were not heard.
    pub lost: u64,
    /// Messages that were not heard because a newer one took their place.
    pub merged: u64,
    /// CPU time of the server, microseconds for each event.
    pub cpu_us: f64,
    /// How much more memory the server takes than before, bytes.
    pub grown_bytes: f64,
}

/// What is published.
#[derive(Debug, Clone, Copy)]
pub struct Load {
    /// In each message.
    pub poses: usize,
    /// How many.
    pub messages: u32,
    /// The next one after so long, or none: when all have heard the last one.
    pub every: Option<Duration>,
}

/// Publishes without waiting for answers.
struct Publisher {
    stream: TcpStream,
    waiting: Vec<u8>,
    answers: Vec<u8>,
}

impl Publisher {
    fn connect(server: &Server) -> io::Result<Self> {
        let stream = TcpStream::connect(server.address())?;
        stream.set_nodelay(true)?;
        stream.set_nonblocking(true)?;
        Ok(Self {
            stream,
            waiting: Vec::new(),
            answers: vec![0; 64 << 10],
        })
    }

    fn push(&mut self, request: &[u8]) -> io::Result<()> {
        self.waiting.extend_from_slice(request);
        self.go_on()
    }

    /// Writes what waits, and takes answers.
    fn go_on(&mut self) -> io::Result<()> {
        let later = |error: io::Error| match error.kind() {
            io::ErrorKind::WouldBlock => Ok(0),
            _ => Err(error),
        };
        if !self.waiting.is_empty() {
            let written = self.stream.write(&self.waiting).or_else(later)?;
            self.waiting.drain(..written);
        }
        let read = self.stream.read(&mut self.answers).or_else(later)?;
        let answers = &self.answers[..read];
        let refused = [&b"HTTP/1.1 4"[..], b"HTTP/1.1 5", b"\"line\""];
        if refused
            .iter()
            .any(|words| answers.windows(words.len()).any(|at| at == *words))
        {
            return Err(io::Error::other(String::from_utf8_lossy(answers).into_owned()));
        }
        Ok(())
    }
}

/// Who has heard what.
struct Tally {
    /// When each message was published.
    published: Vec<Instant>,
    /// What each reader heard last.
    last: Vec<Option<u32>>,
    latencies_us: Vec<u32>,
    /// How many have heard the newest.
    newest_heard: usize,
}

impl Tally {
    fn hear(&mut self, heard: Heard) {
        let newest = self.published.len() as u32 - 1;
        // The number is of the latest messages: a reader is never so far behind.
        let back = (newest + NUMBERS - heard.number) % NUMBERS;
        let Some(message) = newest.checked_sub(back) else {
            return;
        };
        if message == newest && self.last[heard.reader] != Some(newest) {
            self.newest_heard += 1;
        }
        self.last[heard.reader] = Some(message);
        let took = heard.at.duration_since(self.published[message as usize]);
        self.latencies_us.push(took.as_micros() as u32);
    }
}

/// Publishes to readers and counts what they hear.
///
/// # Errors
/// When the server refuses something or a stream ends.
pub fn deliver(server: &Server, readers: &mut Readers, load: Load) -> anyhow::Result<Outcome> {
    let mut publisher = Publisher::connect(server)?;
    let mut tally = Tally {
        published: Vec::new(),
        last: vec![None; readers.len()],
        latencies_us: Vec::new(),
        newest_heard: 0,
    };
    readers.rest(SETTLING)?;
    let live = readers.live();
    let (mut begun, mut cpu_before_s, mut lost) = (Instant::now(), 0.0, 0);
    let pss_before = pss_bytes(server.pid());
    for message in 0..WARM_UP + load.messages {
        if message == WARM_UP {
            tally.latencies_us.clear();
            (begun, cpu_before_s) = (Instant::now(), cpu_s(server.pid()));
        }
        tally.newest_heard = 0;
        tally.published.push(Instant::now());
        publisher.push(&server.message(message, load.poses))?;
        let pace = load.every.filter(|_| message >= WARM_UP);
        let due = match pace {
            Some(every) => begun + every * (message - WARM_UP + 1),
            None => Instant::now() + PATIENCE,
        };
        let is_last = message + 1 == WARM_UP + load.messages;
        let until = if is_last { Instant::now() + PATIENCE } else { due };
        while let Some(left) = until.checked_duration_since(Instant::now()) {
            if tally.newest_heard >= live && (pace.is_none() || is_last) {
                break;
            }
            readers.listen(left.min(Duration::from_millis(5)), |heard| tally.hear(heard))?;
            publisher.go_on()?;
        }
        if pace.is_none() || is_last {
            lost += live.saturating_sub(tally.newest_heard) as u64;
        }
    }
    let (seconds, spent_s) = (begun.elapsed().as_secs_f64(), cpu_s(server.pid()) - cpu_before_s);
    let events = tally.latencies_us.len() as u64;
    let missing = (live as u64 * u64::from(load.messages)).saturating_sub(events);
    let (lost, merged) = if server.merges() {
        (lost, missing.saturating_sub(lost))
    } else {
        (missing, 0)
    };
    tally.latencies_us.sort_unstable();
    let share = |part: f64| {
        let at = (tally.latencies_us.len() as f64 * part) as usize;
        let last = tally.latencies_us.len().saturating_sub(1);
        f64::from(tally.latencies_us.get(at.min(last)).copied().unwrap_or(u32::MAX)) * 1e-3
    };
    Ok(Outcome {
        events_per_s: events as f64 / seconds,
        p50_ms: share(0.5),
        p99_ms: share(0.99),
        lost,
        merged,
        cpu_us: spent_s * 1e6 / events.max(1) as f64,
        grown_bytes: pss_bytes(server.pid()) as f64 - pss_before as f64,
    })
}

/// What an idle stream takes of the server's memory, with all that belongs to it, in bytes.
///
/// # Errors
/// When not all streams can be opened.
pub fn idle(server: &Server, count: usize) -> anyhow::Result<f64> {
    // What is made once is there before, and what is known of each booth.
    let mut first = Readers::open(server, EACH_BOOTH, 0, false)?;
    first.rest(Duration::from_millis(500))?;
    let before = pss_bytes(server.pid());
    let mut readers = Readers::open(server, count, 0, false)?;
    readers.rest(SETTLING)?;
    Ok((pss_bytes(server.pid()) as f64 - before as f64) / count as f64)
}
