//! Smooth LODs, from the bake to the last byte: rungs in a static tree and from the server, and the tools for one file.

use belvedere_client::{
    ByteSource, Client, DiskCache, Error, Event, Explorer, ExplorerOptions, FolderSource, HttpSource,
    strategy::sight::Eye,
};
use belvedere_scene::{
    ObjectId, SceneName,
    rung::SmoothLod,
    smooth::{Decoder, Header},
};
use serde_json::Value;

use crate::{
    program::Data,
    watched::{Harm, Watched},
};

const VASE: &str = "\
title: A vase
legend:
    v = vase marble
    t = spheres
plan:
    ########
    #@.....#
    #..v.t.#
    #......#
    ########
";

fn json(text: &str) -> Value {
    serde_json::from_str(text).expect("JSON")
}

#[tokio::test(flavor = "multi_thread")]
async fn the_rungs_of_every_smooth_lod_are_files_of_the_tree_and_answers_of_the_server() {
    let data = Data::new();
    let report = data.bake(&data.write("vase.plan", VASE), "vase");
    assert!(report["seconds"]["smooth"].as_f64() > Some(0.0), "{report}");
    let tree = data.folder("tree");
    let to = tree.to_str().expect("UTF-8");
    let written = json(&data.ok(&["publish", "vase", "--to", to, "--json"]));
    assert!(written["rungs"].as_u64() > Some(1), "{written}");

    let server = data.serve();
    let name: SceneName = "vase".parse().expect("a name");
    let scene = server.client().open(&name).await.expect("a scene");
    let mut smooth: Vec<SmoothLod> = Vec::new();
    for object in 0..report["objects"].as_u64().expect("a count") {
        let info = scene.object(ObjectId(object as u32)).await.expect("an object");
        let triangles = info.levels[0].triangles;
        assert_eq!(info.smooth.is_some(), triangles >= 500, "{triangles} triangles");
        smooth.extend(info.smooth);
    }
    assert!(!smooth.is_empty());
    for lod in smooth {
        let whole = scene.blob(&lod.url).await.expect("the whole stream");
        assert_eq!(whole.len() as u64, lod.bytes);
        let mut joined = Vec::new();
        for rung in &lod.rungs {
            assert_eq!(joined.len() as u64, rung.from);
            joined.extend(std::fs::read(tree.join("o").join(rung.url.file_name())).expect("a rung"));
            assert_eq!(joined.len() as u64, rung.to);
            let mut decoder = Decoder::new(1 << 30);
            decoder.push(&joined).expect("a beginning");
            assert_eq!(decoder.counts().1 as u64, rung.triangles);
        }
        assert!(joined == whole[..]);
        assert!(
            lod.rungs
                .is_sorted_by(|a, b| a.geometric_error_m >= b.geometric_error_m)
        );
        let materials = json(&String::from_utf8_lossy(
            &scene.blob(&lod.materials).await.expect("materials"),
        ));
        let (header, _) = Header::read(&whole).expect("a header").expect("all of it");
        assert_eq!(
            materials["materials"].as_array().map(Vec::len),
            Some(usize::from(header.materials))
        );
    }
}

