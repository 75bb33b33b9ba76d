//! Is a head simple? One that every reader of HTTP/1.1 must read alike: each line ends with CR LF, there are no other
//! control characters and nothing beyond ASCII, the method is GET or HEAD, the target a path, there is one host, and no field says
//! that a body follows or asks anything of the connection but to be kept.

use std::mem::MaybeUninit;

use axum::{
    body::Body,
    http::{HeaderName, HeaderValue, Method, Request, Uri, Version},
};

use crate::http::fields::Listed;

/// Longer heads are hyper's.
pub(super) const MAX_HEAD_BYTES: usize = 8 << 10;
/// Heads with more fields, too.
const MAX_FIELDS: usize = 48;
/// Fields that make a head not simple, whatever they say.
const NOT_SIMPLE: [&str; 9] = [
    "content-length",
    "transfer-encoding",
    "expect",
    "upgrade",
    "te",
    "trailer",
    "http2-settings",
    "keep-alive",
    "proxy-connection",
];

/// What has been said so far.
#[derive(Debug, PartialEq)]
pub(super) enum Head<A> {
    /// A simple head, what was made of it, and its length.
    Simple(A, usize),
    /// It may become one.
    Partial,
    NotSimple,
}

/// A simple head.
#[derive(Debug)]
pub(in crate::http) struct Simple<'a> {
    pub(in crate::http) method: Method,
    pub(in crate::http) target: &'a str,
    pub(in crate::http) fields: Listed<'a>,
}

/// Reads the first head; what nothing can be made of is not simple.
pub(super) fn read<A>(said: &[u8], make: impl FnOnce(&Simple) -> Option<A>) -> Head<A> {
    if !begins_simply(said) {
        return Head::NotSimple;
    }
    let mut room = [const { MaybeUninit::uninit() }; MAX_FIELDS];
    let mut request = httparse::Request::new(&mut []);
    match request.parse_with_uninit_headers(said, &mut room) {
        Ok(httparse::Status::Complete(length)) => {
            let simple = is_plain(&said[..length]).then(|| simple(&request)).flatten();
            match simple.and_then(|simple| make(&simple)) {
                Some(made) => Head::Simple(made, length),
                None => Head::NotSimple,
            }
        }
        Ok(httparse::Status::Partial) if is_plain(said) => Head::Partial,
        Ok(httparse::Status::Partial) | Err(_) => Head::NotSimple,
    }
}

/// Whether it begins with, or may become, a method that is simple and a path.
fn begins_simply(said: &[u8]) -> bool {
    let as_far = |start: &[u8]| said.iter().zip(start).all(|(a, b)| a == b);
    as_far(b"GET /") || as_far(b"HEAD /")
}

/// Whether there is nothing but visible ASCII, spaces, tabs and whole line ends, of which the last may be half here.
fn is_plain(said: &[u8]) -> bool {
    // In blocks whose counts fit into a byte, without branches: that takes a few nanoseconds.
    const BLOCK: usize = 128;
    let count = |byte: u8| -> usize {
        let blocks = said.chunks(BLOCK);
        let in_block = |block: &[u8]| block.iter().map(|other| u8::from(*other == byte)).sum::<u8>();
        blocks.map(|block| usize::from(in_block(block))).sum()
    };
    let is_odd = |byte: u8| (byte < b' ') & (byte != b'\t') & (byte != b'\r') & (byte != b'\n') | (byte > b'~');
    let odd = said.iter().fold(0, |odd, byte| odd | u8::from(is_odd(*byte)));
    let blocks = said.chunks(BLOCK).zip(said.get(1..).unwrap_or_default().chunks(BLOCK));
    let line_ends = blocks.map(|(block, next)| {
        let pairs = block.iter().zip(next);
        usize::from(pairs.map(|(a, b)| u8::from((*a == b'\r') & (*b == b'\n'))).sum::<u8>())
    });
    let line_ends: usize = line_ends.sum();
    let half = usize::from(said.last() == Some(&b'\r'));
    odd == 0 && count(b'\n') == line_ends && count(b'\r') == line_ends + half
}

fn simple<'a>(request: &'a httparse::Request<'a, 'a>) -> Option<Simple<'a>> {
    let method = match request.method? {
        "GET" => Method::GET,
        "HEAD" => Method::HEAD,
        _ => return None,
    };
    let target = request.path.filter(|target| target.starts_with('/'))?;
    if request.version != Some(1) {
        return None;
    }
    let (mut hosts, mut connections) = (0, 0);
    for field in &*request.headers {
        let is = |name: &str| field.name.eq_ignore_ascii_case(name);
        match field.name.len() {
            4 if is("host") => {
                hosts += 1;
                if !is_host(field.value) {
                    return None;
                }
            }
            10 if is("connection") => {
                connections += 1;
                if !field.value.eq_ignore_ascii_case(b"keep-alive") {
                    return None;
                }
            }
            length if NOT_SIMPLE.iter().any(|name| name.len() == length && is(name)) => return None,
            _ => {}
        }
    }
    (hosts == 1 && connections <= 1).then_some(Simple {
        method,
        target,
        fields: Listed(request.headers),
    })
}

