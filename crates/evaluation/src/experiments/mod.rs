//! Which experiments are there? One module each: its question, a run that gives a result, and a section that a result becomes.

pub mod crowd;
pub mod hidden_movers;
pub mod indoors;
pub mod neighbourhoods;
pub mod network_load;
pub mod octree_levels;
pub mod outdoors;
pub mod rules;
pub mod smooth_progress;
pub mod smooth_sizes;
pub mod walks;

use serde::{Serialize, de::DeserializeOwned};
use serde_json::Value;

use crate::{host::Host, page::Section};

/// An experiment.
pub struct Experiment {
    /// Its name for `--only` and for the file of its result.
    pub id: &'static str,
    /// Its heading.
    pub title: &'static str,
    /// Tables and figures of the papers that it repeats.
    pub repeats: &'static [&'static str],
    /// Measures.
    pub run: fn(&Host) -> anyhow::Result<Value>,
    /// Makes a section of what was measured.
    pub section: fn(&Value) -> anyhow::Result<Section>,
}

/// A result as JSON.
fn ran<T: Serialize>(measured: anyhow::Result<T>) -> anyhow::Result<Value> {
    Ok(serde_json::to_value(measured?)?)
}

/// A result from JSON.
fn shown<T: DeserializeOwned>(value: &Value, section: fn(&T) -> Section) -> anyhow::Result<Section> {
    Ok(section(&T::deserialize(value)?))
}

macro_rules! experiment {
    ($module:ident, $id:literal, $title:literal, $repeats:expr) => {
        Experiment {
            id: $id,
            title: $title,
            repeats: $repeats,
            run: |host| ran($module::run(host)),
            section: |value| shown(value, $module::section),
        }
    };
}

/// All of them, in the order of the page.
pub const ALL: [Experiment; 10] = [
    experiment!(
        network_load,
        "table2",
        "Load with level management",
        &["thesis table 2", "thesis fig 20"]
    ),
    experiment!(
        octree_levels,
        "table3",
        "Levels of the octree",
        &["thesis table 3", "thesis table 4"]
    ),
    experiment!(smooth_sizes, "table7", "Sizes of smooth LODs", &["thesis table 7"]),
    experiment!(
        smooth_progress,
        "fig35",
        "Smooth LODs as they come",
        &["thesis fig 35", "thesis fig 36"]
    ),
    experiment!(rules, "rules", "Rules for geometry", &["thesis §8.6"]),
    experiment!(
        neighbourhoods,
        "cohen-or",
        "What a street cell does not see",
        &["Cohen-Or table 1", "Cohen-Or table 2"]
    ),
    experiment!(indoors, "marvie", "Buildings on a slow line", &["Marvie table 1"]),
    experiment!(outdoors, "town", "A town on a slower line", &["Marvie fig 9"]),
    experiment!(hidden_movers, "sudarsky", "Hidden movers", &["Sudarsky fig 5"]),
    experiment!(crowd, "crowd", "A crowd", &["crowd fig 1"]),
];

#[cfg(test)]
mod tests {
    use std::{collections::BTreeSet, path::Path};

    use super::*;

    /// What is to be repeated: every table and figure that the papers' results stand in.
    const WANTED: [&str; 13] = [
        "thesis table 2",
        "thesis fig 20",
        "thesis table 3",
        "thesis table 4",
        "thesis table 7",
        "thesis fig 35",
        "thesis fig 36",
        "thesis §8.6",
        "Cohen-Or table 1",
        "Cohen-Or table 2",
        "Marvie table 1",
        "Marvie fig 9",
        "Sudarsky fig 5",
    ];

    #[test]
    fn every_table_and_figure_has_an_experiment() {
        let repeated: BTreeSet<_> = ALL.iter().flat_map(|e| e.repeats).copied().collect();
        let missing: Vec<_> = WANTED
            .iter()
            .chain(&["crowd fig 1"])
            .filter(|w| !repeated.contains(*w))
            .collect();
        assert!(missing.is_empty(), "{missing:?}");
        let ids: BTreeSet<_> = ALL.iter().map(|e| e.id).collect();
        assert_eq!(ids.len(), ALL.len());
    }

    /// The results that are kept beside the page can be read, explain every row, and make the page that is kept.
    #[test]
    fn kept_results_make_the_kept_page() {
        let docs = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs");
        let results = crate::results::read_all(&docs.join("evaluation")).unwrap();
        for experiment in &ALL {
            let Some(result) = results.get(experiment.id) else {
                continue;
            };
            let section =
                (experiment.section)(&result.measured).unwrap_or_else(|cause| panic!("{}: {cause:#}", experiment.id));
            assert_eq!(section.unexplained(), Vec::<&str>::new(), "{}", experiment.id);
            assert!(!section.comparisons.is_empty(), "{}", experiment.id);
            assert!(
                section.comparisons.iter().all(|comparison| !comparison.rows.is_empty()),
                "{}",
                experiment.id
            );
        }
        let page = crate::document::render(&results).unwrap();
        let kept = std::fs::read_to_string(docs.join("EVALUATION.md")).unwrap();
        assert!(
            page.markdown == kept,
            "docs/EVALUATION.md is not what its results say: run `make evaluation EVALUATION=--render`"
        );
        for plot in &page.plots {
            let kept = std::fs::read_to_string(docs.join("evaluation").join(&plot.file)).unwrap();
            assert!(plot.svg == kept, "{} is not what its results say", plot.file);
        }
    }
}
