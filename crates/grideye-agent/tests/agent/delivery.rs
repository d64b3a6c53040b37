//! Every frame read reaches the collector once, whatever happens to posts and answers, and the account adds up.

use crate::patience::{WAIT_MAX, wait_for};
use crate::support::*;
use amg8833::Address as Target;
use grideye_agent::agent::{Agent, AgentHandle, AnyBus, Start, Summary};
use grideye_agent::bus::{OpenBus, OpenError};
use grideye_agent::config::{Body, BusConfig, SensorConfig};
use grideye_agent::log::{Level, Log};
use std::sync::atomic::Ordering;
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

const SENSORS: [SensorConfig; 1] = [SensorConfig::at(Target::High)];
const FRAMES: u64 = 450;

fn read_all(collector: &Collector, ring_frames: usize, log: Log) -> (Arc<Host>, AgentHandle) {
    let host = Host::late_by(&[]);
    let bus = Emulated::with_sensor(&host, 400_000, Counter::at_10_hz(), -43_000);
    let config = grideye_agent::config::Config {
        ring_frames,
        ..config(&collector.url)
    };
    let agent = start_with(config, &host, &bus, &SENSORS, Some(FRAMES), log);
    (host, agent)
}

/// The agent's account adds up, and matches the collector's records.
fn assert_balanced(summary: &Summary, collector: &Collector) {
    let sensor = &summary.sensors[SENSOR];
    let dropped: u64 = sensor.account.dropped.values().sum();
    assert_eq!(
        sensor.account.read,
        sensor.acknowledged + dropped + sensor.account.spooled,
        "{summary}"
    );
    let stored = u64::try_from(collector.records(SENSOR).len()).unwrap();
    assert!(stored >= sensor.acknowledged, "{stored} {summary}");
    for batch in &collector.store.lock().unwrap().batches {
        let account = batch.sensors[0].account.clone().unwrap();
        let held = u64::try_from(batch.sensors[0].frames.len()).unwrap();
        assert!(account.spooled >= held && account.read >= account.spooled);
    }
}

/// Reads everything, with a collector that first follows this script and then works.
fn deliver_through(script: &[Conduct]) -> (Collector, Summary) {
    let collector = Collector::start([script, &[Conduct::Store]].concat());
    let (_host, agent) = read_all(&collector, 10_000, Log::silent());
    assert!(agent.wait_finished(WAIT_MAX));
    let summary = agent.stop(WAIT_MAX);
    assert_balanced(&summary, &collector);
    (collector, summary)
}

#[test]
fn lost_answers_failures_and_babble_cost_nothing_and_double_nothing() {
    use Conduct::{Babble, HangUp, Status, Store, StoreAndHangUp};
    let script = [
        Store,
        StoreAndHangUp,
        Status(500),
        HangUp,
        Babble,
        StoreAndHangUp,
        Status(404),
        Status(302),
    ];
    let (collector, summary) = deliver_through(&script);
    assert!(summary.is_complete(), "{summary}");
    let records = collector.records(SENSOR);
    assert_exact(&records, |n| n);
    assert_eq!((records.len(), missing(&records)), (450, vec![]));
    // The collector's last account is the final one.
    let store = collector.store.lock().unwrap();
    let last = store.batches.last().unwrap().sensors[0]
        .account
        .clone()
        .unwrap();
    assert_eq!((last.read, last.spooled), (FRAMES, 0));
}

/// Reads everything and posts it in the compact form.
fn deliver_compactly(script: Vec<Conduct>, log: Log) -> (Collector, Summary) {
    let collector = Collector::start(script);
    let config = grideye_agent::config::Config {
        body: Body::Binary,
        ..config(&collector.url)
    };
    let host = Host::late_by(&[]);
    let bus = Emulated::with_sensor(&host, 400_000, Counter::at_10_hz(), -43_000);
    let agent = start_with(config, &host, &bus, &SENSORS, Some(FRAMES), log);
    assert!(agent.wait_finished(WAIT_MAX));
    let summary = agent.stop(WAIT_MAX);
    assert_balanced(&summary, &collector);
    assert!(summary.is_complete(), "{summary}");
    let records = collector.records(SENSOR);
    assert_exact(&records, |n| n);
    assert_eq!((records.len(), missing(&records)), (450, vec![]));
    (collector, summary)
}

#[test]
fn the_compact_body_carries_the_same_frames() {
    let (collector, _summary) = deliver_compactly(vec![Conduct::Store], Log::silent());
    let store = collector.store.lock().unwrap();
    assert!(store.compact.iter().all(|is_compact| *is_compact));
}

