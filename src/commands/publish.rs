//! `belvedere publish SCENE --to DIR`: the static tree, in a folder for any web server or in a bucket.

use belvedere_scene::SceneName;
use indicatif::{ProgressBar, ProgressStyle};

use super::output::{bytes, print, print_json};
use crate::{
    page,
    place::PlaceArgs,
    progress,
    publish::{data::DataFolder, target::Target, tree},
};

#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// The scene
    scene: SceneName,
    /// The folder or bucket, s3://bucket/prefix, to write into; other scenes that it holds stay
    #[arg(long, value_name = "DIR")]
    to: String,
    /// Write it although it is private; whoever reaches the tree sees all of it
    #[arg(long)]
    although_private: bool,
    #[command(flatten)]
    place: PlaceArgs,
    /// Print the result as JSON
    #[arg(long)]
    json: bool,
}

pub(super) async fn run(args: Args) -> anyhow::Result<()> {
    let place = &args.place;
    let to = Target::new(
        &args.to,
        place.store_endpoint.as_deref(),
        place.store_plain_http.unwrap_or(false),
    )?;
    let mut place = place.clone();
    if place.store.is_none() {
        // It was said for the tree alone.
        place.store_endpoint = None;
    }
    let data = DataFolder::open_existing(&place).await?;
    let private = super::private::key_of(data.catalogue(), &args.scene).await?.is_some();
    anyhow::ensure!(
        args.although_private || !private,
        "scene `{}` is private, and files know no links: whoever reaches them sees them. Where something else keeps strangers out, \
         say --although-private",
        args.scene
    );
    let bar = ProgressBar::with_draw_target(None, progress::target(!args.json));
    bar.set_style(ProgressStyle::with_template(
        "    publish {bar:40.cyan/dim} {pos} of {len} blobs",
    )?);
    let report = tree::write(&data, &args.scene, &to, |done, all| {
        bar.set_length(all);
        bar.set_position(done);
    })
    .await?;
    bar.finish_and_clear();
    if args.json {
        return print_json(&report);
    }
    print(&format!(
        "scene {} revision {}: {} blobs ({}), {} of them new, and {} rungs of smooth LODs, in {to}\n{}",
        report.scene,
        report.revision,
        report.blobs,
        bytes(report.bytes),
        report.new_blobs,
        report.rungs,
        match to {
            _ if page::paths().next().is_none() =>
                "this belvedere was built without its viewer, so there is no page to open: clients read these files",
            Target::Folder(_) => "serve that folder with any web server and open it in a browser",
            Target::Bucket(..) =>
                "let the bucket be read by everybody, or by a CDN, and open its index.html in a browser",
        },
    ))
}
