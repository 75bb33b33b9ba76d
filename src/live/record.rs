//! How is what happens in scenes kept? In one file that only grows, by one thread, so that no scene waits for a disk.
//!
//! The file begins with `BVRE` and a version; then come blocks: the length of a zstd frame with a checksum, and the frame. A
//! block holds the name of a scene and whole entries of its journal (`belvedere_live::journal`), about one tick of it. Whatever
//! ends the program, at most the last block is damaged; it is cut off when the file is opened again. A file that is damaged
//! further ahead is not gone on with.

use std::{
    fs::{File, TryLockError},
    io::{self, Read, Seek, SeekFrom, Write},
    path::Path,
    time::Duration,
};

use belvedere_scene::SceneName;
use tokio::sync::{mpsc, oneshot};

const MAGIC: [u8; 6] = *b"BVRE\x04\x00";
/// A block may take so much, packed or not.
const MOST_BYTES: usize = 256 << 20;
/// So many blocks may wait for the disk before scenes do.
const BLOCKS: usize = 256;
/// Fast; the text of poses shrinks to a seventh all the same.
const LEVEL: i32 = 1;

/// Where scenes hand in what has happened. Cheap to clone.
#[derive(Debug, Clone)]
pub struct Recorder {
    jobs: mpsc::Sender<Job>,
}

#[derive(Debug)]
enum Job {
    Write(String),
    /// Says when everything before is written.
    Flush(oneshot::Sender<()>),
}

/// Why there is no recording.
#[derive(Debug, thiserror::Error)]
pub enum RecordingError {
    /// The file cannot be used.
    #[error(transparent)]
    Io(#[from] io::Error),
    /// Another server goes on with it.
    #[error("another server is recording into it; give each a file of its own")]
    InUse,
    /// It is something else.
    #[error("it is no recording of this version")]
    Other,
    /// More follows what is damaged.
    #[error(
        "the block at byte {at_bytes} is damaged and more follows it; record into another file, or cut this one there if what \
         follows may be lost"
    )]
    Damaged {
        /// Up to here it is whole.
        at_bytes: u64,
    },
}

/// A block: a scene, and entries of its journal, two lines each.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Block {
    /// Where it happened.
    pub scene: String,
    /// What.
    pub entries: String,
}

/// Reads a recording from its begin, block by block, as far as it is whole.
#[derive(Debug)]
pub struct Recording<R> {
    file: R,
    /// Up to here it is whole.
    whole_bytes: u64,
}

impl Recorder {
    /// Goes on with a recording, or begins one.
    ///
    /// # Errors
    /// When the file cannot be written, is something else, or is damaged and not just cut off.
    pub fn open(path: &Path) -> Result<Self, RecordingError> {
        let mut opening = File::options();
        opening.read(true).write(true).create(true).truncate(false);
        // It holds where everybody is, of private scenes too.
        #[cfg(unix)]
        std::os::unix::fs::OpenOptionsExt::mode(&mut opening, 0o600);
        let mut file = opening.open(path)?;
        lock(&file)?;
        if is_cut_in_its_magic(&mut file)? {
            file.set_len(0)?;
            file.rewind()?;
            file.write_all(&MAGIC)?;
        } else {
            file.rewind()?;
            let mut recording = Recording::open(io::BufReader::new(&file))?;
            while recording.next_block()?.is_some() {}
            let whole_bytes = recording.whole_bytes;
            file.seek(SeekFrom::Start(whole_bytes))?;
            check_end(&mut file, whole_bytes)?;
            file.set_len(whole_bytes)?;
            file.seek(SeekFrom::Start(whole_bytes))?;
        }
        #[cfg(unix)]
        if let Err(error) = keep_from_others(&file) {
            tracing::warn!(%error, "others may read what is recorded");
        }
        let (jobs, waiting) = mpsc::channel(BLOCKS);
        std::thread::spawn(move || {
            if let Err(error) = write_all(file, waiting) {
                tracing::error!(%error, "nothing is recorded any more");
            }
        });
        Ok(Self { jobs })
    }

