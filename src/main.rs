//! Host a huge 3-D world behind a CDN; walk through it while downloading only what you can see.

use belvedere::commands::serve::{self, ServeArgs};
use clap::Parser;

#[derive(Parser)]
#[command(version, about)]
enum Command {
    Serve(ServeArgs),
}

#[tokio::main]
async fn main() -> anyhow::Result<()> {
    match Command::parse() {
        Command::Serve(args) => serve::run(args).await,
    }
}
