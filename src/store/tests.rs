use std::path::{Path, PathBuf};

use proptest::prelude::*;

use super::*;

const CACHE_BYTES: u64 = 1 << 20;

async fn store() -> (tempfile::TempDir, BlobStore) {
    let data = tempfile::tempdir().unwrap();
    let store = BlobStore::open_folder(data.path(), CACHE_BYTES).await.unwrap();
    (data, store)
}

fn text(repeats: usize) -> Bytes {
    "a wall hides what stands behind it; ".repeat(repeats).into()
}

/// All forms of a blob, read.
async fn all_forms(store: &BlobStore, name: &BlobName) -> Arc<Representations> {
    let forms = store.forms(name, None).await.unwrap().unwrap();
    for coding in [None].into_iter().chain(Coding::ALL.map(Some)) {
        store.load(name, &forms, coding).await.unwrap();
    }
    forms
}

/// What somebody is sent who takes this coding and the identity, and whether it needed no waiting.
async fn sent(store: &BlobStore, name: &BlobName, coding: Option<Coding>) -> Result<(Bytes, bool), StoreError> {
    let chosen = |forms: &Representations| coding.filter(|coding| forms.has(Some(*coding)));
    if let Some(forms) = store.known(name)
        && let chosen = chosen(&forms)
        && (forms.of(chosen).is_some() || store.load_now(name, &forms, chosen))
    {
        let form = forms.of(chosen).expect("it is in memory");
        return Ok((decoded(chosen, &form.bytes), true));
    }
    let forms = store.forms(name, coding).await?.expect("it is stored");
    loop {
        let chosen = chosen(&forms);
        match forms.of(chosen) {
            Some(form) => return Ok((decoded(chosen, &form.bytes), false)),
            None => store.load(name, &forms, chosen).await?,
        }
    }
}

fn decoded(coding: Option<Coding>, bytes: &[u8]) -> Bytes {
    let mut decoded = Vec::new();
    match coding {
        None => decoded.extend_from_slice(bytes),
        Some(Coding::Zstd) => zstd::stream::copy_decode(bytes, &mut decoded).unwrap(),
        Some(Coding::Gzip) => {
            std::io::copy(&mut flate2::read::GzDecoder::new(bytes), &mut decoded).unwrap();
        }
    }
    decoded.into()
}

fn file_of(data: &tempfile::TempDir, name: &BlobName, coding: Option<Coding>) -> PathBuf {
    let suffix = coding.map_or(String::new(), |coding| format!(".{}", coding.file_suffix()));
    data.path().join("o").join(format!("{name}{suffix}"))
}

fn named(bytes: &Bytes, ext: &str) -> BlobName {
    BlobName::of(bytes, ext).unwrap()
}

#[tokio::test]
async fn a_blob_comes_back_with_variants_that_decode_to_it() {
    let (data, store) = store().await;
    let bytes = text(500);
    let name = named(&bytes, "json");
    assert!(matches!(
        store.put(&name, bytes.clone()).await.unwrap(),
        PutOutcome::Stored { .. }
    ));
    assert_eq!(store.get(&name).await.unwrap().unwrap(), bytes);
    let forms = all_forms(&store, &name).await;
    for coding in [None, Some(Coding::Zstd), Some(Coding::Gzip)] {
        assert_eq!(decoded(coding, &forms.of(coding).unwrap().bytes), bytes);
    }
    for suffix in ["", ".zst", ".gz"] {
        assert!(data.path().join("o").join(format!("{name}{suffix}")).is_file());
    }
}

#[tokio::test]
async fn putting_again_writes_nothing() {
    let (data, store) = store().await;
    let bytes = text(100);
    let name = named(&bytes, "json");
    store.put(&name, bytes.clone()).await.unwrap();
    let modified = || {
        let file = data.path().join("o").join(name.to_string());
        std::fs::metadata(file).unwrap().modified().unwrap()
    };
    let before = modified();
    assert_eq!(store.put(&name, bytes).await.unwrap(), PutOutcome::AlreadyThere);
    assert_eq!(modified(), before);
}

