//! What time is it on the wall? For what others read: links that expire, names of requests, times in events.

use std::time::{Duration, UNIX_EPOCH};

/// The time since the beginning of 1970; none on a machine whose clock stands before that.
pub(crate) fn since_1970() -> Duration {
    UNIX_EPOCH.elapsed().unwrap_or_default()
}
