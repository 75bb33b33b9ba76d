//! `belvedere demo`: the built-in world, baked once, served at once.

use super::{
    bake::{bake_until_interrupted, summary},
    output::print,
    serve::{self, ServeArgs},
};
use crate::publish::{BakeInput, Request, data::DataFolder};

#[derive(Debug, clap::Args)]
pub(super) struct Args {
    #[command(flatten)]
    serve: ServeArgs,
}

pub(super) async fn run(args: Args) -> anyhow::Result<()> {
    let config = args.serve.clone().into_config()?;
    let data = DataFolder::open(&config.data).await?;
    let request = Request {
        scene: "museum".parse()?,
        title: None,
        input: BakeInput::BuiltIn {
            name: "museum.plan",
            text: include_str!("../../content/museum.plan"),
        },
        settings: belvedere_bake::BakeSettings::default(),
        limits: belvedere_bake::import::Limits::default(),
        again: false,
    };
    let report = bake_until_interrupted(&data, request, false).await?;
    print(&summary(&report))?;
    serve::run(args.serve).await
}
