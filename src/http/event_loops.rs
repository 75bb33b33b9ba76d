//! Which threads answer connections? One for each core, with an event loop of its own, so that connections are not handed
//! from thread to thread and no thread wakes another one for them: each reads and answers all that has come, then waits for more.
//!
//! What takes longer than a look into memory is not done here but on the runtime that all else shares: no answer of the
//! router, and no agreeing on keys, keeps the other connections waiting. Records of TLS are read and written here.

use std::{
    io,
    num::NonZero,
    sync::Arc,
    thread::{self, available_parallelism},
};

use tokio::{
    runtime::{Builder, Handle},
    sync::oneshot,
};

/// The event loops of one server; they end when this is dropped.
#[derive(Debug)]
pub(super) struct EventLoops(Vec<EventLoop>);

#[derive(Debug)]
struct EventLoop {
    handle: Handle,
    /// Shared by its connections.
    load: Load,
    /// When it is dropped, the loop ends.
    _goes_on: oneshot::Sender<()>,
}

/// One connection of an event loop, as long as this is kept.
#[derive(Debug, Clone, Default)]
pub(super) struct Load(Arc<()>);

impl EventLoops {
    /// One for each core.
    pub(super) fn start() -> io::Result<Self> {
        let cores = available_parallelism().map_or(1, NonZero::get);
        (0..cores).map(EventLoop::start).collect::<Result<_, _>>().map(Self)
    }

    /// Where a connection is to be answered: where there are fewest.
    pub(super) fn least_busy(&self) -> (&Handle, Load) {
        let chosen = self.0.iter().min_by_key(|one| Arc::strong_count(&one.load.0));
        let chosen = chosen.expect("there is at least one");
        (&chosen.handle, chosen.load.clone())
    }
}

impl EventLoop {
    fn start(number: usize) -> io::Result<Self> {
        let runtime = Builder::new_current_thread().enable_all().build()?;
        let handle = runtime.handle().clone();
        let (goes_on, ended) = oneshot::channel();
        let waits = move || drop(runtime.block_on(ended));
        thread::Builder::new()
            .name(format!("connections-{number}"))
            .spawn(waits)?;
        Ok(Self {
            handle,
            load: Load::default(),
            _goes_on: goes_on,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[tokio::test]
    async fn a_connection_goes_where_there_are_fewest() {
        let loops = EventLoops((0..3).map(EventLoop::start).collect::<Result<_, _>>().unwrap());
        let counts = || {
            let open = loops.0.iter().map(|one| Arc::strong_count(&one.load.0) - 1);
            open.collect::<Vec<_>>()
        };
        let mut open = vec![];
        for _ in 0..7 {
            let (handle, load) = loops.least_busy();
            let name = handle.spawn(async { thread::current().name().unwrap().to_owned() });
            open.push((load, name.await.unwrap()));
        }
        assert_eq!(counts(), [3, 2, 2]);
        open.retain(|(_, thread)| thread != "connections-1");
        assert_eq!(counts(), [3, 0, 2]);
        let _one_more = loops.least_busy();
        assert_eq!(counts(), [3, 1, 2]);
    }

    #[tokio::test]
    async fn what_is_left_ends_with_the_loops() {
        let loops = EventLoops::start().unwrap();
        let left = loops.least_busy().0.spawn(std::future::pending::<()>());
        drop(loops);
        assert!(left.await.unwrap_err().is_cancelled());
    }
}
