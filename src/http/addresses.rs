//! How many connections has each address? As many as it may, so that one that opens more and more, and says half a head over
//! each, keeps nobody else waiting.

use std::{
    collections::HashMap,
    net::IpAddr,
    sync::{Arc, Mutex, MutexGuard},
    time::{Duration, Instant},
};

/// Between two lines of the log.
const TOLD_EVERY: Duration = Duration::from_secs(60);

/// Open connections by address.
#[derive(Debug)]
pub(super) struct Addresses {
    most: usize,
    open: Arc<Mutex<HashMap<IpAddr, usize>>>,
    told_at: Mutex<Option<Instant>>,
}

/// A connection that counts until it is dropped.
#[derive(Debug)]
pub(super) struct Counted {
    address: IpAddr,
    open: Arc<Mutex<HashMap<IpAddr, usize>>>,
}

impl Addresses {
    /// Each may have so many.
    pub(super) fn new(most: usize) -> Self {
        Self {
            most,
            open: Arc::default(),
            told_at: Mutex::default(),
        }
    }

    /// One more, unless there are too many of this address.
    pub(super) fn enter(&self, address: IpAddr) -> Option<Counted> {
        let mut all = locked(&self.open);
        let count = all.entry(address).or_default();
        if *count < self.most {
            *count += 1;
            return Some(Counted {
                address,
                open: self.open.clone(),
            });
        }
        drop(all);
        self.tell(address);
        None
    }

    /// Says in the log whose connections are closed, now and then.
    fn tell(&self, address: IpAddr) {
        let mut told_at = locked(&self.told_at);
        if told_at.is_none_or(|at| at.elapsed() >= TOLD_EVERY) {
            *told_at = Some(Instant::now());
            tracing::warn!(
                %address,
                most = self.most,
                "an address has as many connections as one may have; more of it are closed at once. If it is a proxy, \
                 raise `max_connections_per_address`"
            );
        }
    }
}

impl Drop for Counted {
    fn drop(&mut self) {
        let mut all = locked(&self.open);
        if let Some(count) = all.get_mut(&self.address) {
            *count -= 1;
            if *count == 0 {
                all.remove(&self.address);
            }
        }
    }
}

fn locked<T>(lock: &Mutex<T>) -> MutexGuard<'_, T> {
    lock.lock().expect("nobody panics while holding this lock")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_address_has_its_own_share_and_gets_it_back() {
        let addresses = Addresses::new(2);
        let enter = |last| addresses.enter([10, 0, 0, last].into());
        let (one, _two) = (enter(1).unwrap(), enter(1).unwrap());
        assert!(enter(1).is_none());
        let other = enter(2).unwrap();
        drop((one, other));
        assert!(enter(1).is_some());
        assert_eq!(locked(&addresses.open).len(), 1, "who has gone takes no room");
    }
}
