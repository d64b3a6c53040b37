//! Faults that spoil reads: lost pulses, flipped bits, glitches, torn registers; and their chances.

use crate::support::*;
use amg8833_emulator::{Address, BusError, Chance, Fault, FaultKind};
use embedded_hal::i2c::{I2c, NoAcknowledgeSource};
use grideye_frame::PixelIndex;

/// The pulse of bit 3 is lost, and the bits after it come one place late.
#[test]
fn a_lost_clock_pulse_shifts_what_is_read_and_ends_it() {
    let mut rig = Rig::new(constant(0.0));
    rig.write(&[0x08, 0b1011_0110, 0x05]);
    rig.bus
        .set_fault(Address::High, Fault::ShortClock { byte: 1, bit: 3 });
    assert_eq!(rig.read(0x08, 4), [0b1011_0011, 0xFF, 0xFF, 0xFF]);
    rig.bus
        .set_fault(Address::High, Fault::ShortClock { byte: 2, bit: 0 });
    assert_eq!(rig.read(0x08, 4), [0b1011_0110, 0x05, 0xFF, 0xFF]);
    let mut next = [0; 2];
    rig.bus
        .set_fault(Address::High, Fault::ShortClock { byte: 9, bit: 0 });
    rig.bus.read(HIGH, &mut next).unwrap();
    assert_eq!(next, [0, 0], "the pointer is behind the last byte sent");
    assert_eq!(rig.bus.fault_counts().of(FaultKind::ShortClock), 2);
}

#[test]
fn a_lost_clock_pulse_loses_the_byte_that_is_written() {
    let mut rig = Rig::new(constant(0.0));
    rig.bus
        .set_fault(Address::High, Fault::ShortClock { byte: 2, bit: 7 });
    assert_eq!(
        rig.bus.write(HIGH, &[0x08, 0x11, 0x05, 0x33]).unwrap_err(),
        BusError::NoAcknowledge {
            address: HIGH,
            source: NoAcknowledgeSource::Data
        }
    );
    mended(&mut rig);
    assert_eq!(rig.read(0x08, 3), [0x11, 0, 0]);
}

#[test]
fn a_bit_flips_where_it_was_told_to() {
    let flip = |register, byte, bit| Fault::BitFlip {
        register,
        byte,
        bit,
    };
    let mut rig = Rig::new(constant(0.0));
    rig.write(&[0x08, 0x11, 0x02, 0x33]);
    let cases = [
        (flip(None, None, Some(7)), [0x91, 0x82, 0xB3], 3),
        (flip(Some(0x09), None, Some(0)), [0x11, 0x03, 0x33], 1),
        (flip(None, Some(3), Some(6)), [0x11, 0x02, 0x73], 1),
        (flip(Some(0x09), Some(3), Some(6)), [0x11, 0x02, 0x33], 0),
    ];
    for (fault, bytes, flipped) in cases {
        let before = rig.bus.fault_counts().of(FaultKind::BitFlip);
        if fault == cases[0].0 {
            // If every byte is hit, so is the register address: 0x88 is pixel 5.
            rig.bus.set_fault(Address::High, fault);
            assert_eq!(rig.read(0x08, 3), [0x80, 0x80, 0x80]);
            rig.bus.clear_fault(Address::High);
            rig.write(&[0x08]);
            rig.bus.set_fault(Address::High, fault);
            let mut read = [0; 3];
            rig.bus.read(HIGH, &mut read).unwrap();
            assert_eq!(read, bytes);
            assert_eq!(rig.bus.fault_counts().of(FaultKind::BitFlip), 4 + flipped);
            continue;
        }
        rig.bus.set_fault(Address::High, fault);
        assert_eq!(rig.read(0x08, 3), bytes, "{fault:?}");
        let after = rig.bus.fault_counts().of(FaultKind::BitFlip);
        assert_eq!(after - before, flipped, "{fault:?}");
    }
    rig.bus
        .set_fault(Address::High, flip(Some(0x08), None, Some(4)));
    rig.write(&[0x08, 0x00, 0x00]);
    mended(&mut rig);
    assert_eq!(rig.read(0x08, 2), [0x10, 0x00], "what is written flips too");
}

/// Each bit a third of the time: 30,000 bytes, and six standard deviations (a chance of 2 in a billion).
#[test]
fn chances_hold_to_their_probability() {
    let mut rig = Rig::new(constant(0.0));
    rig.bus.set_seed(11);
    let one = |bit| Fault::BitFlip {
        register: None,
        byte: None,
        bit,
    };
    let third = Chance::new(1.0 / 3.0).unwrap();
    rig.set(100);
    rig.write(&[0x20]);
    rig.bus
        .set_fault_with_chance(Address::High, one(None), third);
    let mut bits = [0_u32; 8];
    for _ in 0..300 {
        let mut bytes = [0; 100];
        rig.bus.read(HIGH, &mut bytes).unwrap();
        // Registers 0x20 to 0x7F and all pixels at 0.0 degrees read 0x00; so do the settings that the pointer passes.
        for byte in bytes.into_iter().filter(|byte| *byte != 0) {
            assert_eq!(byte.count_ones(), 1);
            bits[usize::try_from(byte.trailing_zeros()).unwrap()] += 1;
        }
    }
    let flipped: u32 = bits.iter().sum();
    let deviations = |count: u32, trials: f64, chance: f64| {
        (f64::from(count) - trials * chance) / (trials * chance * (1.0 - chance)).sqrt()
    };
    let off = deviations(flipped, 30_000.0, 1.0 / 3.0);
    assert!(off.abs() < 6.0, "{flipped}: {off}");
    for count in bits {
        let off = deviations(count, f64::from(flipped), 0.125);
        assert!(off.abs() < 6.0, "{bits:?}: {off}");
    }
    let counted = rig.bus.fault_counts().of(FaultKind::BitFlip);
    assert_eq!(counted, u64::from(flipped));
}

