//! How are chunks sent over many connections at once? With one call of the kernel for all of them, where it takes that.
//!
//! A call for each costs the way into the kernel and back, and on the way back whoever was woken by the chunk takes the
//! processor, reads that one chunk, and sleeps again. Linux takes many calls as one through a ring (`io_uring`, and sends since 5.6);
//! where there is none, or a container forbids it, each chunk is sent with a call of its own.

use std::io;

use socket2::SockRef;

/// So many chunks are sent with one call at most.
pub(super) const MOST: usize = 128;

/// A chunk, and where it goes.
#[derive(Debug)]
pub(super) struct Outgoing<'a> {
    pub(super) socket: &'a SockRef<'a>,
    pub(super) chunk: &'a [u8],
}

/// Sends chunks as far as none of them waits; says of each how many of its bytes were sent.
pub(super) fn send(chunks: &[Outgoing]) -> Vec<io::Result<usize>> {
    chunks.chunks(MOST).flat_map(send_some).collect()
}

fn send_some(chunks: &[Outgoing]) -> Vec<io::Result<usize>> {
    let together = if chunks.len() > 1 { ring::send(chunks) } else { None };
    together.unwrap_or_else(|| one_by_one(chunks))
}

fn one_by_one(chunks: &[Outgoing]) -> Vec<io::Result<usize>> {
    let each = chunks.iter().map(|out| out.socket.send(out.chunk));
    each.collect()
}

#[cfg(not(all(target_os = "linux", any(target_arch = "x86_64", target_arch = "aarch64"))))]
mod ring {
    use std::io;

    use super::Outgoing;

    pub(super) fn send(_: &[Outgoing]) -> Option<Vec<io::Result<usize>>> {
        None
    }
}

#[cfg(all(target_os = "linux", any(target_arch = "x86_64", target_arch = "aarch64")))]
mod ring {
    use std::{cell::RefCell, io, os::fd::AsRawFd};

    use io_uring::{IoUring, Probe, opcode::Send, types::Fd};

    use super::{MOST, Outgoing};

    /// `MSG_DONTWAIT | MSG_NOSIGNAL`.
    const AT_ONCE: i32 = 0x40 | 0x4000;

    thread_local! {
        /// None when there can be none.
        static RING: RefCell<Option<IoUring>> = RefCell::new(ring_that_sends().ok());
    }

    fn ring_that_sends() -> io::Result<IoUring> {
        let (ring, mut known) = (IoUring::new(MOST as u32)?, Probe::new());
        ring.submitter().register_probe(&mut known)?;
        let sends = known.is_supported(Send::CODE);
        sends.then_some(ring).ok_or_else(|| io::ErrorKind::Unsupported.into())
    }

    /// None when this thread has no ring; then nothing was sent.
    pub(super) fn send(chunks: &[Outgoing]) -> Option<Vec<io::Result<usize>>> {
        RING.with_borrow_mut(|place| {
            let ring = place.as_mut()?;
            let (sent, broken) = send_through(ring, chunks);
            if let Some(error) = broken {
                tracing::warn!(%error, "the kernel did not take what many were to be told at once; another ring is made");
                *place = ring_that_sends().ok();
            }
            Some(sent)
        })
    }

    /// Sends at most as many chunks as the ring has room for; with an error when the ring is not to be used again.
    #[expect(unsafe_code, reason = "the kernel reads the chunks, which the compiler cannot see")]
    fn send_through(ring: &mut IoUring, chunks: &[Outgoing]) -> (Vec<io::Result<usize>>, Option<io::Error>) {
        for (i, out) in (0..).zip(chunks) {
            let (fd, length) = (Fd(out.socket.as_raw_fd()), out.chunk.len() as u32);
            let entry = Send::new(fd, out.chunk.as_ptr(), length).flags(AT_ONCE).build();
            // SAFETY: the chunk and the socket are borrowed until this function returns. It returns when each send that was handed
            // over has ended; and since they must not wait, they end within the call that hands them over.
            let pushed = unsafe { ring.submission().push(&entry.user_data(i)) };
            pushed.expect("there is room: all earlier ones were handed over");
        }
        // Without a text, which would be made for each chunk and is not shown: the ring says of each what became of it, or is broken.
        let mut sent: Vec<_> = chunks.iter().map(|_| Err(io::ErrorKind::Other.into())).collect();
        let mut left = chunks.len();
        while left > 0 {
            let submitted = ring.submit_and_wait(left);
            for done in ring.completion() {
                left -= 1;
                sent[done.user_data() as usize] = match done.result() {
                    length @ 0.. => Ok(length as usize),
                    error => Err(io::Error::from_raw_os_error(-error)),
                };
            }
            match submitted {
                Err(error) if error.kind() != io::ErrorKind::Interrupted => return (sent, Some(error)),
                _ => {}
            }
        }
        (sent, None)
    }
}

#[cfg(test)]
mod tests {
    use std::io::Read;

    use socket2::{Domain, Socket, Type};

    use super::*;

    fn pair() -> (Socket, Socket) {
        let (near, far) = Socket::pair(Domain::UNIX, Type::STREAM, None).unwrap();
        near.set_nonblocking(true).unwrap();
        (near, far)
    }

    #[test]
    fn each_connection_gets_its_own_and_one_that_takes_no_more_holds_nobody_up() {
        for way in [send, one_by_one] {
            sends_to_each_its_own(way);
        }
        let (near, far) = pair();
        let (near, far) = (SockRef::from(&near), SockRef::from(&far));
        let two = [&near, &far].map(|socket| Outgoing { socket, chunk: b"x" });
        if ring::send(&two).is_none() {
            eprintln!("no ring here: only sends of their own were tested");
        }
    }

    fn sends_to_each_its_own(way: fn(&[Outgoing]) -> Vec<io::Result<usize>>) {
        // More than are sent with one call.
        let pairs: Vec<_> = (0..MOST + 9).map(|_| pair()).collect();
        let chunks: Vec<_> = (0..pairs.len()).map(|i| format!("chunk {i}")).collect();
        let (full, gone) = (5, MOST + 3);
        while pairs[full].0.send(&[0; 4096]).is_ok() {}
        pairs[gone].1.shutdown(std::net::Shutdown::Both).unwrap();
        let sockets: Vec<_> = pairs.iter().map(|(near, _)| SockRef::from(near)).collect();
        let chunks_of = sockets.iter().zip(&chunks);
        let outgoing: Vec<_> = chunks_of
            .map(|(socket, chunk)| Outgoing {
                socket,
                chunk: chunk.as_bytes(),
            })
            .collect();
        let sent = way(&outgoing);
        assert_eq!(sent.len(), pairs.len());
        for (i, sent) in sent.into_iter().enumerate() {
            match sent {
                Err(error) if i == full => assert_eq!(error.kind(), io::ErrorKind::WouldBlock),
                Err(error) if i == gone => assert_eq!(error.kind(), io::ErrorKind::BrokenPipe),
                sent => {
                    let mut heard = [0; 32];
                    let length = (&pairs[i].1).read(&mut heard).unwrap();
                    assert_eq!(sent.unwrap(), length);
                    assert_eq!(&heard[..length], chunks[i].as_bytes());
                }
            }
        }
    }
}
