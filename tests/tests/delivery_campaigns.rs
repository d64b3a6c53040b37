//! Every frame arrives once: real programs that are killed, cut off and starved of disk, again and again.
//!
//! Each campaign draws its moments from a seed and prints it with its counts: `GRIDEYE_CAMPAIGN_SEED=7` runs that one
//! again. By default each kills a few times; `GRIDEYE_CAMPAIGN_KILLS=200` is the long run.

#![expect(
    clippy::unwrap_used,
    clippy::panic,
    reason = "what fails in a helper fails the test"
)]

use grideye_tests::emulated::{Words, recording};
use grideye_tests::programs::{grideye, grideye_agent, is_left_out, terminate, wait};
use std::collections::{BTreeMap, HashMap};
use std::fmt::Write as _;
use std::io::{BufRead as _, BufReader, Read as _, Write as _};
use std::net::{Shutdown, SocketAddr, TcpListener, TcpStream};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

/// How long everything that is left may take to arrive, on a busy machine.
const CATCH_UP_MAX: Duration = Duration::from_secs(120);
/// From a read to its group on the disk, on a busy machine, beyond the time that the agent states.
const ALLOWED_LATE_S: f64 = 4.0;

fn kills() -> u32 {
    number("GRIDEYE_CAMPAIGN_KILLS").map_or(6, |kills| u32::try_from(kills).unwrap())
}

fn number(variable: &str) -> Option<u64> {
    std::env::var(variable).ok()?.parse().ok()
}

/// SplitMix64.
struct Seeded(u64);

impl Seeded {
    fn new(campaign: u64) -> Self {
        let seed = number("GRIDEYE_CAMPAIGN_SEED").unwrap_or(1);
        println!("campaign {campaign}, seed {seed}");
        Self(seed.wrapping_mul(1000).wrapping_add(campaign))
    }

    fn below(&mut self, limit: u64) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut mixed = self.0;
        mixed = (mixed ^ (mixed >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        (mixed ^ (mixed >> 31)) % limit
    }

    fn pause(&mut self, from_ms: u64, to_ms: u64) {
        std::thread::sleep(Duration::from_millis(from_ms + self.below(to_ms - from_ms)));
    }
}

// ---- collector ---------------------------------------------------------------------------------------------------

/// A collector that can be killed and comes back on its port, with its store.
struct Collector {
    child: Option<Child>,
    store: PathBuf,
    address: SocketAddr,
}

impl Collector {
    fn start(folder: &Path) -> Self {
        let port = TcpListener::bind("127.0.0.1:0").unwrap();
        let address = port.local_addr().unwrap();
        drop(port);
        let store = folder.join("store.sqlite");
        let mut collector = Self {
            child: None,
            store,
            address,
        };
        collector.run();
        collector
    }

    fn run(&mut self) {
        let mut child = grideye()
            .args(["collect", "--listen", &self.address.to_string(), "--store"])
            .arg(&self.store)
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        let mut line = String::new();
        let mut said = BufReader::new(child.stdout.take().unwrap());
        said.read_line(&mut line).unwrap();
        assert!(line.starts_with("http://"), "the collector said {line:?}");
        self.child = Some(child);
    }

    fn kill(&mut self) {
        if let Some(mut child) = self.child.take() {
            child.kill().unwrap();
            child.wait().unwrap();
        }
    }

    fn url(&self) -> String {
        format!("http://{}", self.address)
    }

    fn audit(&self) -> serde_json::Value {
        let audit = format!("{}/v1/audit", self.url());
        ureq::get(audit)
            .call()
            .unwrap()
            .body_mut()
            .read_json()
            .unwrap()
    }

    fn start_recording(&self) -> u64 {
        let recordings = format!("{}/v1/recordings", self.url());
        let name = serde_json::json!({ "name": "campaign" });
        let mut answer = ureq::post(recordings).send_json(name).unwrap();
        let recording: serde_json::Value = answer.body_mut().read_json().unwrap();
        recording["id"].as_u64().unwrap()
    }

