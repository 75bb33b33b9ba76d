//! What are rules given on the command line? `--set NAME=VALUE` and `--seed`, the same for every command that grows them.

use std::{collections::BTreeMap, ffi::OsStr};

use belvedere_bake::import::{ImportError, procedural::Sowing};
use belvedere_scene::procedural::{
    Settings, Value, in_place_of_text, is_order,
    limits::{FINEST, MAX_LIST_DEPTH, reached},
};
use clap::{
    Arg, Command,
    builder::TypedValueParser,
    error::{Error, ErrorKind},
};

#[derive(Debug, clap::Args)]
pub(super) struct SowingArgs {
    /// A parameter of the rules: `--set height=12`; a list as in JSON: `--set 'footprint=[[0,0],[8,0],[8,6]]'`
    #[arg(long, value_name = "NAME=VALUE", value_parser = Parameter)]
    set: Vec<(String, Value)>,
    /// Where the random numbers of rules come from
    #[arg(long, default_value_t = 0, value_parser = Whole("--seed <SEED>", seed), allow_negative_numbers = true)]
    seed: u32,
}

/// The same, and how fine it grows, for commands that grow rules and bake nothing.
#[derive(Debug, clap::Args)]
pub(super) struct GrowthArgs {
    #[command(flatten)]
    sowing: SowingArgs,
    /// The level of detail of rules, from 0 (coarsest) to 4 (finest)
    #[arg(long, default_value_t = FINEST, value_parser = Whole("--detail <DETAIL>", detail), allow_negative_numbers = true)]
    detail: u32,
}

/// Refuses them where there is nothing that grows, for the reason that is given.
pub(super) fn refuse_given(GrowthArgs { sowing, detail }: &GrowthArgs, because: &str) -> anyhow::Result<()> {
    let is_none = sowing.set.is_empty() && sowing.seed == 0 && *detail == FINEST;
    anyhow::ensure!(
        is_none,
        "`--set`, `--seed` and `--detail` are for rules (.dcg), and {because}: leave them out"
    );
    Ok(())
}

impl TryFrom<GrowthArgs> for Settings {
    type Error = anyhow::Error;

    fn try_from(GrowthArgs { sowing, detail }: GrowthArgs) -> anyhow::Result<Self> {
        let Sowing { seed, parameters } = sowing.try_into()?;
        Ok(Self {
            seed,
            detail,
            parameters,
            ..Self::default()
        })
    }
}

fn detail(text: &str) -> Result<u32, String> {
    let detail = text.parse().ok().filter(|detail| *detail <= FINEST);
    detail.ok_or_else(|| format!("a level of detail is a whole number from 0 to {FINEST}"))
}

impl TryFrom<SowingArgs> for Sowing {
    type Error = anyhow::Error;

    fn try_from(args: SowingArgs) -> anyhow::Result<Self> {
        let mut parameters = BTreeMap::new();
        for (name, value) in args.set {
            anyhow::ensure!(
                !parameters.contains_key(&name),
                "`--set {}=…` is given twice; remove one of the two",
                beginning(&name)
            );
            parameters.insert(name, value);
        }
        let seed = args.seed;
        Ok(Self { seed, parameters })
    }
}

/// Whether not the rules are wrong but what they were given, which stands in no line of them.
fn is_given(error: &ImportError) -> bool {
    matches!(error, ImportError::Rules(rules) if rules.line == 0)
}

/// What is wrong with rules; where it is what they were given, that is said.
pub(super) fn told(error: ImportError) -> anyhow::Error {
    if is_given(&error) {
        anyhow::anyhow!("`--set`: {error}")
    } else {
        error.into()
    }
}

/// The same of what became of them.
pub(super) fn blamed(cause: anyhow::Error) -> anyhow::Error {
    if cause.downcast_ref().is_some_and(is_given) {
        cause.context("`--set` gives what these rules do not take")
    } else {
        cause
    }
}

fn seed(text: &str) -> Result<u32, String> {
    text.parse()
        .map_err(|_| format!("a seed is a whole number from 0 to {}", u32::MAX))
}

