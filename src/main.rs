//! Host a huge 3-D world behind a CDN; walk through it while downloading only what you can see.

use std::process::ExitCode;

use belvedere::commands::{self, Cli};
use clap::Parser;

#[tokio::main]
async fn main() -> ExitCode {
    match commands::run(Cli::parse()).await {
        Ok(()) => ExitCode::SUCCESS,
        Err(cause) => {
            eprintln!("belvedere: {}", commands::sentence(&cause));
            ExitCode::FAILURE
        }
    }
}
