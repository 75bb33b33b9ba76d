//! Which events are in a stream of bytes? Server-sent events as the HTML standard reads them (§9.2.6), in pieces that may
//! be cut anywhere.

/// No event is larger than this.
const MOST_BYTES: usize = 4 << 20;
const BYTE_ORDER_MARK: &[u8] = b"\xef\xbb\xbf";

/// An event as it came.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Message {
    /// `message` where the stream does not say.
    pub(crate) name: String,
    /// Its lines of data, joined by line feeds.
    pub(crate) data: String,
}

/// An event has more bytes than are believed of one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("an event has more than {MOST_BYTES} bytes")]
pub(crate) struct TooLong;

/// Reads one stream from its beginning.
#[derive(Debug)]
pub(crate) struct Parser {
    /// Of the line that has not ended.
    line: Vec<u8>,
    /// The last byte was a carriage return: a line feed belongs to it.
    after_return: bool,
    /// No line has ended so far.
    at_start: bool,
    name: String,
    data: String,
    /// What the event under way says is its id.
    id: String,
    last_id: String,
    retry_ms: Option<u64>,
}

impl Parser {
    /// Nothing was read so far.
    pub(crate) fn new() -> Self {
        Self {
            line: Vec::new(),
            after_return: false,
            at_start: true,
            name: String::new(),
            data: String::new(),
            id: String::new(),
            last_id: String::new(),
            retry_ms: None,
        }
    }

    /// For another stream that goes on after the last event that came whole.
    pub(crate) fn resumed(&self) -> Self {
        Self {
            id: self.last_id.clone(),
            last_id: self.last_id.clone(),
            retry_ms: self.retry_ms,
            ..Self::new()
        }
    }

    /// The id of the last event that came whole, to come back with.
    pub(crate) fn last_id(&self) -> &str {
        &self.last_id
    }

    /// How long to wait before coming back, if the stream says so.
    pub(crate) fn retry_ms(&self) -> Option<u64> {
        self.retry_ms
    }

    /// Reads on, and answers the events that have become whole.
    pub(crate) fn read(&mut self, bytes: &[u8]) -> Result<Vec<Message>, TooLong> {
        let mut found = Vec::new();
        let mut rest = bytes;
        while !rest.is_empty() {
            if std::mem::take(&mut self.after_return) && rest[0] == b'\n' {
                rest = &rest[1..];
                continue;
            }
            let end = rest.iter().position(|byte| matches!(byte, b'\r' | b'\n'));
            let (line, more) = rest.split_at(end.unwrap_or(rest.len()));
            if self.line.len() + self.data.len() + line.len() > MOST_BYTES {
                return Err(TooLong);
            }
            self.line.extend_from_slice(line);
            if let Some((ending, after)) = more.split_first() {
                self.after_return = *ending == b'\r';
                let line = std::mem::take(&mut self.line);
                found.extend(self.end_line(&line));
                rest = after;
            } else {
                rest = more;
            }
        }
        Ok(found)
    }

    fn end_line(&mut self, line: &[u8]) -> Option<Message> {
        let is_first = std::mem::take(&mut self.at_start);
        let line = line.strip_prefix(BYTE_ORDER_MARK).filter(|_| is_first).unwrap_or(line);
        if line.is_empty() {
            return self.end_event();
        }
        // Lines are decoded whole, so that no character is cut.
        let line = String::from_utf8_lossy(line);
        let (field, value) = line.split_once(':').unwrap_or((&line, ""));
        let value = value.strip_prefix(' ').unwrap_or(value);
        match field {
            "event" => value.clone_into(&mut self.name),
            "data" => {
                self.data.push_str(value);
                self.data.push('\n');
            }
            "id" if !value.contains('\0') => value.clone_into(&mut self.id),
            "retry" if value.bytes().all(|byte| byte.is_ascii_digit()) => {
                self.retry_ms = value.parse().ok().or(self.retry_ms);
            }
            // A comment, or nothing that the standard knows.
            _ => {}
        }
        None
    }

    fn end_event(&mut self) -> Option<Message> {
        self.last_id.clone_from(&self.id);
        let name = std::mem::take(&mut self.name);
        let mut data = std::mem::take(&mut self.data);
        data.pop()?;
        let name = if name.is_empty() { "message".to_owned() } else { name };
        Some(Message { name, data })
    }
}
