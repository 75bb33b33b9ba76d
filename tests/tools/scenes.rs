//! Where are the test scenes, which stand beside the repository, and what if they are not there? Tests that need them say so
//! and pass; but where the variable `CI` is set, all must be tested, and they fail. `scenes.sh` is the same for scripts.

use std::{
    env,
    io::{self, Write},
    path::{Path, PathBuf},
};

pub(crate) fn scenes() -> Option<PathBuf> {
    let package = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut above = package.ancestors();
    let root = above
        .find(|folder| folder.join("Cargo.lock").is_file())
        .expect("a repository");
    let scenes = root.join("../shared/scenes");
    if scenes.is_dir() {
        return Some(scenes);
    }
    let missing = format!("there are no test scenes at {}", scenes.display());
    assert!(env::var_os("CI").is_none_or(|set| set.is_empty()), "{missing}");
    // Unlike what `eprintln!` says, this is seen of tests that pass, too.
    writeln!(io::stderr(), "skipped: {missing}").expect("somewhere to say it");
    None
}
