//! How do two write to one connection? Its own task, and whoever has something short to say into a stream that the task would
//! otherwise be woken for. Chunks stay whole: while the task writes, or a rest of a chunk waits for it, it alone does.

use std::{
    io::{self, IoSlice},
    pin::Pin,
    sync::{
        Arc, Mutex, MutexGuard,
        atomic::{AtomicBool, Ordering},
    },
    task::{Context, Poll, ready},
};

use socket2::SockRef;
use tokio::{
    io::{AsyncRead, AsyncWrite, ReadBuf},
    net::{
        TcpStream,
        tcp::{OwnedReadHalf, OwnedWriteHalf},
    },
};

use super::wire::{CHUNK_END, ChunkHead};
use crate::{
    http::quiet::Moves,
    live::{Held, Line, Turn},
};

/// A connection that others may write chunks to as well.
#[derive(Debug)]
pub(in crate::http) struct Socket {
    read: OwnedReadHalf,
    shared: Arc<Shared>,
}

/// What others know of the connection.
#[derive(Debug)]
pub(super) struct Shared {
    write: OwnedWriteHalf,
    turn: Mutex<Turn>,
    /// Others have written since somebody asked.
    others_wrote: AtomicBool,
}

impl Socket {
    pub(in crate::http) fn new(stream: TcpStream) -> Self {
        let (read, write) = stream.into_split();
        let shared = Arc::new(Shared {
            write,
            turn: Mutex::new(Turn::Task),
            others_wrote: AtomicBool::new(false),
        });
        Self { read, shared }
    }

    /// The same where the runtime of whoever calls this tells when bytes have come.
    pub(super) fn moved(self) -> io::Result<Self> {
        let Self { read, shared } = self;
        match Arc::try_unwrap(shared) {
            Ok(shared) => {
                let stream = read.reunite(shared.write).map_err(io::Error::other)?;
                TcpStream::from_std(stream.into_std()?).map(Self::new)
            }
            // Somebody may write to it still: the one before tells the one that calls.
            Err(shared) => Ok(Self { read, shared }),
        }
    }

    pub(super) fn shared(&self) -> &Arc<Shared> {
        &self.shared
    }
}

impl Shared {
    fn turn(&self) -> MutexGuard<'_, Turn> {
        self.turn.lock().expect("nobody panics while holding this lock")
    }

    /// Others may write from now on, unless they have begun something that the task must end.
    pub(super) fn free(&self) {
        let mut turn = self.turn();
        if matches!(*turn, Turn::Task) {
            *turn = Turn::Free;
        }
    }

    /// Nobody else writes from now on; gives what must be written before all else.
    pub(super) fn take_turn(&self) -> Vec<u8> {
        match std::mem::replace(&mut *self.turn(), Turn::Task) {
            Turn::Task | Turn::Free => Vec::new(),
            Turn::Rest(rest) => rest,
        }
    }

    /// Whether a rest waits for the task.
    pub(super) fn has_rest(&self) -> bool {
        matches!(*self.turn(), Turn::Rest(_))
    }

    fn stream(&self) -> &TcpStream {
        self.write.as_ref()
    }
}

impl Line for Shared {
    fn hold(&self) -> Option<Held<'_>> {
        // Past the runtime's notes of the connection, which only the task needs.
        Held::if_free(self.turn(), SockRef::from(self.stream()), &self.others_wrote)
    }

    fn frame(&self, piece: &[&[u8]], wire: &mut Vec<u8>) {
        // As one: to copy a little takes less than to have it gathered.
        let length = piece.iter().map(|part| part.len()).sum();
        wire.reserve(length + ChunkHead::MOST_BYTES + CHUNK_END.len());
        wire.extend_from_slice(ChunkHead::of(length).bytes());
        piece.iter().for_each(|part| wire.extend_from_slice(part));
        wire.extend_from_slice(CHUNK_END);
    }
}

impl Moves for Socket {
    fn take_moved(&self) -> bool {
        let wrote = &self.shared.others_wrote;
        wrote.load(Ordering::Relaxed) && wrote.swap(false, Ordering::Relaxed)
    }
}

impl AsyncRead for Socket {
    fn poll_read(mut self: Pin<&mut Self>, cx: &mut Context<'_>, buf: &mut ReadBuf<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.read).poll_read(cx, buf)
    }
}

impl Socket {
    /// Ready when something can be written.
    pub(super) fn poll_writable(&self, cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        self.shared.stream().poll_write_ready(cx)
    }

