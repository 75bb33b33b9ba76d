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

    /// For one who waits, and is woken.
    pub(super) fn heard(&self) -> Heard {
        Heard {
            ending: self.clone(),
            waits: None,
        }
    }

    fn waiting(&self) -> MutexGuard<'_, Waiting> {
        self.0.waiting.lock().expect("nobody panics while holding this lock")
    }
}

/// Whether it was heard, by whichever task asks.
#[derive(Debug)]
pub(super) struct Heard {
    ending: Ending,
    /// The task that asked last, and the place of its waker.
    waits: Option<(Waker, usize)>,
}

impl Heard {
    pub(super) fn given(&self) -> bool {
        self.ending.0.given.load(Ordering::Acquire)
    }

    /// For another who waits beside this one.
    pub(super) fn again(&self) -> Self {
        self.ending.heard()
    }

    /// Ready when it was said. The task that asked last is woken then.
    pub(super) fn poll(&mut self, cx: &mut Context<'_>) -> Poll<()> {
        let asked_before = matches!(&self.waits, Some((waker, _)) if waker.will_wake(cx.waker()));
        if !asked_before {
            self.wait(cx.waker());
        }
        if self.given() { Poll::Ready(()) } else { Poll::Pending }
    }

    #[cold]
    fn wait(&mut self, waker: &Waker) {
        let place = self.waits.take().map(|(_, place)| place);
        let place = self.ending.waiting().put(place, waker);
        self.waits = Some((waker.clone(), place));
    }
}

impl Drop for Heard {
    fn drop(&mut self) {
        if let Some((_, place)) = self.waits {
            let mut waiting = self.ending.waiting();
            waiting.wakers[place] = None;
            waiting.free.push(place);
        }
    }
}

impl Waiting {
    /// Puts a waker in a place, or in a free one.
    fn put(&mut self, place: Option<usize>, waker: &Waker) -> usize {
        let place = place.or_else(|| self.free.pop()).unwrap_or_else(|| {
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
    #[tokio::test]
    async fn who_goes_on_elsewhere_is_woken_there() {
        let ending = Ending::default();
        let mut heard = ending.heard();
        let first = tokio::spawn(async move {
            poll_fn(|cx| {
                assert!(heard.poll(cx).is_pending());
                Poll::Ready(())
            })
            .await;
            heard
        });
        let mut heard = first.await.unwrap();
        let second = tokio::spawn(async move {
            poll_fn(|cx| heard.poll(cx)).await;
            heard
        });
        tokio::task::yield_now().await;
        assert!(!second.is_finished());
        ending.give();
        let woken = tokio::time::timeout(Duration::from_secs(20), second).await;
        let heard = woken.expect("the task that waits now is not woken").unwrap();
        assert_eq!(ending.waiting().wakers.len(), 1, "it has one place");
        drop(heard);
        assert_eq!(ending.waiting().free.len(), 1);
    }
}
