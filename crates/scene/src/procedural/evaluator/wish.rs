//! Which pictures does a part ask for, to be drawn with from far away?

use super::terminal::{MAX_LENGTH, Place, amount};
use super::{Evaluator, Outcome};
use crate::impostor::Wish;
use crate::procedural::problem::Problem;
use crate::procedural::solid::IMPOSTOR;
use crate::procedural::syntax::{At, Written};

/// Shortest way of a round of steps.
const LEAST_STRIDE: f64 = 1e-3;

impl<'p> Evaluator<'p> {
    pub(super) fn impostor(&mut self, (scope, at): Place, arguments: &'p [Option<Written>]) -> Outcome<Wish> {
        let [least, most] = [Wish::LEAST_VIEWS, Wish::MOST_VIEWS].map(f64::from);
        let mut number = |index, range| self.formal(scope, IMPOSTOR[index], &arguments[index], range);
        let views = number(0, (least, most))?.floor() as u32;
        let size_px = number(1, (f64::NEG_INFINITY, f64::INFINITY))?;
        let below = number(2, (0.0, 1.0))? != 0.0;
        let frames = number(3, (1.0, f64::from(Wish::MOST_FRAMES)))?.floor() as u32;
        let stride = number(4, (LEAST_STRIDE, MAX_LENGTH))?;
        let Some(size_px) = Wish::SIZES_PX.into_iter().find(|size| f64::from(*size) == size_px) else {
            return self.error(
                scope.module,
                given_at(arguments, 1, at),
                amount("size", "16, 32, 64 or 128"),
            );
        };
        let wish = Wish {
            views,
            size_px,
            below,
            frames,
            stride,
        };
        if !wish.fits() {
            return self.error(scope.module, at, amount("views * size * frames", "at most 4096"));
        }
        if frames > 1 && !self.accounts[self.part].has_phase {
            return self.error(scope.module, frames_at(arguments, at), Problem::NoPhase);
        }
        Ok(wish)
    }
}

/// Where it is said how many frames there are, or else that there are pictures.
pub(super) fn frames_at(arguments: &[Option<Written>], at: At) -> At {
    given_at(arguments, 3, at)
}

fn given_at(arguments: &[Option<Written>], index: usize, at: At) -> At {
    arguments[index].as_ref().map_or(at, |written| written.at)
}
