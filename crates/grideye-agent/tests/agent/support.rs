//! An emulated bus under a host that is late, and a collector that does as it is told.

use amg8833_emulator::{Address, Bus, BusError, Clock as _, FrameSource, ManualClock, Options};
use embedded_hal::i2c::{Error as _, ErrorType, I2c, Operation};
use grideye_agent::agent::{Agent, AgentHandle, AnyBus, Start};
use grideye_agent::bus::{OpenBus, OpenError, by_kind};
use grideye_agent::clock::Clock;
use grideye_agent::config::{BusConfig, Config, SensorConfig};
use grideye_agent::log::Log;
use grideye_frame::{Celsius, Frame, NoData, PIXELS, RawFrame, Reading};
use grideye_recording::wire::{Acknowledgement, Batch, Gap, Limits};
use grideye_recording::{ClockState, Record};
use std::collections::{BTreeMap, VecDeque};
use std::io::{BufRead as _, BufReader, Read as _, Write as _};
use std::net::{TcpListener, TcpStream};
use std::num::NonZeroU32;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

pub(crate) const MS: Duration = Duration::from_millis(1);

// ---- time --------------------------------------------------------------------------------------------------------

/// A host whose time moves only while it sleeps or its bus is busy, and that wakes up late, by turns.
#[derive(Debug, Default)]
pub(crate) struct Host {
    pub(crate) time: Arc<ManualClock>,
    pub(crate) delays: Vec<Duration>,
    turn: AtomicUsize,
}

impl Host {
    pub(crate) fn late_by(delays: &[Duration]) -> Arc<Self> {
        Arc::new(Self {
            delays: delays.to_vec(),
            ..Self::default()
        })
    }
}

impl Clock for Host {
    fn boot(&self) -> Duration {
        self.time.now()
    }

    fn utc(&self) -> (i64, ClockState) {
        let boot_ns = i64::try_from(self.time.now().as_nanos()).unwrap();
        (1_700_000_000_000_000_000 + boot_ns, ClockState::Synced)
    }

    fn sleep_until(&self, boot: Duration) {
        if boot > self.time.now() {
            let turn = self.turn.fetch_add(1, Ordering::SeqCst);
            let late = if self.delays.is_empty() {
                Duration::ZERO
            } else {
                self.delays[turn % self.delays.len()]
            };
            self.time.set(boot + late);
        }
    }
}

// ---- sensor ------------------------------------------------------------------------------------------------------

/// Shows a number in every frame, spread over all pixels and the thermistor, so that a torn frame shows as well.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Counter {
    ticks: u64,
    ticks_per_frame: u64,
    content: fn(u64) -> u64,
    starts_anew: bool,
}

impl Counter {
    /// A number for each frame at 10 Hz; a reset begins again with 0.
    pub(crate) fn at_10_hz() -> Self {
        Self {
            ticks: 0,
            ticks_per_frame: 1,
            content: |n| n,
            starts_anew: true,
        }
    }

    /// A number for each frame at 1 Hz, which is a mean of ten.
    pub(crate) fn at_1_hz() -> Self {
        Self {
            ticks_per_frame: 10,
            ..Self::at_10_hz()
        }
    }

    /// Shows `content(n)` in frame `n`.
    pub(crate) fn showing(self, content: fn(u64) -> u64) -> Self {
        Self { content, ..self }
    }

    /// Never shows a number again, whatever happens to the sensor.
    pub(crate) fn never_again(self) -> Self {
        Self {
            starts_anew: false,
            ..self
        }
    }
}

impl FrameSource for Counter {
    fn frame_at(&mut self, _: Duration) -> Frame {
        let n = self.ticks / self.ticks_per_frame;
        self.ticks += 1;
        picture((self.content)(n))
    }

    fn measuring_from(&mut self, _: Duration) {
        if self.starts_anew {
            self.ticks = 0;
        }
    }
}

/// Steps of a quarter degree above 20 °C, as the datasheet's pixels have them.
const STEPS: u64 = 400;

pub(crate) fn picture(n: u64) -> Frame {
    let celsius = |steps: u64, size: f32| {
        Celsius::new(20.0 + f32::from(u16::try_from(steps % STEPS).unwrap()) * size)
    };
    let mut frame = Frame::uniform(celsius(n, 0.0625));
    for (index, pixel) in (0..).zip(&mut frame.pixels) {
        *pixel = celsius(7 * n + index, 0.25);
    }
    frame.pixels[0] = celsius(n, 0.25);
    frame.pixels[PIXELS - 1] = celsius(n / STEPS, 0.25);
    frame
}

