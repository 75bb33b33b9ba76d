//! A client that is told only where the eye is: it fetches what can be seen, and goes on where something is wrong.

use crate::{
    program::{Data, THREE_ROOMS},
    watched::{Harm, Watched},
};
use belvedere_client::{
    ByteSource, Client, Error, Event, Explorer, ExplorerOptions, FolderSource, HttpSource, Retrying,
    strategy::{order::Budgets, sight::Eye},
};

fn rooms() -> (Data, String) {
    let data = Data::new();
    data.bake(&data.write("rooms.plan", THREE_ROOMS), "rooms");
    data.ok(&["publish", "rooms", "--to", "tree"]);
    let tree = data.folder("tree").to_str().expect("UTF-8").to_owned();
    (data, tree)
}

async fn explorer<S: ByteSource + 'static>(source: S, memory_bytes: u64) -> Explorer<S> {
    let scene = Client::new(source)
        .open(&"rooms".parse().expect("a name"))
        .await
        .expect("a scene");
    let budgets = Budgets {
        memory_bytes,
        ..Budgets::default()
    };
    let options = ExplorerOptions {
        budgets,
        recovers: false,
        ..ExplorerOptions::default()
    };
    Explorer::new(scene, options)
}

/// Walks from the west room through the doorway; answers what went wrong.
async fn walk<S: ByteSource + 'static>(explorer: &mut Explorer<S>) -> Vec<Error> {
    let mut problems = Vec::new();
    for x in [2.5, 4.5, 6.5] {
        explorer.follow(Eye::at([x, 1.5, 2.5])).await;
        while let Some(events) = explorer.advance().await {
            for event in events {
                match event {
                    Event::Problem(cause) => problems.push(cause),
                    Event::Drawn { model, .. } => assert!(explorer.mesh(model).is_some(), "{model}"),
                    _ => {}
                }
            }
        }
    }
    problems
}

#[tokio::test]
async fn all_that_can_be_seen_comes_once_and_progress_says_when_that_is_all() {
    let (data, tree) = rooms();
    let server = data.serve();
    let folder = Watched::new(FolderSource::new(tree), |_, bytes| Ok(bytes));
    let mut still = explorer(folder.clone(), u64::MAX).await;
    assert_eq!(still.progress().total_bytes, 0);
    assert!(walk(&mut still).await.is_empty());
    let (first, sharp) = (still.progress(), still.sharp_progress());
    assert!(
        first.total_bytes > 0 && first.loaded_bytes == first.total_bytes,
        "{first}"
    );
    assert!(
        sharp.loaded_bytes == sharp.total_bytes && still.missing() == Some(0),
        "{sharp}"
    );
    assert_eq!(folder.twice(), Vec::<String>::new());
    // A server offers bundles: the same is there in the end, with no more requests.
    let http = HttpSource::new(&server.base).expect("an address");
    let served = Watched::new(http, |_, bytes| Ok(bytes));
    let mut other = explorer(served.clone(), u64::MAX).await;
    assert!(walk(&mut other).await.is_empty());
    assert_eq!((other.missing(), other.sharp_progress()), (Some(0), sharp));
    let asked = [served.requests(), folder.requests()];
    assert!(asked[0] <= asked[1], "{asked:?}");
}

#[tokio::test]
async fn what_is_lost_or_damaged_is_told_and_done_without() {
    let (_data, tree) = rooms();
    let harms: [Harm; 3] = [
        |path, bytes| match path.ends_with(".pack") {
            true => Err(Error::Missing(path.to_owned())),
            false => Ok(bytes),
        },
        |path, bytes| match path.ends_with(".pack") {
            true => Ok(bytes.slice(1..)),
            false => Ok(bytes),
        },
        |path, bytes| match path.ends_with(".pack") {
            true => Err(Error::Fetch {
                path: path.to_owned(),
                cause: "the connection was cut".to_owned(),
            }),
            false => Ok(bytes),
        },
    ];
    for harm in harms {
        let source = Retrying::new(Watched::new(FolderSource::new(&tree), harm));
        let mut explorer = explorer(source, u64::MAX).await;
        let problems = walk(&mut explorer).await;
        assert!(!problems.is_empty() && explorer.missing() == Some(0), "{problems:?}");
    }
    // Without any level nothing can be drawn, and that is told, too.
    let source = Watched::new(FolderSource::new(&tree), |path, bytes| {
        let is_mesh = [".pack", ".glb", ".slod"].iter().any(|ext| path.ends_with(ext));
        if is_mesh {
            Err(Error::Missing(path.to_owned()))
        } else {
            Ok(bytes)
        }
    });
    let mut explorer = explorer(source, u64::MAX).await;
    let problems = walk(&mut explorer).await;
    assert!(!problems.is_empty() && explorer.missing() == Some(explorer.visible().len()));
}

