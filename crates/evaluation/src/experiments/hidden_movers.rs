//! What do hidden movers cost? (Sudarsky & Gotsman 1997, fig 5), for the server of a dense interior, and the messages that
//! temporal bounding volumes save beside telling everybody everything.
//!
//! A house of 32 × 32 rooms of 4 m that each see themselves and the four beside them. Some movers walk about in rooms where somebody
//! looks on, all others in rooms where nobody does. *Update all* is the same server without volumes: every owner speaks
//! each tick. With volumes it is looked at for longer than one lasts, so that each is renewed once.

mod house;

use serde::{Deserialize, Serialize};

use self::house::{ROOM_M, ROOMS, TICKS, TICKS_OF_A_VOLUME, simulate, simulate_aside, simulate_walk};
use crate::{
    host::Host,
    page::{
        Comparison, Goal, Plot, Row, Section, Table,
        chart::{Axis, Chart, Series},
        count,
    },
    papers::sudarsky::{FIGURE_5, WITH_VOLUMES, WITHOUT},
};

/// Numbers of hidden movers; the charts of the paper go up to a few hundred.
const HIDDEN: [u32; 5] = [0, 100, 1_000, 10_000, 100_000];
/// Movers that can be seen.
const VISIBLE: u32 = 100;
/// Ways of walkers from where nobody is hidden to where everybody is most of the time.
const BEYOND_M: [f64; 6] = [-2.0, -1.0, -0.5, 0.0, 0.5, 1.0];
/// Participants who look on in silence: ten in each row of rooms.
const PEOPLE: u32 = 10 * ROOMS;
/// Where volumes gain nothing, they may cost so much.
const MOST_OVERHEAD: f64 = 1.05;
/// “Almost constant”: with the most hidden movers, a tick costs at most so many times what it costs without any.
const ALMOST_CONSTANT: f64 = 5.0;

/// What was measured.
#[derive(Debug, Serialize, Deserialize)]
pub struct Measured {
    /// Movers that can be seen.
    pub visible: u32,
    /// For each number of hidden movers.
    pub rows: Vec<Cost>,
    /// A participant in each room, for ten seconds.
    pub messages: Messages,
    /// Where few or none are hidden, and volumes can gain little.
    #[serde(default)]
    pub mixes: Vec<Mix>,
    /// Participants who state where they go and look on from there in silence.
    #[serde(default)]
    pub walks: Option<Walks>,
}

/// Participants who walk through rooms, where others see most of them.
#[derive(Debug, Serialize, Deserialize)]
pub struct Walks {
    /// How many.
    pub people: u32,
    /// CPU of a tick with volumes, of one without, of those who look on in silence: the median of runs that took turns.
    pub volumes: f64,
    /// CPU of a tick when they look on in silence, of one when they speak each tick, with volumes.
    pub silence: f64,
    /// Poses that come in, of those when they speak each tick.
    pub poses: f64,
}

/// Walkers about the border of what is seen.
#[derive(Debug, Serialize, Deserialize)]
pub struct Mix {
    /// How far the middle of their ways is beyond the border, metres; each goes a metre to either side.
    pub beyond_m: f64,
    /// CPU of a tick with volumes, of one without: the median of runs that took turns.
    pub ratio: f64,
}

/// A tick of the server: CPU in microseconds, and poses that come in.
#[derive(Debug, Serialize, Deserialize)]
pub struct Cost {
    /// Movers that nobody sees.
    pub hidden: u32,
    /// With volumes.
    pub with_us: f64,
    /// Poses.
    pub with_poses: f64,
    /// Without.
    pub without_us: f64,
    /// Poses.
    pub without_poses: f64,
}

/// Poses told.
#[derive(Debug, Serialize, Deserialize)]
pub struct Messages {
    /// Participants.
    pub participants: u64,
    /// When everybody hears of everybody.
    pub broadcast: u64,
    /// By our rules.
    pub told: u64,
}

/// Which of two runs comes first matters by a few percent, so they take turns.
const TURNS: usize = 9;
const TICKS_OF_A_TURN: u32 = 300;

