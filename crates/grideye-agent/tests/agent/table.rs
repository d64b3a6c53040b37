//! One emulated sensor, read for hours of its time: by the agent, and by programs that poll on their own clock.

use amg8833::{Address as Target, FrameRate};
use amg8833_emulator::{
    Address, Bus, BusError, Clock as _, Drift, FrameSource, ManualClock, Options,
};
use embedded_hal::i2c::I2c as _;
use grideye_agent::bus::{OpenBus, OpenError};
use grideye_agent::bus::{Sink, read_bus};
use grideye_agent::clock::Clock;
use grideye_agent::config::{BusConfig, SensorConfig};
use grideye_agent::log::Log;
use grideye_frame::{Celsius, Frame, NoData, PIXELS, PixelWord, Reading, RecordedFrame};
use grideye_recording::{ClockState, Record};
use std::cell::{Cell, RefCell};
use std::collections::BTreeMap;
use std::fmt;
use std::num::NonZeroU32;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

/// A sensor, its bus, and the time to read it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Case {
    pub(crate) rate: FrameRate,
    pub(crate) scl_hz: u32,
    /// The sensor's clock error at the start.
    pub(crate) error_ppm: i32,
    /// The rise of that error per hour.
    pub(crate) drift_ppm_per_hour: i32,
    pub(crate) span: Duration,
    /// The host wakes up late by up to this much, each time by a different amount.
    pub(crate) late_max: Duration,
}

/// A way to read.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Way {
    /// This agent's bus thread.
    Agent,
    /// 64 transactions of two bytes per nominal period.
    Singles,
    /// Four transactions of 32 bytes per nominal period.
    Blocks,
    /// One transaction of 128 bytes per nominal period.
    Burst,
}

impl Way {
    pub(crate) const fn name(self) -> &'static str {
        match self {
            Self::Agent => "this agent",
            Self::Singles => "poll, 64 single reads",
            Self::Blocks => "poll, 32-byte blocks",
            Self::Burst => "poll, 128-byte burst",
        }
    }

    /// Pixel bytes per transaction.
    const fn bytes(self) -> usize {
        match self {
            Self::Singles => 2,
            Self::Blocks => 32,
            Self::Agent | Self::Burst => 2 * PIXELS,
        }
    }
}

/// The outcome of the sensor's frames, from the first to the last one read.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(crate) struct Tally {
    /// Frames that the sensor made.
    pub(crate) made: u64,
    /// Rows of pixels that the reader took for frames.
    pub(crate) rows: u64,
    /// Rows of a single, new frame: the rows that a recording should have.
    pub(crate) whole: u64,
    /// Rows with pixels of more than one frame.
    pub(crate) torn: u64,
    /// Rows of a frame seen before.
    pub(crate) doubled: u64,
    /// Frames that no row shows whole, but with a row that has a reason.
    pub(crate) missed_with_reason: BTreeMap<String, u64>,
    /// Frames that no row shows whole and nothing reports.
    pub(crate) missed_unknown: u64,
    /// Rows with the thermistor of another frame.
    pub(crate) strange_thermistors: u64,
    /// Counted faults, by kind.
    pub(crate) faults: BTreeMap<String, u64>,
}

/// Reads this case's sensor in this way.
pub(crate) fn run(case: &Case, way: Way) -> Tally {
    let host = Arc::new(Host {
        late_max: case.late_max,
        ..Host::default()
    });
    let bus = bus(case, &host);
    match way {
        Way::Agent => by_agent(case, host, bus),
        way => by_polling(case, way, &host, bus),
    }
}

/// A host with time that moves only while it sleeps or its bus is busy, and that wakes up late.
#[derive(Debug, Default)]
struct Host {
    time: Arc<ManualClock>,
    late_max: Duration,
    wakes: AtomicU64,
}

impl Clock for Host {
    fn boot(&self) -> Duration {
        self.time.now()
    }

    fn utc(&self) -> (i64, ClockState) {
        (0, ClockState::Unsynced)
    }

    fn sleep_until(&self, boot: Duration) {
        if boot > self.time.now() {
            let wake = self.wakes.fetch_add(1, Ordering::Relaxed);
            self.time.set(boot + self.late_max.mul_f64(share(wake)));
        }
    }
}