    fn csv(&self, id: u64) -> String {
        let csv = format!("{}/v1/recordings/{id}.csv", self.url());
        let mut answer = ureq::get(csv).call().unwrap();
        let body = answer.body_mut().with_config().limit(1 << 30);
        body.read_to_string().unwrap()
    }

    /// Waits until nothing is on its way any more.
    fn wait_until_all_is_here(&self) -> serde_json::Value {
        let since = Instant::now();
        loop {
            let audit = self.audit();
            let streams = audit["streams"].as_array().unwrap();
            let is_here = |stream: &serde_json::Value| stream["spooled"] == 0;
            if audit["balanced"] == true && streams.iter().all(is_here) {
                return audit;
            }
            assert!(
                since.elapsed() < CATCH_UP_MAX,
                "still on its way: {audit:#}"
            );
            std::thread::sleep(Duration::from_millis(200));
        }
    }
}

impl Drop for Collector {
    fn drop(&mut self) {
        self.kill();
    }
}

// ---- agent -------------------------------------------------------------------------------------------------------

/// An agent on an emulated sensor that is started again whenever it ends, as systemd does.
struct Agents {
    emulator: Child,
    folder: PathBuf,
}

const LOOP: &str = r#"while [ ! -e "$1/stop" ]; do "$2" run --config "$1/agent.toml" >>"$1/out" 2>>"$1/log" &
echo $! >"$1/pid.new"; mv "$1/pid.new" "$1/pid"; wait $!; done"#;

impl Agents {
    fn start(folder: &Path, config: &str) -> Self {
        let source = recording(folder, "source.csv", (0..50_000).map(identifiable));
        std::fs::write(folder.join("agent.toml"), config).unwrap();
        let emulator = grideye()
            .args([
                "emulate", "--quiet", "--via", "preload", "--replay", "frames",
            ])
            .arg("--recording")
            .arg(source)
            .args(["--", "bash", "-c", LOOP, "agents"])
            .arg(folder)
            .arg(grideye_agent().get_program())
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        let agents = Self {
            emulator,
            folder: folder.to_owned(),
        };
        agents.pid_other_than("");
        agents
    }

    fn pid_other_than(&self, old: &str) -> String {
        let since = Instant::now();
        loop {
            let pid = std::fs::read_to_string(self.folder.join("pid")).unwrap_or_default();
            if !pid.trim().is_empty() && pid.trim() != old {
                return pid.trim().to_owned();
            }
            assert!(since.elapsed() < CATCH_UP_MAX, "no agent: {}", self.log());
            std::thread::sleep(Duration::from_millis(5));
        }
    }

    /// Kills the agent that runs. Returns when that was, on its boot clock in seconds.
    fn kill(&self) -> f64 {
        let pid = self.pid_other_than("");
        let at = boot_s();
        signal("KILL", &pid);
        self.pid_other_than(&pid);
        at
    }

    /// Lets the agent that runs end well.
    fn stop(mut self) {
        std::fs::write(self.folder.join("stop"), "").unwrap();
        signal("TERM", &self.pid_other_than(""));
        assert_eq!(wait(&mut self.emulator), 0);
    }

    fn log(&self) -> String {
        std::fs::read_to_string(self.folder.join("log")).unwrap_or_default()
    }

