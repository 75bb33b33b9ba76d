//! `belvedere gc`: remove blobs that no revision needs, nor any mover or session that is kept, and revisions that nobody will roll back to.

use super::output::{bytes, print, print_json};
use crate::{live::worn, place::PlaceArgs, publish::data::DataFolder};

#[derive(Debug, clap::Args)]
pub(super) struct Args {
    #[command(flatten)]
    place: PlaceArgs,
    /// How many of the newest revisions of each scene to keep, and the current one where it is none of them; previews are not
    /// counted, and go
    #[arg(long, default_value_t = 3, value_parser = clap::value_parser!(u32).range(1..))]
    keep: u32,
    /// Say what would go, and remove nothing
    #[arg(long)]
    dry_run: bool,
    /// The store is this catalogue's from now on, whatever it says
    #[arg(long)]
    adopt: bool,
    /// Print the result as JSON
    #[arg(long)]
    json: bool,
}

#[derive(Debug, Default, serde::Serialize)]
struct Collected {
    dry_run: bool,
    revisions: u64,
    blobs: u64,
    /// Files of writes that were broken off.
    unfinished: u64,
    bytes: u64,
    kept_blobs: u64,
}

pub(super) async fn run(args: Args) -> anyhow::Result<()> {
    let data = DataFolder::open_existing(&args.place).await?;
    let no_bake = data.lock_for_collecting().await?;
    let stored = data.store().list().await?;
    data.own_store(&stored, args.adopt, args.dry_run).await?;
    let mut collected = Collected {
        dry_run: args.dry_run,
        ..Collected::default()
    };
    let mut needed = if args.dry_run {
        collected.revisions = data.catalogue().old_revisions(args.keep).await?;
        data.catalogue().blobs_in_use(args.keep).await?
    } else {
        collected.revisions = data.catalogue().forget_old_revisions(args.keep).await?;
        data.catalogue().blobs_in_use(u32::MAX).await?
    };
    needed.extend(worn(data.catalogue()).await?);
    // Without it a bake may begin that finds a blob and takes it for its own.
    let still_alone = async || {
        anyhow::ensure!(
            no_bake.holds().await,
            "the catalogue was away meanwhile, so something may be baked now; run gc again"
        );
        Ok(())
    };
    for (name, size) in stored {
        if needed.contains(&name) {
            collected.kept_blobs += 1;
            continue;
        }
        collected.blobs += 1;
        collected.bytes += size;
        if !args.dry_run {
            still_alone().await?;
            data.store().delete(&name).await?;
        }
    }
    for file in data.store().unfinished().await? {
        collected.unfinished += 1;
        collected.bytes += file.bytes;
        if !args.dry_run {
            still_alone().await?;
            file.remove().await?;
        }
    }
    if args.json {
        return print_json(&collected);
    }
    let verb = if args.dry_run { "would remove" } else { "removed" };
    print(&format!(
        "{verb} {} revisions, {} blobs and {} files that were never finished ({}); {} blobs are needed",
        collected.revisions,
        collected.blobs,
        collected.unfinished,
        bytes(collected.bytes),
        collected.kept_blobs,
    ))
}
