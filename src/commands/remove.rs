//! `belvedere remove SCENE`: what was published is so no more.

use belvedere_scene::SceneName;

use super::output::{print, print_json};
use crate::{db::Removed, place::PlaceArgs, publish::data::DataFolder};

#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// The scene
    scene: SceneName,
    #[command(flatten)]
    place: PlaceArgs,
    /// Print the result as JSON
    #[arg(long)]
    json: bool,
}

pub(super) async fn run(args: Args) -> anyhow::Result<()> {
    let data = DataFolder::open_existing(&args.place).await?;
    let removed = data.catalogue().remove_scene(&args.scene).await?;
    if removed == Removed::default() {
        return Err(data.no_such_scene(&args.scene).await);
    }
    if args.json {
        return print_json(&removed);
    }
    print(&format!(
        "scene {} is removed: {} revisions, {} movers and {} doors that stayed, and {} jobs; `belvedere gc` frees the space of what \
         no other scene needs",
        args.scene, removed.revisions, removed.movers, removed.doors, removed.jobs
    ))?;
    if super::private::key_of(data.catalogue(), &args.scene).await?.is_some() {
        print("it was private, and stays so if it is published again; `belvedere private SCENE --end` ends that")?;
    }
    Ok(())
}
