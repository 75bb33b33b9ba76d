//! What does a settings file hold, and where in it is what is wrong? Its keys are the settings of the command line. Each is
//! read by itself, so that an error knows its line and its name.

use std::{ops::Range, path::Path};

use clap::{Args, Command, parser::ValueSource};
use serde::{Deserialize, Deserializer};
use toml::{
    Spanned,
    de::{DeTable, DeValue},
};

use super::{ConfigError, Settings};
use crate::spelling::nearest_of;

impl Settings {
    /// Reads a TOML file.
    ///
    /// # Errors
    /// When it cannot be read, is not TOML, or has a key that is none or does not hold what it should, which is named.
    pub fn from_file(file: &Path) -> Result<Self, ConfigError> {
        let text = std::fs::read_to_string(file).map_err(|source| ConfigError::Unreadable {
            file: file.to_owned(),
            source,
        })?;
        read(&text).map_err(|Wrong { at, what }| ConfigError::Malformed {
            file: file.to_owned(),
            line: text.get(..at).unwrap_or(&text).matches('\n').count() + 1,
            what,
        })
    }
}

/// The settings of a file that variables of the environment go before, each with its variable.
pub(crate) fn overridden(file: &Path) -> std::io::Result<Vec<(String, String)>> {
    let text = std::fs::read_to_string(file)?;
    let known = Settings::augment_args(Command::new("settings").no_binary_name(true));
    // What is no TOML, and what variables hold that is no setting, has been refused before.
    let (Ok(names), Ok(found)) = (DeTable::parse(&text), known.clone().try_get_matches_from([""; 0])) else {
        return Ok(vec![]);
    };
    let set = known.get_arguments().filter_map(|setting| {
        let id = setting.get_id().as_str();
        let variable = setting.get_env()?;
        let goes_before = found.value_source(id) == Some(ValueSource::EnvVariable);
        let named = names.get_ref().keys().any(|key| key.get_ref() == id);
        (goes_before && named).then(|| (id.to_owned(), variable.to_string_lossy().into_owned()))
    });
    Ok(set.collect())
}

/// What is wrong, and after how many bytes.
struct Wrong {
    at: usize,
    what: String,
}

impl Wrong {
    fn at(span: Option<Range<usize>>, what: String) -> Self {
        Self {
            at: span.map_or(0, |span| span.start),
            what,
        }
    }
}

fn read(text: &str) -> Result<Settings, Wrong> {
    let whole = DeTable::parse(text).map_err(|error| {
        let what = twice(text, &error).unwrap_or_else(|| error.message().to_owned());
        Wrong::at(error.span(), what)
    })?;
    let known = Settings::augment_args(Command::new("settings"));
    let mut entries: Vec<_> = whole.into_inner().into_iter().collect();
    entries.sort_by_key(|(key, _)| key.span().start);
    let mut settings = Settings::default();
    for (key, value) in entries {
        settings = settings.or(one(&known, key, value)?);
    }
    Ok(settings)
}

/// One of the settings, as all of them.
fn one<'a>(
    known: &Command,
    key: Spanned<std::borrow::Cow<'a, str>>,
    value: Spanned<DeValue<'a>>,
) -> Result<Settings, Wrong> {
    let (name, at) = (key.get_ref().to_string(), key.span());
    let Some(setting) = known.get_arguments().find(|setting| setting.get_id() == name.as_str()) else {
        return Err(Wrong::at(Some(at), no_setting(known, &name)));
    };
    let may_be_secret = setting.is_hide_env_values_set();
    let alone = DeTable::from_iter([(key, value)]);
    Settings::deserialize(toml::Deserializer::from(Spanned::new(at.clone(), alone))).map_err(|error| {
        let what = if may_be_secret {
            "it must be a text, in quotation marks"
        } else {
            &for_people(error.message())
        };
        Wrong::at(Some(at), format!("`{name}`: {what}"))
    })
}

/// Which key is given a second time, if that is what is wrong.
fn twice(text: &str, error: &toml::de::Error) -> Option<String> {
    let key = text.get(error.span()?)?.trim();
    let is_key = !key.is_empty()
        && key
            .bytes()
            .all(|byte| byte.is_ascii_alphanumeric() || b"_-".contains(&byte));
    (error.message() == "duplicate key" && is_key).then(|| format!("`{key}` is given twice"))
}