/// What the first takes of what the second does: the median of runs that take turns.
fn ratio(first: impl Fn() -> f64, second: impl Fn() -> f64) -> f64 {
    let turn = |i: usize| {
        if i.is_multiple_of(2) {
            let first = first();
            first / second()
        } else {
            let second = second();
            first() / second
        }
    };
    let mut ratios: Vec<_> = (0..TURNS).map(turn).collect();
    ratios.sort_by(f64::total_cmp);
    ratios[TURNS / 2]
}

/// CPU of a tick with volumes of one without, of walkers about the border of what is seen.
fn mix(beyond_m: f64) -> Mix {
    let homes = [1; VISIBLE as usize];
    let tick_us = |volumes| simulate_aside(&homes, 0.5 * ROOM_M + beyond_m, volumes, TICKS_OF_A_TURN).tick_us;
    Mix {
        beyond_m,
        ratio: ratio(|| tick_us(true), || tick_us(false)),
    }
}

/// The same of participants who look on from where they go.
fn walks(people: u32) -> Walks {
    let walk = |states, volumes| simulate_walk(people, states, volumes, TICKS_OF_A_TURN);
    let [silent, speaking] = [true, false].map(|states| walk(states, true).poses_in);
    Walks {
        people,
        volumes: ratio(|| walk(true, true).tick_us, || walk(true, false).tick_us),
        silence: ratio(|| walk(true, true).tick_us, || walk(false, true).tick_us),
        poses: silent / speaking,
    }
}

/// Measures.
///
/// # Errors
/// None; movers that cannot be made end the program.
pub fn run(host: &Host) -> anyhow::Result<Measured> {
    let mut rows = Vec::new();
    for hidden in HIDDEN {
        host.say(&format!("{hidden} hidden movers"));
        // The observer sees rooms 0, 1 and 32; the hidden ones walk far from there.
        let far = (0..hidden).map(|i| 128 + i % (ROOMS * ROOMS - 128));
        let homes: Vec<_> = (0..VISIBLE).map(|i| i % 2).chain(far).collect();
        let ours = simulate(&homes, false, true, TICKS_OF_A_VOLUME);
        let all = simulate(&homes, false, false, TICKS);
        rows.push(Cost {
            hidden,
            with_us: ours.tick_us,
            with_poses: ours.poses_in,
            without_us: all.tick_us,
            without_poses: all.poses_in,
        });
    }
    let homes: Vec<_> = (0..ROOMS * ROOMS).collect();
    host.say(&format!("{} participants", homes.len()));
    let participants = homes.len() as u64;
    Ok(Measured {
        visible: VISIBLE,
        rows,
        messages: Messages {
            participants,
            broadcast: u64::from(TICKS) * participants * (participants - 1),
            told: simulate(&homes, true, true, TICKS).told,
        },
        mixes: BEYOND_M.map(mix).into(),
        walks: Some(walks(PEOPLE)),
    })
}

