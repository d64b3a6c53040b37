//! Random transactions, faults, fault scripts, options and time jumps against emulated sensors. After each sensor's
//! life, a power cycle must leave no trace of it.

use crate::any_options::{any_options, power_on_image};
use crate::random::Random;
use amg8833_emulator::script::{Lasting, Rule, Script, When};
use amg8833_emulator::{
    Address, Bus, Chance, Clock, Fault, FaultKind, ManualClock, Options, PastTheEnd,
};
use embedded_hal::i2c::{I2c, Operation};
use grideye_frame::{Celsius, Frame, PixelIndex};
use std::num::NonZeroU32;
use std::time::Duration;

/// The number of transactions in one sensor's life.
const LIFE: u64 = 500;

/// Counts of the actions and their results.
#[derive(Debug, Default, PartialEq, Eq)]
pub(crate) struct Outcome {
    pub(crate) transactions: u64,
    pub(crate) refused: u64,
    pub(crate) bytes: u64,
    pub(crate) frames: u64,
    pub(crate) lives: u64,
    pub(crate) fault_calls: u64,
    /// Rules in the fault scripts.
    pub(crate) rules: u64,
    /// Faults that struck.
    pub(crate) faults: u64,
    /// Emulated time.
    pub(crate) time: Duration,
}

type Source = fn(Duration) -> Frame;
const WILD: Source = wild;

/// Runs at least this many transactions. Panics if a power cycle does not end a life cleanly.
pub(crate) fn run(seed: u64, transactions: u64) -> Outcome {
    let mut outcome = Outcome::default();
    let mut random = Random::new(seed);
    while outcome.transactions < transactions {
        let options = any_options(random.next(), clock_error(&mut random));
        live(&mut random, options, &mut outcome);
        outcome.lives += 1;
    }
    outcome
}

fn clock_error(random: &mut Random) -> i32 {
    match random.below(4) {
        0 => 0,
        1 => i32::try_from(random.below(120_001)).unwrap() - 60_000,
        2 => i32::MIN,
        _ => i32::try_from(random.below(1 << 31)).unwrap(),
    }
}

/// Pixels across the range and beyond, including not-a-number, different every tick.
fn wild(t: Duration) -> Frame {
    let mut random = Random::new(u64::try_from(t.as_nanos()).unwrap());
    let degrees = |random: &mut Random| match random.below(64) {
        0 => f32::NAN,
        1 => f32::INFINITY,
        2 => -1e30,
        _ => f32::from(u16::try_from(random.below(4_801)).unwrap()) / 4.0 - 600.0,
    };
    let mut frame = Frame::uniform(Celsius::new(degrees(&mut random)));
    for pixel in frame.pixels.iter_mut().step_by(7) {
        *pixel = Celsius::new(degrees(&mut random));
    }
    frame
}

fn live(random: &mut Random, options: Options, outcome: &mut Outcome) {
    let bus = Bus::new(ManualClock::new());
    let mut bus = if random.below(2) == 0 {
        bus.with_scl_hz(NonZeroU32::new(10_000 + 90_000 * u32::from(any_byte(random))).unwrap())
    } else {
        bus.with_instant_transactions()
    };
    let plugged = random.below(2) == 0;
    bus.plug(Address::High, WILD, options);
    if plugged {
        bus.plug(Address::Low, WILD, Options::default());
    }
    bus.set_seed(random.next());
    if random.below(2) == 0 {
        let rules: Vec<Rule> = (0..random.below(5))
            .filter_map(|_| any_rule(random))
            .collect();
        outcome.rules += u64::try_from(rules.len()).unwrap();
        bus.set_script(Script::new(random.next(), rules).unwrap());
    }
    for _ in 0..LIFE {
        match random.below(16) {
            0 => break_or_mend(random, &mut bus, outcome),
            1..=4 => pass(random, &bus),
            5 => {
                let now = bus.clock().now();
                let device = bus.device_mut(Address::High).unwrap();
                device.set_clock_error_ppm(clock_error(random), now);
            }
            _ => {}
        }
        transfer(random, &mut bus, outcome);
        look(random, &mut bus);
    }
    let device = bus.device(Address::High).unwrap();
    outcome.frames += device.frames();
    outcome.faults += bus.fault_counts().total();
    outcome.time += bus.clock().now();
    end(bus);
}

fn any_byte(random: &mut Random) -> u8 {
    random.next().to_le_bytes()[7]
}

