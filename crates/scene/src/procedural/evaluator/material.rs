//! What does a surface look like? Materials are computed once for each set of arguments.

use super::terminal::{amount, shape};
use super::{Evaluator, Outcome, Scope, listed};
use crate::procedural::arithmetic::linear_light;
use crate::procedural::grown::Surface;
use crate::procedural::limits::reached;
use crate::procedural::random::step_name;
use crate::procedural::syntax::{MaterialRule, Property, Written};
use crate::procedural::value::Value;

impl<'p> Evaluator<'p> {
    /// The index of the material that a call leads to.
    pub(super) fn surface(&mut self, scope: &Scope, call: usize) -> Outcome<usize> {
        let call = &self.program.modules[scope.module].calls[call];
        let (module, index) = (call.target.module, call.target.index.unwrap_or_default());
        let rule = &self.program.modules[module].materials[index];
        let instance = self.called_instance(scope, call)?;
        if let Some(material) = self.instances[instance].surfaces[index] {
            return Ok(material);
        }
        let is_given = call.given.len() == rule.formals.len();
        let path = |evaluator: &Self| step_name(evaluator.settings.seed, &rule.name);
        let inner = Scope {
            module,
            instance,
            base: self.stack.len(),
            path: if is_given { 0 } else { path(self) },
            depth: scope.depth,
            level: 0,
            held: self.held,
        };
        self.bind((scope, call), &inner, (&rule.formals, rule.slots))?;
        self.count(scope, call.at, listed(&self.stack[inner.base..]))?;
        let mut key = std::mem::take(&mut self.key);
        key.clear();
        key.extend([module as u64, index as u64, instance as u64]);
        self.stack[inner.base..]
            .iter()
            .for_each(|argument| argument.key(&mut key));
        let material = match self.known_materials.get(&key[..]) {
            Some(&material) => material,
            None => {
                let limit = self.settings.limits.materials;
                if self.materials.len() as u64 >= limit {
                    return self.error(scope.module, call.at, reached("materials", limit));
                }
                self.keep((scope.module, call.at), key.len())?;
                let inner = Scope {
                    path: path(self),
                    ..inner
                };
                let surface = self.computed_surface(&inner, rule);
                let surface = surface.map_err(|error| self.traced((scope.module, call.at), error))?;
                self.materials.push(surface);
                self.known_materials.insert(key.clone(), self.materials.len() - 1);
                self.materials.len() - 1
            }
        };
        self.key = key;
        self.close_frame(&inner);
        if rule.formals.is_empty() {
            self.instances[instance].surfaces[index] = Some(material);
        }
        Ok(material)
    }

    fn computed_surface(&mut self, scope: &Scope, rule: &'p MaterialRule) -> Outcome<Surface> {
        let mut surface = Surface {
            name: rule.name.clone(),
            ..Surface::default()
        };
        for (property, value) in &rule.properties {
            let mut share = |name| self.ranged(scope, value, name, (0.0, 1.0));
            match property {
                Property::Roughness => surface.roughness = share("roughness")?,
                Property::Metallic => surface.metallic = share("metallic")?,
                Property::Opacity => surface.opacity = share("opacity")?,
                Property::DoubleSided => surface.double_sided = share("double_sided")? != 0.0,
                Property::Recolour => surface.recolour = share("recolour")? != 0.0,
                Property::Colour => surface.colour = self.colour(scope, value)?,
                Property::Emissive => surface.emissive = self.colour(scope, value)?,
            }
        }
        Ok(surface)
    }

    /// Linear light of a colour.
    fn colour(&mut self, scope: &Scope, written: &'p Written) -> Outcome<[f64; 3]> {
        let value = self.written(scope, written)?;
        let channels = match &value {
            Value::List(items, _) if items.len() == 3 => items.iter().map(|item| match item {
                Value::Number(channel) if (0.0..=1.0).contains(channel) => Some(linear_light(*channel)),
                _ => None,
            }),
            _ => return self.error(scope.module, written.at, shape(COLOUR.0, COLOUR.1)),
        };
        let channels: Option<Vec<f64>> = channels.collect();
        match channels.as_deref() {
            Some(&[r, g, b]) => Ok([r, g, b]),
            _ if value.is_numbers(3) => self.error(scope.module, written.at, amount(COLOUR.0, COLOUR.1)),
            _ => self.error(scope.module, written.at, shape(COLOUR.0, COLOUR.1)),
        }
    }
}

const COLOUR: (&str, &str) = ("a colour", "`#rrggbb`, or three numbers from 0 to 1");
