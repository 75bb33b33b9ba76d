//! Which objects does no proof hide from a part of the region, if it and they are cut into parts?
//!
//! In rounds: all are asked about with a few cuts, those of which nobody knows then with more, and so on, as long as the last
//! round hid enough for its cuts, or the next one takes but few. Most that can be hidden so are hidden by few cuts, and each round
//! costs several times the last.

use super::Observer;
use crate::{
    occluders::Region,
    visibility::narrow::{Answer, Limits, Question, Scout},
};

/// An object may be cut so often in all, after each round.
const ROUNDS: [u32; 7] = [4, 16, 64, 128, 256, 512, 1024];
/// There is another round when at least one object was hidden for so many cuts, …
const WORTH: u32 = 512;
/// … or all that are left may be cut with so few: from outside a closed house each takes more than the first rounds allow.
const FEW: u32 = 1 << 13;

impl Observer<'_> {
    /// Those of these objects that are not hidden.
    pub(super) fn not_hidden_in_parts(&mut self, eye: &Region, objects: Vec<u32>, scout: &mut dyn Scout) -> Vec<u32> {
        if self.settings.cuts == 0 {
            return objects;
        }
        let mut open: Vec<Question> = Vec::with_capacity(objects.len());
        let mut seen = Vec::new();
        for object in objects {
            let Some(target) = &self.scenery.targets[object as usize] else {
                continue;
            };
            match Question::new(eye, (object, target), &*scout) {
                Some(question) => open.push(question),
                None => seen.push(object),
            }
        }
        for (round, most) in ROUNDS.into_iter().enumerate() {
            let (mut hidden, mut cuts, mut left) = (0, 0, open.len() as u32);
            open.retain_mut(|question| {
                let before = question.cuts();
                let answer = self.follow(question, most, left, scout);
                cuts += question.cuts() - before;
                left -= 1;
                match answer {
                    Answer::Hidden(_) => hidden += 1,
                    Answer::Seen => seen.push(question.object),
                    Answer::Open => return true,
                }
                false
            });
            let is_worth_it = hidden * WORTH >= cuts;
            let takes_few = ROUNDS
                .get(round + 1)
                .is_some_and(|next| open.len() as u32 * next <= FEW);
            if cuts == 0 || !(is_worth_it || takes_few) {
                break;
            }
        }
        seen.extend(open.iter().map(|question| question.object));
        seen
    }

    /// Goes on with one of so many questions until it has been cut so often, or its object may be cut no more.
    pub(super) fn follow(&mut self, question: &mut Question, most: u32, of: u32, scout: &mut dyn Scout) -> Answer {
        let cuts_left = &mut self.cuts_left[question.object as usize];
        if *cuts_left == 0 {
            return Answer::Open;
        }
        let before = question.cuts();
        let limits = Limits {
            cuts: most.min(before.saturating_add(*cuts_left)),
            steps: self.prover.budget() / of,
        };
        let shadows = self.settings.fusion.then_some(&self.shadows);
        let answer = question.follow(&mut self.prover, shadows, limits, scout);
        *cuts_left -= question.cuts() - before;
        answer
    }
}