#[test]
fn a_collector_that_does_not_know_the_compact_body_gets_json() {
    let lines = Arc::new(Mutex::new(Vec::new()));
    let sink = Arc::clone(&lines);
    let log = Log::new(move |level, line| sink.lock().unwrap().push((level, line.to_owned())));
    let script = vec![Conduct::Status(415), Conduct::Store];
    let (collector, _summary) = deliver_compactly(script, log);
    let store = collector.store.lock().unwrap();
    assert_eq!(store.compact[..2], [true, false]);
    assert!(store.compact[1..].iter().all(|is_compact| !is_compact));
    // This is no failure, which would need a pause.
    let lines = lines.lock().unwrap();
    let failures = lines.iter().filter(|(level, _)| *level == Level::Warning);
    assert_eq!(failures.count(), 0, "{lines:?}");
}

#[test]
fn the_error_page_of_a_proxy_costs_no_frame() {
    let errors = [400, 409, 422, 413].map(Conduct::Status);
    let collector = Collector::start([&errors[..], &[Conduct::Store]].concat());
    let (_host, agent) = read_all(&collector, 10_000, Log::silent());
    assert!(agent.wait_finished(WAIT_MAX));
    let summary = agent.stop(WAIT_MAX);
    assert_balanced(&summary, &collector);
    assert!(summary.is_complete(), "{summary}");
    assert_eq!(collector.records(SENSOR).len(), 450);
}

#[test]
fn a_permanently_rejected_record_is_set_aside_and_the_rest_goes_on() {
    let collector = Collector::start(vec![Conduct::RefuseSeq(123)]);
    let (_host, agent) = read_all(&collector, 10_000, Log::silent());
    assert!(agent.wait_finished(WAIT_MAX));
    let summary = agent.stop(WAIT_MAX);
    assert_balanced(&summary, &collector);
    let account = &summary.sensors[SENSOR].account;
    assert_eq!(account.dropped.get("refused-422"), Some(&1), "{account:?}");
    let stored: Vec<u64> = collector
        .records(SENSOR)
        .iter()
        .map(|record| record.seq)
        .collect();
    assert_eq!(
        stored,
        (0..FRAMES).filter(|seq| *seq != 123).collect::<Vec<_>>()
    );
    assert!(!summary.is_complete());
    assert!(
        summary
            .to_string()
            .ends_with("450 read = 449 stored + 1 dropped + 0 lost; 0 missing"),
        "{summary}"
    );
}

#[test]
fn what_an_agent_without_a_spool_cannot_deliver_is_lost_when_it_ends() {
    let collector = Collector::start(vec![Conduct::Status(401)]);
    let (_host, agent) = read_all(&collector, 10_000, Log::silent());
    assert!(agent.wait_finished(WAIT_MAX));
    let summary = agent.stop(Duration::from_millis(100));
    assert!(!summary.is_complete());
    let ends = "450 read = 0 stored + 0 dropped + 450 lost; 0 missing";
    assert!(summary.to_string().ends_with(ends), "{summary}");
}

#[test]
fn a_post_to_a_silent_collector_times_out_and_is_retried() {
    let (collector, summary) = deliver_through(&[Conduct::Silence(2_500)]);
    assert!(summary.is_complete(), "{summary}");
    let arrivals = collector.store.lock().unwrap().arrivals.clone();
    assert!(arrivals.len() >= 2);
}

#[test]
fn a_collector_that_asks_for_a_pause_gets_it() {
    let collector = Collector::start(vec![Conduct::RetryAfter(2), Conduct::Store]);
    let (_host, agent) = read_all(&collector, 10_000, Log::silent());
    wait_for("a frame", || {
        (!collector.records(SENSOR).is_empty()).then_some(())
    });
    let arrivals = collector.store.lock().unwrap().arrivals.clone();
    assert!(arrivals[1] - arrivals[0] >= Duration::from_secs(2));
    assert!(agent.stop(WAIT_MAX).is_complete());
}

#[test]
fn a_full_ring_keeps_the_newest_frames_and_counts_the_others() {
    let collector = Collector::start(vec![Conduct::HangUp]);
    let lines = Arc::new(Mutex::new(Vec::new()));
    let sink = Arc::clone(&lines);
    let log = Log::new(move |level, line| sink.lock().unwrap().push((level, line.to_owned())));
    let (_host, agent) = read_all(&collector, 100, log);
    assert!(agent.wait_finished(WAIT_MAX));
    let summary = agent.stop(Duration::from_millis(300));
    let account = &summary.sensors[SENSOR].account;
    assert_eq!((account.read, account.spooled), (FRAMES, 100));
    assert_eq!(account.dropped.get("ring-full"), Some(&350));
    assert_balanced(&summary, &collector);
    let lines = lines.lock().unwrap();
    assert!(
        lines
            .iter()
            .any(|(level, line)| *level == Level::Error && line.contains("the ring is full")),
        "{lines:?}"
    );
    assert!(
        lines
            .iter()
            .any(|(level, line)| *level == Level::Warning && line.starts_with("delivery to ")),
        "{lines:?}"
    );
}

