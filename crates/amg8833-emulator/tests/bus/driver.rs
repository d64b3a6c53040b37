//! The driver against the emulated sensor: two independent readings of one datasheet that must agree.

use amg8833::{
    Amg8833, Deviation, FrameRate, InterruptControl, InterruptLevels, InterruptMode, MovingAverage,
    PowerMode, Settings, Standby, Status,
};
use amg8833_emulator::{Address, Bus, BusError, Clock, Fault, ManualClock, Options, SharedBus};
use core::time::Duration;
use embedded_hal::delay::DelayNs;
use embedded_hal::digital::InputPin;
use grideye_frame::{Celsius, Frame, PixelIndex, ThermistorWord};
use std::cell::RefCell;

type Source = Box<dyn FnMut(Duration) -> Frame>;
type Sensor<'c> = RefCell<Bus<&'c ManualClock, Source>>;

/// Advances the emulated time by the driver's waits.
struct Delay<'c>(&'c ManualClock);

impl DelayNs for Delay<'_> {
    fn delay_ns(&mut self, nanoseconds: u32) {
        self.0.advance(Duration::from_nanos(u64::from(nanoseconds)));
    }
}

fn sensor(
    clock: &ManualClock,
    source: impl FnMut(Duration) -> Frame + 'static,
    options: Options,
) -> Sensor<'_> {
    let mut bus = Bus::new(clock).with_scl_hz(400_000.try_into().unwrap());
    let boxed: Source = Box::new(source);
    bus.plug(Address::High, boxed, options);
    RefCell::new(bus)
}

fn driver<'a, 'c>(sensor: &'a Sensor<'c>) -> Amg8833<SharedBus<'a, &'c ManualClock, Source>> {
    Amg8833::new(SharedBus::new(sensor), amg8833::Address::High)
}

/// Tick n of an exact clock: the pixels run from -512 in quarter-degree steps, shifted by one place per tick.
fn ramp(t: Duration) -> Frame {
    let mut frame = Frame::uniform(Celsius::new(-20.0625));
    let tick = t.as_millis() / 100;
    for (place, pixel) in frame.pixels.iter_mut().enumerate() {
        *pixel = quarter((tick * 64 + u128::try_from(place).unwrap()) % 4_096);
    }
    frame
}

fn quarter(steps_from_least: u128) -> Celsius {
    Celsius::new(f32::from(u16::try_from(steps_from_least).unwrap()) / 4.0 - 512.0)
}

#[test]
fn every_pixel_value_comes_through_as_it_was_meant() {
    let clock = ManualClock::new();
    let sensor = sensor(&clock, ramp, Options::default());
    let mut driver = driver(&sensor);
    driver
        .init(&mut Delay(&clock), &Settings::default())
        .unwrap();
    clock.set(Duration::from_secs(1));
    for tick in 10_u64..=74 {
        let time = Duration::from_millis(100 * tick);
        clock.set(time);
        let frame = amg8833::word::frame(&driver.read_frame().unwrap());
        assert_eq!(frame, ramp(time), "tick {tick}");
    }
}

#[test]
fn every_thermistor_value_comes_through_as_it_was_meant() {
    let clock = ManualClock::new();
    let source = |t: Duration| {
        let sixteenths = u16::try_from(t.as_millis() / 100 % 4_095).unwrap();
        Frame::uniform(Celsius::new(f32::from(sixteenths) / 16.0 - 127.9375))
    };
    let sensor = sensor(&clock, source, Options::default());
    let mut driver = driver(&sensor);
    for tick in 1_u64..=4_095 {
        let time = Duration::from_millis(100 * tick);
        clock.set(time);
        let read = amg8833::word::thermistor_celsius(driver.read_thermistor().unwrap());
        assert_eq!(read, source(time).thermistor, "tick {tick}");
    }
}

/// A recording holds words, and its replay must return the same ones: 0x800 differs from 0x000.
#[test]
fn every_thermistor_word_comes_back_from_a_replay() {
    let clock = ManualClock::new();
    let decoded = |word| amg8833::word::thermistor_celsius(ThermistorWord(word));
    let source = move |t: Duration| {
        Frame::uniform(decoded(u16::try_from(t.as_millis() / 100 % 4_096).unwrap()))
    };
    let sensor = sensor(&clock, source, Options::default());
    let mut driver = driver(&sensor);
    for word in 1..=4_096_u16 {
        clock.set(Duration::from_millis(100) * u32::from(word));
        let read = driver.read_thermistor().unwrap();
        assert_eq!(read, ThermistorWord(word % 4_096));
    }
}

