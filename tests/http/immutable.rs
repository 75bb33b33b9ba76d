//! Content-addressed objects: caching, encodings, conditions, ranges.

use std::time::Duration;

use belvedere_scene::BlobName;
use proptest::{prelude::*, test_runner::TestRunner};

use crate::{
    scene::{Server, glb},
    wire::{Answer, get, metric, send},
};

fn glb_url() -> String {
    BlobName::of(&glb(), "glb").unwrap().url()
}

#[tokio::test]
async fn a_bundle_is_many_slices_and_objects_in_one_answer_that_lasts() {
    let server = Server::start().await;
    let (bytes, name) = (glb(), BlobName::of(&glb(), "glb").unwrap());
    let url = format!("/o/bundle/{name}@0-4096+{name}+{name}@4096-4097");
    let answer = get(server.address, &url).await;
    assert_eq!(
        (
            answer.status,
            answer.header("content-type"),
            answer.header("cache-control")
        ),
        (
            200,
            Some("application/vnd.belvedere.bundle"),
            Some("public, max-age=31536000, immutable")
        )
    );
    let ends: Vec<u8> = [4096, 24_096, 24_097u32]
        .iter()
        .flat_map(|end| end.to_le_bytes())
        .collect();
    let head = [&b"BVBN\x01\0\x03\0"[..], &ends].concat();
    assert_eq!(
        answer.body,
        [&head[..], &bytes[..4096], &bytes, &bytes[4096..4097]].concat()
    );
    assert_eq!(
        answer.header("content-length"),
        Some(answer.body.len().to_string().as_str())
    );
    let etag = answer.header("etag").unwrap();
    assert_eq!(
        send(server.address, "GET", &url, &[("If-None-Match", etag)])
            .await
            .status,
        304
    );
    let head = send(server.address, "HEAD", &url, &[]).await;
    assert_eq!(
        (head.status, head.body.len(), head.header("etag")),
        (200, 0, Some(etag))
    );

    let absent = BlobName::of(b"absent", "glb").unwrap();
    for (members, status) in [
        (format!("{name}+{absent}"), 404),
        (format!("{name}@0-999999"), 404),
        (format!("{name}+x"), 400),
        (vec![name.to_string(); 65].join("+"), 400),
    ] {
        let problem = get(server.address, &format!("/o/bundle/{members}")).await.problem();
        assert_eq!(problem["status"], status, "{members}");
    }
}

#[tokio::test]
async fn an_object_says_that_it_may_be_kept_for_ever() {
    let server = Server::start().await;
    let answer = get(server.address, &glb_url()).await;
    assert_eq!((answer.status, &answer.body), (200, &glb()));
    let hash = BlobName::of(&glb(), "glb").unwrap().hash();
    for (name, value) in [
        ("cache-control", "public, max-age=31536000, immutable"),
        ("etag", format!("\"{hash}\"").as_str()),
        ("accept-ranges", "bytes"),
        ("content-type", "model/gltf-binary"),
        ("vary", "Accept-Encoding"),
        ("content-length", "20000"),
        ("access-control-allow-origin", "*"),
        ("timing-allow-origin", "*"),
        ("x-content-type-options", "nosniff"),
    ] {
        assert_eq!(answer.header(name), Some(value), "{name}");
    }
    assert_eq!(answer.header("content-encoding"), None);
    assert_eq!(answer.header("content-location"), None);
}

#[tokio::test]
async fn each_encoding_has_its_own_tag_and_decodes_to_the_same_bytes() {
    let server = Server::start().await;
    let zstd = send(server.address, "GET", &glb_url(), &[("Accept-Encoding", "gzip, zstd")]).await;
    assert_eq!(zstd.header("content-encoding"), Some("zstd"));
    assert!(zstd.header("etag").unwrap().ends_with("-zstd\""));
    assert_eq!(zstd::decode_all(zstd.body.as_slice()).unwrap(), glb());
    let gzip = send(server.address, "GET", &glb_url(), &[("Accept-Encoding", "gzip")]).await;
    assert_eq!(gzip.header("content-encoding"), Some("gzip"));
    assert!(gzip.header("etag").unwrap().ends_with("-gzip\""));
    let refused = send(server.address, "GET", &glb_url(), &[("Accept-Encoding", "br, *;q=0")]).await;
    assert_eq!(
        (refused.status, refused.problem()["title"].as_str()),
        (406, Some("No stored encoding is acceptable"))
    );
}