#[tokio::test]
async fn pictures_and_what_does_not_shrink_stay_alone() {
    let (_data, store) = store().await;
    for (bytes, ext) in [(text(100), "png"), (Bytes::from_static(b"tiny"), "json")] {
        let name = named(&bytes, ext);
        store.put(&name, bytes).await.unwrap();
        assert!(!store.forms(&name, None).await.unwrap().unwrap().has_variants());
    }
}

#[tokio::test]
async fn damage_is_told_apart_from_absence_and_healed_by_a_new_put() {
    let (data, store) = store().await;
    let bytes = text(100);
    let name = named(&bytes, "json");
    assert!(store.get(&name).await.unwrap().is_none());
    store.put(&name, bytes.clone()).await.unwrap();
    let same_length = vec![0; bytes.len()];
    for damaged in [&b"cut"[..], &same_length] {
        std::fs::write(data.path().join("o").join(name.to_string()), damaged).unwrap();
        // With nothing in memory.
        let store = BlobStore::open_folder(data.path(), CACHE_BYTES).await.unwrap();
        assert!(matches!(store.get(&name).await, Err(StoreError::Corrupt { .. })));
        store.put(&name, bytes.clone()).await.unwrap();
        assert_eq!(store.get(&name).await.unwrap().unwrap(), bytes);
    }
    for (suffix, coding) in [(".zst", Coding::Zstd), (".gz", Coding::Gzip)] {
        let variant = data.path().join("o").join(format!("{name}{suffix}"));
        let whole = std::fs::read(&variant).unwrap();
        std::fs::write(&variant, b"").unwrap();
        let others = BlobStore::open_folder(data.path(), CACHE_BYTES).await.unwrap();
        for _ in 0..2 {
            let forms = all_forms(&others, &name).await;
            assert_eq!(forms.of(None).unwrap().bytes, bytes);
            assert!(forms.of(Some(coding)).is_none() && forms.has_variants(), "{suffix}");
            others.inner.cache.clear();
        }
        assert_eq!(others.cache_use().damaged_variants, 1, "it is told once");
        store.put(&name, bytes.clone()).await.unwrap();
        assert_eq!(std::fs::read(&variant).unwrap(), whole);
    }
}

#[tokio::test]
async fn bytes_cannot_be_stored_under_a_name_that_is_not_theirs() {
    let (_data, store) = store().await;
    let name = named(&text(1), "json");
    assert!(matches!(
        store.put(&name, text(2)).await,
        Err(StoreError::Misnamed { .. })
    ));
    assert_eq!(store.stored_bytes(&name).await.unwrap(), None);
}

#[tokio::test]
async fn what_a_crash_left_behind_is_listed_but_not_served() {
    let (data, store) = store().await;
    let bytes = text(100);
    let name = named(&bytes, "json");
    std::fs::write(data.path().join("o").join(format!("{name}.zst")), b"left behind").unwrap();
    std::fs::write(data.path().join("o").join("README"), b"not a blob").unwrap();
    assert!(store.get(&name).await.unwrap().is_none());
    assert_eq!(store.list().await.unwrap(), BTreeMap::from([(name.clone(), 11)]));
    store.delete(&name).await.unwrap();
    assert!(store.list().await.unwrap().is_empty());
    store.delete(&name).await.unwrap();
}

#[tokio::test]
async fn parts_of_files_that_a_crash_left_behind_are_found_and_removed() {
    let (data, store) = store().await;
    let bytes = text(100);
    let name = named(&bytes, "json");
    store.put(&name, bytes).await.unwrap();
    let left = data.path().join("o").join(format!("{name}.gz#1"));
    std::fs::write(&left, b"half").unwrap();
    let found = store.unfinished().await.unwrap();
    assert_eq!(found.iter().map(|file| file.bytes).collect::<Vec<_>>(), [4]);
    for file in found {
        file.remove().await.unwrap();
    }
    assert!(!left.exists() && store.get(&name).await.unwrap().is_some());
    assert!(store.unfinished().await.unwrap().is_empty());
}

