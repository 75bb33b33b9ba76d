//! How does a frame stay below the log? Whoever writes a line of the log takes the frame away before it and puts it back
//! after it, under one lock. Nothing but a few escape sequences is asked of the terminal: no alternate screen and no raw mode, so the log
//! can be scrolled back and nothing need be put in order at the end, however that comes.

use std::{
    io::{self, Write},
    sync::{Arc, Mutex, MutexGuard},
};

use tracing_subscriber::fmt::MakeWriter;

/// To the first column of the line so many lines up, and everything from there on away.
const ERASE: &str = "\x1b[J";
/// Lines that are too long are cut by the terminal, so that a line is a line.
const CUT: (&str, &str) = ("\x1b[?7l", "\x1b[?7h");

/// The terminal. Cheap to clone.
#[derive(Debug, Clone, Default)]
pub(crate) struct Screen(Arc<Mutex<Frame>>);

#[derive(Debug, Default)]
struct Frame {
    lines: Vec<String>,
    /// Whether the log is written to the same terminal.
    log_is_here: bool,
}

impl Frame {
    fn erased(&self) -> String {
        match self.lines.len() {
            0 => String::new(),
            lines => format!("\r\x1b[{lines}A{ERASE}"),
        }
    }

    fn drawn(&self) -> String {
        match self.lines.is_empty() {
            true => String::new(),
            false => format!("{}{}\n{}", CUT.0, self.lines.join("\n"), CUT.1),
        }
    }

    /// What a line of the log becomes: the frame is below it afterwards.
    fn around(&self, log: &[u8]) -> Vec<u8> {
        [self.erased().as_bytes(), log, self.drawn().as_bytes()].concat()
    }

    /// What replaces the frame by another.
    fn replace(&mut self, lines: Vec<String>) -> String {
        let erased = self.erased();
        self.lines = lines;
        erased + &self.drawn()
    }
}

impl Screen {
    /// A terminal without a frame yet; `log_is_here` says whether the log is written to it, too.
    #[must_use]
    pub(crate) fn new(log_is_here: bool) -> Self {
        let frame = Frame {
            log_is_here,
            ..Frame::default()
        };
        Self(Arc::new(Mutex::new(frame)))
    }

    fn frame(&self) -> MutexGuard<'_, Frame> {
        self.0.lock().expect("nobody panics while holding this lock")
    }

    pub(super) fn draw(&self, lines: Vec<String>) {
        let mut frame = self.frame();
        let text = frame.replace(lines);
        // Whoever closes the terminal sees nothing.
        let mut out = io::stdout().lock();
        let _gone = out.write_all(text.as_bytes()).and_then(|()| out.flush());
    }
}

/// Standard error with the frame kept below.
#[derive(Debug)]
pub(crate) struct Log(Screen);

impl<'a> MakeWriter<'a> for Screen {
    type Writer = Log;

    fn make_writer(&'a self) -> Log {
        Log(self.clone())
    }
}

impl Write for Log {
    fn write(&mut self, line: &[u8]) -> io::Result<usize> {
        let frame = self.0.frame();
        let text = if frame.log_is_here {
            frame.around(line)
        } else {
            line.to_vec()
        };
        io::stderr().lock().write_all(&text)?;
        Ok(line.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        io::stderr().flush()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_frame_is_replaced_and_the_log_comes_above_it() {
        let mut frame = Frame::default();
        assert_eq!(frame.around(b"first\n"), b"first\n");
        assert_eq!(frame.replace(vec!["a".into(), "b".into()]), "\x1b[?7la\nb\n\x1b[?7h");
        assert_eq!(
            frame.around(b"second\n"),
            b"\r\x1b[2A\x1b[Jsecond\n\x1b[?7la\nb\n\x1b[?7h"
        );
        assert_eq!(frame.replace(vec!["c".into()]), "\r\x1b[2A\x1b[J\x1b[?7lc\n\x1b[?7h");
    }
}
