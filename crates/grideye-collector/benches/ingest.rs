//! Load test of `POST /v1/frames`: agents with persistent connections, against any server that accepts the wire format.
//!
//! ```text
//!   cargo bench -p grideye-collector --bench ingest                       ours alone: JSON and bytes, as fast as it takes them
//!   cargo bench -p grideye-collector --bench ingest -- ours 10 256        the same for 10 s each, with 256 agents in place of 64
//!   cargo bench -p grideye-collector --bench ingest -- fleet 2000 600     2,000 agents, a batch every 0.5 s, for 600 s
//!   cargo bench -p grideye-collector --bench ingest -- url NAME URL PID   another server, with its first process
//! ```
//!
//! This program generates the load; the collector under test is a separate process (`serve FILE`), so that `/proc`
//! shows the cost of each. `tests/peers/ingest/run` compares it with its peers.

#![expect(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::as_conversions,
    clippy::cast_precision_loss,
    reason = "a program for one who watches: it may stop at the first surprise, and its figures are rounded"
)]

use grideye_collector::{Collector, Config, StoreLocation, SystemClock};
use grideye_frame::{PixelWord, Reading, RecordedFrame, ThermistorWord};
use grideye_recording::wire::{Acknowledgement, BINARY_TYPE, Batch, JSON_TYPE, SensorBatch};
use grideye_recording::{ClockState, Record, Stamp};
use std::io::{BufRead as _, BufReader};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::{Duration, Instant};
use tokio::io::{AsyncReadExt as _, AsyncWriteExt as _};
use tokio::net::TcpStream;

/// As in `grideye collect`.
#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

/// Frames per batch: half a second at 10 Hz.
const FRAMES: u64 = 5;
/// Connections that post as fast as they are answered.
const CLOSED_LOOP_AGENTS: u64 = 64;
const CLOSED_LOOP_TIME: Duration = Duration::from_secs(10);
/// Number of parts of the test after which memory is measured.
const TENTHS: u32 = 10;
const POST_EVERY: Duration = Duration::from_millis(500);

fn main() {
    let arguments: Vec<String> = std::env::args()
        .skip(1)
        .filter(|a| a != "--bench")
        .collect();
    let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
    match arguments.as_slice() {
        ["serve", place] => serve(place),
        [] => ours(Pace::default(), &Body::ALL),
        ["ours", "binary", pace @ ..] => ours(Pace::of(pace), &[Body::Binary]),
        ["ours", pace @ ..] => ours(Pace::of(pace), &Body::ALL),
        ["url", name, url, pid, pace @ ..] => url_of_another(name, url, pid, Pace::of(pace)),
        ["fleet", agents, seconds] => fleet(agents, seconds, Body::Json),
        ["fleet", agents, seconds, "binary"] => fleet(agents, seconds, Body::Binary),
        _ => panic!(
            "expected nothing, ours [binary] [SECONDS [AGENTS]], fleet AGENTS SECONDS [binary], or url NAME URL PID [SECONDS [AGENTS]]"
        ),
    }
}

/// Duration and agents of a closed loop.
#[derive(Debug, Clone, Copy)]
struct Pace {
    time: Duration,
    agents: u64,
}

impl Default for Pace {
    fn default() -> Self {
        Self {
            time: CLOSED_LOOP_TIME,
            agents: CLOSED_LOOP_AGENTS,
        }
    }
}

impl Pace {
    /// Parses nothing, seconds, or seconds and agents.
    fn of(arguments: &[&str]) -> Self {
        let number = |place: usize, name: &str, otherwise: u64| match arguments.get(place) {
            None => otherwise,
            Some(text) => match text.parse() {
                Ok(number) => number,
                Err(_) => panic!("expected [SECONDS [AGENTS]], found {text:?} as {name}"),
            },
        };
        Self {
            time: Duration::from_secs(number(0, "SECONDS", CLOSED_LOOP_TIME.as_secs())),
            agents: number(1, "AGENTS", CLOSED_LOOP_AGENTS),
        }
    }
}

/// The collector under test; ends with its standard input.
fn serve(place: &str) {
    let runtime = grideye_collector::runtime().unwrap();
    runtime.block_on(async {
        let store: StoreLocation = place.parse().unwrap();
        let config = Config::new(
            ([127, 0, 0, 1], 0).into(),
            store,
            Arc::new(SystemClock::new()),
        );
        let collector = Collector::bind(config).await.unwrap();
        println!("http://{}", collector.local_addr());
        let ended = tokio::task::spawn_blocking(|| std::io::stdin().lines().count());
        collector
            .serve(async { ended.await.map(|_| ()).unwrap() })
            .await
            .unwrap();
    });
}

/// A running collector.
struct Ours {
    child: Child,
    url: String,
    _folder: tempfile::TempDir,
}

