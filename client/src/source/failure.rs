//! Why did no answer come, or not all of it? In words for a person: libraries name one failure in each of their layers.

use std::io;

use crate::Error;

/// What says more by its name than by its text.
const NAMED: [io::ErrorKind; 4] = [
    io::ErrorKind::ConnectionRefused,
    io::ErrorKind::HostUnreachable,
    io::ErrorKind::NetworkUnreachable,
    io::ErrorKind::TimedOut,
];

/// A request that was not answered, or not to its end.
pub(crate) fn failed(path: &str, cause: &reqwest::Error) -> Error {
    Error::Fetch {
        path: path.to_owned(),
        cause: told(cause),
    }
}

/// An answer that ended early: so many bytes of it came, of as many as were announced.
pub(super) fn cut(path: &str, cause: &reqwest::Error, (came, announced): (u64, Option<u64>)) -> Error {
    let of = announced.map_or_else(String::new, |bytes| format!(" of {bytes}"));
    Error::Fetch {
        path: path.to_owned(),
        cause: format!("{} after {came}{of} bytes", told(cause)),
    }
}

fn told(cause: &reqwest::Error) -> String {
    if let Some(status) = cause.status() {
        return format!("the server answers with status {status}");
    }
    if cause.is_connect() {
        return unconnected(cause);
    }
    let is_begun = cause.is_body() || cause.is_decode();
    match (cause.is_timeout(), is_begun) {
        (true, true) => "nothing more came".to_owned(),
        (true, false) => "no answer came in time".to_owned(),
        (false, true) => "the connection was cut".to_owned(),
        (false, false) => format!("no answer came: {}", innermost(cause)),
    }
}

fn unconnected(cause: &reqwest::Error) -> String {
    let place = cause.url().and_then(|url| {
        let (host, port) = (url.host_str()?, url.port_or_known_default()?);
        Some(format!("{host}:{port}"))
    });
    let place = place.as_deref().unwrap_or("its address");
    let innermost = innermost(cause);
    let kind = innermost.downcast_ref().map(io::Error::kind);
    match kind.filter(|kind| NAMED.contains(kind)) {
        Some(kind) => format!("nobody answers at {place} ({kind})"),
        None => format!("cannot connect to {place}: {innermost}"),
    }
}

fn innermost(cause: &reqwest::Error) -> &(dyn std::error::Error + 'static) {
    let mut innermost: &(dyn std::error::Error + 'static) = cause;
    while let Some(cause) = innermost.source() {
        innermost = cause;
    }
    innermost
}
