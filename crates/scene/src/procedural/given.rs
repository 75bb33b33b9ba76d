//! How does a text say what it was given? Rules that are published speak for themselves: what was chosen when a world was
//! grown stands in them, as if its author had written it.

use std::collections::BTreeMap;

use super::Settings;
use super::error::DcgError;
use super::link::Program;
use super::problem::Problem;
use super::spelling::nearest;
use super::syntax::Parameter;
use super::value::Value;
use super::wording::{given_instead, list_of_colour, shown};

impl Program {
    /// The text of a file, as it was imported, with these values as its parameters' own: it grows what this program grows of it
    /// with them. Nothing for a file that the program does not have; names that are none of its parameters change nothing.
    #[must_use]
    pub fn text_given(&self, file: &str, values: &BTreeMap<String, Value>) -> Option<String> {
        let module = self.modules.iter().find(|module| module.file == file)?;
        let mut text = String::with_capacity(module.text.len());
        let mut copied = 0;
        for parameter in &module.parameters {
            let Some(value) = values.get(&parameter.formal.name) else {
                continue;
            };
            let own = &module.text[parameter.default.clone()];
            text += &module.text[copied..parameter.default.start];
            let value = value.to_json();
            // Which random numbers come depends on how many calls stand before them, so calls stay; and lines stay where they are.
            if own.contains('(') {
                text += &format!("if 1 then {value} else {own}");
            } else {
                text += &format!("{value} ");
                text.extend(own.chars().filter(|c| ['\n', '\r'].contains(c)));
            }
            copied = parameter.default.end;
        }
        Some(text + &module.text[copied..])
    }

    /// Whether the model takes parameters that it is given.
    ///
    /// # Errors
    /// When there is no parameter of a name, or a value is out of its range.
    pub fn refuse_given(&self, settings: &Settings) -> Result<(), Box<DcgError>> {
        super::evaluator::refuse_given(self, settings)
    }

    /// A mistake of the text about what a value must be, with the parameter that was given a number in place of a list, or a list
    /// in place of a number. What the first file was given is nearer to who is to mend it than what that gave to others.
    pub(super) fn with_given(&self, mut error: Box<DcgError>, settings: &Settings) -> Box<DcgError> {
        let is_of_value = error.problem.is_of_value() || matches!(error.problem, Problem::ListInRange(_));
        if error.line > 0 && is_of_value {
            let odd = self.odd(0, |_, name| settings.parameters.get(name));
            let told = odd.map(|(name, is_list)| given_instead(name, is_list, None));
            error.given = told.or(error.given);
        }
        error
    }

    /// The first parameter of a file whose default is a list where it is given a number, or the other way round; whether its
    /// default is a list.
    pub(super) fn odd<'v>(
        &self,
        module: usize,
        given: impl Fn(usize, &str) -> Option<&'v Value>,
    ) -> Option<(&str, bool)> {
        let parameters = self.modules[module].parameters.iter().enumerate();
        let mut odd = parameters.filter_map(|(slot, Parameter { formal, .. })| {
            let value = given(slot, &formal.name)?;
            let is_list = formal.default.as_ref()?.of.is_list()?;
            (is_list != matches!(value, Value::List(..))).then_some((formal.name.as_str(), is_list))
        });
        odd.next()
    }

    /// Refuses the first name that no parameter of the first file has.
    pub(super) fn refuse_unknown<'n>(&self, mut given: impl Iterator<Item = &'n String>) -> Result<(), Box<DcgError>> {
        let Some(name) = given.find(|name| !self.parameters().any(|known| known == *name)) else {
            return Ok(());
        };
        let file = &self.modules[0].file;
        let problem = Problem::UnknownArgument {
            name: name.clone(),
            callee: file.clone(),
            suggestion: nearest(name, self.parameters()),
            known: self.modules[0]
                .parameters
                .iter()
                .map(|parameter| parameter.shown.clone())
                .collect(),
        };
        Err(DcgError::of_whole(file, problem))
    }
}

/// What to write where a text is given in place of a value, if one can see what was meant: a truth, a number that is written
/// otherwise, or a colour, though not all take one.
#[must_use]
pub fn in_place_of_text(text: &str) -> Option<String> {
    let number = match text {
        "true" => Some(1.0),
        "false" => Some(0.0),
        _ => number_meant(text),
    };
    let number = number.map(|number| format!("`{}`", shown(number)));
    number.or_else(|| {
        let list = list_of_colour(text)?;
        Some(format!("a number, or, where a colour is wanted, `{list}`"))
    })
}

/// A number as people write it and JSON does not: with a sign or zeros before it, without a digit before or behind its point, as a
/// fraction, in metres or degrees.
fn number_meant(text: &str) -> Option<f64> {
    let text = text.strip_suffix(['m', '°']).unwrap_or(text).trim_end();
    let number = |text: &str| {
        let is_plain = text.bytes().all(|byte| byte.is_ascii_digit() || b"+-.".contains(&byte));
        text.parse().ok().filter(|number: &f64| is_plain && number.is_finite())
    };
    match text.split_once('/') {
        None => number(text),
        Some((above, below)) => {
            let share = number(above.trim())? / number(below.trim())?;
            share.is_finite().then_some(share)
        }
    }
}
