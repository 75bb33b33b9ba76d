//! Do settings come from where they should, and is what cannot work refused by its name?

use std::time::Duration;

use super::*;
use crate::live::LiveSettings;

fn file(text: &str) -> Result<Settings, ConfigError> {
    let file = tempfile::NamedTempFile::new().unwrap();
    std::fs::write(file.path(), text).unwrap();
    Settings::from_file(file.path())
}

#[test]
fn the_file_fills_what_flags_leave_open() {
    let flags = Settings {
        cache_mib: Some(7),
        ..Settings::default()
    };
    let merged = flags.or(file("cache_mib = 9\ndrain_s = 3\nlog_format = \"json\"").unwrap());
    let config = Config::try_from(merged).unwrap();
    assert_eq!(
        (config.cache_bytes, config.connections.drain),
        (7 << 20, Duration::from_secs(3))
    );
    assert_eq!(config.log_format, LogFormat::Json);
}

#[test]
fn a_line_that_is_wrong_is_named_and_not_repeated() {
    let error = file("cache_mib = 9\ndatabase = postgres://me:hush@host/db").unwrap_err();
    let told = error.to_string();
    assert!(told.contains("line 2") && !told.contains("hush"), "{told}");
    let set = file("database = \"postgres://me:hush@host/db\"\nstore = \"s3://worlds\"").unwrap();
    let config = Config::try_from(set).unwrap();
    assert!(!format!("{config:?}").contains("hush"));
    assert_eq!(config.place.bucket.unwrap().to_string(), "s3://worlds/");
}

#[test]
fn a_certificate_needs_its_key() {
    let settings = Settings {
        tls_cert: Some("cert.pem".into()),
        ..Settings::default()
    };
    let error = Config::try_from(settings).unwrap_err().to_string();
    assert_eq!(error, "TLS needs `tls_cert` and `tls_key`; `tls_key` is missing");
}

#[test]
fn numbers_that_cannot_work_are_refused_by_name() {
    let settings = Settings {
        max_connections: Some(0),
        ..Settings::default()
    };
    let error = Config::try_from(settings).unwrap_err().to_string();
    assert_eq!(error, "`max_connections` must be from 1 to 1000000; got 0");
}

#[test]
fn origins_of_other_trees_are_named_or_none() {
    let with = |origins: &[&str]| {
        Config::try_from(Settings {
            base_origins: origins.iter().map(ToString::to_string).collect(),
            ..Settings::default()
        })
    };
    let origins = with(&["https://worlds.example.org/", " http://127.0.0.1:9000", ""]).unwrap();
    let told: Vec<_> = origins.base_origins.iter().map(ToString::to_string).collect();
    assert_eq!(told, ["https://worlds.example.org", "http://127.0.0.1:9000"]);
    assert!(
        with(&["*"])
            .unwrap_err()
            .to_string()
            .starts_with("`base_origins` is not right: \"*\"")
    );
    let listed = file("base_origins = [\"https://a.example\", \"https://b.example\"]").unwrap();
    assert_eq!(
        file("base_origins = \"https://a.example,https://b.example\"").unwrap(),
        listed
    );
    let merged = Settings::default().or(file("base_origins = [\"https://a.example\"]").unwrap());
    assert_eq!(Config::try_from(merged).unwrap().base_origins.len(), 1);
}

#[test]
fn an_address_has_half_of_the_sessions_unless_somebody_says_otherwise() {
    let of_an_address = |max_sessions, max_sessions_per_address| {
        let live = LiveArgs {
            max_sessions,
            max_sessions_per_address,
            ..LiveArgs::default()
        };
        LiveSettings::try_from(live).unwrap().sessions_of_an_address
    };
    assert_eq!(
        of_an_address(None, None),
        LiveSettings::default().sessions_of_an_address
    );
    assert_eq!((of_an_address(Some(7), None), of_an_address(Some(7), Some(7))), (4, 7));
}

#[test]
fn an_operators_token_must_be_one() {
    let with = |token: &str| {
        Config::try_from(Settings {
            live: LiveArgs {
                operator_token: Some(token.to_owned()),
                ..LiveArgs::default()
            },
            ..Settings::default()
        })
    };
    assert!(with(&"0a".repeat(16)).unwrap().live.operator.is_some());
    let error = with("secret").unwrap_err().to_string();
    assert!(error.contains("operator_token") && !error.contains("secret"), "{error}");
}

#[test]
fn a_collector_is_asked_for_and_must_be_one() {
    let with = |collector: &str, percent| {
        Config::try_from(Settings {
            otlp: Some(collector.to_owned()),
            otlp_sample_percent: Some(percent),
            ..Settings::default()
        })
    };
    assert_eq!(Config::try_from(Settings::default()).unwrap().traces, None);
    assert_eq!(with("", 1.0).unwrap().traces, None);
    let traces = with("http://collector:4318", 0.1).unwrap().traces.unwrap();
    assert_eq!(
        (traces.collector.to_string(), traces.share.to_string()),
        ("http://collector:4318".to_owned(), "0.1".to_owned())
    );
    let told = with("http://me:hush@collector", 1.0).unwrap_err().to_string();
    assert!(told.contains("`otlp`") && !told.contains("hush"), "{told}");
    let told = with("http://collector:4318", 101.0).unwrap_err().to_string();
    assert_eq!(told, "`otlp_sample_percent` must be from 0 to 100; got 101");
}
