//! What goes over the bus, transaction by transaction, blocking and async, and what is made of the answers.
//!
//! Addresses and values are written out here from the datasheet, and not taken from the crate.
#![expect(
    clippy::unwrap_used,
    clippy::panic,
    reason = "the helpers of tests are allowed what tests are allowed"
)]

use amg8833::{
    Address, Amg8833, Configuration, Error, FrameRate, InterruptControl, InterruptLevels,
    InterruptMode, MovingAverage, PixelSet, PowerMode, Settings, Standby, Status,
    UndefinedPowerMode, asynch, word,
};
use embedded_hal::i2c::{ErrorKind, ErrorType, I2c, NoAcknowledgeSource, Operation};
use embedded_hal_mock::eh1::delay::NoopDelay;
use embedded_hal_mock::eh1::i2c::{Mock, Transaction};
use grideye_frame::{Celsius, PixelIndex, PixelWord, RawFrame, ThermistorWord};
use proptest::prelude::*;
use std::cell::RefCell;
use std::fmt;
use std::pin::pin;
use std::rc::Rc;
use std::task::{Context, Poll, Waker};

/// The address of both sensors on the mocked bus, but where an address is what is tested.
const SENSOR: u8 = 0x69;

fn write(bytes: &[u8]) -> Transaction {
    Transaction::write(SENSOR, bytes.to_vec())
}

fn read(register: u8, answer: &[u8]) -> Transaction {
    Transaction::write_read(SENSOR, vec![register], answer.to_vec())
}

/// One test module a method: the blocking and the async driver send these transactions and return this value; and
/// when any one of the transactions fails, its error comes back and nothing is sent after it.
macro_rules! traffic {
    ($name:ident: $bus:expr, $method:ident($($argument:expr),*) => $expected:expr) => {
        mod $name {
            use super::*;

            #[test]
            fn blocking() {
                let mut sensor = Amg8833::new(Mock::new(&$bus), Address::High);
                assert_eq!(sensor.$method($($argument),*), $expected);
                sensor.release().done();
            }

            #[test]
            fn asynchronous() {
                let bus = Yielding::new(Mock::new(&$bus));
                let mut sensor = asynch::Amg8833::new(bus, Address::High);
                assert_eq!(block_on(sensor.$method($($argument),*)), $expected);
                sensor.release().bus.done();
            }

            #[test]
            fn keeps_the_error_of_each_transaction_and_stops() {
                for failing in 0..$bus.len() {
                    let (bus, kind) = failing_at(&$bus, failing);
                    let mut sensor = Amg8833::new(Mock::new(&bus), Address::High);
                    assert_eq!(sensor.$method($($argument),*), Err(Error::Bus(kind)));
                    sensor.release().done();

                    let bus = Yielding::new(Mock::new(&bus));
                    let mut sensor = asynch::Amg8833::new(bus, Address::High);
                    assert_eq!(block_on(sensor.$method($($argument),*)), Err(Error::Bus(kind)));
                    sensor.release().bus.done();
                }
            }
        }
    };
}

fn failing_at(bus: &[Transaction], failing: usize) -> (Vec<Transaction>, ErrorKind) {
    let kinds = [
        ErrorKind::NoAcknowledge(NoAcknowledgeSource::Address),
        ErrorKind::NoAcknowledge(NoAcknowledgeSource::Data),
        ErrorKind::ArbitrationLoss,
        ErrorKind::Bus,
    ];
    let kind = kinds[failing % kinds.len()];
    let mut until = bus[..=failing].to_vec();
    let last = until.pop().unwrap().with_error(kind);
    until.push(last);
    (until, kind)
}

// Power and resets: AMG88 spec §4-11-1, §4-11-2.

traffic!(wake: [write(&[0x00, 0x00]), write(&[0x01, 0x3F]), write(&[0x01, 0x30])],
    wake(&mut NoopDelay::new()) => Ok(()));
