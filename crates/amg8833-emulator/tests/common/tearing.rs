//! How often each driver's way of reading mixes two frames: a sensor 4 % slow, a host that reads ten times per second.

use crate::random::Random;
use amg8833_emulator::{Address, Bus, Clock, ManualClock, Options};
use embedded_hal::i2c::{I2c, Operation};
use grideye_frame::{Celsius, Frame};
use std::time::Duration;

/// The host's read interval.
const POLL: Duration = Duration::from_millis(100);
/// A sensor 4 % slow has a frame every 100 ms / 0.96.
const SENSOR_PERIOD_NS: f64 = 1e8 / 0.96;
const CLOCK_ERROR_PPM: i32 = -40_000;
/// The host's maximum delay. With it, 25 reads cover all phases between host and sensor evenly, since 100 ms are 24/25
/// of the sensor's period.
const JITTER_NS: u64 = 4_166_667;

/// How a driver reads 128 bytes.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Way {
    /// One write of the address, repeated START, one read.
    Burst,
    /// The address, STOP, one read.
    BurstAfterStop,
    /// Reads of this many bytes after repeated STARTs, with one STOP at the end.
    OneTransaction(usize),
    /// One transaction per this many bytes, each with its register address.
    Chunks(usize),
    /// The same with a STOP after the register address.
    ChunksAfterStop(usize),
}

/// Who reads how, and the reference's estimate of torn frames in percent at 100 and 400 kHz (section 5: readout time
/// with the thermistor divided by 100 ms; 0 for a read of 128 bytes).
pub(crate) const WAYS: [(&str, Way, [f64; 2]); 12] = [
    (
        "burst (Zephyr, libdriver, amg88, agent)",
        Way::Burst,
        [0.0, 0.0],
    ),
    ("W80 STOP R128 (dotnet)", Way::BurstAfterStop, [0.0, 0.0]),
    (
        "32-byte parts, repeated START (BusIO on AVR)",
        Way::OneTransaction(32),
        [0.0, 0.0],
    ),
    ("4 x 32 (arms22, grideyelib)", Way::Chunks(32), [13.2, 3.30]),
    (
        "31-byte blocks (kernel on SMBus)",
        Way::Chunks(31),
        [13.5, 3.38],
    ),
    ("8 x 16 (grideye-driver)", Way::Chunks(16), [14.4, 3.60]),
    (
        "8 x 16, STOP between (xoseperez)",
        Way::ChunksAfterStop(16),
        [14.5, 3.62],
    ),
    ("2 x 64", Way::Chunks(64), [f64::NAN, f64::NAN]),
    (
        "64 words (CircuitPython, SparkFun)",
        Way::Chunks(2),
        [31.2, 7.80],
    ),
    (
        "64 words, STOP between (grideye 0.3.0)",
        Way::ChunksAfterStop(2),
        [31.9, 7.96],
    ),
    ("128 bytes (melopero, Seeed)", Way::Chunks(1), [50.7, 12.68]),
    (
        "128 bytes, STOP between",
        Way::ChunksAfterStop(1),
        [f64::NAN, f64::NAN],
    ),
];

/// The result for one way at one speed.
#[derive(Debug)]
pub(crate) struct Share {
    pub(crate) torn: u32,
    pub(crate) reads: u32,
    /// The expected share: the time from the first transaction's START to the last one's, divided by the sensor's
    /// period. A frame due in that time comes between two transactions.
    pub(crate) expected: f64,
    /// The readout time of the 128 bytes.
    pub(crate) readout: Duration,
}

impl Share {
    pub(crate) fn percent(&self) -> f64 {
        100.0 * f64::from(self.torn) / f64::from(self.reads)
    }

    /// One standard deviation of the share, in percent, if reads are torn independently with the expected chance.
    pub(crate) fn deviation_percent(&self) -> f64 {
        100.0 * (self.expected * (1.0 - self.expected) / f64::from(self.reads)).sqrt()
    }
}

/// Every tick has its own word, and both of its bytes differ from the previous tick's.
fn ticking(t: Duration) -> Frame {
    let tick = u64::try_from(t.as_nanos()).unwrap() / 104_000_000;
    let word = u16::try_from(tick % 251 + (tick % 13) * 256).unwrap();
    let signed = (i32::from(word) + 0x800) % 0x1000 - 0x800;
    Frame::uniform(Celsius::new(
        f32::from(i16::try_from(signed).unwrap()) / 4.0,
    ))
}