    /// Whether a file begins as a recording does that can be gone on with, or holds nothing yet; it stays as it is.
    ///
    /// # Errors
    /// When it cannot be read, or is something else.
    pub fn could_go_on(path: &Path) -> Result<(), RecordingError> {
        let mut file = File::open(path)?;
        if is_cut_in_its_magic(&mut file)? {
            return Ok(());
        }
        file.rewind()?;
        Recording::open(file).map(drop)
    }

    /// Keeps entries of a scene's journal.
    pub(super) async fn write(&self, scene: &SceneName, entries: String) {
        // Whoever cannot write any more has said so.
        _ = self.jobs.send(Job::Write(format!("{scene}\n{entries}"))).await;
    }

    /// Waits until everything so far is written.
    pub async fn flush(&self) {
        let (done, written) = oneshot::channel();
        if self.jobs.send(Job::Flush(done)).await.is_ok() {
            _ = written.await;
        }
    }
}

fn write_all(mut file: File, mut waiting: mpsc::Receiver<Job>) -> io::Result<()> {
    let mut compressor = zstd::bulk::Compressor::new(LEVEL)?;
    compressor.include_checksum(true)?;
    while let Some(job) = waiting.blocking_recv() {
        match job {
            Job::Write(text) => {
                if text.len() > MOST_BYTES {
                    return Err(io::Error::other(format!("a block takes more than {MOST_BYTES} bytes")));
                }
                let frame = compressor.compress(text.as_bytes())?;
                let length = u32::try_from(frame.len()).map_err(io::Error::other)?;
                // One write, so that a block is there or not as far as the system can help it.
                file.write_all(&[&length.to_le_bytes()[..], &frame].concat())?;
            }
            Job::Flush(done) => {
                file.sync_data()?;
                _ = done.send(());
            }
        }
    }
    Ok(())
}

impl<R: Read> Recording<R> {
    /// Begins to read.
    ///
    /// # Errors
    /// When it cannot be read, or is something else.
    pub fn open(mut file: R) -> Result<Self, RecordingError> {
        let mut magic = [0; MAGIC.len()];
        match file.read_exact(&mut magic) {
            Err(error) if error.kind() == io::ErrorKind::UnexpectedEof => return Err(RecordingError::Other),
            read => read?,
        }
        let whole_bytes = MAGIC.len() as u64;
        let known = magic == MAGIC;
        known.then_some(Self { file, whole_bytes }).ok_or(RecordingError::Other)
    }

    /// The next block; none at the end of what is whole.
    ///
    /// # Errors
    /// When the file cannot be read.
    pub fn next_block(&mut self) -> Result<Option<Block>, RecordingError> {
        let mut length = [0; 4];
        if !self.fill(&mut length)? {
            return Ok(None);
        }
        let length = u32::from_le_bytes(length) as usize;
        if length > MOST_BYTES {
            return Ok(None);
        }
        let mut frame = Vec::new();
        (&mut self.file).take(length as u64).read_to_end(&mut frame)?;
        let text = (frame.len() == length).then(|| unpack(&frame)).flatten();
        let block = text.and_then(|text| {
            let (scene, entries) = text.split_once('\n')?;
            Some(Block {
                scene: scene.to_owned(),
                entries: entries.to_owned(),
            })
        });
        if block.is_some() {
            self.whole_bytes += 4 + length as u64;
        }
        Ok(block)
    }

    /// After the last block: whether that was the end, or but for a block that was not written to its end.
    ///
    /// # Errors
    /// When more follows what is damaged, or the file cannot be read.
    pub fn check_end(&mut self) -> Result<(), RecordingError>
    where
        R: Seek,
    {
        self.file.seek(SeekFrom::Start(self.whole_bytes))?;
        check_end(&mut self.file, self.whole_bytes)
    }

    /// How many bytes were whole so far.
    pub fn whole_bytes(&self) -> u64 {
        self.whole_bytes
    }

    /// Whether there was as much left.
    fn fill(&mut self, buffer: &mut [u8]) -> io::Result<bool> {
        match self.file.read_exact(buffer) {
            Err(error) if error.kind() == io::ErrorKind::UnexpectedEof => Ok(false),
            read => read.map(|()| true),
        }
    }
}

