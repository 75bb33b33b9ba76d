//! What can one ask of the program? One module for each command of `belvedere`; this file is the list of them.

mod audit;
mod bake;
mod check;
mod demo;
mod gc;
mod grow;
mod growing;
mod inspect;
mod keys;
mod mesh;
mod output;
mod private;
mod publish;
mod remove;
mod rollback;
pub mod serve;
mod sign;
mod sowing;
mod verify;
mod walk;

use clap::{CommandFactory, Parser, Subcommand};

pub use output::printable;

use crate::config::environment::{Stranger, behind, of_this_process};

/// Host a huge 3-D world behind a CDN; walk through it while downloading only what you can see.
#[derive(Debug, Parser)]
#[command(name = "belvedere", version, about, max_term_width = 100)]
pub struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Bake the built-in worlds, a town, a museum and a forest; serve them and print the viewer's address
    Demo(demo::Args),
    /// Import a scene, compute cells, visibility and levels of detail, and publish it
    Bake(bake::Args),
    /// Serve the published scenes over HTTP
    Serve(serve::ServeArgs),
    /// Write a published scene as a static tree for any web server or bucket
    Publish(publish::Args),
    /// Show what is in a published scene or in a source file
    Inspect(inspect::Args),
    /// Look for visible objects that the visible sets lack; fails when there are too many
    Verify(verify::Args),
    /// Send visitors through a served or published scene and measure what they get to see, and when
    Walk(walk::Args),
    /// Replay a recording of live sessions: was anybody told of what it cannot see, or not of what it sees?
    Audit(audit::Args),
    /// Make levels of detail of the meshes in a file, without baking a scene
    Mesh(mesh::Args),
    /// Grow a model out of rules (.dcg) and write it as a GLB
    Grow(grow::Args),
    /// Remove blobs and old revisions that nothing needs
    Gc(gc::Args),
    /// Move a scene back to an earlier revision
    Rollback(rollback::Args),
    /// Take a published scene away, with its revisions and all that stays in it
    Remove(remove::Args),
    /// Make, list and revoke API keys: who may upload scenes, roll them back and read private ones
    Keys(keys::Args),
    /// Make a scene private, or public again
    Private(private::Args),
    /// Print a link that opens a private scene for a while
    Sign(sign::Args),
    /// Print the OpenAPI document of the HTTP interface
    Openapi,
}

/// An error with its causes, outermost first; a cause that was already told is not told again.
#[must_use]
pub fn sentence(error: &anyhow::Error) -> String {
    let mut told = String::new();
    for cause in error.chain().map(ToString::to_string).filter(|cause| !cause.is_empty()) {
        if !told.contains(&cause) {
            told = if told.is_empty() {
                cause
            } else {
                format!("{told}: {cause}")
            };
        }
    }
    told
}

/// What was asked for. Ends the program where that cannot be read, and says so; of a value, also from which variable it comes.
#[must_use]
pub fn read() -> Cli {
    Cli::try_parse().unwrap_or_else(|error| {
        // What cannot be printed nobody reads.
        _ = error.print();
        if let Some(variable) = behind(&Cli::command(), &error) {
            eprintln!("The value is that of the variable {variable}.");
        }
        std::process::exit(error.exit_code())
    })
}

/// Variables that look like settings and are none.
fn strange_variables() -> Vec<Stranger> {
    of_this_process(&Cli::command())
}

/// Says so on standard error.
fn tell_strange_variables() {
    for stranger in strange_variables() {
        eprintln!("belvedere: {stranger}");
    }
}

/// Runs what was asked for.
///
/// # Errors
/// With a sentence for the person who asked.
pub async fn run(cli: Cli) -> anyhow::Result<()> {
    // Who serves says it in the log.
    if !matches!(cli.command, Command::Serve(_) | Command::Demo(_)) {
        tell_strange_variables();
    }
    match cli.command {
        Command::Demo(args) => demo::run(args).await,
        Command::Bake(args) => bake::run(args).await,
        Command::Serve(args) => serve::run(args).await,
        Command::Publish(args) => publish::run(args).await,
        Command::Remove(args) => remove::run(args).await,
        Command::Inspect(args) => inspect::run(args).await,
        Command::Verify(args) => verify::run(args).await,
        Command::Walk(args) => walk::run(args).await,
        Command::Audit(args) => audit::run(args).await,
        Command::Mesh(args) => mesh::run(args),
        Command::Grow(args) => grow::run(args),
        Command::Gc(args) => gc::run(args).await,
        Command::Rollback(args) => rollback::run(args).await,
        Command::Keys(args) => keys::run(args).await,
        Command::Private(args) => private::run(args).await,
        Command::Sign(args) => sign::run(args).await,
        Command::Openapi => output::print(crate::http::OPENAPI_JSON),
    }
}
