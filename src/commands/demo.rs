//! `belvedere demo`: the built-in worlds, each baked once, served as soon as there is something to see.
//!
//! First revisions of all worlds come first, then each bake goes on to the end, one after the other.

use std::sync::{Arc, Mutex, mpsc};

use tokio::{sync::oneshot, task::JoinHandle};

use super::{
    bake::{stop_on_interrupt, summary},
    output::print,
    serve::{self, ServeArgs},
};
use crate::{
    progress::{BakeProgress, Show},
    publish::{self, BakeInput, OnFirst, Request, data::DataFolder},
    worlds::{WORLDS, World},
};

#[derive(Debug, clap::Args)]
pub(super) struct Args {
    #[command(flatten)]
    serve: ServeArgs,
}

pub(super) async fn run(args: Args) -> anyhow::Result<()> {
    let config = args.serve.clone().into_config()?;
    let data = DataFolder::open_place(&config.place).await?;
    let progress: Vec<_> = WORLDS.iter().map(|_| Arc::new(BakeProgress::new(Show::Bars))).collect();
    progress.iter().for_each(stop_on_interrupt);
    let (told, shown) = oneshot::channel();
    let baking = tokio::spawn(bake_all(data, progress.clone(), told));
    // Nothing is shown when the first bake fails; then there is nothing to serve.
    if shown.await.is_err() {
        return baking.await?;
    }
    let page = format!("?scene={}", WORLDS[0].name);
    // The bars of the bakes stand where the figures would.
    let serve = ServeArgs {
        no_dashboard: true,
        ..args.serve
    };
    let served = serve::run_at(serve, &page).await;
    progress.iter().for_each(|progress| progress.cancel());
    // What it says now is that it was cancelled, or what the log says already.
    _ = baking.await?;
    served
}

/// Bakes every world; `told` hears when the first of them can be looked at.
async fn bake_all(data: DataFolder, progress: Vec<Arc<BakeProgress>>, told: oneshot::Sender<()>) -> anyhow::Result<()> {
    let mut told = Some(told);
    let mut begun = Vec::new();
    for (world, progress) in WORLDS.iter().zip(progress) {
        let mut bake = Bake::start(&data, world, progress)?;
        match (&mut bake.shown).await {
            Ok(()) => begun.push(bake),
            // It has ended without a first revision: nothing has changed, or it failed.
            Err(_) => bake.finish().await?,
        }
        told.take().map(|told| told.send(()));
    }
    for bake in begun {
        bake.finish().await?;
    }
    Ok(())
}

/// A bake that waits after its first revision until it is told to go on.
struct Bake {
    running: JoinHandle<anyhow::Result<()>>,
    shown: oneshot::Receiver<()>,
    go_on: mpsc::Sender<()>,
}

impl Bake {
    fn start(data: &DataFolder, world: &World, progress: Arc<BakeProgress>) -> anyhow::Result<Self> {
        let request = Request {
            scene: world.name.parse()?,
            title: Some(world.title.to_owned()),
            input: BakeInput::BuiltIn(world.file),
            sowing: belvedere_bake::import::procedural::Sowing::default(),
            settings: belvedere_bake::BakeSettings::default(),
            limits: belvedere_bake::import::Limits::default(),
            again: false,
            claim: None,
        };
        let (told, shown) = oneshot::channel();
        let (go_on, going_on) = mpsc::channel();
        let waiting = Mutex::new((Some(told), going_on));
        let on_first: OnFirst = Box::new(move |report| {
            // Who has closed the output still wants to be served.
            _ = print(&format!(
                "{}\n  the bake goes on: smaller visible sets follow",
                summary(report)
            ));
            let mut waiting = waiting.lock().expect("nobody panics while holding this lock");
            waiting.0.take().map(|told| told.send(()));
            // Nobody is left to say so when the demo ends; then the bake finds that it was cancelled.
            _ = waiting.1.recv();
        });
        let data = data.clone();
        let running = tokio::spawn(async move {
            let baked = publish::bake(&data, request, progress, Some(on_first)).await;
            let baked = baked.inspect_err(|cause| tracing::warn!("the bake stopped: {cause:#}"));
            print(&summary(&baked?))
        });
        Ok(Self { running, shown, go_on })
    }

    /// Lets it go on to its end.
    async fn finish(self) -> anyhow::Result<()> {
        _ = self.go_on.send(());
        self.running.await?
    }
}