#[test]
fn after_init_and_its_wait_there_is_a_frame_whatever_the_sensor_did_before() {
    for clock_error_ppm in [-90_000, -40_000, 0, 40_000] {
        for rate in [FrameRate::Ten, FrameRate::One] {
            for phase_ms in (0..100).step_by(7) {
                let clock = ManualClock::new();
                let options = Options {
                    clock_error_ppm,
                    phase: Duration::from_millis(phase_ms),
                    silent_start: true,
                    freezes_on_fast_wake: true,
                    ..Options::default()
                };
                let sensor = sensor(&clock, |_| Frame::uniform(Celsius::new(-25.0)), options);
                let mut driver = driver(&sensor);
                clock.advance(amg8833::timing::POWER_ON);
                let settings = Settings {
                    frame_rate: rate,
                    ..Settings::default()
                };
                driver.init(&mut Delay(&clock), &settings).unwrap();
                driver.sleep(&mut Delay(&clock)).unwrap();
                driver.init(&mut Delay(&clock), &settings).unwrap();
                clock.advance(rate.settling_time());
                let frame = amg8833::word::frame(&driver.read_frame().unwrap());
                let place = format!("{clock_error_ppm} ppm, {rate}, {phase_ms} ms");
                assert_eq!(frame, Frame::uniform(Celsius::new(-25.0)), "{place}");
                assert_eq!(
                    driver.configuration().unwrap().deviation(&settings),
                    None,
                    "{place}"
                );
            }
        }
    }
}

#[test]
fn power_modes() {
    let clock = ManualClock::new();
    let sensor = sensor(&clock, ramp, Options::default());
    let mut driver = driver(&sensor);
    assert_eq!(driver.power_mode().unwrap(), PowerMode::Normal);
    for interval in [Standby::TenSeconds, Standby::SixtySeconds] {
        driver.standby(interval).unwrap();
        assert_eq!(driver.power_mode().unwrap(), PowerMode::Standby(interval));
    }
    driver.sleep(&mut Delay(&clock)).unwrap();
    assert_eq!(driver.power_mode().unwrap(), PowerMode::Sleep);
    let asleep = driver.read_frame().unwrap();
    assert!(asleep.pixels.iter().all(|word| word.0 == 0));
    driver.wake(&mut Delay(&clock)).unwrap();
    assert_eq!(driver.power_mode().unwrap(), PowerMode::Normal);
}

#[test]
fn settings_read_back_as_written_and_a_brown_out_is_found() {
    let clock = ManualClock::new();
    let sensor = sensor(&clock, ramp, Options::default());
    let mut driver = driver(&sensor);
    let levels =
        InterruptLevels::new(Celsius::new(30.0), Celsius::new(-5.0), Celsius::new(1.0)).unwrap();
    let settings = Settings {
        frame_rate: FrameRate::One,
        moving_average: MovingAverage::Twice,
        interrupt: InterruptControl {
            pin_active: true,
            mode: InterruptMode::Absolute,
        },
        levels,
    };
    driver.init(&mut Delay(&clock), &settings).unwrap();
    let configuration = driver.configuration().unwrap();
    assert_eq!(configuration.deviation(&settings), None);
    assert_eq!(configuration.moving_average, MovingAverage::Twice);
    assert_eq!(driver.moving_average().unwrap(), MovingAverage::Twice);
    assert_eq!(driver.interrupt_levels().unwrap(), levels);

    sensor
        .borrow_mut()
        .set_fault(Address::High, Fault::BrownOut);
    let deviation = driver.configuration().unwrap().deviation(&settings);
    assert!(matches!(
        deviation,
        Some(Deviation::FrameRate(_, FrameRate::Ten))
    ));
}

