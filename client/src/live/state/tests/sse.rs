//! Streams of events, cut anywhere.

use proptest::prelude::*;

use super::super::sse::{Message, Parser, TooLong};

fn message(name: &str, data: &str) -> Message {
    let [name, data] = [name, data].map(str::to_owned);
    Message { name, data }
}

fn read(bytes: &[u8]) -> (Vec<Message>, Parser) {
    let mut parser = Parser::new();
    let messages = parser.read(bytes).unwrap();
    (messages, parser)
}

#[test]
fn events_have_names_lines_of_data_and_ids() {
    let (messages, parser) = read(
        b": a comment\nretry: 2500\n\nid: 7\nevent: door\ndata: one\ndata:two\ndata:  three\n\n\
          data\n\nevent: empty\n\ndata: unnamed\n\n",
    );
    // An event without data is none; its name does not stay.
    let expected = [
        message("door", "one\ntwo\n three"),
        message("message", ""),
        message("message", "unnamed"),
    ];
    assert_eq!(messages, expected);
    assert_eq!((parser.last_id(), parser.retry_ms()), ("7", Some(2500)));
}

#[test]
fn fields_that_mean_nothing_change_nothing() {
    let (messages, parser) = read(b"id: 3\n\nid: 4\0\nretry: 1s\nretry:\nwhat: ever\nEvent: x\ndata: a\n\n");
    assert_eq!(messages, [message("message", "a")]);
    assert_eq!((parser.last_id(), parser.retry_ms()), ("3", None));
}

#[test]
fn one_comes_back_after_the_last_event_that_came_whole() {
    let (_, parser) = read(b"id: 3\ndata: a\n\nid: 4\ndata: b\n");
    let mut again = parser.resumed();
    assert_eq!(again.last_id(), "3");
    // What was half here is not added to what is sent again.
    assert_eq!(again.read(b"data: c\n\n").unwrap(), [message("message", "c")]);
    assert_eq!(again.last_id(), "3");
}

#[test]
fn an_event_without_end_is_not_kept() {
    let mut parser = Parser::new();
    let line = [b"data: ".as_slice(), &[b'x'; 1 << 20], b"\n"].concat();
    let mut read = 0;
    while parser.read(&line) != Err(TooLong) {
        read += 1;
        assert!(read < 5, "it goes on for ever");
    }
    assert_eq!(read, 3);
}

proptest! {
    #[test]
    fn cuts_and_line_ends_make_no_difference(
        cuts in prop::collection::vec(0usize..200, 0..12),
        ending in prop::sample::select(vec!["\n", "\r", "\r\n"]),
        marked in any::<bool>(),
    ) {
        let lines = ["id: ä", "event: grüße", "data: 東京 → 🚋", "data: zwei", "", ": beat", "", "data: 3", ""];
        let mark = if marked { "\u{feff}" } else { "" };
        let text = lines.iter().fold(mark.to_owned(), |text, line| text + line + ending);
        let bytes = text.as_bytes();
        let mut cuts: Vec<usize> = cuts.into_iter().map(|cut| cut.min(bytes.len())).collect();
        cuts.extend([0, bytes.len()]);
        cuts.sort_unstable();
        let mut parser = Parser::new();
        let mut messages = Vec::new();
        for pair in cuts.windows(2) {
            messages.extend(parser.read(&bytes[pair[0]..pair[1]]).unwrap());
        }
        prop_assert_eq!(messages, [message("grüße", "東京 → 🚋\nzwei"), message("message", "3")]);
        prop_assert_eq!(parser.last_id(), "ä");
    }
}
