//! Has the server been told to end? Connections ask at every request, so that must cost next to nothing: a load, once they
//! have said whom to wake. Each of them waits for it as long as it is there, so that must take next to no room.

use std::{
    sync::{
        Arc, Mutex, MutexGuard,
        atomic::{AtomicBool, Ordering},
    },
    task::{Context, Poll, Waker},
};

/// Something that is said once, to everybody. Cheap to clone.
#[derive(Debug, Clone, Default)]
pub(super) struct Ending(Arc<Inner>);

#[derive(Debug, Default)]
struct Inner {
    given: AtomicBool,
    waiting: Mutex<Waiting>,
}

/// Who is to be woken.
#[derive(Debug, Default)]
struct Waiting {
    wakers: Vec<Option<Waker>>,
    /// Places without a waker.
    free: Vec<usize>,
}

impl Ending {
    /// Says it.
    pub(super) fn give(&self) {
        self.0.given.store(true, Ordering::Release);
        let wakers: Vec<_> = self.waiting().wakers.iter_mut().filter_map(Option::take).collect();
        wakers.into_iter().for_each(Waker::wake);
    }

    /// For one task, which is woken.
    pub(super) fn heard(&self) -> Heard {
        Heard {
            ending: self.clone(),
            place: None,
        }
    }

    fn waiting(&self) -> MutexGuard<'_, Waiting> {
        self.0.waiting.lock().expect("nobody panics while holding this lock")
    }
}

/// Whether one task has heard it.
#[derive(Debug)]
pub(super) struct Heard {
    ending: Ending,
    /// Of its waker.
    place: Option<usize>,
}

impl Heard {
    pub(super) fn given(&self) -> bool {
        self.ending.0.given.load(Ordering::Acquire)
    }

    /// For the same task, when this one is about to be dropped or is not asked again.
    pub(super) fn again(&self) -> Self {
        self.ending.heard()
    }

    /// Ready when it was said. The task of the first call is woken then, so it must be the same one that calls again.
    pub(super) fn poll(&mut self, cx: &mut Context<'_>) -> Poll<()> {
        if self.place.is_none() {
            self.place = Some(self.ending.waiting().add(cx.waker()));
        }
        if self.given() { Poll::Ready(()) } else { Poll::Pending }
    }
}

impl Drop for Heard {
    fn drop(&mut self) {
        if let Some(place) = self.place {
            let mut waiting = self.ending.waiting();
            waiting.wakers[place] = None;
            waiting.free.push(place);
        }
    }
}

impl Waiting {
    fn add(&mut self, waker: &Waker) -> usize {
        let place = self.free.pop().unwrap_or_else(|| {
            self.wakers.push(None);
            self.wakers.len() - 1
        });
        self.wakers[place] = Some(waker.clone());
        place
    }
}

#[cfg(test)]
mod tests {
    use std::{future::poll_fn, time::Duration};

    use super::*;

    #[tokio::test]
    async fn everybody_who_waits_is_woken_and_who_comes_later_does_not_wait() {
        let ending = Ending::default();
        let waits = || {
            let mut heard = ending.heard();
            tokio::spawn(async move {
                // Twice: once before and once after somebody else has woken the task.
                let mut woken = Box::pin(tokio::time::sleep(Duration::from_millis(1)));
                poll_fn(|cx| {
                    woken
                        .as_mut()
                        .poll(cx)
                        .is_ready()
                        .then_some(())
                        .map_or(Poll::Pending, Poll::Ready)
                })
                .await;
                assert!(!heard.given());
                poll_fn(|cx| heard.poll(cx)).await;
            })
        };
        let waiting = [waits(), waits()];
        tokio::time::sleep(Duration::from_millis(20)).await;
        assert!(waiting.iter().all(|task| !task.is_finished()));
        ending.give();
        for task in waiting {
            let heard = tokio::time::timeout(Duration::from_secs(20), task).await;
            heard.expect("nobody woke it").unwrap();
        }
        let mut late = ending.heard();
        assert_eq!(ending.waiting().free.len(), 2, "there is room for others");
        assert!(late.given());
        poll_fn(|cx| late.poll(cx)).await;
    }
}
