//! What are rules given on the command line? `--set NAME=VALUE` and `--seed`, the same for every command that grows them.

use belvedere_bake::import::procedural::Sowing;
use belvedere_scene::procedural::Value;

#[derive(Debug, clap::Args)]
pub(super) struct SowingArgs {
    /// A parameter of the rules: `--set height=12`; a list as in JSON: `--set 'footprint=[[0,0],[8,0],[8,6]]'`
    #[arg(long, value_name = "NAME=VALUE", value_parser = parameter)]
    set: Vec<(String, Value)>,
    /// Where the random numbers of rules come from
    #[arg(long, default_value_t = 0)]
    seed: u32,
}

impl From<SowingArgs> for Sowing {
    fn from(args: SowingArgs) -> Self {
        Self {
            seed: args.seed,
            parameters: args.set.into_iter().collect(),
        }
    }
}

fn parameter(text: &str) -> Result<(String, Value), String> {
    let (name, value) = text.split_once('=').ok_or("write NAME=VALUE")?;
    let json = serde_json::from_str(value).map_err(|_| format!("`{value}` is neither a number nor a list"))?;
    let value = Value::from_json(&json).ok_or_else(|| format!("`{value}` is neither a number nor a list of them"))?;
    Ok((name.trim().to_owned(), value))
}
