//! How are runs shown? Medians of each server, and beside them the median of the ratios of runs that stood beside each other.

use super::runs::Outcome;

/// A server's runs of one kind.
#[derive(Debug)]
pub struct Column {
    /// The server.
    pub name: String,
    /// What is published, in words.
    pub what: String,
    /// Events that one event stands for, where that is more than one.
    pub updates: usize,
    /// In the order in which they ran.
    pub runs: Vec<Outcome>,
}

/// Rows of a table in Markdown; ratios are to the last column.
#[must_use]
pub fn markdown(columns: &[Column]) -> String {
    let mut text = String::from(
        "| server | published | events/s | updates/s | p50 ms | p99 ms | CPU µs/event | lost | merged | memory MB | events/s × | p99 × | CPU × |\n\
         |---|---|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|\n",
    );
    let base = columns.last();
    for column in columns {
        let of = |value: fn(&Outcome) -> f64| median(column.runs.iter().map(value));
        let ratio = |value: fn(&Outcome) -> f64| {
            let pairs = base.into_iter().flat_map(|base| column.runs.iter().zip(&base.runs));
            median(pairs.map(|(ours, theirs)| value(ours) / value(theirs)))
        };
        let events_per_s = of(|run| run.events_per_s);
        text += &format!(
            "| {} | {} | {:.0} | {:.0} | {:.1} | {:.1} | {:.2} | {:.0} | {:.0} | {:+.1} | {:.2} | {:.2} | {:.2} |\n",
            column.name,
            column.what,
            events_per_s,
            events_per_s * column.updates as f64,
            of(|run| run.p50_ms),
            of(|run| run.p99_ms),
            of(|run| run.cpu_us),
            of(|run| run.lost as f64),
            of(|run| run.merged as f64),
            of(|run| run.grown_bytes) / 1e6,
            ratio(|run| run.events_per_s),
            ratio(|run| run.p99_ms),
            ratio(|run| run.cpu_us),
        );
    }
    text
}

/// The middle one; not a number when there is none.
pub fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut values: Vec<_> = values.collect();
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ratios_are_those_of_runs_beside_each_other() {
        let run = |events_per_s| Outcome {
            events_per_s,
            p50_ms: 1.0,
            p99_ms: 2.0,
            lost: 0,
            merged: 0,
            cpu_us: 3.0,
            grown_bytes: 0.0,
        };
        let column = |name: &str, runs: &[f64]| Column {
            name: name.to_owned(),
            what: "x".to_owned(),
            updates: 20,
            runs: runs.iter().copied().map(run).collect(),
        };
        // The machine was twice as busy in the second round.
        let text = markdown(&[column("a", &[200.0, 100.0, 202.0]), column("b", &[100.0, 50.0, 101.0])]);
        assert!(text.contains("| a | x | 200 | 4000 |"), "{text}");
        assert_eq!(text.matches("| 2.00 | 1.00 | 1.00 |").count(), 1, "{text}");
    }
}