#[tokio::test]
async fn hot_blobs_are_read_from_memory_within_the_limit() {
    let (data, store) = store().await;
    let bytes = text(100);
    let name = named(&bytes, "json");
    store.put(&name, bytes).await.unwrap();
    store.get(&name).await.unwrap();
    std::fs::remove_file(data.path().join("o").join(name.to_string())).unwrap();
    assert!(store.get(&name).await.unwrap().is_some());
    assert_eq!((store.cache_use().hits, store.cache_use().misses), (1, 1));
    for i in 0..64u8 {
        let picture = Bytes::from(vec![i; 64 << 10]);
        let name = named(&picture, "png");
        store.put(&name, picture).await.unwrap();
        store.get(&name).await.unwrap();
    }
    assert!(store.cache_use().bytes <= CACHE_BYTES);
}

#[tokio::test]
async fn only_the_form_that_is_asked_for_is_read_and_held() {
    let (data, store) = store().await;
    let bytes = text(2000);
    let name = named(&bytes, "json");
    store.put(&name, bytes.clone()).await.unwrap();
    let whole = std::fs::read(file_of(&data, &name, Some(Coding::Zstd))).unwrap();
    assert_eq!(sent(&store, &name, Some(Coding::Zstd)).await.unwrap().0, bytes);
    let held = store.cache_use().bytes;
    assert!(held < (whole.len() + 8192) as u64, "{held}");
    assert!(store.in_memory(&name).is_none());
    assert_eq!(store.get(&name).await.unwrap().unwrap(), bytes);
    let more = store.cache_use().bytes;
    assert!(
        more >= held + bytes.len() as u64,
        "what is read later counts too: {more}"
    );
    assert!(store.in_memory(&name).is_some());
    store.delete(&name).await.unwrap();
    assert_eq!(store.cache_use().bytes, 0);
    assert!(store.known(&name).is_none() && store.get(&name).await.unwrap().is_none());
}

/// Whether the system reads this file, which was just written, without waiting.
#[cfg(target_os = "linux")]
fn can_be_at_hand(path: &Path) -> bool {
    use rustix::{
        fs::{CWD, Mode, OFlags, ResolveFlags, openat2},
        io::{ReadWriteFlags, preadv2},
    };

    let Ok(file) = openat2(CWD, path, OFlags::RDONLY, Mode::empty(), ResolveFlags::CACHED) else {
        return false;
    };
    let mut byte = [0];
    preadv2(
        file,
        &mut [std::io::IoSliceMut::new(&mut byte)],
        0,
        ReadWriteFlags::NOWAIT,
    ) == Ok(1)
}

#[cfg(not(target_os = "linux"))]
fn can_be_at_hand(_: &Path) -> bool {
    false
}

#[tokio::test]
async fn what_was_checked_once_is_read_again_without_waiting_where_the_system_has_it() {
    let (data, store) = store().await;
    let bytes = text(500);
    let name = named(&bytes, "json");
    store.put(&name, bytes.clone()).await.unwrap();
    for coding in [None, Some(Coding::Zstd), Some(Coding::Gzip)] {
        assert_eq!(sent(&store, &name, coding).await.unwrap().0, bytes);
        store.inner.cache.clear();
        let misses = store.cache_use().misses;
        let path = file_of(&data, &name, coding);
        let at_hand = can_be_at_hand(&path);
        assert_eq!(sent(&store, &name, coding).await.unwrap(), (bytes.clone(), at_hand));
        assert_eq!(store.cache_use().misses, misses + 1);
    }
}

