//! What time is it in answers? That of the clock, also when it has been set back: hyper's own date stays until the clock has
//! come to where it was.

use std::{
    cell::RefCell,
    time::{Duration, Instant, SystemTime},
};

use axum::http::{HeaderValue, Response, header};

use crate::epoch::since_1970;

/// The value of `Date` at this moment; made once a second on each thread.
pub(super) fn with<R>(now: Instant, read: impl FnOnce(&HeaderValue) -> R) -> R {
    thread_local! {
        /// The value, and until when it is right.
        static DATE: RefCell<Option<(HeaderValue, Instant)>> = const { RefCell::new(None) };
    }
    DATE.with_borrow_mut(|date| {
        let known = date.take().filter(|(_, right_until)| now < *right_until);
        let (value, _) = date.insert(known.unwrap_or_else(|| {
            let of_this_second = Duration::from_nanos(since_1970().subsec_nanos().into());
            let value = HeaderValue::try_from(httpdate::fmt_http_date(SystemTime::now()));
            let right_until = now + (Duration::from_secs(1) - of_this_second);
            (value.expect("dates are plain characters"), right_until)
        }));
        read(value)
    })
}

/// An answer that says it.
pub(super) fn dated<B>(mut answer: Response<B>) -> Response<B> {
    let value = with(Instant::now(), Clone::clone);
    answer.headers_mut().insert(header::DATE, value);
    answer
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_date_is_that_of_the_clock_and_is_looked_up_again_a_second_later() {
        let text = |now: Instant| with(now, |value| value.to_str().unwrap().to_owned());
        let start = Instant::now();
        let told = httpdate::parse_http_date(&text(start)).unwrap();
        let off = SystemTime::now().duration_since(told).unwrap();
        assert!(off < Duration::from_secs(60), "{off:?}");
        let same = text(start);
        assert_eq!(same, text(start), "it is kept");
        // As for a request that comes later.
        text(start + Duration::from_secs(2));
        assert_eq!(dated(Response::new(())).headers().len(), 1);
    }
}
