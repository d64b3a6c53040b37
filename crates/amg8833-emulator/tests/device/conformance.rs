//! Reference section 4.10 line by line, and the register map behind it (sections 1 and 2).

use crate::support::*;
use amg8833_emulator::{
    Address, AverageReadback, Bus, BusError, InitialReset, ManualClock, Options, SleepImage,
};
use core::time::Duration;
use embedded_hal::i2c::{Error, ErrorKind, I2c, NoAcknowledgeSource, Operation};
use grideye_frame::{Celsius, Frame};

#[test]
fn line_1_empty_writes_and_bare_reads_are_acknowledged() {
    let mut rig = Rig::new(constant(20.0));
    rig.bus.write(HIGH, &[]).unwrap();
    rig.bus
        .transaction(HIGH, &mut [Operation::Write(&[]), Operation::Write(&[])])
        .unwrap();
    let mut byte = [0xA5];
    rig.bus.read(HIGH, &mut byte).unwrap();
    assert_eq!(byte, [0x00], "the pointer starts at 0x00");
    rig.write(&[0x80]);
    rig.pass(100);
    rig.bus.read(HIGH, &mut byte).unwrap();
    assert_eq!(byte, [80], "the pointer stays over STOP");
}

/// A frame whose bytes reveal a wrong pointer: pixel n shows n - 33 degrees.
fn numbered() -> Frame {
    let mut frame = uniform(-0.25);
    for (pixel, degrees) in frame.pixels.iter_mut().zip(-32_i8..) {
        *pixel = Celsius::new(f32::from(degrees));
    }
    frame
}

fn numbered_bytes() -> Vec<u8> {
    // -32 degrees are -128 steps, 0xF80 in twelve bits; each pixel is four steps above the previous one.
    (0..64_u16)
        .flat_map(|place| ((0x0F80 + 4 * place) & 0x0FFF).to_le_bytes())
        .collect()
}

#[test]
fn line_2_every_way_of_reading_a_frame_gives_the_same_bytes() {
    let mut rig = Rig::new(|_| numbered());
    rig.pass(100);
    let expected = numbered_bytes();
    assert_eq!(rig.read(0x80, 128), expected);

    let mut apart = [0; 128];
    rig.write(&[0x80]);
    rig.bus.read(HIGH, &mut apart).unwrap();
    assert_eq!(apart, expected[..], "write, STOP, read");

    for chunk in [1, 2, 16, 31, 32, 64] {
        let mut bytes = [0; 128];
        for (at, part) in bytes.chunks_mut(chunk).enumerate() {
            let register = u8::try_from(0x80 + at * chunk).unwrap();
            rig.bus.write_read(HIGH, &[register], part).unwrap();
        }
        assert_eq!(
            bytes,
            expected[..],
            "chunks of {chunk}, each with its address"
        );

        rig.write(&[0x80]);
        for part in bytes.chunks_mut(chunk) {
            part.fill(0xA5);
            rig.bus.read(HIGH, part).unwrap();
        }
        assert_eq!(
            bytes,
            expected[..],
            "chunks of {chunk} without address, STOP between"
        );
    }
}

#[test]
fn line_2_chunks_after_repeated_starts_continue_where_the_last_ended() {
    let mut rig = Rig::new(|_| numbered());
    rig.pass(100);
    let (mut first, mut second, mut third) = ([0; 31], [0; 64], [0; 33]);
    // An empty write between two reads is a repeated START and an address byte, which do not move the pointer.
    rig.bus
        .transaction(
            HIGH,
            &mut [
                Operation::Write(&[0x80]),
                Operation::Read(&mut first),
                Operation::Write(&[]),
                Operation::Read(&mut second),
                Operation::Read(&mut third),
            ],
        )
        .unwrap();
    assert_eq!([&first[..], &second, &third].concat(), numbered_bytes());
}

#[test]
fn line_2_odd_starts_begin_in_the_middle_of_a_pixel() {
    let mut rig = Rig::new(|_| numbered());
    rig.pass(100);
    assert_eq!(rig.read(0x9F, 31), numbered_bytes()[0x1F..0x1F + 31]);
}

