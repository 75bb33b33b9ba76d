//! Who answers the streams of HTTP/2? The task of their connection, as far as that goes without waiting; what must wait gets a task
//! of its own. Most answers are in memory, and beside those a task for each, which other threads are woken to take, would show.

use std::task::{Context, Waker};

use hyper::rt::Executor;

/// Begins at once with what it is given.
#[derive(Debug, Clone, Copy)]
pub(super) struct AtOnce;

impl<F: Future<Output = ()> + Send + 'static> Executor<F> for AtOnce {
    fn execute(&self, stream: F) {
        let mut stream = Box::pin(stream);
        // Nobody need be woken: what goes on is looked at anew by its own task.
        if stream
            .as_mut()
            .poll(&mut Context::from_waker(Waker::noop()))
            .is_pending()
        {
            tokio::spawn(stream);
        }
    }
}

#[cfg(test)]
mod tests {
    use tokio::sync::oneshot;

    use super::*;

    #[tokio::test]
    async fn what_need_not_wait_is_done_at_once_and_the_rest_in_time() {
        let (done, mut is_done) = oneshot::channel();
        AtOnce.execute(async move { done.send(1).unwrap() });
        assert_eq!(is_done.try_recv(), Ok(1));

        let (go_on, waiting) = oneshot::channel();
        let (done, is_done) = oneshot::channel();
        AtOnce.execute(async move { done.send(waiting.await.unwrap()).unwrap() });
        go_on.send(2).unwrap();
        assert_eq!(is_done.await, Ok(2));
    }
}
