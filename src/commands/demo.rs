//! `belvedere demo`: the built-in world, baked once, served at once.

use std::sync::{Arc, Mutex};

use tokio::sync::oneshot;

use super::{
    bake::{stop_on_interrupt, summary},
    output::print,
    serve::{self, ServeArgs},
};
use crate::{
    progress::{BakeProgress, Show},
    publish::{self, BakeInput, OnFirst, Request, data::DataFolder},
};

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
    let progress = Arc::new(BakeProgress::new(Show::Bars));
    stop_on_interrupt(&progress);
    let (told, first) = oneshot::channel();
    let told = Mutex::new(Some(told));
    let on_first: OnFirst = Box::new(move |report| {
        let told = told.lock().expect("nobody panics while holding this lock").take();
        told.map(|told| told.send(summary(report)));
    });
    let going_on = progress.clone();
    let mut baking = tokio::spawn(async move {
        let baked = publish::bake(&data, request, going_on, Some(on_first)).await;
        let baked = baked.inspect_err(|cause| tracing::warn!("the bake stopped: {cause:#}"));
        print(&summary(&baked?))
    });
    // Served as soon as there is something to serve; then the bake goes on beside.
    tokio::select! {
        done = &mut baking => {
            done??;
            return serve::run(args.serve).await;
        }
        Ok(summary) = first => {
            // Who has closed the output still wants to be served.
            _ = print(&format!("{summary}\n  the bake goes on: smaller visible sets follow"));
        }
    }
    let served = serve::run(args.serve).await;
    progress.cancel();
    // What it says now is that it was cancelled, or what the log says already.
    _ = baking.await?;
    served
}