#[test]
fn line_2_past_the_end_reading_goes_on_at_the_start() {
    let mut rig = Rig::new(constant(-0.25));
    rig.write(&[0x02, 0x01]);
    rig.write(&[0x02, 0x00]);
    rig.write(&[0x03, 0x02]);
    rig.pass(100);
    assert_eq!(rig.read(0xFE, 6), [0xFF, 0x0F, 0x00, 0x00, 0x00, 0x02]);
}

#[test]
fn line_3_writing_moves_the_pointer_on() {
    let mut rig = Rig::new(constant(20.0));
    rig.write(&[0x08, 0x78, 0x00, 0xEC, 0x0F, 0x04, 0x00]);
    assert_eq!(rig.read(0x08, 6), [0x78, 0x00, 0xEC, 0x0F, 0x04, 0x00]);
    rig.write(&[0x0A, 0xD8, 0x0F]);
    assert_eq!(rig.read(0x08, 6), [0x78, 0x00, 0xD8, 0x0F, 0x04, 0x00]);
    rig.write(&[0x02, 0x01, 0x03]);
    assert_eq!(rig.read(0x02, 2), [0x01, 0x03]);
    let mut next = [0xA5];
    rig.bus.write_read(HIGH, &[0x02, 0x00], &mut next).unwrap();
    assert_eq!(next, [0x03], "a read after a write is of the next register");
}

#[test]
fn line_4_every_register_answers_and_nothing_wedges_the_sensor() {
    let mut rig = Rig::new(counting);
    for register in 0..=0xFF {
        assert_eq!(
            rig.register(register),
            0x00,
            "0x{register:02x} after power-on"
        );
    }
    // Extra bytes from SMBus block writes and other driver mistakes (section 1.3).
    for bytes in [[0x00, 0x01, 0x00], [0x01, 0x01, 0x3F], [0x00, 0x77, 0x12]] {
        rig.write(&bytes);
    }
    assert_eq!(
        rig.read(0x00, 4),
        [0x00, 0x00, 0x01, 0x00],
        "only bit 0 of 0x3F reached FPSC"
    );
    rig.write(&[0x02, 0xFE]);
    rig.pass(100);
    assert_eq!(rig.word(), 1, "an unknown command keeps normal mode");
    assert_eq!(rig.device().refusals().unknown_commands, 5);
}

#[test]
fn line_4_write_only_reserved_and_read_only_registers_keep_nothing() {
    let mut rig = Rig::new(constant(20.0));
    rig.pass(100);
    let mut before = rig.image();
    let unwritable = (0x05..=0x07).chain(0x0E..=0x1E).chain(0x20..=0xFF);
    for register in unwritable {
        rig.write(&[register, 0xF0]);
    }
    assert_eq!(rig.image(), before);
    let refusals = rig.device().refusals();
    assert_eq!(refusals.read_only, 0x18 - 0x0E + 0x80);
    assert_eq!(refusals.reserved, 1 + 0x1F - 0x18 + 0x80 - 0x20);
    assert_eq!(refusals.without_key, 1);
    assert_eq!(refusals.nacks, 0);

    rig.write(&[0x03, 0xFF]);
    rig.write(&[0x09, 0xFF]);
    before[0x03] = 0x03;
    before[0x09] = 0x0F;
    assert_eq!(rig.image(), before, "bits that are not specified read 0");
}

#[test]
fn line_5_empty_reads_are_fine() {
    let mut rig = Rig::new(constant(20.0));
    rig.bus.read(HIGH, &mut []).unwrap();
    rig.bus
        .write_read(HIGH, &[0x08, 0x78, 0x00], &mut [])
        .unwrap();
    assert_eq!(rig.read(0x08, 2), [0x78, 0x00]);
    rig.bus.transaction(HIGH, &mut []).unwrap();
}

