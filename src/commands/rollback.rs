//! `belvedere rollback SCENE`: move a scene's pointer to an earlier revision.

use belvedere_scene::{Revision, SceneName};

use super::output::{print, print_json, table};
use crate::{
    place::PlaceArgs,
    publish::{
        data::DataFolder,
        rollback::{RollbackError, roll_back},
    },
};

#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// The scene
    scene: SceneName,
    /// The revision [default: the one that was published before the current one, previews left out]
    #[arg(long, value_name = "REVISION")]
    to: Option<Revision>,
    /// List the revisions that are kept, newest first, and move nothing
    #[arg(long, conflicts_with = "to")]
    list: bool,
    #[command(flatten)]
    place: PlaceArgs,
    /// Print the result as JSON
    #[arg(long)]
    json: bool,
}

pub(super) async fn run(args: Args) -> anyhow::Result<()> {
    let data = DataFolder::open_existing(&args.place).await?;
    if args.list {
        return list(&data, &args).await;
    }
    let moved = match roll_back(data.catalogue(), data.store(), &args.scene, args.to).await {
        Err(RollbackError::NoScene(scene)) => return Err(data.no_such_scene(&scene).await),
        moved => moved?,
    };
    if args.json {
        return print_json(&moved);
    }
    print(&format!(
        "scene {} is at revision {}; it was at {}",
        args.scene, moved.revision, moved.from
    ))
}

async fn list(data: &DataFolder, args: &Args) -> anyhow::Result<()> {
    let kept = data.catalogue().kept_revisions(&args.scene).await?;
    if kept.is_empty() {
        return Err(data.no_such_scene(&args.scene).await);
    }
    if args.json {
        return print_json(&kept);
    }
    let rows: Vec<_> = kept
        .iter()
        .map(|kept| {
            let told = match (kept.current, kept.preview) {
                (true, true) => "current, preview",
                (true, false) => "current",
                (false, true) => "preview",
                (false, false) => "",
            };
            vec![kept.revision.to_string(), kept.published_at.clone(), told.to_owned()]
        })
        .collect();
    print(&table(&["revision", "published", ""], &rows))
}