impl Ours {
    fn start() -> Self {
        let folder = tempfile::tempdir_in(
            std::env::var_os("GRIDEYE_BENCH_IN").unwrap_or_else(|| "/var/tmp".into()),
        )
        .unwrap();
        let place = std::env::var("GRIDEYE_BENCH_STORE")
            .unwrap_or_else(|_| folder.path().join("frames.sqlite").display().to_string());
        let mut child = Command::new(std::env::current_exe().unwrap())
            .args(["serve", &place])
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let mut url = String::new();
        BufReader::new(child.stdout.take().unwrap())
            .read_line(&mut url)
            .unwrap();
        Self {
            child,
            url: url.trim().to_owned(),
            _folder: folder,
        }
    }
}

impl Drop for Ours {
    fn drop(&mut self) {
        drop(self.child.stdin.take());
        let _ = self.child.wait();
    }
}

fn ours(pace: Pace, bodies: &[Body]) {
    heading();
    for body in bodies.iter().copied() {
        let name = match body {
            Body::Json => "collector, JSON",
            Body::Binary => "collector, bytes",
        };
        let ours = Ours::start();
        let load = Load::closed(&ours.url, body, pace);
        load.run(ours.child.id()).print(name);
    }
}

fn url_of_another(name: &str, url: &str, pid: &str, pace: Pace) {
    Load::closed(url, Body::Json, pace)
        .run(pid.parse().unwrap())
        .print(name);
}

fn fleet(agents: &str, seconds: &str, body: Body) {
    let ours = Ours::start();
    let load = Load {
        url: ours.url.clone(),
        agents: agents.parse().unwrap(),
        every: Some(POST_EVERY),
        time: Duration::from_secs(seconds.parse().unwrap()),
        body,
    };
    heading();
    let outcome = load.run(ours.child.id());
    outcome.print("collector, fleet");
    println!(
        "sent {} frames, acknowledged {}, refused {}, lost {}",
        outcome.sent,
        outcome.frames,
        outcome.refused,
        outcome.sent - outcome.frames
    );
    let residents = outcome.residents_mib.iter().map(|mib| format!(" {mib:.0}"));
    println!(
        "MiB resident at the start and after each tenth of the time:{}",
        residents.collect::<String>()
    );
    assert_eq!((outcome.refused, outcome.sent), (0, outcome.frames));
}