#[tokio::test]
async fn a_damaged_form_is_not_sent_when_only_that_one_is_asked_for() {
    for known in [false, true] {
        for coding in Coding::ALL {
            let (data, store) = store().await;
            let bytes = text(500);
            let name = named(&bytes, "json");
            store.put(&name, bytes.clone()).await.unwrap();
            if known {
                assert_eq!(sent(&store, &name, Some(coding)).await.unwrap().0, bytes);
                store.inner.cache.clear();
            }
            let file = file_of(&data, &name, Some(coding));
            let whole = std::fs::read(&file).unwrap();
            let mut damaged = whole.clone();
            damaged[whole.len() / 2] ^= 1;
            std::fs::write(&file, damaged).unwrap();
            let forms = store.forms(&name, Some(coding)).await.unwrap().unwrap();
            assert!(!forms.has(Some(coding)) && forms.of(Some(coding)).is_none());
            assert_eq!(sent(&store, &name, Some(coding)).await.unwrap().0, bytes);
            assert_eq!(store.cache_use().damaged_variants, 1);
            // Whoever mends it without telling anybody is believed when it is read again.
            std::fs::write(&file, whole).unwrap();
            store.inner.cache.clear();
            let forms = store.forms(&name, Some(coding)).await.unwrap().unwrap();
            assert!(forms.of(Some(coding)).is_some());
        }
    }
}

#[test]
fn no_damage_is_ever_sent_whichever_file_has_it_and_whatever_was_read_before() {
    let runtime = tokio::runtime::Runtime::new().unwrap();
    let codings = || prop_oneof![Just(None), Just(Some(Coding::Zstd)), Just(Some(Coding::Gzip))];
    let steps = proptest::collection::vec((codings(), any::<bool>()), 0..4);
    let damage = (codings(), any::<proptest::sample::Index>(), 1u8.., any::<bool>());
    proptest!(ProptestConfig::with_cases(48), |(before in steps.clone(), (damaged, at, flipped, cut) in damage, after in steps)| {
        let outcome: Result<(), TestCaseError> = runtime.block_on(async {
            let (data, store) = store().await;
            let bytes = text(60);
            let name = named(&bytes, "json");
            store.put(&name, bytes.clone()).await.unwrap();
            for (coding, forgotten) in before {
                prop_assert_eq!(&sent(&store, &name, coding).await.unwrap().0, &bytes);
                if forgotten {
                    store.inner.cache.clear();
                }
            }
            let file = file_of(&data, &name, damaged);
            let mut stored = std::fs::read(&file).unwrap();
            let at = at.index(stored.len());
            if cut {
                stored.truncate(at);
            } else {
                stored[at] ^= flipped;
            }
            std::fs::write(&file, stored).unwrap();
            for (coding, forgotten) in after {
                match sent(&store, &name, coding).await {
                    Ok((sent, _)) => prop_assert_eq!(&sent, &bytes),
                    Err(StoreError::Corrupt { .. }) => prop_assert!(damaged.is_none()),
                    Err(error) => return Err(TestCaseError::fail(error.to_string())),
                }
                if forgotten {
                    store.inner.cache.clear();
                }
            }
            Ok(())
        });
        outcome?;
    });
}

#[tokio::test]
async fn the_rest_of_a_form_is_read_in_pieces_that_are_counted_and_never_damaged() {
    let (data, folder) = store().await;
    let bucket = Arc::new(object_store::memory::InMemory::new());
    let over = BlobStore::open_over(bucket, CACHE_BYTES).await.unwrap();
    // Bytes that nothing compresses, and that the cache has no room for.
    let bytes: Bytes = (0u32..300_000)
        .flat_map(|n| n.wrapping_mul(2_654_435_761).to_be_bytes())
        .collect();
    let name = BlobName::of(&bytes, "bin").unwrap();
    for store in [&folder, &over] {
        store.put(&name, bytes.clone()).await.unwrap();
        let mut rest = store.rest(&name, None, 1_000..bytes.len());
        let mut got = Vec::new();
        while !rest.is_empty() {
            assert!(rest.in_memory().is_none());
            let piece = rest.read().await.unwrap();
            assert_eq!(store.cache_use().lent_bytes, piece.len() as u64);
            rest.advance(piece.len());
            got.extend_from_slice(&piece);
        }
        assert!(got == bytes[1_000..]);
        assert_eq!(store.cache_use().lent_bytes, 0);
        // Who holds much makes pieces small for all.
        let held = store.lend(vec![0; CACHE_BYTES as usize]);
        let small = store.rest(&name, None, 0..bytes.len()).read().await.unwrap();
        assert!(small.len() < 64 << 10 && small == bytes[..small.len()]);
        drop(held);
    }
    let file = file_of(&data, &name, None);
    let mut damaged = bytes.to_vec();
    damaged[700_000] ^= 1;
    std::fs::write(&file, &damaged).unwrap();
    let before = folder.rest(&name, None, 0..100).read().await;
    assert_eq!(before.unwrap(), bytes[..100], "what is whole is known again");
    let within = folder.rest(&name, None, 699_000..701_000).read().await;
    assert!(matches!(within, Err(StoreError::Corrupt { .. })), "{within:?}");
    std::fs::remove_file(&file).unwrap();
    let gone = folder.rest(&name, None, 0..100).read().await;
    assert!(matches!(gone, Err(StoreError::Missing(_))), "{gone:?}");
}

