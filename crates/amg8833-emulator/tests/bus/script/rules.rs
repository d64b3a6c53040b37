//! When rules strike, how often, whom, and with what probability.

use super::support::*;
use amg8833_emulator::script::{EVERY_MIN, Lasting, RULES_MAX, Rule, Script, When};
use amg8833_emulator::{Address, BusError, Chance, Fault, FaultKind, Options, STEPS_MAX};
use core::time::Duration;
use embedded_hal::i2c::I2c;
use grideye_frame::PixelIndex;

#[test]
fn a_moment_lasts_its_duration_first_instant_included() {
    let mut bus = from_toml(
        "[[fault]]\nkind = \"nack-address\"\nat = \"12.5 s\"\nduration = \"250 ms\"\naddress = 0x69\n",
    );
    let ns = Duration::from_nanos(1);
    for (at, answer) in [
        (ms(12_500) - ns, Ok(())),
        (ms(12_500), Err(ABSENT)),
        (ms(12_750) - ns, Err(ABSENT)),
        (ms(12_750), Ok(())),
    ] {
        bus.clock().set(at);
        assert_eq!(bus.write(HIGH, &[]), answer, "{at:?}");
    }
    assert_eq!(bus.fault_counts().of(FaultKind::NackAddress), 2);
}

#[test]
fn times_count_from_when_the_script_was_handed_over() {
    let mut bus = bus();
    bus.clock().set(ms(5_000));
    let rule = Rule {
        when: When::Between {
            from: ms(100),
            until: Some(ms(200)),
        },
        ..Rule::new(Fault::BusError)
    };
    bus.set_script(Script::new(0, vec![rule]).unwrap());
    assert_eq!(probe_at(&mut bus, 5_099), Ok(()));
    assert_eq!(probe_at(&mut bus, 5_100), Err(BusError::Bus));
    assert_eq!(probe_at(&mut bus, 5_200), Ok(()));
}

#[test]
fn each_occurrence_has_its_own_count() {
    let mut bus = from_toml("[[fault]]\nkind = \"timeout\"\nevery = \"10 s\"\ncount = 2\n");
    assert_eq!(probe_at(&mut bus, 9_999), Ok(()));
    for round in 1..=3 {
        bus.clock().set(ms(10_000 * round));
        // Each attempt that times out takes one second.
        assert_eq!(bus.write(HIGH, &[]), Err(BusError::Timeout));
        assert_eq!(bus.write(HIGH, &[]), Err(BusError::Timeout));
        assert_eq!(bus.write(HIGH, &[]), Ok(()));
    }
    assert_eq!(bus.fault_counts().of(FaultKind::Timeout), 6);
}

#[test]
fn no_occurrence_begins_at_the_end_or_after_it() {
    let mut bus = from_toml(
        "[[fault]]\nkind = \"brown-out\"\nevery = \"1 s\"\nfrom = \"2 s\"\nuntil = \"5 s\"\n",
    );
    bus.clock().set(ms(60_000));
    bus.advance();
    assert_eq!(
        bus.fault_counts().of(FaultKind::BrownOut),
        2,
        "at 3 and 4 s"
    );
}

#[test]
fn a_frozen_sensor_misses_the_same_frames_whenever_it_is_read() {
    let rule = Rule {
        when: When::Between {
            from: ms(1_000),
            until: Some(ms(2_000)),
        },
        address: Some(Address::High),
        ..Rule::new(Fault::Freeze)
    };
    let mut late = following(vec![rule]);
    late.clock().set(ms(3_000));
    late.advance();
    let mut often = following(vec![rule]);
    for step in 0..300 {
        often.clock().set(ms(10 * (step + 1)));
        let shown = pixels(&mut often).unwrap()[0];
        let tick = 10 * (step + 1) / 100;
        let expected = if (10..20).contains(&tick) { 9 } else { tick };
        assert_eq!(u64::from(shown), expected);
    }
    for bus in [&late, &often] {
        assert_eq!(bus.device(Address::High).unwrap().frames(), 20);
        assert_eq!(bus.fault_counts().of(FaultKind::Freeze), 1);
    }
}

