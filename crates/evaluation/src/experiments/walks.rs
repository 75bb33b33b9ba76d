//! What do visitors on slow lines get to see? Worlds are baked, published and walked through, with prefetching and without
//! (Marvie & Bouatouch 2004, §7: table 1 and fig 9).
//!
//! Walks are those of `belvedere walk`: every byte is fetched for real, when it would arrive is computed. So they give the same numbers on
//! any machine.

use std::path::Path;

use anyhow::Context;
use belvedere_client::{
    Client, FolderSource,
    tour::{self, Line, Manner, Outcome, Rambles, Tour, TourSettings},
};
use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::host::Host;

/// Latency of the lines, milliseconds; the paper has none.
pub const LATENCY_MS: f64 = 50.0;

/// How one walks.
#[derive(Debug, Clone, Copy)]
pub struct Way {
    /// Bits a second of the line, and km/h of the visitor.
    pub line: (f64, f64),
    /// Walks, each another way.
    pub walks: u64,
    /// Seconds of each.
    pub seconds: f64,
}

/// A world that was walked through.
#[derive(Debug, Serialize, Deserialize)]
pub struct World {
    /// Its name.
    pub name: String,
    /// Which bake of it, in words.
    pub revision: String,
    /// Triangles of everything at level 0.
    pub triangles: u64,
    /// Objects.
    pub objects: u64,
    /// View cells.
    pub cells: u64,
    /// Bytes of level 0 of everything, as published: the file that one would have to download whole.
    pub whole_bytes: u64,
    /// Walks and seconds of each.
    pub walks: (u64, f64),
    /// Bits a second, and km/h.
    pub line: (f64, f64),
    /// Without prefetching.
    pub without: Walked,
    /// With it.
    pub with: Walked,
    /// With it, where nothing is grown from rules: levels and smooth LODs alone.
    pub without_rules: Walked,
    /// The same within the least memory that holds a cell and its neighbours; not there where that was not measured.
    #[serde(default)]
    pub tight: Option<Tight>,
}

/// What became of walks within little memory.
#[derive(Debug, Serialize, Deserialize)]
pub struct Tight {
    /// The limit, bytes.
    pub limit_bytes: u64,
    /// Quality of the worst frame after all in sight was there for the first time.
    pub min: Option<f64>,
    /// Objects in sight that found no room, summed over frames.
    pub missing: u64,
    /// Bytes: those that went, those of them that came again, and those of these that were near all the time.
    pub bytes: [u64; 3],
    /// Share of objects that were as sharp as the eye can tell; without a limit, and with it.
    pub sharp: [Option<f64>; 2],
}

/// What became of the walks.
#[derive(Debug, Serialize, Deserialize)]
pub struct Walked {
    /// Until all in sight was there for the first time; the mean over walks; none if one never had it.
    pub convergence_s: Option<f64>,
    /// Quality of the worst frame after that …
    pub min: Option<f64>,
    /// … and of the mean frame.
    pub mean: Option<f64>,
    /// Share of these frames with all there.
    pub perfect: Option<f64>,
    /// Bytes: needed, prefetched and used, prefetched and wasted.
    pub bytes: [u64; 3],
    /// Requests.
    pub requests: u64,
    /// Files that could not be had.
    pub failures: u64,
    /// Of the first walk, each second: its time, the worst quality, bytes so far.
    pub seconds: Vec<[f64; 3]>,
}

impl World {
    /// Seconds that the whole file takes.
    #[must_use]
    pub fn whole_s(&self) -> f64 {
        8.0 * self.whole_bytes as f64 / self.line.0
    }
}

impl Walked {
    /// Share of what was prefetched that nobody saw.
    #[must_use]
    pub fn waste(&self) -> f64 {
        let [_, used, wasted] = self.bytes;
        wasted as f64 / ((used + wasted) as f64).max(1.0)
    }
}

