//! How do results become docs/EVALUATION.md? All goals first, then a section for each experiment.

use std::collections::BTreeMap;

use anyhow::Context;

use crate::{
    experiments::ALL,
    page::{Goal, Plot, goals, push},
    results::Kept,
};

/// The folder of pictures and results, beside the page.
pub const FOLDER: &str = "evaluation";

/// The page and its pictures.
#[derive(Debug)]
pub struct Document {
    /// The page.
    pub markdown: String,
    /// Its pictures.
    pub plots: Vec<Plot>,
}

/// Renders the page. An experiment that was not run says so.
///
/// # Errors
/// When a result is not one of its experiment.
pub fn render(results: &BTreeMap<String, Kept>) -> anyhow::Result<Document> {
    let (mut sections, mut plots, mut all) = (String::new(), Vec::new(), Vec::<(&str, Goal)>::new());
    for experiment in &ALL {
        push(&mut sections, &format!("## {}", experiment.title));
        let repeats = experiment.repeats.join(", ");
        let Some(kept) = results.get(experiment.id) else {
            push(
                &mut sections,
                &format!(
                    "Would repeat {repeats}. **Not measured yet**: `make evaluation EVALUATION='--only {}'`.",
                    experiment.id
                ),
            );
            continue;
        };
        let section = (experiment.section)(&kept.measured).with_context(|| {
            format!(
                "the result of {0} is not of this version; measure it again with `--only {0}`",
                experiment.id
            )
        })?;
        push(
            &mut sections,
            &format!(
                "Repeats {repeats}. Measured in {:.0} s by a {} build of `{}` on {} cores: `make evaluation EVALUATION='--only {}'`.",
                kept.seconds, kept.build, kept.sources, kept.cores, experiment.id
            ),
        );
        sections.push_str(&section.to_markdown(FOLDER));
        all.extend(section.goals.into_iter().map(|goal| (experiment.title, goal)));
        plots.extend(section.plots);
    }
    let mut markdown = String::new();
    push(&mut markdown, "<!-- Written by `make evaluation`; do not edit. -->");
    push(&mut markdown, "# Evaluation");
    push(
        &mut markdown,
        "What the papers that Belvedere builds on measured, measured again: their numbers, ours, and why they differ. Our numbers come from runs, whose results stand in \
         `docs/evaluation/*.json`; theirs are stated once, in `crates/evaluation/src/papers.rs`. `make evaluation` runs everything and writes this page; \
         `EVALUATION='--only table2,marvie'` runs a part, `EVALUATION=--render` none. Times are those of a shared machine, so read ratios rather than seconds.",
    );
    let met = all.iter().filter(|(_, goal)| goal.met).count();
    push(
        &mut markdown,
        &format!("## Goals\n\n{met} of {} are met. Missed:", all.len()),
    );
    let missed: Vec<_> = all
        .into_iter()
        .filter(|(_, goal)| !goal.met)
        .map(|(title, goal)| Goal {
            what: format!("{title}: {}", goal.what),
            ..goal
        })
        .collect();
    push(
        &mut markdown,
        &if missed.is_empty() {
            "none.".to_owned()
        } else {
            goals(&missed)
        },
    );
    markdown.push_str(&sections);
    Ok(Document {
        markdown: markdown.trim_end().to_owned() + "\n",
        plots,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn kept(experiment: &str, measured: serde_json::Value) -> BTreeMap<String, Kept> {
        let kept = Kept {
            experiment: experiment.to_owned(),
            sources: "abc".to_owned(),
            build: "release".to_owned(),
            cores: 2,
            seconds: 3.0,
            measured,
        };
        [(experiment.to_owned(), kept)].into()
    }

    #[test]
    fn what_was_not_run_is_on_the_page_and_says_so() {
        let page = render(&BTreeMap::new()).unwrap();
        for experiment in &ALL {
            assert!(
                page.markdown.contains(&format!("## {}\n", experiment.title)),
                "{}",
                experiment.id
            );
        }
        for repeated in ALL.iter().flat_map(|experiment| experiment.repeats) {
            assert!(page.markdown.contains(repeated), "{repeated}");
        }
        assert_eq!(page.markdown.matches("**Not measured yet**").count(), ALL.len());
        assert!(page.markdown.contains("0 of 0 are met"));
    }

    #[test]
    fn a_result_becomes_numbers_and_missed_goals_are_told_first() {
        let model = |bytes: u64| serde_json::json!({"file": "x.dcg", "rule_bytes": 1000, "explicit_bytes": bytes, "triangles": 5});
        let measured = serde_json::json!({"models": [model(90_000), model(20_000), model(90_000_000)]});
        let page = render(&kept("rules", measured)).unwrap();
        assert!(page.markdown.contains("2 of 3 are met"), "{}", page.markdown);
        assert!(
            page.markdown
                .contains("| conifer / x.dcg | 7,418 B for 442,708 B, 60× | 1,000 B for 20,000 B | 20× | 5 | 1 |")
        );
        let [goals, section] = ["## Goals", "## Rules"].map(|heading| page.markdown.find(heading).unwrap());
        let told = page
            .markdown
            .find("| Rules for geometry: conifer: geometry for each byte of rules | ≥ 60× | 20× | **missed** |");
        assert!(told.is_some_and(|told| goals < told && told < section));
    }

    #[test]
    fn a_result_of_another_version_is_refused_by_name() {
        let error = render(&kept("rules", serde_json::json!({"models": 3})))
            .unwrap_err()
            .to_string();
        assert!(error.contains("--only rules"), "{error}");
    }
}