#[test]
fn a_frame_by_its_number_is_spoiled_and_no_other() {
    let text = "[[fault]]\nkind = \"pixel-glitch\"\nframe = 17\npixel = 3\nword = 0\n\
                [[fault]]\nkind = \"pixel-glitch\"\nframe = 1\npixel = 3\nword = 0xFFF\n";
    for look_every in [1, 20] {
        let mut bus = from_toml(text);
        for tick in (look_every..=40).step_by(look_every) {
            bus.clock().set(ms(100 * u64::try_from(tick).unwrap()));
            let shown = pixels(&mut bus).unwrap();
            let number = u16::try_from(tick).unwrap();
            let expected = match tick {
                1 => 0xFFF,
                17 => 0,
                _ => number,
            };
            assert_eq!((shown[2], shown[3]), (expected, number));
        }
        assert_eq!(bus.fault_counts().of(FaultKind::PixelGlitch), 2);
    }
}

#[test]
fn a_fault_by_the_number_of_a_frame_is_there_with_it() {
    let mut bus = from_toml(
        "[[fault]]\nkind = \"stuck-high\"\nframe = 5\nframes = 2\n\
         [[fault]]\nkind = \"freeze\"\nframe = 10\nduration = \"1 s\"\n",
    );
    let mut stuck = Vec::new();
    for tick in 1..=30 {
        bus.clock().set(ms(100 * tick));
        if pixels(&mut bus).unwrap() == [0xFFFF; 64] {
            stuck.push(tick);
        }
    }
    assert_eq!(stuck, [5, 6]);
    // Frozen from 1.0 s with frame 10 in the registers; measures again from 2.0 s.
    assert_eq!(bus.device(Address::High).unwrap().frames(), 10 + 11);
}

#[test]
fn frames_count_from_the_script_and_on_with_a_new_sensor() {
    let rule = Rule {
        when: When::Frame(5),
        lasting: Lasting::Frames(1),
        address: Some(Address::High),
        ..Rule::new(Fault::PixelGlitch {
            pixel: PixelIndex::from_number(1),
            word: 0xFFF,
        })
    };
    let mut bus = bus();
    bus.clock().set(ms(1_000));
    bus.set_script(Script::new(0, vec![rule]).unwrap());
    bus.clock().set(ms(1_200));
    assert_eq!(pixels(&mut bus).unwrap()[0], 12);
    bus.unplug(Address::High);
    bus.clock().set(ms(1_250));
    bus.plug(Address::High, COUNTING, Options::default());
    bus.clock().set(ms(1_350));
    assert_eq!(pixels(&mut bus).unwrap()[0], 13, "its first, our third");
    bus.clock().set(ms(1_450));
    assert_eq!(pixels(&mut bus).unwrap()[0], 14, "its second, our fourth");
    bus.clock().set(ms(1_550));
    assert_eq!(pixels(&mut bus).unwrap()[0], 0xFFF, "its third, our fifth");
    bus.clock().set(ms(1_650));
    assert_eq!(pixels(&mut bus).unwrap()[0], 16);
}

#[test]
fn faults_of_one_address_leave_the_other_alone() {
    let mut bus = from_toml("[[fault]]\nkind = \"unplugged\"\naddress = 0x68\n");
    bus.plug(Address::Low, COUNTING, Options::default());
    assert_eq!(bus.write(HIGH, &[]), Ok(()));
    assert!(bus.write(0x68, &[]).is_err());
    assert_eq!(bus.device(Address::Low).unwrap().next_tick_at(), None);
}

#[test]
fn buses_take_their_own_rules_and_draw_apart() {
    let script = Script::from_toml(
        "[[fault]]\nkind = \"nack-address\"\nprobability = 0.5\n\
         [[fault]]\nkind = \"stuck-high\"\nbus = 3\n",
        "test.toml",
    )
    .unwrap();
    let run = |number| {
        let mut bus = bus();
        bus.set_script(script.for_bus(number));
        let hits: Vec<bool> = (0..64).map(|_| bus.write(HIGH, &[]).is_err()).collect();
        let stuck = bus.faults(Address::High).contains(FaultKind::StuckHigh);
        (hits, stuck)
    };
    assert!(!run(1).1 && run(3).1);
    assert_eq!(run(1), run(1));
    assert_ne!(run(1).0, run(3).0);
}

