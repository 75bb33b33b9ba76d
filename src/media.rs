//! What is a published file to whoever downloads it: of which kind, and good for how long? The same from the server and from
//! a bucket.

/// Of what is named by its content.
pub(crate) const FOR_EVER: &str = "public, max-age=31536000, immutable";
/// Of what names the current revision.
pub(crate) const CURRENT: &str = "public, max-age=2, stale-while-revalidate=30";
/// Of the page, which names its parts.
pub(crate) const PAGE: &str = "no-cache";

/// The media type of a file, by what its name ends with.
pub(crate) fn kind(name: &str) -> &'static str {
    match name.rsplit_once('.').map_or(name, |(_, ext)| ext) {
        "json" | "map" => "application/json",
        "glb" => "model/gltf-binary",
        "gltf" => "model/gltf+json",
        "cell" => "application/vnd.belvedere.cell",
        "steps" => "application/vnd.belvedere.steps",
        "slod" => "application/vnd.belvedere.slod",
        "pack" => "application/vnd.belvedere.pack",
        "pop" => "application/vnd.belvedere.population",
        "dcg" | "txt" => "text/plain; charset=utf-8",
        "png" => "image/png",
        "jpg" | "jpeg" => "image/jpeg",
        "webp" => "image/webp",
        "avif" => "image/avif",
        "ktx2" => "image/ktx2",
        "html" => "text/html; charset=utf-8",
        "js" | "mjs" => "text/javascript; charset=utf-8",
        "css" => "text/css; charset=utf-8",
        "svg" => "image/svg+xml",
        "ico" => "image/x-icon",
        "woff2" => "font/woff2",
        _ => "application/octet-stream",
    }
}

/// How long a file of a published tree may be kept.
pub(crate) fn life(path: &str) -> &'static str {
    if path.starts_with("o/") || path.starts_with("assets/") {
        FOR_EVER
    } else if path.starts_with("v1/") {
        CURRENT
    } else {
        PAGE
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_say_what_files_are_and_paths_how_long_they_hold() {
        assert_eq!(
            (kind("o/aa.r2.slod"), life("o/aa.r2.slod")),
            ("application/vnd.belvedere.slod", FOR_EVER)
        );
        assert_eq!(
            (kind("index.html"), life("index.html")),
            ("text/html; charset=utf-8", PAGE)
        );
        assert_eq!(
            (kind("json"), kind("LICENSE")),
            ("application/json", "application/octet-stream")
        );
        assert_eq!(life("v1/scenes/index.json"), CURRENT);
    }
}