traffic!(sleep: [write(&[0x00, 0x10])], sleep(&mut NoopDelay::new()) => Ok(()));
traffic!(standby_60_s: [write(&[0x00, 0x20])], standby(Standby::SixtySeconds) => Ok(()));
traffic!(standby_10_s: [write(&[0x00, 0x21])], standby(Standby::TenSeconds) => Ok(()));
traffic!(initial_reset: [write(&[0x01, 0x3F])], initial_reset(&mut NoopDelay::new()) => Ok(()));
traffic!(flag_reset: [write(&[0x01, 0x30])], flag_reset() => Ok(()));
traffic!(power_mode_normal: [read(0x00, &[0x00])], power_mode() => Ok(PowerMode::Normal));
traffic!(power_mode_sleep: [read(0x00, &[0x10])], power_mode() => Ok(PowerMode::Sleep));
traffic!(power_mode_standby_60_s: [read(0x00, &[0x20])],
    power_mode() => Ok(PowerMode::Standby(Standby::SixtySeconds)));
traffic!(power_mode_standby_10_s: [read(0x00, &[0x21])],
    power_mode() => Ok(PowerMode::Standby(Standby::TenSeconds)));
traffic!(power_mode_that_is_not_defined: [read(0x00, &[0x01])],
    power_mode() => Err(Error::UndefinedPowerMode(UndefinedPowerMode { found: 0x01 })));

// Frame rate: AMG88 spec §4-11-3.

traffic!(set_frame_rate_ten: [write(&[0x02, 0x00])], set_frame_rate(FrameRate::Ten) => Ok(()));
traffic!(set_frame_rate_one: [write(&[0x02, 0x01])], set_frame_rate(FrameRate::One) => Ok(()));
traffic!(frame_rate_ten: [read(0x02, &[0xFE])], frame_rate() => Ok(FrameRate::Ten));
traffic!(frame_rate_one: [read(0x02, &[0x01])], frame_rate() => Ok(FrameRate::One));

// Interrupt control, status and clear: AMG88 spec §4-11-4 to §4-11-6.

const ABSOLUTE_ON: InterruptControl = InterruptControl {
    pin_active: true,
    mode: InterruptMode::Absolute,
};
const DIFFERENCE_ON: InterruptControl = InterruptControl {
    pin_active: true,
    mode: InterruptMode::Difference,
};
const ABSOLUTE_OFF: InterruptControl = InterruptControl {
    pin_active: false,
    mode: InterruptMode::Absolute,
};
const DIFFERENCE_OFF: InterruptControl = InterruptControl {
    pin_active: false,
    mode: InterruptMode::Difference,
};

traffic!(set_interrupt_absolute_on: [write(&[0x03, 0x03])], set_interrupt(ABSOLUTE_ON) => Ok(()));
traffic!(set_interrupt_difference_on: [write(&[0x03, 0x01])], set_interrupt(DIFFERENCE_ON) => Ok(()));
traffic!(set_interrupt_absolute_off: [write(&[0x03, 0x02])], set_interrupt(ABSOLUTE_OFF) => Ok(()));
traffic!(set_interrupt_difference_off: [write(&[0x03, 0x00])], set_interrupt(DIFFERENCE_OFF) => Ok(()));
traffic!(interrupt_absolute_on: [read(0x03, &[0x03])], interrupt() => Ok(ABSOLUTE_ON));
traffic!(interrupt_difference_on: [read(0x03, &[0x01])], interrupt() => Ok(DIFFERENCE_ON));
traffic!(interrupt_absolute_off: [read(0x03, &[0x02])], interrupt() => Ok(ABSOLUTE_OFF));
traffic!(interrupt_difference_off: [read(0x03, &[0xFC])], interrupt() => Ok(DIFFERENCE_OFF));

const INTERRUPT: Status = Status {
    interrupt: true,
    pixel_overflow: false,
    thermistor_overflow: false,
};
const PIXEL_OVERFLOW: Status = Status {
    interrupt: false,
    pixel_overflow: true,
    thermistor_overflow: false,
};
const THERMISTOR_OVERFLOW: Status = Status {
    interrupt: false,
    pixel_overflow: false,
    thermistor_overflow: true,
};

traffic!(status_interrupt: [read(0x04, &[0x02])], status() => Ok(INTERRUPT));
traffic!(status_pixel_overflow: [read(0x04, &[0x04])], status() => Ok(PIXEL_OVERFLOW));
traffic!(status_thermistor_overflow: [read(0x04, &[0x08])], status() => Ok(THERMISTOR_OVERFLOW));
traffic!(status_of_undefined_bits: [read(0x04, &[0xF1])], status() => Ok(Status::default()));
traffic!(clear_interrupt: [write(&[0x05, 0x02])], clear_flags(INTERRUPT) => Ok(()));
traffic!(clear_pixel_overflow: [write(&[0x05, 0x04])], clear_flags(PIXEL_OVERFLOW) => Ok(()));
traffic!(clear_thermistor_overflow: [write(&[0x05, 0x08])], clear_flags(THERMISTOR_OVERFLOW) => Ok(()));
traffic!(clear_all: [write(&[0x05, 0x0E])], clear_flags(Status::ALL) => Ok(()));

