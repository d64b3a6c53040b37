//! An emulated bus under a host that is late, and a scripted collector.

mod collector;

pub(crate) use collector::{Collector, Conduct};

use crate::patience::WAIT_MAX;
use amg8833_emulator::{Address, Bus, BusError, Clock as _, FrameSource, ManualClock, Options};
use embedded_hal::i2c::{Error as _, ErrorType, I2c, Operation};
use grideye_agent::agent::{Agent, AgentHandle, AnyBus, Start};
use grideye_agent::bus::{OpenBus, OpenError, by_kind};
use grideye_agent::clock::Clock;
use grideye_agent::config::{BusConfig, Config, SensorConfig};
use grideye_agent::log::Log;
use grideye_frame::{Celsius, Frame, NoData, PIXELS, Reading, RecordedFrame};
use grideye_recording::{ClockState, Record};
use std::collections::VecDeque;
use std::num::NonZeroU32;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex};
use std::time::Duration;

pub(crate) const MS: Duration = Duration::from_millis(1);
/// The wall clock when the host starts.
pub(crate) const UTC_AT_BOOT_NS: i64 = 1_700_000_000_000_000_000;

/// A host with time that moves only while it sleeps or its bus is busy; it wakes up late by the given delays in turn.
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
        (UTC_AT_BOOT_NS + boot_ns, ClockState::Synced)
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

/// Shows a number in every frame, spread over all pixels and the thermistor, which exposes a torn frame.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Counter {
    ticks: u64,
    ticks_per_frame: u64,
    content: fn(u64) -> u64,
    starts_anew: bool,
}

impl Counter {
    /// One number per frame at 10 Hz; a reset starts again at 0.
    pub(crate) fn at_10_hz() -> Self {
        Self {
            ticks: 0,
            ticks_per_frame: 1,
            content: |n| n,
            starts_anew: true,
        }
    }

    /// One number per frame at 1 Hz, each a mean of ten.
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

    /// Never repeats a number, whatever happens to the sensor.
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

/// Steps of a quarter degree above 20 °C, the resolution of the datasheet's pixels.
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
pub(crate) fn number(raw: &RecordedFrame) -> u64 {
    let n = number_in_pixels(raw);
    assert_eq!(
        grideye_frame::word::thermistor_celsius(raw.thermistor.unwrap()),
        picture(n).thermistor,
        "torn frame {n}"
    );
    n
}

/// The number that the pixels show. Panics if they are torn. The thermistor has a separate transfer, and may belong to
/// the next frame if the host was so late that an update fell between the two.
pub(crate) fn number_in_pixels(raw: &RecordedFrame) -> u64 {
    let pixels = grideye_frame::word::pixels(&raw.pixels);
    let steps = |pixel: Celsius| {
        let quarters = (pixel.get() - 20.0) * 4.0;
        (0..STEPS)
            .find(|steps| f32::from(u16::try_from(*steps).unwrap()) == quarters)
            .expect("a number")
    };
    let n = steps(pixels[0]) + STEPS * steps(pixels[PIXELS - 1]);
    assert_eq!(pixels, picture(n).pixels, "torn frame {n}");
    n
}

pub(crate) type TestBus = Bus<Arc<ManualClock>, Counter>;
type Meddle = Box<dyn FnOnce(&mut TestBus) + Send>;

/// An emulated bus that a script breaks and repairs at given times.
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

    /// A sensor at 0x69 with this clock error.
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

    /// Runs this on the bus before the first transfer at or after `at`.
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
        // One step per transfer, so that a repair never hides the fault before it.
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

    /// As uncertain as a Raspberry Pi's device tree.
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

/// Runs until every sensor has delivered this many frames.
pub(crate) fn run(
    collector: &Collector,
    host: &Arc<Host>,
    bus: &Emulated,
    sensors: &[SensorConfig],
    frames: u64,
) -> grideye_agent::agent::Summary {
    let agent = start(collector, host, bus, sensors, frames);
    assert!(agent.wait_finished(WAIT_MAX), "{:?}", agent.accounts());
    agent.stop(WAIT_MAX)
}

pub(crate) fn missing(records: &[Record]) -> Vec<(u64, NoData)> {
    let missing = records.iter().filter_map(|record| match record.reading {
        Reading::NoData(reason) => Some((record.seq, reason)),
        Reading::Frame(_) => None,
    });
    missing.collect()
}

/// Checks that `seq` has no gaps and each frame shows its own number.
pub(crate) fn assert_exact(records: &[Record], content: fn(u64) -> u64) {
    assert_exact_by(records, content, number);
}

pub(crate) fn assert_exact_by(
    records: &[Record],
    content: fn(u64) -> u64,
    number: fn(&RecordedFrame) -> u64,
) {
    for (expected, record) in (0..).zip(records) {
        assert_eq!(record.seq, expected);
        if let Some(frame) = record.reading.frame() {
            assert_eq!(number(frame), content(expected), "frame {expected}");
        }
    }
}
