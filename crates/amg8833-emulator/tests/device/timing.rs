//! Reference sections 2.1, 2.3, 2.4, 2.5: rates, averages, stand-by, and the sensor's clock.

use crate::support::*;
use amg8833_emulator::{
    CATCH_UP_FRAMES_MAX, CLOCK_ERROR_PPM_MAX, DRIFT_STRETCH_MAX, Device, Drift, DriftCurve,
    DriftError, FrameSource, InterruptPin, Options,
};
use core::time::Duration;
use grideye_frame::Frame;
use std::cell::RefCell;
use std::rc::Rc;

fn slow(ppm: i32) -> Options {
    Options {
        clock_error_ppm: ppm,
        ..Options::default()
    }
}

#[test]
fn ten_frames_a_second_each_once() {
    let mut rig = Rig::new(counting);
    for frame in 1..=50 {
        rig.set(100 * frame);
        assert_eq!(u64::from(rig.word()), frame);
        rig.set(100 * frame + 99);
        assert_eq!(
            u64::from(rig.word()),
            frame,
            "polling faster gives the same frame"
        );
        assert_eq!(rig.frames(), frame);
    }
}

#[test]
fn one_frame_a_second_is_the_mean_of_the_last_ten() {
    let mut rig = Rig::new(counting);
    rig.write(&ONE_FPS);
    rig.set(999);
    assert_eq!(rig.word(), 0);
    rig.set(1_000);
    assert_eq!(rig.word(), 6, "mean of 1 to 10, halves away from zero");
    rig.set(1_999);
    assert_eq!(rig.word(), 6);
    rig.set(2_000);
    assert_eq!(rig.word(), 16, "mean of 11 to 20");
    assert_eq!(rig.frames(), 2);
    rig.write(&[0x02, 0x00]);
    rig.set(2_100);
    assert_eq!(rig.word(), 21, "back at ten a second");
    rig.write(&ONE_FPS);
    rig.set(3_050);
    assert_eq!(
        rig.word(),
        21,
        "the old frame stays until the mean is complete"
    );
    rig.set(3_100);
    assert_eq!(rig.word(), 27, "mean of 22 to 31");
}

#[test]
fn a_change_of_rate_restarts_both_averages() {
    let mut rig = Rig::new(counting);
    rig.write(&ONE_FPS);
    rig.set(550);
    rig.write(&[0x02, 0x00]);
    rig.write(&ONE_FPS);
    rig.set(1_499);
    assert_eq!(rig.word(), 0, "five of the ten were before the change");
    rig.set(1_500);
    assert_eq!(rig.word(), 11, "10.5: mean of 6 to 15");

    for pair in AVERAGE_KEY {
        rig.write(&pair);
    }
    rig.write(&[0x02, 0x00]);
    rig.set(1_600);
    assert_eq!(
        rig.word(),
        16,
        "not averaged with a frame of the other rate"
    );
    rig.set(1_700);
    assert_eq!(rig.word(), 17, "16.5");
}

#[test]
fn means_are_taken_before_the_quantization() {
    // Seven values round to 80 steps and three to 81: the mean of the words would be 80.
    let source = |t: Duration| {
        uniform(if t.as_millis() / 100 % 10 < 3 {
            20.16
        } else {
            20.12
        })
    };
    let mut rig = Rig::new(source);
    rig.write(&ONE_FPS);
    rig.set(1_000);
    assert_eq!(rig.word(), 81);

    let halves = |t: Duration| {
        uniform(if t.as_millis() / 100 % 2 == 0 {
            20.11
        } else {
            20.13
        })
    };
    let mut rig = Rig::new(halves);
    for pair in AVERAGE_KEY {
        rig.write(&pair);
    }
    rig.set(200);
    assert_eq!(
        rig.word(),
        80,
        "20.12 degrees are 80.48 steps; 80 and 81 would give 81"
    );
}

/// Section 2.5: the mean of the last two output frames, at either rate.
#[test]
fn the_moving_average_halves_a_step() {
    let step = |t: Duration| {
        uniform(if t < Duration::from_secs(1) {
            20.0
        } else {
            24.0
        })
    };
    let mut rig = Rig::new(step);
    for pair in AVERAGE_KEY {
        rig.write(&pair);
    }
    for (time, word) in [(100, 80), (900, 80), (1_000, 88), (1_100, 96), (1_200, 96)] {
        rig.set(time);
        assert_eq!(rig.word(), word, "at {time} ms");
    }

    let mut without = Rig::new(step);
    without.set(900);
    assert_eq!(without.word(), 80);
    without.set(1_000);
    assert_eq!(without.word(), 96, "off by default");
}