/// Command bytes, more often than by chance.
fn byte(random: &mut Random) -> u8 {
    const COMMANDS: [u8; 20] = [
        0x00, 0x01, 0x02, 0x03, 0x04, 0x05, 0x07, 0x08, 0x0E, 0x10, 0x1F, 0x20, 0x21, 0x30, 0x3F,
        0x45, 0x50, 0x57, 0x80, 0xFF,
    ];
    if random.below(4) == 0 {
        return any_byte(random);
    }
    COMMANDS[usize::try_from(random.below(20)).unwrap()]
}

fn transfer(random: &mut Random, bus: &mut Bus<ManualClock, Source>, outcome: &mut Outcome) {
    let address = match random.below(16) {
        0 => any_byte(random),
        1 => 0x68,
        _ => 0x69,
    };
    let mut buffer = [0; 4 * 300];
    let mut rest = &mut buffer[..];
    let mut operations: Vec<Operation<'_>> = Vec::with_capacity(4);
    for _ in 0..random.below(4) {
        let length = match random.below(8) {
            0 => 0,
            1 => random.below(300),
            _ => random.below(6),
        };
        let (part, after) = rest.split_at_mut(usize::try_from(length).unwrap());
        rest = after;
        operations.push(if random.below(2) == 0 {
            part.fill_with(|| byte(random));
            Operation::Write(part)
        } else {
            Operation::Read(part)
        });
    }
    let before = bus.traffic().bytes;
    outcome.refused += u64::from(bus.transaction(address, &mut operations).is_err());
    outcome.bytes += bus.traffic().bytes - before;
    outcome.transactions += 1;
}

fn pass(random: &mut Random, bus: &Bus<ManualClock, Source>) {
    let step = match random.below(64) {
        // Catching up a long unobserved sensor is the slowest step here.
        0 => Duration::from_secs(random.below(100)),
        1..=20 => Duration::from_nanos(random.below(200_000_000)),
        _ => Duration::from_millis(random.below(500)),
    };
    bus.clock().advance(step);
}

fn fault(random: &mut Random) -> Fault {
    let kind = FaultKind::ALL[usize::try_from(random.below(20)).unwrap()];
    let word = u16::from_le_bytes([any_byte(random), any_byte(random)]);
    let pixel = PixelIndex::new((any_byte(random) % 80).into());
    let bit = any_byte(random) % 8;
    match kind {
        FaultKind::NackAddress => Fault::NackAddress,
        FaultKind::NackByte => Fault::NackByte(word % 8),
        FaultKind::BusError => Fault::BusError,
        FaultKind::ArbitrationLoss => Fault::ArbitrationLoss,
        FaultKind::Timeout => Fault::Timeout,
        FaultKind::Hang => Fault::Hang,
        FaultKind::ShortClock => Fault::ShortClock {
            byte: word % 8,
            bit,
        },
        FaultKind::BitFlip => Fault::BitFlip {
            register: pixel.map(|_| any_byte(random)),
            byte: (word % 2 == 0).then_some(word % 9),
            bit: (word % 3 == 0).then_some(bit),
        },
        FaultKind::StuckHigh => Fault::StuckHigh,
        FaultKind::AllZero => Fault::AllZero,
        FaultKind::BrownOut => Fault::BrownOut,
        FaultKind::FastWake => Fault::FastWake,
        FaultKind::Freeze => Fault::Freeze,
        FaultKind::Torn => Fault::Torn { pixel },
        FaultKind::Unplugged => Fault::Unplugged,
        FaultKind::AdapterGone => Fault::AdapterGone,
        FaultKind::PixelGlitch => Fault::PixelGlitch { pixel, word },
        FaultKind::ThermistorFailure => Fault::ThermistorFailure { word },
        FaultKind::ClockError => Fault::ClockError {
            ppm: i32::from_le_bytes([
                any_byte(random),
                any_byte(random),
                any_byte(random),
                any_byte(random),
            ]),
        },
        FaultKind::SclSpeed => Fault::SclSpeed {
            hz: NonZeroU32::new(1_000 + 4_000 * u32::from(any_byte(random))).unwrap(),
        },
    }
}

fn any_time(random: &mut Random) -> Duration {
    match random.below(16) {
        0 => Duration::MAX,
        1 => Duration::from_nanos(random.next()),
        _ => Duration::from_millis(random.below(120_000)),
    }
}