/// What is wrong, without the names that types have in the program.
fn for_people(message: &str) -> String {
    let Some((what, expected)) = message.rsplit_once(", expected ") else {
        return message.to_owned();
    };
    let wanted = match expected {
        "usize" | "u64" | "u32" => "a whole number from 0 on",
        "f64" => "a number",
        "a boolean" => "true or false",
        "path string" | "a string" => "a text, in quotation marks",
        other => other,
    };
    format!("{what}, expected {wanted}")
}

/// Texts as a list, or as one text with commas between them.
pub(super) fn texts<'de, D: Deserializer<'de>>(from: D) -> Result<Vec<String>, D::Error> {
    #[derive(Deserialize)]
    #[serde(untagged, expecting = "a list of texts is wanted, or one with commas between them")]
    enum Texts {
        One(String),
        Many(Vec<String>),
    }
    Ok(match Texts::deserialize(from)? {
        Texts::One(text) => text.split(',').map(str::to_owned).collect(),
        Texts::Many(texts) => texts,
    })
}

fn no_setting(known: &Command, name: &str) -> String {
    let names = known.get_arguments().map(|setting| setting.get_id().as_str());
    match nearest_of(name, names, name.len()) {
        Some(nearest) => format!("`{name}` is no setting; did you mean `{nearest}`?"),
        None => format!(
            "`{name}` is no setting; `belvedere serve --help` lists those that there are, here with `_` for `-`"
        ),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wrong(text: &str) -> String {
        let file = tempfile::NamedTempFile::new().unwrap();
        std::fs::write(file.path(), text).unwrap();
        let told = Settings::from_file(file.path()).unwrap_err().to_string();
        assert!(!told.contains("hush"), "{told}");
        told.split_once(" is not right in ").unwrap().1.to_owned()
    }

    #[test]
    fn what_is_wrong_is_told_with_its_line_and_its_name() {
        for (text, told) in [
            (
                "# two\ncache_mib = 9\nmax_bakez = 2",
                "line 3: `max_bakez` is no setting; did you mean `max_bakes`?",
            ),
            (
                "cache_mib = 9\n\n\ndata = 5",
                "line 4: `data`: invalid type: integer `5`, expected a text, in quotation marks",
            ),
            (
                "poll_ms = 200\nmax_bakes = \"two\"",
                "line 2: `max_bakes`: invalid type: string \"two\", expected a whole number from 0 on",
            ),
            (
                "poll_ms = -1",
                "line 1: `poll_ms`: invalid value: integer `-1`, expected a whole number from 0 on",
            ),
            (
                "\n[server]\nport = 1",
                "line 2: `server` is no setting; `belvedere serve --help` lists those that there are, here with `_` for `-`",
            ),
            ("cache_mib = 1\ncache_mib = 2", "line 2: `cache_mib` is given twice"),
            (
                "base_origins = 1",
                "line 1: `base_origins`: a list of texts is wanted, or one with commas between them",
            ),
        ] {
            assert_eq!(wrong(text), told);
        }
        assert!(wrong("\nlisten = \"80\"").starts_with("line 2: `listen`: "));
        assert!(wrong("\n\nlog_format = \"xml\"").starts_with("line 3: `log_format`: unknown variant `xml`"));
    }

    #[test]
    fn what_may_be_a_secret_is_not_repeated() {
        for text in [
            "operator_token = [\"hush\"]",
            "nats = {hush = 1}",
            "otlp = [\"hush\"]",
            "database = [\"hush\"]",
            "operator_token = hush",
            "operator_token = \"hush",
        ] {
            assert!(wrong(text).starts_with("line 1: "), "{text}");
        }
        assert_eq!(
            wrong("operator_token = 17"),
            "line 1: `operator_token`: it must be a text, in quotation marks"
        );
    }

    #[test]
    fn every_setting_can_be_read() {
        let known = Settings::augment_args(Command::new("settings"));
        for setting in known.get_arguments() {
            let name = setting.get_id().as_str();
            let read = ["1", "\"127.0.0.1:1\"", "true", "\"text\"", "[\"a\"]"]
                .iter()
                .filter_map(|value| super::read(&format!("{name} = {value}")).ok());
            assert!(read.count() > 0, "{name}");
        }
    }
}