#[test]
fn line_6_pixels_are_zero_until_the_first_frame() {
    let mut rig = Rig::new(constant(20.0));
    rig.bus.clock().set(Duration::from_nanos(99_999_999));
    assert_eq!(rig.word(), 0);
    assert_eq!(rig.read(0x0E, 2), [0x00, 0x00]);
    rig.set(100);
    assert_eq!(rig.word(), 0x050);
    assert_eq!(rig.read(0x0E, 2), [0x40, 0x01]);
}

#[test]
fn line_6_an_initial_reset_empties_the_pixels_for_two_frames_and_no_more() {
    let mut rig = Rig::new(counting);
    rig.set(350);
    assert_eq!(rig.word(), 3);
    rig.write(&INITIAL_RESET);
    let mut image = [0; 130];
    rig.bus.write_read(HIGH, &[0x0E], &mut image[..2]).unwrap();
    assert_eq!(
        image[..2],
        [12, 0],
        "the thermistor holds (section 2.2): 0.75 degrees"
    );
    for (time, word) in [(351, 0), (400, 0), (499, 0), (500, 5), (600, 6)] {
        rig.set(time);
        assert_eq!(rig.word(), word, "at {time} ms");
    }
}

#[test]
fn line_7_levels_of_zero_trip_on_any_change_or_on_any_pixel_but_zero() {
    let mut changing = Rig::new(|t| {
        with_pixel(
            20.0,
            7,
            if t < Duration::from_millis(300) {
                20.0
            } else {
                20.25
            },
        )
    });
    changing.set(200);
    assert_eq!(
        changing.register(0x04),
        0x00,
        "difference mode, nothing changed"
    );
    changing.set(300);
    assert_eq!(
        changing.register(0x04),
        0x02,
        "difference mode, one step of one pixel"
    );
    assert_eq!(changing.read(0x10, 8), [0x40, 0, 0, 0, 0, 0, 0, 0]);

    for (celsius, status) in [(0.0, 0x00), (0.25, 0x02), (-0.25, 0x02)] {
        let mut absolute = Rig::new(constant(celsius));
        absolute.write(&[0x03, 0x02]);
        absolute.set(100);
        assert_eq!(absolute.register(0x04), status, "absolute mode, {celsius}");
    }
}

#[test]
fn line_8_the_sleep_image_and_the_only_write_that_wakes() {
    let mut rig = Rig::new(counting);
    rig.write(&ONE_FPS);
    rig.write(&[0x02, 0x00]);
    rig.write(&[0x03, 0x03]);
    rig.set(300);
    rig.write(&SLEEP);
    let mut expected = vec![0; 256];
    expected[0x00] = 0x10;
    expected[0x0F] = 0x80;
    assert_eq!(rig.image(), expected);

    for register in 0..=0xFF {
        rig.write(&[register, 0x21]);
    }
    rig.write(&INITIAL_RESET);
    assert_eq!(rig.image(), expected, "still asleep");
    assert_eq!(rig.device().refusals().asleep, 257);

    rig.set(5_000);
    assert_eq!(rig.image(), expected);
    rig.write(&NORMAL);
    assert_eq!(rig.register(0x00), 0x00);
    assert_eq!(rig.register(0x03), 0x03, "settings hold (section 2.2)");
    assert_eq!(rig.word(), 3, "no frame while asleep");
    rig.set(5_100);
    assert_eq!(rig.word(), 51);
}

#[test]
fn line_8_another_sleep_image_by_option() {
    let options = Options {
        sleep_image: SleepImage::Zero,
        ..Options::default()
    };
    let mut rig = Rig::with(constant(20.0), options);
    rig.set(100);
    rig.write(&SLEEP);
    assert_eq!(rig.image(), vec![0; 256]);
}