#[test]
fn interrupts_trip_for_the_right_pixels_and_clear() {
    let clock = ManualClock::new();
    let person = |t: Duration| {
        let mut frame = Frame::uniform(Celsius::new(20.0));
        if t >= Duration::from_secs(2) {
            for number in [1, 8, 28, 64] {
                frame.pixels[number - 1] = Celsius::new(30.25);
            }
            frame.pixels[1] = Celsius::new(-5.25);
            frame.pixels[2] = Celsius::new(30.0);
            frame.pixels[3] = Celsius::new(-5.0);
        }
        frame
    };
    let sensor = sensor(&clock, person, Options::default());
    let mut driver = driver(&sensor);
    let mut pin = SharedBus::new(&sensor).int_pin(Address::High);
    let settings = Settings {
        interrupt: InterruptControl {
            pin_active: true,
            mode: InterruptMode::Absolute,
        },
        levels: InterruptLevels::new(Celsius::new(30.0), Celsius::new(-5.0), Celsius::new(1.0))
            .unwrap(),
        ..Settings::default()
    };
    driver.init(&mut Delay(&clock), &settings).unwrap();
    clock.set(Duration::from_millis(1_999));
    assert_eq!(driver.status().unwrap(), Status::default());
    assert!(pin.is_high().unwrap() && driver.interrupt_table().unwrap().is_empty());

    clock.set(Duration::from_secs(2));
    assert!(pin.is_low().unwrap());
    let tripped: Vec<u8> = driver
        .interrupt_table()
        .unwrap()
        .iter()
        .map(PixelIndex::number)
        .collect();
    assert_eq!(tripped, [1, 2, 8, 28, 64]);
    driver
        .clear_flags(Status {
            interrupt: true,
            ..Status::default()
        })
        .unwrap();
    assert!(pin.is_high().unwrap());
    driver.flag_reset().unwrap();
    assert!(driver.interrupt_table().unwrap().is_empty());
    clock.advance(Duration::from_millis(100));
    assert!(pin.is_low().unwrap(), "the person is still there");
}

#[test]
fn the_sensor_applies_the_moving_average() {
    let step = |t: Duration| {
        Frame::uniform(Celsius::new(if t < Duration::from_secs(1) {
            -10.0
        } else {
            -6.0
        }))
    };
    for (moving_average, celsius) in [(MovingAverage::Off, -6.0), (MovingAverage::Twice, -8.0)] {
        let clock = ManualClock::new();
        let sensor = sensor(&clock, step, Options::default());
        let mut driver = driver(&sensor);
        let settings = Settings {
            moving_average,
            ..Settings::default()
        };
        driver.init(&mut Delay(&clock), &settings).unwrap();
        clock.set(Duration::from_secs(1));
        let frame = amg8833::word::frame(&driver.read_frame().unwrap());
        assert_eq!(frame.pixels, [Celsius::new(celsius); 64]);
    }
}

/// The frame in two transactions of 136 bytes, 1,230 bits, 3.075 ms at 400 kHz (reference section 5).
#[test]
fn a_frame_of_the_driver_is_at_the_floor_of_the_bus() {
    let clock = ManualClock::new();
    let sensor = sensor(&clock, ramp, Options::default());
    driver(&sensor).read_frame().unwrap();
    let traffic = sensor.borrow().traffic();
    assert_eq!(
        (traffic.transactions, traffic.bytes, traffic.bits),
        (2, 136, 1_230)
    );
    assert_eq!(clock.now(), Duration::from_nanos(3_075_000));
}

/// Whatever the phase between host and sensor, the pixels of one read come from one tick.
#[test]
fn no_frame_of_the_driver_is_torn() {
    let clock = ManualClock::new();
    let options = Options {
        clock_error_ppm: -40_000,
        ..Options::default()
    };
    let ticking = |t: Duration| Frame::uniform(quarter(t.as_millis() / 104));
    let sensor = sensor(&clock, ticking, options);
    let mut driver = driver(&sensor);
    clock.set(Duration::from_millis(200));
    for _ in 0..2_000 {
        clock.advance(Duration::from_micros(1_234));
        let pixels = driver.read_pixels().unwrap();
        assert!(
            pixels.iter().all(|word| *word == pixels[0]),
            "at {:?}",
            clock.now()
        );
    }
}

#[test]
fn the_drivers_error_keeps_the_error_of_the_bus() {
    let clock = ManualClock::new();
    let sensor = sensor(&clock, ramp, Options::default());
    let mut driver = driver(&sensor);
    let faults = [
        (Fault::BusError, BusError::Bus),
        (Fault::Hang, BusError::Timeout),
        (Fault::AdapterGone, BusError::Gone),
    ];
    for (fault, error) in faults {
        sensor.borrow_mut().set_fault(Address::High, fault);
        assert_eq!(driver.read_frame(), Err(amg8833::Error::Bus(error)));
    }
}
