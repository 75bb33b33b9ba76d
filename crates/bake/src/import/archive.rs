//! Which glTF file does a zip archive hold, and what are the files beside it?
//!
//! Nothing is unpacked before it is asked for. Declared sizes are not trusted: inflating stops at the limit. An archive
//! with an entry that points outside of it, or with an encrypted one, is refused as a whole.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::io::{Cursor, Read as _};

use zip::ZipArchive;
use zip::result::ZipError;

use super::uri::relative_path;
use super::{FileError, ImportError, SourceFiles};

/// A zip archive with one glTF file in it; paths are relative to that file.
pub(super) struct Archive {
    zip: RefCell<ZipArchive<Cursor<Vec<u8>>>>,
    entries: BTreeMap<String, usize>,
    /// The path of the glTF file.
    main: String,
}

impl Archive {
    /// Reads the directory of the archive and finds its glTF file.
    pub(super) fn open(bytes: Vec<u8>) -> Result<Self, ImportError> {
        let refused = |what: String| ImportError::Zip(what);
        let whole = bytes.len();
        // Its directory stands at its end.
        let mut zip = ZipArchive::new(Cursor::new(bytes)).map_err(|e| {
            refused(format!(
                "{e}; it ends at byte {whole}: if it was cut off on its way, send it again, whole"
            ))
        })?;
        let mut entries = BTreeMap::new();
        for index in 0..zip.len() {
            let entry = zip.by_index_raw(index).map_err(|e| refused(e.to_string()))?;
            let name = entry.name().map_err(|e| refused(e.to_string()))?.into_owned();
            if entry.encrypted() {
                return Err(refused(format!(
                    "entry \"{name}\" is encrypted: pack it without a password"
                )));
            }
            let path = relative_path(&name).map_err(|_| {
                refused(format!(
                    "entry \"{name}\" leaves the archive: pack it with relative paths"
                ))
            })?;
            if !entry.is_dir() {
                entries.insert(path, index);
            }
        }
        let candidates: Vec<&String> = entries.keys().filter(|path| is_gltf(path)).collect();
        let main = match candidates[..] {
            [main] => main.clone(),
            [] => return Err(refused("there is no .gltf or .glb file in it".into())),
            [first, second, ..] => {
                return Err(refused(format!(
                    "there are {} glTF files in it (\"{first}\", \"{second}\" …): pack one",
                    candidates.len()
                )));
            }
        };
        Ok(Self {
            zip: RefCell::new(zip),
            entries,
            main,
        })
    }

    /// The path of the glTF file in the archive.
    pub(super) fn main_path(&self) -> &str {
        &self.main
    }

    /// The glTF file.
    pub(super) fn read_main(&self, max_bytes: u64) -> Result<Vec<u8>, ImportError> {
        self.inflate(&self.main, max_bytes)
            .map_err(|e| ImportError::Zip(format!("entry \"{}\": {e}", self.main)))
    }

    fn inflate(&self, path: &str, max_bytes: u64) -> Result<Vec<u8>, FileError> {
        let index = *self.entries.get(path).ok_or(FileError::Missing)?;
        let mut zip = self.zip.borrow_mut();
        let entry = zip.by_index(index).map_err(|e| match e {
            ZipError::CompressionMethodNotSupported(method) => FileError::Io(format!(
                "compression method {method} is not supported: pack it with deflate"
            )),
            other => FileError::Io(other.to_string()),
        })?;
        if entry.size() > max_bytes {
            return Err(FileError::TooLarge(max_bytes));
        }
        let mut bytes = Vec::new();
        entry
            .take(max_bytes.saturating_add(1))
            .read_to_end(&mut bytes)
            .map_err(|e| FileError::Io(e.to_string()))?;
        if bytes.len() as u64 > max_bytes {
            return Err(FileError::TooLarge(max_bytes));
        }
        Ok(bytes)
    }
}

impl SourceFiles for Archive {
    fn read(&self, relative: &str, max_bytes: u64) -> Result<Vec<u8>, FileError> {
        match self.main.rsplit_once('/') {
            Some((folder, _)) => self.inflate(&format!("{folder}/{relative}"), max_bytes),
            None => self.inflate(relative, max_bytes),
        }
    }
}

/// Whether a path names a glTF file. What macOS puts beside each file (`__MACOSX/._x.gltf`) does not count.
fn is_gltf(path: &str) -> bool {
    let name = path.rsplit('/').next().unwrap_or(path);
    let extension = name.rsplit_once('.').map_or("", |(_, e)| e);
    !name.starts_with('.')
        && !path.starts_with("__MACOSX/")
        && (extension.eq_ignore_ascii_case("gltf") || extension.eq_ignore_ascii_case("glb"))
}

