//! What kind of file is this, and where in it are the document and its binary chunk?
//!
//! By content: magic bytes first, the extension only to name what is not read. The GLB container is glTF 2.0, §4.

use std::ops::Range;

use super::ImportError;

/// What a file is, by its first bytes.
#[derive(Debug, PartialEq, Eq)]
pub(super) enum Format {
    /// Binary glTF.
    Glb,
    /// JSON, presumably glTF.
    Json,
    /// A zip archive.
    Zip,
    /// Something else, with its name.
    Other(String),
}

/// Formats that are recognised in order to name them.
const OTHERS: [(&[u8], &str); 20] = [
    (b"#VRML V2.0", "VRML97 (.wrl)"),
    (b"#VRML V1.0", "VRML 1.0 (.wrl)"),
    (b"#X3D", "X3D in classic VRML encoding (.x3dv)"),
    (b"#Inventor", "Open Inventor (.iv)"),
    (b"Kaydara FBX", "FBX (.fbx)"),
    (b"; FBX", "FBX (.fbx)"),
    (b"#usda", "USD (.usda)"),
    (b"PXR-USDC", "USD (.usdc)"),
    (b"BLENDER", "a Blender file (.blend)"),
    (b"ply", "PLY (.ply)"),
    (b"solid ", "STL (.stl)"),
    (b"b3dm", "a 3D Tiles batched model (.b3dm)"),
    (b"i3dm", "a 3D Tiles instanced model (.i3dm)"),
    (b"pnts", "a 3D Tiles point cloud (.pnts)"),
    (b"7z\xBC\xAF", "a 7-Zip archive (.7z)"),
    (b"Rar!", "a RAR archive (.rar)"),
    (b"\x1F\x8B", "a gzip file (.gz)"),
    (b"DRACO", "a bare Draco mesh (.drc)"),
    (b"\x89PNG", "a PNG picture"),
    (b"\xFF\xD8\xFF", "a JPEG picture"),
];

/// Whether a file's name ends so, in whatever case.
pub(super) fn has_ending(file_name: &str, ending: &str) -> bool {
    let found = file_name.rsplit_once('.');
    found.is_some_and(|(_, found)| found.eq_ignore_ascii_case(ending))
}

/// Finds out what a file is.
pub(super) fn detect(file_name: &str, bytes: &[u8]) -> Format {
    if bytes.starts_with(b"glTF") {
        return Format::Glb;
    }
    if bytes.starts_with(b"PK\x03\x04") || bytes.starts_with(b"PK\x05\x06") {
        return Format::Zip;
    }
    let text = without_byte_order_mark(bytes).trim_ascii_start();
    if text.starts_with(b"{") {
        return Format::Json;
    }
    if bytes.is_empty() {
        return Format::Other("an empty file".into());
    }
    if let Some((_, name)) = OTHERS.iter().find(|(magic, _)| text.starts_with(magic)) {
        return Format::Other((*name).into());
    }
    if text.starts_with(b"<") {
        let head = &text[..text.len().min(4096)];
        let has = |tag: &[u8]| head.windows(tag.len()).any(|w| w.eq_ignore_ascii_case(tag));
        let name = match () {
            () if has(b"<X3D") => "X3D (.x3d)",
            () if has(b"<COLLADA") => "COLLADA (.dae)",
            () if has(b"<html") => "an HTML page",
            () => "an XML file",
        };
        return Format::Other(name.into());
    }
    let extension = file_name
        .rsplit_once('.')
        .map_or_else(String::new, |(_, e)| e.to_ascii_lowercase());
    Format::Other(match extension.as_str() {
        "obj" => "Wavefront OBJ (.obj)".into(),
        "stl" => "STL (.stl)".into(),
        "3ds" => "3D Studio (.3ds)".into(),
        "gltf" | "glb" | "zip" => format!("not what its name says: it does not begin as a .{extension} does"),
        "" => "a file of unknown format".into(),
        other => format!("a file of unknown format (.{other})"),
    })
}

/// JSON text may begin with a mark that JSON does not know.
pub(super) fn without_byte_order_mark(bytes: &[u8]) -> &[u8] {
    bytes.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(bytes)
}

/// Where the chunks of a GLB are.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct GlbChunks {
    /// The document.
    pub(super) json: Range<usize>,
    /// The binary chunk, when there is one.
    pub(super) bin: Option<Range<usize>>,
}