#[test]
fn the_moving_average_at_one_frame_a_second_is_of_two_means_of_ten() {
    let mut rig = Rig::new(counting);
    for pair in AVERAGE_KEY {
        rig.write(&pair);
    }
    rig.write(&ONE_FPS);
    rig.set(1_000);
    assert_eq!(rig.word(), 6, "5.5: the first has no predecessor");
    rig.set(2_000);
    assert_eq!(rig.word(), 11, "10.5: mean of 5.5 and 15.5");
    rig.set(3_000);
    assert_eq!(
        rig.word(),
        21,
        "20.5, not a recursive mean of 10.5 and 25.5"
    );
}

#[test]
fn stand_by_measures_every_ten_or_sixty_seconds() {
    for (command, seconds) in [(0x21, 10), (0x20, 60)] {
        let mut rig = Rig::new(|t| uniform(f32::from(u16::try_from(t.as_secs()).unwrap())));
        rig.set(2_050);
        rig.write(&[0x00, command]);
        assert_eq!(
            rig.register(0x00),
            command,
            "registers answer as in normal mode"
        );
        for interval in 1..=3_u16 {
            let tick = 2_000 + 1_000 * u64::from(seconds) * u64::from(interval);
            rig.set(tick - 1);
            let before = if interval == 1 {
                2
            } else {
                2 + seconds * (interval - 1)
            };
            assert_eq!(rig.word(), 4 * before);
            rig.set(tick);
            assert_eq!(rig.word(), 4 * (2 + seconds * interval));
        }
        rig.write(&NORMAL);
        rig.pass(100);
        assert_eq!(rig.frames(), 20 + 3 + 1);
    }
}

/// AMG88 spec §4-11-1: interrupts work in stand-by.
#[test]
fn stand_by_still_interrupts() {
    let mut rig = Rig::new(constant(30.0));
    rig.write(&[0x03, 0x03]);
    rig.write(&[0x08, 0x64, 0x00]);
    rig.write(&[0x00, 0x21]);
    let pin = |rig: &mut Rig| rig.bus.interrupt_pin(amg8833_emulator::Address::High);
    assert_eq!(pin(&mut rig), Some(InterruptPin::HighZ));
    rig.set(10_000);
    assert_eq!(pin(&mut rig), Some(InterruptPin::Low));
}

#[test]
fn a_sensor_four_percent_slow_gives_576_frames_a_minute() {
    let mut rig = Rig::with(constant(20.0), slow(-40_000));
    rig.set(60_000);
    assert_eq!(rig.frames(), 576);
    let mut fast = Rig::with(constant(20.0), slow(40_000));
    fast.set(60_000);
    assert_eq!(fast.frames(), 624);
}

#[test]
fn the_source_is_asked_for_the_times_of_the_ticks() {
    let asked = Rc::new(RefCell::new(Vec::new()));
    let log = Rc::clone(&asked);
    let source = move |t: Duration| {
        log.borrow_mut().push(t.as_nanos());
        uniform(20.0)
    };
    let options = Options {
        phase: Duration::from_millis(37),
        ..slow(-40_000)
    };
    let mut rig = Rig::with(source, options);
    rig.set(141);
    assert!(asked.borrow().is_empty());
    assert_eq!(
        rig.device().next_tick_at(),
        Some(Duration::from_nanos(141_166_667))
    );
    rig.set(500);
    assert_eq!(rig.frames(), 4);
    assert_eq!(
        *asked.borrow(),
        [141_166_667, 245_333_334, 349_500_000, 453_666_667]
    );
}

#[test]
fn the_clock_error_can_drift_without_a_jump() {
    let mut rig = Rig::new(constant(20.0));
    rig.set(150);
    rig.device()
        .set_clock_error_ppm(-500_000, Duration::from_millis(150));
    assert_eq!(
        rig.device().next_tick_at(),
        Some(Duration::from_millis(250))
    );
    assert_eq!(rig.device().options().clock_error_ppm, -500_000);
    rig.set(1_049);
    assert_eq!(rig.frames(), 1 + 4);
    rig.set(1_050);
    assert_eq!(rig.frames(), 1 + 5);
}

