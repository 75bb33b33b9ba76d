//! Many small things that have grown from rules: what a client reads of them before the first picture, and what it does when the
//! rules cannot be had.

use std::collections::BTreeSet;

use belvedere_client::{
    Client, Error, Event, Explorer, ExplorerOptions, FolderSource,
    strategy::{grade::Form, sight::Eye},
    tour::{self, Script, TourSettings},
};
use belvedere_scene::{SceneName, manifest::Manifest, population::POPULATION_OBJECTS};

use crate::{program::Data, watched::Watched};

/// Two closed rooms with 300 posts in each, of three heights. Nobody can enter the second.
const POSTS: &str = "
material wood { colour = #7a5232 }
part post(height) { paint wood box(0.1, height, 0.1) }
rule room() {
  for i in 2 { move((i - 0.5) * 24, 0, 0) box(0.4, 4, 24.4) move(0, 0, (i - 0.5) * 24) box(24.4, 4, 0.4) }
  for i in 2 move(0, 4.4 * i - 0.4, 0) box(24.4, 0.4, 24.4)
  for i in 20 for k in 15 move(i - 9.5, 0, k - 7) post(1 + mod(i, 3))
}
for i in 2 move(30 * i, 0, 0) room()
move(0.25, 1.7, 0.25) viewpoint \"Among posts\"
";

fn posts() -> (Data, FolderSource) {
    let data = Data::new();
    data.bake(&data.write("posts.dcg", POSTS), "posts");
    data.ok(&["publish", "posts", "--to", "tree"]);
    let tree = FolderSource::new(data.folder("tree"));
    (data, tree)
}

fn name() -> SceneName {
    "posts".parse().expect("a name")
}

/// Without them, what a source gives as it is.
fn without_rules(path: &str, bytes: bytes::Bytes) -> Result<bytes::Bytes, Error> {
    match path.ends_with(".dcg") {
        true => Err(Error::Missing(path.to_owned())),
        false => Ok(bytes),
    }
}

/// The chunks of the indices of cells, objects and models.
fn chunks(manifest: &Manifest) -> BTreeSet<String> {
    let roots = [&manifest.cells, &manifest.objects, &manifest.models];
    let entries = roots.into_iter().flat_map(|root| &root.entries);
    entries.map(|entry| entry.url.url()).collect()
}

#[tokio::test]
async fn who_begins_at_a_viewpoint_reads_one_document_instead_of_chunks() {
    let (_data, tree) = posts();
    let source = Watched::new(tree, |_, bytes| Ok(bytes));
    let scene = Client::new(source.clone()).open(&name()).await.expect("a scene");
    let eye = scene.manifest().viewpoints[0].position;
    let begun = scene.begin(eye, false).await.expect("a cell");
    let record = scene.record(&begun.cell).await.expect("a record");
    let infos = scene.visible(&record).await.expect("infos");
    assert!(infos.len() > 300, "{} objects", infos.len());
    let [start] = &scene.manifest().starts[..] else {
        panic!("one viewpoint has one start");
    };
    let asked = source.paths();
    assert!(asked.contains(&start.url.url()));
    assert_eq!(asked.intersection(&chunks(scene.manifest())).count(), 0);

    let indexed = Client::new(source.clone()).open(&name()).await.expect("a scene");
    assert_eq!(begun, indexed.locate(eye).await.expect("a cell"));
    assert_eq!(infos, indexed.visible(&record).await.expect("infos"));
    // Who has read of what is around already has no use for it.
    indexed.begin(eye, false).await.expect("a cell");
    assert!(!source.twice().contains(&start.url.url()));
}

async fn explorer(source: Watched<FolderSource>) -> Explorer<Watched<FolderSource>> {
    let scene = Client::new(source).open(&name()).await.expect("a scene");
    let options = ExplorerOptions {
        rules: true,
        recovers: false,
        ..ExplorerOptions::default()
    };
    Explorer::new(scene, options)
}

/// Stands at the viewpoint until all is there; answers with the forms in which things are drawn and what went wrong.
async fn stand(explorer: &mut Explorer<Watched<FolderSource>>) -> (Vec<Form>, Vec<Error>) {
    let (mut forms, mut problems) = (Vec::new(), Vec::new());
    let eye = Eye::at(explorer.scene().manifest().viewpoints[0].position);
    explorer.follow(eye).await;
    while let Some(events) = explorer.advance().await {
        for event in events {
            match event {
                Event::Drawn { grade, .. } => forms.push(grade.form),
                Event::Problem(cause) => problems.push(cause),
                _ => {}
            }
        }
    }
    (forms, problems)
}

#[tokio::test]
async fn posts_grow_where_populations_say_they_stand() {
    let (_data, tree) = posts();
    let source = Watched::new(tree, |_, bytes| Ok(bytes));
    let mut explorer = explorer(source.clone()).await;
    let (forms, problems) = stand(&mut explorer).await;
    assert!(problems.is_empty(), "{problems:?}");
    assert_eq!(explorer.missing(), Some(0));
    let standing_in = explorer.visible().iter().filter(|seen| seen.is_stand_in()).count();
    // For the few posts beyond the first population, entries cost less than all of the next.
    assert!(
        standing_in >= POPULATION_OBJECTS,
        "{standing_in} of {}",
        explorer.visible().len()
    );
    assert!(forms.contains(&Form::Grown));
    let manifest = explorer.scene().manifest();
    let populations = manifest.populations.as_ref().expect("posts can be grown");
    let asked = source.paths();
    assert!(populations.entries.iter().any(|entry| asked.contains(&entry.url.url())));
    let starts = manifest.starts.iter().map(|start| start.url.url());
    assert_eq!(
        starts.filter(|start| asked.contains(start)).count(),
        0,
        "populations are fewer bytes"
    );
}

#[tokio::test]
async fn levels_come_instead_of_rules_that_get_lost_on_the_way() {
    let (_data, tree) = posts();
    let source = Watched::new(tree.clone(), without_rules);
    let mut explorer = explorer(source).await;
    let (forms, problems) = stand(&mut explorer).await;
    assert!(
        problems
            .iter()
            .any(|cause| matches!(cause, Error::Missing(path) if path.ends_with(".dcg"))),
        "{problems:?}"
    );
    assert_eq!(explorer.missing(), Some(0));
    assert!(explorer.visible().iter().all(|seen| !seen.is_stand_in()));
    assert!(
        forms.contains(&Form::Level) && !forms.contains(&Form::Grown),
        "{forms:?}"
    );

    let position = explorer.scene().manifest().viewpoints[0].position;
    let still = |t_ms: u32| format!("{{\"t_ms\": {t_ms}, \"position\": {position:?}}}\n");
    let script = Script::parse(&[0, 20_000].map(still).concat()).expect("two moments");
    let source = Watched::new(tree, without_rules);
    let walked = tour::walk(source, &name(), &script, &TourSettings::default(), || ())
        .await
        .expect("a walk");
    assert!(walked.lost_files > 0);
    assert_eq!(
        walked.frames.last().map(|frame| (frame.missing, frame.quality)),
        Some((0, 1.0))
    );
}