#[test]
fn batches_are_bounded_a_backlog_is_sent_without_pauses_and_the_connection_is_kept() {
    let collector = Collector::storing();
    let (_host, agent) = read_all(&collector, 10_000, Log::silent());
    assert!(agent.wait_finished(WAIT_MAX));
    assert!(agent.stop(WAIT_MAX).is_complete());
    let store = collector.store.lock().unwrap();
    assert!(
        store
            .batches
            .iter()
            .all(|batch| batch.sensors[0].frames.len()
                <= grideye_agent::deliver::BACKLOG_RECORDS_MAX)
    );
    assert!(
        store
            .batches
            .iter()
            .all(|batch| batch.t_sent_boot_ns.is_some() && batch.device == "pi-1")
    );
    assert_eq!(collector.connections.load(Ordering::SeqCst), 1);
}

#[test]
fn an_agent_without_a_collector_ends_in_time_with_everything_counted() {
    let collector = Collector::storing();
    let host = Host::late_by(&[]);
    let bus = Emulated::with_sensor(&host, 400_000, Counter::at_10_hz(), 0);
    // Nothing listens on port 9 of the loopback address.
    let agent = start_with(
        config("http://127.0.0.1:9"),
        &host,
        &bus,
        &SENSORS,
        Some(50),
        Log::silent(),
    );
    assert!(agent.wait_finished(WAIT_MAX));
    let stopping = Instant::now();
    let summary = agent.stop(Duration::from_millis(500));
    // Without a limit it would never stop trying.
    assert!(stopping.elapsed() < Duration::from_secs(60));
    assert_eq!(summary.sensors[SENSOR].account.spooled, 50);
    assert_balanced(&summary, &collector);
}

#[test]
fn a_post_that_hangs_does_not_hold_up_the_stop() {
    let silence = Duration::from_secs(20);
    let collector = Collector::start(vec![Conduct::Silence(20_000)]);
    let host = Host::late_by(&[]);
    let bus = Emulated::with_sensor(&host, 400_000, Counter::at_10_hz(), 0);
    let config = grideye_agent::config::Config {
        request_timeout: Duration::from_secs(120),
        ..config(&collector.url)
    };
    let agent = start_with(config, &host, &bus, &SENSORS, Some(50), Log::silent());
    assert!(agent.wait_finished(WAIT_MAX));
    // The store is locked while the collector is silent, so use the connection count to see that the post began.
    let connections = || collector.connections.load(Ordering::SeqCst);
    wait_for("the post", || (connections() == 1).then_some(()));
    let stopping = Instant::now();
    let summary = agent.stop(Duration::from_millis(500));
    assert!(stopping.elapsed() < silence);
    assert_eq!(summary.sensors[SENSOR].account.spooled, 50);
    assert!(!summary.is_complete());
}

#[test]
fn each_failure_is_logged_once_with_the_collectors_address() {
    use Conduct::{Status, Store};
    let collector = Collector::start(vec![Status(404), Status(404), Status(503), Store]);
    let lines = Arc::new(Mutex::new(Vec::new()));
    let sink = Arc::clone(&lines);
    let log = Log::new(move |level, line| sink.lock().unwrap().push((level, line.to_owned())));
    let (_host, agent) = read_all(&collector, 10_000, log);
    assert!(agent.wait_finished(WAIT_MAX));
    assert!(agent.stop(WAIT_MAX).is_complete());
    let failures: Vec<String> = lines
        .lock()
        .unwrap()
        .iter()
        .filter(|(level, _)| *level == Level::Warning)
        .map(|(_, line)| line.clone())
        .collect();
    assert_eq!(failures.len(), 2, "{failures:?}");
    for (line, status) in failures.iter().zip(["status 404", "status 503"]) {
        assert!(
            line.starts_with(&format!("delivery to {} failed", collector.url)),
            "{line}"
        );
        assert!(line.contains(status), "{line}");
    }
}

/// A bus that is first missing, then forbidden, and finally opens.
struct LateBus {
    attempts: usize,
    bus: Emulated,
}

impl OpenBus for LateBus {
    type Bus = Emulated;

    fn open(&mut self) -> Result<Emulated, OpenError> {
        let path = "/dev/i2c-1".to_owned();
        self.attempts += 1;
        match self.attempts {
            1..=3 => Err(OpenError::NoSuchBus(path)),
            4..=6 => Err(OpenError::PermissionDenied(path)),
            _ => Ok(self.bus.clone()),
        }
    }

    fn name(&self) -> String {
        "/dev/i2c-1".to_owned()
    }
}

