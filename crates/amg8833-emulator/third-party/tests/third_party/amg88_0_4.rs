//! `amg88` 0.4.1 (embedded-hal 0.2): bursts, and one byte read after every write.

use crate::sensor::*;
use amg88::{Address, FrameRateValue, GridEye, InterruptControlMode, PowerControlValue};

fn driver(sensor: &Sensor) -> GridEye<Handle<'_>> {
    GridEye::new(Handle::new(sensor), Address::High)
}

/// All its conversions of the sensor's words are right. (word, the driver's and true value)
const PIXELS: [(u16, f32); 10] = [
    (0x1F4, 125.0),
    (0x064, 25.0),
    (0x001, 0.25),
    (0x000, 0.0),
    (0x7FF, 511.75),
    (0xFFF, -0.25),
    (0xFEC, -5.0),
    (0xF9C, -25.0),
    (0xF24, -55.0),
    (0x800, -512.0),
];

#[test]
fn pixels() {
    for (word, celsius) in PIXELS {
        let sensor = sensor(move |_| uniform(celsius));
        set(&sensor, 100);
        assert_eq!(words(&sensor, 0x80, 64), [word; 64]);
        let image = driver(&sensor).image().unwrap();
        assert!(image.iter().all(|pixel| *pixel == celsius), "{celsius}");
        assert_eq!(true_pixel(word), celsius);
    }
}

const THERMISTORS: [(u16, f32); 8] = [
    (0x7FF, 127.9375),
    (0x190, 25.0),
    (0x004, 0.25),
    (0x000, 0.0),
    (0x804, -0.25),
    (0x808, -0.5),
    (0x940, -20.0),
    (0xBBB, -59.6875),
];

#[test]
fn thermistor() {
    for (word, celsius) in THERMISTORS {
        let sensor = sensor(move |_| warm_chip(celsius));
        set(&sensor, 100);
        assert_eq!(words(&sensor, 0x0E, 1), [word]);
        assert_eq!(driver(&sensor).thermistor().unwrap(), celsius);
        assert_eq!(true_thermistor(word), celsius);
    }
}

/// (degrees set, word in the registers, degrees the driver reads back, true degrees)
const LEVELS: [(f32, u16, f32, f32); 7] = [
    (30.0, 0x078, 30.0, 30.0),
    (511.75, 0x7FF, 511.75, 511.75),
    (-5.0, 0xFEC, -5.0, -5.0),
    (-10.0, 0xFD8, -10.0, -10.0),
    (-512.0, 0x800, -512.0, -512.0),
    // Truncated instead of rounded.
    (30.2, 0x078, 30.0, 30.25),
    // Less than a step below zero becomes 0x1000, beyond the sensor's twelve bits.
    (-0.2, 0x000, 0.0, -0.25),
];

#[test]
fn levels() {
    for (degrees, word, theirs, truth) in LEVELS {
        let sensor = sensor(|_| uniform(20.0));
        let mut driver = driver(&sensor);
        driver.set_upper_interrupt_level(&degrees).unwrap();
        driver.set_lower_interrupt_level(&degrees).unwrap();
        driver.set_hysteresis_interrupt_level(&degrees).unwrap();
        assert_eq!(words(&sensor, 0x08, 3), [word; 3], "{degrees}");
        assert_eq!(driver.upper_interrupt_level().unwrap(), theirs);
        assert_eq!(driver.lower_interrupt_level().unwrap(), theirs);
        assert_eq!(driver.hysteresis_interrupt_level().unwrap(), theirs);
        assert_eq!((degrees * 4.0).round() / 4.0, truth);
    }
}

/// A level beyond twelve bits panics instead of returning an error.
#[test]
fn a_level_out_of_range_panics() {
    let caught = std::panic::catch_unwind(|| {
        let sensor = sensor(|_| uniform(20.0));
        let _ = driver(&sensor).set_upper_interrupt_level(&600.0);
    });
    assert!(caught.is_err());
}

