//! A backlog that the collector forbids: it stays visible on the disk and blocks nothing else.

use crate::model_disk::ModelDisk;
use crate::spool::record;
use grideye_agent::config::SpoolMode;
use grideye_agent::deliver::Spooler;
use grideye_agent::deliver::{BACKLOG_FORBIDDEN, HELD_FOR, Pace, Post, Posted, Scheduler};
use grideye_agent::log::{Level, Log};
use grideye_agent::queue::Ring;
use grideye_agent::queue::Shared;
use grideye_agent::spool::{Limits, Spool};
use grideye_recording::wire::{Acknowledgement, Batch};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex};
use std::time::Duration;

const SENSOR: &str = "i2c-1:0x69";
const AFTER: Duration = Duration::from_secs(1);

/// A collector that forbids one device until told otherwise.
#[derive(Debug, Default)]
struct Collector {
    forbids: Option<&'static str>,
    /// Device and number of each stored record, and how often a post was forbidden.
    came: Vec<(String, u64)>,
    forbidden: u64,
}

#[derive(Debug, Clone, Default)]
struct Line(Arc<Mutex<Collector>>);

impl Post for Line {
    fn post(&mut self, batch: &Batch, _: Duration) -> Posted {
        let mut collector = self.0.lock().unwrap();
        if collector.forbids == Some(batch.device.as_str()) {
            collector.forbidden += 1;
            return Posted::Forbidden(403, "the token is not for this device".to_owned());
        }
        let mut answer = Acknowledgement::default();
        for part in &batch.sensors {
            for frame in &part.frames {
                assert_eq!(*frame, record(frame.seq), "bytes as read");
                collector.came.push((batch.device.clone(), frame.seq));
            }
            let of_device = collector.came.iter().filter(|came| came.0 == batch.device);
            if let Some(through) = of_device.map(|came| came.1).max() {
                answer.durable_through.insert(part.sensor.clone(), through);
            }
        }
        Posted::Durable(answer)
    }
}

/// An agent in virtual time, with this device and boot.
struct Agent {
    ns: Arc<AtomicU64>,
    shared: Arc<Shared>,
    spooler: Spooler,
    scheduler: Scheduler<Line>,
    lines: Arc<Mutex<Vec<(Level, String)>>>,
}

impl Agent {
    fn start(disk: &ModelDisk, line: &Line, device: &str, boot: &str) -> Self {
        let ns: Arc<AtomicU64> = Arc::default();
        let sensors = vec![SENSOR.to_owned()];
        let ring = Ring::new(10_000, device, boot, sensors.clone());
        let limits = Limits::new(1 << 20, 0);
        let mut spool =
            Spool::open(Box::new(disk.clone()), limits, device, boot, &sensors).unwrap();
        while spool.recover() {}
        let shared = Arc::new(Shared::new(ring, Some(spool)));
        let pace = Pace {
            collector: "http://test".to_owned(),
            boot: boot.to_owned(),
            post_every: Duration::from_millis(500),
            request_timeout: Duration::from_secs(10),
            backlog_per_s: 1000,
            seed: 1,
        };
        let lines: Arc<Mutex<Vec<(Level, String)>>> = Arc::default();
        let (timed, written) = (Arc::clone(&ns), Arc::clone(&lines));
        let now = move || {
            let ns = timed.load(Ordering::SeqCst);
            (Duration::from_nanos(ns), ns)
        };
        let log = Log::new(move |level, line| written.lock().unwrap().push((level, line.into())));
        let mode = SpoolMode::Outage { after: AFTER };
        Self {
            spooler: Spooler::new(Arc::clone(&shared), mode, Log::silent()),
            scheduler: Scheduler::new(line.clone(), pace, Arc::clone(&shared), Box::new(now), log),
            ns,
            shared,
            lines,
        }
    }

    /// Reads these frames, one per 100 ms, and delivers what it may.
    fn run(&mut self, seqs: std::ops::Range<u64>) {
        for seq in seqs {
            let ns = self.ns.fetch_add(100_000_000, Ordering::SeqCst);
            let now = Duration::from_nanos(ns);
            self.shared.with_ring(|ring| ring.push(0, record(seq), now));
            self.spooler.step(now);
            self.scheduler.step();
        }
    }

    /// Time passes without a frame.
    fn wait(&mut self, time: Duration) {
        for _ in 0..time.as_secs() * 2 {
            let ns = self.ns.fetch_add(500_000_000, Ordering::SeqCst);
            self.spooler.step(Duration::from_nanos(ns));
            self.scheduler.step();
        }
    }

    fn errors(&self) -> Option<u64> {
        let accounts = self.shared.with_ring(|ring| ring.accounts());
        accounts[SENSOR].errors.get(BACKLOG_FORBIDDEN).copied()
    }