#[test]
fn line_9_the_moving_average_needs_its_key() {
    let mut rig = Rig::new(constant(20.0));
    rig.write(&[0x07, 0x20]);
    assert_eq!(rig.register(0x07), 0x00, "no key");
    for wrong in [
        [0x00, 0x45, 0x57],
        [0x50, 0x00, 0x57],
        [0x50, 0x57, 0x45],
        [0x45, 0x50, 0x57],
        [0x50, 0x45, 0x00],
    ] {
        for byte in wrong {
            rig.write(&[0x1F, byte]);
        }
        rig.write(&[0x07, 0x20]);
        assert_eq!(rig.register(0x07), 0x00, "key {wrong:x?}");
    }
    for [register, byte] in [
        [0x1F, 0x50],
        [0x1F, 0x45],
        [0x02, 0x00],
        [0x1F, 0x57],
        [0x07, 0x20],
    ] {
        rig.write(&[register, byte]);
    }
    assert_eq!(
        rig.register(0x07),
        0x00,
        "another write between those of the key"
    );

    for pair in AVERAGE_KEY {
        rig.write(&pair);
    }
    assert_eq!(rig.register(0x07), 0x20);
    rig.write(&[0x07, 0x00]);
    assert_eq!(rig.register(0x07), 0x20, "locked again by 0x1F = 0x00");
    for mut pair in AVERAGE_KEY {
        if pair[0] == 0x07 {
            pair[1] = 0xDF;
        }
        rig.write(&pair);
    }
    assert_eq!(rig.register(0x07), 0x00, "only bit 5 exists");
}

/// Section 2.5: the writes of drivers with a wrong key or none. The sensor continues without averaging.
#[test]
fn line_9_keys_that_drivers_got_wrong() {
    let key_elsewhere = [
        [0x15, 0x50],
        [0x15, 0x45],
        [0x15, 0x57],
        [0x07, 0x20],
        [0x15, 0x00],
    ];
    let value_elsewhere = [
        [0x1F, 0x50],
        [0x1F, 0x45],
        [0x1F, 0x57],
        [0x1F, 0x20],
        [0x1F, 0x00],
    ];
    let another_bit = [
        [0x1F, 0x50],
        [0x1F, 0x45],
        [0x1F, 0x57],
        [0x07, 0x01],
        [0x1F, 0x00],
    ];
    for pairs in [key_elsewhere, value_elsewhere, another_bit] {
        let step = |t: Duration| {
            uniform(if t < Duration::from_secs(1) {
                20.0
            } else {
                24.0
            })
        };
        let mut rig = Rig::new(step);
        for pair in pairs {
            rig.write(&pair);
        }
        assert_eq!(rig.register(0x07), 0x00, "{pairs:02x?}");
        rig.set(900);
        rig.frames();
        rig.set(1_000);
        assert_eq!(rig.word(), 96, "{pairs:02x?}: no mean");
    }
}

/// Section 1.3: Panasonic's 2021 diagrams chain the five pairs by repeated STARTs. A bus that merges adjacent writes
/// cannot show that, so this test sends bytes.
#[test]
fn line_9_the_key_in_one_transaction() {
    let mut rig = Rig::new(constant(20.0));
    let now = Duration::ZERO;
    for pair in AVERAGE_KEY {
        rig.device().start_write(now);
        for byte in pair {
            rig.device().write(byte, now);
        }
    }
    rig.device().stop(now);
    assert_eq!(rig.register(0x07), 0x20);
}

/// Section 6.2, open question 8.
#[test]
fn the_moving_average_may_read_zero_by_option() {
    let options = Options {
        average_readback: AverageReadback::Zero,
        ..Options::default()
    };
    let mut rig = Rig::with(constant(20.0), options);
    for pair in AVERAGE_KEY {
        rig.write(&pair);
    }
    assert_eq!(rig.register(0x07), 0x00);
}

