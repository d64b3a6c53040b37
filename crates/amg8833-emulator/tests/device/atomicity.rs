//! Reference section 1.4: a burst never mixes frames; several transactions can.

use crate::support::*;
use amg8833_emulator::{Ack, Device, FrameSource, Options};
use core::time::Duration;
use embedded_hal::i2c::{I2c, Operation};

fn byte<S: FrameSource>(device: &mut Device<S>, now: Duration) -> u8 {
    device.read(now)
}

#[test]
fn a_frame_that_falls_due_in_an_open_transaction_waits_for_stop() {
    let mut device = Device::new(counting, Options::default(), Duration::ZERO);
    assert_eq!(device.start_write(ms(190)), Ack::Ack);
    assert_eq!(device.write(0x80, ms(191)), Ack::Ack);
    assert_eq!(device.start_read(ms(192)), Ack::Ack);
    for pixel in 0..64 {
        // Three frames fall due between 192 ms and 507 ms.
        let now = ms(192 + 5 * pixel);
        assert_eq!((byte(&mut device, now), byte(&mut device, now)), (1, 0));
    }
    assert_eq!(
        device.start_write(ms(520)),
        Ack::Ack,
        "a repeated START latches nothing new"
    );
    device.write(0x80, ms(520));
    device.start_read(ms(521));
    assert_eq!(byte(&mut device, ms(522)), 1);
    assert_eq!(device.frames(), 1);
    device.advance(ms(530));
    assert_eq!(device.frames(), 1, "not even when advanced");
    device.stop(ms(540));
    assert_eq!(device.frames(), 5, "every due frame, once");
    device.start_write(ms(541));
    device.write(0x80, ms(541));
    device.start_read(ms(541));
    assert_eq!(byte(&mut device, ms(541)), 5);
}

#[test]
fn a_burst_over_the_wire_never_mixes_and_two_transactions_can() {
    let mut rig = Rig::new(counting).at_scl(100_000);
    rig.set(195);
    // 11.8 ms from START to STOP; the second frame falls due in between.
    assert_eq!(rig.word(), 1);
    assert_eq!(rig.word(), 2);

    rig.set(295);
    let halves = [rig.read(0x80, 64), rig.read(0xC0, 64)].concat();
    let pixels = words(&halves);
    assert_eq!((pixels[0], pixels[63]), (2, 3), "two transactions: torn");
}

#[test]
fn several_reads_in_one_transaction_are_one_snapshot() {
    let mut rig = Rig::new(counting).at_scl(100_000);
    rig.set(190);
    let (mut thermistor, mut first, mut second) = ([0; 2], [0; 128], [0; 128]);
    rig.bus
        .transaction(
            HIGH,
            &mut [
                Operation::Write(&[0x0E]),
                Operation::Read(&mut thermistor),
                Operation::Write(&[0x80]),
                Operation::Read(&mut first),
                Operation::Write(&[0x80]),
                Operation::Read(&mut second),
            ],
        )
        .unwrap();
    assert_eq!(thermistor, [4, 0]);
    assert_eq!(words(&first), [1; 64]);
    assert_eq!(words(&second), [1; 64]);
    assert_eq!(rig.word(), 2);
}

/// AMG88 spec §4-11-10: the interrupt table updates together with the pixels.
#[test]
fn the_table_belongs_to_the_same_snapshot() {
    let mut rig = Rig::new(counting);
    rig.write(&[0x03, 0x02]);
    rig.write(&[0x08, 0x01, 0x00]);
    rig.set(150);
    let device = rig.device();
    device.start_write(ms(150));
    device.write(0x04, ms(150));
    device.start_read(ms(150));
    assert_eq!(byte(device, ms(250)), 0x00, "the second frame would trip");
    // Pointer 0x05 to 0x0F, then the table.
    let behind: Vec<u8> = (0..19).map(|_| byte(device, ms(250))).collect();
    assert_eq!(behind[11..], [0; 8], "the table of the same frame");
    device.stop(ms(251));
    assert_eq!(rig.register(0x04), 0x02);
    assert_eq!(rig.read(0x10, 8), [0xFF; 8]);
}

/// A flag that rises again in the transaction that clears it must not be lost.
#[test]
fn a_frame_that_trips_during_the_clearing_trips_after_it() {
    let mut rig = Rig::new(counting);
    rig.set(250);
    let device = rig.device();
    device.start_write(ms(299));
    device.write(0x05, ms(299));
    device.write(0x0E, ms(301));
    device.stop(ms(302));
    assert_eq!(rig.register(0x04), 0x02);
}

/// The percentage of torn frames over all phases between reader and sensor, for one way of reading.
fn torn_percent(scl_hz: u32, read: impl Fn(&mut Rig) -> Vec<u8>) -> usize {
    (0..100)
        .filter(|phase| {
            let mut rig = Rig::new(counting).at_scl(scl_hz);
            rig.set(100 + phase);
            let pixels = words(&read(&mut rig));
            pixels.iter().any(|word| *word != pixels[0])
        })
        .count()
}

/// The estimates of sections 1.4 and 5: the pixels' readout time divided by the frame period.
#[test]
fn ways_of_reading_tear_as_often_as_estimated() {
    let burst = |rig: &mut Rig| rig.read(0x80, 128);
    let in_chunks = |size: usize| {
        move |rig: &mut Rig| {
            let starts = (0x80..=0xFF_u8).step_by(size);
            starts
                .flat_map(|register| rig.read(register, size))
                .collect()
        }
    };
    assert_eq!(torn_percent(100_000, burst), 0);
    assert_eq!(torn_percent(400_000, burst), 0);
    // 64 x 48 bits and 128 x 39 bits, minus the first transaction, in which a due frame does not tear.
    let expected = [
        (100_000, 2, 30),
        (400_000, 2, 7),
        (100_000, 1, 49),
        (400_000, 1, 12),
        (400_000, 16, 3),
    ];
    for (hz, size, percent) in expected {
        let torn = torn_percent(hz, in_chunks(size));
        assert!(
            torn.abs_diff(percent) <= 1,
            "{size} bytes at {hz} Hz: {torn} %, expected {percent}"
        );
    }
}