    fn wait_for_log(&self, said: &str) {
        let since = Instant::now();
        while !self.log().contains(said) {
            assert!(
                since.elapsed() < CATCH_UP_MAX,
                "no {said:?} in {}",
                self.log()
            );
            std::thread::sleep(Duration::from_millis(50));
        }
    }
}

impl Drop for Agents {
    fn drop(&mut self) {
        let _ = std::fs::write(self.folder.join("stop"), "");
        if let Ok(pid) = std::fs::read_to_string(self.folder.join("pid")) {
            let _ = Command::new("kill")
                .args(["-KILL", pid.trim()])
                .stderr(Stdio::null())
                .status();
        }
        let _ = self.emulator.kill();
        let _ = self.emulator.wait();
    }
}

fn signal(name: &str, pid: &str) {
    let sent = Command::new("kill")
        .args([&format!("-{name}"), pid])
        .status()
        .unwrap();
    assert!(sent.success(), "no process {pid}");
}

/// `CLOCK_BOOTTIME` in seconds.
fn boot_s() -> f64 {
    let uptime = std::fs::read_to_string("/proc/uptime").unwrap();
    uptime.split(' ').next().unwrap().parse().unwrap()
}

fn config(collector: &str, folder: &Path, spool: &str) -> String {
    format!(
        "device = \"pi-1\"\ncollector = \"{collector}\"\npost_every_ms = 100\nrequest_timeout_ms = 1500\n\
         [spool]\nfolder = \"{}\"\nfree_mib_min = 0\n{spool}\n\
         [[bus]]\npath = \"/dev/i2c-1\"\n[[bus.sensor]]\naddress = 0x69\n",
        folder.display()
    )
}

/// A frame that shows its number, spread over all pixels.
fn identifiable(index: usize) -> Words {
    let quarters = |pixel: usize| match pixel {
        0 => index % 512,
        1 => index / 512,
        _ => (index * 2_654_435_761 + pixel * 40_503) / 512 % 480,
    };
    Words {
        pixels: std::array::from_fn(|pixel| {
            let quarters = i16::try_from(quarters(pixel)).unwrap() - 160;
            u16::from_ne_bytes(quarters.to_ne_bytes()) & 0xFFF
        }),
        thermistor: u16::try_from(160 + index % 1000).unwrap(),
    }
}

// ---- what arrived ------------------------------------------------------------------------------------------------

/// What the collector has of each run.
#[derive(Debug, Default)]
struct Arrived {
    frames: u64,
    runs: BTreeMap<String, Run>,
}

#[derive(Debug, Default)]
struct Run {
    rows: u64,
    /// When its last row was read, on the boot clock in seconds.
    last_s: f64,
    /// The source's number less the row's.
    distance: Option<i64>,
}

/// Checks every row against the source: none torn, none twice, none changed, in order and without a gap in any run.
fn arrived(csv: &str, source: &Path) -> Arrived {
    let numbers: HashMap<String, i64> = cells(&std::fs::read_to_string(source).unwrap())
        .map(|(row, pixels)| (pixels, row["seq"].parse().unwrap()))
        .collect();
    let mut arrived = Arrived::default();
    for (row, pixels) in cells(csv) {
        let boot = row["boot"].clone();
        let run = arrived.runs.entry(boot.clone()).or_default();
        let seq: u64 = row["seq"].parse().unwrap();
        assert_eq!(seq, run.rows, "run {boot}: neither a gap nor a repetition");
        run.rows += 1;
        run.last_s = row["t_boot_ns"].parse::<f64>().unwrap() / 1e9;
        if !row["missing"].is_empty() {
            continue;
        }
        arrived.frames += 1;
        let number = numbers.get(&pixels);
        let number = number.unwrap_or_else(|| panic!("run {boot}, row {seq}: torn or changed"));
        let distance = number - i64::try_from(seq).unwrap();
        assert_eq!(
            *run.distance.get_or_insert(distance),
            distance,
            "run {boot}, row {seq}: out of order"
        );
    }
    arrived
}

/// The rows of a recording as cells by column, and the text of their pixels.
fn cells(csv: &str) -> impl Iterator<Item = (BTreeMap<String, String>, String)> {
    let mut lines = csv.lines().filter(|line| !line.starts_with('#'));
    let header: Vec<&str> = lines.next().unwrap().split(',').collect();
    let first = header.iter().position(|name| *name == "pixel1").unwrap();
    lines.map(move |line| {
        let cells: Vec<&str> = line.split(',').collect();
        let pixels = cells[first..].join(",");
        let named = header.iter().zip(&cells).take(first);
        let row = named.map(|(name, cell)| ((*name).to_owned(), (*cell).to_owned()));
        (row.collect(), pixels)
    })
}

/// The counts of all runs together, by name.
fn sums(audit: &serde_json::Value) -> BTreeMap<String, u64> {
    let mut sums: BTreeMap<String, u64> = BTreeMap::new();
    for stream in audit["streams"].as_array().unwrap() {
        for name in ["read", "stored", "spooled"] {
            *sums.entry(name.to_owned()).or_default() += stream[name].as_u64().unwrap();
        }
        for (reason, count) in stream["dropped"].as_object().unwrap() {
            *sums.entry(format!("dropped {reason}")).or_default() += count.as_u64().unwrap();
        }
    }
    sums
}

fn line(counts: &BTreeMap<String, u64>) -> String {
    let mut line = String::new();
    for (name, count) in counts {
        write!(line, "{name} {count}; ").unwrap();
    }
    line
}

/// Frames that the killed runs had read before their guarantee's time and that did not arrive.
fn beyond_the_guarantee(arrived: &Arrived, kills_s: &[f64], guarantee_s: f64) -> (u64, f64) {
    let mut ends: Vec<f64> = arrived.runs.values().map(|run| run.last_s).collect();
    ends.sort_by(f64::total_cmp);
    let (mut beyond, mut longest_s) = (0, 0.0_f64);
    for killed in kills_s {
        // The run that was killed there is the one with the last row before it, if it lived long enough to have one.
        let Some(end) = ends.iter().copied().rev().find(|end| end < killed) else {
            continue;
        };
        let before = kills_s
            .iter()
            .copied()
            .filter(|other| other < killed)
            .fold(0.0, f64::max);
        if end > before {
            longest_s = longest_s.max(killed - end);
            if killed - end > guarantee_s + ALLOWED_LATE_S {
                beyond += 1;
            }
        }
    }
    (beyond, longest_s)
}

// ---- campaigns ---------------------------------------------------------------------------------------------------

#[test]
fn an_agent_that_is_killed_at_any_moment_loses_no_more_than_it_says() {
    for (campaign, mode, guarantee_s) in [
        (1, "mode = \"always\"\nsync_every_ms = 100", 0.35),
        (2, "mode = \"outage\"\nafter_ms = 500", 0.75),
    ] {
        let mut seeded = Seeded::new(campaign);
        let folder = tempfile::tempdir().unwrap();
        let collector = Collector::start(folder.path());
        let id = collector.start_recording();
        let spool = folder.path().join("spool");
        let agents = Agents::start(folder.path(), &config(&collector.url(), &spool, mode));
        let mut kills_s = Vec::new();
        for _ in 0..kills() {
            seeded.pause(300, 3000);
            kills_s.push(agents.kill());
        }
        seeded.pause(2000, 3000);
        agents.stop();
        let audit = collector.wait_until_all_is_here();
        let arrived = arrived(&collector.csv(id), &folder.path().join("source.csv"));
        let (beyond, longest_s) = beyond_the_guarantee(&arrived, &kills_s, guarantee_s);
        println!(
            "agent killed {} times, {mode:?}: {} runs; {}at most {longest_s:.2} s between the last row and the kill; beyond the guarantee: {beyond}; twice: 0",
            kills_s.len(),
            arrived.runs.len(),
            line(&sums(&audit))
        );
        assert_eq!(beyond, 0);
        assert_eq!(sums(&audit)["stored"], arrived.frames);
        assert!(arrived.frames > u64::from(kills()), "{arrived:?}");
    }
}

#[test]
fn a_collector_that_is_killed_at_any_moment_costs_nothing() {
    let mut seeded = Seeded::new(3);
    let folder = tempfile::tempdir().unwrap();
    let mut collector = Collector::start(folder.path());
    let id = collector.start_recording();
    let spool = folder.path().join("spool");
    let mode = "mode = \"outage\"\nafter_ms = 500";
    let agents = Agents::start(folder.path(), &config(&collector.url(), &spool, mode));
    for _ in 0..kills() {
        seeded.pause(100, 2000);
        collector.kill();
        seeded.pause(10, 1500);
        collector.run();
    }
    seeded.pause(2000, 3000);
    collector.wait_until_all_is_here();
    agents.stop();
    let audit = collector.wait_until_all_is_here();
    let arrived = arrived(&collector.csv(id), &folder.path().join("source.csv"));
    let sums = sums(&audit);
    println!(
        "collector killed {} times: {} run; {}lost: 0; twice: 0",
        kills(),
        arrived.runs.len(),
        line(&sums)
    );
    assert_eq!(
        (sums["read"], sums["stored"]),
        (sums["stored"], arrived.frames)
    );
    assert_eq!(arrived.runs.len(), 1);
}

#[test]
fn both_killed_behind_a_network_that_drops_delays_resets_and_swallows_loses_no_more_than_the_agent_says()
 {
    let mut seeded = Seeded::new(4);
    let folder = tempfile::tempdir().unwrap();
    let mut collector = Collector::start(folder.path());
    let id = collector.start_recording();
    let proxy = Proxy::start(collector.address, seeded.below(u64::MAX));
    let spool = folder.path().join("spool");
    let mode = "mode = \"always\"\nsync_every_ms = 100";
    let agents = Agents::start(folder.path(), &config(&proxy.url, &spool, mode));
    let mut kills_s = Vec::new();
    for _ in 0..kills() {
        seeded.pause(500, 3000);
        if seeded.below(2) == 0 {
            kills_s.push(agents.kill());
        } else {
            collector.kill();
            seeded.pause(10, 1000);
            collector.run();
        }
    }
    proxy.is_kind.store(true, Ordering::SeqCst);
    collector.wait_until_all_is_here();
    agents.stop();
    let audit = collector.wait_until_all_is_here();
    let arrived = arrived(&collector.csv(id), &folder.path().join("source.csv"));
    let (beyond, longest_s) = beyond_the_guarantee(&arrived, &kills_s, 0.35);
    println!(
        "agent killed {}, collector {} times, behind {}: {} runs; {}at most {longest_s:.2} s between the last row and the kill; beyond the guarantee: {beyond}; twice: 0",
        kills_s.len(),
        kills() - u32::try_from(kills_s.len()).unwrap(),
        proxy.said(),
        arrived.runs.len(),
        line(&sums(&audit))
    );
    assert_eq!(beyond, 0);
    assert_eq!(sums(&audit)["stored"], arrived.frames);
}

#[test]
fn a_disk_that_is_full_or_read_only_costs_nothing_while_there_is_memory() {
    let is_root = std::fs::read_to_string("/proc/self/status")
        .unwrap()
        .contains("\nUid:\t0\t");
    if !is_root
        || is_left_out(
            "GRIDEYE_WITHOUT_MOUNTS",
            "a spool on a full and a read-only disk",
        )
    {
        return;
    }
    for is_full in [true, false] {
        let folder = tempfile::tempdir().unwrap();
        let disk = Mounted::tmpfs(folder.path().join("disk"));
        let spool = disk.0.join("spool");
        std::fs::create_dir(&spool).unwrap();
        let mut collector = Collector::start(folder.path());
        let id = collector.start_recording();
        collector.kill();
        let mode = "mode = \"outage\"\nafter_ms = 500";
        let agents = Agents::start(folder.path(), &config(&collector.url(), &spool, mode));
        // Until it has written, it has nothing to lose there.
        let written = || {
            std::fs::read_dir(&spool)
                .unwrap()
                .flatten()
                .any(|entry| entry.file_name().to_string_lossy().starts_with("segment-"))
        };
        let since = Instant::now();
        while !written() {
            assert!(since.elapsed() < CATCH_UP_MAX, "{}", agents.log());
            std::thread::sleep(Duration::from_millis(20));
        }
        if is_full {
            disk.fill();
        } else {
            disk.remount("ro");
        }
        agents.wait_for_log("the spool cannot be written: ");
        std::thread::sleep(Duration::from_secs(2));
        collector.run();
        if !is_full {
            disk.remount("rw");
        }
        collector.wait_until_all_is_here();
        agents.stop();
        let audit = collector.wait_until_all_is_here();
        let arrived = arrived(&collector.csv(id), &folder.path().join("source.csv"));
        let sums = sums(&audit);
        println!(
            "disk {}: {}lost: 0; twice: 0",
            if is_full { "full" } else { "read-only" },
            line(&sums)
        );
        assert_eq!(
            (sums["read"], sums["stored"]),
            (sums["stored"], arrived.frames)
        );
        let kind = if is_full {
            "spool-disk-full"
        } else {
            "spool-read-only"
        };
        let errors = &audit["streams"][0]["errors"];
        assert!(
            errors[kind].as_u64().is_some_and(|count| count > 0),
            "{errors}"
        );
    }
}

/// A file system of 1 MiB in memory, until it is dropped.
struct Mounted(PathBuf);

impl Mounted {
    fn tmpfs(path: PathBuf) -> Self {
        std::fs::create_dir(&path).unwrap();
        let mount = ["-t", "tmpfs", "-o", "size=1m", "grideye-test"];
        let done = Command::new("mount")
            .args(mount)
            .arg(&path)
            .status()
            .unwrap();
        assert!(done.success());
        Self(path)
    }