/// Keeps other servers from writing in between, as long as the file is open. One that has just ended may take a moment.
fn lock(file: &File) -> Result<(), RecordingError> {
    const TRIES: u32 = 50;
    const BETWEEN: Duration = Duration::from_millis(20);
    for _ in 0..TRIES {
        match file.try_lock() {
            Ok(()) => return Ok(()),
            Err(TryLockError::WouldBlock) => std::thread::sleep(BETWEEN),
            Err(TryLockError::Error(error)) => return Err(error.into()),
        }
    }
    Err(RecordingError::InUse)
}

/// Takes from all but the owner what they may do with a file that was there before.
#[cfg(unix)]
fn keep_from_others(file: &File) -> io::Result<()> {
    use std::os::unix::fs::PermissionsExt;
    let mut permissions = file.metadata()?.permissions();
    if permissions.mode() & 0o077 == 0 {
        return Ok(());
    }
    permissions.set_mode(permissions.mode() & 0o700);
    file.set_permissions(permissions)
}

/// Refuses what follows the last whole block, unless it is one that was not written to its end.
fn check_end(file: &mut impl Read, at_bytes: u64) -> Result<(), RecordingError> {
    if is_cut_off(file)? {
        Ok(())
    } else {
        Err(RecordingError::Damaged { at_bytes })
    }
}

/// Whether nothing was written yet, or not even as much as says what the file is.
fn is_cut_in_its_magic(file: &mut File) -> io::Result<bool> {
    let mut begin = Vec::new();
    file.take(MAGIC.len() as u64).read_to_end(&mut begin)?;
    Ok(begin.len() < MAGIC.len() && MAGIC.starts_with(&begin))
}

/// Whether a file ends, from here on, with no more than a block that was not written to its end.
fn is_cut_off(file: &mut impl Read) -> io::Result<bool> {
    let mut rest = Vec::new();
    file.take(4 + MOST_BYTES as u64).read_to_end(&mut rest)?;
    let Some((length, frame)) = rest.split_first_chunk::<4>() else {
        return Ok(true);
    };
    let length = u32::from_le_bytes(*length) as usize;
    // Some systems make a file longer before they write into it.
    let unwritten = rest.iter().all(|byte| *byte == 0);
    let reaches_the_end = (frame.len()..=MOST_BYTES).contains(&length);
    // A frame that is whole all the same says that its length is what is damaged.
    let is_shorter = length > frame.len() && begins_whole(frame);
    Ok(unwritten || reaches_the_end && !is_shorter)
}

/// Whether bytes begin with a whole frame.
fn begins_whole(bytes: &[u8]) -> bool {
    let decoder = zstd::stream::read::Decoder::with_buffer(bytes).map(|decoder| decoder.single_frame());
    decoder.is_ok_and(|decoder| text_of(decoder).is_some())
}

fn unpack(frame: &[u8]) -> Option<String> {
    text_of(zstd::stream::read::Decoder::new(frame).ok()?)
}

