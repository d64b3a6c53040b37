//! A collector that can be killed and comes back on its port, with its store.

use grideye_tests::patience::wait_or_explain;
use grideye_tests::programs::{grideye, run, terminate, wait};
use serde_json::Value;
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufRead as _, BufReader};
use std::net::{SocketAddr, TcpListener};
use std::path::{Path, PathBuf};
use std::process::{Child, Stdio};

/// The longest recording that is read.
const RECORDING_BYTES_MAX: u64 = 1 << 30;

const LOG: &str = "collector.log";

pub(crate) struct Collector {
    child: Option<Child>,
    /// The recording of everything.
    recording: u64,
    environment: Vec<(&'static str, PathBuf)>,
    pub(crate) store: PathBuf,
    pub(crate) address: SocketAddr,
}

impl Collector {
    pub(crate) fn start(folder: &Path) -> Self {
        Self::start_in(folder, Vec::new())
    }

    /// A collector with these variables in its environment.
    pub(crate) fn start_in(folder: &Path, environment: Vec<(&'static str, PathBuf)>) -> Self {
        let port = TcpListener::bind("127.0.0.1:0").unwrap();
        let address = port.local_addr().unwrap();
        drop(port);
        let mut collector = Self {
            child: None,
            recording: 0,
            environment,
            store: folder.join("store.sqlite"),
            address,
        };
        collector.run();
        collector.recording = collector.start_recording();
        collector
    }

    pub(crate) fn run(&mut self) {
        let mut child = grideye()
            .args(["collect", "--listen", &self.address.to_string(), "--store"])
            .arg(&self.store)
            .envs(self.environment.iter().cloned())
            .stdout(Stdio::piped())
            .stderr(self.log())
            .spawn()
            .unwrap();
        let mut line = String::new();
        let mut said = BufReader::new(child.stdout.take().unwrap());
        said.read_line(&mut line).unwrap();
        assert!(line.starts_with("http://"), "the collector said {line:?}");
        self.child = Some(child);
    }

    /// Where all collectors of a campaign say what happens, one after the other.
    fn log(&self) -> File {
        let log = self.store.with_file_name(LOG);
        File::options().create(true).append(true).open(log).unwrap()
    }

    /// What collectors and agents have said, for a person who looks for what went wrong.
    fn said(&self) -> String {
        let said = ["log", LOG].map(|name| {
            let said = std::fs::read_to_string(self.store.with_file_name(name));
            format!("{name}:\n{}", said.unwrap_or_default())
        });
        said.join("\n")
    }

    /// `kill -9`.
    pub(crate) fn kill(&mut self) {
        if let Some(mut child) = self.child.take() {
            child.kill().unwrap();
            child.wait().unwrap();
        }
    }

    /// Ends it well, so that all is in the store's one file.
    pub(crate) fn stop(mut self) -> PathBuf {
        let mut child = self.child.take().unwrap();
        terminate(&child);
        assert_eq!(wait(&mut child), 0, "the collector's end");
        self.store.clone()
    }

    pub(crate) fn url(&self) -> String {
        format!("http://{}", self.address)
    }

    /// What `grideye audit` says of every stream.
    pub(crate) fn audit(&self) -> Vec<Value> {
        let audit = run(grideye().args(["audit", "--json", "--collector", &self.url()]));
        assert!([0, 3].contains(&audit.code), "{audit:?}");
        let rows: Value = serde_json::from_str(&audit.stdout).unwrap();
        let mut rows = rows.as_array().unwrap().clone();
        let errors = self.errors();
        for row in &mut rows {
            row["errors"] = errors[row["boot"].as_str().unwrap()].clone();
        }
        rows
    }

    /// The errors of each run, which the command does not print.
    fn errors(&self) -> BTreeMap<String, Value> {
        let url = format!("{}/v1/audit", self.url());
        let audit: Value = ureq::get(url)
            .call()
            .unwrap()
            .body_mut()
            .read_json()
            .unwrap();
        let streams = audit["streams"].as_array().unwrap().iter();
        streams
            .map(|row| {
                (
                    row["boot"].as_str().unwrap().to_owned(),
                    row["errors"].clone(),
                )
            })
            .collect()
    }

    /// Waits until an agent that runs has delivered all: what the books said before it was cut off balances as well, so
    /// they must have grown, and twice, since an agent that was cut off sends its backlog after the first post.
    pub(crate) fn wait_until_caught_up(&self) -> Vec<Value> {
        let read = |rows: &[Value]| rows.iter().filter_map(|row| row["read"].as_u64()).sum();
        let mut rows = self.audit();
        for _ in 0..2 {
            let before: u64 = read(&rows);
            rows = self.wait_until(|rows| are_settled(rows) && read(rows) > before);
        }
        rows
    }

    /// Waits until what agents have said before they ended is all here, but for frames that they left on their disk.
    pub(crate) fn wait_until_all_is_here_but(&self, left: u64) -> Vec<Value> {
        self.wait_until(|rows| are_balanced_but_for(rows, left))
    }

    fn wait_until(&self, is_met: impl Fn(&[Value]) -> bool) -> Vec<Value> {
        let rows = || Some(self.audit()).filter(|rows| is_met(rows));
        wait_or_explain(rows, || {
            format!("what is on its way: {:#?}\n{}", self.audit(), self.said())
        })
    }

    /// Everything that has arrived.
    pub(crate) fn csv(&self) -> String {
        let csv = format!("{}/v1/recordings/{}.csv", self.url(), self.recording);
        let mut answer = ureq::get(csv).call().unwrap();
        let body = answer.body_mut().with_config().limit(RECORDING_BYTES_MAX);
        body.read_to_string().unwrap()
    }

    fn start_recording(&self) -> u64 {
        let recordings = format!("{}/v1/recordings", self.url());
        let name = serde_json::json!({ "name": "campaign" });
        let mut answer = ureq::post(recordings).send_json(name).unwrap();
        let recording: Value = answer.body_mut().read_json().unwrap();
        recording["id"].as_u64().unwrap()
    }
}

impl Drop for Collector {
    fn drop(&mut self) {
        self.kill();
    }
}

/// Whether `grideye audit` says that the books balance and that nothing is in a spool any more.
fn are_settled(rows: &[Value]) -> bool {
    are_balanced_but_for(rows, 0)
}

/// Whether it says that they balance, and that so many frames are in spools.
fn are_balanced_but_for(rows: &[Value], left: u64) -> bool {
    let spooled: u64 = rows.iter().filter_map(|row| row["spooled"].as_u64()).sum();
    !rows.is_empty() && spooled == left && rows.iter().all(|row| row["balanced"] == true)
}
