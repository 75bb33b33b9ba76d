//! Which servers are measured, how are they started, and what is asked of them?

use std::{
    fs,
    net::SocketAddr,
    path::{Path, PathBuf},
    process::{Child, Command, Stdio},
    time::{Duration, Instant},
};

use anyhow::Context;
use serde_json::{Value, json};

use super::{
    booths,
    http::{Asking, request},
};

/// Where Debian puts it.
const NCHAN_MODULE: &str = "/usr/lib/nginx/modules/ngx_nchan_module.so";
const SCENE: &str = "booths";
const PATIENCE: Duration = Duration::from_secs(20);
/// Messages are told apart by the first coordinate of a position: so many different ones, so far apart that each is told of.
pub const NUMBERS: u32 = 128;
pub(super) const STEP_M: f64 = 0.05;

/// What is to be started.
#[derive(Debug, Clone)]
pub enum Kind {
    /// The program, with a data folder that holds the booths.
    Belvedere {
        /// The program.
        binary: PathBuf,
        /// Its data.
        data: PathBuf,
        /// Time between ticks.
        tick_ms: u64,
    },
    /// nginx with nchan, two workers.
    Nchan,
}

impl Kind {
    /// Its name in tables.
    #[must_use]
    pub fn name(&self) -> String {
        match self {
            Self::Belvedere { tick_ms, .. } => format!("Belvedere, {tick_ms} ms ticks"),
            Self::Nchan => "nchan".to_owned(),
        }
    }
}

/// Whether nginx can be started with nchan.
#[must_use]
pub fn has_nchan() -> bool {
    let nginx = Command::new("nginx").arg("-v").stderr(Stdio::null()).status();
    nginx.is_ok_and(|status| status.success()) && Path::new(NCHAN_MODULE).is_file()
}

/// Bakes the booths into a data folder, once.
///
/// # Errors
/// When the program cannot be run or the bake fails.
pub fn bake(binary: &Path, data: &Path) -> anyhow::Result<()> {
    fs::create_dir_all(data)?;
    let file = data.join("booths.glb");
    fs::write(&file, booths::glb())?;
    let baked = Command::new(binary)
        .arg("bake")
        .arg(&file)
        .args(["--scene", SCENE, "--visibility", "sampled", "--json", "--data"])
        .arg(data)
        .stdout(Stdio::null())
        .status()
        .with_context(|| format!("cannot run {}", binary.display()))?;
    anyhow::ensure!(baked.success(), "the booths cannot be baked");
    Ok(())
}

/// A server that runs until it is dropped.
#[derive(Debug)]
pub struct Server {
    child: Child,
    address: SocketAddr,
    /// How it is asked to publish; none: it is nchan.
    movers: Option<Movers>,
}

/// Who moves.
#[derive(Debug, Default)]
struct Movers {
    token: String,
    objects: Vec<String>,
}

impl Server {
    /// Starts one for so many readers, with so many movers where there are some, and waits until it answers.
    ///
    /// # Errors
    /// When it does not.
    pub fn start(kind: &Kind, readers: usize, movers: usize) -> anyhow::Result<Self> {
        let (child, address) = match kind {
            Kind::Belvedere { binary, data, tick_ms } => belvedere(binary, data, *tick_ms, readers)?,
            Kind::Nchan => nchan(readers)?,
        };
        let moves = matches!(kind, Kind::Belvedere { .. }).then(Movers::default);
        let mut server = Self {
            child,
            address,
            movers: moves,
        };
        let until = Instant::now() + PATIENCE;
        while Asking::connect(address).is_err() {
            anyhow::ensure!(Instant::now() < until, "{} does not answer", kind.name());
            std::thread::sleep(Duration::from_millis(50));
        }
        server.add_movers(movers)?;
        Ok(server)
    }

    /// Its process.
    #[must_use]
    pub fn pid(&self) -> u32 {
        self.child.id()
    }

    pub(super) fn address(&self) -> SocketAddr {
        self.address
    }