// Moving average: AMG88 spec §4-11-7.

traffic!(set_moving_average_on:
    [write(&[0x1F, 0x50]), write(&[0x1F, 0x45]), write(&[0x1F, 0x57]), write(&[0x07, 0x20]), write(&[0x1F, 0x00])],
    set_moving_average(MovingAverage::Twice) => Ok(()));
traffic!(set_moving_average_off:
    [write(&[0x1F, 0x50]), write(&[0x1F, 0x45]), write(&[0x1F, 0x57]), write(&[0x07, 0x00]), write(&[0x1F, 0x00])],
    set_moving_average(MovingAverage::Off) => Ok(()));
traffic!(moving_average_on: [read(0x07, &[0x20])], moving_average() => Ok(MovingAverage::Twice));
traffic!(moving_average_off: [read(0x07, &[0xDF])], moving_average() => Ok(MovingAverage::Off));

// Levels and table: AMG88 spec §4-11-8, §4-11-10.

/// The rows of AMG88 spec §4-11-8: 30 °C is 0x078, −5 °C is 0xFEC, and 1 °C is four steps.
fn levels() -> InterruptLevels {
    InterruptLevels::new(Celsius::new(30.0), Celsius::new(-5.0), Celsius::new(1.0)).unwrap()
}

traffic!(set_interrupt_levels:
    [write(&[0x08, 0x78]), write(&[0x09, 0x00]), write(&[0x0A, 0xEC]), write(&[0x0B, 0x0F]),
     write(&[0x0C, 0x04]), write(&[0x0D, 0x00])],
    set_interrupt_levels(&levels()) => Ok(()));
traffic!(interrupt_levels: [read(0x08, &[0x78, 0x00, 0xEC, 0x0F, 0x04, 0x00])],
    interrupt_levels() => Ok(levels()));
traffic!(interrupt_levels_with_undefined_bits: [read(0x08, &[0x78, 0xF0, 0xEC, 0x5F, 0x04, 0xC0])],
    interrupt_levels() => Ok(levels()));
traffic!(interrupt_table: [read(0x10, &[0x01, 0, 0, 0x08, 0, 0, 0, 0x80])],
    interrupt_table() => Ok([1, 28, 64].into_iter().filter_map(PixelIndex::from_number).collect::<PixelSet>()));

// Temperatures: AMG88 spec §4-11-9, §4-11-11.

/// Pixel `n` holds `n` steps, but for the first and the last, which hold −0.25 and −55 °C.
fn pixel_bytes() -> Vec<u8> {
    let mut bytes: Vec<u8> = (1..=64).flat_map(|number| [number, 0x00]).collect();
    bytes[..2].copy_from_slice(&[0xFF, 0x0F]);
    bytes[126..].copy_from_slice(&[0x24, 0x0F]);
    bytes
}

fn pixel_words() -> [PixelWord; 64] {
    std::array::from_fn(|index| {
        PixelWord(match index {
            0 => 0xFFF,
            63 => 0xF24,
            _ => u16::try_from(index + 1).unwrap(),
        })
    })
}

traffic!(read_pixels: [read(0x80, &pixel_bytes())], read_pixels() => Ok(pixel_words()));
traffic!(read_thermistor: [read(0x0E, &[0x04, 0x08])],
    read_thermistor() => Ok(ThermistorWord(0x804)));
traffic!(the_upper_four_bits_are_kept: [read(0x0E, &[0x90, 0x81])],
    read_thermistor() => Ok(ThermistorWord(0x8190)));
traffic!(read_frame: [read(0x80, &pixel_bytes()), read(0x0E, &[0x90, 0x01])],
    read_frame() => Ok(RawFrame { thermistor: ThermistorWord(0x190), pixels: pixel_words() }));

