//! What has come of an answer that is still on its way? Its bytes so far, unpacked, any part of which can be taken out before the
//! rest is here.

use std::io::{self, Write};

use bytes::Bytes;
use flate2::write::GzDecoder;

use crate::Error;

/// No document is larger than this once it is unpacked.
const MOST_DOCUMENT_BYTES: usize = 256 << 20;

/// One answer, piece after piece.
pub(super) struct Incoming<'a> {
    path: &'a str,
    body: Body,
    /// What the line has carried of it.
    pub(super) carried: u64,
}

enum Body {
    Plain(Vec<u8>),
    Packed(Box<GzDecoder<Vec<u8>>>),
}

impl<'a> Incoming<'a> {
    pub(super) fn new(path: &'a str, is_packed: bool) -> Self {
        Self {
            path,
            body: match is_packed {
                true => Body::Packed(Box::new(GzDecoder::new(Vec::new()))),
                false => Body::Plain(Vec::new()),
            },
            carried: 0,
        }
    }

    pub(super) fn push(&mut self, piece: &[u8]) -> Result<(), Error> {
        self.carried += piece.len() as u64;
        match &mut self.body {
            Body::Plain(bytes) => bytes.extend_from_slice(piece),
            Body::Packed(unpacks) => unpack(self.path, unpacks, piece)?,
        }
        Ok(())
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

fn unpack(path: &str, unpacks: &mut GzDecoder<Vec<u8>>, mut piece: &[u8]) -> Result<(), Error> {
    while !piece.is_empty() {
        // Of a piece that unpacks to very much, only so much is taken in at once.
        let taken = unpacks.write(piece).map_err(|cause| garbled(path, &cause))?;
        if unpacks.get_ref().len() > MOST_DOCUMENT_BYTES {
            return Err(Error::Document {
                path: path.to_owned(),
                cause: format!("it has more than {MOST_DOCUMENT_BYTES} bytes"),
            });
        }
        if taken == 0 {
            // What follows its end is nothing of it.
            break;
        }
        piece = &piece[taken..];
    }
    unpacks.flush().map_err(|cause| garbled(path, &cause))
}

fn garbled(path: &str, cause: &io::Error) -> Error {
    Error::Garbled {
        path: path.to_owned(),
        cause: format!("its gzip does not unpack: {cause}"),
    }
}