    /// Whether messages that follow each other fast may become one.
    pub(super) fn merges(&self) -> bool {
        self.movers.is_some()
    }

    fn add_movers(&mut self, count: usize) -> anyhow::Result<()> {
        let Some(movers) = &mut self.movers else { return Ok(()) };
        let mut asking = Asking::connect(self.address)?;
        let driver = json!({"position": booths::place(0), "max_speed_mps": 0, "radius_m": 0.1, "include": []});
        let driver = asking.post(&format!("/v1/scenes/{SCENE}/sessions"), None, &driver)?;
        movers.token = text(&driver, "token")?;
        for _ in 0..count {
            let new = json!({"position": position(NUMBERS - 1, 0), "radius_m": booths::MOVER_RADIUS_M});
            let made = asking.post(&format!("/v1/scenes/{SCENE}/movers"), Some(&movers.token), &new)?;
            movers.objects.push(text(&made, "object")?);
        }
        Ok(())
    }

    /// The head with which the `i`-th reader asks for its stream. One that is to `hear` sees the movers.
    pub(super) fn subscription(&self, asking: &mut Asking, i: usize, hears: bool) -> anyhow::Result<String> {
        let (path, token) = if self.movers.is_some() {
            let enter_m = if hears { 30.0 } else { 0.001 };
            let aoi = json!({"enter_m": enter_m, "leave_m": enter_m + 0.001});
            let who = json!({"position": booths::place(i), "max_speed_mps": 0, "radius_m": 0.01, "aoi": aoi});
            let session = asking.post(&format!("/v1/scenes/{SCENE}/sessions"), None, &who)?;
            let token = format!("Authorization: Bearer {}\r\n", text(&session, "token")?);
            (text(&session, "events_url")?, token)
        } else {
            ("/sub/all".to_owned(), String::new())
        };
        Ok(format!(
            "GET {path} HTTP/1.1\r\nHost: t\r\nAccept: text/event-stream\r\n{token}\r\n"
        ))
    }

    /// The request that publishes a message of so many poses.
    pub(super) fn message(&self, number: u32, poses: usize) -> Vec<u8> {
        match &self.movers {
            Some(movers) => {
                let line = |(i, object): (usize, &String)| {
                    json!({"object": object, "position": position(number, i), "velocity": [0, 0, 0]}).to_string() + "\n"
                };
                let lines: String = movers.objects.iter().take(poses).enumerate().map(line).collect();
                let path = format!("/v1/scenes/{SCENE}/movers/poses");
                request(&path, Some(&movers.token), "application/x-ndjson", lines.as_bytes())
            }
            None => request("/pub/all", None, "application/json", as_told(number, poses).as_bytes()),
        }
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        // nginx ends its workers when it is asked to end, and not when it is killed.
        let asked = Command::new("kill").arg(self.child.id().to_string()).status();
        let until = Instant::now() + PATIENCE;
        while asked.is_ok() && Instant::now() < until && matches!(self.child.try_wait(), Ok(None)) {
            std::thread::sleep(Duration::from_millis(20));
        }
        // One that has ended cannot be killed.
        _ = self.child.kill();
        _ = self.child.wait();
    }
}

fn position(number: u32, mover: usize) -> [f64; 3] {
    let [x, y, z] = booths::middle();
    let along = f64::from(number % NUMBERS) - f64::from(NUMBERS) / 2.0;
    [x + STEP_M * along, y, z + 0.01 * mover as f64]
}

/// The number of the message that is told by a first position.
pub(super) fn number_at(x: f64) -> u32 {
    let along = (x - booths::middle()[0]) / STEP_M + f64::from(NUMBERS) / 2.0;
    along.round().max(0.0) as u32 % NUMBERS
}