/// Walks through a published scene.
///
/// # Errors
/// When the scene cannot be opened.
pub fn walk_through(
    host: &Host,
    data: &Path,
    scene: &str,
    name: &str,
    revision: String,
    way: Way,
) -> anyhow::Result<World> {
    let tree = host.publish(data, scene)?;
    let about = host.inspect(data, scene)?;
    let runtime = tokio::runtime::Builder::new_current_thread().build()?;
    let source = FolderSource::new(&tree);
    let scene_name = scene
        .parse()
        .ok()
        .with_context(|| format!("{scene} is no name of a scene"))?;
    let scripts = runtime.block_on(async {
        let opened = Client::new(source.clone()).open(&scene_name).await?;
        let mut rambles = Rambles::through(&opened, way.line.1 / 3.6, way.seconds);
        let mut scripts = Vec::new();
        for seed in 0..way.walks {
            scripts.push(rambles.script(Manner::Wander, seed << 32 | 1).await?);
        }
        anyhow::Ok(scripts)
    })?;
    let tours = |prefetch: bool, rules: bool, memory_bytes: u64| {
        let within = match memory_bytes {
            u64::MAX => String::new(),
            _ => format!(", within {memory_bytes} bytes"),
        };
        host.say(&format!(
            "{name}: {} walks, prefetch {prefetch}, rules {rules}{within}",
            way.walks
        ));
        let settings = TourSettings {
            line: Line {
                bits_per_s: way.line.0,
                latency_ms: LATENCY_MS,
            },
            prefetch,
            rules,
            memory_bytes,
            ..TourSettings::default()
        };
        let tours = scripts
            .iter()
            .map(|script| runtime.block_on(tour::walk(source.clone(), &scene_name, script, &settings, || ())));
        anyhow::Ok(tours.collect::<Result<Vec<_>, _>>()?)
    };
    let walked = |prefetch: bool, rules: bool| anyhow::Ok(Walked::of(&tours(prefetch, rules, u64::MAX)?));
    let without_rules = tours(true, false, u64::MAX)?;
    let ample = Outcome::of(&without_rules);
    let limit_bytes = ample.memory.needed_bytes;
    let tight = Tight::of(limit_bytes, &ample, &Outcome::of(&tours(true, false, limit_bytes)?));
    let whole = &about["levels"][0];
    Ok(World {
        name: name.to_owned(),
        revision,
        triangles: number(&whole["triangles"])?,
        whole_bytes: number(&whole["bytes"])?,
        objects: number(&about["report"]["objects"])?,
        cells: number(&about["report"]["cells"])?,
        walks: (way.walks, way.seconds),
        line: way.line,
        without: walked(false, true)?,
        with: walked(true, true)?,
        without_rules: Walked::of(&without_rules),
        tight: Some(tight),
    })
}

fn number(value: &Value) -> anyhow::Result<u64> {
    value
        .as_u64()
        .with_context(|| format!("`inspect` gives {value} where a number was expected"))
}

impl Tight {
    fn of(limit_bytes: u64, ample: &Outcome, tight: &Outcome) -> Self {
        let memory = &tight.memory;
        Self {
            limit_bytes,
            min: tight.quality.min,
            missing: memory.missing,
            bytes: [memory.evicted_bytes, memory.again_bytes, memory.cycle_bytes],
            sharp: [ample.sharp, tight.sharp],
        }
    }
}

impl Walked {
    fn of(tours: &[Tour]) -> Self {
        let outcome = Outcome::of(tours);
        let settled = tours.iter().flat_map(|tour| {
            let from_ms = tour.converged_ms.unwrap_or(f64::INFINITY);
            tour.frames.iter().filter(move |frame| frame.t_ms >= from_ms)
        });
        let (perfect, frames) = settled.fold((0u64, 0u64), |(perfect, all), frame| {
            (perfect + u64::from(frame.missing == 0), all + 1)
        });
        let causes = outcome.bytes;
        Self {
            convergence_s: outcome.convergence_s,
            min: outcome.quality.min,
            mean: outcome.quality.mean,
            perfect: (frames > 0).then(|| perfect as f64 / frames as f64),
            bytes: [causes.needed, causes.prefetched_used, causes.prefetched_wasted],
            requests: outcome.requests,
            failures: outcome.lost_files,
            seconds: tours.first().map_or_else(Vec::new, seconds),
        }
    }
}

/// A tour second by second.
fn seconds(tour: &Tour) -> Vec<[f64; 3]> {
    let mut all: Vec<[f64; 3]> = Vec::new();
    for frame in &tour.frames {
        let second = (frame.t_ms / 1000.0).floor();
        match all.last_mut().filter(|[t, ..]| *t == second) {
            Some([_, quality, bytes]) => (*quality, *bytes) = (quality.min(frame.quality), frame.bytes as f64),
            None => all.push([second, frame.quality, frame.bytes as f64]),
        }
    }
    all
}

#[cfg(test)]
mod tests {
    use belvedere_client::tour::Frame;

    use super::*;

    fn tour(converged_ms: Option<f64>) -> Tour {
        let frame = |t_ms: f64, quality: f64, missing: u32, bytes: u64| Frame {
            t_ms,
            quality,
            missing,
            bytes,
            ..Frame::default()
        };
        Tour {
            frames: vec![
                frame(0.0, 0.0, 9, 0),
                frame(500.0, 1.0, 0, 70),
                frame(1000.0, 0.5, 2, 90),
                frame(1500.0, 1.0, 0, 95),
            ],
            converged_ms,
            ..Tour::default()
        }
    }

    #[test]
    fn frames_count_from_convergence_on() {
        let walked = Walked::of(&[tour(Some(400.0))]);
        assert_eq!((walked.min, walked.perfect), (Some(0.5), Some(2.0 / 3.0)));
        assert_eq!(walked.seconds, [[0.0, 0.0, 70.0], [1.0, 0.5, 95.0]]);
        let never = Walked::of(&[tour(None)]);
        assert_eq!((never.min, never.perfect, never.convergence_s), (None, None, None));
    }

    #[test]
    fn waste_is_a_share_of_what_was_prefetched() {
        let mut walked = Walked::of(&[]);
        assert_eq!(walked.waste(), 0.0);
        walked.bytes = [1000, 75, 25];
        assert_eq!(walked.waste(), 0.25);
    }
}
