//! Which variables look like settings and are none, and what was meant? Which one gave a value that cannot be read? One whose
//! name is spelt wrong would do nothing, without a word.

use std::{collections::BTreeSet, ffi::OsString, fmt};

use clap::{
    Command,
    error::{ContextKind, ContextValue},
};

use crate::spelling::nearest_of;

const PREFIX: &str = "BELVEDERE_";

/// A variable that is no setting. Its value may be a secret and is told nowhere.
#[derive(Debug, PartialEq, Eq)]
pub(crate) struct Stranger {
    name: String,
    /// The setting that is spelt most alike, if one is.
    nearest: Option<String>,
}

impl fmt::Display for Stranger {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "the variable {} is no setting, so it does nothing; ", self.name)?;
        match &self.nearest {
            Some(nearest) => write!(f, "did you mean {nearest}?"),
            None => write!(f, "`belvedere serve --help` lists those that there are"),
        }
    }
}

/// Those of this process. Only names are judged; what settings are worth is for clap to read.
pub(crate) fn of_this_process(program: &Command) -> Vec<Stranger> {
    let texts = |(name, value): (OsString, OsString)| Some((name.into_string().ok()?, value.to_string_lossy().into()));
    strangers(program, std::env::vars_os().filter_map(texts))
}

/// Those of these variables, with their values, that no command of the program knows.
fn strangers(program: &Command, variables: impl Iterator<Item = (String, String)>) -> Vec<Stranger> {
    let mut known = BTreeSet::new();
    gather(program, &mut known);
    variables
        .filter(|(name, value)| name.starts_with(PREFIX) && !known.contains(name) && !is_of_a_service(name, value))
        .map(|(name, _)| Stranger {
            nearest: nearest_of(&name, known.iter().map(String::as_str), name.len() - PREFIX.len()),
            name,
        })
        .collect()
}

fn gather(command: &Command, known: &mut BTreeSet<String>) {
    let variables = command.get_arguments().filter_map(|argument| argument.get_env());
    known.extend(variables.filter_map(|name| name.to_str()).map(str::to_owned));
    command.get_subcommands().for_each(|command| gather(command, known));
}

/// Whether Kubernetes has set it, which tells every container where each service is, in the service's name.
fn is_of_a_service(name: &str, value: &str) -> bool {
    name.contains("_SERVICE_HOST")
        || name.contains("_SERVICE_PORT")
        || name.contains("_PORT_")
        || value.starts_with("tcp://")
}

/// The variable of this process that gave the value which an error is about, where no argument did.
pub(crate) fn behind(program: &Command, error: &clap::Error) -> Option<String> {
    let said: Vec<_> = std::env::args_os().filter_map(|word| word.into_string().ok()).collect();
    let set: BTreeSet<_> = std::env::vars_os().map(|(name, _)| name).collect();
    variable_of(program, error, &said, &set)
}

/// The same, of these arguments and variables.
fn variable_of(program: &Command, error: &clap::Error, said: &[String], set: &BTreeSet<OsString>) -> Option<String> {
    let Some(ContextValue::String(argument)) = error.get(ContextKind::InvalidArg) else {
        return None;
    };
    let flag = argument.strip_prefix("--")?.split([' ', '=', '[']).next()?;
    let mut flags = said
        .iter()
        .filter_map(|word| word.strip_prefix("--")?.split('=').next());
    if flags.any(|said| said == flag) {
        return None;
    }
    let variable = variable_behind(program, said, flag).filter(|name| set.contains(name))?;
    variable.into_string().ok()
}

/// The variable that a flag can be set by, of a command or of the one below it that was said.
fn variable_behind(command: &Command, said: &[String], flag: &str) -> Option<OsString> {
    let mut flags = command.get_arguments();
    let here = flags.find(|argument| argument.get_long() == Some(flag));
    let here = here.and_then(|argument| argument.get_env()).map(ToOwned::to_owned);
    let below = || {
        let (at, below) = said
            .iter()
            .enumerate()
            .find_map(|(at, word)| Some((at, command.find_subcommand(word)?)))?;
        variable_behind(below, &said[at + 1..], flag)
    };
    here.or_else(below)
}

#[cfg(test)]
mod tests {
    use clap::{CommandFactory, Parser};

    use super::*;
    use crate::commands::Cli;

    fn of(variables: &[(&str, &str)]) -> Vec<Stranger> {
        let variables = variables
            .iter()
            .map(|(name, value)| ((*name).to_owned(), (*value).to_owned()));
        strangers(&Cli::command(), variables)
    }

    #[test]
    fn a_name_that_is_spelt_wrong_is_told_with_the_one_that_was_meant() {
        for (wrong, right) in [
            ("BELVEDERE_MAX_BAKE", "BELVEDERE_MAX_BAKES"),
            ("BELVEDERE_CACHE", "BELVEDERE_CACHE_MIB"),
            ("BELVEDERE_STORE_ENDPONT", "BELVEDERE_STORE_ENDPOINT"),
            ("BELVEDERE_LISTEN_ADDR", "BELVEDERE_LISTEN"),
        ] {
            let told = of(&[(wrong, "hush")]);
            assert_eq!(told.len(), 1, "{wrong}");
            let told = told[0].to_string();
            assert!(
                told.contains(wrong) && told.ends_with(&format!("did you mean {right}?")),
                "{told}"
            );
            assert!(!told.contains("hush"), "{told}");
        }
        let told = of(&[("BELVEDERE_WALLPAPER", "")]);
        assert!(told[0].to_string().ends_with("lists those that there are"), "{told:?}");
    }

    #[test]
    fn settings_what_others_set_and_what_kubernetes_sets_are_no_strangers() {
        let told = of(&[
            ("BELVEDERE_DATA", "/data"),
            ("BELVEDERE_CONFIG", "/etc/belvedere.toml"),
            ("OTEL_EXPORTER_OTLP_ENDPOINT", ""),
            ("MY_BELVEDERE_CACHE", ""),
            ("BELVEDERE_SERVICE_HOST", "10.0.0.1"),
            ("BELVEDERE_SERVICE_PORT_HTTP", "80"),
            ("BELVEDERE_PORT", "tcp://10.0.0.1:80"),
            ("BELVEDERE_PORT_80_TCP_ADDR", "10.0.0.1"),
        ]);
        assert_eq!(told, []);
    }

    #[test]
    fn a_value_that_cannot_be_read_is_told_with_its_variable_unless_an_argument_gave_it() {
        let words = |words: &[&str]| words.iter().map(ToString::to_string).collect::<Vec<_>>();
        let wrong = words(&["belvedere", "serve", "--tick-ms", "abc"]);
        let error = Cli::try_parse_from(&wrong).unwrap_err();
        let set = BTreeSet::from(["BELVEDERE_TICK_MS".into()]);
        let of = |said: &[String], set| variable_of(&Cli::command(), &error, said, set);
        assert_eq!(of(&wrong, &set), None);
        let alone = words(&["belvedere", "serve", "--lease-s=3"]);
        assert_eq!(of(&alone, &set).as_deref(), Some("BELVEDERE_TICK_MS"));
        assert_eq!(of(&alone, &BTreeSet::new()), None);
    }
}