fn heading() {
    println!(
        "{:<20} {:>6} {:>10} {:>12} {:>9} {:>9} {:>9} {:>11} {:>11}",
        "server",
        "agents",
        "frames/s",
        "frames/CPU s",
        "p50 ms",
        "p99 ms",
        "max ms",
        "MiB begin",
        "MiB end"
    );
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Body {
    Json,
    Binary,
}

impl Body {
    const ALL: [Self; 2] = [Self::Json, Self::Binary];
}

struct Load {
    url: String,
    agents: u64,
    /// Pause between two batches of an agent; without it, as fast as it is answered.
    every: Option<Duration>,
    time: Duration,
    body: Body,
}

struct Outcome {
    agents: u64,
    sent: u64,
    frames: u64,
    refused: u64,
    wall: Duration,
    cpu: Duration,
    /// In microseconds, ascending.
    latencies: Vec<u32>,
    /// At the start, and after each tenth of the time.
    residents_mib: Vec<f64>,
}

impl Outcome {
    fn print(&self, name: &str) {
        let at = |part: f64| {
            let last = self.latencies.len().saturating_sub(1);
            let index = (last as f64 * part).round();
            // In range, because `part` is at most 1.
            f64::from(self.latencies[format!("{index}").parse::<usize>().unwrap()]) / 1000.0
        };
        println!(
            "{name:<20} {:>6} {:>10.0} {:>12.0} {:>9.2} {:>9.2} {:>9.2} {:>11.1} {:>11.1}",
            self.agents,
            self.frames as f64 / self.wall.as_secs_f64(),
            self.frames as f64 / self.cpu.as_secs_f64(),
            at(0.5),
            at(0.99),
            at(1.0),
            self.residents_mib.first().unwrap(),
            self.residents_mib.last().unwrap(),
        );
    }
}

impl Load {
    fn closed(url: &str, body: Body, pace: Pace) -> Self {
        Self {
            url: url.to_owned(),
            agents: pace.agents,
            every: None,
            time: pace.time,
            body,
        }
    }

    /// Loads the server with this first process.
    fn run(&self, pid: u32) -> Outcome {
        let runtime = tokio::runtime::Builder::new_current_thread()
            .enable_all()
            .build()
            .unwrap();
        runtime.block_on(self.load(pid))
    }

    async fn load(&self, pid: u32) -> Outcome {
        let address = self.url.strip_prefix("http://").unwrap().to_owned();
        let shared = Arc::new(Shared::default());
        let mut agents = Vec::new();
        for number in 0..self.agents {
            let agent = Agent {
                address: address.clone(),
                number,
                body: self.body,
                every: self.every,
                // Spread over the pause, like agents that were started at random times.
                offset: self.every.map_or(Duration::ZERO, |every| {
                    every.mul_f64(number as f64 / self.agents as f64)
                }),
                shared: Arc::clone(&shared),
            };
            agents.push(tokio::spawn(agent.run()));
        }
        // All connections are open and all streams known before counting starts.
        tokio::time::sleep(Duration::from_secs(2)).await;
        let (cpu, begun) = (cpu_time(pid), Instant::now());
        let frames = shared.frames.load(Ordering::Relaxed);
        let resident = resident_mib(pid);
        shared.counting.store(true, Ordering::Relaxed);
        let mut residents = vec![resident];
        for _ in 0..TENTHS {
            tokio::time::sleep(self.time / TENTHS).await;
            residents.push(resident_mib(pid));
        }
        let counted = shared.frames.load(Ordering::Relaxed) - frames;
        let (wall, cpu) = (begun.elapsed(), cpu_time(pid) - cpu);
        shared.stopping.store(true, Ordering::Relaxed);
        let mut latencies = Vec::new();
        for agent in agents {
            latencies.extend(agent.await.unwrap());
        }
        latencies.sort_unstable();
        let of = |count: &AtomicU64| count.load(Ordering::Relaxed);
        let (sent, frames) = match self.every {
            Some(_) => (of(&shared.sent), of(&shared.frames)),
            None => (counted, counted),
        };
        let wall = match self.every {
            Some(_) => wall + Duration::from_secs(2),
            None => wall,
        };
        Outcome {
            agents: self.agents,
            sent,
            frames,
            refused: of(&shared.refused),
            wall,
            cpu,
            latencies,
            residents_mib: residents,
        }
    }
}

#[derive(Default)]
struct Shared {
    sent: AtomicU64,
    frames: AtomicU64,
    refused: AtomicU64,
    counting: AtomicBool,
    stopping: AtomicBool,
}

struct Agent {
    address: String,
    number: u64,
    body: Body,
    every: Option<Duration>,
    offset: Duration,
    shared: Arc<Shared>,
}

impl Agent {
    /// Posts until told to stop; returns the time of each answer in microseconds.
    async fn run(self) -> Vec<u32> {
        tokio::time::sleep(self.offset).await;
        let mut stream = TcpStream::connect(&self.address).await.unwrap();
        stream.set_nodelay(true).unwrap();
        let mut template = Template::new(self.number, self.body);
        let mut latencies = Vec::new();
        let mut next = tokio::time::Instant::now();
        let mut answer = Vec::with_capacity(1024);
        while !self.shared.stopping.load(Ordering::Relaxed) {
            let last = template.next();
            let sent = Instant::now();
            self.shared.sent.fetch_add(FRAMES, Ordering::Relaxed);
            stream.write_all(&template.request).await.unwrap();
            let status = read_answer(&mut stream, &mut answer).await;
            if self.shared.counting.load(Ordering::Relaxed) {
                latencies.push(u32::try_from(sent.elapsed().as_micros()).unwrap_or(u32::MAX));
            }
            if status == 200 && durable_through(&answer) == Some(last) {
                self.shared.frames.fetch_add(FRAMES, Ordering::Relaxed);
            } else {
                self.shared.refused.fetch_add(1, Ordering::Relaxed);
            }
            if let Some(every) = self.every {
                next += every;
                tokio::time::sleep_until(next).await;
            }
        }
        latencies
    }
}

fn durable_through(body: &[u8]) -> Option<u64> {
    let answer = Acknowledgement::from_json(body).ok()?;
    answer.durable_through.into_values().next()
}

/// Reads one answer with a `content-length` and returns its status. The body stays in the buffer.
async fn read_answer(stream: &mut TcpStream, buffer: &mut Vec<u8>) -> u16 {
    buffer.clear();
    loop {
        let head = buffer.windows(4).position(|bytes| bytes == b"\r\n\r\n");
        if let Some(head) = head {
            let text = String::from_utf8_lossy(&buffer[..head]).to_ascii_lowercase();
            let status = text[9..12].parse().unwrap();
            let length = text
                .lines()
                .find_map(|line| line.strip_prefix("content-length:"))
                .map_or(0, |length| length.trim().parse().unwrap());
            buffer.drain(..head + 4);
            while buffer.len() < length {
                assert!(
                    stream.read_buf(buffer).await.unwrap() > 0,
                    "an answer was cut"
                );
            }
            return status;
        }
        assert!(stream.read_buf(buffer).await.unwrap() > 0, "no answer came");
    }
}

/// A request that is rebuilt for each batch: only numbers and times change, at fixed byte offsets in binary and
/// anywhere in JSON.
struct Template {
    batch: Batch,
    body: Body,
    next_seq: u64,
    request: Vec<u8>,
    head: String,
}

impl Template {
    fn new(number: u64, body: Body) -> Self {
        // Like a room: 20 to 30 degrees in quarters, with noise that differs from pixel to pixel.
        let mut noise = number.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1;
        let frames = (0..FRAMES).map(|_| {
            let pixels = std::array::from_fn(|_| {
                noise ^= noise << 13;
                noise ^= noise >> 7;
                noise ^= noise << 17;
                PixelWord(80 + u16::try_from(noise % 40).unwrap())
            });
            Record {
                seq: 0,
                stamp: Stamp {
                    t_boot_ns: 0,
                    t_utc_ns: 0,
                    clock: ClockState::Synced,
                },
                reading: Reading::Frame(RecordedFrame {
                    thermistor: Some(ThermistorWord(402)),
                    pixels,
                }),
            }
        });
        let batch = Batch {
            device: format!("pi-{number}"),
            boot: "5f0c1d2e".to_owned(),
            t_sent_boot_ns: Some(0),
            sensors: vec![SensorBatch {
                sensor: "i2c-1:0x69".to_owned(),
                account: None,
                frames: frames.collect(),
            }],
        };
        let kind = match body {
            Body::Json => JSON_TYPE,
            Body::Binary => BINARY_TYPE,
        };
        Self {
            batch,
            body,
            next_seq: 0,
            request: Vec::new(),
            head: format!(
                "POST /v1/frames HTTP/1.1\r\nhost: 127.0.0.1\r\ncontent-type: {kind}\r\ncontent-length: "
            ),
        }
    }

    /// Builds the next request; returns its last number.
    fn next(&mut self) -> u64 {
        let first = self.next_seq;
        for (seq, record) in (first..).zip(&mut self.batch.sensors[0].frames) {
            record.seq = seq;
            record.stamp.t_boot_ns = 1_000_000_000 + seq * 100_000_000;
            record.stamp.t_utc_ns =
                1_700_000_000_000_000_000 + i64::try_from(seq * 100_000_000).unwrap();
        }
        self.next_seq = first + FRAMES;
        self.batch.t_sent_boot_ns = Some(1_000_000_000 + self.next_seq * 100_000_000);
        let body = match self.body {
            Body::Json => self.batch.to_json(),
            Body::Binary => self.batch.to_binary(),
        };
        let body = body.expect("a valid batch");
        self.request.clear();
        self.request.extend(self.head.bytes());
        self.request
            .extend(format!("{}\r\n\r\n", body.len()).bytes());
        self.request.extend(body);
        self.next_seq - 1
    }
}

/// The process and its descendants, from `/proc`.
fn family(pid: u32) -> Vec<u32> {
    let mut family = vec![pid];
    let mut next = 0;
    while let Some(parent) = family.get(next).copied() {
        next += 1;
        let Ok(tasks) = std::fs::read_dir(format!("/proc/{parent}/task")) else {
            continue;
        };
        for task in tasks.flatten() {
            let children =
                std::fs::read_to_string(task.path().join("children")).unwrap_or_default();
            family.extend(
                children
                    .split_whitespace()
                    .filter_map(|pid| pid.parse::<u32>().ok()),
            );
        }
    }
    family
}

/// User and system time of a server, including its ended children.
fn cpu_time(pid: u32) -> Duration {
    /// `sysconf(_SC_CLK_TCK)` on every Linux.
    const TICKS_A_SECOND: u64 = 100;
    let ticks: u64 = family(pid)
        .into_iter()
        .map(|pid| {
            let stat = std::fs::read_to_string(format!("/proc/{pid}/stat")).unwrap_or_default();
            let fields = stat.rsplit_once(") ").map_or("", |(_, fields)| fields);
            let fields: Vec<u64> = fields
                .split(' ')
                .map(|field| field.parse().unwrap_or(0))
                .collect();
            // utime, stime, cutime, cstime: fields 14 to 17 of proc(5), two of which come before the bracket.
            fields.get(11..15).map_or(0, |times| times.iter().sum())
        })
        .sum();
    Duration::from_millis(1000 / TICKS_A_SECOND * ticks)
}

fn resident_mib(pid: u32) -> f64 {
    let kib: u64 = family(pid)
        .into_iter()
        .map(|pid| {
            let path = format!("/proc/{pid}/status");
            let status = std::fs::read_to_string(Path::new(&path)).unwrap_or_default();
            let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:"));
            line.map_or(0, |line| {
                line.trim().trim_end_matches(" kB").parse().unwrap_or(0)
            })
        })
        .sum();
    kib as f64 / 1024.0
}
