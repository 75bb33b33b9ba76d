//! How are the frames of many streams of HTTP/2 sent? Those of one turn of their connection together: a TLS record for each frame, and
//! a system call for each record, would cost both ends more than all else about a small answer.
//!
//! While a cork is in, frames are kept above TLS until they fill records, and nothing is flushed, whatever the connection says.
//! At the end of its turn the cork is pulled, and the connection has another turn, in which it flushes.

use std::{
    io::{self, IoSlice},
    pin::Pin,
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering::Relaxed},
    },
    task::{Context, Poll, ready},
};

use tokio::io::{AsyncRead, AsyncWrite, ReadBuf};

use super::quiet::Moves;

/// What a TLS record holds at most.
const RECORD_BYTES: usize = 16 << 10;
/// So much is not kept but written, as far as it fills records.
const MUCH_BYTES: usize = 2 * RECORD_BYTES;

/// The cork of one connection, which one task at a time knows. Cheap to clone.
#[derive(Debug, Clone, Default)]
pub(super) struct Cork(Arc<State>);

#[derive(Debug, Default)]
struct State {
    /// Whether there are turns at all.
    in_use: AtomicBool,
    is_in: AtomicBool,
    /// Something was written and not flushed.
    waits: AtomicBool,
}

impl Cork {
    /// From the first request on: before, nobody may be there to flush.
    pub(super) fn begin(&self) {
        self.0.in_use.store(true, Relaxed);
    }

    /// Has the connection write what it has to, then send it.
    pub(super) fn poll<F: Future>(&self, mut connection: Pin<&mut F>, cx: &mut Context<'_>) -> Poll<F::Output> {
        self.0.is_in.store(self.0.in_use.load(Relaxed), Relaxed);
        let polled = connection.as_mut().poll(cx);
        self.0.is_in.store(false, Relaxed);
        if polled.is_pending() && self.0.waits.load(Relaxed) {
            return connection.poll(cx);
        }
        polled
    }

    fn is_in(&self) -> bool {
        self.0.is_in.load(Relaxed)
    }
}

/// A connection whose bytes nobody else reads, with a cork or without.
#[derive(Debug)]
pub(super) struct Corked<T> {
    io: T,
    cork: Option<Cork>,
    /// What is written together; without room while there is nothing.
    kept: Vec<u8>,
}

impl<T> Corked<T> {
    pub(super) fn new(io: T, cork: Option<Cork>) -> Self {
        Self {
            io,
            cork,
            kept: Vec::new(),
        }
    }

    /// Whether what is written is kept.
    fn keeps(&self) -> bool {
        self.cork.as_ref().is_some_and(Cork::is_in)
    }
}

impl<T: AsyncWrite + Unpin> Corked<T> {
    /// Writes all that was kept.
    fn poll_kept(&mut self, cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        while !self.kept.is_empty() {
            let written = ready!(Pin::new(&mut self.io).poll_write(cx, &self.kept))?;
            if written == 0 {
                return Poll::Ready(Err(io::ErrorKind::WriteZero.into()));
            }
            self.kept.drain(..written);
        }
        self.kept = Vec::new();
        Poll::Ready(Ok(()))
    }

    /// Writes as many whole records as there are of what was kept and of this, which are many bytes; then keeps the rest. Says how much
    /// of this was taken.
    fn poll_records(&mut self, cx: &mut Context<'_>, slices: &[IoSlice<'_>]) -> Poll<io::Result<usize>> {
        let given: usize = slices.iter().map(|slice| slice.len()).sum();
        let mut room = (self.kept.len() + given) / RECORD_BYTES * RECORD_BYTES;
        let whole = room;
        let mut records = Vec::with_capacity(1 + slices.len());
        for slice in [&self.kept[..]]
            .into_iter()
            .chain(slices.iter().map(|slice| &slice[..]))
        {
            let fits = slice.len().min(room);
            room -= fits;
            records.push(IoSlice::new(&slice[..fits]));
        }
        let written = ready!(Pin::new(&mut self.io).poll_write_vectored(cx, &records))?;
        if written == 0 {
            return Poll::Ready(Err(io::ErrorKind::WriteZero.into()));
        }
        let of_kept = written.min(self.kept.len());
        self.kept.drain(..of_kept);
        let taken = written - of_kept;
        if written < whole {
            return match taken {
                // None of this: there may be room for it now.
                0 => Pin::new(self).poll_write_vectored(cx, slices),
                _ => Poll::Ready(Ok(taken)),
            };
        }
        let mut passed = taken;
        for slice in slices {
            let skip = passed.min(slice.len());
            passed -= skip;
            self.kept.extend_from_slice(&slice[skip..]);
        }
        Poll::Ready(Ok(given))
    }
}

impl<T> Moves for Corked<T> {}

impl<T: AsyncRead + Unpin> AsyncRead for Corked<T> {
    fn poll_read(mut self: Pin<&mut Self>, cx: &mut Context<'_>, buf: &mut ReadBuf<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.io).poll_read(cx, buf)
    }
}

impl<T: AsyncWrite + Unpin> AsyncWrite for Corked<T> {
    fn poll_write(self: Pin<&mut Self>, cx: &mut Context<'_>, bytes: &[u8]) -> Poll<io::Result<usize>> {
        self.poll_write_vectored(cx, &[IoSlice::new(bytes)])
    }

