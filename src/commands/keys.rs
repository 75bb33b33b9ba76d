//! `belvedere keys`: who may upload scenes, roll them back and read private ones.

use belvedere_scene::SceneName;
use clap::Subcommand;

use super::output::{print, print_json, table};
use crate::{
    keys::{Keys, ListedKey, Scope, Wanted},
    place::{Place, PlaceArgs},
};

#[derive(Debug, clap::Args)]
pub(super) struct Args {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Make a key and show it, this once
    Create(Create),
    /// List keys, without their secrets
    List(List),
    /// Take a key back; it opens nothing from its next use on
    Revoke(Revoke),
}

#[derive(Debug, clap::Args)]
struct Create {
    /// What to call it in lists
    #[arg(long, default_value = "unnamed", value_parser = name)]
    name: String,
    /// What it may do, with commas between, or given more than once [default: publish and rollback]
    #[arg(long, value_enum, value_delimiter = ',')]
    scope: Vec<Scope>,
    /// In which scenes, with commas between, or given more than once [default: in all]
    #[arg(long, value_delimiter = ',')]
    scene: Vec<SceneName>,
    /// After how many days it expires [default: never]
    #[arg(long, value_name = "DAYS", value_parser = clap::value_parser!(u32).range(1..=36_500))]
    expires_days: Option<u32>,
    /// Make the catalogue, too, when there is none yet
    #[arg(long)]
    new: bool,
    #[command(flatten)]
    place: PlaceArgs,
    /// Print the result as JSON
    #[arg(long)]
    json: bool,
}

#[derive(Debug, clap::Args)]
struct List {
    #[command(flatten)]
    place: PlaceArgs,
    /// Print the result as JSON
    #[arg(long)]
    json: bool,
}

#[derive(Debug, clap::Args)]
struct Revoke {
    /// The key's id: the first group of digits of a key, or the first column of `keys list`
    id: String,
    #[command(flatten)]
    place: PlaceArgs,
}

/// Something that can be read in a list.
fn name(text: &str) -> Result<String, &'static str> {
    let is_seen = text.chars().any(|c| !c.is_whitespace() && !c.is_control());
    is_seen
        .then(|| text.to_owned())
        .ok_or("a name is wanted that can be read, such as press")
}

/// The keys of a catalogue that is there; `make` makes one.
async fn open(place: &PlaceArgs, make: bool) -> anyhow::Result<Keys> {
    let place = Place::try_from(place)?;
    anyhow::ensure!(
        make || place.has_catalogue(),
        "there is no catalogue in {0}; name the folder with --data, or make one there with \
         `belvedere keys create --new --data {0}`, as a bake or `belvedere serve` does",
        place.data.display(),
    );
    Ok(Keys::new(place.open_catalogue().await?))
}

pub(super) async fn run(args: Args) -> anyhow::Result<()> {
    match args.command {
        Command::Create(args) => create(args).await,
        Command::List(args) => list(&args).await,
        Command::Revoke(args) => revoke(&args).await,
    }
}

async fn create(args: Create) -> anyhow::Result<()> {
    let keys = open(&args.place, args.new).await?;
    let wanted = Wanted {
        name: args.name,
        scopes: if args.scope.is_empty() {
            vec![Scope::Publish, Scope::Rollback]
        } else {
            args.scope
        },
        scenes: (!args.scene.is_empty()).then_some(args.scene),
        days: args.expires_days,
    };
    let key = keys.create(&wanted).await?;
    if args.json {
        return print_json(&serde_json::json!({
            "id": key.id(), "key": key.reveal(), "name": wanted.name, "scopes": wanted.scopes, "scenes": wanted.scenes,
        }));
    }
    // Alone on standard output, so that a script can take it.
    print(&key.reveal())?;
    eprintln!(
        "keep it now: it is not shown again; `belvedere keys revoke {}` takes it back",
        key.id()
    );
    Ok(())
}

async fn list(args: &List) -> anyhow::Result<()> {
    let keys = open(&args.place, false).await?.list().await?;
    if args.json {
        return print_json(&keys);
    }
    let rows: Vec<_> = keys.iter().map(row).collect();
    print(&table(&["id", "name", "may", "in", "made", "state"], &rows))
}

fn row(key: &ListedKey) -> Vec<String> {
    let joined = |words: Vec<String>| words.join(",");
    let state = match (&key.revoked_at, &key.expires_at) {
        (Some(when), _) => format!("revoked {when}"),
        (None, Some(when)) if key.valid => format!("until {when}"),
        (None, Some(when)) => format!("expired {when}"),
        (None, None) => "valid".to_owned(),
    };
    vec![
        key.grant.id.clone(),
        key.name.clone(),
        joined(key.grant.scopes.iter().map(ToString::to_string).collect()),
        match &key.grant.scenes {
            Some(scenes) => joined(scenes.iter().map(ToString::to_string).collect()),
            None => "all scenes".to_owned(),
        },
        key.created_at.clone(),
        state,
    ]
}

async fn revoke(args: &Revoke) -> anyhow::Result<()> {
    // Whoever has the whole key at hand may show that; it is not repeated.
    let id = match args.id.parse::<crate::keys::ApiKey>() {
        Ok(key) => key.id().to_owned(),
        Err(_) => args.id.clone(),
    };
    anyhow::ensure!(
        open(&args.place, false).await?.revoke(&id).await?,
        "there is no key {id}; `belvedere keys list` shows which there are"
    );
    print(&format!("key {id} is revoked"))
}

#[cfg(test)]
mod tests {
    use super::name;

    #[test]
    fn a_name_can_be_read() {
        assert_eq!(name("the press"), Ok("the press".to_owned()));
        for text in ["", " ", "\t\n"] {
            assert!(name(text).is_err(), "{text:?}");
        }
    }
}
