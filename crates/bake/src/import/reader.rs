//! Which bytes does a buffer view name? Buffers are loaded once, on demand; views are checked against them.
//!
//! A view past the end of its buffer is cut off there and counted, so whatever reads it sees only real bytes.

use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::Arc;

use serde_json::Value;

use super::compression::meshopt_view;
use super::document::Item;
use super::error::{Flaw, Read, Trouble, flaw};
use super::limits::Budget;
use super::uri::{Target, target};
use super::{FileError, ImportError, SourceFiles};
use crate::defect::Defects;

/// The kind of defect when the file of a buffer cannot be read.
pub(super) const NO_BUFFER_FILE: &str = "file of a buffer missing: left out with what needs it";

/// A shared run of bytes.
#[derive(Debug, Clone)]
pub(super) struct Bytes {
    data: Arc<Vec<u8>>,
    range: Range<usize>,
}

impl Bytes {
    /// All of `data`.
    pub(super) fn new(data: Vec<u8>) -> Self {
        let range = 0..data.len();
        Self {
            data: Arc::new(data),
            range,
        }
    }

    /// A part of it, cut off at its end.
    pub(super) fn slice(&self, range: Range<usize>) -> Self {
        let clamp = |at: usize| self.range.start.saturating_add(at).min(self.range.end);
        let start = clamp(range.start);
        Self {
            data: Arc::clone(&self.data),
            range: start..clamp(range.end).max(start),
        }
    }

    /// The bytes.
    pub(super) fn as_slice(&self) -> &[u8] {
        &self.data[self.range.clone()]
    }
}

/// Everything that reading a document needs.
pub(super) struct Reader<'a> {
    /// The document.
    pub(super) root: Item<'a>,
    /// What may still be claimed.
    pub(super) budget: Budget,
    /// What was wrong so far.
    pub(super) defects: Defects,
    pub(super) files: &'a dyn SourceFiles,
    bin: Option<Bytes>,
    buffers: BTreeMap<usize, Result<Bytes, Flaw>>,
    decompressed: BTreeMap<usize, Result<Bytes, Flaw>>,
}

impl<'a> Reader<'a> {
    /// Reads `document`; `bin` is the binary chunk of its GLB.
    pub(super) fn new(document: &'a Value, bin: Option<Bytes>, files: &'a dyn SourceFiles, budget: Budget) -> Self {
        Self {
            root: Item::root(document),
            budget,
            defects: Defects::default(),
            files,
            bin,
            buffers: BTreeMap::new(),
            decompressed: BTreeMap::new(),
        }
    }

    /// Counts a flaw and goes on without the thing that has it.
    pub(super) fn settle<T>(&mut self, read: Read<T>) -> Result<Option<T>, ImportError> {
        match read {
            Ok(value) => Ok(Some(value)),
            Err(Trouble::Fatal(error)) => Err(error),
            Err(Trouble::Flaw(flaw)) => {
                self.defects.note(flaw.kind, 1, || flaw.place);
                Ok(None)
            }
        }
    }

    /// The bytes of a buffer view, decompressed, and its stride.
    pub(super) fn view(&mut self, index: usize) -> Read<(Bytes, Option<usize>)> {
        let view = self.root.listed("bufferViews", index)?;
        let compressed = view
            .extension("EXT_meshopt_compression")
            .or_else(|| view.extension("KHR_meshopt_compression"));
        let stride = view.index("byteStride")?;
        if let Some(compression) = compressed {
            let bytes = match self.decompressed.get(&index) {
                Some(known) => known.clone(),
                None => {
                    let read = keep_flaw(meshopt_view(self, &compression))?;
                    self.decompressed.insert(index, read.clone());
                    read
                }
            }?;
            return Ok((bytes, stride.or(compression.index("byteStride")?)));
        }
        Ok((self.buffer_part(&view)?, stride))
    }

    /// The part of a buffer that `buffer`, `byteOffset` and `byteLength` name.
    pub(super) fn buffer_part(&mut self, view: &Item) -> Read<Bytes> {
        let buffer = view.needed("buffer")?.as_index()?;
        let start = view.index("byteOffset")?.unwrap_or(0);
        let length = view.needed("byteLength")?.as_index()?;
        let bytes = self.buffer(buffer)?;
        let part = bytes.slice(start..start.saturating_add(length));
        let there = part.as_slice().len();
        if there < length {
            self.defects
                .note("buffer view past the end of its buffer: cut off there", 1, || {
                    format!("{}: {length} bytes from {start}, {there} of them there", view.place)
                });
        }
        Ok(part)
    }

    /// A file or data URI, or a flaw of the given kind when it is not there. Claims its size.
    pub(super) fn load(&mut self, uri: &str, place: &str, missing: &'static str) -> Read<Vec<u8>> {
        match target(uri) {
            Target::Outside => Err(Trouble::Fatal(ImportError::UriLeavesFolder {
                place: place.to_owned(),
                uri: shorten(uri).to_owned(),
            })),
            Target::Data(data) => {
                self.budget.claim(data.max_bytes(), 1, || place.to_owned())?;
                data.decode()
                    .map_or_else(|| flaw("data URI that cannot be decoded: left out", place), Ok)
            }
            Target::File(path) => {
                let max_bytes = self.budget.left_bytes();
                match self.files.read(&path, max_bytes) {
                    Ok(bytes) => {
                        self.budget.claim(bytes.len(), 1, || place.to_owned())?;
                        Ok(bytes)
                    }
                    Err(FileError::TooLarge(bytes)) => Err(self
                        .budget
                        .refusal(format!("{place}: \"{path}\""), bytes.saturating_add(1))
                        .into()),
                    Err(error) => flaw(missing, format!("{place} \"{path}\": {error}")),
                }
            }
        }
    }

    fn buffer(&mut self, index: usize) -> Read<Bytes> {
        if let Some(known) = self.buffers.get(&index) {
            return Ok(known.clone()?);
        }
        let read = keep_flaw(self.load_buffer(index))?;
        self.buffers.insert(index, read.clone());
        Ok(read?)
    }

    fn load_buffer(&mut self, index: usize) -> Read<Bytes> {
        let buffer = self.root.listed("buffers", index)?;
        let bytes = match (buffer.text("uri")?, &self.bin) {
            (Some(uri), _) => Bytes::new(self.load(uri, &buffer.place, NO_BUFFER_FILE)?),
            (None, Some(bin)) if index == 0 => bin.clone(),
            (None, _) => {
                return flaw(
                    "buffer missing: left out with what needs it",
                    format!("{}: it has no uri and no binary chunk", buffer.place),
                );
            }
        };
        let (claimed, there) = (buffer.index("byteLength")?.unwrap_or(0), bytes.as_slice().len());
        self.defects.note(
            "buffer shorter than it says: read as far as it goes",
            u64::from(there < claimed),
            || format!("{}: {there} of {claimed} bytes", buffer.place),
        );
        Ok(bytes)
    }
}

/// Separates what can be remembered from what stops the import.
fn keep_flaw<T>(read: Read<T>) -> Result<Result<T, Flaw>, ImportError> {
    match read {
        Ok(value) => Ok(Ok(value)),
        Err(Trouble::Flaw(flaw)) => Ok(Err(flaw)),
        Err(Trouble::Fatal(error)) => Err(error),
    }
}

/// Enough of a URI to find it.
pub(super) fn shorten(uri: &str) -> &str {
    uri.char_indices().nth(200).map_or(uri, |(end, _)| &uri[..end])
}
