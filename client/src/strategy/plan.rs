//! What should be fetched next of what is visible? A pure function of that, of what is held and of where the eye is, as in
//! `viewer/core/strategy/plan.ts`. The rules stand in `docs/STRATEGY.md`.

use std::collections::{HashMap, HashSet};

use belvedere_scene::ModelId;

use super::{
    file::Key,
    grade::{self, Form, Grade, Stock, goal, step_towards},
    priority::{Cause, Wish},
    sharing::Sharing,
    sight::{Eye, Seen},
};

/// What is known of models while one plans.
pub trait Held: Stock {
    /// What a model is drawn with, if anything.
    fn held(&self, model: ModelId) -> Option<Grade>;
}

/// Everything to fetch of what is visible (largest solid angle first), most urgent first. While an object has nothing at
/// all that could be had, nothing finer is in the plan.
#[must_use]
pub fn plan<'a>(
    visible: impl IntoIterator<Item = &'a Seen> + Clone,
    held: &impl Held,
    eye: &Eye,
    target_px: f64,
) -> Vec<Wish> {
    let mut wishes = first_wishes(visible.clone(), held);
    if !wishes.is_empty() {
        return wishes;
    }
    let mut finer: HashMap<ModelId, Wish> = HashMap::new();
    for seen in visible {
        let Some(wish) = refinement(seen, held, eye, target_px) else {
            continue;
        };
        let known = finer.entry(seen.model).or_insert(wish);
        let priority = known.priority.min(wish.priority);
        if wish.grade.error <= known.grade.error {
            *known = wish;
        }
        known.priority = priority;
    }
    wishes.extend(finer.into_values());
    wishes.sort_by(|a, b| a.priority.total_cmp(&b.priority).then(a.model.cmp(&b.model)));
    wishes
}

/// Something of every model of which nothing is held, each once.
#[must_use]
pub fn first_wishes<'a>(visible: impl IntoIterator<Item = &'a Seen>, held: &impl Held) -> Vec<Wish> {
    let mut named = HashSet::new();
    let waits = |(_, seen): &(usize, &Seen)| held.held(seen.model).is_none() && named.insert(seen.model);
    let waiting: Vec<_> = visible.into_iter().enumerate().filter(waits).collect();
    let sharing = Sharing::among(waiting.iter().map(|(_, seen)| &*seen.geometry), held);
    let first = |(rank, seen): (usize, &Seen)| {
        let goal = first_goal(seen, &sharing)?;
        let cause = Cause::Missing {
            solid_angle_sr: seen.solid_angle_sr,
        };
        Some(wish(seen, step_towards(&seen.geometry, goal, None), cause, rank, held))
    };
    waiting.into_iter().filter_map(first).collect()
}

/// Whether the first picture is there: something of everything visible, but for what cannot be had.
#[must_use]
pub fn has_first_picture(visible: &[Seen], held: &impl Held) -> bool {
    let has_all_it_can = |seen: &Seen| held.held(seen.model).is_some() || first_goal(seen, held).is_none();
    visible.iter().all(has_all_it_can)
}

/// What a first picture is made of: what costs least of all that is at least as good as the coarsest level; where that
/// cannot be had, whatever can.
#[must_use]
pub fn first_goal(seen: &Seen, stock: &impl Stock) -> Option<Grade> {
    let coarsest = Grade::coarsest(&seen.geometry).map_or(f64::INFINITY, |grade| grade.error);
    let model = &seen.geometry;
    grade::first(model, coarsest, stock).or_else(|| grade::first(model, f64::INFINITY, stock))
}

/// Whether what is held of a model will do for this object.
#[must_use]
pub fn is_sharp(seen: &Seen, held: Grade, eye: &Eye, target_px: f64) -> bool {
    held.will_do(&seen.geometry, seen.error_of_px(target_px, eye))
}

/// The next step of an object of which something is held, unless that will do.
fn refinement(seen: &Seen, held: &impl Held, eye: &Eye, target_px: f64) -> Option<Wish> {
    let model = &seen.geometry;
    let now = held.held(seen.model)?;
    let unsound = now.form != Form::Level && now.is_lost(model, held);
    if !unsound && is_sharp(seen, now, eye, target_px) {
        return None;
    }
    let goal = goal(model, seen.error_of_px(target_px, eye), held)?;
    if !unsound && goal.error >= now.error {
        return None;
    }
    let error_px = if unsound {
        f64::MAX
    } else {
        seen.error_px(now.error, eye)
    };
    let grade = step_towards(model, goal, Some(now).filter(|_| !unsound));
    Some(wish(seen, grade, Cause::Finer { error_px }, 0, held))
}

fn wish(seen: &Seen, grade: Grade, cause: Cause, rank: usize, held: &impl Held) -> Wish {
    Wish {
        model: seen.model,
        object: seen.object,
        grade,
        cost_bytes: grade.cost_bytes(&seen.geometry, held),
        cause,
        priority: cause.priority(rank),
    }
}

/// The error on the screen with which everything visible takes at most so many triangles: `target_px`, or twice that, four
/// times … as much. The largest error is smallest when all have the same.
#[must_use]
pub fn target_within(visible: &[Seen], eye: &Eye, target_px: f64, most_triangles: u64) -> f64 {
    let triangles = |px: f64| -> u64 {
        let of = |seen: &Seen| {
            let most_error = seen.error_of_px(px, eye);
            let fit = Grade::all(&seen.geometry).filter(|grade| grade.will_do(&seen.geometry, most_error));
            fit.map(|grade| grade.triangles).min().unwrap_or(0)
        };
        visible.iter().map(of).fold(0, u64::saturating_add)
    };
    (0..16)
        .map(|doubled| target_px * f64::from(1 << doubled))
        .find(|px| triangles(*px) <= most_triangles)
        .unwrap_or(target_px * f64::from(1 << 16))
}

/// Bytes of memory that the first pictures of these take, each file once, packs apart.
#[must_use]
pub fn least_bytes<'a>(visible: impl IntoIterator<Item = &'a Seen>, stock: &impl Stock) -> u64 {
    let mut files: HashMap<Key, u64> = HashMap::new();
    for seen in visible {
        if let Some(coarsest) = Grade::coarsest(&seen.geometry) {
            files.extend(
                coarsest
                    .parts(&seen.geometry, stock)
                    .map(|part| (part.key(), part.bytes)),
            );
        }
    }
    files.into_values().fold(0, u64::saturating_add)
}
