//! `belvedere private`: which scenes are not for everybody.

use anyhow::Context;
use belvedere_scene::SceneName;

use super::output::{print, print_json, table};
use crate::{
    db::Catalogue,
    links::LinkKey,
    place::{Place, PlaceArgs},
};

#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// The scene that only links and API keys shall open; it need not be published yet
    #[arg(required_unless_present = "list")]
    scene: Option<SceneName>,
    /// Open it to everybody again; its links end
    #[arg(long)]
    end: bool,
    /// Sign its links with another key from now on: none that was made before holds any more
    #[arg(long, conflicts_with = "end")]
    new_key: bool,
    /// Print the key that its links are signed with, for the edge of a CDN
    #[arg(long, conflicts_with_all = ["end", "new_key"])]
    show_key: bool,
    /// List the private scenes
    #[arg(long, conflicts_with_all = ["scene", "end", "new_key", "show_key"])]
    list: bool,
    #[command(flatten)]
    place: PlaceArgs,
    /// Print the result as JSON
    #[arg(long)]
    json: bool,
}

pub(super) async fn run(args: Args) -> anyhow::Result<()> {
    let catalogue = Place::try_from(&args.place)?.open_catalogue().await?;
    match args.scene {
        None => list(&catalogue, args.json).await,
        Some(scene) if args.end => {
            anyhow::ensure!(catalogue.make_public(&scene).await?, "scene `{scene}` is not private");
            say(
                args.json,
                &scene,
                false,
                None,
                &format!("scene {scene} is for everybody"),
            )
        }
        Some(scene) if args.show_key => {
            let key = key_of(&catalogue, &scene).await?;
            let key = key.with_context(|| format!("scene `{scene}` is not private, so it has no links"))?;
            say(args.json, &scene, true, Some(&key), "")
        }
        Some(scene) => {
            let made = make_private(&catalogue, &scene).await?;
            if args.new_key && !made {
                catalogue.replace_link_key(&scene, LinkKey::random()?.secret()).await?;
            }
            let ended = if args.new_key && !made {
                ", and no link that was made before holds"
            } else {
                ""
            };
            let sentence = format!("scene {scene} is private{ended}; `belvedere sign {scene}` makes links to it");
            say(args.json, &scene, true, None, &sentence)
        }
    }
}

/// Says whether it was not before.
pub(super) async fn make_private(catalogue: &Catalogue, scene: &SceneName) -> anyhow::Result<bool> {
    catalogue.make_private(scene, LinkKey::random()?.secret()).await
}

/// What the links of a scene are signed with, if it is private.
pub(super) async fn key_of(catalogue: &Catalogue, scene: &SceneName) -> anyhow::Result<Option<LinkKey>> {
    let all = catalogue.private_scenes().await?;
    let private = all.into_iter().find(|private| private.scene == *scene);
    Ok(private.map(|private| private.link_key.reveal().parse()).transpose()?)
}

fn say(json: bool, scene: &SceneName, private: bool, key: Option<&LinkKey>, sentence: &str) -> anyhow::Result<()> {
    let key = key.map(|key| key.secret().reveal());
    if json {
        return print_json(&serde_json::json!({"scene": scene, "private": private, "link_key": key}));
    }
    match key {
        // Alone on standard output, so that a script can take it.
        Some(key) => print(key),
        None => print(sentence),
    }
}

async fn list(catalogue: &Catalogue, json: bool) -> anyhow::Result<()> {
    let all = catalogue.private_scenes().await?;
    let rows: Vec<_> = all
        .into_iter()
        .map(|private| vec![private.scene.to_string(), private.since])
        .collect();
    if json {
        let rows = rows
            .iter()
            .map(|row| serde_json::json!({"scene": row[0], "since": row[1]}));
        return print_json(&rows.collect::<Vec<_>>());
    }
    print(&table(&["scene", "private since"], &rows))
}
