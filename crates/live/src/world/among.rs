//! What does a session see of the crowd that it stands in? Kept until the participant has moved on ([`crate::crowd`]); it decides
//! how closely each mover is followed, and whether it is at all.

use belvedere_scene::object::Level;

use super::{World, mover::Mover, session::Session, sight::Judge};
use crate::{
    Ms,
    cells::distance_m,
    crowd::{Crowding, Spot, View},
    event::{Attention, SessionId},
    pace,
};

/// Who is not told of comes back only when clearly more of it is seen.
pub const BACK: f64 = 1.5;

/// What was seen of the crowd, from where and when.
#[derive(Debug)]
pub(super) struct Among {
    view: View,
    from: [f64; 3],
    at_ms: Ms,
}

impl World {
    /// Looks around in the crowd, for those who have moved on or have not for a while.
    pub(super) fn look_around(&mut self, now_ms: Ms) {
        let (Some(crowding), Some(crowd)) = (self.rules.crowd, &mut self.crowd) else {
            return;
        };
        // Whoever has not moved, and has no crowd around, still has none while nobody has come into another cell.
        let all = std::mem::take(&mut self.somebody_came);
        let some = self.in_crowd.union(&self.stirred_sessions).copied();
        let sessions: Vec<_> = if all {
            self.sessions.keys().copied().collect()
        } else {
            some.collect()
        };
        for id in sessions {
            let Some(session) = self.sessions.get_mut(&id) else {
                continue;
            };
            let near = session
                .eye
                .watched
                .iter()
                .map(|cell| self.movers_in[cell.index()].len());
            if near.sum::<usize>() < crowding.least {
                session.among = None;
                self.in_crowd.remove(&id);
                continue;
            }
            self.in_crowd.insert(id);
            let eye = session.eye.position;
            let holds = |among: &Among| {
                distance_m(among.from, eye) <= crowding.moved_m && now_ms - among.at_ms < crowding.lasts_ms
            };
            if session.among.as_deref().is_some_and(holds) {
                continue;
            }
            session.unsettle(id, &mut self.unsettled);
            session.among = Some(Box::new(Among {
                view: View::from(crowd, eye, session.aoi.leave_m),
                from: eye,
                at_ms: now_ms,
            }));
            if crowding.cull_below > 0.0 {
                self.stirred_sessions.insert(id);
            }
        }
    }

    /// How closely a session follows a mover from now on.
    pub(super) fn attention(&self, id: SessionId, mover: &Mover, away_m: f64, now_ms: Ms) -> Attention {
        let (session, position) = (&self.sessions[&id], mover.position_at(now_ms));
        let spot = self.crowd.as_ref().map(|crowd| crowd.spot(position));
        let visibility = visibility(session.among.as_deref(), spot.as_ref());
        attention(mover, away_m, visibility, self.rules.tick_ms)
    }
}

impl Judge<'_> {
    /// Where somebody is in the crowd, if one may be lost in it.
    pub(super) fn spot(&self, at: [f64; 3]) -> Option<Spot> {
        let culls = self.cull_below() > 0.0;
        self.crowd.filter(|_| culls).map(|crowd| crowd.spot(at))
    }

    /// Whether so little of what is there is seen that the session need not be told of it.
    pub(super) fn is_lost_in_crowd(&self, session: &Session, spot: Option<&Spot>, told: bool) -> bool {
        let least = if told { 1.0 } else { BACK } * self.cull_below();
        let visibility = visibility(session.among.as_deref(), spot);
        visibility.is_some_and(|visibility| visibility < least)
    }

    fn cull_below(&self) -> f64 {
        self.rules.crowd.map_or(0.0, |crowding: Crowding| crowding.cull_below)
    }
}

/// The share of somebody that a session sees; none when it stands in no crowd.
pub(super) fn visibility(among: Option<&Among>, spot: Option<&Spot>) -> Option<f64> {
    let visibility = among?.view.of(spot?);
    Some((visibility * 100.0).round() / 100.0)
}

/// How closely a mover is followed that is so far away, and of which so much is seen.
pub(super) fn attention(mover: &Mover, away_m: f64, visibility: Option<f64>, tick_ms: Ms) -> Attention {
    let as_far_m = pace::as_far_m(away_m, visibility.unwrap_or(1.0));
    let levels = mover.look.model.as_deref().map_or(&[][..], |model| &model.levels);
    let will_do = |level: &&Level| level.switch_distance_m <= as_far_m;
    let level = levels.iter().rev().find(will_do).or(levels.first());
    Attention {
        period_ms: pace::period_ms(as_far_m, tick_ms),
        visibility,
        level: visibility.and(level).map(|level| level.level),
    }
}