#[test]
fn the_tools_write_smooth_lods_and_what_their_beginnings_give() {
    let data = Data::new();
    let file = data.write("vase.plan", VASE);
    let (file, folder) = (file.to_str().expect("UTF-8"), data.folder("streams"));
    let out = folder.to_str().expect("UTF-8");
    let report = json(&data.ok(&["mesh", "smooth", file, "-o", out, "--json"]));
    let meshes = report["meshes"].as_array().expect("meshes");
    let mesh = meshes
        .iter()
        .max_by_key(|mesh| mesh["triangles"].as_u64())
        .expect("a mesh");
    assert!(mesh["bytes"].as_u64() < mesh["object_bytes"].as_u64(), "{mesh}");
    let thesis_bytes = mesh["thesis_bytes"].as_u64();
    assert!(mesh["bytes"].as_u64() < thesis_bytes && thesis_bytes < mesh["object_bytes"].as_u64());
    let rungs = mesh["rungs"].as_array().expect("rungs");
    assert_eq!(rungs.last().map(|rung| &rung["to"]), Some(&mesh["bytes"]));

    let stream = mesh["file"].as_str().expect("a file");
    let glb = data.folder("part.glb");
    for rung in rungs {
        let length = rung["to"].to_string();
        data.ok(&[
            "mesh",
            "decode",
            stream,
            "--bytes",
            &length,
            "-o",
            glb.to_str().expect("UTF-8"),
        ]);
        let gltf = gltf::Gltf::open(&glb).expect("a valid GLB");
        let parts = gltf.meshes().flat_map(|mesh| mesh.primitives().collect::<Vec<_>>());
        let corners: usize = parts.map(|part| part.indices().expect("indices").count()).sum();
        assert_eq!(Some(corners as u64 / 3), rung["triangles"].as_u64());
    }
    let report = json(&data.ok(&["mesh", "smooth", file, "-o", out, "--thesis", "--json"]));
    let packets = report["meshes"].as_array().expect("meshes").iter();
    let packets = packets.max_by_key(|mesh| mesh["triangles"].as_u64()).expect("a mesh");
    let told = data.ok(&[
        "mesh",
        "decode",
        packets["file"].as_str().expect("a file"),
        "-o",
        glb.to_str().expect("UTF-8"),
    ]);
    let all = format!("{} vertices, {} triangles", mesh["vertices"], mesh["triangles"]);
    assert!(told.contains(&all), "{told}");

    let table = data.ok(&["mesh", "smooth", file, "--bits", "10", "--no-attributes"]);
    assert!(table.contains("RMS error") && table.contains("r0"), "{table}");

    let message = data.fails(&["mesh", "decode", file, "-o", glb.to_str().expect("UTF-8")]);
    assert!(message.contains("not a smooth LOD"), "{message}");
    let glb = glb.to_str().expect("UTF-8");
    let message = data.fails(&["mesh", "decode", glb, "-o", "x.glb"]);
    assert!(
        message.contains("is a GLB") && message.contains("mesh smooth"),
        "{message}"
    );
    let claims = data.folder("claims.slod");
    let mut bytes = std::fs::read(stream).expect("a stream");
    // Of vertices, which no limit would make come.
    bytes[15] = 0x7f;
    std::fs::write(&claims, bytes).expect("a damaged stream");
    let message = data.fails(&["mesh", "decode", claims.to_str().expect("UTF-8"), "-o", "x.glb"]);
    assert!(
        message.contains("damaged") && !message.contains("raise the limit"),
        "{message}"
    );
    let look = |with: [&str; 4]| data.run(&[&["mesh", "decode", stream, "-o", "x.glb"], &with[..]].concat());
    for (with, code, wanted) in [
        (["--eye", "1,2,3", "--target", "1,2,3"], 1, "leave out --target"),
        (["--eye", "1,2,3", "--pixels", "-1"], 2, "0 or more"),
    ] {
        let refused = look(with);
        let said = String::from_utf8_lossy(&refused.stderr);
        assert!(refused.status.code() == Some(code) && said.contains(wanted), "{said}");
    }
    let message = data.fails(&["mesh", "decode", stream, "--bytes", "99999999", "-o", "x.glb"]);
    assert!(message.contains("bytes, not 99999999"), "{message}");
}

/// Looks from the first viewpoint until all is sharp, with what earlier visits left in a folder; says what was drawn by rungs.
async fn visit<S: ByteSource + 'static>(source: S, folder: &std::path::Path) -> usize {
    let source = DiskCache::open(folder, 1 << 24, source).expect("a folder");
    let scene = Client::new(source).open(&"vase".parse().expect("a name")).await;
    let scene = scene.expect("a scene");
    let eye = Eye::at(scene.pointer().viewpoints[0].position);
    let mut explorer = Explorer::new(scene, ExplorerOptions::default());
    explorer.follow(eye).await;
    while let Some(events) = explorer.advance().await {
        let wrong = events.iter().find(|event| matches!(event, Event::Problem(_)));
        assert!(wrong.is_none(), "{wrong:?}");
    }
    assert_eq!(explorer.missing(), Some(0));
    let models = explorer.visible().iter().map(|seen| seen.model);
    models
        .filter_map(|model| explorer.mesh(model))
        .filter(|mesh| mesh.grade.form == belvedere_client::strategy::grade::Form::Rung)
        .count()
}

#[tokio::test]
async fn the_second_visit_fetches_no_rungs_however_they_came() {
    let data = Data::new();
    data.bake(&data.write("vase.plan", VASE), "vase");
    let tree = data.folder("tree").to_str().expect("UTF-8").to_owned();
    data.ok(&["publish", "vase", "--to", &tree]);
    let server = data.serve();
    let http = HttpSource::new(&server.base).expect("an address");
    // Bundles, where the server offers them; rungs by themselves.
    let kept = tempfile::tempdir().expect("a folder");
    for is_first in [true, false] {
        let source = Watched::new(http.clone(), |_, bytes| Ok(bytes));
        assert!(
            visit(source.clone(), kept.path()).await > 0,
            "the world has smooth LODs"
        );
        let fetched = source.paths().into_iter().filter(|path| path.starts_with("/o/"));
        assert_eq!(fetched.count() > 0, is_first, "{:?}", source.paths());
    }
    // Rungs have no addresses, so they come as ranges.
    let no_rungs: Harm = |path, bytes| match path.split('.').count() {
        2 => Ok(bytes),
        _ if path.ends_with(".slod") => Err(Error::Missing(path.to_owned())),
        _ => Ok(bytes),
    };
    let kept = tempfile::tempdir().expect("a folder");
    for is_first in [true, false] {
        let source = Watched::new(FolderSource::new(&tree), no_rungs);
        assert!(visit(source.clone(), kept.path()).await > 0);
        let is_stream = |path: &String| path.ends_with(".slod") && path.split('.').count() == 2;
        assert_eq!(source.paths().iter().any(is_stream), is_first);
    }
}
