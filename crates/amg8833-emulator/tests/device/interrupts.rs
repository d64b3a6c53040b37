//! Reference section 2.6: levels, hysteresis, both modes, table, flags, pin.

use crate::support::*;
use amg8833_emulator::{
    Address, Bus, InterruptFlag, InterruptPin, ManualClock, Options, OverflowFlag, PinError,
    SharedBus, StatusClear, ThermistorUpdate,
};
use core::time::Duration;
use embedded_hal::digital::InputPin;
use grideye_frame::{Celsius, Frame};
use std::cell::RefCell;

const ABSOLUTE: [u8; 2] = [0x03, 0x03];
const DIFFERENCE: [u8; 2] = [0x03, 0x01];
/// Upper 30.00, lower -5.00, hysteresis 1.00 degrees: 0x078, 0xFEC (AMG88 spec §4-11-8), 0x004.
const LEVELS: [u8; 7] = [0x08, 0x78, 0x00, 0xEC, 0x0F, 0x04, 0x00];

/// One temperature per tick; the last one stays.
fn sequence(temperatures: &'static [f32]) -> impl FnMut(Duration) -> Frame {
    move |t| {
        let tick = usize::try_from(t.as_millis() / 100).unwrap();
        uniform(temperatures[(tick - 1).min(temperatures.len() - 1)])
    }
}

/// The status register after each tick.
fn statuses(mut rig: Rig, ticks: u64) -> Vec<u8> {
    (1..=ticks)
        .map(|tick| {
            rig.set(100 * tick);
            rig.register(0x04)
        })
        .collect()
}

fn rig(temperatures: &'static [f32], mode: [u8; 2], options: Options) -> Rig {
    let mut rig = Rig::with(sequence(temperatures), options);
    rig.write(&LEVELS);
    rig.write(&mode);
    rig
}

fn pin(rig: &mut Rig) -> InterruptPin {
    rig.bus.interrupt_pin(Address::High).unwrap()
}

#[test]
fn absolute_mode_trips_beyond_a_level_not_on_it_and_releases_a_hysteresis_inside() {
    let upper = rig(
        &[30.0, 30.25, 30.0, 29.25, 29.0, 30.0],
        ABSOLUTE,
        Options::default(),
    );
    assert_eq!(statuses(upper, 6), [0, 2, 2, 2, 0, 0]);
    let lower = rig(
        &[-5.0, -5.25, -5.0, -4.25, -4.0, -5.0],
        ABSOLUTE,
        Options::default(),
    );
    assert_eq!(statuses(lower, 6), [0, 2, 2, 2, 0, 0]);
}

#[test]
fn difference_mode_compares_with_the_frame_before() {
    let mut jumps = Rig::new(sequence(&[20.0, 22.0, 24.25, 24.25, 22.0, 19.5]));
    // Upper +2.00, lower -2.25, no hysteresis.
    jumps.write(&[0x08, 0x08, 0x00, 0xF7, 0x0F, 0x00, 0x00]);
    jumps.write(&DIFFERENCE);
    assert_eq!(statuses(jumps, 6), [0, 0, 2, 0, 0, 2]);
}

#[test]
fn the_first_frame_after_a_wake_or_reset_has_nothing_to_differ_from() {
    let mut rig = Rig::new(sequence(&[20.0, 20.0, 40.0]));
    rig.write(&DIFFERENCE);
    rig.set(150);
    rig.write(&SLEEP);
    rig.set(450);
    rig.write(&NORMAL);
    rig.set(500);
    assert_eq!((rig.word(), rig.register(0x04)), (160, 0x00));
    rig.write(&INITIAL_RESET);
    rig.set(700);
    assert_eq!((rig.word(), rig.register(0x04)), (160, 0x00));
}

#[test]
fn extreme_differences_stay_within_twelve_bits() {
    let mut rig = Rig::new(sequence(&[-512.0, 511.75, -512.0]));
    rig.write(&[0x08, 0xFF, 0x07, 0x00, 0x08, 0x00, 0x00]);
    rig.write(&DIFFERENCE);
    assert_eq!(
        statuses(rig, 3),
        [0, 0, 0],
        "no 12-bit value is beyond 0x7FF or 0x800"
    );
}