/// Section 2.2, the row of the initial reset, in both readings.
#[test]
fn an_initial_reset_holds_the_settings_or_restores_defaults_by_option() {
    for (initial_reset, held) in [
        (InitialReset::HoldsSettings, true),
        (InitialReset::RestoresDefaults, false),
    ] {
        let mut rig = Rig::with(
            constant(30.0),
            Options {
                initial_reset,
                ..Options::default()
            },
        );
        for pair in AVERAGE_KEY {
            rig.write(&pair);
        }
        rig.write(&[0x02, 0x01, 0x03]);
        rig.write(&[0x08, 0x50, 0x00, 0xEC, 0x0F, 0x04, 0x00]);
        rig.write(&[0x00, 0x21]);
        rig.set(10_000);
        assert_eq!(rig.register(0x04), 0x02);
        rig.write(&INITIAL_RESET);
        let settings = [rig.read(0x00, 4), rig.read(0x07, 7)].concat();
        let expected: [u8; 11] = if held {
            [
                0x21, 0, 0x01, 0x03, 0x20, 0x50, 0x00, 0xEC, 0x0F, 0x04, 0x00,
            ]
        } else {
            [0; 11]
        };
        assert_eq!(settings, expected);
        assert_eq!(rig.register(0x04), 0x00, "flags are reset in both");
        assert_eq!(rig.read(0x10, 8), [0; 8], "the table is reset in both");
        assert_eq!(
            rig.read(0x0E, 2),
            [0xE0, 0x01],
            "the thermistor holds in both"
        );
        assert_eq!(rig.word(), 0);
    }
}

/// AMG88 spec §4-11-9 and §4-11-11 with the 2011 rows: degrees in, register bytes out.
#[test]
fn the_datasheets_rows_through_the_registers() {
    let pixels = [
        (125.0, [0xF4, 0x01]),
        (25.0, [0x64, 0x00]),
        (0.25, [0x01, 0x00]),
        (0.0, [0x00, 0x00]),
        (-0.25, [0xFF, 0x0F]),
        (-25.0, [0x9C, 0x0F]),
        (-55.0, [0x24, 0x0F]),
    ];
    for (celsius, bytes) in pixels {
        let mut rig = Rig::new(constant(celsius));
        rig.set(100);
        assert_eq!(rig.read(0x80, 128), bytes.repeat(64), "{celsius}");
        assert_eq!(rig.register(0x04) & 0x04, 0);
    }
    let thermistors = [
        (127.9375, [0xFF, 0x07]),
        (125.0, [0xD0, 0x07]),
        (25.0, [0x90, 0x01]),
        (0.25, [0x04, 0x00]),
        (0.0, [0x00, 0x00]),
        (-0.25, [0x04, 0x08]),
        (-20.0, [0x40, 0x09]),
        (-59.6875, [0xBB, 0x0B]),
    ];
    for (celsius, bytes) in thermistors {
        let mut rig = Rig::new(move |_| Frame {
            thermistor: Celsius::new(celsius),
            ..uniform(20.0)
        });
        rig.set(100);
        assert_eq!(rig.read(0x0E, 2), bytes, "{celsius}");
        assert_eq!(rig.word(), 0x050);
    }
}

/// Section 1: addresses 0x68 and 0x69, and no other.
#[test]
fn only_the_sensors_addresses_are_acknowledged() {
    let mut bus = Bus::with_sensor(ManualClock::new(), Address::High, uniform(20.0));
    bus.plug(Address::Low, uniform(-25.0), Options::default());
    bus.clock().advance(Duration::from_millis(100));
    for address in 0..=0xFF {
        let result = bus.write(address, &[]);
        if matches!(address, 0x68 | 0x69) {
            assert_eq!(result, Ok(()));
        } else {
            let error = result.unwrap_err();
            assert_eq!(
                error.kind(),
                ErrorKind::NoAcknowledge(NoAcknowledgeSource::Address)
            );
            let source = NoAcknowledgeSource::Address;
            assert_eq!(error, BusError::NoAcknowledge { address, source });
        }
    }
    assert_eq!(bus.traffic().nacks, 254);
    let mut word = [0; 2];
    bus.write_read(0x68, &[0x80], &mut word).unwrap();
    assert_eq!(word, [0x9C, 0x0F]);
    bus.write_read(0x69, &[0x80], &mut word).unwrap();
    assert_eq!(word, [0x50, 0x00]);
    assert!(bus.unplug(Address::Low).is_some());
    assert!(bus.write(0x68, &[]).is_err());
}

#[test]
fn addresses_convert_both_ways() {
    for address in Address::ALL {
        assert_eq!(Address::from_bits(address.bits()), Some(address));
    }
    assert_eq!(Address::from_bits(0x6A), None);
}
