//! Reference section 2.1: modes, their transitions, and sleep and wake.

use crate::support::*;
use amg8833_emulator::{AfterWake, InterruptPin, Options, SleepImage, StandBy};

const STAND_BY_60: [u8; 2] = [0x00, 0x20];
const STAND_BY_10: [u8; 2] = [0x00, 0x21];

/// The diagram of the 2011 AMG88 spec: which mode may follow which. It does not show sleep to stand-by, which the text
/// forbids, or one stand-by to the other, which nothing forbids.
#[test]
fn the_modes_and_their_transitions() {
    let modes = [NORMAL, SLEEP, STAND_BY_60, STAND_BY_10];
    for from in modes {
        for to in modes {
            let mut rig = Rig::new(counting);
            rig.set(350);
            rig.write(&from);
            rig.pass(200);
            rig.write(&to);
            let stays = from == SLEEP && to != NORMAL;
            let expected = if stays { from[1] } else { to[1] };
            assert_eq!(rig.register(0x00), expected, "{from:02x?} to {to:02x?}");
        }
    }
}

/// AMG88 spec of 2016, §4-11-1 and §4-11-2: 0x00, 50 ms, 0x3F, 2 ms, 0x30, two frames.
#[test]
fn the_wake_sequence_of_the_datasheet() {
    let mut rig = Rig::new(counting);
    rig.write(&[0x08, 0x28, 0x00]);
    rig.write(&[0x03, 0x03]);
    rig.set(1_000);
    rig.write(&SLEEP);
    rig.set(1_520);
    rig.write(&NORMAL);
    rig.set(1_570);
    rig.write(&INITIAL_RESET);
    rig.set(1_572);
    rig.write(&FLAG_RESET);
    assert_eq!(rig.read(0x00, 10), [0, 0, 0, 3, 0, 0, 0, 0, 0x28, 0]);
    rig.set(1_699);
    assert_eq!(rig.word(), 0, "two frames have to come");
    rig.set(1_700);
    assert_eq!(rig.word(), 17);
}

/// 0x3F is meant for the end of sleep; it does the same in normal mode.
#[test]
fn sleep_to_normal_without_a_reset_goes_on_with_the_next_tick() {
    let mut rig = Rig::new(counting);
    rig.set(300);
    rig.write(&SLEEP);
    rig.set(730);
    rig.write(&NORMAL);
    assert_eq!(rig.word(), 3, "the old frame");
    rig.set(800);
    assert_eq!(rig.word(), 8);
}

/// One driver's authors found the mode unreliable when read in sleep.
#[test]
fn the_mode_reads_by_turns_in_sleep_by_option() {
    let options = Options {
        sleep_image: SleepImage::ModeByTurns,
        ..Options::default()
    };
    let mut rig = Rig::with(constant(20.0), options);
    rig.set(200);
    rig.write(&SLEEP);
    let modes: Vec<u8> = (0..4).map(|_| rig.register(0x00)).collect();
    assert_eq!(modes, [0x10, 0x00, 0x10, 0x00]);
    assert_eq!(rig.read(0x0E, 2), [0x00, 0x80]);
    rig.write(&NORMAL);
    assert_eq!(rig.register(0x00), 0x00);
    rig.write(&SLEEP);
    assert_eq!(rig.register(0x00), 0x10);
}

/// AMG88 spec of 2016, §4-11-1: registers are undefined between wake and resets.
#[test]
fn nothing_is_certain_between_wake_and_reset_by_option() {
    let options = Options {
        after_wake: AfterWake::Undefined,
        ..Options::default()
    };
    let mut rig = Rig::with(constant(31.0), options);
    rig.write(&[0x08, 0x28, 0x00]);
    rig.write(&[0x03, 0x03]);
    rig.set(300);
    let awake = rig.image();
    rig.write(&SLEEP);
    rig.pass(200);
    rig.write(&NORMAL);
    let undefined = rig.image();
    let same = undefined.iter().zip(&awake).filter(|(a, b)| a == b);
    assert!(same.count() < 8, "chance apart, no register is right");
    rig.set(2_000);
    assert_eq!(rig.image(), undefined, "and nothing is measured");
    assert_eq!(rig.device().next_tick_at(), None);
    assert_eq!(rig.bus.interrupt_pin(ADDRESS), Some(InterruptPin::HighZ));
    rig.write(&FLAG_RESET);
    assert_eq!(rig.register(0x03), undefined[3], "0x30 alone is not enough");

    rig.write(&INITIAL_RESET);
    assert_eq!(rig.register(0x03), 0x03, "the settings held after all");
    rig.set(2_200);
    assert_eq!(rig.image(), awake);
    assert_eq!(rig.bus.interrupt_pin(ADDRESS), Some(InterruptPin::Low));
}

#[test]
fn a_sensor_that_never_slept_is_never_undefined() {
    let options = Options {
        after_wake: AfterWake::Undefined,
        ..Options::default()
    };
    let mut rig = Rig::with(counting, options);
    rig.write(&STAND_BY_10);
    rig.write(&NORMAL);
    rig.set(300);
    assert_eq!(rig.word(), 3);
}

/// AMG88 spec of 2016, §4-11-4, has interrupts in stand-by. The 2021 interface document has them only in normal mode,
/// and lists no stand-by modes.
#[test]
fn stand_by_in_the_three_readings() {
    let readings = [
        (StandBy::Interrupts, 0x21, 40, 0x02),
        (StandBy::NoInterrupts, 0x21, 40, 0x00),
        (StandBy::Missing, 0x00, 41, 0x02),
    ];
    for (stand_by, mode, frames, status) in readings {
        let options = Options {
            stand_by,
            ..Options::default()
        };
        let mut rig = Rig::with(
            |t| uniform(if t.as_millis() < 4_000 { 20.0 } else { 31.0 }),
            options,
        );
        rig.write(&[0x08, 0x78, 0x00]);
        rig.write(&[0x03, 0x03]);
        rig.set(3_950);
        rig.write(&STAND_BY_10);
        assert_eq!(rig.register(0x00), mode, "{stand_by:?}");
        rig.set(4_050);
        assert_eq!(rig.frames(), frames - 1, "{stand_by:?}");
        rig.set(13_900);
        if mode == 0x21 {
            assert_eq!((rig.word(), rig.frames()), (124, frames), "{stand_by:?}");
        } else {
            assert_eq!(rig.device().refusals().unknown_commands, 1);
        }
        assert_eq!(rig.register(0x04), status, "{stand_by:?}");
        let low = status == 0x02;
        let pin = rig.bus.interrupt_pin(ADDRESS);
        assert_eq!(pin == Some(InterruptPin::Low), low, "{stand_by:?}");
        rig.write(&NORMAL);
        rig.pass(100);
        assert_eq!(rig.register(0x04), 0x02, "{stand_by:?}, in normal mode");
    }
}

#[test]
fn from_one_stand_by_to_the_other_the_interval_restarts() {
    let mut rig = Rig::new(counting);
    rig.write(&STAND_BY_60);
    rig.set(30_000);
    rig.write(&STAND_BY_10);
    rig.set(39_999);
    assert_eq!(rig.frames(), 0);
    rig.set(40_000);
    assert_eq!((rig.frames(), rig.word()), (1, 400));
    rig.write(&SLEEP);
    rig.set(60_000);
    assert_eq!(rig.frames(), 1);
}