#[test]
fn the_log_names_the_bus_each_reason_why_it_does_not_open_and_what_to_do() {
    let collector = Collector::storing();
    let host = Host::late_by(&[]);
    let bus = Emulated::with_sensor(&host, 400_000, Counter::at_10_hz(), 0);
    let lines = Arc::new(Mutex::new(Vec::new()));
    let sink = Arc::clone(&lines);
    let log = Log::new(move |level, line| sink.lock().unwrap().push((level, line.to_owned())));
    let start = Start {
        frames_limit: Some(10),
        ..Start::new(config(&collector.url), "host")
    };
    let bus_config = BusConfig {
        path: "/dev/i2c-1".into(),
        sensors: SENSORS.to_vec(),
    };
    let buses = vec![(bus_config, AnyBus::new(LateBus { attempts: 0, bus }))];
    let agent = Agent::start(start, buses, host, log).unwrap();
    assert!(agent.wait_finished(WAIT_MAX));
    let _ = agent.stop(Duration::from_secs(5));
    let lines = lines.lock().unwrap();
    let said = |wanted: Level, beginning: &str| {
        let hits = lines
            .iter()
            .filter(|(level, line)| *level == wanted && line.starts_with(beginning));
        hits.count()
    };
    assert_eq!(said(Level::Error, "/dev/i2c-1: no such bus\nhint: "), 1);
    assert_eq!(
        said(Level::Error, "/dev/i2c-1: permission denied\nhint: "),
        1
    );
    assert_eq!(said(Level::Info, "/dev/i2c-1: opened"), 1);
    assert_eq!(
        said(
            Level::Error,
            "i2c-1:0x69: no frame comes: unplugged\nhint: "
        ),
        1,
        "{lines:?}"
    );
}

/// A bus with transfers that end only with the test.
struct Hung(std::sync::mpsc::Receiver<()>);

impl embedded_hal::i2c::ErrorType for Hung {
    type Error = embedded_hal::i2c::ErrorKind;
}

impl embedded_hal::i2c::I2c for Hung {
    fn transaction(
        &mut self,
        _: u8,
        _: &mut [embedded_hal::i2c::Operation<'_>],
    ) -> Result<(), Self::Error> {
        let _ = self.0.recv();
        Err(embedded_hal::i2c::ErrorKind::Bus)
    }
}

struct HungBus(Option<std::sync::mpsc::Receiver<()>>);

impl OpenBus for HungBus {
    type Bus = Hung;

    fn open(&mut self) -> Result<Hung, OpenError> {
        self.0
            .take()
            .map(Hung)
            .ok_or(OpenError::NoSuchBus("/dev/i2c-3".to_owned()))
    }
}

#[test]
fn a_bus_that_hangs_keeps_neither_the_other_bus_nor_the_uploads() {
    let collector = Collector::storing();
    let host = Host::late_by(&[]);
    let bus = Emulated::with_sensor(&host, 400_000, Counter::at_10_hz(), 0);
    let (release, hung) = std::sync::mpsc::channel();
    let sensors = SENSORS.to_vec();
    let bus_config = |path: &str| BusConfig {
        path: path.into(),
        sensors: sensors.clone(),
    };
    let buses = vec![
        (bus_config("/dev/i2c-3"), AnyBus::new(HungBus(Some(hung)))),
        (bus_config("/dev/i2c-1"), AnyBus::new(bus)),
    ];
    let start = Start {
        frames_limit: Some(200),
        ..Start::new(config(&collector.url), "host")
    };
    let agent = Agent::start(start, buses, host, Log::silent()).unwrap();
    wait_for("the frames of the other bus", || {
        (collector.records(SENSOR).len() == 200).then_some(())
    });
    assert!(!agent.is_finished());
    let summary = agent.stop(Duration::from_secs(5));
    assert_eq!(summary.hung_buses, ["/dev/i2c-3"]);
    assert!(!summary.is_complete());
    drop(release);
}

#[test]
fn an_idle_agent_still_posts_its_account() {
    let collector = Collector::storing();
    let host = Host::late_by(&[]);
    let bus = Emulated::with_sensor(&host, 400_000, Counter::at_10_hz(), 0);
    let agent = start(&collector, &host, &bus, &SENSORS, 0);
    let posts = || collector.store.lock().unwrap().bodies;
    wait_for("the first account", || (posts() > 0).then_some(()));
    std::thread::sleep(Duration::from_millis(500));
    assert_eq!(
        posts(),
        1,
        "one account at the start, the next after {:?}",
        grideye_agent::deliver::HEARTBEAT_EVERY
    );
    assert!(agent.stop(Duration::from_secs(5)).is_complete());
    let store = collector.store.lock().unwrap();
    let account = store.batches[0].sensors[0].account.clone().unwrap();
    assert_eq!(
        (store.batches[0].sensors[0].frames.len(), account.read),
        (0, 0)
    );
}