/// What it says.
#[must_use]
pub fn section(measured: &Measured) -> Section {
    let base = measured
        .rows
        .first()
        .map_or([f64::NAN; 2], |cost| [cost.with_us, cost.without_us]);
    let times = |us: f64, base: f64| format!("{us:.0} µs, {:.1}×", us / base);
    let row = |cost: &Cost| Row {
        what: count(u64::from(cost.hidden)),
        paper: format!("{WITH_VOLUMES} with volumes; {WITHOUT} without"),
        ours: vec![
            times(cost.with_us, base[0]),
            format!("{:.0}", cost.with_poses),
            times(cost.without_us, base[1]),
            format!("{:.0}", cost.without_poses),
        ],
        why: vec![0, 1],
    };
    let curve = |of: &dyn Fn(&Cost) -> f64| {
        let points = measured.rows.iter().filter(|cost| cost.hidden > 0);
        points
            .map(|cost| [f64::from(cost.hidden), of(cost)])
            .collect::<Vec<_>>()
    };
    let chart = Chart {
        title: "Cost of a tick against the number of hidden movers".to_owned(),
        x: Axis::log("hidden movers"),
        y: Axis::log("CPU of a tick, µs"),
        right: None,
        series: vec![
            Series::new("update all", 1, curve(&|cost| cost.without_us)).dashed(),
            Series::new("with temporal bounding volumes", 0, curve(&|cost| cost.with_us)),
        ],
    };
    let growth = |i: usize| {
        measured
            .rows
            .last()
            .map_or(f64::NAN, |cost| [cost.with_us, cost.without_us][i] / base[i])
    };
    let messages = &measured.messages;
    Section {
        how: vec![format!(
            "CPU of a tick of the server with the poses that come in, {} visible movers and one participant. With volumes, that is the mean over ten minutes and a bit, in which each volume is renewed once. \
             Multiples are of the first row.",
            measured.visible
        )],
        comparisons: vec![Comparison {
            source: FIGURE_5,
            of: "hidden movers",
            ours: ["with volumes", "poses in a tick", "update all", "poses in a tick"].map(str::to_owned).into(),
            rows: measured.rows.iter().map(row).collect(),
        }],
        tables: [Table {
            caption: format!("Poses told in ten seconds to {} participants, one in each room (the paper's §2.4 has no numbers)", count(messages.participants)),
            head: ["everybody hears everybody", "Belvedere"].map(str::to_owned).into(),
            rows: vec![vec![count(messages.broadcast), count(messages.told)]],
        }]
        .into_iter()
        .chain(mixes(&measured.mixes))
        .chain(measured.walks.as_ref().map(walks_table))
        .collect(),
        plots: vec![Plot {
            file: "fig5.svg".to_owned(),
            caption: "After fig 5: CPU of a tick against hidden movers".to_owned(),
            svg: chart.to_svg(),
        }],
        reasons: vec![
            "The paper measures frames of a renderer and gives a curve without numbers; ours is the server, which decides who hears of whom. What compares is the shape.".to_owned(),
            "What is left to grow are renewals: every hidden mover speaks once in the ten minutes that a volume may last. The paper's men are not said to be renewed.".to_owned(),
        ],
        goals: vec![
            Goal::at_most(
                format!("growth of a tick from no hidden movers to {}, with volumes", count(u64::from(HIDDEN[HIDDEN.len() - 1]))),
                ALMOST_CONSTANT,
                growth(0),
                |x| format!("{x:.1}×"),
            ),
            Goal::at_most("… of what it grows to when all are updated", 0.01, growth(0) / growth(1), |x| format!("{:.2} %", 100.0 * x)),
        ]
        .into_iter()
        .chain(overhead(measured))
        .collect(),
    }
}

fn mixes(mixes: &[Mix]) -> Option<Table> {
    let row = |mix: &Mix| vec![format!("{:.1} m", mix.beyond_m), format!("{:.2}×", mix.ratio)];
    (!mixes.is_empty()).then(|| Table {
        caption: format!("Where volumes can gain little: {VISIBLE} walkers who go to and fro by a metre about a line beside the border of what is seen"),
        head: ["line beyond the border", "CPU of a tick with volumes, of one without"].map(str::to_owned).into(),
        rows: mixes.iter().map(row).collect(),
    })
}

fn walks_table(walks: &Walks) -> Table {
    let head = [
        "poses that come in, of those who speak each tick",
        "CPU of a tick, of that when they speak each tick",
        "with volumes, of one without",
    ];
    Table {
        caption: format!(
            "{} participants who walk through rooms in a row, state where they go, speak once a second, and look on from where they have come to",
            walks.people
        ),
        head: head.map(str::to_owned).into(),
        rows: vec![vec![
            format!("{:.0} %", 100.0 * walks.poses),
            format!("{:.2}×", walks.silence),
            format!("{:.2}×", walks.volumes),
        ]],
    }
}

fn overhead(measured: &Measured) -> Option<Goal> {
    let mixes = measured.mixes.iter().map(|mix| mix.ratio);
    let worst = mixes
        .chain(measured.walks.as_ref().map(|walks| walks.volumes))
        .reduce(f64::max)?;
    Some(Goal::at_most(
        "a tick with volumes, of one without, in any mix",
        MOST_OVERHEAD,
        worst,
        |x| format!("{x:.2}×"),
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn who_states_where_it_goes_speaks_seldom_and_is_told_of_others_all_the_same() {
        let [silent, speaking] = [true, false].map(|states| simulate_walk(PEOPLE, states, false, 30));
        assert!(
            silent.poses_in * 5.0 < speaking.poses_in,
            "{} {}",
            silent.poses_in,
            speaking.poses_in
        );
        assert!(silent.told > 0);
    }
}
