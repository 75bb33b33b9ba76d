//! What has come of an answer that is still on its way? Its bytes so far, unpacked, any part of which can be taken out before the
//! rest is here. It may have no more bytes than it is known to have, or than a document may: more are refused as soon as they come, or
//! are announced.

use std::io::{self, Write};

use bytes::Bytes;
use flate2::write::GzDecoder;

use super::{Ask, Carried};
use crate::Error;

/// No document is larger than this once it is unpacked.
const MOST_DOCUMENT_BYTES: u64 = 256 << 20;
/// What does not shrink takes more when it is packed: headers, and a share for each block.
const PACKING_BYTES: u64 = 1 << 10;
const PACKING_SHARE: u64 = 256;

/// One answer, piece after piece.
pub(super) struct Incoming<'a> {
    path: &'a str,
    body: Body,
    /// It may have so many bytes, and take so many on the line.
    most_bytes: u64,
    most_carried: u64,
    /// What the line has carried of it …
    pub(super) carried: u64,
    /// … which somebody may keep count of, whatever becomes of it.
    count: Option<&'a Carried>,
}

enum Body {
    Plain(Vec<u8>),
    Packed(Box<GzDecoder<Vec<u8>>>),
}

impl<'a> Incoming<'a> {
    pub(super) fn new(ask: Ask<'a>, is_packed: bool) -> Self {
        let most_bytes = ask.bytes.unwrap_or(MOST_DOCUMENT_BYTES);
        let (body, most_carried) = if is_packed {
            let unpacks = Box::new(GzDecoder::new(Vec::new()));
            let packing_bytes = PACKING_BYTES + most_bytes / PACKING_SHARE;
            (Body::Packed(unpacks), most_bytes.saturating_add(packing_bytes))
        } else {
            (Body::Plain(Vec::new()), most_bytes)
        };
        Self {
            path: ask.path,
            body,
            most_bytes,
            most_carried,
            carried: 0,
            count: ask.count,
        }
    }

    /// Hears how many bytes the line is to carry.
    pub(super) fn expect(&self, carried: Option<u64>) -> Result<(), Error> {
        self.bound(carried.unwrap_or(0), self.most_carried)
    }

    pub(super) fn push(&mut self, piece: &[u8]) -> Result<(), Error> {
        self.carried += piece.len() as u64;
        if let Some(count) = self.count {
            count.note(piece.len() as u64);
        }
        self.bound(self.carried, self.most_carried)?;
        let mut left = piece;
        while !left.is_empty() {
            left = self.push_some(left)?;
            self.bound_unpacked()?;
        }
        if let Body::Packed(unpacks) = &mut self.body {
            unpacks.flush().map_err(|cause| garbled(self.path, &cause))?;
        }
        self.bound_unpacked()
    }

    /// What unpacks to more than there can be was damaged on the way, or packed wrongly: the line carried no more than it may.
    fn bound_unpacked(&self) -> Result<(), Error> {
        let bounded = self.bound(self.so_far().len() as u64, self.most_bytes);
        match &self.body {
            Body::Plain(_) => bounded,
            Body::Packed(_) => bounded.map_err(|_| Error::Garbled {
                path: self.path.to_owned(),
                cause: format!(
                    "its gzip unpacks to more than the {} bytes that it may have",
                    self.most_bytes
                ),
            }),
        }
    }

    /// Takes in the beginning of a piece; answers with what is left of it.
    fn push_some<'p>(&mut self, piece: &'p [u8]) -> Result<&'p [u8], Error> {
        match &mut self.body {
            Body::Plain(bytes) => {
                bytes.extend_from_slice(piece);
                Ok(&[])
            }
            Body::Packed(unpacks) => {
                // Of a piece that unpacks to very much, only so much is taken in at once.
                let taken = unpacks.write(piece).map_err(|cause| garbled(self.path, &cause))?;
                // What follows its end is nothing of it.
                Ok(if taken == 0 { &[] } else { &piece[taken..] })
            }
        }
    }

    fn bound(&self, bytes: u64, most_bytes: u64) -> Result<(), Error> {
        match bytes <= most_bytes {
            true => Ok(()),
            false => Err(Error::TooLong {
                path: self.path.to_owned(),
                most_bytes: self.most_bytes,
            }),
        }
    }

    /// All that has come.
    pub(super) fn so_far(&self) -> &[u8] {
        match &self.body {
            Body::Plain(bytes) => bytes,
            Body::Packed(unpacks) => unpacks.get_ref(),
        }
    }

    /// The same, when that is all of it.
    pub(super) fn whole(self) -> Result<Bytes, Error> {
        let mut bytes = match self.body {
            Body::Plain(bytes) => bytes,
            Body::Packed(unpacks) => unpacks.finish().map_err(|cause| garbled(self.path, &cause))?,
        };
        // It may be kept for long, and counts as so much.
        bytes.shrink_to_fit();
        Ok(bytes.into())
    }
}

fn garbled(path: &str, cause: &io::Error) -> Error {
    Error::Garbled {
        path: path.to_owned(),
        cause: format!("its gzip does not unpack: {cause}"),
    }
}

#[cfg(test)]
mod tests {
    use flate2::{Compression, write::GzEncoder};

    use super::*;

    /// What comes of a packed answer, of which so many bytes are expected.
    fn unpacked(packed: &[u8], bytes: usize) -> Result<Bytes, Error> {
        let mut incoming = Incoming::new(Ask::of("/o/some.glb").having(Some(bytes as u64)), true);
        incoming.push(packed)?;
        incoming.whole()
    }

    #[test]
    fn a_wrong_bit_in_what_came_packed_is_told_as_damage_of_its_gzip_wherever_it_is() {
        let content = b"what is packed is told again and again, again and again, and what is told is packed";
        let mut packs = GzEncoder::new(Vec::new(), Compression::best());
        packs.write_all(content).expect("memory");
        let packed = packs.finish().expect("memory");
        assert_eq!(unpacked(&packed, content.len()).expect("it is whole"), &content[..]);
        let mut too_much = 0;
        for bit in 0..8 * packed.len() {
            let mut damaged = packed.clone();
            damaged[bit / 8] ^= 1 << (bit % 8);
            match unpacked(&damaged, content.len()) {
                // Some say nothing of what is in it, or the same otherwise.
                Ok(bytes) => assert_eq!(bytes, &content[..], "bit {bit}"),
                Err(Error::Garbled { cause, .. }) => too_much += u32::from(cause.contains("more than the 83 bytes")),
                Err(other) => panic!("bit {bit}: {other}"),
            }
        }
        assert!(too_much > 0, "some unpack to more than was packed");
        let cut = unpacked(&packed[..packed.len() - 9], content.len()).expect_err("it is cut");
        assert!(matches!(cut, Error::Garbled { .. }), "{cut}");
    }
}
