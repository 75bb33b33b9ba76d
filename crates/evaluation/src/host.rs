//! What does an experiment get from outside? The program itself, a folder to work in, and somewhere to say how far it is.

use std::{
    path::{Path, PathBuf},
    process::{Command, Stdio},
    time::{Duration, Instant},
};

use anyhow::Context;
use serde_json::Value;

/// Where experiments run.
#[derive(Debug)]
pub struct Host {
    /// The program.
    pub belvedere: PathBuf,
    /// A folder for data and trees, kept from run to run, so that what is baked stays baked.
    pub work: PathBuf,
    /// A data folder that holds a baked town, if somebody has one.
    pub town_data: Option<PathBuf>,
    /// How long the bake of the town may take.
    pub town_budget: Duration,
}

/// How often a child is looked at.
const PAUSE: Duration = Duration::from_millis(200);

/// How a bake ended.
#[derive(Debug)]
pub enum Baked {
    /// The scene is published.
    Done,
    /// It was stopped because its time was over; a first revision may be there.
    Stopped,
}

impl Host {
    /// Says how far an experiment is.
    #[allow(clippy::print_stderr, reason = "the one place that tells progress")]
    pub fn say(&self, words: &str) {
        eprintln!("  {words}");
    }

    /// Bakes a file into the work folder's data, within a time.
    ///
    /// # Errors
    /// When the program cannot be run or the bake fails.
    pub fn bake(&self, file: &Path, scene: &str, more: &[&str], budget: Duration) -> anyhow::Result<Baked> {
        self.say(&format!(
            "baking {}, {} min at most",
            file.display(),
            budget.as_secs() / 60
        ));
        let mut child = Command::new(&self.belvedere)
            .arg("bake")
            .arg(file)
            .args(["--scene", scene, "--json", "--data"])
            .arg(self.data())
            .args(more)
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .spawn()
            .with_context(|| format!("cannot run {}", self.belvedere.display()))?;
        let started = Instant::now();
        loop {
            if let Some(status) = child.try_wait()? {
                anyhow::ensure!(status.success(), "the bake of {} failed", file.display());
                return Ok(Baked::Done);
            }
            if started.elapsed() > budget {
                child.kill()?;
                child.wait()?;
                return Ok(Baked::Stopped);
            }
            std::thread::sleep(PAUSE);
        }
    }

    /// Writes a scene of a data folder as a tree, and gives the tree's folder.
    ///
    /// # Errors
    /// When there is no such scene.
    pub fn publish(&self, data: &Path, scene: &str) -> anyhow::Result<PathBuf> {
        let tree = self.work.join("public");
        let output = Command::new(&self.belvedere)
            .args(["publish", scene, "--to"])
            .arg(&tree)
            .arg("--data")
            .arg(data)
            .output()
            .with_context(|| format!("cannot run {}", self.belvedere.display()))?;
        anyhow::ensure!(
            output.status.success(),
            "cannot publish {scene}: {}",
            String::from_utf8_lossy(&output.stderr).trim()
        );
        Ok(tree)
    }

    /// What `inspect --json` says of a scene.
    ///
    /// # Errors
    /// When there is no such scene.
    pub fn inspect(&self, data: &Path, scene: &str) -> anyhow::Result<Value> {
        let output = Command::new(&self.belvedere)
            .args(["inspect", scene, "--json", "--data"])
            .arg(data)
            .output()
            .with_context(|| format!("cannot run {}", self.belvedere.display()))?;
        anyhow::ensure!(
            output.status.success(),
            "cannot inspect {scene}: {}",
            String::from_utf8_lossy(&output.stderr).trim()
        );
        serde_json::from_slice(&output.stdout).context("`inspect` gives no JSON")
    }

    /// The data folder of the work folder.
    #[must_use]
    pub fn data(&self) -> PathBuf {
        self.work.join("data")
    }
}