/// The data of the event by which we tell of such a message.
fn as_told(number: u32, poses: usize) -> String {
    let pose = |i: usize| {
        let object = format!("o{}", 100_000_000 + i);
        let at = position(number, i).map(|x| format!("{x:?}")).join(",");
        format!(
            r#"{{"object":"{object}","t_ms":1700000000000,"position":[{at}],"orientation":[0.0,0.0,0.0,1.0],"velocity":[0.0,0.0,0.0]}}"#
        )
    };
    let poses = (0..poses).map(pose).collect::<Vec<_>>().join(",");
    format!(r#"{{"t_ms":1700000000000,"objects":[{poses}]}}"#)
}

fn text(of: &Value, member: &str) -> anyhow::Result<String> {
    let text = of[member].as_str();
    Ok(text.with_context(|| format!("no {member} in {of}"))?.to_owned())
}

/// A port that nobody listens on now.
fn free_address() -> anyhow::Result<SocketAddr> {
    Ok(std::net::TcpListener::bind(("127.0.0.1", 0))?.local_addr()?)
}

fn belvedere(binary: &Path, data: &Path, tick_ms: u64, readers: usize) -> anyhow::Result<(Child, SocketAddr)> {
    let (address, most) = (free_address()?, (readers + 100).to_string());
    let mut command = Command::new(binary);
    command.args(["serve", "--no-dashboard", "--listen", &address.to_string(), "--data"]);
    command.arg(data);
    command.args(["--max-connections", &most, "--max-sessions", &most]);
    // All readers come from one address.
    command.args(["--max-connections-per-address", &most]);
    command.args(["--tick-ms", &tick_ms.to_string(), "--lease-s", "3600"]);
    // Whether poses are told is measured, not how many bytes of them a session may have by our choice.
    command.args(["--session-bytes-per-s", "1000000000"]);
    command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
    let child = command.spawn();
    Ok((
        child.with_context(|| format!("cannot run {}", binary.display()))?,
        address,
    ))
}

fn nchan(readers: usize) -> anyhow::Result<(Child, SocketAddr)> {
    let (address, most) = (free_address()?, readers + 200);
    let folder = std::env::temp_dir().join(format!("belvedere-streams-{}", address.port()));
    fs::create_dir_all(&folder)?;
    let at = folder.display();
    let conf = format!(
        "daemon off; master_process on; worker_processes 2; worker_rlimit_nofile {};
        pid {at}/pid; error_log {at}/error.log; load_module {NCHAN_MODULE}; {}
        events {{ use epoll; multi_accept on; accept_mutex off; worker_connections {}; }}
        http {{
          access_log off; tcp_nodelay on; keepalive_requests 1000000000; nchan_shared_memory_size 512M;
          client_body_temp_path {at}/body; proxy_temp_path {at}/proxy; fastcgi_temp_path {at}/fastcgi;
          uwsgi_temp_path {at}/uwsgi; scgi_temp_path {at}/scgi; client_body_buffer_size 64k;
          server {{
            listen {address} reuseport backlog=4096;
            location = /sub/all {{ nchan_subscriber eventsource; nchan_channel_id all; nchan_subscriber_first_message newest; }}
            location = /pub/all {{ nchan_publisher http; nchan_channel_id all; nchan_message_buffer_length 256; nchan_message_timeout 30s; }}
          }}
        }}",
        super::process::most_files(),
        // Whoever is nobody in particular cannot write there.
        if is_root() { "user root;" } else { "" },
        most + 100,
    );
    let path = folder.join("nginx.conf");
    fs::write(&path, conf)?;
    let mut command = Command::new("nginx");
    command.arg("-c").arg(&path).arg("-e").arg(folder.join("error.log"));
    command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
    Ok((command.spawn().context("cannot run nginx")?, address))
}

fn is_root() -> bool {
    let status = fs::read_to_string("/proc/self/status").unwrap_or_default();
    status.lines().any(|line| line.starts_with("Uid:\t0\t"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_message_says_its_number() {
        for number in 0..2 * NUMBERS {
            let [x, ..] = position(number, 3);
            assert_eq!(number_at(x), number % NUMBERS);
            assert!(as_told(number, 1).contains(&format!("[{x:?},")));
        }
        let length = as_told(5, 29).len();
        assert!((3_900..4_100).contains(&length), "{length}");
    }
}
