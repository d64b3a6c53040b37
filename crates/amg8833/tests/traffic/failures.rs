//! Buses that report success for reads they did not carry out, and errors as people and programs see them.

use crate::buses::{Broken, Delivering, Event, RemoteIo, Tape, Yielding, block_on};
use crate::{pixel_bytes, pixel_words};
use amg8833::{Address, Amg8833, Error, InterruptLevels, UndefinedPowerMode, asynch};
use grideye_frame::{Celsius, PixelWord};
use proptest::prelude::*;

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
        // Rounding may lift the hysteresis one step above a level, which is then rejected as it should be.
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