    fn poll_write_vectored(
        mut self: Pin<&mut Self>,
        cx: &mut Context<'_>,
        slices: &[IoSlice<'_>],
    ) -> Poll<io::Result<usize>> {
        if !self.keeps() {
            ready!(self.poll_kept(cx))?;
            return Pin::new(&mut self.io).poll_write_vectored(cx, slices);
        }
        if let Some(cork) = &self.cork {
            cork.0.waits.store(true, Relaxed);
        }
        let given = slices.iter().map(|slice| slice.len()).sum();
        if self.kept.len() + given >= MUCH_BYTES {
            return self.poll_records(cx, slices);
        }
        self.kept.reserve(given);
        slices.iter().for_each(|slice| self.kept.extend_from_slice(slice));
        Poll::Ready(Ok(given))
    }

    fn is_write_vectored(&self) -> bool {
        self.io.is_write_vectored()
    }

    fn poll_flush(mut self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        if self.keeps() {
            return Poll::Ready(Ok(()));
        }
        ready!(self.poll_kept(cx))?;
        let flushed = Pin::new(&mut self.io).poll_flush(cx);
        if let Some(cork) = self.cork.as_ref().filter(|_| flushed.is_ready()) {
            cork.0.waits.store(false, Relaxed);
        }
        flushed
    }

    fn poll_shutdown(mut self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        ready!(self.poll_kept(cx))?;
        Pin::new(&mut self.io).poll_shutdown(cx)
    }
}

#[cfg(test)]
mod tests {
    use std::{future::poll_fn, pin::pin, sync::Mutex, task::Waker};

    use super::*;

    /// Notes how much is written at once; takes nothing while it is full.
    #[derive(Clone, Default)]
    struct Wire(Arc<Mutex<(Vec<usize>, bool)>>);

    impl Wire {
        fn writes(&self) -> Vec<usize> {
            std::mem::take(&mut self.0.lock().unwrap().0)
        }

        fn is_full(&self, full: bool) {
            self.0.lock().unwrap().1 = full;
        }
    }

    impl AsyncWrite for Wire {
        fn poll_write(self: Pin<&mut Self>, _: &mut Context<'_>, bytes: &[u8]) -> Poll<io::Result<usize>> {
            let mut wire = self.0.lock().unwrap();
            if wire.1 {
                return Poll::Pending;
            }
            wire.0.push(bytes.len());
            Poll::Ready(Ok(bytes.len()))
        }

        fn poll_write_vectored(
            self: Pin<&mut Self>,
            cx: &mut Context<'_>,
            slices: &[IoSlice<'_>],
        ) -> Poll<io::Result<usize>> {
            let all: Vec<u8> = slices.iter().flat_map(|slice| slice.to_vec()).collect();
            self.poll_write(cx, &all)
        }

        fn poll_flush(self: Pin<&mut Self>, _: &mut Context<'_>) -> Poll<io::Result<()>> {
            Poll::Ready(Ok(()))
        }

        fn poll_shutdown(self: Pin<&mut Self>, _: &mut Context<'_>) -> Poll<io::Result<()>> {
            Poll::Ready(Ok(()))
        }
    }

    /// Each turn writes and flushes so many frames of so many bytes, flushes once more and waits, as HTTP/2 does.
    fn turns(wire: &Wire, test: impl FnOnce(&Cork, &mut dyn FnMut(usize, usize))) {
        let cork = Cork::default();
        let mut io = Corked::new(wire.clone(), Some(cork.clone()));
        let left = Mutex::new((0, 0));
        let mut connection = pin!(poll_fn(|cx| {
            loop {
                let (frames, bytes) = *left.lock().unwrap();
                if frames == 0 {
                    ready!(Pin::new(&mut io).poll_flush(cx)).unwrap();
                    return Poll::<()>::Pending;
                }
                ready!(Pin::new(&mut io).poll_write(cx, &vec![0; bytes])).unwrap();
                left.lock().unwrap().0 -= 1;
                ready!(Pin::new(&mut io).poll_flush(cx)).unwrap();
            }
        }));
        test(&cork, &mut |frames, bytes| {
            *left.lock().unwrap() = (frames, bytes);
            let mut cx = Context::from_waker(Waker::noop());
            assert!(cork.poll(connection.as_mut(), &mut cx).is_pending());
        });
    }

    #[test]
    fn the_frames_of_one_turn_go_together_from_the_first_request_on() {
        let wire = Wire::default();
        turns(&wire, |cork, turn| {
            turn(2, 100);
            assert_eq!(wire.writes(), [100, 100]);
            cork.begin();
            turn(3, 100);
            assert_eq!(wire.writes(), [300]);
            turn(0, 0);
            assert!(wire.writes().is_empty());
        });
    }

    #[test]
    fn what_fills_records_does_not_wait_for_the_end_of_the_turn() {
        let wire = Wire::default();
        turns(&wire, |cork, turn| {
            cork.begin();
            turn(5, RECORD_BYTES - 100);
            assert_eq!(wire.writes(), [2 * RECORD_BYTES, 2 * RECORD_BYTES, RECORD_BYTES - 500]);
        });
    }

    #[test]
    fn what_could_not_go_at_the_end_of_its_turn_goes_with_the_next() {
        let wire = Wire::default();
        turns(&wire, |cork, turn| {
            cork.begin();
            wire.is_full(true);
            turn(1, 100);
            turn(0, 0);
            assert!(wire.writes().is_empty());
            wire.is_full(false);
            turn(0, 0);
            assert_eq!(wire.writes(), [100]);
        });
    }
}