/// A name or an address, perhaps with a port.
fn is_host(value: &[u8]) -> bool {
    let taken = |byte: &u8| byte.is_ascii_alphanumeric() || b".-_:[]".contains(byte);
    !value.is_empty() && value.iter().all(taken)
}

impl Simple<'_> {
    /// The same for whoever takes requests; none when it cannot be said so.
    pub(super) fn request(&self) -> Option<Request<Body>> {
        let mut request = Request::new(Body::empty());
        *request.method_mut() = self.method.clone();
        *request.uri_mut() = Uri::try_from(self.target).ok()?;
        *request.version_mut() = Version::HTTP_11;
        request.headers_mut().reserve(self.fields.0.len());
        for field in self.fields.0 {
            let name = HeaderName::from_bytes(field.name.as_bytes()).ok()?;
            request
                .headers_mut()
                .append(name, HeaderValue::from_bytes(field.value).ok()?);
        }
        Some(request)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn kind(said: &[u8]) -> Head<String> {
        read(said, |simple| Some(format!("{} {}", simple.method, simple.target)))
    }

    const PLAIN: &[u8] = b"GET /o/x HTTP/1.1\r\nHost: a.b:80\r\nAccept: */*\r\nConnection: Keep-Alive\r\n\r\n";

    #[test]
    fn a_plain_head_is_simple_once_it_is_whole() {
        let whole = || Head::Simple("GET /o/x".to_owned(), PLAIN.len());
        for length in 1..PLAIN.len() {
            assert_eq!(kind(&PLAIN[..length]), Head::Partial, "{length}");
        }
        assert_eq!(kind(PLAIN), whole());
        // What comes after it may be anything.
        assert_eq!(kind(&[PLAIN, b"\n\xff"].concat()), whole());
        let head = b"HEAD /?x=1 HTTP/1.1\r\nhost: [::1]\r\n\r\n";
        assert_eq!(kind(head), Head::Simple("HEAD /?x=1".to_owned(), head.len()));
    }

    #[test]
    fn what_could_be_read_in_two_ways_is_not_simple() {
        let with = |field: &str| format!("GET / HTTP/1.1\r\nHost: t\r\n{field}\r\n\r\n");
        let fields = [
            "Content-Length: 0",
            "content-length:5",
            "Transfer-Encoding: chunked",
            "TRANSFER-ENCODING: identity",
            "Expect: 100-continue",
            "Upgrade: h2c",
            "HTTP2-Settings: AA",
            "TE: trailers",
            "Trailer: x",
            "Keep-Alive: 5",
            "Proxy-Connection: keep-alive",
            "Connection: close",
            "Connection: keep-alive, te",
            "Connection: keep-alive\r\nConnection: keep-alive",
            "Host: t",
            "X: \u{e9}",
            "X: \x7f",
            "X: \x0b",
            "X: y\n Z: x",
            "X: y\nZ: x",
            "X: y\rZ: x",
            "X: y\r\r",
            "X: y\r\n z",
            "X : y",
            "X",
        ];
        for head in fields.map(with) {
            assert_eq!(kind(head.as_bytes()), Head::NotSimple, "{head:?}");
        }
        for head in [
            "GET / HTTP/1.1\nHost: t\n\n",
            "GET / HTTP/1.1\r\nHost: t\n\r\n",
            "GET / HTTP/1.1\r\n\r\n",
            "GET / HTTP/1.1\r\nHost:\r\n\r\n",
            "GET / HTTP/1.1\r\nHost: a b\r\n\r\n",
            "GET / HTTP/1.1\r\nHost: a,b\r\n\r\n",
            "GET / HTTP/1.0\r\nHost: t\r\n\r\n",
            "GET http://t/ HTTP/1.1\r\nHost: t\r\n\r\n",
            "GET * HTTP/1.1\r\nHost: t\r\n\r\n",
            "GET  / HTTP/1.1\r\nHost: t\r\n\r\n",
            "\r\nGET / HTTP/1.1\r\nHost: t\r\n\r\n",
            "POST / HTTP/1.1\r\nHost: t\r\n\r\n",
            "PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n",
            "P",
            "get",
            "GET x",
            "HEADS",
            // Half a head that can become none.
            "GET / HTTP/1.1\nHo",
            "GET / HTTP/1.1\r\nHost: t\rx",
            "GET / HTTP/1.1\r\nHost: t\r\nX: \u{e9}",
        ] {
            assert_eq!(kind(head.as_bytes()), Head::NotSimple, "{head:?}");
        }
    }

    #[test]
    fn more_fields_than_there_is_room_for_are_not_simple() {
        let with = |count: usize| format!("GET / HTTP/1.1\r\nHost: t\r\n{}\r\n", "X: y\r\n".repeat(count));
        assert!(matches!(kind(with(MAX_FIELDS - 1).as_bytes()), Head::Simple(..)));
        assert_eq!(kind(with(MAX_FIELDS).as_bytes()), Head::NotSimple);
    }
}
