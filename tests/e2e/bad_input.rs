//! What the program says to bad input: an error that names the place and the way out; nothing is published.

use crate::{boxes::two_rooms, program::Data};

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
fn a_glb_of_which_a_part_came_is_not_taken_for_a_whole_one() {
    let whole = two_rooms();
    // All of the document, and some of the numbers that it speaks of.
    let half = &whole[..whole.len() - 100];
    let message = refused("cut.glb", half);
    let [there, all] = [half, &whole[..]].map(|bytes| bytes.len().to_string());
    assert!(
        message.contains("cut.glb") && message.contains("send or export it again"),
        "{message}"
    );
    assert!(
        message.contains(&format!("ends at byte {there}")) && message.contains(&all),
        "{message}"
    );
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
fn keys_are_not_made_in_a_folder_that_was_mistyped() {
    let data = Data::new();
    for command in [
        vec!["keys", "list"],
        vec!["keys", "create"],
        vec!["keys", "revoke", "x"],
    ] {
        let message = data.fails(&command);
        assert!(
            message.contains("there is no catalogue in") && message.contains("keys create --new"),
            "{message}"
        );
    }
    assert!(!data.path().exists(), "it made the data folder");
    data.ok(&["keys", "create", "--new"]);
    assert!(data.ok(&["keys", "list"]).contains("unnamed"));
}

#[test]
fn settings_are_checked_without_serving_and_without_a_trace() {
    let data = Data::new();
    let check = |more: &[&str]| -> Vec<String> {
        let args = [&["serve", "--listen", "127.0.0.1:0", "--check-config"], more].concat();
        args.into_iter().map(str::to_owned).collect()
    };
    let says = |more: &[&str]| {
        let args = check(more);
        data.ok(&args.iter().map(String::as_str).collect::<Vec<_>>())
    };
    let refuses = |more: &[&str], with: &str| {
        let args = check(more);
        let told = data.fails(&args.iter().map(String::as_str).collect::<Vec<_>>());
        assert!(told.contains(with), "{told}");
    };
    let token = "0a".repeat(16);
    let said = says(&["--max-bakes", "3", "--operator-token", &token]);
    let lines: Vec<Vec<_>> = said.lines().map(|line| line.split_whitespace().collect()).collect();
    assert!(
        lines.contains(&vec!["max_bakes", "3"]) && !said.contains(&token),
        "{said}"
    );
    for default in [["node", "node"], ["otlp_sample_percent", "100"]] {
        assert!(lines.contains(&default.to_vec()), "{said}");
    }
    let said = says(&["--node", "eu-1", "--otlp-sample-percent", "5"]);
    assert!(said.contains(" eu-1\n") && said.contains(" 5\n"), "{said}");
    let both = data.write("both.toml", "data = \"elsewhere\"\nmax_bakes = 2");
    let said = says(&["--config", both.to_str().expect("UTF-8")]);
    let nothing: Vec<_> = said.lines().filter(|line| line.contains(" does nothing: ")).collect();
    assert!(
        matches!(nothing[..], [line] if line.starts_with("data of ") && line.contains("BELVEDERE_DATA goes before it")),
        "{said}"
    );
    assert!(!data.path().exists(), "it made the data folder");
    let path = |path: std::path::PathBuf| path.to_str().expect("UTF-8").to_owned();
    let file = path(data.write("belvedere.toml", "max_bakes = 99"));
    refuses(&["--config", &file], "`max_bakes` must be from 0 to 64; got 99");
    let file = path(data.write("file", "x"));
    refuses(&["--data", &file], "`data` must be a folder");
    refuses(
        &["--record", &path(data.folder("nowhere/record"))],
        "`record` cannot be used",
    );
    says(&["--record", &path(data.folder("record"))]);
    assert!(!data.folder("record").exists(), "it made the recording");
    refuses(&["--record", &file], "it is no recording of this version");
    let part = path(data.write("part", "BVRE"));
    says(&["--record", &part]);
    let half = data.folder("half");
    data.write("half/o", "x");
    refuses(&["--data", &path(half)], "blobs cannot be kept in");
    refuses(&["--tls-cert", &file], "`tls_key` is missing");
    refuses(&["--tls-cert", &file, "--tls-key", &file], "holds no certificate");
    refuses(&["--store", "bucket"], "s3://bucket/prefix");
    refuses(
        &["--store-endpoint", "https://s3.example"],
        "`store` does not say which one",
    );
    let bucket = ["--store", "s3://bucket", "--store-endpoint", "http://127.0.0.1:1"];
    let mut without_keys = data.command(&check(&bucket).iter().map(String::as_str).collect::<Vec<_>>());
    let told = without_keys
        .env_remove("AWS_ACCESS_KEY_ID")
        .output()
        .expect("the program runs");
    assert!(!told.status.success());
    assert!(String::from_utf8_lossy(&told.stderr).contains("AWS_ACCESS_KEY_ID"));
    let hidden = "postgres://me:hush@127.0.0.1:1/db";
    let told = data.fails(&["serve", "--check-config", "--database", hidden]);
    assert!(told.contains("127.0.0.1:1/db") && !told.contains("hush"), "{told}");
    let told = data.fails(&["serve", "--check-config", "--nats", "nats://me:hush@127.0.0.1:1"]);
    assert!(
        told.contains("`nats` cannot be reached: nats://127.0.0.1:1") && !told.contains("hush"),
        "{told}"
    );
}

#[test]
fn a_share_that_is_larger_than_the_whole_is_said_to_do_nothing() {
    let data = Data::new();
    let does_nothing = |more: &[&str]| -> Vec<String> {
        let said = data.ok(&[&["serve", "--listen", "127.0.0.1:0", "--check-config"], more].concat());
        let lines = said.lines().filter(|line| line.contains(" does nothing: "));
        lines.map(str::to_owned).collect()
    };
    let said = does_nothing(&["--max-connections", "100", "--max-connections-per-address", "101"]);
    assert_eq!(
        said,
        [
            "max_connections_per_address does nothing: it is 101, and max_connections is 100 already; set it to 100 to say the same"
        ]
    );
    let said = does_nothing(&["--max-sessions", "7", "--max-sessions-per-address", "8"]);
    assert!(
        matches!(&said[..], [line] if line.starts_with("max_sessions_per_address does nothing: it is 8")),
        "{said:?}"
    );
    // Behind a proxy it is as many as all.
    assert!(does_nothing(&["--max-connections", "100", "--max-connections-per-address", "100"]).is_empty());
    assert!(does_nothing(&[]).is_empty());
}

/// Bits of permission say that somebody may write, and not that this user may.
#[cfg(unix)]
#[test]
fn a_folder_that_others_alone_may_write_is_told() {
    use std::os::unix::{fs::PermissionsExt, process::CommandExt};

    /// Whoever this is owns nothing.
    const NOBODY: u32 = 65534;
    let data = Data::new();
    let set = |path: &std::path::Path, mode| {
        std::fs::set_permissions(path, std::fs::Permissions::from_mode(mode)).expect("the mode is set");
    };
    let refused = |more: &[&str]| {
        let mut check = data.command(&[&["serve", "--listen", "127.0.0.1:0", "--check-config"], more].concat());
        // Root may write everywhere.
        if std::os::unix::fs::MetadataExt::uid(&std::fs::metadata(data.path()).expect("a folder")) == 0 {
            check.uid(NOBODY).gid(NOBODY);
        }
        let told = check.output().expect("the program runs");
        (
            told.status.success(),
            String::from_utf8_lossy(&told.stderr).into_owned(),
        )
    };
    std::fs::create_dir(data.path()).expect("a folder");
    let catalogue = data.write("data/catalogue.sqlite", "");
    set(&data.folder(""), 0o755);
    set(&data.path(), 0o575);
    let (fine, told) = refused(&[]);
    assert!(!fine && told.contains("`data` cannot be written"), "{told}");
    set(&data.path(), 0o777);
    set(&catalogue, 0o464);
    let (fine, told) = refused(&[]);
    assert!(!fine && told.contains("`data` cannot be written"), "{told}");
    std::fs::remove_file(catalogue).expect("it goes");
    let narrow = data.write("narrow/file", "");
    let narrow = narrow.parent().expect("a folder");
    set(narrow, 0o575);
    let (fine, told) = refused(&["--record", narrow.join("record").to_str().expect("UTF-8")]);
    assert!(!fine && told.contains("`record` cannot be used"), "{told}");
    let (fine, told) = refused(&[]);
    assert!(fine, "{told}");
}

#[test]
fn the_address_of_a_server_that_runs_is_said_to_be_taken() {
    let data = Data::new();
    let taken = std::net::TcpListener::bind("127.0.0.1:0").expect("a port");
    let address = taken.local_addr().expect("an address").to_string();
    let said = data.ok(&["serve", "--listen", &address, "--check-config"]);
    assert!(said.contains(&format!("somebody listens on {address}")), "{said}");
}

#[test]
fn a_variable_that_is_no_setting_is_told_with_the_setting_that_was_meant() {
    let data = Data::new();
    let told = |args: &[&str]| {
        let output = data
            .command(args)
            .env("BELVEDERE_MAX_BAKE", "hush")
            .output()
            .expect("the program runs");
        assert!(output.status.success(), "{args:?}");
        String::from_utf8_lossy(&output.stderr).into_owned()
    };
    for args in [
        &["private", "--list"][..],
        &["serve", "--listen", "127.0.0.1:0", "--check-config"],
    ] {
        let told = told(args);
        assert!(
            told.contains("BELVEDERE_MAX_BAKE is no setting") && told.contains("did you mean BELVEDERE_MAX_BAKES?"),
            "{told}"
        );
        assert!(!told.contains("hush"), "{told}");
    }
}

#[test]
fn who_asks_for_a_scene_that_is_not_there_is_told_which_are() {
    let data = Data::new();
    let source = data.write("hall.plan", "###\n#.#\n###\n");
    data.bake(&source, "hall");
    for args in [
        &["rollback", "nowhere"][..],
        &["rollback", "nowhere", "--list"],
        &["inspect", "nowhere"],
    ] {
        let told = data.fails(args);
        assert!(
            told.contains("no scene `nowhere`") && told.contains("there is `hall`"),
            "{told}"
        );
    }
}
