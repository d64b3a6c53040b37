//! Frame rates, and how found settings deviate from wanted ones.

use amg8833::{
    Configuration, FrameRate, InterruptControl, InterruptLevels, InterruptMode, MovingAverage,
    PowerMode, Settings,
};
use grideye_frame::Celsius;
use std::time::Duration;

/// As the sensor wakes (AMG88 spec §4-11: all registers 0).
fn power_on() -> Configuration {
    let zero = Celsius::new(0.0);
    Configuration {
        power: PowerMode::Normal,
        frame_rate: FrameRate::Ten,
        moving_average: MovingAverage::Off,
        interrupt: InterruptControl {
            pin_active: false,
            mode: InterruptMode::Difference,
        },
        levels: InterruptLevels::new(zero, zero, zero).unwrap(),
    }
}

#[test]
fn two_frames_of_a_slow_sensor_are_waited_for() {
    assert_eq!(FrameRate::Ten.settling_time(), Duration::from_millis(220));
    assert_eq!(FrameRate::One.settling_time(), Duration::from_millis(2200));
}

#[test]
fn only_one_and_ten_are_frame_rates() {
    for fps in 0..=u8::MAX {
        let rate = FrameRate::from_fps(fps);
        assert_eq!(rate.is_some(), fps == 1 || fps == 10);
        if let Some(rate) = rate {
            assert_eq!(rate.fps(), fps);
            assert_eq!(rate.period() * u32::from(fps), Duration::from_secs(1));
        }
    }
}

#[test]
fn a_sensor_that_was_reset_deviates_from_the_default_settings() {
    let deviation = power_on().deviation(&Settings::default()).unwrap();
    assert_eq!(
        deviation.to_string(),
        "interrupt levels: expected above 511.75 or below -512 °C with 0 °C of hysteresis, \
         found above 0 or below 0 °C with 0 °C of hysteresis"
    );
}

#[test]
fn every_register_but_the_average_is_compared() {
    let settings = Settings::default();
    let good = Configuration {
        levels: settings.levels,
        ..power_on()
    };
    assert_eq!(good.deviation(&settings), None);
    let mut averaged = good;
    averaged.moving_average = MovingAverage::Twice;
    assert_eq!(averaged.deviation(&settings), None);

    let deviation = |found: Configuration| found.deviation(&settings).unwrap().to_string();
    let (mut power, mut rate, mut interrupt, mut levels) = (good, good, good, good);
    power.power = PowerMode::Sleep;
    assert_eq!(deviation(power), "power mode: expected normal, found sleep");
    rate.frame_rate = FrameRate::One;
    assert_eq!(deviation(rate), "frame rate: expected 10 fps, found 1 fps");
    interrupt.interrupt.pin_active = true;
    interrupt.interrupt.mode = InterruptMode::Absolute;
    assert_eq!(
        deviation(interrupt),
        "interrupt: expected difference with the pin inactive, found absolute with the pin active"
    );
    let [upper, lower, hysteresis] = [30.0, -5.0, 1.0].map(Celsius::new);
    levels.levels = InterruptLevels::new(upper, lower, hysteresis).unwrap();
    let found = "found above 30 or below -5 °C with 1 °C of hysteresis";
    assert!(deviation(levels).ends_with(found));
}