#[test]
fn a_frame_that_was_read_has_the_degrees_of_the_specification() {
    let bus = [read(0x80, &pixel_bytes()), read(0x0E, &[0xBB, 0x0B])];
    let mut sensor = Amg8833::new(Mock::new(&bus), Address::High);
    let frame = word::frame(&sensor.read_frame().unwrap());
    sensor.release().done();
    assert_eq!(frame.thermistor, Celsius::new(-59.6875));
    assert_eq!(frame.pixels[0], Celsius::new(-0.25));
    assert_eq!(frame.pixels[1], Celsius::new(0.5));
    assert_eq!(frame.pixels[62], Celsius::new(15.75));
    assert_eq!(frame.pixels[63], Celsius::new(-55.0));
}

// Everything at once.

fn settings() -> Settings {
    Settings {
        frame_rate: FrameRate::One,
        moving_average: MovingAverage::Twice,
        interrupt: ABSOLUTE_ON,
        levels: levels(),
    }
}

/// What `settings()` looks like in the registers 0x00 to 0x0D, with the write-only and reserved ones set to what no
/// one may rely on.
const SETTINGS_READ_BACK: [u8; 14] = [
    0x00, 0xFF, 0x01, 0x03, 0x0E, 0xFF, 0xFF, 0x20, 0x78, 0x00, 0xEC, 0x0F, 0x04, 0x00,
];

fn init_traffic() -> Vec<Transaction> {
    [
        [0x00, 0x00],
        [0x01, 0x3F],
        [0x01, 0x30],
        [0x02, 0x01],
        [0x1F, 0x50],
        [0x1F, 0x45],
        [0x1F, 0x57],
        [0x07, 0x20],
        [0x1F, 0x00],
        [0x08, 0x78],
        [0x09, 0x00],
        [0x0A, 0xEC],
        [0x0B, 0x0F],
        [0x0C, 0x04],
        [0x0D, 0x00],
        [0x03, 0x03],
    ]
    .iter()
    .map(|bytes| write(bytes))
    .collect()
}

traffic!(init: init_traffic(), init(&mut NoopDelay::new(), &settings()) => Ok(()));
traffic!(configuration: [read(0x00, &SETTINGS_READ_BACK)],
configuration() => Ok(Configuration {
    power: PowerMode::Normal,
    frame_rate: FrameRate::One,
    moving_average: MovingAverage::Twice,
    interrupt: ABSOLUTE_ON,
    levels: levels(),
}));
traffic!(configuration_with_an_undefined_power_mode: [read(0x00, &[0x30; 14])],
    configuration() => Err(Error::UndefinedPowerMode(UndefinedPowerMode { found: 0x30 })));

#[test]
fn a_sensor_that_reset_itself_is_told_from_one_that_did_not() {
    let mut after_power_on = [0; 14];
    let bus = [read(0x00, &SETTINGS_READ_BACK), read(0x00, &after_power_on)];
    let mut sensor = Amg8833::new(Mock::new(&bus), Address::High);
    assert_eq!(sensor.configuration().unwrap().deviation(&settings()), None);
    assert!(
        sensor
            .configuration()
            .unwrap()
            .deviation(&settings())
            .is_some()
    );
    sensor.release().done();

    // With the default settings only the levels can tell, and they do.
    let default = Settings::default();
    let bus = [read(0x00, &after_power_on)];
    let mut sensor = Amg8833::new(Mock::new(&bus), Address::High);
    assert!(
        sensor
            .configuration()
            .unwrap()
            .deviation(&default)
            .is_some()
    );
    sensor.release().done();

    after_power_on[8..].copy_from_slice(&[0xFF, 0x07, 0x00, 0x08, 0x00, 0x00]);
    let bus = [read(0x00, &after_power_on)];
    let mut sensor = Amg8833::new(Mock::new(&bus), Address::High);
    assert_eq!(sensor.configuration().unwrap().deviation(&default), None);
    sensor.release().done();
}

#[test]
fn only_the_four_defined_power_modes_are_taken() {
    for found in 0..=u8::MAX {
        // The byte that a buffer is filled with before a read is read twice: see the test of that name.
        let times = if found == 0xA5 { 2 } else { 1 };
        let bus = vec![read(0x00, &[found]); times];
        let mut sensor = Amg8833::new(Mock::new(&bus), Address::High);
        let mode = sensor.power_mode();
        sensor.release().done();
        if matches!(found, 0x00 | 0x10 | 0x20 | 0x21) {
            assert!(mode.is_ok());
        } else {
            assert_eq!(
                mode,
                Err(Error::UndefinedPowerMode(UndefinedPowerMode { found }))
            );
        }
    }
}

