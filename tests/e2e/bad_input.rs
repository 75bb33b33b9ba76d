//! What the program says to bad input: an error that names the place and the way out; nothing is published.

use crate::program::Data;

/// Bakes bytes that must be refused; gives the message.
fn refused(name: &str, bytes: impl AsRef<[u8]>) -> String {
    let data = Data::new();
    let file = data.write(name, bytes);
    let message = data.fails(&["bake", file.to_str().expect("UTF-8"), "--scene", "bad"]);
    assert!(!message.contains("panicked"), "{message}");
    let shown = data.fails(&["inspect", "bad"]);
    assert!(shown.contains("no scene `bad`"), "something was published: {shown}");
    message
}

#[test]
fn a_truncated_file_is_refused() {
    let message = refused("cut.glb", b"glTF\x02\0\0\0\xff\xff\0\0");
    assert!(message.contains("cut.glb"), "{message}");
}

#[test]
fn a_file_of_another_format_is_named() {
    let message = refused("house.wrl", "#VRML V2.0 utf8\nShape {}\n");
    assert!(message.contains("VRML") && message.contains("glTF"), "{message}");
}

#[test]
fn a_uri_that_leaves_the_folder_is_named() {
    let gltf = r#"{"asset":{"version":"2.0"},"buffers":[{"uri":"../../etc/passwd","byteLength":36}],
        "bufferViews":[{"buffer":0,"byteLength":36}],
        "accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"}],
        "meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],"nodes":[{"mesh":0}],"scenes":[{"nodes":[0]}]}"#;
    let message = refused("sly.gltf", gltf);
    assert!(message.contains("../../etc/passwd"), "{message}");
}

#[test]
fn a_claim_of_a_billion_elements_is_refused_without_taking_the_memory() {
    let gltf = r#"{"asset":{"version":"2.0"},
        "accessors":[{"componentType":5126,"count":1000000000,"type":"VEC3"}],
        "meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],"nodes":[{"mesh":0}],"scenes":[{"nodes":[0]}]}"#;
    let message = refused("huge.gltf", gltf);
    assert!(message.contains("accessors/0"), "{message}");
}

#[test]
fn a_plan_with_an_unknown_sign_names_line_and_column() {
    let message = refused("odd.plan", "#####\n#a.?#\n#####\n");
    assert!(message.contains("line 2") && message.contains("column 4"), "{message}");
}

#[test]
fn a_bad_scene_name_says_what_a_name_may_hold() {
    let data = Data::new();
    let file = data.write("rooms.plan", "###\n#.#\n###\n");
    let output = data.run(&["bake", file.to_str().expect("UTF-8"), "--scene", "../etc"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(crate::program::text(&output.stderr).contains("a-z"));
}

#[test]
fn a_missing_data_folder_says_how_to_make_one() {
    let data = Data::new();
    for command in [
        vec!["inspect", "museum"],
        vec!["gc"],
        vec!["publish", "museum", "--to", "tree"],
    ] {
        let message = data.fails(&command);
        assert!(message.contains("belvedere bake"), "{message}");
    }
}

#[test]
fn settings_are_checked_without_serving_and_without_a_trace() {
    let data = Data::new();
    let said = data.ok(&["serve", "--listen", "127.0.0.1:0", "--max-bakes", "3", "--check-config"]);
    assert!(said.contains("bakes: 3"), "{said}");
    assert!(!data.path().exists(), "it made the data folder");
    let file = data.write("belvedere.toml", "max_bakes = 99");
    let wrong = data.fails(&["serve", "--config", file.to_str().expect("UTF-8"), "--check-config"]);
    assert!(wrong.contains("`max_bakes` must be from 0 to 64; got 99"), "{wrong}");
    let taken = std::net::TcpListener::bind("127.0.0.1:0").expect("a port");
    let address = taken.local_addr().expect("an address").to_string();
    assert!(
        data.fails(&["serve", "--listen", &address, "--check-config"])
            .contains("`listen`")
    );
    let file = data.write("file", "x");
    let wrong = data.fails(&[
        "serve",
        "--listen",
        "127.0.0.1:0",
        "--data",
        file.to_str().expect("UTF-8"),
        "--check-config",
    ]);
    assert!(wrong.contains("`data` must be a folder"), "{wrong}");
}
