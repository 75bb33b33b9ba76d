//! Will a loop place more than may be? Where each of its turns places something for sure, that is known before the first, and need not
//! be found out at the end of a million.

use super::{Evaluator, Outcome, Scope};
use crate::procedural::limits::reached;
use crate::procedural::syntax::{At, Statement};

/// Loops of fewer turns are soon done.
const MANY: u64 = 1000;

impl Evaluator<'_> {
    /// Refuses so many turns of a statement that will place too much, where they would come to it.
    pub(super) fn foresee(&self, scope: &Scope, turns: u64, body: &Statement) -> Outcome<()> {
        if turns < MANY {
            return Ok(());
        }
        let places = self.placed_for_sure(scope.module, body);
        let each = places.len() as u64;
        let limit = self.settings.limits.placements;
        let left = limit.saturating_sub(self.accounts[self.part].placements);
        if each == 0 || turns.saturating_mul(each) <= left {
            return Ok(());
        }
        let first_too_many = places[(left % each) as usize];
        self.error(scope.module, first_too_many, reached("placements", limit))
    }

    /// Where a statement places something, whatever is chosen in it; not what rules and loops in it place.
    fn placed_for_sure(&self, module: usize, statement: &Statement) -> Vec<At> {
        let module_of = &self.program.modules[module];
        match statement {
            Statement::Group { of, .. } => of
                .iter()
                .flat_map(|inner| self.placed_for_sure(module, inner))
                .collect(),
            Statement::Place { body, .. } | Statement::Paint { body, .. } => self.placed_for_sure(module, body),
            Statement::If {
                then,
                otherwise: Some(otherwise),
                ..
            } => {
                let [then, otherwise] = [then, otherwise].map(|branch| self.placed_for_sure(module, branch));
                if otherwise.len() < then.len() { otherwise } else { then }
            }
            Statement::Called { at, .. } | Statement::Viewpoint { at, .. } | Statement::Model { at, .. } => vec![*at],
            Statement::Call { call, .. } => {
                let call = &module_of.calls[*call];
                let is_placed = call
                    .target
                    .index
                    .is_none_or(|index| self.rule(call.target.module, index).is_part);
                if is_placed { vec![call.at] } else { Vec::new() }
            }
            _ => Vec::new(),
        }
    }
}