/// A fraction from 0 to 1 for each number (SplitMix64).
fn share(number: u64) -> f64 {
    let mut bits = number.wrapping_mul(0x9E37_79B9_7F4A_7C15);
    bits = (bits ^ (bits >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    bits = (bits ^ (bits >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    bits ^= bits >> 31;
    f64::from(u32::try_from(bits >> 32).unwrap()) / f64::from(u32::MAX)
}

/// Shows the frame's number in every pixel and in the thermistor.
#[derive(Debug)]
struct Numbers {
    ticks: u64,
    ticks_per_frame: u64,
    /// The temperatures of each number.
    shown: Arc<[Celsius]>,
}

/// Numbers repeat after this many; the order of the frames continues them.
const ROUND: u64 = 1024;
/// A pixel's steps from frame to frame, and from pixel to pixel; both differ between any two frames.
const STEPS_A_FRAME: u64 = 7;
const STEPS_A_PIXEL: u64 = 3;
/// This many consecutive frames have different thermistors.
const THERMISTORS: u64 = 256;

impl Numbers {
    fn new(rate: FrameRate) -> Self {
        let quarters = |step: u16| Celsius::new(f32::from(step) * 0.25 - 100.0);
        Self {
            ticks: 0,
            ticks_per_frame: if rate == FrameRate::One { 10 } else { 1 },
            shown: (0..u16::try_from(ROUND).unwrap()).map(quarters).collect(),
        }
    }
}

impl FrameSource for Numbers {
    fn frame_at(&mut self, _: Duration) -> Frame {
        let number = self.ticks / self.ticks_per_frame;
        self.ticks += 1;
        let mut frame = Frame::uniform(thermistor(number));
        for (pixel, celsius) in (0..).zip(&mut frame.pixels) {
            let step = (number * STEPS_A_FRAME + pixel * STEPS_A_PIXEL) % ROUND;
            *celsius = self.shown[usize::try_from(step).unwrap()];
        }
        frame
    }

    fn measuring_from(&mut self, _: Duration) {
        self.ticks = 0;
    }
}

fn thermistor(number: u64) -> Celsius {
    let step = u16::try_from(number % THERMISTORS).unwrap();
    Celsius::new(20.0 + f32::from(step) * 0.0625)
}

/// The number that a pixel shows, modulo [`ROUND`]: its steps times the inverse of the steps per frame.
fn number(pixel: u64, word: PixelWord) -> u64 {
    const INVERSE: u64 = 439;
    let quarters = u64::from(word.0.wrapping_add(400) & 0xFFF);
    (quarters + ROUND - pixel * STEPS_A_PIXEL % ROUND) * INVERSE % ROUND
}

/// The single number that all pixels show, if there is one.
fn number_of(pixels: &[PixelWord; PIXELS]) -> Option<u64> {
    let mut numbers = (0..).zip(pixels).map(|(pixel, word)| number(pixel, *word));
    let first = numbers.next()?;
    numbers.all(|number| number == first).then_some(first)
}

type TestBus = Bus<Arc<ManualClock>, Numbers>;

fn bus(case: &Case, host: &Host) -> TestBus {
    let mut bus =
        Bus::new(Arc::clone(&host.time)).with_scl_hz(NonZeroU32::new(case.scl_hz).unwrap());
    let options = Options {
        clock_error_ppm: case.error_ppm,
        clock_drift: match case.drift_ppm_per_hour {
            0 => Drift::None,
            rise => Drift::PpmPerHour(rise),
        },
        ..Options::default()
    };
    bus.plug(Address::High, Numbers::new(case.rate), options);
    bus
}

/// Follows the numbers that the rows show.
#[derive(Debug, Default)]
struct Count {
    tally: Tally,
    first: Option<u64>,
    /// The highest number shown so far.
    last: u64,
}

impl Count {
    fn row(&mut self, pixels: &[PixelWord; PIXELS]) -> Option<u64> {
        self.tally.rows += 1;
        let Some(shown) = number_of(pixels) else {
            self.tally.torn += 1;
            return None;
        };
        if self.first.is_none() {
            (self.first, self.last) = (Some(shown), shown);
            self.tally.whole = 1;
            return Some(shown);
        }
        let on = (shown + ROUND - self.last % ROUND) % ROUND;
        if on == 0 || on > ROUND / 2 {
            self.tally.doubled += 1;
            return Some(self.last - (ROUND - on) % ROUND);
        }
        self.last += on;
        self.tally.whole += 1;
        Some(self.last)
    }

    fn finish(mut self) -> Tally {
        self.tally.made = self.last + 1 - self.first.unwrap_or(0);
        let missed = self.tally.made - self.tally.whole;
        let with_reason: u64 = self.tally.missed_with_reason.values().sum();
        self.tally.missed_unknown = missed.saturating_sub(with_reason);
        assert!(with_reason <= missed, "more reasons than missed frames");
        self.tally
    }
}

struct Opener(Option<TestBus>);

impl OpenBus for Opener {
    type Bus = TestBus;

    fn open(&mut self) -> Result<TestBus, OpenError> {
        self.0
            .take()
            .ok_or(OpenError::NoSuchBus("closed".to_owned()))
    }

    fn classify(&self, error: &BusError) -> NoData {
        panic!("a bus without faults failed: {error}");
    }
}

struct Records {
    count: RefCell<Count>,
    host: Arc<Host>,
    end: Duration,
    seq: Cell<u64>,
}

impl Sink for Records {
    fn record(&self, _: usize, record: Record) {
        assert_eq!(
            record.seq,
            self.seq.replace(record.seq + 1),
            "seq has no gap"
        );
        let mut count = self.count.borrow_mut();
        match record.reading {
            Reading::NoData(reason) => {
                let reasons = &mut count.tally.missed_with_reason;
                *reasons.entry(reason.name().to_owned()).or_default() += 1;
            }
            Reading::Frame(frame) => self.frame(&mut count, record.seq, &frame),
        }
    }

    fn fault(&self, _: usize, kind: &'static str) {
        let mut count = self.count.borrow_mut();
        *count.tally.faults.entry(kind.to_owned()).or_default() += 1;
    }

    fn is_stopping(&self) -> bool {
        self.host.boot() >= self.end
    }
}

impl Records {
    /// The agent's number of a frame is the sensor's, from the first to the last.
    fn frame(&self, count: &mut Count, seq: u64, frame: &RecordedFrame) {
        let Some(number) = count.row(&frame.pixels) else {
            return;
        };
        assert_eq!(
            seq,
            number - count.first.unwrap_or(0),
            "seq is the sensor's count"
        );
        let shown = grideye_frame::word::thermistor_celsius(frame.thermistor.unwrap());
        count.tally.strange_thermistors += u64::from(shown != thermistor(number));
    }
}

fn by_agent(case: &Case, host: Arc<Host>, bus: TestBus) -> Tally {
    let records = Records {
        count: RefCell::default(),
        host: Arc::clone(&host),
        end: case.span,
        seq: Cell::new(0),
    };
    let config = BusConfig {
        path: "/dev/i2c-1".into(),
        sensors: vec![SensorConfig {
            rate: case.rate,
            ..SensorConfig::at(Target::High)
        }],
    };
    read_bus(Opener(Some(bus)), &config, host, Log::silent(), &records);
    records.count.into_inner().finish()
}

/// Reads at fixed intervals, like scripts do, and takes every row for a frame.
fn by_polling(case: &Case, way: Way, host: &Host, mut bus: TestBus) -> Tally {
    let period = case.rate.period();
    let mut count = Count::default();
    let rate: u8 = if case.rate == FrameRate::One { 1 } else { 0 };
    for write in [[0x00, 0x00], [0x01, 0x3F], [0x01, 0x30], [0x02, rate]] {
        bus.write(0x69, &write).unwrap();
    }
    let mut at = case.rate.settling_time() + period;
    while at < case.span {
        host.sleep_until(at);
        let mut bytes = [0; 2 * PIXELS];
        for (register, part) in (0x80..=0xFF)
            .step_by(way.bytes())
            .zip(bytes.chunks_mut(way.bytes()))
        {
            bus.write_read(0x69, &[register], part).unwrap();
        }
        let word = |pixel: usize| u16::from_le_bytes([bytes[2 * pixel], bytes[2 * pixel + 1]]);
        count.row(&std::array::from_fn(|pixel| PixelWord(word(pixel))));
        at += period;
    }
    count.finish()
}

/// The smallest and largest share over several cases, in percent.
pub(crate) struct Range(f64, f64);

impl Range {
    pub(crate) fn of(
        tallies: &[Tally],
        part: impl Fn(&Tally) -> u64,
        of: impl Fn(&Tally) -> u64,
    ) -> Self {
        let count = |count: u64| f64::from(u32::try_from(count).unwrap());
        let shares = tallies
            .iter()
            .map(|tally| 100.0 * count(part(tally)) / count(of(tally)));
        shares.fold(Self(f64::INFINITY, 0.0), |Self(least, most), share| {
            Self(least.min(share), most.max(share))
        })
    }
}

impl fmt::Display for Range {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.1 == 0.0 {
            return formatter.pad("none");
        }
        formatter.pad(&format!("{:.2} - {:.2} %", self.0, self.1))
    }
}

pub(crate) const HEADING: &str = "SCL      rate   way                     rows         torn               doubled            missed with reason  missed unknown";

/// One row of the table: one way on one bus at one rate, over all clocks.
pub(crate) fn row(case: &Case, way: Way, tallies: &[Tally]) -> String {
    let with_reason = |tally: &Tally| tally.missed_with_reason.values().sum();
    format!(
        "{:>3} kHz  {:>2} Hz  {:<22}  {:>9}  {:<17}  {:<17}  {:<18}  {}",
        case.scl_hz / 1000,
        case.rate.fps(),
        way.name(),
        tallies.iter().map(|tally| tally.rows).sum::<u64>(),
        Range::of(tallies, |tally| tally.torn, |tally| tally.rows).to_string(),
        Range::of(tallies, |tally| tally.doubled, |tally| tally.rows).to_string(),
        Range::of(tallies, with_reason, |tally| tally.made).to_string(),
        Range::of(tallies, |tally| tally.missed_unknown, |tally| tally.made),
    )
}