    fn fill(&self) {
        let mut file = std::fs::File::create(self.0.join("filler")).unwrap();
        while file.write_all(&[0; 1024]).is_ok() {}
    }

    fn remount(&self, how: &str) {
        let option = format!("remount,{how}");
        let done = Command::new("mount")
            .args(["-o", &option])
            .arg(&self.0)
            .status()
            .unwrap();
        assert!(done.success(), "{option}");
    }
}

impl Drop for Mounted {
    fn drop(&mut self) {
        let _ = Command::new("umount").arg("-l").arg(&self.0).status();
    }
}

// ---- network -----------------------------------------------------------------------------------------------------

/// What the network does to one connection.
const MISFORTUNES: [&str; 7] = [
    "none",
    "drop",
    "delay",
    "reset in mid-body",
    "half-close",
    "truncated answer",
    "swallowed answer",
];

/// A network that goes wrong, by a seed.
struct Proxy {
    url: String,
    is_kind: Arc<AtomicBool>,
    counts: Arc<Mutex<BTreeMap<&'static str, u64>>>,
    drawn: Arc<AtomicU64>,
}

impl Proxy {
    fn start(collector: SocketAddr, seed: u64) -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let proxy = Self {
            url: format!("http://{}", listener.local_addr().unwrap()),
            is_kind: Arc::default(),
            counts: Arc::default(),
            drawn: Arc::default(),
        };
        let (is_kind, counts, drawn) = (
            Arc::clone(&proxy.is_kind),
            Arc::clone(&proxy.counts),
            Arc::clone(&proxy.drawn),
        );
        std::thread::spawn(move || {
            let mut seeded = Seeded(seed);
            for stream in listener.incoming().flatten() {
                let drawn_now = seeded.below(MISFORTUNES.len() as u64);
                let kind = is_kind.load(Ordering::SeqCst);
                let misfortune = if kind {
                    "none"
                } else {
                    MISFORTUNES[usize::try_from(drawn_now).unwrap()]
                };
                drawn.fetch_add(1, Ordering::SeqCst);
                *counts.lock().unwrap().entry(misfortune).or_default() += 1;
                std::thread::spawn(move || carry(stream, collector, misfortune));
            }
        });
        proxy
    }

