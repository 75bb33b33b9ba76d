//! The program under test, its data folder, and a server that ends with the test.

#![allow(dead_code, reason = "each test binary uses a part")]

use std::{
    io::{BufRead, BufReader, Read},
    net::SocketAddr,
    path::{Path, PathBuf},
    process::{Child, Command, Output, Stdio},
    sync::{Arc, Mutex},
    time::{Duration, Instant},
};

use belvedere_client::{Client, HttpSource};
use serde_json::Value;

use crate::wire::{Answer, get};

/// Long enough for a bake beside much else; what takes longer hangs.
const PATIENCE: Duration = Duration::from_secs(300);
/// Between two looks.
const PAUSE: Duration = Duration::from_millis(50);

/// A data folder of one test; it goes with the test.
pub(crate) struct Data {
    folder: tempfile::TempDir,
}

impl Data {
    pub(crate) fn new() -> Self {
        Self {
            folder: tempfile::tempdir().expect("a temporary folder"),
        }
    }

    pub(crate) fn path(&self) -> PathBuf {
        self.folder.path().join("data")
    }

    /// Writes a file beside the data folder.
    pub(crate) fn write(&self, name: &str, bytes: impl AsRef<[u8]>) -> PathBuf {
        let path = self.folder.path().join(name);
        std::fs::create_dir_all(path.parent().expect("a parent")).expect("a folder");
        std::fs::write(&path, bytes).expect("a file");
        path
    }

    pub(crate) fn folder(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    pub(crate) fn run(&self, args: &[&str]) -> Output {
        self.command(args).output().expect("the program runs")
    }

    /// Runs a command that must succeed; gives what it printed.
    pub(crate) fn ok(&self, args: &[&str]) -> String {
        let output = self.run(args);
        let (out, err) = (text(&output.stdout), text(&output.stderr));
        assert!(output.status.success(), "{args:?} failed\n{out}\n{err}");
        out
    }

    /// Runs a command that must fail; gives its message.
    pub(crate) fn fails(&self, args: &[&str]) -> String {
        let output = self.run(args);
        assert_eq!(output.status.code(), Some(1), "{args:?}: {}", text(&output.stdout));
        text(&output.stderr)
    }

    pub(crate) fn bake(&self, file: &Path, scene: &str) -> serde_json::Value {
        let file = file.to_str().expect("a path in UTF-8");
        serde_json::from_str(&self.ok(&["bake", file, "--scene", scene, "--json"])).expect("a JSON report")
    }

    pub(crate) fn command(&self, args: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_belvedere"));
        command
            .args(args)
            .env("BELVEDERE_DATA", self.path())
            .current_dir(self.folder.path());
        // What tests are told themselves is no setting of the program, which would say so.
        for told in ["FOLDER", "POSTGRES", "S3", "NATS"] {
            command.env_remove(format!("BELVEDERE_TEST_{told}"));
        }
        command
    }

    pub(crate) fn serve(&self) -> Server {
        self.serve_with(&[])
    }

    /// Serves with more arguments.
    pub(crate) fn serve_with(&self, args: &[&str]) -> Server {
        Server::start(self, args)
    }
}

/// A running server.
pub(crate) struct Server {
    child: Child,
    pub(crate) base: String,
    log: Arc<Mutex<String>>,
    may_warn: bool,
}

impl Server {
    fn start(data: &Data, args: &[&str]) -> Self {
        let mut child = data
            .command(&[&["serve", "--listen", "127.0.0.1:0"], args].concat())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .expect("the program starts");
        let log = Arc::new(Mutex::new(String::new()));
        let (mut stderr, kept) = (child.stderr.take().expect("stderr"), log.clone());
        std::thread::spawn(move || {
            let mut buffer = [0; 4096];
            while let Ok(read @ 1..) = stderr.read(&mut buffer) {
                kept.lock()
                    .expect("the log")
                    .push_str(&String::from_utf8_lossy(&buffer[..read]));
            }
        });
        let mut lines = BufReader::new(child.stdout.take().expect("stdout")).lines();
        let base = lines.by_ref().map_while(Result::ok).find_map(|line| {
            line.split_whitespace()
                .find(|w| w.starts_with("http://"))
                .map(str::to_owned)
        });
        std::thread::spawn(move || lines.for_each(drop));
        let base = base.unwrap_or_else(|| panic!("no address was printed; {}", log.lock().expect("the log")));
        Self {
            child,
            base: base.trim_end_matches('/').to_owned(),
            log,
            may_warn: false,
        }
    }

