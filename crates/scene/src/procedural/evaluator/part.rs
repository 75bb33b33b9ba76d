//! What is shared? What a part looks like depends on its parameters and its material alone: its random numbers begin anew
//! from the seed, its name and its parameters. So equal calls share one part, and a population costs no more than its
//! placements (Schmalstieg 1997, §8.3: the enumerator node).

use super::{Account, Evaluator, Outcome, Scope, Turtle, listed};
use crate::Bounds;
use crate::procedural::affine::Affine;
use crate::procedural::grown::{Part, Placement, SaidInFile};
use crate::procedural::limits::reached;
use crate::procedural::problem::Problem;
use crate::procedural::random::step_name;
use crate::procedural::recipe::Recipe;
use crate::procedural::syntax::{At, Rule, Statement, Written};
use crate::procedural::value::Value;

/// The parameter by which a part or a file moves: the share of a round of its movement that is over.
pub const PHASE: &str = "phase";

/// By how much geometry may go beyond what a part declares: rounding to single precision, relative and in metres.
const SLACK: f64 = 1e-6;

/// Towards where something reaches beyond a box, and how far, metres.
type Beyond = (&'static str, f64);

impl<'p> Evaluator<'p> {
    pub(super) fn place_part(
        &mut self,
        (caller, at): (&Scope, At),
        turtle: &Turtle,
        rule: &'p Rule,
        index: usize,
        inner: Scope,
    ) -> Outcome<()> {
        self.count(caller, at, listed(&self.stack[inner.base..]))?;
        let arguments = &self.stack[inner.base..inner.base + rule.formals.len()];
        let kept = arguments.iter().map(Value::size).sum();
        let mut key = vec![
            1,
            inner.module as u64,
            index as u64,
            inner.instance as u64,
            turtle.material as u64,
        ];
        arguments.iter().for_each(|argument| argument.key(&mut key));
        let path = step_name(self.settings.seed, &rule.name);
        let path = arguments.iter().fold(path, |path, argument| argument.step(path));
        let part = match self.known.get(&key) {
            Some(&part) if self.accounts[part].finished => part,
            Some(_) => return self.error(caller.module, at, Problem::PartInItself(rule.name.clone())),
            None => {
                let part = self.begin((caller, at), &rule.name, None)?;
                self.keep((caller.module, at), kept)?;
                self.known.insert(key, part);
                self.accounts[part].has_phase = rule.formals.iter().any(|formal| formal.name == PHASE);
                let scope = Scope { path, ..inner };
                let declared = self.declared_bounds(&scope, rule)?;
                match declared {
                    Some(bounds) if self.measuring => self.parts[part].bounds = bounds,
                    _ => self.inside(part, turtle.material, true, |e, turtle| {
                        e.visit(&scope, turtle, &rule.body)
                    })?,
                }
                let beyond = declared.and_then(|bounds| beyond(&self.reach_of(part), &bounds));
                if let Some(beyond) = beyond {
                    // The model that is to blame, where it is one.
                    let of_model = declared.and_then(|bounds| self.model_beyond(part, &bounds));
                    let ((module, at), (towards, by_m)) = of_model.unwrap_or(((inner.module, rule.at), beyond));
                    let part = rule.name.clone();
                    return self.error(module, at, Problem::BeyondDeclared { part, towards, by_m });
                }
                self.accounts[part].finished = true;
                self.note_recipe(part, turtle.material, |e| {
                    let formals = rule.formals.iter().map(|formal| formal.name.clone());
                    Recipe {
                        file: e.program.modules[inner.module].file.clone(),
                        given: e.instances[inner.instance].given.clone(),
                        part: Some(rule.name.clone()),
                        parameters: formals.zip(e.stack[inner.base..].iter().cloned()).collect(),
                    }
                });
                part
            }
        };
        self.place_known((caller, at), turtle, part)
    }

    /// A box around what is in a part: tight around its own triangles, not so around what it places.
    fn reach_of(&self, part: usize) -> Bounds {
        let Part {
            meshes,
            placements,
            models,
            bounds,
            ..
        } = &self.parts[part];
        if self.measuring {
            return *bounds;
        }
        let vertices = meshes.iter().flat_map(|mesh| &mesh.positions);
        let own = Bounds::around(vertices.map(|position| position.map(f64::from)));
        let placed = placements
            .iter()
            .map(|Placement { part, frame }| frame.bounds(&self.parts[*part].bounds));
        let models = models
            .iter()
            .filter_map(|(path, frame)| Some(frame.bounds(&(self.boxes)(path)?)));
        placed.chain(models).fold(own, |all, bounds| all.union(&bounds))
    }

    /// Where a glTF file is placed that reaches beyond a box, in a part or in what that places; and how it does.
    fn model_beyond(&self, part: usize, declared: &Bounds) -> Option<((usize, At), Beyond)> {
        let mut left = vec![(part, Affine::IDENTITY)];
        while let Some((part, frame)) = left.pop() {
            let Part { models, placements, .. } = &self.parts[part];
            for ((path, place), at) in models.iter().zip(&self.accounts[part].models) {
                let bounds = (self.boxes)(path).map(|bounds| frame.after(place).bounds(&bounds));
                if let Some(beyond) = bounds.and_then(|bounds| beyond(&bounds, declared)) {
                    return Some((*at, beyond));
                }
            }
            let placed = placements.iter().rev();
            let placed = placed.map(|child| (child.part, frame.after(&child.frame)));
            left.extend(
                placed.filter(|(part, frame)| beyond(&frame.bounds(&self.parts[*part].bounds), declared).is_some()),
            );
        }
        None
    }

    fn declared_bounds(&mut self, scope: &Scope, rule: &'p Rule) -> Outcome<Option<Bounds>> {
        let Some([least, most]) = &rule.within else {
            return Ok(None);
        };
        let mut corner = |written: &'p Written| {
            let value = self.written(scope, written)?;
            self.point3((scope, written.at), "a corner of `within`", &value)
        };
        let (min, max) = (corner(least)?, corner(most)?);
        if (0..3).any(|axis| min[axis] > max[axis]) {
            let (what, wanted) = (
                "`within`",
                "from the corner of the least x, y and z to that of the most",
            );
            return self.error(scope.module, least.at, Problem::Amount { what, wanted });
        }
        Ok(Some(Bounds { min, max }))
    }

    /// Notes how a part can be made alone: when it places nothing, and nothing in it has taken on paint from outside.
    pub(super) fn note_recipe(&mut self, part: usize, material: usize, recipe: impl FnOnce(&Self) -> Recipe) {
        let made = &self.parts[part];
        let is_alone = made.placements.is_empty() && made.models.is_empty() && !made.meshes.is_empty();
        let takes_paint = material != 0 && made.meshes.iter().any(|mesh| mesh.material == material);
        self.parts[part].takes_paint = takes_paint;
        if is_alone && !takes_paint {
            self.parts[part].recipe = Some(recipe(self));
        }
    }

    /// Statements whose geometry is named: a part of its own that is not shared.
    pub(super) fn visit_called(
        &mut self,
        (scope, at): (&Scope, At),
        turtle: &Turtle,
        name: &str,
        body: &'p Statement,
    ) -> Outcome<()> {
        let file = scope.module;
        let part = self.begin((scope, at), name, Some(SaidInFile { file, at }))?;
        self.keep_name((scope.module, at), name)?;
        self.inside(part, turtle.material, false, |e, turtle| e.visit(scope, turtle, body))?;
        self.accounts[part].finished = true;
        self.place_known((scope, at), turtle, part)
    }

    pub(super) fn check_parts(&self, (scope, at): (&Scope, At)) -> Outcome<()> {
        let limit = self.settings.limits.parts;
        if self.parts.len() as u64 >= limit {
            return self.error(scope.module, at, reached("parts", limit));
        }
        Ok(())
    }

    fn begin(&mut self, place: (&Scope, At), name: &str, called: Option<SaidInFile>) -> Outcome<usize> {
        self.check_parts(place)?;
        self.parts.push(Part::new(name, called));
        self.accounts.push(Account::default());
        Ok(self.parts.len() - 1)
    }

    /// Visits what is inside of a part, in its own space; a part that is shared does not see which rules are open.
    pub(super) fn inside(
        &mut self,
        part: usize,
        material: usize,
        is_shared: bool,
        visit: impl FnOnce(&mut Self, &Turtle) -> Outcome<()>,
    ) -> Outcome<()> {
        let outer = std::mem::replace(&mut self.part, part);
        let shut = vec![0; if is_shared { self.open.len() } else { 0 }];
        let open = is_shared.then(|| std::mem::replace(&mut self.open, shut));
        visit(
            self,
            &Turtle {
                frame: Affine::IDENTITY,
                material,
            },
        )?;
        if let Some(open) = open {
            self.open = open;
        }
        // Its corners are rounded when they are written.
        self.parts[part].bounds = self.parts[part].bounds.in_single();
        self.part = outer;
        Ok(())
    }

    /// Counts what is placed in the part that is being made.
    pub(super) fn count_placements(&mut self, (scope, at): (&Scope, At), placements: u64) -> Outcome<()> {
        let account = &mut self.accounts[self.part];
        account.placements = account.placements.saturating_add(placements);
        let limit = self.settings.limits.placements;
        if account.placements > limit {
            return self.error(scope.module, at, reached("placements", limit));
        }
        Ok(())
    }

    pub(super) fn place_known(&mut self, (scope, at): (&Scope, At), turtle: &Turtle, part: usize) -> Outcome<()> {
        let inner = self.parts[part].bounds;
        let placements = self.accounts[part].placements.saturating_add(1);
        self.count_placements((scope, at), placements)?;
        let outer = &mut self.parts[self.part];
        outer.placements.push(Placement {
            part,
            frame: turtle.frame,
        });
        outer.bounds = outer.bounds.union(&turtle.frame.bounds(&inner));
        Ok(())
    }
}

/// Where most of `inner` is outside of `outer`, and how far it reaches out there, in whole millimetres.
fn beyond(inner: &Bounds, outer: &Bounds) -> Option<Beyond> {
    const TOWARDS: [&str; 6] = ["-x", "-y", "-z", "+x", "+y", "+z"];
    let slack = SLACK * (1.0 + outer.diagonal_m());
    let mut most = slack;
    let mut found = None;
    for (side, towards) in TOWARDS.into_iter().enumerate() {
        let axis = side % 3;
        let by = if side < 3 {
            outer.min[axis] - inner.min[axis]
        } else {
            inner.max[axis] - outer.max[axis]
        };
        if by > most {
            most = by;
            found = Some(towards);
        }
    }
    found.map(|towards| (towards, (1000.0 * most).ceil() / 1000.0))
}