/// `None` if a script would reject the rule.
fn any_rule(random: &mut Random) -> Option<Rule> {
    let rule = Rule {
        when: match random.below(5) {
            0 => When::Always,
            1 => When::At(any_time(random)),
            2 => When::Between {
                from: any_time(random),
                until: (random.below(2) == 0).then(|| any_time(random)),
            },
            3 => When::Every {
                period: Duration::from_micros(random.below(10_000_000)),
                from: any_time(random),
                until: (random.below(2) == 0).then(|| any_time(random)),
            },
            _ => When::Frame(random.below(1_000)),
        },
        lasting: match random.below(4) {
            0 => Lasting::ToTheEnd,
            1 => Lasting::For(any_time(random)),
            2 => Lasting::Frames(any_byte(random).into()),
            _ => Lasting::Times(any_byte(random).into()),
        },
        chance: Chance::new(f64::from(any_byte(random)) / 255.0).unwrap(),
        address: Address::from_bits(0x67 + any_byte(random) % 4),
        bus: (random.below(8) == 0).then_some(1),
        ..Rule::new(fault(random))
    };
    Script::new(0, vec![rule]).is_ok().then_some(rule)
}

fn break_or_mend(random: &mut Random, bus: &mut Bus<ManualClock, Source>, outcome: &mut Outcome) {
    outcome.fault_calls += 1;
    let chance = match random.below(3) {
        0 => Chance::new(0.3).unwrap(),
        _ => Chance::ALWAYS,
    };
    match random.below(6) {
        0 => drop(bus.set_fault_with_chance(Address::High, fault(random), chance)),
        1 => drop(bus.set_fault_with_chance(None::<Address>, fault(random), chance)),
        2 => {
            let now = bus.clock().now();
            bus.device_mut(Address::High).unwrap().power_cycle(now);
        }
        3 => drop(bus.clear_fault(None::<Address>)),
        _ => {
            bus.clear_fault(Address::High);
            bus.clear_fault(None::<Address>);
        }
    }
}

/// Inspecting changes nothing and never fails.
fn look(random: &mut Random, bus: &mut Bus<ManualClock, Source>) {
    if random.below(8) != 0 {
        return;
    }
    assert!(bus.interrupt_pin(Address::High).is_some());
    let now = bus.clock().now();
    let device = bus.device_mut(Address::High).unwrap();
    assert!(device.next_tick_at() <= device.next_frame_at());
    assert!(device.next_tick_at().is_none_or(|tick| tick > now));
    while device.take_edge().is_some() {}
}

/// After a power cycle the sensor equals a new one: pointer, all registers, and its behavior from then on.
fn end(mut bus: Bus<ManualClock, Source>) {
    bus.clear_script();
    bus.clear_fault(Address::High);
    bus.clear_fault(None::<Address>);
    let start = bus.clock().now();
    let used = bus.device_mut(Address::High).unwrap();
    used.power_cycle(start);
    let options = *used.options();
    // The clock error set by call belongs to the sensor and survives a power cycle.
    let mut fresh = amg8833_emulator::Device::new(WILD, options, start);
    let frames = used.frames();
    let ask = |device: &mut amg8833_emulator::Device<Source>, now: Duration| {
        device.start_read(now);
        let pointer = device.read(now);
        device.stop(now);
        device.start_write(now);
        device.write(0x00, now);
        device.start_read(now);
        let image: Vec<u8> = (0..256).map(|_| device.read(now)).collect();
        device.stop(now);
        // Return the pointer to its power-on value.
        device.start_write(now);
        device.write(0x00, now);
        device.stop(now);
        (pointer, image)
    };
    // A silent start takes 50 ms.
    for milliseconds in [50, 1_700, 2_900] {
        let now = start + Duration::from_millis(milliseconds);
        let found = ask(used, now);
        assert_eq!(found, ask(&mut fresh, now), "{options:?}");
        if milliseconds == 50 && options.past_the_end == PastTheEnd::Wraps {
            assert_eq!(found, (0x00, power_on_image(&options)), "{options:?}");
        }
        assert_eq!(used.frames() - frames, fresh.frames(), "{options:?}");
        assert_eq!(used.interrupt_pin(), fresh.interrupt_pin(), "{options:?}");
        assert_eq!(used.next_frame_at(), fresh.next_frame_at(), "{options:?}");
    }
}
