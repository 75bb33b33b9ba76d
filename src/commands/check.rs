//! `belvedere serve --check-config`: what do the settings come to, and can they work? Looks at what is outside of them and
//! leaves all as it was.

use std::{fs::File, io::ErrorKind, path::Path, time::Duration};

use anyhow::Context;

use super::output::print;
use crate::{
    config::{Config, file::overridden},
    db,
    live::{
        Recorder,
        nodes::{NodeName, Nodes},
    },
    place::Place,
};

/// Looks at folders, address, certificate, catalogue, bucket and NATS, and prints every setting, and those that do nothing.
///
/// # Errors
/// With the first setting that cannot work.
pub(super) async fn check(config: &Config, settings_file: Option<&Path>) -> anyhow::Result<()> {
    data(&config.place)?;
    if let Some(file) = &config.record {
        record(file)?;
    }
    if let Some(files) = &config.tls {
        files.check()?;
    }
    config.place.reach().await?;
    if let Some(nodes) = &config.nodes {
        Nodes::reach(&nodes.nats).await?;
    }
    let listened = std::net::TcpListener::bind(config.listen);
    for (name, value) in settings(config) {
        print(&format!("{name:<28}{value}"))?;
    }
    for idle in beyond_all(config) {
        print(&idle)?;
    }
    if let Some(file) = settings_file {
        for (name, variable) in overridden(file)? {
            print(&format!(
                "{name} of {} does nothing: {variable} goes before it",
                file.display()
            ))?;
        }
    }
    match listened {
        Ok(_) => Ok(()),
        // Perhaps the very server whose settings these are.
        Err(error) if error.kind() == ErrorKind::AddrInUse => {
            print(&format!("somebody listens on {} right now", config.listen))
        }
        Err(error) => Err(error).with_context(|| format!("`listen` cannot be used: {}", config.listen)),
    }
}

fn data(place: &Place) -> anyhow::Result<()> {
    let data = &place.data;
    let cannot = || format!("`data` cannot be written: {}", data.display());
    match std::fs::metadata(data) {
        Ok(about) if !about.is_dir() => anyhow::bail!("`data` must be a folder, and {} is none", data.display()),
        Ok(_) => takes_more(data).with_context(cannot)?,
        Err(error) if error.kind() == ErrorKind::NotFound => {
            let above = data.ancestors().skip(1).find(|folder| folder.exists());
            let made = takes_more(above.unwrap_or(Path::new(".")));
            return made.with_context(|| format!("`data` cannot be made: {}", data.display()));
        }
        Err(error) => return Err(error).with_context(|| format!("`data` cannot be used: {}", data.display())),
    }
    if place.database.is_none() {
        unless_absent(File::options().append(true).open(data.join(db::FILE_NAME)).map(drop)).with_context(cannot)?;
    }
    if place.bucket.is_none() {
        let blobs = data.join("o");
        let about = std::fs::metadata(&blobs).and_then(|about| {
            if about.is_dir() {
                takes_more(&blobs)
            } else {
                Err(ErrorKind::NotADirectory.into())
            }
        });
        unless_absent(about).with_context(|| format!("blobs cannot be kept in {}", blobs.display()))?;
    }
    Ok(())
}

/// What is not there is made.
fn unless_absent(tried: std::io::Result<()>) -> std::io::Result<()> {
    match tried {
        Err(error) if error.kind() == ErrorKind::NotFound => Ok(()),
        tried => tried,
    }
}

/// Whether a folder takes another: makes one, and takes it away again. Bits of permission do not say what this user may do.
fn takes_more(folder: &Path) -> std::io::Result<()> {
    let tried = folder.join(format!(".belvedere-check-{}", std::process::id()));
    std::fs::create_dir(&tried).and_then(|()| std::fs::remove_dir(&tried))
}

fn record(file: &Path) -> anyhow::Result<()> {
    let cannot = || format!("`record` cannot be used: {}", file.display());
    match File::options().append(true).open(file) {
        Ok(_) => Recorder::could_go_on(file).with_context(cannot),
        Err(error) if error.kind() == ErrorKind::NotFound => {
            let folder = file.parent().filter(|folder| !folder.as_os_str().is_empty());
            takes_more(folder.unwrap_or(Path::new("."))).with_context(cannot)
        }
        Err(error) => Err(error).with_context(cannot),
    }
}

