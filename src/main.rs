//! Host a huge 3-D world behind a CDN; walk through it while downloading only what you can see.

use std::{num::NonZero, process::ExitCode, thread::available_parallelism};

use belvedere::commands;
use tokio::runtime::Builder;

/// For what blocks, such as reads from a disk, besides one a core for what computes. The runtime would make hundreds when many objects are
/// asked for at once, of which each holds memory and none makes a disk faster.
const READING_THREADS: usize = 32;

fn main() -> ExitCode {
    let cores = available_parallelism().map_or(1, NonZero::get);
    let runtime = Builder::new_multi_thread()
        .enable_all()
        .max_blocking_threads(cores + READING_THREADS)
        .build()
        .expect("the system has room for threads");
    match runtime.block_on(commands::run(commands::read())) {
        Ok(()) => ExitCode::SUCCESS,
        Err(cause) => {
            eprintln!("belvedere: {}", commands::printable(&commands::sentence(&cause)));
            ExitCode::FAILURE
        }
    }
}
