//! Why can an object not be seen from a region?

use super::Observer;
use crate::{
    occluders::Region,
    visibility::{
        narrow::{Answer, Question, Scout},
        prover::Witness,
    },
};

impl Observer<'_> {
    /// Why an object cannot be seen from a region, each reason once, if that can be proved: for all of the region, or for
    /// parts of it and of the object.
    pub fn reasons(&mut self, eye: &Region, object: u32, scout: &mut dyn Scout) -> Option<Vec<Witness>> {
        self.cuts_left[object as usize] = self.settings.cuts;
        let mut found = Vec::new();
        self.explain(eye, object, self.settings.halvings, scout, &mut found)
            .then_some(found)
    }

    fn explain(
        &mut self,
        eye: &Region,
        object: u32,
        halvings: u32,
        scout: &mut dyn Scout,
        found: &mut Vec<Witness>,
    ) -> bool {
        let Some(target) = self.scenery.targets[object as usize].as_ref() else {
            return false;
        };
        let by_one = self.prover.hides_whole_by_one(eye, target, object);
        let witness = by_one.or_else(|| self.prover.hides_by_openings(eye, target));
        let mut witnesses: Vec<Witness> = witness.into_iter().collect();
        if witnesses.is_empty() && self.settings.fusion {
            let mut open = self.not_hidden(eye);
            self.fuse(eye, &mut open);
            witnesses.extend(open.binary_search(&object).is_err().then_some(Witness::Fused));
        }
        if witnesses.is_empty() && halvings == 0 {
            let Some(mut question) = Question::new(eye, (object, target), &*scout) else {
                return false;
            };
            match self.follow(&mut question, u32::MAX, 1, scout) {
                Answer::Hidden(parts) => witnesses = parts,
                Answer::Seen | Answer::Open => return false,
            }
        }
        let mut halves = eye.halves().into_iter();
        if witnesses.is_empty() && !halves.all(|half| self.explain(&half, object, halvings - 1, scout, found)) {
            return false;
        }
        for witness in witnesses {
            if !found.contains(&witness) {
                found.push(witness);
            }
        }
        true
    }
}