/// AMG88 spec §4-11-10: bit b of INTn is pixel 8n+b+1.
#[test]
fn each_pixel_has_its_bit_in_the_table() {
    for number in 1..=64 {
        let mut rig = Rig::new(move |_| with_pixel(20.0, number, 30.25));
        rig.write(&LEVELS);
        rig.write(&ABSOLUTE);
        rig.set(100);
        let mut expected = [0; 8];
        expected[(number - 1) / 8] = 1 << ((number - 1) % 8);
        assert_eq!(rig.read(0x10, 8), expected, "pixel {number}");
        assert_eq!(rig.register(0x04), 0x02);
    }
}

#[test]
fn the_flag_does_not_need_the_pin_and_the_pin_needs_the_flag() {
    let mut rig = rig(&[31.0], [0x03, 0x02], Options::default());
    rig.set(100);
    assert_eq!(rig.register(0x04), 0x02, "INTF is independent of INTEN");
    assert_eq!(pin(&mut rig), InterruptPin::HighZ);
    rig.write(&ABSOLUTE);
    assert_eq!(pin(&mut rig), InterruptPin::Low);
    rig.write(&[0x05, 0x02]);
    assert_eq!(pin(&mut rig), InterruptPin::HighZ);
    rig.set(200);
    assert_eq!(
        pin(&mut rig),
        InterruptPin::Low,
        "asserted again by the next frame"
    );
    rig.write(&SLEEP);
    assert_eq!(pin(&mut rig), InterruptPin::HighZ);
}

/// Section 2.2: SCLR clears flags, 0x30 clears flags and table, as documented for the default options.
#[test]
fn the_status_clear_register_clears_what_is_selected_and_reads_zero() {
    let mut rig = rig(&[600.0], ABSOLUTE, Options::default());
    rig.set(100);
    assert_eq!(
        rig.register(0x04),
        0x06,
        "above the level, and beyond the register"
    );
    rig.write(&[0x05, 0x02]);
    assert_eq!(rig.register(0x04), 0x04);
    assert_eq!(rig.read(0x10, 8), [0xFF; 8], "the table stays");
    assert_eq!(rig.register(0x05), 0x00);
    rig.write(&[0x05, 0xF1]);
    assert_eq!(rig.register(0x04), 0x04, "neither is selected");
    rig.write(&[0x05, 0x04]);
    assert_eq!(rig.register(0x04), 0x00);
    rig.write(&FLAG_RESET);
    assert_eq!(rig.read(0x10, 8), [0; 8]);
    assert_eq!(rig.word(), 0x7FF, "pixels hold");
    rig.write(&[0x01, 0x31]);
    rig.set(200);
    assert_eq!(rig.register(0x04), 0x06, "still outside: asserted again");
}

#[test]
fn the_status_clear_register_clears_the_table_by_option() {
    let options = Options {
        status_clear: StatusClear::FlagsAndTable,
        ..Options::default()
    };
    let mut rig = rig(&[600.0], ABSOLUTE, options);
    rig.set(100);
    rig.write(&[0x05, 0x04]);
    assert_eq!(rig.read(0x10, 8), [0xFF; 8], "INTCLR was not selected");
    rig.write(&[0x05, 0x02]);
    assert_eq!(rig.read(0x10, 8), [0; 8]);
}

/// Section 2.6, latching: by default the flag follows the frames, but the overflow does not.
#[test]
fn the_overflow_stays_until_cleared() {
    let mut rig = rig(&[600.0, 20.0], ABSOLUTE, Options::default());
    rig.set(200);
    assert_eq!(rig.register(0x04), 0x04);
    assert_eq!(rig.read(0x10, 8), [0; 8]);
    rig.write(&[0x05, 0x04]);
    rig.set(300);
    assert_eq!(rig.register(0x04), 0x00);
}