/// Reads this many frames in this way at this bus speed.
pub(crate) fn share(way: Way, scl_hz: u32, reads: u32) -> Share {
    let clock = ManualClock::new();
    let mut bus = Bus::new(&clock).with_scl_hz(scl_hz.try_into().unwrap());
    let options = Options {
        clock_error_ppm: CLOCK_ERROR_PPM,
        ..Options::default()
    };
    let source: fn(Duration) -> Frame = ticking;
    bus.plug(Address::High, source, options);
    let mut random = Random::new(u64::from(scl_hz));
    let mut torn = 0;
    let mut readout = Duration::ZERO;
    let mut until_last = Duration::ZERO;
    for read in 1..=reads {
        let jitter = Duration::from_nanos(random.below(JITTER_NS));
        clock.set(POLL * read + jitter);
        let start = clock.now();
        let (bytes, last) = one(&mut bus, way);
        let words = bytes.chunks_exact(2);
        let mut words = words.map(|pair| u16::from_le_bytes([pair[0], pair[1]]));
        let first = words.next().unwrap();
        torn += u32::from(words.any(|word| word != first));
        readout = clock.now() - start;
        until_last = last - start;
    }
    let until_last_ns = until_last.as_secs_f64() * 1e9;
    Share {
        torn,
        reads,
        expected: until_last_ns / SENSOR_PERIOD_NS,
        readout,
    }
}

/// The 128 bytes, and when the last transaction that brought some of them began.
fn one(bus: &mut Bus<&ManualClock, fn(Duration) -> Frame>, way: Way) -> ([u8; 128], Duration) {
    let mut bytes = [0; 128];
    let clock = *bus.clock();
    let start = clock.now();
    let mut last = start;
    match way {
        Way::Burst => bus.write_read(0x69, &[0x80], &mut bytes).unwrap(),
        Way::BurstAfterStop => {
            bus.write(0x69, &[0x80]).unwrap();
            bus.read(0x69, &mut bytes).unwrap();
        }
        Way::OneTransaction(size) => {
            // An empty write acts as the repeated START; it costs an address byte that real drivers do not send.
            let mut operations = vec![Operation::Write(&[0x80])];
            for part in bytes.chunks_mut(size) {
                operations.push(Operation::Read(part));
                operations.push(Operation::Write(&[]));
            }
            bus.transaction(0x69, &mut operations).unwrap();
        }
        Way::Chunks(size) | Way::ChunksAfterStop(size) => {
            for (register, part) in (0x80..=0xFF_u8).step_by(size).zip(bytes.chunks_mut(size)) {
                if matches!(way, Way::Chunks(_)) {
                    last = clock.now();
                    bus.write_read(0x69, &[register], part).unwrap();
                } else {
                    bus.write(0x69, &[register]).unwrap();
                    last = clock.now();
                    bus.read(0x69, part).unwrap();
                }
            }
        }
    }
    (bytes, last)
}

/// The table, one line per way, and the results.
pub(crate) fn table(reads: u32) -> (String, Vec<(Way, Share)>) {
    let mut text = format!(
        "torn frames in percent of {reads} reads at 10 Hz of a sensor 4 % slow; in brackets one standard deviation\n\
         {:<46} {:>8} {:>9} {:>15} {:>9} {:>10}\n",
        "way of reading 128 bytes", "SCL kHz", "takes ms", "torn", "expected", "reference"
    );
    let mut shares = Vec::new();
    for (name, way, estimates) in WAYS {
        for (hz, estimate) in [100_000, 400_000].into_iter().zip(estimates) {
            let share = share(way, hz, reads);
            let estimate = if estimate.is_nan() {
                "-".to_owned()
            } else {
                format!("{estimate:.1}")
            };
            text += &format!(
                "{name:<46} {:>8} {:>9.2} {:>8.2} ({:.2}) {:>9.2} {estimate:>10}\n",
                hz / 1_000,
                share.readout.as_secs_f64() * 1e3,
                share.percent(),
                share.deviation_percent(),
                100.0 * share.expected,
            );
            shares.push((way, share));
        }
    }
    (text, shares)
}