#[test]
fn each_address_is_the_one_on_the_bus() {
    for (address, byte) in [(Address::Low, 0x68), (Address::High, 0x69)] {
        let bus = [
            Transaction::write(byte, vec![0x01, 0x30]),
            Transaction::write_read(byte, vec![0x04], vec![0x02]),
        ];
        let mut sensor = Amg8833::new(Mock::new(&bus), address);
        assert_eq!(sensor.address(), address);
        assert_eq!(sensor.flag_reset(), Ok(()));
        assert_eq!(sensor.status(), Ok(INTERRUPT));
        sensor.release().done();

        let mut sensor = asynch::Amg8833::new(Yielding::new(Mock::new(&bus)), address);
        assert_eq!(sensor.address(), address);
        assert_eq!(block_on(sensor.flag_reset()), Ok(()));
        assert_eq!(block_on(sensor.status()), Ok(INTERRUPT));
        sensor.release().bus.done();
    }
}

/// What the tests of the blocking driver alone show holds for the async one too, methods added later included.
#[test]
fn the_async_driver_is_the_blocking_one_with_await() {
    let blocking = include_str!("../src/blocking.rs");
    let asynchronous = include_str!("../src/asynch.rs");
    let without_await = asynchronous
        .replace("async fn ", "fn ")
        .replace("embedded_hal_async", "embedded_hal")
        .replace("an asynchronous bus", "a bus")
        .split_whitespace()
        .collect::<String>()
        .replace(".await", "");
    assert_eq!(bare(&without_await), bare(blocking));
}

/// A source file without what the formatter may choose, and without the line that says what the file is.
fn bare(source: &str) -> String {
    let squeezed: String = source.split_whitespace().collect();
    let start = squeezed.find("usecrate::address::Address;").unwrap();
    squeezed[start..].replace(",)", ")")
}

// Waits, and bytes on the wire.

#[test]
fn init_waits_where_the_specification_says() {
    let expected = |tape: Tape| {
        let events = tape.events.borrow();
        assert_eq!(
            events[..6],
            [
                Event::Write(vec![0x00, 0x00]),
                Event::WaitNs(50_000_000),
                Event::Write(vec![0x01, 0x3F]),
                Event::WaitNs(2_000_000),
                Event::Write(vec![0x01, 0x30]),
                Event::Write(vec![0x02, 0x01]),
            ]
        );
        assert_eq!(waits(&events[6..]), 0);
    };
    let tape = Tape::default();
    let mut sensor = Amg8833::new(tape.clone(), Address::High);
    sensor.init(&mut tape.clone(), &settings()).unwrap();
    expected(tape);

    let tape = Tape::default();
    let mut sensor = asynch::Amg8833::new(Yielding::new(tape.clone()), Address::High);
    block_on(sensor.init(&mut tape.clone(), &settings())).unwrap();
    expected(tape);
}

#[test]
fn sleep_does_not_return_before_the_sensor_may_be_woken() {
    let expected = [
        Event::Write(vec![0x00, 0x10]),
        Event::WaitNs(100_000_000),
        Event::Write(vec![0x00, 0x00]),
        Event::WaitNs(50_000_000),
        Event::Write(vec![0x01, 0x3F]),
        Event::WaitNs(2_000_000),
        Event::Write(vec![0x01, 0x30]),
    ];
    let tape = Tape::default();
    let mut sensor = Amg8833::new(tape.clone(), Address::High);
    sensor.sleep(&mut tape.clone()).unwrap();
    sensor.wake(&mut tape.clone()).unwrap();
    assert_eq!(*tape.events.borrow(), expected);

    let tape = Tape::default();
    let mut sensor = asynch::Amg8833::new(Yielding::new(tape.clone()), Address::High);
    block_on(sensor.sleep(&mut tape.clone())).unwrap();
    block_on(sensor.wake(&mut tape.clone())).unwrap();
    assert_eq!(*tape.events.borrow(), expected);
}

#[test]
fn the_initial_reset_waits_for_two_milliseconds() {
    let tape = Tape::default();
    let mut sensor = Amg8833::new(tape.clone(), Address::High);
    sensor.initial_reset(&mut tape.clone()).unwrap();
    assert_eq!(
        *tape.events.borrow(),
        [Event::Write(vec![0x01, 0x3F]), Event::WaitNs(2_000_000)]
    );
}

