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
    let forms = store.get(&name).await.unwrap().unwrap();
    assert_eq!(forms.identity.bytes, bytes);
    let zstd = forms.zstd.as_ref().unwrap();
    assert_eq!(zstd::decode_all(zstd.bytes.as_ref()).unwrap(), bytes);
    assert!(forms.gzip.is_some());
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
        assert!(!store.get(&name).await.unwrap().unwrap().has_variants());
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
        assert_eq!(store.get(&name).await.unwrap().unwrap().identity.bytes, bytes);
    }
    for (suffix, coding) in [(".zst", Coding::Zstd), (".gz", Coding::Gzip)] {
        let variant = data.path().join("o").join(format!("{name}{suffix}"));
        let whole = std::fs::read(&variant).unwrap();
        std::fs::write(&variant, b"").unwrap();
        let others = BlobStore::open_folder(data.path(), CACHE_BYTES).await.unwrap();
        for _ in 0..2 {
            let forms = others.get(&name).await.unwrap().unwrap();
            assert_eq!(forms.identity.bytes, bytes);
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
