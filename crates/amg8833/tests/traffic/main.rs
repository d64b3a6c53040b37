//! The driver's bus traffic, transaction by transaction, blocking and async, and its decoding of the answers.
//!
//! Addresses and values are written out from the datasheet, not taken from the crate.
#![expect(
    clippy::unwrap_used,
    clippy::panic,
    reason = "the helpers of tests are allowed what tests are allowed"
)]

mod buses;
mod failures;
mod settings;
mod wire;

use amg8833::{
    Address, Amg8833, Configuration, Error, FrameRate, InterruptControl, InterruptLevels,
    InterruptMode, MovingAverage, PixelSet, PowerMode, Settings, Standby, Status,
    UndefinedPowerMode, asynch, word,
};
use buses::{Yielding, block_on};
use embedded_hal::i2c::{ErrorKind, NoAcknowledgeSource};
use embedded_hal_mock::eh1::delay::NoopDelay;
use embedded_hal_mock::eh1::i2c::{Mock, Transaction};
use grideye_frame::{Celsius, PixelIndex, PixelWord, RawFrame, ThermistorWord};

/// The sensor's address on the mocked bus, except where a test is about addresses.
const SENSOR: u8 = 0x69;

fn write(bytes: &[u8]) -> Transaction {
    Transaction::write(SENSOR, bytes.to_vec())
}

fn read(register: u8, answer: &[u8]) -> Transaction {
    Transaction::write_read(SENSOR, vec![register], answer.to_vec())
}

/// One test module per method. The blocking and the async driver must send these transactions and return this value. If
/// any transaction fails, they must return its error and send nothing more.
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

/// Pixel `n` holds `n` steps, except the first and last, which hold −0.25 and −55 °C.
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

// All settings at once.

fn settings() -> Settings {
    Settings {
        frame_rate: FrameRate::One,
        moving_average: MovingAverage::Twice,
        interrupt: ABSOLUTE_ON,
        levels: levels(),
    }
}

/// `settings()` in registers 0x00 to 0x0D, with arbitrary values in the write-only and reserved ones.
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
fn a_sensor_that_reset_itself_is_recognized() {
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

    // With the default settings, only the levels reveal a reset.
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
        // The byte that fills a buffer before a read causes a second read.
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