    fn said(&self, level: Level) -> Vec<String> {
        let lines = self.lines.lock().unwrap();
        let of_level = lines.iter().filter(|line| line.0 == level);
        of_level.map(|line| line.1.clone()).collect()
    }
}

/// The disk of an agent once named `old`, with 100 records.
fn a_disk_of_the_old_name(line: &Line) -> ModelDisk {
    let disk = ModelDisk::default();
    line.0.lock().unwrap().forbids = Some("old");
    let mut agent = Agent::start(&disk, line, "old", "b1");
    agent.run(0..100);
    agent.spooler.finish(Duration::from_secs(20));
    disk
}

fn numbers(line: &Line, device: &str) -> Vec<u64> {
    let collector = line.0.lock().unwrap();
    let of_device = collector.came.iter().filter(|came| came.0 == device);
    of_device.map(|came| came.1).collect()
}

#[test]
fn a_forbidden_backlog_is_held_and_reported_and_all_else_goes_on() {
    let line = Line::default();
    let disk = a_disk_of_the_old_name(&line);
    let before = line.0.lock().unwrap().forbidden;
    let mut agent = Agent::start(&disk, &line, "pi", "b2");
    agent.run(0..200);
    // Its own frames continue.
    agent.wait(Duration::from_secs(5));
    assert_eq!(numbers(&line, "pi"), (0..200).collect::<Vec<_>>());
    assert_eq!(numbers(&line, "old"), Vec::<u64>::new());
    // One attempt, reported in the account and the log.
    assert_eq!(line.0.lock().unwrap().forbidden, before + 1);
    assert_eq!(agent.errors(), Some(1));
    let said = agent.said(Level::Error);
    assert_eq!(said.len(), 1, "{said:?}");
    assert!(
        said[0].starts_with("the collector forbids it, status 403: the token is not for this device; 90 frames of device old, boot b1, stay in the spool and are retried every 10 min; all others continue\nhint: "),
        "{said:?}"
    );
    // It is retried, and the log does not repeat itself.
    agent.wait(2 * HELD_FOR);
    let attempts = line.0.lock().unwrap().forbidden - before;
    assert!((2..=3).contains(&attempts), "{attempts}");
    assert_eq!(agent.errors(), Some(attempts));
    assert_eq!(agent.said(Level::Error).len(), 1);
    // Forbidden records are on the disk, for a later start too.
    assert_eq!(
        agent.shared.spool().as_ref().unwrap().waiting_frames(),
        (0, 90)
    );

    line.0.lock().unwrap().forbids = None;
    agent.wait(HELD_FOR);
    assert_eq!(numbers(&line, "old"), (0..100).collect::<Vec<_>>());
    assert_eq!(
        agent.said(Level::Info),
        ["the rest of boot b1 is being delivered again"]
    );
    assert_eq!(disk.names(), ["state"]);
}

#[test]
fn a_forbidden_boot_without_records_is_retried_no_more_often_than_one_with_many() {
    let line = Line::default();
    let disk = ModelDisk::default();
    drop(Agent::start(&disk, &line, "old", "b1"));
    line.0.lock().unwrap().forbids = Some("old");
    let mut agent = Agent::start(&disk, &line, "pi", "b2");
    agent.run(0..100);
    agent.wait(Duration::from_secs(2));
    assert_eq!(line.0.lock().unwrap().forbidden, 1);
    assert_eq!(numbers(&line, "pi"), (0..100).collect::<Vec<_>>());
}

#[test]
fn a_useless_token_is_an_ordinary_failure_and_holds_nothing() {
    let line = Line::default();
    line.0.lock().unwrap().forbids = Some("pi");
    let disk = ModelDisk::default();
    let mut agent = Agent::start(&disk, &line, "pi", "b1");
    agent.run(0..300);
    assert_eq!(agent.errors(), None);
    assert!(agent.scheduler.failures() > 0);
    let said = agent.said(Level::Warning);
    assert!(
        said.len() == 1
            && said[0].contains("records wait: the collector forbids it, status 403")
            && said[0].contains("\nhint: print a line with `grideye enroll pi` on the collector's"),
        "{said:?}"
    );
    line.0.lock().unwrap().forbids = None;
    agent.wait(Duration::from_secs(70));
    // All were on the disk by then.
    let said = agent.said(Level::Info);
    let frames = (0..300).filter(|seq| record(*seq).reading.frame().is_some());
    let frames = frames.count();
    let again =
        format!("delivering again; 0 records wait in memory and {frames} frames on the disk");
    assert_eq!(said, [again]);
    let mut came = numbers(&line, "pi");
    came.sort_unstable();
    assert_eq!(came, (0..300).collect::<Vec<_>>());
}
