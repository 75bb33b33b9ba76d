//! Whom do visitors meet on the way? Each opens a live session, and all walk in real time, which is what a live server is tested
//! with.

use std::{sync::Arc, time::Duration};

use anyhow::Context;
use belvedere_client::{
    HttpSource,
    live::{Participant, Session},
    tour::{Echoes, Latency, Meeting, Script, meeting},
};
use belvedere_scene::SceneName;
use serde::Serialize;
use tokio::task::JoinSet;

use crate::open_files;

/// Visitors do not come all at once: each so much after the one before.
const APART: Duration = Duration::from_millis(5);
/// Connections of a visitor: the stream, and a pose on its way.
const CONNECTIONS: usize = 2;
/// No promise of a speed is higher.
const FASTEST_MPS: f64 = 100.0;

/// What became of it.
#[derive(Debug, Serialize)]
pub(super) struct Live {
    #[serde(flatten)]
    meeting: Meeting,
    /// How many poses of one visitor another was told, …
    delays: u64,
    /// … and how much later than they were said; null when nobody met anybody.
    delay_ms: Option<Latency>,
}

/// Fails where nobody can be met, before anybody sets out.
pub(super) async fn ensure_offered(source: &HttpSource, scene: &SceneName, sessions: usize) -> anyhow::Result<()> {
    let offered = Session::offered(source.clone(), scene, Participant::default()).await?;
    anyhow::ensure!(
        offered.is_some(),
        "`{scene}` offers no live sessions there: plain files, as of nginx or a bucket, have none; name a Belvedere server, or walk without --live on"
    );
    let wanted = CONNECTIONS * sessions;
    let room = open_files::room_for(wanted);
    anyhow::ensure!(
        room == wanted,
        "{sessions} live sessions take {wanted} connections, and the system has room for {room}: raise `ulimit -n`, or take at most {} --sessions",
        room / CONNECTIONS
    );
    Ok(())
}

/// Sends everybody along their ways.
pub(super) async fn meet(source: &HttpSource, scene: &SceneName, scripts: &[Script]) -> anyhow::Result<Live> {
    let echoes = Arc::new(Echoes::default());
    let mut visitors = JoinSet::new();
    for (number, script) in (0..).zip(scripts) {
        let (source, scene, script, echoes) = (source.clone(), scene.clone(), script.clone(), echoes.clone());
        let who = Participant {
            name: Some(format!("visitor {}", number + 1)),
            max_speed_mps: script.fastest_mps().clamp(1.0, FASTEST_MPS),
            ..Participant::default()
        };
        visitors.spawn(async move {
            tokio::time::sleep(APART * number).await;
            meeting::meet(source, &scene, &script, who, &echoes).await
        });
    }
    let mut all = Meeting::default();
    while let Some(met) = visitors.join_next().await {
        let met = met??.context("the scene has stopped to offer live sessions")?;
        all = all.and(met);
    }
    let delays = echoes.delays();
    Ok(Live {
        meeting: all,
        delays: delays.map_or(0, |(count, _)| count),
        delay_ms: delays.map(|(_, latency)| latency),
    })
}

impl Live {
    /// Fails when nobody got in.
    pub(super) fn ensure_inside(&self) -> anyhow::Result<()> {
        let why = self
            .meeting
            .first_failures
            .first()
            .map_or("nobody answered in time", String::as_str);
        anyhow::ensure!(self.meeting.inside > 0, "no live session could be opened: {why}");
        Ok(())
    }

    /// Rows of the table.
    pub(super) fn rows(&self) -> Vec<Vec<String>> {
        let row = |name: &str, value: String| vec![name.to_owned(), value];
        let met = &self.meeting;
        let mut rows = vec![
            row(
                "live sessions opened, of visitors",
                format!("{}, {}", met.opened, met.inside),
            ),
            row("others met, each once for each visitor", met.movers_met.to_string()),
            row("events; poses in them", format!("{}; {}", met.events, met.poses_told)),
            row(
                "poses said; not said because nobody might look",
                format!("{}; {}", met.poses_said, met.poses_hushed),
            ),
            row(
                "  … moments at which others knew; nothing could be said",
                format!("{}; {}", met.poses_known, met.poses_waited),
            ),
            row(
                "resyncs, streams cut, sessions lost",
                format!("{}, {}, {}", met.resyncs, met.cuts, met.lost),
            ),
            row(
                "from said to heard, half and 99 of 100 below",
                self.delay_ms.map_or_else(
                    || "nobody heard anybody".to_owned(),
                    |delay| format!("{:.0} ms, {:.0} ms", delay.p50, delay.p99),
                ),
            ),
        ];
        if met.late_frames > 0 {
            rows.push(row("moments that came too late here", met.late_frames.to_string()));
        }
        let wrong = met.failures + met.cuts + met.lost;
        if wrong > 0 {
            rows.push(row("went wrong in live sessions", wrong.to_string()));
        }
        rows
    }

    /// What went wrong first.
    pub(super) fn first_failures(&self) -> &[String] {
        &self.meeting.first_failures
    }
}