/// Records what a replay receives: `measuring_from`, then the frame requests.
#[derive(Default)]
struct Listener {
    starts: Vec<u128>,
    first_frames: Vec<u128>,
    armed: bool,
}

impl FrameSource for Listener {
    fn frame_at(&mut self, t: Duration) -> Frame {
        if std::mem::take(&mut self.armed) {
            self.first_frames.push(t.as_millis());
        }
        uniform(20.0)
    }

    fn measuring_from(&mut self, t: Duration) {
        self.starts.push(t.as_millis());
        self.armed = true;
    }
}

fn send<S: FrameSource>(device: &mut Device<S>, bytes: &[u8], milliseconds: u64) {
    let now = Duration::from_millis(milliseconds);
    device.start_write(now);
    for byte in bytes {
        device.write(*byte, now);
    }
    device.stop(now);
}

#[test]
fn a_source_is_told_the_time_of_its_first_frame() {
    let mut device = Device::new(Listener::default(), Options::default(), Duration::ZERO);
    send(&mut device, &NORMAL, 250);
    send(&mut device, &INITIAL_RESET, 300);
    send(&mut device, &FLAG_RESET, 310);
    send(&mut device, &ONE_FPS, 3_000);
    send(&mut device, &INITIAL_RESET, 3_333);
    send(&mut device, &[0x00, 0x21], 9_050);
    send(&mut device, &INITIAL_RESET, 9_060);
    device.advance(Duration::from_secs(20));
    device.power_cycle(Duration::from_millis(20_001));
    device.advance(Duration::from_secs(30));
    let expected = [100, 500, 3_500, 19_000, 20_101];
    assert_eq!(device.source().starts, expected);
    assert_eq!(device.source().first_frames, expected);
}

#[test]
fn the_first_frame_at_one_fps_after_an_initial_reset_needs_eleven_ticks() {
    let mut rig = Rig::new(counting);
    rig.write(&INITIAL_RESET);
    rig.write(&ONE_FPS);
    rig.set(1_099);
    assert_eq!(rig.word(), 0);
    rig.set(1_100);
    assert_eq!(rig.word(), 7, "6.5: mean of 2 to 11");
}

#[test]
fn a_day_at_ten_frames_a_second_is_exact() {
    let mut rig = Rig::new(constant(20.0));
    rig.set(86_400_000);
    assert_eq!(rig.frames(), 864_000);
}

#[test]
fn a_longer_absence_measures_only_the_newest_frames() {
    let asked = Rc::new(RefCell::new((0_u64, Duration::ZERO)));
    let log = Rc::clone(&asked);
    let source = move |t| {
        let mut asked = log.borrow_mut();
        *asked = (asked.0 + 1, t);
        uniform(20.0)
    };
    let mut rig = Rig::with(source, Options::default());
    rig.bus.clock().set(Duration::from_secs(1_000_000_000));
    assert_eq!(rig.frames(), CATCH_UP_FRAMES_MAX);
    assert_eq!(
        *asked.borrow(),
        (CATCH_UP_FRAMES_MAX, Duration::from_secs(1_000_000_000))
    );
}

#[test]
fn years_asleep_cost_nothing() {
    let mut rig = Rig::new(constant(20.0));
    rig.write(&SLEEP);
    rig.bus.clock().set(Duration::from_secs(1_000_000_000));
    assert_eq!(rig.frames(), 0);
    assert_eq!(rig.device().next_tick_at(), None);
    rig.write(&NORMAL);
    rig.pass(100);
    assert_eq!(rig.frames(), 1);
}

/// Section 2.3: 50 ms until the bus works, by option.
#[test]
fn the_silent_start_by_option() {
    let options = Options {
        silent_start: true,
        ..Options::default()
    };
    let mut rig = Rig::with(constant(20.0), options);
    use embedded_hal::i2c::I2c;
    rig.bus.clock().set(Duration::from_nanos(49_999_999));
    assert!(rig.bus.write(HIGH, &[]).is_err());
    rig.set(50);
    assert!(rig.bus.write(HIGH, &[]).is_ok());
    assert_eq!(rig.device().refusals().nacks, 1);
}

