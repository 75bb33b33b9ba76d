//! What is kept of a run? One JSON file for each experiment, so that the page can be rendered without running anything.

use std::{collections::BTreeMap, fs, path::Path};

use anyhow::Context;
use serde::{Deserialize, Serialize};
use serde_json::Value;

/// A run of an experiment.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Kept {
    /// Which one.
    pub experiment: String,
    /// The sources that were measured, as `git describe` names them.
    pub sources: String,
    /// `development` or `release`.
    pub build: String,
    /// Cores of the machine.
    pub cores: usize,
    /// How long it took.
    pub seconds: f64,
    /// What was measured.
    pub measured: Value,
}

/// All that a folder holds, by experiment. An absent folder holds nothing.
///
/// # Errors
/// When a file is not a result.
pub fn read_all(folder: &Path) -> anyhow::Result<BTreeMap<String, Kept>> {
    let mut all = BTreeMap::new();
    let Ok(files) = fs::read_dir(folder) else {
        return Ok(all);
    };
    for file in files {
        let path = file?.path();
        if path.extension().is_some_and(|ext| ext == "json") {
            let kept = read(&path)?;
            all.insert(kept.experiment.clone(), kept);
        }
    }
    Ok(all)
}

fn read(path: &Path) -> anyhow::Result<Kept> {
    let text = fs::read_to_string(path).with_context(|| format!("cannot read {}", path.display()))?;
    serde_json::from_str(&text).with_context(|| format!("{} is no result; remove it and measure again", path.display()))
}

impl Kept {
    /// Writes it into a folder.
    ///
    /// # Errors
    /// When the folder cannot be written.
    pub fn write(&self, folder: &Path) -> anyhow::Result<()> {
        fs::create_dir_all(folder)?;
        let path = folder.join(format!("{}.json", self.experiment));
        let text = serde_json::to_string(self)? + "\n";
        fs::write(&path, text).with_context(|| format!("cannot write {}", path.display()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_written_is_read() {
        let folder = tempfile::tempdir().unwrap();
        let kept = Kept {
            experiment: "table2".to_owned(),
            sources: "abc".to_owned(),
            build: "release".to_owned(),
            cores: 2,
            seconds: 1.5,
            measured: serde_json::json!({"rows": [0.1]}),
        };
        kept.write(folder.path()).unwrap();
        let all = read_all(folder.path()).unwrap();
        assert_eq!(all["table2"].measured, kept.measured);
        fs::write(folder.path().join("crowd.json"), "{}").unwrap();
        let error = read_all(folder.path()).unwrap_err().to_string();
        assert!(error.contains("crowd.json is no result"), "{error}");
        assert!(read_all(&folder.path().join("nowhere")).unwrap().is_empty());
    }
}