#[tokio::test]
async fn what_the_client_has_is_not_sent_again() {
    let server = Server::start().await;
    for encoding in ["identity", "zstd", "gzip"] {
        let encoding = ("Accept-Encoding", encoding);
        let etag = send(server.address, "GET", &glb_url(), &[encoding])
            .await
            .header("etag")
            .unwrap()
            .to_owned();
        let again = send(server.address, "GET", &glb_url(), &[encoding, ("If-None-Match", &etag)]).await;
        assert_eq!(
            (again.status, again.body.len(), again.header("etag")),
            (304, 0, Some(etag.as_str()))
        );
        assert!(again.header("cache-control").unwrap().contains("immutable"));
        assert_eq!(again.header("vary"), Some("Accept-Encoding"));
    }
    let failed = send(server.address, "GET", &glb_url(), &[("If-Match", "\"other\"")]).await;
    assert_eq!(failed.status, 412);
    failed.problem();
}

#[tokio::test]
async fn head_tells_what_get_would_send() {
    let server = Server::start().await;
    for path in [
        glb_url(),
        "/v1/scenes".to_owned(),
        "/v1/scenes/row/objects/o1".to_owned(),
        "/nothing".to_owned(),
    ] {
        let (whole, head) = (
            get(server.address, &path).await,
            send(server.address, "HEAD", &path, &[]).await,
        );
        assert_eq!(head.status, whole.status, "{path}");
        assert!(head.body.is_empty());
        assert_eq!(
            head.header("content-length"),
            Some(whole.body.len().to_string().as_str()),
            "{path}"
        );
        assert_eq!(head.header("etag"), whole.header("etag"));
    }
}

#[tokio::test]
async fn a_range_is_cut_from_the_identity_while_its_tag_is_right() {
    let server = Server::start().await;
    let etag = get(server.address, &glb_url()).await.header("etag").unwrap().to_owned();
    let range = ("Range", "bytes=10-19");
    let slice = send(
        server.address,
        "GET",
        &glb_url(),
        &[range, ("Accept-Encoding", "zstd"), ("If-Range", &etag)],
    )
    .await;
    assert_eq!((slice.status, slice.body.as_slice()), (206, &glb()[10..20]));
    assert_eq!(slice.header("content-range"), Some("bytes 10-19/20000"));
    assert_eq!(slice.header("content-encoding"), None);
    for stale in ["\"other\"", "Sat, 21 Nov 2026 00:00:00 GMT"] {
        let whole = send(server.address, "GET", &glb_url(), &[range, ("If-Range", stale)]).await;
        assert_eq!((whole.status, whole.body.len()), (200, 20000));
    }
    let outside = send(server.address, "GET", &glb_url(), &[("Range", "bytes=20000-")]).await;
    assert_eq!(
        (outside.status, outside.header("content-range")),
        (416, Some("bytes */20000"))
    );
    outside.problem();
    let malformed = send(server.address, "GET", &glb_url(), &[("Range", "bytes=9-1")]).await;
    assert_eq!(malformed.status, 200);
    let head = send(server.address, "HEAD", &glb_url(), &[range]).await;
    assert_eq!((head.status, head.header("content-length")), (200, Some("20000")));
}

/// The slices of an answer with where they start, whatever form it has.
fn slices(answer: &Answer) -> Vec<(usize, Vec<u8>)> {
    let start = |range: &str| {
        range
            .strip_prefix("bytes ")
            .unwrap()
            .split('-')
            .next()
            .unwrap()
            .parse()
            .unwrap()
    };
    if answer.status == 200 {
        return vec![(0, answer.body.clone())];
    }
    assert_eq!(answer.status, 206);
    let content_type = answer.header("content-type").unwrap();
    let Some(boundary) = content_type.strip_prefix("multipart/byteranges; boundary=") else {
        return vec![(start(answer.header("content-range").unwrap()), answer.body.clone())];
    };
    assert_eq!(answer.header("content-length").unwrap(), answer.body.len().to_string());
    let delimiter = format!("--{boundary}\r\n");
    let mut rest = answer.body.as_slice();
    let mut found = vec![];
    while let Some(part) = rest.strip_prefix(delimiter.as_bytes()) {
        let head_end = part.windows(4).position(|w| w == b"\r\n\r\n").unwrap();
        let head = std::str::from_utf8(&part[..head_end]).unwrap();
        let range = head.split("Content-Range: ").nth(1).unwrap();
        let ends = range
            .strip_prefix("bytes ")
            .unwrap()
            .split('/')
            .next()
            .unwrap()
            .split('-');
        let ends: Vec<usize> = ends.map(|n| n.parse().unwrap()).collect();
        let (body, after) = part[head_end + 4..].split_at(ends[1] + 1 - ends[0]);
        found.push((ends[0], body.to_vec()));
        rest = after.strip_prefix(b"\r\n").unwrap();
    }
    assert_eq!(rest, format!("--{boundary}--\r\n").as_bytes());
    found
}

