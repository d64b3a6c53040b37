//! The collector with default limits, as a separate process.

use grideye_collector::auth::{AccessFolder, Scope, Token, TokenBook};
use grideye_collector::{Collector, Config, Log, StoreLocation, SystemClock};
use std::collections::{BTreeMap, BTreeSet};
use std::io::{BufRead as _, BufReader};
use std::net::SocketAddr;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::Arc;
use tokio::io::{AsyncReadExt as _, AsyncWriteExt as _};
use tokio::net::TcpStream;

/// Names the folder of [`role`]'s store and tokens.
const ROLE: &str = "GRIDEYE_ATTACKED_IN";
/// The usual soft limit on a program's open files.
const OPEN_FILES: &str = "ulimit -S -n 1024";

/// Serves in the folder that the environment names until its input ends; without that it does nothing.
#[test]
fn role() {
    let Some(folder) = std::env::var_os(ROLE).map(PathBuf::from) else {
        return;
    };
    let store = StoreLocation::File(folder.join("frames.sqlite"));
    let config = Config {
        access: Some(AccessFolder::new(folder.join("access"))),
        log: Log::new(|event| eprintln!("{event}")),
        ..Config::new(
            ([127, 0, 0, 1], 0).into(),
            store,
            Arc::new(SystemClock::new()),
        )
    };
    let runtime = grideye_collector::runtime().unwrap();
    runtime.block_on(async {
        let collector = Collector::bind(config).await.unwrap();
        let ended = tokio::task::spawn_blocking(|| std::io::stdin().lines().count());
        let ended = async { drop(ended.await) };
        collector.serve(ended).await.unwrap();
    });
}

/// A folder for a collector, before the start.
pub(crate) struct Folder(tempfile::TempDir);

impl Folder {
    pub(crate) fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    fn access(&self) -> AccessFolder {
        AccessFolder::new(self.0.path().join("access"))
    }

    /// A token for each of these devices.
    pub(crate) fn tokens(&self, devices: &[String]) -> Vec<Token> {
        let add = |book: &mut TokenBook| {
            let scope = |name: &String| Scope::Ingest {
                devices: BTreeSet::from([name.clone()]),
            };
            let made = devices.iter().map(|name| book.add(name, scope(name), 1));
            made.collect::<Result<Vec<_>, _>>()
        };
        self.access().change(add).unwrap()
    }

    /// A token that may read.
    pub(crate) fn reader(&self) -> Token {
        let add = |book: &mut TokenBook| book.add("read", Scope::Read, 1);
        self.access().change(add).unwrap()
    }

    pub(crate) fn start(self) -> Attacked {
        self.start_after(OPEN_FILES)
    }

    /// Starts after this shell command.
    pub(crate) fn start_after(self, command: &str) -> Attacked {
        let log = self.0.path().join("log");
        let mut child = Command::new("sh")
            .args(["-c", &format!("{command} && exec \"$0\" \"$@\"")])
            .arg(std::env::current_exe().unwrap())
            .args(["--exact", "collector_process::role", "--nocapture"])
            .env(ROLE, self.0.path())
            .stdin(Stdio::piped())
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let mut lines = BufReader::new(child.stderr.take().unwrap()).lines();
        let mut said = String::new();
        let address = loop {
            let line = lines.next().unwrap().unwrap();
            said.push_str(&line);
            said.push('\n');
            let address = line.strip_prefix("info: listening address=");
            if let Some(address) = address.and_then(|rest| rest.split(' ').next()) {
                break address.parse().unwrap();
            }
        };
        std::fs::write(&log, said).unwrap();
        let mut rest = std::fs::OpenOptions::new().append(true).open(&log).unwrap();
        std::thread::spawn(move || {
            for line in lines.map_while(Result::ok) {
                let _ = std::io::Write::write_all(&mut rest, format!("{line}\n").as_bytes());
            }
        });
        Attacked {
            child,
            address,
            log,
            _folder: self,
        }
    }
}

/// A running collector that ends on drop.
pub(crate) struct Attacked {
    child: Child,
    pub(crate) address: SocketAddr,
    log: PathBuf,
    _folder: Folder,
}

impl Attacked {
    pub(crate) fn resident_kib(&self) -> u64 {
        resident_kib(Path::new(&format!("/proc/{}/status", self.child.id())))
    }

    pub(crate) fn log(&self) -> String {
        std::fs::read_to_string(&self.log).unwrap()
    }

    /// The response body for this path, on a new connection.
    pub(crate) async fn get(&self, path: &str, token: Option<&Token>) -> String {
        let mut stream = TcpStream::connect(self.address).await.unwrap();
        let token = authorization(token);
        let request =
            format!("GET {path} HTTP/1.1\r\nhost: localhost\r\nconnection: close\r\n{token}\r\n");
        stream.write_all(request.as_bytes()).await.unwrap();
        let mut answer = String::new();
        stream.read_to_string(&mut answer).await.unwrap();
        let (head, body) = answer.split_once("\r\n\r\n").unwrap();
        assert!(head.starts_with("HTTP/1.1 200"), "{answer}");
        body.to_owned()
    }

    /// All figures of `/metrics` by name and labels.
    pub(crate) async fn metrics(&self, token: Option<&Token>) -> Metrics {
        let text = self.get("/metrics", token).await;
        let samples = text.lines().filter(|line| !line.starts_with('#'));
        let samples = samples.filter_map(|line| line.rsplit_once(' '));
        let samples = samples.map(|(name, value)| (name.to_owned(), value.to_owned()));
        Metrics(samples.collect())
    }
}

impl Drop for Attacked {
    fn drop(&mut self) {
        drop(self.child.stdin.take());
        let _ = self.child.wait();
    }
}

/// The header with a token, or empty.
pub(crate) fn authorization(token: Option<&Token>) -> String {
    token.map_or_else(String::new, |token| {
        format!("authorization: Bearer {}\r\n", token.reveal())
    })
}

/// The figures of a collector.
pub(crate) struct Metrics(BTreeMap<String, String>);

impl Metrics {
    /// A count; 0 if absent.
    pub(crate) fn of(&self, name: &str) -> u64 {
        self.0.get(name).map_or(0, |value| value.parse().unwrap())
    }

    /// Requests refused with this code.
    pub(crate) fn refused(&self, code: &str) -> u64 {
        self.of(&format!("grideye_refused_total{{code=\"{code}\"}}"))
    }

    /// The sum of a family over all labels.
    pub(crate) fn sum(&self, family: &str) -> u64 {
        let of_family = self.0.keys().filter(|name| {
            let rest = name.strip_prefix(family);
            rest.is_some_and(|rest| rest.is_empty() || rest.starts_with('{'))
        });
        of_family.map(|name| self.of(name)).sum()
    }
}

/// A process' resident memory in KiB, from `/proc/PID/status`.
pub(crate) fn resident_kib(status: &Path) -> u64 {
    let status = std::fs::read_to_string(status).unwrap();
    let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:"));
    line.unwrap()
        .trim()
        .trim_end_matches(" kB")
        .parse()
        .unwrap()
}