/// Per transaction, with the same bound; and adjacent transactions are independent.
#[test]
fn chances_are_drawn_for_every_transaction() {
    let hits = |seed| {
        let mut rig = Rig::new(constant(0.0));
        rig.bus.set_seed(seed);
        let tenth = Chance::new(0.1).unwrap();
        rig.bus
            .set_fault_with_chance(Address::High, Fault::NackAddress, tenth);
        let hits: Vec<bool> = (0..20_000)
            .map(|_| rig.bus.write(HIGH, &[]).is_err())
            .collect();
        let counted = rig.bus.fault_counts().of(FaultKind::NackAddress);
        let hit = hits.iter().filter(|hit| **hit).count();
        assert_eq!(u64::try_from(hit), Ok(counted));
        hits
    };
    let one = hits(1);
    assert_eq!(one, hits(1), "the same seed, the same faults");
    assert_ne!(one, hits(2));
    // 20,000 at one tenth: 2,000 with a standard deviation of 42; 200 in pairs, with 14.
    let count = one.iter().filter(|hit| **hit).count();
    assert!(count.abs_diff(2_000) < 6 * 43, "{count}");
    let pairs = one.windows(2).filter(|pair| pair[0] && pair[1]).count();
    assert!(pairs.abs_diff(200) < 6 * 15, "{pairs}");
}

#[test]
fn a_glitch_spoils_frames_and_trips_the_interrupt() {
    let mut rig = Rig::new(constant(20.0));
    rig.write(&[0x03, 0x03]);
    rig.write(&[0x08, 0x78, 0x00, 0xEC, 0x0F]);
    rig.set(150);
    let pixel = PixelIndex::from_number(9);
    let glitch = |word| Fault::PixelGlitch { pixel, word };
    rig.bus.set_fault(Address::High, glitch(0x1F4));
    assert_eq!(rig.word(), 80, "the frame that is there stays");
    rig.pass(100);
    let mut expected = vec![80; 64];
    expected[8] = 0x1F4;
    assert_eq!(rig.pixels(), expected);
    assert_eq!(rig.read(0x10, 8), [0, 1, 0, 0, 0, 0, 0, 0]);
    rig.bus.set_fault(Address::High, glitch(0x000));
    rig.pass(200);
    expected[8] = 0;
    assert_eq!(rig.pixels(), expected);
    let failed = Fault::ThermistorFailure { word: 0xFFF };
    rig.bus.set_fault(Address::High, failed);
    rig.pass(100);
    assert_eq!(rig.read(0x0E, 2), [0xFF, 0x0F]);
    mended(&mut rig);
    rig.pass(100);
    assert_eq!(rig.word(), 80);
    assert_eq!(rig.read(0x0E, 2), [0x40, 0x01]);
    let counts = rig.bus.fault_counts();
    assert_eq!(counts.of(FaultKind::PixelGlitch), 4);
    assert_eq!(counts.of(FaultKind::ThermistorFailure), 1);
    assert_eq!(counts.total(), 5);
}

#[test]
fn a_glitch_without_a_pixel_strikes_any() {
    let mut rig = Rig::new(constant(20.0));
    let glitch = Fault::PixelGlitch {
        pixel: None,
        word: 0xFFF,
    };
    rig.bus.set_fault(Address::High, glitch);
    let mut hit = [0; 64];
    for _ in 0..6_400 {
        rig.pass(100);
        let pixels = rig.pixels();
        let spoiled: Vec<usize> = (0..64).filter(|place| pixels[*place] != 80).collect();
        assert_eq!(spoiled.len(), 1);
        hit[spoiled[0]] += 1;
    }
    // 100 each, standard deviation 9.9.
    assert!(hit.iter().all(|count| (41..160).contains(count)), "{hit:?}");
}

/// AMG88 spec §4-11-11 disabled: a frame that falls due in a burst lands in the middle of it.
#[test]
fn torn_registers_do_not_stand_still() {
    let mut rig = Rig::new(counting).at_scl(100_000);
    rig.set(196);
    assert_eq!(rig.word(), 1, "without the fault, the frame waits for STOP");
    rig.set(296);
    rig.bus
        .set_fault(Address::High, Fault::Torn { pixel: None });
    let pixels = rig.pixels();
    assert_eq!((pixels[0], pixels[63]), (2, 3));
    assert_eq!(
        pixels.windows(2).filter(|pair| pair[0] != pair[1]).count(),
        1
    );
    // START, two addresses, the register, and 4 ms: bit 400 of the transaction is in byte 41 after the addresses.
    let place = pixels.iter().position(|word| *word == 3).unwrap();
    assert!((19..=21).contains(&place), "{place}");
    rig.set(350);
    assert_eq!(rig.word(), 3, "no frame is due");
    assert_eq!(rig.bus.fault_counts().of(FaultKind::Torn), 1);
}

#[test]
fn torn_at_a_pixel_needs_no_time() {
    let mut rig = Rig::new(counting);
    rig.set(300);
    let pixel = PixelIndex::from_number(17);
    rig.bus.set_fault(Address::High, Fault::Torn { pixel });
    let pixels = rig.pixels();
    assert_eq!(pixels[..16], [2; 16]);
    assert_eq!(pixels[16..], [3; 48]);
    assert_eq!(rig.read(0x0E, 1), [rig.register(0x0E)]);
    assert_eq!(rig.bus.fault_counts().of(FaultKind::Torn), 1);
}