#[test]
fn time_that_runs_backwards_counts_as_standing_still() {
    let mut device = Device::new(counting, Options::default(), Duration::ZERO);
    device.advance(Duration::from_millis(500));
    send(&mut device, &INITIAL_RESET, 100);
    device.advance(Duration::from_millis(600));
    assert_eq!(device.frames(), 5, "the reset was at 500 ms");
    device.advance(Duration::from_millis(700));
    assert_eq!(device.frames(), 6);
}

#[test]
fn a_time_beyond_every_clock_counts_as_the_latest() {
    let mut device = Device::new(uniform(20.0), Options::default(), Duration::ZERO);
    device.advance(Duration::MAX);
    assert_eq!(device.frames(), CATCH_UP_FRAMES_MAX);
    send(&mut device, &[0x00, 0x20], 0);
    send(&mut device, &INITIAL_RESET, 0);
    device.set_clock_error_ppm(-500_000, Duration::MAX);
    device.power_cycle(Duration::MAX);
    device.advance(Duration::MAX);
    assert_eq!(device.frames(), CATCH_UP_FRAMES_MAX);
}

#[test]
fn frames_before_a_power_cycle_count() {
    let mut device = Device::new(counting, Options::default(), Duration::ZERO);
    device.power_cycle(Duration::from_millis(250));
    assert_eq!(device.frames(), 2);
    device.advance(Duration::from_millis(350));
    assert_eq!(device.frames(), 3);
}

/// Section 2.3: two frames after an initial reset, whatever the mode does in the meantime.
#[test]
fn a_change_of_mode_does_not_shorten_the_warm_up() {
    let mut rig = Rig::new(counting);
    rig.set(350);
    rig.write(&INITIAL_RESET);
    rig.write(&[0x00, 0x21]);
    rig.write(&NORMAL);
    rig.set(499);
    assert_eq!(rig.word(), 0);
    rig.set(500);
    assert_eq!(rig.word(), 5);
}

/// A day with a clock that starts 4 % slow and speeds up by 100 ppm per hour. The number of frames is the integral of
/// the speed, (0.96 * 24 h + 100e-6 / h * 24^2 h^2 / 2) * 36,000 / h = 830,476.8.
#[test]
fn a_drifting_day_has_the_frames_of_the_integral() {
    let options = Options {
        clock_drift: Drift::PpmPerHour(100),
        ..slow(-40_000)
    };
    let mut rig = Rig::with(constant(20.0), options);
    for second in 1..=86_400 {
        rig.set(1_000 * second);
        rig.frames();
    }
    assert_eq!(rig.frames(), 830_476);
    // The next frame is due after 0.2 of another one, at 9.624 per second: in 20.781 ms.
    let next = rig.device().next_frame_at().unwrap().as_secs_f64();
    assert!((next - 86_400.020_781).abs() < 2e-6, "{next}");
}

/// The same for a curve of two lines, the second through the first night: 10 h from 0 to 1,000 ppm, 4 h back.
#[test]
fn a_drift_curve_counts_from_power_on_and_restarts_with_it() {
    static POINTS: [(Duration, i32); 3] = [
        (Duration::ZERO, 0),
        (Duration::from_secs(36_000), 1_000),
        (Duration::from_secs(50_400), 0),
    ];
    let options = Options {
        clock_drift: Drift::Curve(DriftCurve::new(&POINTS).unwrap()),
        ..Options::default()
    };
    let mut rig = Rig::with(constant(20.0), options);
    rig.set(36_000_000);
    assert_eq!(rig.frames(), 360_000 + 180);
    rig.set(50_400_000);
    assert_eq!(rig.frames(), 504_000 + 252);
    rig.set(86_400_000);
    assert_eq!(rig.frames(), 864_000 + 252);

    rig.device().power_cycle(ms(86_400_000));
    let before = rig.frames();
    rig.set(86_400_000 + 36_000_000);
    assert_eq!(rig.frames() - before, 360_000 + 180);
}