#[tokio::test]
async fn without_the_map_of_cells_or_any_record_all_is_shown_and_that_is_said() {
    let (_data, tree) = rooms();
    let harms: [Harm; 2] = [
        |path, bytes| {
            let names_cells = path.ends_with(".json") && bytes.windows(10).any(|ten| ten == b"\"adjacent\"");
            if names_cells {
                Err(Error::Missing(path.to_owned()))
            } else {
                Ok(bytes)
            }
        },
        |path, bytes| match path.ends_with(".cell") || bytes.starts_with(b"{\"cell\":") {
            true => Err(Error::Missing(path.to_owned())),
            false => Ok(bytes),
        },
    ];
    for (harm, told) in harms.into_iter().zip(["map of cells", ".cell"]) {
        let mut explorer = explorer(Watched::new(FolderSource::new(&tree), harm), u64::MAX).await;
        let problems = walk(&mut explorer).await;
        let all = explorer.scene().manifest().counts.objects;
        assert_eq!((explorer.visible().len(), explorer.missing()), (all as usize, Some(0)));
        assert!(problems[0].to_string().contains(told), "{problems:?}");
        let again = walk(&mut explorer).await;
        assert!(again.is_empty(), "told once: {again:?}");
    }
}

#[tokio::test]
async fn memory_is_kept_and_said_when_not_even_the_neighbours_fit() {
    let (_data, tree) = rooms();
    let mut roomy = explorer(FolderSource::new(&tree), u64::MAX).await;
    walk(&mut roomy).await;
    let all = roomy.memory_bytes();
    let mut tight = explorer(FolderSource::new(&tree), all / 8).await;
    let problems = walk(&mut tight).await;
    assert!(tight.memory_bytes() <= all / 8);
    let short = problems.iter().find(|cause| matches!(cause, Error::MemoryShort { .. }));
    let told = short.expect("it does not fit").to_string();
    assert!(
        told.contains("cells next door") && told.contains("raise the limit"),
        "{told}"
    );
}

#[tokio::test]
async fn a_revision_that_comes_under_way_is_told_and_the_walk_goes_on_in_either() {
    let (data, _) = rooms();
    let server = data.serve();
    let source = Watched::new(HttpSource::new(&server.base).expect("an address"), |_, bytes| Ok(bytes));
    let mut explorer = explorer(source.clone(), u64::MAX).await;
    assert!(explorer.scene().is_current().await.expect("a pointer"));
    walk(&mut explorer).await;
    assert!(explorer.successor().await.expect("a pointer").is_none());
    data.bake(
        &data.write("rooms.plan", THREE_ROOMS.replace("#a..#", "#.a.#")),
        "rooms",
    );
    for _ in 0..100 {
        explorer.look_for_newer();
        while explorer.advance().await.is_some() {}
        if explorer.newer_revision().is_some() {
            break;
        }
        tokio::time::sleep(std::time::Duration::from_millis(100)).await;
    }
    assert!(!explorer.scene().is_current().await.expect("a pointer"));
    assert!(walk(&mut explorer).await.is_empty());
    assert_eq!(explorer.missing(), Some(0));

    let mut next = explorer
        .successor()
        .await
        .expect("a pointer")
        .expect("a newer revision");
    assert_eq!(Some(next.scene().pointer().revision), explorer.newer_revision());
    assert!(walk(&mut next).await.is_empty());
    assert_eq!((next.missing(), source.twice()), (Some(0), Vec::new()));
}
