//! Reference sections 2.2 and 2.3: what each reset keeps, and when frames follow it.

use crate::support::*;
use amg8833_emulator::{Address, InitialReset, Options, StatusClear, WarmUp};

/// A sensor with nothing at its default: settings, flags, table, thermistor, pixels.
fn all_set(options: Options) -> Rig {
    let mut rig = Rig::with(constant(600.0), options);
    for pair in AVERAGE_KEY {
        rig.write(&pair);
    }
    rig.write(&[0x02, 0x01, 0x03]);
    rig.write(&[0x08, 0x78, 0x00, 0xEC, 0x0F, 0x04, 0x00]);
    rig.set(1_050);
    rig
}

/// Whether each register group of the table of resets is non-zero: settings, status, table, thermistor, pixels.
fn groups(rig: &mut Rig) -> [bool; 5] {
    let settings = [rig.read(0x00, 4), rig.read(0x07, 7)].concat();
    let status = rig.read(0x04, 1);
    let table = rig.read(0x10, 8);
    let thermistor = rig.read(0x0E, 2);
    let pixels = rig.read(0x80, 128);
    [settings, status, table, thermistor, pixels].map(|bytes| bytes.iter().any(|byte| *byte != 0))
}

const HELD: bool = true;
const RESET: bool = false;

/// AMG88 spec of 2016, every row of the table of resets, with the emulator's defaults where table and text disagree.
#[test]
fn the_table_of_resets() {
    let mut rig = all_set(Options::default());
    assert_eq!(groups(&mut rig), [HELD; 5], "before");
    rig.write(&FLAG_RESET);
    assert_eq!(
        groups(&mut rig),
        [HELD, RESET, RESET, HELD, HELD],
        "flag reset"
    );

    let mut rig = all_set(Options::default());
    rig.write(&[0x05, 0x0E]);
    assert_eq!(
        groups(&mut rig),
        [HELD, RESET, HELD, HELD, HELD],
        "status clear, as the text and two users have it"
    );
    let mut rig = all_set(Options {
        status_clear: StatusClear::FlagsAndTable,
        ..Options::default()
    });
    rig.write(&[0x05, 0x0E]);
    assert_eq!(
        groups(&mut rig),
        [HELD, RESET, RESET, HELD, HELD],
        "status clear, as the table has it"
    );

    let mut rig = all_set(Options::default());
    let unplugged = rig.bus.unplug(Address::High).unwrap();
    let mut again = unplugged;
    again.power_cycle(ms(1_060));
    assert_eq!(again.frames(), 1);
    let mut rig = Rig::of(again);
    assert_eq!(groups(&mut rig), [RESET; 5], "power cycle");

    let mut rig = all_set(Options::default());
    rig.write(&SLEEP);
    rig.pass(100);
    rig.write(&NORMAL);
    rig.pass(50);
    rig.write(&INITIAL_RESET);
    rig.pass(2);
    rig.write(&FLAG_RESET);
    assert_eq!(
        groups(&mut rig),
        [HELD, RESET, RESET, HELD, RESET],
        "sleep, normal, 0x3F, 0x30"
    );

    let mut rig = all_set(Options {
        initial_reset: InitialReset::RestoresDefaults,
        ..Options::default()
    });
    rig.write(&INITIAL_RESET);
    assert_eq!(
        groups(&mut rig),
        [RESET, RESET, RESET, HELD, RESET],
        "0x3F as the specification of 2011 words it"
    );
}

/// AMG88 spec §4-11-2: every other byte has no effect on RST.
#[test]
fn no_other_byte_resets_anything() {
    let mut rig = all_set(Options::default());
    let before = rig.image();
    for byte in (0..=0xFF).filter(|byte| !matches!(byte, 0x30 | 0x3F)) {
        rig.write(&[0x01, byte]);
    }
    assert_eq!(rig.image(), before);
    assert_eq!(rig.device().refusals().unknown_commands, 254);
}

/// Section 2.2: one driver sets levels and interrupt control before 0x3F and expects them to survive.
#[test]
fn settings_written_before_an_initial_reset_survive_it() {
    let mut rig = Rig::new(constant(33.0));
    for pair in [[0x08, 0x80], [0x0A, 0x01], [0x0C, 0x08], [0x03, 0x03]] {
        rig.write(&pair);
    }
    rig.pass(10);
    rig.write(&[0x05, 0x0E]);
    rig.write(&INITIAL_RESET);
    rig.pass(300);
    assert_eq!(rig.register(0x04), 0x02);
}

/// Section 2.3: two frames of the array, or two of the registers.
#[test]
fn the_two_frames_after_an_initial_reset_in_both_readings() {
    let expected = [
        (WarmUp::TwoTicks, false, 200),
        (WarmUp::TwoTicks, true, 1_100),
        (WarmUp::TwoFrames, false, 200),
        (WarmUp::TwoFrames, true, 2_000),
    ];
    for (warm_up, one_fps, milliseconds) in expected {
        // Set the rate before the reset, or after it.
        for before in [true, false] {
            let options = Options {
                warm_up,
                ..Options::default()
            };
            let mut rig = Rig::with(constant(20.0), options);
            rig.set(450);
            if one_fps && before {
                rig.write(&ONE_FPS);
            }
            rig.set(500);
            rig.write(&INITIAL_RESET);
            if one_fps && !before {
                rig.pass(30);
                rig.write(&ONE_FPS);
            }
            let place = format!("{warm_up:?}, 1 fps {one_fps}, before {before}");
            assert_eq!(
                rig.device().next_frame_at(),
                Some(ms(500 + milliseconds)),
                "{place}"
            );
            rig.set(500 + milliseconds - 1);
            assert_eq!(rig.word(), 0, "{place}");
            rig.set(500 + milliseconds);
            assert_eq!(rig.word(), 80, "{place}");
        }
    }
}

#[test]
fn two_frames_at_one_fps_are_two_means_and_the_rate_can_still_change() {
    let options = Options {
        warm_up: WarmUp::TwoFrames,
        ..Options::default()
    };
    let mut rig = Rig::with(counting, options);
    rig.write(&ONE_FPS);
    rig.write(&INITIAL_RESET);
    rig.set(2_000);
    assert_eq!(rig.word(), 16, "15.5: mean of 11 to 20");
    rig.set(3_000);
    assert_eq!(rig.word(), 26, "and so on every second");

    rig.write(&INITIAL_RESET);
    rig.set(3_150);
    rig.write(&[0x02, 0x00]);
    rig.set(3_200);
    assert_eq!(rig.word(), 32, "two frames at 10 fps");

    rig.write(&INITIAL_RESET);
    rig.write(&[0x00, 0x21]);
    rig.set(23_199);
    assert_eq!(rig.word(), 0);
    rig.set(23_200);
    assert_eq!(rig.word(), 232, "two intervals of stand-by");
}

/// AMG88 spec §4-11-5: INTF is valid from the second frame on; before that, nothing measures or trips.
#[test]
fn nothing_trips_during_the_two_frames() {
    let mut rig = Rig::new(constant(31.0));
    rig.write(&[0x08, 0x78, 0x00]);
    rig.write(&[0x03, 0x03]);
    rig.set(300);
    rig.write(&INITIAL_RESET);
    rig.set(499);
    assert_eq!((rig.register(0x04), rig.read(0x10, 8)), (0, vec![0; 8]));
    rig.set(500);
    assert_eq!(rig.register(0x04), 0x02);
}