    fn said(&self) -> String {
        let counts = self.counts.lock().unwrap();
        let named: Vec<String> = counts
            .iter()
            .map(|(name, count)| format!("{name} {count}"))
            .collect();
        format!(
            "{} connections ({})",
            self.drawn.load(Ordering::SeqCst),
            named.join(", ")
        )
    }
}

/// Requests on one connection that go well before the misfortune.
const GOOD_REQUESTS: u32 = 4;

/// Carries requests and answers one by one; the last of some meets with the misfortune.
fn carry(agent: TcpStream, collector: SocketAddr, misfortune: &str) {
    let Ok(far) = TcpStream::connect(collector) else {
        return;
    };
    let mut requests = BufReader::new(agent.try_clone().unwrap());
    let mut answers = BufReader::new(far.try_clone().unwrap());
    for number in 0.. {
        let is_now = number == GOOD_REQUESTS && misfortune != "none";
        let Some(request) = message(&mut requests) else {
            return;
        };
        match misfortune {
            "drop" if is_now => return,
            "delay" if is_now => std::thread::sleep(Duration::from_millis(1700)),
            "reset in mid-body" if is_now => {
                let _ = (&far).write_all(&request[..request.len() / 2]);
                return;
            }
            _ => {}
        }
        if (&far).write_all(&request).is_err() {
            return;
        }
        if is_now && misfortune == "half-close" {
            let _ = far.shutdown(Shutdown::Write);
        }
        let Some(answer) = message(&mut answers) else {
            return;
        };
        match misfortune {
            "truncated answer" if is_now => {
                let _ = (&agent).write_all(&answer[..answer.len() / 2]);
                return;
            }
            // The agent hears nothing, and does not hear that it will hear nothing.
            "swallowed answer" if is_now => {
                std::thread::sleep(Duration::from_secs(2));
                return;
            }
            _ => {}
        }
        if (&agent).write_all(&answer).is_err() || is_now {
            return;
        }
    }
}