/// None where there is more than a block may hold.
fn text_of(decoder: impl Read) -> Option<String> {
    let mut text = String::new();
    decoder.take(MOST_BYTES as u64 + 1).read_to_string(&mut text).ok()?;
    (text.len() <= MOST_BYTES).then_some(text)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn blocks(path: &Path) -> Vec<Block> {
        let mut recording = Recording::open(File::open(path).unwrap()).unwrap();
        std::iter::from_fn(|| recording.next_block().unwrap()).collect()
    }

    async fn record(path: &Path, entries: &[&str]) {
        let recorder = Recorder::open(path).unwrap();
        for entry in entries {
            recorder.write(&"row".parse().unwrap(), (*entry).to_owned()).await;
        }
        recorder.flush().await;
    }

    #[tokio::test]
    async fn nobody_records_into_a_file_that_somebody_records_into() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.rec");
        let first = Recorder::open(&path).unwrap();
        assert!(matches!(Recorder::open(&path), Err(RecordingError::InUse)));
        drop(first);
        Recorder::open(&path).unwrap();
    }

    #[tokio::test]
    async fn whatever_is_cut_off_what_is_whole_is_read_and_gone_on_with() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.rec");
        record(&path, &["one\n", "two\n"]).await;
        let all = std::fs::read(&path).unwrap();
        let whole: Vec<_> = blocks(&path)
            .into_iter()
            .map(|block| (block.scene, block.entries))
            .collect();
        assert_eq!(
            whole,
            [("row".into(), "one\n".into()), ("row".into(), "two\n".to_owned())]
        );
        for end in 0..all.len() {
            std::fs::write(&path, &all[..end]).unwrap();
            let before = if end < MAGIC.len() { vec![] } else { blocks(&path) };
            record(&path, &["three\n"]).await;
            let after = blocks(&path);
            assert_eq!(
                (&after[..before.len()], after.len()),
                (&before[..], before.len() + 1),
                "{end}"
            );
            assert_eq!(after.last().unwrap().entries, "three\n");
        }
        let last = all.len() - 5;
        let flipped: Vec<_> = all
            .iter()
            .enumerate()
            .map(|(i, byte)| byte ^ u8::from(i == last))
            .collect();
        std::fs::write(&path, flipped).unwrap();
        assert_eq!(blocks(&path).len(), 1, "its checksum is wrong");
    }

    #[tokio::test]
    async fn what_is_damaged_before_its_last_block_is_left_alone() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.rec");
        record(&path, &["one\n"]).await;
        let first_bytes = std::fs::metadata(&path).unwrap().len() as usize;
        record(&path, &["two\n"]).await;
        let all = std::fs::read(&path).unwrap();
        for bit in 8 * MAGIC.len()..8 * first_bytes {
            let mut damaged = all.clone();
            damaged[bit / 8] ^= 1 << (bit % 8);
            std::fs::write(&path, &damaged).unwrap();
            if blocks(&path).len() == 2 {
                // Some bits of a frame's header mean nothing.
                continue;
            }
            let refused = Recorder::open(&path).map(drop);
            let at_bytes = MAGIC.len() as u64;
            assert!(
                matches!(refused, Err(RecordingError::Damaged { at_bytes: at }) if at == at_bytes),
                "{bit}: {refused:?}"
            );
            assert_eq!(std::fs::read(&path).unwrap(), damaged, "{bit}");
            let mut read = Recording::open(File::open(&path).unwrap()).unwrap();
            while read.next_block().unwrap().is_some() {}
            assert!(matches!(read.check_end(), Err(RecordingError::Damaged { .. })), "{bit}");
        }
    }

    #[cfg(unix)]
    #[tokio::test]
    async fn a_recording_is_its_owners_alone() {
        use std::os::unix::fs::PermissionsExt;
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.rec");
        record(&path, &["one\n"]).await;
        let mode = |path: &Path| std::fs::metadata(path).unwrap().permissions().mode() & 0o777;
        let open_up = |path: &Path, mode| std::fs::set_permissions(path, PermissionsExt::from_mode(mode)).unwrap();
        assert_eq!(mode(&path), 0o600);
        for before in [0o644, 0o640, 0o622] {
            open_up(&path, before);
            record(&path, &["more\n"]).await;
            assert_eq!(mode(&path), 0o600, "{before:o}");
        }
        assert_eq!(blocks(&path).len(), 4);
        let other = folder.path().join("a.txt");
        std::fs::write(&other, "no recording at all").unwrap();
        open_up(&other, 0o644);
        Recorder::open(&other).map(drop).unwrap_err();
        assert_eq!(mode(&other), 0o644, "it is left alone");
    }

    #[test]
    fn what_is_no_recording_is_left_alone() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.txt");
        for text in ["no", "no recording at all"] {
            std::fs::write(&path, text).unwrap();
            assert!(matches!(Recorder::open(&path), Err(RecordingError::Other)));
            assert_eq!(std::fs::read_to_string(&path).unwrap(), text);
        }
    }
}