#[test]
fn a_frame_is_two_transactions_and_136_bytes_on_the_wire() {
    let tape = Tape::default();
    Amg8833::new(tape.clone(), Address::High)
        .read_frame()
        .unwrap();
    assert_eq!(tape.transactions(), 2);
    assert_eq!(tape.wire_bytes(), 136);
    assert_eq!(tape.wire_bits(), 1230);

    let tape = Tape::default();
    let bus = Yielding::new(tape.clone());
    block_on(asynch::Amg8833::new(bus, Address::High).read_frame()).unwrap();
    assert_eq!(tape.transactions(), 2);
    assert_eq!(tape.wire_bytes(), 136);
}

#[test]
fn every_setting_is_read_back_with_17_bytes_on_the_wire() {
    let tape = Tape::default();
    Amg8833::new(tape.clone(), Address::High)
        .configuration()
        .unwrap();
    assert_eq!((tape.transactions(), tape.wire_bytes()), (1, 17));
}

// Buses that report success for reads they did not carry out.

#[test]
fn a_bus_that_leaves_the_buffer_alone_is_a_short_read() {
    let short = |register, expected| Error::ShortRead {
        register,
        expected,
        found: 0,
    };
    let mut sensor = Amg8833::new(Delivering::nothing(), Address::High);
    assert_eq!(sensor.read_pixels(), Err(short(0x80, 128)));
    assert_eq!(sensor.read_thermistor(), Err(short(0x0E, 2)));
    assert_eq!(sensor.read_frame(), Err(short(0x80, 128)));
    assert_eq!(sensor.power_mode(), Err(short(0x00, 1)));
    assert_eq!(sensor.status(), Err(short(0x04, 1)));
    assert_eq!(sensor.interrupt_table(), Err(short(0x10, 8)));
    assert_eq!(sensor.configuration(), Err(short(0x00, 14)));

    let bus = Yielding::new(Delivering::nothing());
    let mut sensor = asynch::Amg8833::new(bus, Address::High);
    assert_eq!(block_on(sensor.read_frame()), Err(short(0x80, 128)));
    assert_eq!(block_on(sensor.read_thermistor()), Err(short(0x0E, 2)));
}

#[test]
fn a_frame_cut_off_at_any_byte_is_a_short_read() {
    for delivered in 0..128 {
        let bus = Delivering::only(vec![0x64; delivered]);
        let mut sensor = Amg8833::new(bus, Address::High);
        assert_eq!(
            sensor.read_pixels(),
            Err(Error::ShortRead {
                register: 0x80,
                expected: 128,
                found: delivered
            })
        );
        assert_eq!(sensor.release().reads, 2);
    }
}

#[test]
fn a_bus_that_recovers_at_the_second_attempt_gives_the_frame() {
    let mut bus = Delivering::only(pixel_bytes());
    bus.silent_reads = 1;
    let mut sensor = Amg8833::new(bus, Address::High);
    assert_eq!(sensor.read_pixels(), Ok(pixel_words()));
    assert_eq!(sensor.release().reads, 2);
}

#[test]
fn a_stuck_bus_is_not_a_short_read() {
    for stuck in [0x00, 0xFF] {
        let mut sensor = Amg8833::new(Delivering::only(vec![stuck; 128]), Address::High);
        let word = PixelWord(u16::from_le_bytes([stuck, stuck]));
        assert_eq!(sensor.read_pixels(), Ok([word; 64]));
        assert_eq!(sensor.release().reads, 1);
    }
}

proptest! {
    #[test]
    fn no_frame_is_refused_for_what_is_in_it(
        mut bytes in proptest::collection::vec(any::<u8>(), 128),
        last in prop_oneof![Just(0xA5), Just(0x5A), any::<u8>()],
        filled in any::<bool>(),
    ) {
        if filled {
            bytes.fill(last);
        }
        bytes[127] = last;
        let mut sensor = Amg8833::new(Delivering::only(bytes.clone()), Address::High);
        let words = sensor.read_pixels().unwrap();
        let read_back: Vec<u8> = words.iter().flat_map(|word| word.0.to_le_bytes()).collect();
        prop_assert_eq!(read_back, bytes);
        prop_assert!(sensor.release().reads <= 2);
    }

    #[test]
    fn levels_are_read_back_as_they_were_written(
        upper in 0.0_f32..=511.75,
        lower in -512.0_f32..=0.0,
        share in 0.0_f32..=1.0,
    ) {
        let hysteresis = share * upper.min(-lower);
        // Rounding may lift the hysteresis one step above a level; then it is refused, and rightly.
        let Ok(levels) = InterruptLevels::new(Celsius::new(upper), Celsius::new(lower), Celsius::new(hysteresis))
        else {
            return Ok(());
        };
        let tape = Tape::default();
        Amg8833::new(tape.clone(), Address::High).set_interrupt_levels(&levels).unwrap();
        let written: Vec<u8> = tape.events.borrow().iter().map(Event::value).collect();
        let mut sensor = Amg8833::new(Delivering::only(written), Address::High);
        prop_assert_eq!(sensor.interrupt_levels(), Ok(levels));
        prop_assert!((levels.upper().get() - upper).abs() <= 0.125);
        prop_assert!((levels.lower().get() - lower).abs() <= 0.125);
        prop_assert!((levels.hysteresis().get() - hysteresis).abs() <= 0.125);
    }
}