#[test]
fn interrupts_trip_and_clear() {
    let sensor = sensor(|t| uniform(if t.as_millis() < 500 { 20.0 } else { 31.0 }));
    let mut driver = driver(&sensor);
    driver
        .set_interrupt_mode(InterruptControlMode::Absolute)
        .unwrap();
    driver.set_upper_interrupt_level(&30.0).unwrap();
    driver.set_lower_interrupt_level(&-5.0).unwrap();
    driver.enable_interrupts().unwrap();
    assert!(driver.interrupts_enabled().unwrap());
    assert_eq!(
        driver.interrupt_mode().unwrap(),
        InterruptControlMode::Absolute
    );
    set(&sensor, 499);
    assert!(!driver.interrupt_flag().unwrap());
    set(&sensor, 500);
    assert!(driver.interrupt_flag().unwrap() && !driver.overflow_flag().unwrap());
    driver.clear_interrupt_flag().unwrap();
    assert!(!driver.interrupt_flag().unwrap());
    set(&sensor, 600);
    assert!(driver.interrupt_flag().unwrap(), "still there");
    driver.reset_flags().unwrap();
    assert!(!driver.interrupt_flag().unwrap());
    driver.disable_interrupts().unwrap();
    assert!(!driver.interrupts_enabled().unwrap());
}

#[test]
fn overflow() {
    let sensor = sensor(|_| uniform(600.0));
    set(&sensor, 100);
    let mut driver = driver(&sensor);
    assert!(driver.overflow_flag().unwrap());
    driver.clear_overflow_flag().unwrap();
    assert!(!driver.overflow_flag().unwrap());
    driver.clear_all_flags().unwrap();
    assert!(!driver.interrupt_flag().unwrap());
}

#[test]
fn modes_rate_resets_and_moving_average() {
    let sensor = sensor(|_| uniform(-0.25));
    let mut driver = driver(&sensor);
    driver.set_frame_rate(FrameRateValue::Fps1).unwrap();
    assert_eq!(driver.frame_rate().unwrap(), FrameRateValue::Fps1);
    driver.set_frame_rate(FrameRateValue::Fps10).unwrap();
    driver.enable_moving_average().unwrap();
    assert!(driver.moving_average_enabled().unwrap(), "its key is right");
    driver.disable_moving_average().unwrap();
    assert!(!driver.moving_average_enabled().unwrap());

    set(&sensor, 100);
    for mode in [
        PowerControlValue::Standby10,
        PowerControlValue::Standby60,
        PowerControlValue::Sleep,
    ] {
        driver.set_power_mode(mode).unwrap();
        assert_eq!(driver.power_mode().unwrap(), mode);
    }
    assert_eq!(
        driver.thermistor().unwrap(),
        -0.0,
        "0x8000 in sleep, read as 0"
    );
    driver.set_power_mode(PowerControlValue::Normal).unwrap();
    driver.reset_initial().unwrap();
    driver.reset_flags().unwrap();
    assert_eq!(driver.image().unwrap()[[7, 7]], 0.0);
    set(&sensor, 300);
    assert_eq!(driver.image().unwrap()[[7, 7]], -0.25);
}

#[test]
fn a_person_who_walks_through() {
    for colder_by in [0.0, 40.0] {
        let sensor = sensor(person(colder_by));
        let mut driver = driver(&sensor);
        let mut contrasts = Vec::new();
        for tenth in 1..=60 {
            set(&sensor, 100 * tenth);
            let truth: Vec<f32> = words(&sensor, 0x80, 64)
                .into_iter()
                .map(true_pixel)
                .collect();
            let image = driver.image().unwrap();
            assert_eq!(image.iter().copied().collect::<Vec<f32>>(), truth);
            assert_eq!(image.iter().all(|pixel| *pixel < 0.0), colder_by > 0.0);
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
    driver.image().unwrap();
    driver.thermistor().unwrap();
    let traffic = sensor.borrow().traffic();
    assert_eq!(
        (traffic.transactions, traffic.bytes, traffic.bits),
        (2, 136, 1_230),
        "section 5 of the reference: the floor"
    );
}
