//! Does a bucket hold blobs as a folder does, and what comes of one that fails?

use belvedere::store::{BlobStore, Coding, Errands, PutOutcome, StoreError};
use belvedere_scene::BlobName;
use bytes::Bytes;

use crate::{
    faulty::{Fault, Faulty},
    shared::{at, bucket, s3},
};

const CACHE_BYTES: u64 = 1 << 20;

fn text() -> (BlobName, Bytes) {
    let bytes = Bytes::from("a wall hides what stands behind it; ".repeat(500));
    (BlobName::of(&bytes, "json").unwrap(), bytes)
}

#[tokio::test]
#[ignore = "needs an S3 server: make test-services"]
async fn a_blob_comes_back_from_a_bucket_with_its_variants_until_it_is_deleted() {
    let place = at(&bucket().await, s3());
    let (here, there) = (
        BlobStore::open_bucket(&place, CACHE_BYTES).await.unwrap(),
        BlobStore::open_bucket(&place, CACHE_BYTES).await.unwrap(),
    );
    let (name, bytes) = text();
    assert!(there.get(&name).await.unwrap().is_none());
    assert!(matches!(
        here.put(&name, bytes.clone()).await.unwrap(),
        PutOutcome::Stored { .. }
    ));
    here.sync().await.unwrap();
    assert_eq!(there.get(&name).await.unwrap().unwrap(), bytes);
    let forms = there.forms(&name, None).await.unwrap().unwrap();
    let zstd = &forms.of(Some(Coding::Zstd)).unwrap().bytes;
    assert_eq!(zstd::decode_all(zstd.as_ref()).unwrap(), bytes);
    assert!(forms.of(Some(Coding::Gzip)).is_some());
    assert_eq!(there.put(&name, bytes.clone()).await.unwrap(), PutOutcome::AlreadyThere);
    assert_eq!(there.stored_bytes(&name).await.unwrap(), Some(bytes.len() as u64));
    assert_eq!(
        there.list().await.unwrap().into_keys().collect::<Vec<_>>(),
        std::slice::from_ref(&name)
    );
    there.delete(&name).await.unwrap();
    there.delete(&name).await.unwrap();
    assert_eq!(there.stored_bytes(&name).await.unwrap(), None);
    there.probe().await.unwrap();
}

#[tokio::test]
#[ignore = "needs an S3 server: make test-services"]
async fn a_bucket_that_is_not_there_is_named() {
    let error = BlobStore::open_bucket(&at("s3://no-such-bucket", s3()), CACHE_BYTES)
        .await
        .unwrap_err();
    let told = format!("{:#}", anyhow::Error::from(error));
    assert!(
        told.contains("NoSuchBucket") || told.contains("no-such-bucket"),
        "{told}"
    );
}

#[tokio::test(flavor = "multi_thread")]
#[ignore = "needs an S3 server: make test-services"]
async fn what_a_faulty_store_says_is_never_taken_for_bytes_nor_kept() {
    let place = bucket().await;
    let faulty = Faulty::before(s3()).await;
    let store = BlobStore::open_bucket(&at(&place, faulty.address), CACHE_BYTES)
        .await
        .unwrap();
    let (name, bytes) = text();
    store.put(&name, bytes.clone()).await.unwrap();
    for fault in [
        Fault::Fails,
        Fault::SaysNothing,
        Fault::CutsBodies,
        Fault::ChangesBodies,
    ] {
        faulty.set(fault);
        let error = store.get(&name).await.unwrap_err();
        let expected = match fault {
            Fault::ChangesBodies => matches!(error, StoreError::Corrupt { .. }),
            _ => matches!(error, StoreError::Io { .. }),
        };
        assert!(expected, "{fault:?}: {error}");
        assert!(fault != Fault::SaysNothing || error.was_away(), "{error}");
        assert!(store.in_memory(&name).is_none(), "{fault:?}");
    }
    faulty.set(Fault::None);
    let other = BlobStore::open_bucket(&at(&place, faulty.address), CACHE_BYTES)
        .await
        .unwrap();
    faulty.set(Fault::ChangesABody);
    let read = other.get(&name).await.unwrap().unwrap();
    assert_eq!(read, bytes, "it is read once more");
    // The bytes are right, and what is sent instead of them to most clients is not.
    faulty.set(Fault::None);
    let direct = object_store::aws::AmazonS3Builder::from_env()
        .with_bucket_name(place.trim_start_matches("s3://").trim_end_matches("/worlds"))
        .with_endpoint(format!("http://{}", s3()))
        .with_allow_http(true)
        .build()
        .unwrap();
    let variant = object_store::path::Path::from(format!("worlds/o/{name}.zst"));
    object_store::ObjectStoreExt::put(&direct, &variant, "no zstd".into())
        .await
        .unwrap();
    let whole = store.forms(&name, Some(Coding::Zstd)).await.unwrap().unwrap();
    assert!(!whole.has(Some(Coding::Zstd)), "nobody gets it");
    let identity = &whole.of(None).unwrap().bytes;
    assert_eq!(*identity, bytes, "who takes another form is served");
    assert_eq!(store.cache_use().damaged_variants, 1);
    faulty.set(Fault::Fails);
    assert!(store.get(&name).await.unwrap().is_some(), "what is in memory is served");
    assert!(store.probe().await.is_err());
}

#[tokio::test]
#[ignore = "needs an S3 server: make test-services"]
async fn a_file_reaches_another_node_whole() {
    let place = bucket().await;
    let (here, there) = (
        Errands::through(&at(&place, s3())).unwrap(),
        Errands::through(&at(&place, s3())).unwrap(),
    );
    let folder = tempfile::tempdir().unwrap();
    // Larger than one part of an upload in parts.
    let bytes: Vec<u8> = (0..12_u32 << 20).map(|i| (i / 7) as u8).collect();
    let file = folder.path().join("town.glb");
    std::fs::write(&file, &bytes).unwrap();
    here.send("j1", &file).await.unwrap();
    let fetched = folder.path().join("there");
    there.fetch("j1", &fetched).await.unwrap();
    assert!(std::fs::read(fetched.join("town.glb")).unwrap() == bytes);
    there.remove("j1").await.unwrap();
    let nothing = folder.path().join("nothing");
    here.fetch("j1", &nothing).await.unwrap();
    assert_eq!(std::fs::read_dir(nothing).unwrap().count(), 0);
}
