//! `grideye` 0.3.0 (embedded-hal 1.0): every access is a write, STOP, and a read.

use crate::sensor::*;
use uwearzt_grideye::{Address, Framerate, GridEye, Power};

fn driver(sensor: &Sensor) -> GridEye<Handle<'_>> {
    GridEye::new(Handle::new(sensor), Address::Standard)
}

/// Its decoder of negative words: inverts the bits, but omits the one that two's complement adds.
fn their_negative(word: u16, step: f32) -> f32 {
    f32::from(!word & 0x7FF) * -step
}

fn their_pixel(word: u16) -> f32 {
    if word & 0x800 == 0 {
        f32::from(word) * 0.25
    } else {
        their_negative(word, 0.25)
    }
}

/// Pixel values. (word, the driver's value, true value)
const PIXELS: [(u16, f32, f32); 11] = [
    (0x1F4, 125.0, 125.0),
    (0x064, 25.0, 25.0),
    (0x001, 0.25, 0.25),
    (0x000, 0.0, 0.0),
    (0x7FF, 511.75, 511.75),
    // One step too warm below zero: one's complement instead of two's.
    (0xFFF, -0.0, -0.25),
    (0xFEC, -4.75, -5.0),
    (0xFD8, -9.75, -10.0),
    (0xF9C, -24.75, -25.0),
    (0xF24, -54.75, -55.0),
    (0x800, -511.75, -512.0),
];

#[test]
fn pixels() {
    for (word, theirs, truth) in PIXELS {
        let sensor = sensor(move |_| uniform(truth));
        set(&sensor, 100);
        let mut driver = driver(&sensor);
        assert_eq!(driver.get_pixel_temperature_raw(63).unwrap(), word);
        let found = driver.get_pixel_temperature_celsius(0).unwrap();
        assert_eq!(found, theirs, "0x{word:03x}");
        assert_eq!(true_pixel(word), truth);
    }
}

/// Thermistor values: the driver decodes sign and magnitude like the pixels' format. (word, the driver's value, true
/// value)
const THERMISTORS: [(u16, f32, f32); 8] = [
    (0x7FF, 127.9375, 127.9375),
    (0x190, 25.0, 25.0),
    (0x004, 0.25, 0.25),
    (0x000, 0.0, 0.0),
    (0x804, -127.6875, -0.25),
    (0x808, -127.4375, -0.5),
    (0x940, -107.9375, -20.0),
    (0xBBB, -68.25, -59.6875),
];

#[test]
fn thermistor() {
    for (word, theirs, truth) in THERMISTORS {
        let sensor = sensor(move |_| warm_chip(truth));
        set(&sensor, 100);
        let mut driver = driver(&sensor);
        assert_eq!(driver.get_device_temperature_raw().unwrap(), word);
        let found = driver.get_device_temperature_celsius().unwrap();
        assert_eq!(found, theirs, "0x{word:03x}");
        assert_eq!(true_thermistor(word), truth);
    }
}

/// Levels set in degrees: encoded as whole degrees instead of quarters, with a sign bit. (degrees set, word in the
/// registers, the sensor's value, the driver's value)
const LEVELS: [(f32, u16, f32, f32); 5] = [
    (30.0, 0x01E, 7.5, 7.5),
    (30.75, 0x01E, 7.5, 7.5),
    (0.25, 0x000, 0.0, 0.0),
    (-5.0, 0x805, -510.75, -510.5),
    (-20.0, 0x814, -507.0, -506.75),
];

#[test]
fn levels() {
    for (degrees, word, sensors, theirs) in LEVELS {
        let sensor = sensor(|_| uniform(20.0));
        let mut driver = driver(&sensor);
        driver.set_upper_int_value_celsius(degrees).unwrap();
        driver.set_lower_int_value_celsius(degrees).unwrap();
        driver.set_int_hysteresis_celsius(degrees).unwrap();
        assert_eq!(words(&sensor, 0x08, 3), [word; 3], "{degrees}");
        assert_eq!(true_pixel(word), sensors);
        assert_eq!(driver.upper_int_value_celsius().unwrap(), theirs);
        assert_eq!(driver.lower_int_value_celsius().unwrap(), theirs);
        assert_eq!(driver.hysteresis_int_value_celsius().unwrap(), theirs);
    }
}