/// Reads what is called so. What is wrong is told with no more of a long value than its beginning.
#[derive(Debug, Clone)]
struct Whole(&'static str, fn(&str) -> Result<u32, String>);

impl TypedValueParser for Whole {
    type Value = u32;

    fn parse_ref(&self, command: &Command, _: Option<&Arg>, value: &OsStr) -> Result<u32, Error> {
        let Self(what, read) = self;
        let text = value.to_string_lossy();
        read(&text).map_err(|wrong| {
            let told = format!("invalid value '{}' for '{what}': {wrong}\n", beginning(&text));
            Error::raw(ErrorKind::ValueValidation, told).with_cmd(command)
        })
    }
}

/// Reads `NAME=VALUE`. What is wrong is told once, and no more of a long value than its beginning.
#[derive(Debug, Clone)]
struct Parameter;

impl TypedValueParser for Parameter {
    type Value = (String, Value);

    fn parse_ref(&self, command: &Command, _: Option<&Arg>, value: &OsStr) -> Result<Self::Value, Error> {
        parameter(&value.to_string_lossy())
            .map_err(|wrong| Error::raw(ErrorKind::ValueValidation, format!("`--set`: {wrong}\n")).with_cmd(command))
    }
}

fn parameter(text: &str) -> Result<(String, Value), String> {
    let missing = || format!("`{}` has no `=`; write NAME=VALUE", beginning(text));
    let (name, value) = text.split_once('=').ok_or_else(missing)?;
    if name.trim().is_empty() {
        return Err("before `=` the name of a parameter is missing; write NAME=VALUE".to_owned());
    }
    // JSON of lists that are much deeper is not read at all.
    if deepest(value) > MAX_LIST_DEPTH as usize {
        let reached = reached("lists inside each other", MAX_LIST_DEPTH.into());
        return Err(format!("the value of `{}` has {reached}", beginning(name.trim())));
    }
    let unread = || {
        format!(
            "the value of `{}` is neither a number nor a list of them: `{}`",
            beginning(name.trim()),
            beginning(value)
        )
    };
    let instead = || in_place_of_text(value.trim()).unwrap_or_else(|| usual(value.trim()));
    let with_way_out = || format!("{}; write {}", unread(), instead());
    let json = serde_json::from_str(value).map_err(|cause| match place_in(value, &cause) {
        Some(place) => unread() + &place,
        None => with_way_out(),
    })?;
    let value = Value::from_json(&json).ok_or_else(with_way_out)?;
    Ok((name.trim().to_owned(), value))
}

/// How values are written, where one cannot see which was meant.
fn usual(value: &str) -> String {
    if value.starts_with('#') {
        "a number, or, where a colour is wanted, a list of its channels from 0 to 1, as `[1,0,0]` for `#f00`".to_owned()
    } else {
        "a number, as `12` or `0.5`, or a list, as `[1,0,0]`".to_owned()
    }
}

/// Where a long value goes wrong.
fn place_in(value: &str, cause: &serde_json::Error) -> Option<String> {
    let rest = value.get(cause.column().saturating_sub(1)..).unwrap_or_default();
    let is_far = value.len() > MOST_SHOWN && !rest.is_empty();
    is_far.then(|| format!(", from letter {} on: `{}`", cause.column(), beginning(rest)))
}

/// Most letters of a value that a message repeats.
const MOST_SHOWN: usize = 120;

/// The beginning of what may be long, without what a terminal would take for an order.
pub(super) fn beginning(value: &str) -> String {
    let mut letters = value.chars();
    let shown: String = letters
        .by_ref()
        .take(MOST_SHOWN)
        .map(|c| if is_order(c) { char::REPLACEMENT_CHARACTER } else { c })
        .collect();
    match letters.next() {
        Some(_) => shown + "…",
        None => shown,
    }
}

/// Most brackets that are open at once.
fn deepest(value: &str) -> usize {
    let (mut open, mut most) = (0_usize, 0);
    for letter in value.chars() {
        match letter {
            '[' => open += 1,
            ']' => open = open.saturating_sub(1),
            _ => {}
        }
        most = most.max(open);
    }
    most
}

#[cfg(test)]
mod tests {
    use belvedere_bake::import::procedural::{Ground, plant};
    use belvedere_bake::{import::Limits, progress::Silent};
    use belvedere_scene::procedural::{Settings, Value};

    use super::{blamed, parameter, seed, told};
    use crate::publish::source_files::SourceFolder;

    #[test]
    fn what_was_set_wrongly_is_told_where_it_was_set() {
        let planted = |text: &str| {
            let settings = Settings {
                parameters: [("heigth".to_owned(), Value::Number(3.0))].into(),
                ..Settings::default()
            };
            let ground = Ground {
                files: &SourceFolder::beside(std::path::Path::new("tree.dcg")),
                limits: &Limits::default(),
                progress: &Silent,
            };
            plant("tree.dcg", text.as_bytes().to_vec(), &settings, ground)
                .err()
                .unwrap()
        };
        let refused = |text: &str| told(planted(text)).to_string();
        let known = refused("parameter height = 2 box(1, height, 1)");
        assert_eq!(
            known,
            "`--set`: `heigth` is not a parameter of `tree.dcg`; did you mean `height`?"
        );
        assert!(refused("bix(1)").starts_with("tree.dcg, line 1, column 1: "));
        let of_bake = blamed(anyhow::Error::from(planted("parameter height = 2")).context("cannot import tree.dcg"));
        assert!(
            super::super::sentence(&of_bake).starts_with("`--set` gives what these rules do not take: cannot import")
        );
    }

    #[test]
    fn a_wrong_seed_or_parameter_is_told_what_it_should_be() {
        assert_eq!(seed("4294967295"), Ok(u32::MAX));
        for wrong in ["-1", "abc", "4294967296", "1.5", ""] {
            assert!(seed(wrong).unwrap_err().contains("0 to 4294967295"), "{wrong}");
        }
        assert_eq!(parameter("height=12").unwrap().0, "height");
        let list = |depth: usize| format!("any={}1{}", "[".repeat(depth), "]".repeat(depth));
        assert!(parameter(&list(64)).is_ok());
        assert_eq!(
            parameter(&list(70)).unwrap_err(),
            "the value of `any` has more than 64 lists inside each other; make it smaller"
        );
        assert_eq!(
            parameter(&list(200)).unwrap_err(),
            "the value of `any` has more than 64 lists inside each other; make it smaller"
        );
        assert_eq!(
            parameter("a=tall").unwrap_err(),
            "the value of `a` is neither a number nor a list of them: `tall`; write a number, as `12` or `0.5`, or a list, as `[1,0,0]`"
        );
        assert_eq!(
            parameter("a=[1, {}]").unwrap_err(),
            "the value of `a` is neither a number nor a list of them: `[1, {}]`; write a number, as `12` or `0.5`, or a list, as \
             `[1,0,0]`"
        );
        for (given, instead) in [
            ("#ff0000", "[1,0,0]"),
            ("#0f8", "[0,1,0.533]"),
            ("f00", "[1,0,0]"),
            ("red", "[1,0,0]"),
        ] {
            let told = parameter(&format!("tint={given}")).unwrap_err();
            let wanted = format!(": `{given}`; write a number, or, where a colour is wanted, `{instead}`");
            assert!(told.ends_with(&wanted), "{told}");
            assert!(parameter(&format!("tint={instead}")).is_ok());
        }
        let told = parameter("tint=#12").unwrap_err();
        assert!(
            told.ends_with("a list of its channels from 0 to 1, as `[1,0,0]` for `#f00`"),
            "{told}"
        );
        for (given, instead) in [
            ("true", "1"),
            ("false", "0"),
            ("03", "3"),
            ("+3", "3"),
            ("-03", "-3"),
            ("1/2", "0.5"),
            (".5", "0.5"),
            ("2.", "2"),
            ("12m", "12"),
            ("45°", "45"),
        ] {
            let told = parameter(&format!("height={given}")).unwrap_err();
            assert!(told.ends_with(&format!(": `{given}`; write `{instead}`")), "{told}");
            assert!(parameter(&format!("height={instead}")).is_ok());
        }
        for given in ["1/0", "inf", "NaN", "1e999", "-", "m"] {
            let told = parameter(&format!("height={given}")).unwrap_err();
            assert!(
                told.ends_with("; write a number, as `12` or `0.5`, or a list, as `[1,0,0]`"),
                "{told}"
            );
        }
        let long = parameter(&format!("a=[{}x]", "1, ".repeat(500))).unwrap_err();
        assert!(long.contains("from letter 1502 on: `x]`") && long.len() < 250, "{long}");
        let long = parameter(&"x".repeat(70_000)).unwrap_err();
        assert!(long.contains("write NAME=VALUE") && long.len() < 250, "{long}");
        for order in ['\u{1b}', '\n', '\u{202e}', '\u{200f}'] {
            let told = parameter(&format!("{order}a={order}[2J")).unwrap_err();
            assert!(!told.contains(order), "{told:?}");
        }
        for wrong in ["=3", " = 3", "height"] {
            assert!(parameter(wrong).unwrap_err().contains("NAME=VALUE"), "{wrong}");
        }
    }
}