/// The number that a frame shows. Panics if it is torn.
pub(crate) fn number(raw: &RawFrame) -> u64 {
    let n = number_in_pixels(raw);
    assert_eq!(
        amg8833::word::frame(raw).thermistor,
        picture(n).thermistor,
        "torn frame {n}"
    );
    n
}

/// The number that the pixels show. Panics if they are torn. The thermistor is a transfer of its own, and may be of
/// the next frame if the host came so late that the next update fell between the two.
pub(crate) fn number_in_pixels(raw: &RawFrame) -> u64 {
    let frame = amg8833::word::frame(raw);
    let steps = |pixel: Celsius| {
        let quarters = (pixel.get() - 20.0) * 4.0;
        (0..STEPS)
            .find(|steps| f32::from(u16::try_from(*steps).unwrap()) == quarters)
            .expect("a number")
    };
    let n = steps(frame.pixels[0]) + STEPS * steps(frame.pixels[PIXELS - 1]);
    assert_eq!(frame.pixels, picture(n).pixels, "torn frame {n}");
    n
}

// ---- bus ---------------------------------------------------------------------------------------------------------

pub(crate) type TestBus = Bus<Arc<ManualClock>, Counter>;
type Meddle = Box<dyn FnOnce(&mut TestBus) + Send>;

/// An emulated bus that a script breaks and mends at moments of its own time.
#[derive(Clone)]
pub(crate) struct Emulated {
    bus: Arc<Mutex<TestBus>>,
    script: Arc<Mutex<VecDeque<(Duration, Meddle)>>>,
    host: Arc<Host>,
    scl_hz: NonZeroU32,
}

impl Emulated {
    pub(crate) fn new(
        host: &Arc<Host>,
        scl_hz: u32,
        sensors: &[(Address, Counter, Options)],
    ) -> Self {
        let scl_hz = NonZeroU32::new(scl_hz).unwrap();
        let mut bus = Bus::new(Arc::clone(&host.time)).with_scl_hz(scl_hz);
        for (address, source, options) in sensors {
            bus.plug(*address, *source, *options);
        }
        Self {
            bus: Arc::new(Mutex::new(bus)),
            script: Arc::default(),
            host: Arc::clone(host),
            scl_hz,
        }
    }

    /// A sensor at 0x69 whose clock is off by this much.
    pub(crate) fn with_sensor(
        host: &Arc<Host>,
        scl_hz: u32,
        source: Counter,
        clock_error_ppm: i32,
    ) -> Self {
        let options = Options {
            clock_error_ppm,
            ..Options::default()
        };
        Self::new(host, scl_hz, &[(Address::High, source, options)])
    }

    /// Does this to the bus before the first transfer at or after `at`.
    pub(crate) fn at(
        self,
        at: Duration,
        meddle: impl FnOnce(&mut TestBus) + Send + 'static,
    ) -> Self {
        self.script
            .lock()
            .unwrap()
            .push_back((at, Box::new(meddle)));
        self
    }

    pub(crate) fn with<T>(&self, look: impl FnOnce(&mut TestBus) -> T) -> T {
        look(&mut self.bus.lock().unwrap())
    }
}

impl ErrorType for Emulated {
    type Error = BusError;
}

impl I2c for Emulated {
    fn transaction(
        &mut self,
        address: u8,
        operations: &mut [Operation<'_>],
    ) -> Result<(), BusError> {
        let mut bus = self.bus.lock().unwrap();
        let mut script = self.script.lock().unwrap();
        // One before each transfer, so that none mends what the one before broke without anybody having seen it.
        if script
            .front()
            .is_some_and(|(at, _)| *at <= self.host.boot())
        {
            let (_, meddle) = script.pop_front().unwrap();
            meddle(&mut bus);
        }
        bus.transaction(address, operations)
    }
}

impl OpenBus for Emulated {
    type Bus = Self;

    fn open(&mut self) -> Result<Self, OpenError> {
        Ok(self.clone())
    }

    /// As uncertain as the device tree of a Raspberry Pi.
    fn scl_hz_max(&self) -> Option<NonZeroU32> {
        Some(self.scl_hz.saturating_mul(NonZeroU32::new(2).unwrap()))
    }