#[test]
fn any_ranges_are_the_slices_of_the_whole() {
    let runtime = tokio::runtime::Runtime::new().unwrap();
    let server = runtime.block_on(Server::start());
    let whole = glb();
    let spec = prop_oneof![
        (0usize..22_000, 0usize..4000).prop_map(|(first, more)| format!("{first}-{}", first + more)),
        (0usize..22_000).prop_map(|first| format!("{first}-")),
        (0usize..22_000).prop_map(|last| format!("-{last}")),
    ];
    let mut runner = TestRunner::new(ProptestConfig::with_cases(200));
    let outcome = runner.run(&prop::collection::vec(spec, 1..5), |specs| {
        let range = format!("bytes={}", specs.join(","));
        let answer = runtime.block_on(send(server.address, "GET", &glb_url(), &[("Range", &range)]));
        if answer.status == 416 {
            let outside = |spec: &String| {
                spec == "-0"
                    || spec
                        .split('-')
                        .next()
                        .unwrap()
                        .parse()
                        .is_ok_and(|first: usize| first >= whole.len())
            };
            prop_assert!(specs.iter().all(outside), "{range} refused");
            return Ok(());
        }
        for (start, slice) in slices(&answer) {
            prop_assert_eq!(slice.as_slice(), &whole[start..start + slice.len()]);
        }
        Ok(())
    });
    outcome.unwrap();
}

#[tokio::test]
async fn what_is_not_there_and_what_is_damaged_are_told_apart() {
    let server = Server::start().await;
    let unknown = format!("/o/{}.glb", "0".repeat(64));
    for path in [unknown.as_str(), "/o/x", "/o/..%2f..%2fetc%2fpasswd", "/o/"] {
        let answer = get(server.address, path).await;
        assert_eq!(answer.status, 404, "{path}");
        answer.problem();
    }
    let name = BlobName::of(&glb(), "glb").unwrap();
    std::fs::write(server.data.path().join("o").join(name.to_string()), b"damaged").unwrap();
    let answer = get(server.address, &name.url()).await;
    assert_eq!(answer.status, 500);
    assert!(!answer.problem().to_string().contains("damaged"));
}

#[tokio::test]
async fn the_rungs_of_a_smooth_lod_are_its_bytes_and_objects_of_their_own() {
    let server = Server::start().await;
    let whole = include_bytes!("../golden/smooth/bowl.slod");
    let name = BlobName::of(whole, "slod").unwrap();
    server.blobs.put(&name, whole.to_vec().into()).await.unwrap();
    let (header, _) = belvedere_scene::smooth::Header::read(whole).unwrap().unwrap();
    let count = header.cuts.len();
    assert!(count > 2);
    let url = |number: usize| format!("/o/{}.r{number}.slod", name.hash());

    let mut joined = Vec::new();
    // Twice: from the store, and from memory.
    for number in (0..count).chain(0..count) {
        let rung = get(server.address, &url(number)).await;
        for (field, value) in [
            ("cache-control", "public, max-age=31536000, immutable"),
            ("content-type", "application/vnd.belvedere.slod"),
            ("accept-ranges", "bytes"),
            ("etag", format!("\"{}-r{number}\"", name.hash()).as_str()),
        ] {
            assert_eq!(rung.header(field), Some(value), "{field}");
        }
        assert_eq!((rung.status, rung.header("vary")), (200, None));
        joined.extend(rung.body);
    }
    assert_eq!(joined, whole.repeat(2));

    let etag = format!("\"{}-r1\"", name.hash());
    let again = send(server.address, "GET", &url(1), &[("If-None-Match", &etag)]).await;
    assert_eq!((again.status, again.body.len()), (304, 0));
    let slice = send(
        server.address,
        "GET",
        &url(1),
        &[("Range", "bytes=2-4"), ("If-Range", &etag)],
    )
    .await;
    let first = header.cuts[0].bytes as usize + 2;
    assert_eq!((slice.status, slice.body.as_slice()), (206, &whole[first..first + 3]));
    let head = send(server.address, "HEAD", &url(0), &[]).await;
    assert_eq!(
        head.header("content-length"),
        Some(header.cuts[0].bytes.to_string().as_str())
    );

    let beyond = get(server.address, &url(count)).await;
    assert_eq!(beyond.status, 404);
    let detail = beyond.problem()["detail"].as_str().unwrap().to_owned();
    assert!(
        detail.ends_with(&format!("it has {count}, r0 to r{}", count - 1)),
        "{detail}"
    );
    for wrong in ["r00.slod", "r1.glb", "r-1.slod", "r999.slod"] {
        assert_eq!(
            get(server.address, &format!("/o/{}.{wrong}", name.hash())).await.status,
            404
        );
    }
}