#[cfg(test)]
mod tests {
    use std::io::Write as _;

    use zip::write::SimpleFileOptions;

    use super::super::testing::{Gltf, import_bytes};
    use super::*;

    fn pack(entries: &[(&str, &[u8])]) -> Vec<u8> {
        let mut writer = zip::ZipWriter::new(Cursor::new(Vec::new()));
        for (name, bytes) in entries {
            writer.start_file(*name, SimpleFileOptions::default()).unwrap();
            writer.write_all(bytes).unwrap();
        }
        writer.finish().unwrap().into_inner()
    }

    fn refusal(bytes: Vec<u8>) -> String {
        import_bytes("x.zip", bytes).map(|_| ()).unwrap_err().to_string()
    }

    #[test]
    fn a_gltf_in_a_subfolder_finds_its_files_beside_it() {
        let (json, bin) = Gltf::triangle().with_file("a b.bin");
        let packed = pack(&[
            ("readme.txt", b"x"),
            ("in/scene.gltf", &json),
            ("in/a b.bin", &bin),
            ("__MACOSX/in/._scene.gltf", b"x"),
        ]);
        assert_eq!(import_bytes("x.zip", packed).unwrap().scene.objects.len(), 1);
        let packed = pack(&[("scene.GLB", &Gltf::triangle().glb())]);
        assert_eq!(import_bytes("x.zip", packed).unwrap().scene.objects.len(), 1);
    }

    #[test]
    fn archives_that_cannot_be_meant_are_refused_with_the_reason() {
        let glb = Gltf::triangle().glb();
        for (entries, reason) in [
            (&[("a.txt", &b"x"[..])][..], "no .gltf or .glb"),
            (
                &[("a.glb", &glb), ("b/c.gltf", &glb)],
                "2 glTF files in it (\"a.glb\", \"b/c.gltf\"",
            ),
            (&[("../a.glb", &glb)], "\"../a.glb\" leaves the archive"),
            (&[("a.glb", &glb), ("/etc/x", b"x")], "\"/etc/x\" leaves the archive"),
            (&[("a.glb", &glb), ("c:\\x", b"x")], "leaves the archive"),
            (&[("a.glb", &pack(&[("b.glb", &glb)]))], "an archive again"),
        ] {
            let refused = refusal(pack(entries));
            assert!(refused.contains(reason), "{refused}");
        }
    }

    #[test]
    fn an_encrypted_entry_is_refused() {
        let mut packed = pack(&[("a.glb", &Gltf::triangle().glb())]);
        let directory = packed.windows(4).rposition(|w| w == b"PK\x01\x02").unwrap();
        packed[directory + 8] |= 1;
        packed[6] |= 1;
        assert!(refusal(packed).contains("encrypted"));
    }

    #[test]
    fn a_bomb_is_stopped_at_the_limit_whatever_it_declares() {
        let zeros = vec![0; 1 << 20];
        let mut packed = pack(&[("a.gltf", &zeros)]);
        let open = |packed: &Vec<u8>| {
            Archive::open(packed.clone())
                .unwrap()
                .read_main(1000)
                .unwrap_err()
                .to_string()
        };
        assert!(open(&packed).contains("larger than 1000 bytes"));
        // Now it declares to be small.
        let directory = packed.windows(4).rposition(|w| w == b"PK\x01\x02").unwrap();
        packed[directory + 24..directory + 28].copy_from_slice(&500u32.to_le_bytes());
        open(&packed);
    }

    #[test]
    fn a_truncated_archive_is_refused_at_every_length() {
        let packed = pack(&[("a.glb", &Gltf::triangle().glb())]);
        for end in 4..packed.len() {
            let refused = refusal(packed[..end].to_vec());
            assert!(
                refused.contains(&format!("ends at byte {end}")) && refused.contains("again, whole"),
                "{refused}"
            );
        }
    }

    #[test]
    fn a_glb_that_was_cut_off_before_it_was_packed_is_named() {
        let glb = Gltf::triangle().glb();
        let refused = refusal(pack(&[("in/a.glb", &glb[..glb.len() - 1])]));
        assert!(
            refused.contains("\"in/a.glb\"") && refused.contains("its header says"),
            "{refused}"
        );
    }
}