/// What to do with a file of which only a part is there.
const CUT_OFF: &str = "it was cut off on its way, or that length is wrong: send or export it again, whole";

/// Finds the chunks of a GLB. One that ends before its header or a chunk says is refused: what is there of it would be taken for all.
pub(super) fn glb_chunks(bytes: &[u8]) -> Result<GlbChunks, ImportError> {
    const JSON: u32 = 0x4E4F_534A;
    const BIN: u32 = 0x004E_4942;
    let word = |at: usize| {
        let four = bytes.get(at..at.checked_add(4)?)?;
        Some(u32::from_le_bytes(four.try_into().ok()?))
    };
    let broken = |what: String| Err(ImportError::Glb(what));
    match word(4) {
        Some(2) => {}
        Some(version) => {
            return Err(ImportError::Version {
                found: format!("{version} (of the GLB container)"),
            });
        }
        None => return broken(format!("it ends at byte {}, inside its header", bytes.len())),
    }
    let (Some(json_bytes), Some(kind)) = (word(12), word(16)) else {
        return broken(format!("it ends at byte {}, before its first chunk", bytes.len()));
    };
    if kind != JSON {
        return broken(format!("its first chunk is of type {kind:#010x}, not JSON"));
    }
    let json = 20..20 + json_bytes as usize;
    if json.end > bytes.len() {
        return broken(format!(
            "it ends at byte {}, inside its JSON chunk, which goes to byte {}; {CUT_OFF}",
            bytes.len(),
            json.end
        ));
    }
    if let Some(whole) = word(8).filter(|whole| *whole as usize > bytes.len()) {
        return broken(format!(
            "it ends at byte {}, and its header says that it has {whole}; {CUT_OFF}",
            bytes.len()
        ));
    }
    // Chunks of unknown type are passed over, as the specification asks.
    let mut at = json.end.next_multiple_of(4);
    while let (Some(chunk_bytes), Some(kind)) = (word(at), word(at + 4)) {
        let start = at + 8;
        let end = start + chunk_bytes as usize;
        if end > bytes.len() {
            return broken(format!(
                "it ends at byte {}, inside its chunk at byte {at}, which goes to byte {end}; {CUT_OFF}",
                bytes.len()
            ));
        }
        if kind == BIN {
            let bin = Some(start..end);
            return Ok(GlbChunks { json, bin });
        }
        at = end.next_multiple_of(4);
    }
    Ok(GlbChunks { json, bin: None })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn formats_are_known_by_content_and_not_by_extension() {
        assert_eq!(detect("x.wrl", b"glTF\x02"), Format::Glb);
        assert_eq!(detect("x.glb", b"\xEF\xBB\xBF \n{}"), Format::Json);
        assert_eq!(detect("x", b"PK\x03\x04"), Format::Zip);
        for (name, bytes, word) in [
            ("a.glb", &b"#VRML V2.0 utf8"[..], "VRML97"),
            ("a", b"<?xml version='1.0'?><X3D>", "X3D"),
            ("a.obj", b"v 0 0 0", "OBJ"),
            ("a.gltf", b"hello", "does not begin as a .gltf"),
            ("a.bin", b"", "empty"),
        ] {
            let Format::Other(found) = detect(name, bytes) else {
                panic!("{name} was taken")
            };
            assert!(found.contains(word), "{found}");
        }
    }

    #[test]
    fn a_glb_is_refused_at_every_length_but_its_own() {
        let mut bytes = b"glTF\x02\0\0\0\x24\0\0\0\x04\0\0\0JSON{}  \x04\0\0\0BIN\0abcd".to_vec();
        let chunks = glb_chunks(&bytes).unwrap();
        assert_eq!((chunks.json, chunks.bin), (20..24, Some(32..36)));
        for end in 4..36 {
            assert!(glb_chunks(&bytes[..end]).is_err(), "accepted {end} bytes");
        }
        let refused = glb_chunks(&bytes[..24]).unwrap_err().to_string();
        assert!(
            refused.contains("ends at byte 24") && refused.contains("it has 36"),
            "{refused}"
        );
        assert!(refused.contains("again, whole"), "{refused}");
        // The header says less than the chunks.
        bytes[8] = 0x20;
        let refused = glb_chunks(&bytes[..34]).unwrap_err().to_string();
        assert!(
            refused.contains("chunk at byte 24") && refused.contains("to byte 36"),
            "{refused}"
        );
        assert_eq!(glb_chunks(&bytes).unwrap().bin, Some(32..36));
    }
}
