//! What does a settings file hold, and where in it is what is wrong? Its keys are the settings of the command line. Each is
//! read by itself, so that an error knows its line and its name.

use std::{ops::Range, path::Path};

use clap::{Args, Command};
use serde::Deserialize;
use toml::{
    Spanned,
    de::{DeTable, DeValue},
};

use super::{ConfigError, Settings, environment::nearest_of};

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
    let whole = DeTable::parse(text).map_err(|error| Wrong::at(error.span(), error.message().to_owned()))?;
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
            error.message()
        };
        Wrong::at(Some(at), format!("`{name}`: {what}"))
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
                "line 4: `data`: invalid type: integer `5`, expected path string",
            ),
            (
                "poll_ms = 200\nmax_bakes = \"two\"",
                "line 2: `max_bakes`: invalid type: string \"two\", expected usize",
            ),
            (
                "poll_ms = -1",
                "line 1: `poll_ms`: invalid value: integer `-1`, expected u64",
            ),
            (
                "\n[server]\nport = 1",
                "line 2: `server` is no setting; `belvedere serve --help` lists those that there are, here with `_` for `-`",
            ),
            ("cache_mib = 1\ncache_mib = 2", "line 2: duplicate key"),
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