/// Hexadecimal digits in no order: half of them is saved, and no more.
fn digits(many: u32) -> Bytes {
    (0..many / 8)
        .flat_map(|n| format!("{:08x}", n.wrapping_mul(2_654_435_761).rotate_left(n % 32)).into_bytes())
        .collect()
}

/// Puts other bytes in the place of a file, in one step.
fn store_anew(file: &Path, bytes: &[u8]) {
    let beside = file.with_extension("new");
    std::fs::write(&beside, bytes).unwrap();
    std::fs::rename(beside, file).unwrap();
}

#[tokio::test]
async fn a_variant_that_is_stored_anew_is_never_mixed_with_what_a_slow_reader_has_got() {
    let (data, store) = store().await;
    let bytes = digits(1_200_000);
    let name = named(&bytes, "json");
    store.put(&name, bytes.clone()).await.unwrap();
    for coding in Coding::ALL {
        let file = file_of(&data, &name, Some(coding));
        let begin = async || {
            let forms = store.forms(&name, Some(coding)).await.unwrap().unwrap();
            store.load(&name, &forms, Some(coding)).await.unwrap();
            let form = forms.of(Some(coding)).unwrap();
            let whole = form.bytes.clone();
            (store.rest(&name, Some((coding, form)), 0..whole.len()), whole)
        };
        let (mut rest, whole) = begin().await;
        store.inner.cache.clear();
        let mut got = rest.read().await.unwrap().to_vec();
        rest.advance(got.len());
        assert!(!rest.is_empty());
        // The same bytes in another file are the same, also where they were checked anew.
        store_anew(&file, &whole);
        store.inner.seals.forget(&name);
        drop(begin().await);
        let piece = rest.read().await.unwrap();
        rest.advance(piece.len());
        got.extend_from_slice(&piece);
        assert!(!rest.is_empty() && got == whole[..got.len()]);

        let other = match coding {
            Coding::Zstd => zstd::stream::encode_all(&bytes[..], 1).unwrap(),
            Coding::Gzip => {
                let mut encoder = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
                std::io::Write::write_all(&mut encoder, &bytes).unwrap();
                encoder.finish().unwrap()
            }
        };
        assert_ne!(other.len(), whole.len());
        store_anew(&file, &other);
        store.inner.cache.clear();
        let ended = rest.read().await;
        assert!(matches!(ended, Err(StoreError::Changed { .. })), "{ended:?}");
        // Nor when somebody has read the new one meanwhile, which is in memory.
        let (new, there) = begin().await;
        assert!(there == other, "who begins now gets what is there");
        assert!(rest.in_memory().is_none() && rest.piece_in_memory().is_none());
        let ended = rest.read().await;
        assert!(matches!(ended, Err(StoreError::Changed { .. })), "{ended:?}");
        let first = new.read().await.unwrap();
        assert!(first == other[..first.len()]);
    }
}
