//! Who is at the other end of a connection? Its address, whether a request of it has come, whether it has been given time for
//! a long upload, or has said all of one and waits.

use std::{
    net::{IpAddr, Ipv6Addr, SocketAddr},
    sync::{
        Arc,
        atomic::{AtomicBool, AtomicUsize, Ordering},
    },
};

/// Of one connection; requests carry it as an extension.
#[derive(Debug, Clone)]
pub(super) struct Peer {
    household: IpAddr,
    requests: Requests,
}

/// Whom to count for: an address, or the network that a house has of the sixth version.
pub(super) fn household(address: SocketAddr) -> IpAddr {
    match address.ip().to_canonical() {
        IpAddr::V6(address) => {
            let [a, b, c, d, ..] = address.segments();
            IpAddr::V6(Ipv6Addr::new(a, b, c, d, 0, 0, 0, 0))
        }
        address => address,
    }
}

impl Peer {
    pub(super) fn new(address: SocketAddr, requests: Requests) -> Self {
        Self {
            household: household(address),
            requests,
        }
    }

    /// Whom to count requests for.
    pub(super) fn household(&self) -> IpAddr {
        self.household
    }

    /// The head of a request is all here.
    pub(super) fn has_asked(&self) {
        self.requests.0.asked.store(true, Ordering::Relaxed);
    }

    /// As long as what this gives is kept, the connection may talk without an answer.
    pub(super) fn take_time(&self) -> Upload {
        self.requests.0.going_on.fetch_add(1, Ordering::Relaxed);
        Upload {
            requests: self.requests.clone(),
            all_here: false,
        }
    }
}

/// What of one connection's requests is known where they are answered and wanted where bytes move.
#[derive(Debug, Clone, Default)]
pub(super) struct Requests(Arc<Counts>);

#[derive(Debug, Default)]
struct Counts {
    /// Whether there was one.
    asked: AtomicBool,
    /// How many uploads are going on.
    going_on: AtomicUsize,
    /// Those of them whose last byte has come.
    all_here: AtomicUsize,
}

impl Requests {
    /// Whether there was one.
    pub(super) fn have_come(&self) -> bool {
        self.0.asked.load(Ordering::Relaxed)
    }

    /// Whether an upload is going on.
    pub(super) fn going_on(&self) -> bool {
        self.0.going_on.load(Ordering::Relaxed) > 0
    }

    /// Whether it is the server that takes its time.
    pub(super) fn all_here(&self) -> bool {
        self.0.all_here.load(Ordering::Relaxed) > 0
    }
}

/// An upload that is going on.
#[derive(Debug)]
pub(super) struct Upload {
    requests: Requests,
    all_here: bool,
}

impl Upload {
    /// The last byte has come: from here on the connection may be silent.
    pub(super) fn all_here(&mut self) {
        if !std::mem::replace(&mut self.all_here, true) {
            self.requests.0.all_here.fetch_add(1, Ordering::Relaxed);
        }
    }
}

impl Drop for Upload {
    fn drop(&mut self) {
        self.requests.0.going_on.fetch_sub(1, Ordering::Relaxed);
        if self.all_here {
            self.requests.0.all_here.fetch_sub(1, Ordering::Relaxed);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_house_counts_as_one() {
        let household = |address: &str| household(address.parse().unwrap());
        assert_eq!(
            household("[2001:db8:1:2:3::4]:5"),
            household("[2001:db8:1:2:ffff::9]:7")
        );
        assert_ne!(household("[2001:db8:1:2::]:5"), household("[2001:db8:1:3::]:5"));
        assert_ne!(household("10.0.0.1:5"), household("10.0.0.2:5"));
        assert_eq!(household("[::ffff:10.0.0.1]:5"), household("10.0.0.1:9"));
    }
}