#[test]
fn flag_and_table_hold_until_cleared_by_option() {
    let options = Options {
        interrupt_flag: InterruptFlag::HoldsUntilCleared,
        ..Options::default()
    };
    let mut rig = rig(&[31.0, 20.0], ABSOLUTE, options);
    rig.set(300);
    assert_eq!(rig.register(0x04), 0x02);
    assert_eq!(rig.read(0x10, 8), [0xFF; 8]);
    assert_eq!(pin(&mut rig), InterruptPin::Low);
    rig.write(&[0x05, 0x02]);
    rig.set(400);
    assert_eq!(rig.register(0x04), 0x00, "cleared: nothing trips now");
    rig.write(&FLAG_RESET);
    assert_eq!(rig.read(0x10, 8), [0; 8]);
}

/// A flag reset also ends an interrupt held only by the hysteresis (section 2.6, users of the hardware).
#[test]
fn a_flag_reset_releases_what_only_the_hysteresis_holds() {
    let mut rig = rig(&[31.0, 29.5], ABSOLUTE, Options::default());
    rig.set(200);
    assert_eq!(rig.register(0x04), 0x02);
    rig.write(&FLAG_RESET);
    rig.set(300);
    assert_eq!(rig.register(0x04), 0x00);
}

/// Only the 2011 specification has OVF_THS.
#[test]
fn the_thermistors_overflow_by_option() {
    let hot = |_| Frame {
        thermistor: Celsius::new(200.0),
        ..uniform(20.0)
    };
    for (thermistor_overflow_flag, status) in [(false, 0x00), (true, 0x08)] {
        let options = Options {
            thermistor_overflow_flag,
            ..Options::default()
        };
        let mut rig = Rig::with(hot, options);
        rig.set(100);
        assert_eq!(rig.register(0x04), status);
        assert_eq!(rig.read(0x0E, 2), [0xFF, 0x07]);
        rig.write(&[0x05, 0x08]);
        assert_eq!(rig.register(0x04), 0x00);
    }
}

#[test]
fn a_value_that_is_no_number_is_an_overflow() {
    let mut rig = Rig::new(|_| with_pixel(20.0, 3, f32::NAN));
    rig.set(100);
    assert_eq!(rig.register(0x04) & 0x04, 0x04);
    assert_eq!(rig.pixels()[2], 0x7FF);
}

#[test]
fn the_int_pin_is_an_input_pin_beside_the_driver() {
    let bus = RefCell::new(Bus::with_sensor(
        ManualClock::new(),
        Address::High,
        uniform(31.0),
    ));
    let mut driver = SharedBus::new(&bus);
    let mut pin = driver.int_pin(Address::High);
    assert_eq!(
        driver.int_pin(Address::Low).is_high(),
        Ok(true),
        "nobody pulls it low"
    );
    use embedded_hal::i2c::I2c;
    driver.write(HIGH, &LEVELS).unwrap();
    driver.write(HIGH, &ABSOLUTE).unwrap();
    assert_eq!(pin.is_high(), Ok(true));
    bus.borrow().clock().advance(Duration::from_millis(100));
    assert_eq!(pin.is_low(), Ok(true));
    let held = bus.borrow();
    assert_eq!(pin.is_low(), Err(PinError::Borrowed));
    assert_eq!(
        driver.write(HIGH, &[]),
        Err(amg8833_emulator::BusError::ArbitrationLoss)
    );
    drop(held);
}

/// Section 2.6: in the 2011 specification, the word 0xFFF sets the overflow flags; it is also -0.25 degrees in a pixel.
/// In the 2016 one, a converter overflow sets them.
#[test]
fn the_overflow_flags_in_both_readings() {
    let expected = [
        (OverflowFlag::Saturation, -0.25, 20.0, 0x00),
        (OverflowFlag::Saturation, 600.0, 20.0, 0x04),
        (OverflowFlag::Saturation, 20.0, -128.0, 0x08),
        (OverflowFlag::Saturation, 20.0, -127.9375, 0x00),
        (OverflowFlag::WordFff, -0.25, 20.0, 0x04),
        (OverflowFlag::WordFff, 600.0, 20.0, 0x00),
        (OverflowFlag::WordFff, 20.0, -127.9375, 0x08),
        (OverflowFlag::WordFff, 20.0, 200.0, 0x00),
    ];
    for (overflow_flag, pixel, thermistor, status) in expected {
        let options = Options {
            overflow_flag,
            thermistor_overflow_flag: true,
            ..Options::default()
        };
        let source = move |_| Frame {
            thermistor: Celsius::new(thermistor),
            ..with_pixel(20.0, 33, pixel)
        };
        let mut rig = Rig::with(source, options);
        rig.write(&[0x09, 0x07]);
        rig.set(100);
        let found = rig.register(0x04) & 0x0C;
        assert_eq!(found, status, "{overflow_flag:?} {pixel} {thermistor}");
    }
}