#[tokio::test]
async fn a_damaged_variant_keeps_nobody_from_the_object() {
    let server = Server::start().await;
    let name = BlobName::of(&glb(), "glb").unwrap();
    for suffix in ["zst", "gz"] {
        std::fs::write(server.data.path().join(format!("o/{name}.{suffix}")), "no such form").unwrap();
    }
    for fields in [&[("Accept-Encoding", "zstd, gzip")][..], &[]] {
        let answer = send(server.address, "GET", &glb_url(), fields).await;
        assert_eq!((answer.status, answer.header("content-encoding")), (200, None));
        assert_eq!(answer.body, glb());
    }
    let slice = send(server.address, "GET", &glb_url(), &[("Range", "bytes=4-7")]).await;
    assert_eq!((slice.status, &slice.body[..]), (206, &glb()[4..8]));
    let metrics = String::from_utf8(get(server.address, "/metrics").await.body).unwrap();
    assert!(
        metrics.contains("\nbelvedere_blob_variants_damaged_total 2\n"),
        "{metrics}"
    );
}

#[tokio::test]
async fn an_object_that_is_published_and_gone_is_told_of() {
    let server = Server::start().await;
    let name = BlobName::of(&glb(), "glb").unwrap();
    std::fs::remove_file(server.data.path().join(format!("o/{name}"))).unwrap();
    let told = async || metric(server.address, "belvedere_blobs_missing_total").await;
    assert_eq!(told().await, "0");
    // The catalogue is asked beside the answer, and not every time.
    let asking = async {
        while told().await == "0" {
            assert_eq!(get(server.address, &glb_url()).await.status, 404);
            tokio::time::sleep(Duration::from_millis(50)).await;
        }
    };
    tokio::time::timeout(Duration::from_secs(60), asking).await.unwrap();
}

/// What an answer says, whatever its coding.
fn decoded(answer: &Answer) -> Vec<u8> {
    let mut decoded = Vec::new();
    match answer.header("content-encoding") {
        None => decoded.clone_from(&answer.body),
        Some("zstd") => zstd::stream::copy_decode(&answer.body[..], &mut decoded).unwrap(),
        Some("gzip") => {
            std::io::copy(&mut flate2::read::GzDecoder::new(&answer.body[..]), &mut decoded).unwrap();
        }
        Some(other) => panic!("nobody asked for {other}"),
    }
    decoded
}

#[tokio::test]
async fn whichever_form_is_asked_for_no_damage_of_it_is_sent() {
    let server = Server::start().await;
    let mut objects = vec![];
    for i in 0..40u32 {
        // Numerical Recipes' generator, so that encoded forms are large, too.
        let mut state = i;
        let numbers = (0..3000).map(|_| {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 22).to_string()
        });
        let bytes = numbers.collect::<Vec<_>>().join(" ").into_bytes();
        let name = BlobName::of(&bytes, "json").unwrap();
        server.blobs.put(&name, bytes.clone().into()).await.unwrap();
        objects.push((name, bytes));
    }
    let damaged = |i: usize| (!i.is_multiple_of(4)).then_some([("zstd", "zst"), ("gzip", "gz")][i % 2]);
    for (i, (name, _)) in objects.iter().enumerate() {
        if let Some((_, suffix)) = damaged(i) {
            let file = server.data.path().join(format!("o/{name}.{suffix}"));
            let mut stored = std::fs::read(&file).unwrap();
            let at = (100 + i * 31) % stored.len();
            stored[at] ^= 4;
            std::fs::write(file, stored).unwrap();
        }
    }
    for accepted in ["zstd", "gzip", "identity"] {
        for (i, (name, bytes)) in objects.iter().enumerate() {
            let answer = send(server.address, "GET", &name.url(), &[("Accept-Encoding", accepted)]).await;
            assert_eq!(answer.status, 200);
            assert!(decoded(&answer) == *bytes, "{accepted}, {name}");
            let is_whole = damaged(i).is_none_or(|(coding, _)| coding != accepted);
            let expected = Some(accepted).filter(|accepted| is_whole && *accepted != "identity");
            assert_eq!(answer.header("content-encoding"), expected);
            let slice = send(server.address, "GET", &name.url(), &[("Range", "bytes=777-8999")]).await;
            assert_eq!((slice.status, &slice.body[..]), (206, &bytes[777..9000]));
        }
    }
    let metrics = String::from_utf8(get(server.address, "/metrics").await.body).unwrap();
    assert!(
        metrics.contains("\nbelvedere_blob_variants_damaged_total 30\n"),
        "{metrics}"
    );
}