/// Its flag getters read the interrupt control register (0x03) instead of the status register (0x04). Its "enabled" is
/// the mode bit, and difference mode cannot be set.
#[test]
fn interrupts() {
    let sensor = sensor(|_| uniform(31.0));
    let mut driver = driver(&sensor);
    driver.set_upper_int_value_raw(0x078).unwrap();
    driver.enable_interrupt().unwrap();
    assert_eq!(registers(&sensor, 0x03, 1), [0x01], "right");
    assert!(!driver.interrupt_enabled().unwrap(), "wrong: it is");
    driver.interrupt_mode_absolut().unwrap();
    assert_eq!(registers(&sensor, 0x03, 1), [0x03], "right");
    assert!(driver.interrupt_enabled().unwrap(), "right by chance");

    assert!(driver.interrupt_flag_set().unwrap(), "wrong: no frame yet");
    set(&sensor, 100);
    assert_eq!(registers(&sensor, 0x04, 1), [0x02]);
    assert!(driver.interrupt_flag_set().unwrap(), "right by chance");
    for pixel in 0..64 {
        assert!(driver.pixel_interrupt_enabled(pixel).unwrap(), "right");
    }
    driver.clear_interrupt_flag().unwrap();
    assert_eq!(registers(&sensor, 0x04, 1), [0x00], "right");
    assert!(driver.interrupt_flag_set().unwrap(), "wrong: cleared");

    driver.interrupt_mode_difference().unwrap();
    assert_eq!(registers(&sensor, 0x03, 1), [0x03], "wrong: still absolute");
    driver.disable_interrupt().unwrap();
    assert_eq!(registers(&sensor, 0x03, 1), [0x02], "right");
}

#[test]
fn overflow_is_never_seen_and_can_be_cleared() {
    let sensor = sensor(|_| uniform(600.0));
    set(&sensor, 100);
    let mut driver = driver(&sensor);
    assert_eq!(registers(&sensor, 0x04, 1), [0x04]);
    assert!(!driver.pixel_temperature_out_ok().unwrap(), "wrong");
    driver.clear_device_temperature_overflow().unwrap();
    assert_eq!(registers(&sensor, 0x04, 1), [0x04], "right: another flag");
    driver.clear_pixel_temperatur_overflow().unwrap();
    assert_eq!(registers(&sensor, 0x04, 1), [0x00], "right");
    set(&sensor, 200);
    driver.clear_all_status().unwrap();
    assert_eq!(registers(&sensor, 0x04, 1), [0x00], "right");
}

#[test]
fn modes_rate_and_moving_average() {
    let sensor = sensor(|_| uniform(20.0));
    let mut driver = driver(&sensor);
    driver.set_framerate(Framerate::Fps1).unwrap();
    assert!(matches!(driver.get_framerate().unwrap(), Framerate::Fps1));
    driver.set_framerate(Framerate::Fps10).unwrap();
    assert!(matches!(driver.get_framerate().unwrap(), Framerate::Fps10));
    driver.enable_moving_average().unwrap();
    assert!(driver.moving_average_enabled().unwrap(), "its key is right");
    driver.disable_moving_average().unwrap();
    assert!(!driver.moving_average_enabled().unwrap());

    set(&sensor, 100);
    driver.power(Power::Sleep).unwrap();
    assert_eq!(registers(&sensor, 0x00, 1), [0x10]);
    assert_eq!(driver.get_pixel_temperature_raw(0).unwrap(), 0);
    driver.power(Power::Wakeup).unwrap();
    assert_eq!(driver.get_pixel_temperature_raw(0).unwrap(), 80);
    driver.power(Power::Standby10Seconds).unwrap();
    assert_eq!(registers(&sensor, 0x00, 1), [0x21]);
}

/// Reads a frame, in 128 transactions.
fn frame(driver: &mut GridEye<Handle<'_>>) -> Vec<f32> {
    (0..64)
        .map(|pixel| driver.get_pixel_temperature_celsius(pixel).unwrap())
        .collect()
}

#[test]
fn a_person_who_walks_through() {
    for colder_by in [0.0, 40.0] {
        let sensor = sensor(person(colder_by));
        let mut driver = driver(&sensor);
        let mut contrasts = Vec::new();
        for tenth in 1..=60 {
            set(&sensor, 100 * tenth);
            let words = words(&sensor, 0x80, 64);
            let theirs: Vec<f32> = words.iter().copied().map(their_pixel).collect();
            let found = frame(&mut driver);
            assert_eq!(found, theirs);
            for (found, word) in found.iter().zip(&words) {
                let error = if *word >= 0x800 { 0.25 } else { 0.0 };
                assert_eq!(*found, true_pixel(*word) + error);
            }
            assert_eq!(words.iter().all(|word| *word >= 0x800), colder_by > 0.0);
            contrasts.push(contrast(&sensor));
        }
        let most = contrasts.iter().copied().fold(0.0, f32::max);
        let least = contrasts.iter().copied().fold(f32::MAX, f32::min);
        assert!(
            most >= 1.75 && least <= 0.75,
            "comes and goes: {contrasts:?}"
        );
    }
}

#[test]
fn what_a_frame_and_the_thermistor_cost() {
    let sensor = sensor(|_| uniform(20.0));
    let mut driver = driver(&sensor);
    frame(&mut driver);
    driver.get_device_temperature_raw().unwrap();
    let traffic = sensor.borrow().traffic();
    assert_eq!(
        (traffic.transactions, traffic.bytes, traffic.bits),
        (130, 325, 3_185),
        "section 5 of the reference"
    );
}