#[test]
fn a_drift_curve_of_no_use_is_refused_by_its_point() {
    const fn hour(hours: u64) -> Duration {
        Duration::from_secs(3_600 * hours)
    }
    static EQUAL: [(Duration, i32); 3] = [(hour(0), 1), (hour(1), 2), (hour(1), 3)];
    static LONG: [(Duration, i32); 2] = [(hour(1), 1), (hour(2_402), 2)];
    static LATE: [(Duration, i32); 1] = [(hour(2_401), 1)];
    static WILD: [(Duration, i32); 1] = [(hour(1), -500_001)];
    static GOOD: [(Duration, i32); 2] =
        [(hour(2_400), -CLOCK_ERROR_PPM_MAX), (hour(4_800), 500_000)];
    assert_eq!(DRIFT_STRETCH_MAX, hour(2_400));
    let refused = [
        (&[][..], DriftError::Empty, "no points"),
        (&EQUAL, DriftError::Order(2), "point 2"),
        (&LONG, DriftError::Stretch(1), "point 1"),
        (&LATE, DriftError::Stretch(0), "more than 100 days"),
        (&WILD, DriftError::TooFar(0, -500_001), "-500001 ppm"),
    ];
    for (points, error, text) in refused {
        assert_eq!(DriftCurve::new(points), Err(error));
        assert!(error.to_string().contains(text), "{error}");
    }
    assert!(DriftCurve::new(&GOOD).is_ok());
}

/// Any drift set by call: a clock error read from a table every minute of a day.
#[test]
fn a_drift_by_call_over_a_day_loses_nothing() {
    let mut rig = Rig::new(constant(20.0));
    let mut expected = 0.0;
    for minute in 0..1_440_u32 {
        let ppm = i32::try_from(minute % 97).unwrap() * 500 - 24_000;
        let now = ms(60_000 * u64::from(minute));
        rig.device().set_clock_error_ppm(ppm, now);
        expected += 600.0 * (1.0 + f64::from(ppm) / 1e6);
    }
    rig.set(86_400_000);
    let frames = f64::from(u32::try_from(rig.frames()).unwrap());
    assert!((expected - frames).abs() < 1.0, "{expected} {frames}");
    let next = rig.device().next_frame_at().unwrap().as_secs_f64() - 86_400.0;
    let last_ppm: f64 = f64::from(1_439 % 97) * 500.0 - 24_000.0;
    let due = (frames + 1.0 - expected) / (10.0 * (1.0 + last_ppm / 1e6));
    assert!((next - due).abs() < 1e-6, "{next} {due}");
}

/// A live program with a slow source need not produce frames that no read would see.
#[test]
fn the_frames_to_catch_up_can_be_few() {
    for (catch_up_frames_max, asked) in [(0, 1), (1, 1), (20, 20), (CATCH_UP_FRAMES_MAX, 6_003)] {
        let count = Rc::new(RefCell::new(0_u64));
        let log = Rc::clone(&count);
        let source = move |t: Duration| {
            *log.borrow_mut() += 1;
            uniform(f32::from(u16::try_from(t.as_millis() % 60_000 / 100).unwrap()) / 4.0)
        };
        let options = Options {
            catch_up_frames_max: Some(catch_up_frames_max),
            ..Options::default()
        };
        let mut rig = Rig::with(source, options);
        rig.set(600_300);
        assert_eq!(rig.word(), 3, "the newest frame is there");
        assert_eq!(*count.borrow(), asked);
    }
}

/// At 1 fps the skipped frames are skipped by tens, so that the next mean comes on time.
#[test]
fn a_stall_does_not_move_the_second_at_one_fps() {
    let options = Options {
        catch_up_frames_max: Some(20),
        ..Options::default()
    };
    for pause in [120_000, 120_300, 123_900] {
        let mut rig = Rig::with(counting_slowly, options);
        rig.write(&ONE_FPS);
        rig.set(700);
        rig.frames();
        rig.set(700 + pause);
        rig.frames();
        let due = (700 + pause) / 1_000 * 1_000 + 1_000;
        assert_eq!(rig.device().next_frame_at(), Some(ms(due)), "{pause}");
        rig.set(due);
        let seconds = u16::try_from(due / 1_000).unwrap();
        assert_eq!(rig.word(), 4 * (seconds - 1) + 2, "{pause}");
    }
}

/// Second n shows n degrees, from half a second before to half a second after, so the mean of ten ticks is n - 0.5.
fn counting_slowly(t: Duration) -> Frame {
    let halves = u16::try_from((t.as_millis() - 1) / 500).unwrap();
    uniform(f32::from(halves / 2 + halves % 2))
}