    /// Something will go wrong around it, and it shall say so.
    pub(crate) fn may_warn(mut self) -> Self {
        self.may_warn = true;
        self
    }

    pub(crate) fn address(&self) -> SocketAddr {
        let address = self.base.trim_start_matches("http://");
        address.parse().expect("an address")
    }

    pub(crate) fn client(&self) -> Client<HttpSource> {
        Client::new(HttpSource::new(&self.base).expect("an address"))
    }

    /// Waits until its log has these words.
    pub(crate) async fn until_it_says(&self, words: &str) {
        let begun = Instant::now();
        loop {
            {
                let log = self.log.lock().expect("the log");
                if log.contains(words) {
                    return;
                }
                assert!(begun.elapsed() < PATIENCE, "it does not say: {words}\n{log}");
            }
            tokio::time::sleep(PAUSE).await;
        }
    }

    /// Asks for something until the answer is as it shall be.
    pub(crate) async fn until(&self, path: &str, is_so: impl Fn(&Answer) -> bool) -> Answer {
        let begun = Instant::now();
        loop {
            let answer = get(self.address(), path).await;
            if is_so(&answer) {
                return answer;
            }
            let (status, body) = (answer.status, String::from_utf8_lossy(&answer.body));
            assert!(begun.elapsed() < PATIENCE, "{path} is still {status} {body}");
            tokio::time::sleep(PAUSE).await;
        }
    }

    /// The same, of something that is JSON as soon as it is there.
    pub(crate) async fn until_shown(&self, path: &str, is_so: impl Fn(&Value) -> bool) -> Value {
        let is_shown = |answer: &Answer| answer.status == 200 && is_so(&answer.json());
        self.until(path, is_shown).await.json()
    }

    /// Ends it without a warning.
    pub(crate) fn kill(mut self) {
        self.child.kill().expect("it is killed");
        self.child.wait().expect("it ends");
    }

    /// Holds it up, as a machine does that is out of breath.
    pub(crate) fn pause(&self) {
        self.signal("-STOP");
    }

    pub(crate) fn resume(&self) {
        self.signal("-CONT");
    }

    fn signal(&self, signal: &str) {
        let id = self.child.id().to_string();
        Command::new("kill").args([signal, &id]).status().expect("kill runs");
    }

    /// Asks it to stop as an init system would; gives its exit code and its log.
    pub(crate) fn stop(mut self) -> (Option<i32>, String) {
        self.signal("-TERM");
        let status = self.child.wait().expect("it ends");
        (status.code(), self.log.lock().expect("the log").clone())
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
        if !std::thread::panicking() && !self.may_warn {
            let log = self.log.lock().expect("the log");
            // How long a query takes, or waits for its turn, says something about the machine alone.
            let is_slow = |line: &str| line.contains("slow statement") || line.contains("exceeded slow threshold");
            let loud = log
                .lines()
                .filter(|line| !is_slow(line))
                .find(|line| line.contains(" WARN ") || line.contains(" ERROR ") || line.contains("panicked"));
            assert_eq!(loud, None, "the server's log holds a warning");
        }
    }
}

pub(crate) fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// Two rooms with a doorway between them, and a third that is closed.
pub(crate) const THREE_ROOMS: &str = "\
#############
#a..#..b#...#
#...+...#.c.#
#...#...#...#
#############
";
