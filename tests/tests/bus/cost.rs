//! The bus cost of a frame, counted on the emulated wire, against the theoretical minimum.

#![expect(clippy::unwrap_used, reason = "what fails in a helper fails the test")]

use amg8833::timing::{READ_BITS, read_time};
use amg8833::{Amg8833, Settings};
use amg8833_emulator::{Address, Bus, Clock as _, ManualClock, Traffic};
use embedded_hal::delay::DelayNs;
use embedded_hal::i2c::I2c;
use grideye_frame::{Celsius, Frame};
use std::num::NonZeroU32;
use std::time::Duration;

const PIXEL_REGISTERS: u8 = 0x80;
const THERMISTOR_REGISTER: u8 = 0x0E;

/// Waits by advancing the emulated time.
struct Waits<'a>(&'a ManualClock);

impl DelayNs for Waits<'_> {
    fn delay_ns(&mut self, nanoseconds: u32) {
        self.0.advance(Duration::from_nanos(nanoseconds.into()));
    }
}

type Sensor<'a> = Bus<&'a ManualClock, Frame>;
type Way = fn(Sensor<'_>) -> Traffic;

/// Time and traffic of one way to read a frame and the thermistor.
fn cost(scl_hz: u32, read: Way) -> (Duration, Traffic) {
    let clock = ManualClock::new();
    let bus = Bus::with_sensor(&clock, Address::High, Frame::uniform(Celsius::new(21.5)))
        .with_scl_hz(NonZeroU32::new(scl_hz).unwrap());
    let mut driver = Amg8833::new(bus, amg8833::Address::High);
    driver
        .init(&mut Waits(&clock), &Settings::default())
        .unwrap();
    let bus = driver.release();
    let before = (clock.now(), bus.traffic());
    let after = read(bus);
    let spent = Traffic {
        transactions: after.transactions - before.1.transactions,
        bytes: after.bytes - before.1.bytes,
        bits: after.bits - before.1.bits,
        nacks: after.nacks - before.1.nacks,
    };
    (clock.now() - before.0, spent)
}

fn with_the_driver(bus: Sensor<'_>) -> Traffic {
    let mut driver = Amg8833::new(bus, amg8833::Address::High);
    driver.read_frame().unwrap();
    driver.release().traffic()
}

fn pixel_by_pixel(mut bus: Sensor<'_>) -> Traffic {
    let mut word = [0; 2];
    for pixel in 0..64 {
        bus.write_read(0x69, &[PIXEL_REGISTERS + 2 * pixel], &mut word)
            .unwrap();
    }
    bus.write_read(0x69, &[THERMISTOR_REGISTER], &mut word)
        .unwrap();
    bus.traffic()
}

/// [`READ_BITS`] is the theoretical minimum.
#[test]
fn the_driver_reads_a_frame_at_the_floor_of_the_bus() {
    assert_eq!(READ_BITS, 1230);
    println!(
        "way                        SCL       transactions  bytes  bits   time       floor      floor/time"
    );
    for scl_hz in [100_000, 400_000] {
        let floor = read_time(scl_hz.try_into().unwrap());
        let ways: [(&str, Way); 2] = [
            ("this driver", with_the_driver),
            ("64 pixels one by one", pixel_by_pixel),
        ];
        for (way, read) in ways {
            let (time, spent) = cost(scl_hz, read);
            println!(
                "{way:<25}  {:>3} kHz   {:>12}  {:>5}  {:>5}  {:>7.3} ms  {:>6.3} ms  {:>5.1} %",
                scl_hz / 1000,
                spent.transactions,
                spent.bytes,
                spent.bits,
                time.as_secs_f64() * 1e3,
                floor.as_secs_f64() * 1e3,
                100.0 * floor.as_secs_f64() / time.as_secs_f64()
            );
            let expected = if way == "this driver" {
                (2, 136, 1230)
            } else {
                (65, 325, 3120)
            };
            assert_eq!(
                (spent.transactions, spent.bytes, spent.bits),
                expected,
                "{way}"
            );
            assert_eq!(spent.nacks, 0);
            assert_eq!(
                time,
                Duration::from_secs(spent.bits) / scl_hz,
                "{way} at {scl_hz} Hz"
            );
        }
    }
}