    fn classify(&self, error: &BusError) -> NoData {
        match error {
            BusError::Timeout => NoData::BusTimeout,
            BusError::Gone => NoData::Unplugged,
            other => by_kind(other.kind()),
        }
    }
}

// ---- collector ---------------------------------------------------------------------------------------------------

/// What the collector does with one post.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Conduct {
    /// Stores and acknowledges.
    Store,
    /// Stores, and closes the connection without an answer.
    StoreAndHangUp,
    /// Closes the connection without storing.
    HangUp,
    /// Answers with this status and stores nothing.
    Status(u16),
    /// Answers 503 and asks for this pause, in seconds.
    RetryAfter(u64),
    /// Says nothing for this many milliseconds, and then hangs up.
    Silence(u64),
    /// Refuses any batch with this number in it (422), and stores others.
    RefuseSeq(u64),
    /// Answers 200 with something that is no acknowledgement.
    Babble,
}

#[derive(Debug, Default)]
pub(crate) struct Store {
    pub(crate) frames: BTreeMap<String, BTreeMap<u64, Record>>,
    pub(crate) batches: Vec<Batch>,
    pub(crate) bodies: usize,
    pub(crate) arrivals: Vec<Instant>,
}

/// A collector on a loopback port: does what the script says, the last entry for ever.
pub(crate) struct Collector {
    pub(crate) url: String,
    pub(crate) store: Arc<Mutex<Store>>,
    pub(crate) connections: Arc<AtomicUsize>,
    stopping: Arc<AtomicBool>,
}

impl Collector {
    pub(crate) fn start(script: Vec<Conduct>) -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let collector = Self {
            url: format!("http://{}", listener.local_addr().unwrap()),
            store: Arc::default(),
            connections: Arc::default(),
            stopping: Arc::default(),
        };
        let (store, connections, stopping) = (
            Arc::clone(&collector.store),
            Arc::clone(&collector.connections),
            Arc::clone(&collector.stopping),
        );
        let script = Arc::new(Mutex::new(VecDeque::from(script)));
        std::thread::spawn(move || {
            for stream in listener.incoming() {
                if stopping.load(Ordering::SeqCst) {
                    return;
                }
                connections.fetch_add(1, Ordering::SeqCst);
                let (store, script) = (Arc::clone(&store), Arc::clone(&script));
                std::thread::spawn(move || serve(&stream.unwrap(), &store, &script));
            }
        });
        collector
    }

    pub(crate) fn storing() -> Self {
        Self::start(vec![Conduct::Store])
    }

    pub(crate) fn records(&self, sensor: &str) -> Vec<Record> {
        let store = self.store.lock().unwrap();
        store
            .frames
            .get(sensor)
            .map(|frames| frames.values().copied().collect())
            .unwrap_or_default()
    }
}

impl Drop for Collector {
    fn drop(&mut self) {
        self.stopping.store(true, Ordering::SeqCst);
        let _ = TcpStream::connect(self.url.trim_start_matches("http://"));
    }
}

fn serve(stream: &TcpStream, store: &Mutex<Store>, script: &Mutex<VecDeque<Conduct>>) {
    let mut reader = BufReader::new(stream);
    while let Some(body) = read_post(&mut reader) {
        let conduct = {
            let mut script = script.lock().unwrap();
            if script.len() > 1 {
                script.pop_front().unwrap()
            } else {
                script[0]
            }
        };
        let batch = Batch::from_json(&body, &Limits::default()).expect("a valid batch");
        let Some(answer) = act(conduct, batch, &mut store.lock().unwrap()) else {
            return;
        };
        if (&*stream).write_all(&answer).is_err() {
            return;
        }
    }
}

/// What to answer; `None` to hang up.
fn act(conduct: Conduct, batch: Batch, store: &mut Store) -> Option<Vec<u8>> {
    store.bodies += 1;
    store.arrivals.push(Instant::now());
    let holds = |seq| {
        batch
            .sensors
            .iter()
            .flat_map(|sensor| &sensor.frames)
            .any(|record| record.seq == seq)
    };
    match conduct {
        Conduct::RefuseSeq(seq) if holds(seq) => {
            Some(response("422 Unprocessable", "", b"{\"error\":\"no\"}"))
        }
        Conduct::Store | Conduct::RefuseSeq(_) => Some(response("200 OK", "", &keep(batch, store))),
        Conduct::StoreAndHangUp => {
            keep(batch, store);
            None
        }
        Conduct::HangUp => None,
        Conduct::Status(status) => Some(response(&format!("{status} No"), "", b"no\n")),
        Conduct::RetryAfter(seconds) => Some(response(
            "503 Busy",
            &format!("retry-after: {seconds}\r\n"),
            b"",
        )),
        Conduct::Silence(milliseconds) => {
            std::thread::sleep(Duration::from_millis(milliseconds));
            None
        }
        Conduct::Babble => Some(response("200 OK", "", b"<html>welcome</html>")),
    }
}