    /// Writes as much as goes now.
    pub(super) fn write_now(&self, slices: &[IoSlice<'_>]) -> io::Result<usize> {
        match slices {
            [one] => self.shared.stream().try_write(one),
            many => self.shared.stream().try_write_vectored(many),
        }
    }

    /// Writes as soon as something can be written.
    fn poll_io(
        &self,
        cx: &mut Context<'_>,
        mut write: impl FnMut(&TcpStream) -> io::Result<usize>,
    ) -> Poll<io::Result<usize>> {
        let stream = self.shared.stream();
        loop {
            ready!(stream.poll_write_ready(cx))?;
            match write(stream) {
                Err(error) if error.kind() == io::ErrorKind::WouldBlock => {}
                written => return Poll::Ready(written),
            }
        }
    }
}

impl AsyncWrite for Socket {
    fn poll_write(self: Pin<&mut Self>, cx: &mut Context<'_>, bytes: &[u8]) -> Poll<io::Result<usize>> {
        self.poll_io(cx, |stream| stream.try_write(bytes))
    }

    fn poll_write_vectored(
        self: Pin<&mut Self>,
        cx: &mut Context<'_>,
        slices: &[IoSlice<'_>],
    ) -> Poll<io::Result<usize>> {
        self.poll_io(cx, |stream| stream.try_write_vectored(slices))
    }

    fn is_write_vectored(&self) -> bool {
        true
    }

    fn poll_flush(self: Pin<&mut Self>, _: &mut Context<'_>) -> Poll<io::Result<()>> {
        // Nothing is held back.
        Poll::Ready(Ok(()))
    }

    fn poll_shutdown(self: Pin<&mut Self>, _: &mut Context<'_>) -> Poll<io::Result<()>> {
        // It ends when it is dropped.
        Poll::Ready(Ok(()))
    }
}

#[cfg(test)]
mod tests {
    use tokio::{
        io::{AsyncReadExt, AsyncWriteExt},
        net::TcpListener,
    };

    use super::*;
    use crate::live::Taken;

    async fn connection() -> (TcpStream, Socket) {
        let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
        let far = TcpStream::connect(listener.local_addr().unwrap()).await.unwrap();
        let (near, _) = listener.accept().await.unwrap();
        near.writable().await.unwrap();
        (far, Socket::new(near))
    }

    /// Writes a piece past the task.
    fn take(line: &Shared, piece: &[u8]) -> Taken {
        let mut chunk = Vec::new();
        line.frame(&[piece], &mut chunk);
        line.hold().map_or(Taken::Nothing, |held| {
            let sent = held.socket().send(&chunk);
            held.has_sent(&sent, &chunk)
        })
    }

    async fn heard(far: &mut TcpStream, length: usize) -> Vec<u8> {
        let mut heard = vec![0; length];
        far.read_exact(&mut heard).await.unwrap();
        heard
    }

    #[tokio::test]
    async fn others_write_only_while_the_task_has_nothing_to_write() {
        let (mut far, socket) = connection().await;
        let shared = socket.shared();
        assert_eq!(take(shared, b"early"), Taken::Nothing);
        shared.free();
        assert!(!socket.take_moved());
        assert_eq!(take(shared, b"seventeen letters"), Taken::All);
        assert!(socket.take_moved() && !socket.take_moved());
        assert_eq!(shared.take_turn(), b"");
        assert_eq!(take(shared, b"late"), Taken::Nothing);
        assert_eq!(heard(&mut far, 23).await, b"11\r\nseventeen letters\r\n");
    }

    #[tokio::test]
    async fn the_task_ends_the_chunk_that_others_have_begun() {
        // More than any connection holds.
        let long = vec![b'x'; 64 << 20];
        let (mut far, mut socket) = connection().await;
        let shared = socket.shared().clone();
        shared.free();
        assert_eq!(take(&shared, &long), Taken::Begun);
        assert_eq!(take(&shared, b"and more"), Taken::Nothing);
        shared.free();
        assert!(shared.has_rest(), "it is the task's turn still");
        let rest = shared.take_turn();
        let ends = async {
            socket.write_all(&rest).await.unwrap();
            shared.free();
        };
        let whole = [b"4000000\r\n", &long[..], b"\r\n"].concat();
        let ((), heard_so_far) = tokio::join!(ends, heard(&mut far, whole.len()));
        assert!(heard_so_far == whole);
        assert_eq!(take(&shared, b"."), Taken::All);
        assert_eq!(heard(&mut far, 6).await, b"1\r\n.\r\n");
    }
}
