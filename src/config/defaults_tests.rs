//! Is what the help says of each default what the program does? Whoever gives a default aloud must get what one gets who
//! says nothing.

use std::path::Path;

use clap::{Args, Command, FromArgMatches};

use super::{Config, Settings};
use crate::live::nodes::NodeName;

/// Defaults that no value says which can be given, most of them in words.
const IN_WORDS: &[(&str, &str)] = &[
    // How the place was typed is kept beside what it comes to, so that aloud is not the same; compared below.
    ("data", "./data"),
    ("database", "in the data folder"),
    ("store", "in the data folder"),
    ("max_connections_per_address", "half of all"),
    ("max_sessions_per_address", "half of all"),
    ("operator_token", "everybody makes them"),
    ("base_origins", "those of its own only"),
    ("nats", "this server is alone"),
    // Whoever names a node does say something: its name goes before one made up.
    ("node", NodeName::UNLESS_SET),
    ("otlp", "no traces"),
];

/// The settings as flags, whatever stands in the environment.
fn flags() -> Command {
    Settings::augment_args(Command::new("settings")).mut_args(|arg| arg.env(None::<&'static str>))
}

/// Name and flag of each setting of which the help says a default, and that default.
fn defaults() -> Vec<(String, String, String)> {
    let mut found = Vec::new();
    for arg in flags().get_arguments() {
        let help = arg.get_help().map(ToString::to_string).unwrap_or_default();
        if let Some((_, said)) = help.split_once("[default: ") {
            let said = said.strip_suffix(']').unwrap_or_else(|| panic!("{help}"));
            let flag = format!("--{}", arg.get_long().expect("a setting has a flag"));
            found.push((arg.get_id().to_string(), flag, said.to_owned()));
        }
    }
    found
}

fn with(flag: &str, value: &str) -> Settings {
    let matches = flags().try_get_matches_from(["settings", flag, value]);
    Settings::from_arg_matches(&matches.unwrap_or_else(|e| panic!("{e}"))).unwrap_or_else(|e| panic!("{e}"))
}

#[test]
fn the_help_states_the_defaults_that_hold() {
    let silent = Config::try_from(Settings::default()).unwrap();
    let mut in_words = Vec::new();
    for (name, flag, said) in defaults() {
        if let Some(words) = IN_WORDS.iter().find(|(of, _)| *of == name) {
            assert_eq!(said, words.1, "{name}");
            in_words.push(name);
        } else {
            let aloud = Config::try_from(with(&flag, &said)).unwrap();
            assert_eq!(aloud, silent, "{flag} {said} is not what holds without it");
        }
    }
    assert_eq!(Path::new(".").join(&silent.place.data), Path::new("./data"));
    in_words.sort_unstable();
    let mut listed: Vec<_> = IN_WORDS.iter().map(|(name, _)| (*name).to_owned()).collect();
    listed.sort_unstable();
    assert_eq!(in_words, listed);
}

#[test]
fn each_setting_is_taken_from_where_it_is_set() {
    for (name, flag, said) in defaults() {
        if IN_WORDS.iter().any(|(of, _)| *of == name) {
            continue;
        }
        let set = with(&flag, &said);
        assert_ne!(set, Settings::default(), "{flag}");
        assert_eq!(set.clone().or(Settings::default()), set, "{flag}");
        assert_eq!(Settings::default().or(set.clone()), set, "{flag}");
    }
}