/// One message of HTTP, head and body.
fn message(reader: &mut BufReader<TcpStream>) -> Option<Vec<u8>> {
    let mut bytes = Vec::new();
    let mut length = 0;
    loop {
        let begin = bytes.len();
        if reader.read_until(b'\n', &mut bytes).ok()? == 0 {
            return None;
        }
        let line = String::from_utf8_lossy(&bytes[begin..]).to_ascii_lowercase();
        if let Some(value) = line.strip_prefix("content-length:") {
            length = value.trim().parse().ok()?;
        }
        if line.trim().is_empty() {
            break;
        }
    }
    let mut body = vec![0; length];
    reader.read_exact(&mut body).ok()?;
    bytes.extend(body);
    Some(bytes)
}

#[test]
fn a_second_agent_on_the_same_spool_is_refused_and_named() {
    let folder = tempfile::tempdir().unwrap();
    let spool = folder.path().join("spool");
    let text = config("http://127.0.0.1:9", &spool, "");
    let text = text.replace("/dev/i2c-1", "/nonexistent/i2c-1");
    let path = folder.path().join("agent.toml");
    std::fs::write(&path, text).unwrap();
    let mut first = grideye_agent();
    first
        .args(["run", "--config"])
        .arg(&path)
        .stdout(Stdio::null())
        .stderr(Stdio::null());
    let mut first = first.spawn().unwrap();
    let since = Instant::now();
    while !spool.join("state").exists() {
        assert!(since.elapsed() < CATCH_UP_MAX);
        std::thread::sleep(Duration::from_millis(20));
    }
    let second = grideye_tests::programs::run(grideye_agent().args(["run", "--config"]).arg(&path));
    assert_eq!(second.code, 1, "{second:?}");
    assert!(
        second
            .stderr
            .contains("another agent uses this spool\nhint: "),
        "{second:?}"
    );
    terminate(&first);
    wait(&mut first);
}