// Errors as a person and as a program sees them.

#[test]
fn the_error_of_the_bus_is_kept_whole() {
    let mut sensor = Amg8833::new(Broken, Address::High);
    let error = sensor.read_frame().unwrap_err();
    assert_eq!(error, Error::Bus(RemoteIo { errno: 121 }));
    assert_eq!(
        error.to_string(),
        "i2c transfer failed: remote i/o error 121"
    );
    let error: Box<dyn std::error::Error> = Box::new(error);
    assert!(error.source().is_none());
}

#[test]
fn messages_say_what_was_expected_and_found() {
    let short: Error<RemoteIo> = Error::ShortRead {
        register: 0x80,
        expected: 128,
        found: 64,
    };
    let mut lines = short.to_string();
    assert!(lines.contains("\nhint: "));
    lines.truncate(lines.find('\n').unwrap());
    assert_eq!(
        lines,
        "short read from register 0x80: expected 128 bytes, found 64"
    );

    let undefined: Error<RemoteIo> = UndefinedPowerMode { found: 0x01 }.into();
    assert!(undefined.to_string().starts_with(
        "undefined power mode: expected 0x00, 0x10, 0x20 or 0x21, found 0x01\nhint: "
    ));
}

// The buses of these tests.

/// A bus and a clock that write down what is asked of them; every read gives zeros.
#[derive(Clone, Default)]
struct Tape {
    events: Rc<RefCell<Vec<Event>>>,
}

#[derive(Debug, Clone, PartialEq, Eq)]
enum Event {
    Write(Vec<u8>),
    WriteRead(Vec<u8>, usize),
    WaitNs(u64),
}

impl Event {
    fn value(&self) -> u8 {
        match self {
            Self::Write(bytes) => bytes[1],
            Self::WriteRead(..) | Self::WaitNs(_) => panic!("not a write: {self:?}"),
        }
    }
}

impl Tape {
    fn transactions(&self) -> usize {
        self.events.borrow().len()
    }

    /// Address bytes included: one before what is written, one more before what is read.
    fn wire_bytes(&self) -> usize {
        self.events
            .borrow()
            .iter()
            .map(|event| match event {
                Event::Write(bytes) => 1 + bytes.len(),
                Event::WriteRead(bytes, count) => 1 + bytes.len() + 1 + count,
                Event::WaitNs(_) => 0,
            })
            .sum()
    }

    /// Nine bits a byte with its acknowledge, and one each for START, repeated START and STOP.
    fn wire_bits(&self) -> usize {
        let conditions: usize = self
            .events
            .borrow()
            .iter()
            .map(|event| match event {
                Event::Write(_) => 2,
                Event::WriteRead(..) => 3,
                Event::WaitNs(_) => 0,
            })
            .sum();
        9 * self.wire_bytes() + conditions
    }
}

fn waits(events: &[Event]) -> usize {
    events
        .iter()
        .filter(|event| matches!(event, Event::WaitNs(_)))
        .count()
}

impl ErrorType for Tape {
    type Error = ErrorKind;
}

impl I2c for Tape {
    fn transaction(&mut self, _: u8, operations: &mut [Operation<'_>]) -> Result<(), Self::Error> {
        let event = match operations {
            [Operation::Write(bytes)] => Event::Write(bytes.to_vec()),
            [Operation::Write(bytes), Operation::Read(buffer)] => {
                buffer.fill(0);
                Event::WriteRead(bytes.to_vec(), buffer.len())
            }
            other => panic!("neither a write nor a write and a read: {other:?}"),
        };
        self.events.borrow_mut().push(event);
        Ok(())
    }
}

impl embedded_hal::delay::DelayNs for Tape {
    fn delay_ns(&mut self, ns: u32) {
        self.events.borrow_mut().push(Event::WaitNs(u64::from(ns)));
    }