/// Shares of one address that are larger than the whole, and so hold nobody back.
fn beyond_all(config: &Config) -> Vec<String> {
    let (connections, live) = (&config.connections, &config.live);
    let shares = [
        (
            ("max_connections_per_address", connections.most_of_an_address()),
            ("max_connections", connections.connections),
        ),
        (
            ("max_sessions_per_address", live.sessions_of_an_address),
            ("max_sessions", live.sessions),
        ),
    ];
    let beyond = shares.into_iter().filter(|((_, share), (_, all))| share > all);
    let said = beyond.map(|((name, share), (of, all))| {
        format!("{name} does nothing: it is {share}, and {of} is {all} already; set it to {all} to say the same")
    });
    said.collect()
}

/// Every setting by its name in a file; secrets only by whether they are set.
fn settings(config: &Config) -> Vec<(&'static str, String)> {
    let (place, connections, live, jobs) = (&config.place, &config.connections, &config.live, &config.jobs);
    let hidden = |set: bool| if set { "set, not shown" } else { "not set" }.to_owned();
    let file = |file: Option<&Path>| file.map_or_else(|| "not set".to_owned(), |file| file.display().to_string());
    let mib = |bytes: u64| (bytes >> 20).to_string();
    let s = |time: Duration| time.as_secs().to_string();
    let ms = |time: Duration| time.as_millis().to_string();
    let bucket = place.bucket.as_ref();
    let tls = config.tls.as_ref();
    let nats = config.nodes.as_ref().map(|nodes| &nodes.nats);
    let node = config.node.as_ref().map(ToString::to_string);
    let traces = config.traces.as_ref();
    let or_not = |set: Option<String>| set.unwrap_or_else(|| "not set".to_owned());
    let origins: Vec<_> = config.base_origins.iter().map(ToString::to_string).collect();
    let origins = Some(origins.join(",")).filter(|origins| !origins.is_empty());
    vec![
        ("listen", config.listen.to_string()),
        ("tls_cert", file(tls.map(|tls| tls.cert.as_path()))),
        ("tls_key", file(tls.map(|tls| tls.key.as_path()))),
        ("data", place.data.display().to_string()),
        ("database", hidden(place.database.is_some())),
        (
            "store",
            bucket.map_or_else(|| "not set".to_owned(), ToString::to_string),
        ),
        ("cache_mib", mib(config.cache_bytes)),
        ("max_connections", connections.connections.to_string()),
        (
            "max_connections_per_address",
            connections.most_of_an_address().to_string(),
        ),
        ("request_timeout_s", s(config.request_timeout)),
        ("max_requests_per_s", config.requests_per_s.to_string()),
        ("drain_s", s(connections.drain)),
        ("poll_ms", ms(config.poll)),
        ("max_sessions", live.sessions.to_string()),
        ("max_sessions_per_address", live.sessions_of_an_address.to_string()),
        ("max_movers", live.movers.to_string()),
        ("max_persistent", live.persistent.to_string()),
        (
            "max_movers_per_address_percent",
            live.movers_of_an_address_percent.to_string(),
        ),
        ("operator_token", hidden(live.operator.is_some())),
        ("mover_lease_s", s(live.mover_lease)),
        ("cull_below_percent", live.cull_below_percent.to_string()),
        ("tick_ms", ms(live.tick)),
        ("session_bytes_per_s", live.session_bytes_per_s.to_string()),
        ("lease_s", s(live.lease)),
        ("nats", nats.map_or_else(|| "not set".to_owned(), ToString::to_string)),
        ("node", node.unwrap_or_else(|| NodeName::UNLESS_SET.to_owned())),
        ("max_upload_mib", mib(jobs.upload_bytes)),
        ("max_bakes", jobs.bakes.to_string()),
        ("bake_memory_mib", mib(jobs.memory_bytes)),
        ("bake_minutes", (jobs.time.as_secs() / 60).to_string()),
        ("max_jobs_per_key", jobs.open_of_a_key.to_string()),
        ("max_jobs", jobs.open_of_all.to_string()),
        ("base_origins", or_not(origins)),
        ("record", file(config.record.as_deref())),
        ("otlp", or_not(traces.map(|traces| traces.collector.to_string()))),
        ("otlp_sample_percent", config.share.to_string()),
        ("log", config.log.clone()),
        ("log_format", format!("{:?}", config.log_format).to_lowercase()),
    ]
}