/// Each fault draws from its own stream, at places that depend only on its subject.
#[test]
fn a_fault_that_is_added_changes_nothing_about_the_others() {
    let half = Chance::new(0.5).unwrap();
    let nack = Rule {
        chance: half,
        ..Rule::new(Fault::NackAddress)
    };
    let flip = Rule {
        chance: half,
        ..Rule::new(Fault::BitFlip {
            register: None,
            byte: None,
            bit: None,
        })
    };
    let hits = |rules| {
        let mut bus = following(rules);
        (0..200)
            .map(|_| bus.write(HIGH, &[0x20]).is_err())
            .collect::<Vec<_>>()
    };
    assert_eq!(hits(vec![nack]), hits(vec![nack, flip]));
    assert_ne!(hits(vec![nack]), hits(vec![flip, nack]));
}

/// Of 4,000 stretches at three quarters: 3,000, standard deviation 27.
#[test]
fn a_stretch_is_drawn_once() {
    let rule = Rule {
        when: When::Every {
            period: ms(10),
            from: Duration::ZERO,
            until: None,
        },
        lasting: Lasting::For(ms(5)),
        chance: Chance::new(0.75).unwrap(),
        address: Some(Address::High),
        ..Rule::new(Fault::Unplugged)
    };
    let mut bus = following(vec![rule]);
    let mut absent = 0;
    for occurrence in 1..=4_000 {
        let first = probe_at(&mut bus, 10 * occurrence);
        assert_eq!(first, probe_at(&mut bus, 10 * occurrence + 4), "throughout");
        assert_eq!(probe_at(&mut bus, 10 * occurrence + 5), Ok(()));
        absent += u64::from(first.is_err());
    }
    assert!(absent.abs_diff(3_000) < 6 * 28, "{absent}");
    assert_eq!(bus.fault_counts().of(FaultKind::Unplugged), absent);
}

#[test]
fn faults_by_call_stand_beside_the_script_and_outlive_it() {
    let mut bus = following(vec![Rule::new(Fault::AllZero)]);
    bus.set_fault(Address::High, Fault::Freeze);
    let both: Vec<_> = bus.faults(Address::High).iter().collect();
    assert_eq!(both, [FaultKind::AllZero, FaultKind::Freeze]);
    bus.clear_fault(Address::High);
    bus.set_fault(Address::High, Fault::StuckHigh);
    bus.clear_script();
    let rest: Vec<_> = bus.faults(Address::High).iter().collect();
    assert_eq!(rest, [FaultKind::StuckHigh]);
}

/// As many rules as allowed are active at once, each with its own slot.
#[test]
fn as_many_faults_at_once_as_there_can_be_rules() {
    let rules: Vec<Rule> = (0..RULES_MAX)
        .map(|slot| Rule {
            lasting: Lasting::Times(1),
            ..Rule::new(Fault::BitFlip {
                register: Some(u8::try_from(slot).unwrap()),
                byte: None,
                bit: Some(0),
            })
        })
        .collect();
    let mut bus = following(rules);
    let mut bytes = [0; 256];
    bus.write_read(HIGH, &[0x00], &mut bytes).unwrap();
    let flipped = bytes.iter().filter(|byte| **byte == 1).count();
    assert_eq!(flipped, RULES_MAX);
    bus.write_read(HIGH, &[0x00], &mut bytes).unwrap();
    assert_eq!(bytes, [0; 256], "each of them once");
}

/// After more steps than are handled one by one, time still arrives at the present.
#[test]
fn a_long_absence_is_skipped_and_the_script_continues() {
    let every = |period, lasting, fault| Rule {
        when: When::Every {
            period,
            from: Duration::ZERO,
            until: None,
        },
        lasting,
        ..Rule::new(fault)
    };
    let long = EVERY_MIN * STEPS_MAX * 3 + ms(100_000);
    let mut bus = following(vec![
        every(EVERY_MIN, Lasting::Times(1), Fault::BusError),
        every(ms(10_000), Lasting::For(ms(5_000)), Fault::NackAddress),
    ]);
    bus.clock().set(long - Duration::from_micros(500));
    assert_eq!(bus.write(HIGH, &[]), Err(BusError::Bus));
    assert_eq!(
        bus.write(HIGH, &[]),
        Ok(()),
        "the second half of ten seconds"
    );
    bus.clock().set(long + ms(10_000));
    assert_eq!(bus.write(HIGH, &[]), Err(BusError::Bus));
    assert_eq!(bus.write(HIGH, &[]), Err(ABSENT));
}