    fn delay_ms(&mut self, ms: u32) {
        self.events
            .borrow_mut()
            .push(Event::WaitNs(u64::from(ms) * 1_000_000));
    }
}

impl embedded_hal_async::delay::DelayNs for Tape {
    async fn delay_ns(&mut self, ns: u32) {
        embedded_hal::delay::DelayNs::delay_ns(self, ns);
    }

    async fn delay_ms(&mut self, ms: u32) {
        embedded_hal::delay::DelayNs::delay_ms(self, ms);
    }
}

/// A bus that reports success for every read and delivers only the first so many bytes of it.
struct Delivering {
    bytes: Vec<u8>,
    /// Reads that deliver nothing, before those that do.
    silent_reads: usize,
    reads: usize,
}

impl Delivering {
    fn nothing() -> Self {
        Self::only(Vec::new())
    }

    fn only(bytes: Vec<u8>) -> Self {
        Self {
            bytes,
            silent_reads: 0,
            reads: 0,
        }
    }
}

impl ErrorType for Delivering {
    type Error = ErrorKind;
}

impl I2c for Delivering {
    fn transaction(&mut self, _: u8, operations: &mut [Operation<'_>]) -> Result<(), Self::Error> {
        for operation in operations {
            if let Operation::Read(buffer) = operation {
                self.reads += 1;
                if self.reads > self.silent_reads {
                    let count = self.bytes.len().min(buffer.len());
                    buffer[..count].copy_from_slice(&self.bytes[..count]);
                }
            }
        }
        Ok(())
    }
}

/// A bus whose every transfer fails as on a Raspberry Pi without the sensor.
struct Broken;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct RemoteIo {
    errno: i32,
}

impl fmt::Display for RemoteIo {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "remote i/o error {}", self.errno)
    }
}

impl std::error::Error for RemoteIo {}

impl embedded_hal::i2c::Error for RemoteIo {
    fn kind(&self) -> ErrorKind {
        ErrorKind::NoAcknowledge(NoAcknowledgeSource::Unknown)
    }
}

impl ErrorType for Broken {
    type Error = RemoteIo;
}

impl I2c for Broken {
    fn transaction(&mut self, _: u8, _: &mut [Operation<'_>]) -> Result<(), Self::Error> {
        Err(RemoteIo { errno: 121 })
    }
}

/// An async bus over a blocking one that is not ready when it is first asked, as a real one is not.
struct Yielding<B> {
    bus: B,
}

impl<B> Yielding<B> {
    fn new(bus: B) -> Self {
        Self { bus }
    }
}

impl<B: ErrorType> ErrorType for Yielding<B> {
    type Error = B::Error;
}

impl<B: I2c> embedded_hal_async::i2c::I2c for Yielding<B> {
    async fn write(&mut self, address: u8, bytes: &[u8]) -> Result<(), Self::Error> {
        yield_once().await;
        self.bus.write(address, bytes)
    }

    async fn write_read(
        &mut self,
        address: u8,
        bytes: &[u8],
        buffer: &mut [u8],
    ) -> Result<(), Self::Error> {
        yield_once().await;
        self.bus.write_read(address, bytes, buffer)
    }

    async fn transaction(
        &mut self,
        address: u8,
        operations: &mut [Operation<'_>],
    ) -> Result<(), Self::Error> {
        yield_once().await;
        self.bus.transaction(address, operations)
    }
}

async fn yield_once() {
    let mut yielded = false;
    std::future::poll_fn(|_| {
        if yielded {
            Poll::Ready(())
        } else {
            yielded = true;
            Poll::Pending
        }
    })
    .await;
}

/// Polls a future to its end; no future of this crate is polled more often than it has transactions.
fn block_on<F: Future>(future: F) -> F::Output {
    const POLLS_MAX: usize = 100;
    let mut future = pin!(future);
    let mut context = Context::from_waker(Waker::noop());
    for _ in 0..POLLS_MAX {
        if let Poll::Ready(output) = future.as_mut().poll(&mut context) {
            return output;
        }
    }
    panic!("still not ready after {POLLS_MAX} polls")
}