/// AMG88 spec §4-11-8: a hysteresis beyond the level makes the output incorrect. Here a tripped pixel stays tripped,
/// since it never comes a whole hysteresis inside.
#[test]
fn a_hysteresis_beyond_the_level_never_releases() {
    let mut rig = Rig::new(sequence(&[31.0, 20.0, 0.0, -5.0, 20.0]));
    rig.write(&[0x08, 0x78, 0x00, 0xEC, 0x0F, 0xA0, 0x00]);
    rig.write(&ABSOLUTE);
    assert_eq!(statuses(rig, 5), [2, 2, 2, 2, 2]);
}

/// Section 1.4 leaves open whether the thermistor is part of the snapshot.
#[test]
fn the_thermistor_in_both_readings() {
    let t_and_p = |t: Duration| Frame {
        thermistor: Celsius::new(f32::from(u16::try_from(t.as_millis() / 100).unwrap())),
        ..counting(t)
    };
    for (thermistor_update, in_transaction, at_one_fps) in [
        (ThermistorUpdate::WithFrame, [1, 1], 88),
        (ThermistorUpdate::EveryTick, [1, 2], 13 * 16),
    ] {
        let options = Options {
            thermistor_update,
            ..Options::default()
        };
        let asked = std::rc::Rc::new(RefCell::new(Vec::new()));
        let log = std::rc::Rc::clone(&asked);
        let source = move |t: Duration| {
            log.borrow_mut().push(t.as_millis());
            t_and_p(t)
        };
        let mut rig = Rig::with(source, options);
        rig.set(150);
        let device = rig.device();
        let thermistor = |device: &mut amg8833_emulator::Device<Source>, now| {
            device.start_write(ms(now));
            device.write(0x0E, ms(now));
            device.start_read(ms(now));
            u16::from_le_bytes([device.read(ms(now)), device.read(ms(now))]) / 16
        };
        let read = [thermistor(device, 150), thermistor(device, 260)];
        assert_eq!(read, in_transaction, "{thermistor_update:?}");
        device.start_write(ms(261));
        device.write(0x80, ms(261));
        device.start_read(ms(261));
        assert_eq!(device.read(ms(262)), 1, "the pixels stand still");
        let late = thermistor(device, 370);
        assert_eq!(late, in_transaction[1], "once in each transaction");
        device.stop(ms(380));
        assert_eq!(rig.word(), 3);
        assert_eq!(rig.frames(), 3);
        assert_eq!(*asked.borrow(), [100, 200, 300], "each tick once");

        let mut rig = Rig::with(t_and_p, options);
        rig.write(&ONE_FPS);
        rig.set(1_350);
        let word = words(&rig.read(0x0E, 2))[0];
        assert_eq!(word, at_one_fps, "5.5 degrees, or those of tick 13");
    }
}

/// Section 2.7: the thermistor's registers at power-on are 0x000 in the 2011 specification and unspecified in the 2016
/// one.
#[test]
fn the_thermistor_at_power_on_by_option() {
    let options = Options {
        thermistor_at_power_on: 0xF190,
        ..Options::default()
    };
    let mut rig = Rig::with(constant(20.0), options);
    assert_eq!(rig.read(0x0E, 2), [0x90, 0x01]);
    rig.set(100);
    assert_eq!(rig.read(0x0E, 2), [0x40, 0x01]);
}