fn response(status: &str, headers: &str, body: &[u8]) -> Vec<u8> {
    let head = format!(
        "HTTP/1.1 {status}\r\n{headers}content-length: {}\r\n\r\n",
        body.len()
    );
    [head.as_bytes(), body].concat()
}

/// Keeps every record once, and refuses to have one of them changed.
fn keep(batch: Batch, store: &mut Store) -> Vec<u8> {
    let mut answer = Acknowledgement::default();
    for sensor in &batch.sensors {
        let stored = store.frames.entry(sensor.sensor.clone()).or_default();
        for record in &sensor.frames {
            let before = stored.insert(record.seq, *record);
            assert!(
                before.is_none_or(|before| before == *record),
                "record {} changed",
                record.seq
            );
        }
        if let Some((last, _)) = stored.last_key_value() {
            answer.durable_through.insert(sensor.sensor.clone(), *last);
            let gaps = (0..*last).filter(|seq| !stored.contains_key(seq));
            answer.gaps.extend(gaps.map(|seq| Gap {
                sensor: sensor.sensor.clone(),
                from: seq,
                to: seq,
            }));
        }
    }
    store.batches.push(batch);
    answer.to_json().unwrap()
}

fn read_post(reader: &mut BufReader<&TcpStream>) -> Option<Vec<u8>> {
    let mut length = None;
    loop {
        let mut line = String::new();
        if reader.read_line(&mut line).ok()? == 0 {
            return None;
        }
        let line = line.trim_end().to_ascii_lowercase();
        if line.is_empty() {
            break;
        }
        if let Some(value) = line.strip_prefix("content-length:") {
            length = value.trim().parse().ok();
        }
    }
    let mut body = vec![0; length?];
    reader.read_exact(&mut body).ok()?;
    Some(body)
}

// ---- agent -------------------------------------------------------------------------------------------------------

pub(crate) const SENSOR: &str = "i2c-1:0x69";

pub(crate) fn config(collector: &str) -> Config {
    let text = format!(
        "device = \"pi-1\"\ncollector = \"{collector}\"\npost_every_ms = 50\nring_frames = 100000\n\
         request_timeout_ms = 2000\n[[bus]]\npath = \"/dev/i2c-1\"\n[[bus.sensor]]\naddress = 0x69\n"
    );
    Config::parse(&text, "test").unwrap()
}

pub(crate) fn start(
    collector: &Collector,
    host: &Arc<Host>,
    bus: &Emulated,
    sensors: &[SensorConfig],
    frames: u64,
) -> AgentHandle {
    let config = config(&collector.url);
    start_with(config, host, bus, sensors, Some(frames), Log::silent())
}

pub(crate) fn start_with(
    config: Config,
    host: &Arc<Host>,
    bus: &Emulated,
    sensors: &[SensorConfig],
    frames_limit: Option<u64>,
    log: Log,
) -> AgentHandle {
    let start = Start {
        frames_limit,
        ..Start::new(config, "host")
    };
    let bus_config = BusConfig {
        path: "/dev/i2c-1".into(),
        sensors: sensors.to_vec(),
    };
    Agent::start(
        start,
        vec![(bus_config, AnyBus::new(bus.clone()))],
        Arc::<Host>::clone(host),
        log,
    )
    .unwrap()
}

/// Runs until every sensor has given so many frames, and delivers them.
pub(crate) fn run(
    collector: &Collector,
    host: &Arc<Host>,
    bus: &Emulated,
    sensors: &[SensorConfig],
    frames: u64,
) -> grideye_agent::agent::Summary {
    let agent = start(collector, host, bus, sensors, frames);
    assert!(
        agent.wait_finished(Duration::from_secs(120)),
        "{:?}",
        agent.accounts()
    );
    agent.stop(Duration::from_secs(30))
}

pub(crate) fn missing(records: &[Record]) -> Vec<(u64, NoData)> {
    let missing = records.iter().filter_map(|record| match record.reading {
        Reading::NoData(reason) => Some((record.seq, reason)),
        Reading::Frame(_) => None,
    });
    missing.collect()
}

/// Checks that `seq` runs without a gap and that each frame shows the number that belongs to it.
pub(crate) fn assert_exact(records: &[Record], content: fn(u64) -> u64) {
    assert_exact_by(records, content, number);
}

pub(crate) fn assert_exact_by(
    records: &[Record],
    content: fn(u64) -> u64,
    number: fn(&RawFrame) -> u64,
) {
    for (expected, record) in (0..).zip(records) {
        assert_eq!(record.seq, expected);
        if let Some(frame) = record.reading.frame() {
            assert_eq!(number(frame), content(expected), "frame {expected}");
        }
    }
}
