//! Where do the catalogue and the blobs live? In a folder, or, where several nodes shall serve the same, in a PostgreSQL
//! database and an S3-compatible bucket. Chosen by settings alone, and the same for every command.

mod absent;

use std::path::PathBuf;

use anyhow::Context;
use clap::Args;
use serde::Deserialize;

pub(crate) use absent::Absent;

use crate::{
    db::{self, Catalogue},
    folder,
    secret::Secret,
    store::{BlobStore, Bucket, Errands, NoBucket, credentials},
};

/// Where, as it was typed.
#[derive(Debug, Clone, Default, PartialEq, Args, Deserialize)]
pub struct PlaceArgs {
    /// Folder with the catalogue, the blobs and what is being worked on [default: ./data]
    #[arg(long, value_name = "DIR", env = "BELVEDERE_DATA")]
    pub data: Option<PathBuf>,
    /// Keep the catalogue in PostgreSQL, so that several nodes share it: postgres://user:password@host/name [default: in
    /// the data folder]
    #[arg(long, value_name = "URL", env = "BELVEDERE_DATABASE", hide_env_values = true)]
    pub database: Option<Secret>,
    /// Keep the blobs in an S3-compatible bucket: s3://bucket/prefix; region and keys come from AWS_REGION,
    /// AWS_ACCESS_KEY_ID and AWS_SECRET_ACCESS_KEY [default: in the data folder]
    #[arg(long, value_name = "URL", env = "BELVEDERE_STORE")]
    pub store: Option<String>,
    /// The bucket's server, where it is not Amazon's, like http://127.0.0.1:9000
    #[arg(long, value_name = "URL", env = "BELVEDERE_STORE_ENDPOINT")]
    pub store_endpoint: Option<String>,
    /// Speak plain HTTP with a bucket's server on another machine
    #[arg(long, value_name = "BOOL", env = "BELVEDERE_STORE_PLAIN_HTTP", num_args = 0..=1,
        default_missing_value = "true")]
    pub store_plain_http: Option<bool>,
}

impl PlaceArgs {
    /// These settings, and those of `fallback` where there are none.
    #[must_use]
    pub fn or(self, fallback: Self) -> Self {
        Self {
            data: self.data.or(fallback.data),
            database: self.database.or(fallback.database),
            store: self.store.or(fallback.store),
            store_endpoint: self.store_endpoint.or(fallback.store_endpoint),
            store_plain_http: self.store_plain_http.or(fallback.store_plain_http),
        }
    }
}

/// Where everything lives.
#[derive(Debug, Clone, PartialEq)]
pub struct Place {
    /// The folder of this node: all of it, or only what is being worked on.
    pub data: PathBuf,
    /// The database, where it is not in the folder.
    pub database: Option<Secret>,
    /// The bucket, where blobs are not in the folder.
    pub bucket: Option<Bucket>,
    /// The address of the bucket as it was typed, for a child process.
    args: PlaceArgs,
}

impl TryFrom<&PlaceArgs> for Place {
    type Error = NoBucket;

    fn try_from(args: &PlaceArgs) -> Result<Self, NoBucket> {
        let plain = args.store_plain_http.unwrap_or(false);
        if args.store.is_none() && args.store_endpoint.is_some() {
            return Err(NoBucket::EndpointAlone);
        }
        let bucket = |store: &String| Bucket::new(store, args.store_endpoint.as_deref(), plain);
        Ok(Self {
            data: args.data.clone().unwrap_or_else(|| PathBuf::from("data")),
            database: args.database.clone(),
            bucket: args.store.as_ref().map(bucket).transpose()?,
            args: args.clone(),
        })
    }
}

impl Place {
    /// Opens the catalogue, and makes it when there is none.
    ///
    /// # Errors
    /// When it cannot be opened, or does not answer within seconds.
    pub async fn open_catalogue(&self) -> anyhow::Result<Catalogue> {
        match &self.database {
            Some(url) => Catalogue::connect(url).await,
            None => Catalogue::open(&self.data).await,
        }
    }

    /// Opens the blobs, with so much memory for hot ones.
    ///
    /// # Errors
    /// When folder or bucket cannot be used.
    pub async fn open_store(&self, cache_bytes: u64) -> anyhow::Result<BlobStore> {
        let Some(bucket) = &self.bucket else {
            folder::make_data(&self.data)?;
            return Ok(BlobStore::open_folder(&self.data, cache_bytes).await?);
        };
        let opened = BlobStore::open_bucket(bucket, cache_bytes).await;
        opened.with_context(|| no_bucket(bucket))
    }

    /// Whether the catalogue can be read, if there is one, and database and bucket are there, where there shall be any; changes
    /// nothing in them.
    ///
    /// # Errors
    /// When one does not answer as it should.
    pub async fn reach(&self) -> anyhow::Result<()> {
        match &self.database {
            Some(url) => Catalogue::reach(url).await?,
            None => Catalogue::reach_file(&self.data).await?,
        }
        if let Some(bucket) = &self.bucket {
            let reached = BlobStore::reach_bucket(bucket).await;
            reached.with_context(|| no_bucket(bucket))?;
        }
        Ok(())
    }

    /// How uploads reach the node that bakes them.
    ///
    /// # Errors
    /// When the bucket's settings cannot be used.
    pub fn errands(&self) -> anyhow::Result<Errands> {
        Ok(self
            .bucket
            .as_ref()
            .map(Errands::through)
            .transpose()?
            .unwrap_or_default())
    }

    /// Whether there is a catalogue already; one in a database is made by whoever opens it.
    #[must_use]
    pub fn has_catalogue(&self) -> bool {
        self.database.is_some() || self.data.join(db::FILE_NAME).is_file()
    }

    /// Says the same to a child process, by its environment: arguments are for everybody to read.
    #[must_use]
    pub fn environment(&self) -> Vec<(String, Secret)> {
        let args = &self.args;
        let mut said = Vec::new();
        let mut say = |name: &str, value: Option<&str>| {
            said.extend(value.map(|value| (format!("BELVEDERE_{name}"), value.into())));
        };
        say("DATABASE", args.database.as_ref().map(Secret::reveal));
        say("STORE", args.store.as_deref());
        say("STORE_ENDPOINT", args.store_endpoint.as_deref());
        say(
            "STORE_PLAIN_HTTP",
            args.store_plain_http.map(|plain| if plain { "true" } else { "false" }),
        );
        if self.bucket.is_some() {
            said.extend(
                credentials()
                    .into_iter()
                    .map(|(name, value)| (name, value.as_str().into())),
            );
        }
        said
    }
}

fn no_bucket(bucket: &Bucket) -> String {
    format!(
        "cannot open the store {bucket}; the bucket must be there, and AWS_ACCESS_KEY_ID and AWS_SECRET_ACCESS_KEY, or the \
         role of the machine, must open it"
    )
}
