//! Reference sections 1.2 and 1.3: the transactions of drivers that ran on the real part, byte by byte.

use crate::support::*;
use amg8833_emulator::{Ack, Device, Options, PastTheEnd, UnspecifiedBits};
use core::time::Duration;
use embedded_hal::i2c::{I2c, Operation};

type Sensor = Device<Source>;

fn sensor() -> Sensor {
    let source: Source = Box::new(counting);
    Device::new(source, Options::default(), ms(0))
}

/// S, address for writing, these bytes; no STOP.
fn begin(device: &mut Sensor, bytes: &[u8], now: u64) {
    assert_eq!(device.start_write(ms(now)), Ack::Ack);
    for byte in bytes {
        assert_eq!(device.write(*byte, ms(now)), Ack::Ack);
    }
}

/// Sr, address for reading, this many bytes, STOP.
fn end_reading(device: &mut Sensor, count: usize, now: u64) -> Vec<u8> {
    assert_eq!(device.start_read(ms(now)), Ack::Ack);
    let bytes = (0..count).map(|_| device.read(ms(now))).collect();
    device.stop(ms(now));
    bytes
}

fn registers(device: &mut Sensor, register: u8, count: usize, now: u64) -> Vec<u8> {
    begin(device, &[register], now);
    end_reading(device, count, now)
}

/// The 2021 interface document sets a level in two pairs after repeated STARTs, with one STOP.
#[test]
fn pairs_after_repeated_starts_in_one_transaction() {
    let mut device = sensor();
    begin(&mut device, &[0x08, 0xD8], 0);
    begin(&mut device, &[0x09, 0x0F], 0);
    begin(&mut device, &[0x03, 0x02], 0);
    device.stop(ms(0));
    assert_eq!(registers(&mut device, 0x08, 2, 0), [0xD8, 0x0F]);
    assert_eq!(registers(&mut device, 0x03, 1, 0), [0x02]);
}

/// An Arduino driver sends the address alone before every write, then again with the bytes.
#[test]
fn an_address_alone_before_a_repeated_start() {
    let mut device = sensor();
    begin(&mut device, &[], 0);
    begin(&mut device, &[0x02, 0x01], 0);
    device.stop(ms(0));
    assert_eq!(registers(&mut device, 0x02, 1, 0), [0x01]);
}

/// Drivers that never send a STOP after a write continue with a START, which counts as a repeated one.
#[test]
fn writes_without_a_stop() {
    let mut device = sensor();
    for bytes in [
        &[0x00, 0x00, 0x00][..],
        &[0x01, 0x00, 0x3F],
        &[0x02, 0x00, 0x00],
        &[0x03, 0x00, 0x00],
    ] {
        begin(&mut device, bytes, 0);
    }
    assert_eq!(registers(&mut device, 0x80, 2, 250), [0, 0], "no STOP yet");
    assert_eq!(registers(&mut device, 0x80, 2, 250), [2, 0]);
    assert_eq!(registers(&mut device, 0x00, 4, 250), [0, 0, 0, 0]);
}

/// SMBus block writes put a count between register and value; other drivers put a zero. Neither blocks the sensor.
#[test]
fn a_byte_too_many_shifts_the_value_to_the_next_register() {
    let mut rig = Rig::new(counting);
    rig.write(&[0x00, 0x01, 0x00]);
    assert_eq!(rig.read(0x00, 2), [0x00, 0x00]);
    rig.write(&[0x01, 0x01, 0x3F]);
    assert_eq!(rig.read(0x02, 1), [0x01], "bit 0 of 0x3F: 1 fps");
    rig.write(&[0x02, 0x00, 0x00]);
    rig.set(200);
    assert_eq!(rig.word(), 2);
    assert_eq!(rig.device().refusals().unknown_commands, 3);
}

/// CircuitPython reads 0x00, 0x01, 0x03, 0x02 before it writes them.
#[test]
fn every_setting_can_be_read_before_it_is_written() {
    let mut rig = Rig::new(constant(20.0));
    rig.bus.write(HIGH, &[]).unwrap();
    for [register, byte] in [[0x00, 0x00], [0x01, 0x3F], [0x03, 0x00], [0x02, 0x00]] {
        assert_eq!(rig.register(register), 0x00);
        rig.write(&[register, byte]);
    }
    rig.set(200);
    assert_eq!(rig.word(), 80);
}

/// amg88 0.4.1 reads one byte after each write, from the next register: 0x20 after 0x1F.
#[test]
fn a_read_behind_each_write_is_of_the_register_after_it() {
    let mut rig = Rig::new(constant(20.0));
    for [register, byte] in AVERAGE_KEY {
        let mut next = [0xA5];
        rig.bus
            .write_read(HIGH, &[register, byte], &mut next)
            .unwrap();
        assert_eq!(next, [0x00], "after 0x{register:02x}");
    }
    assert_eq!(rig.register(0x07), 0x20);
}

/// The breakout board's firmware: 0x80 and STOP, then four reads of 32 bytes without a register address, 2 ms apart.
#[test]
fn the_pointer_continues_across_stops() {
    let mut rig = Rig::new(counting);
    rig.set(110);
    rig.write(&[0x80]);
    let mut frame = Vec::new();
    for _ in 0..4 {
        let mut part = [0; 32];
        rig.bus.read(HIGH, &mut part).unwrap();
        frame.extend(part);
        rig.pass(2);
    }
    assert_eq!(words(&frame), [1; 64]);
    let mut behind = [0xA5];
    rig.bus.read(HIGH, &mut behind).unwrap();
    assert_eq!(behind, [0x00], "then from the start");
}

#[test]
fn the_pointer_stays_at_the_end_by_option() {
    let options = Options {
        past_the_end: PastTheEnd::Stays,
        ..Options::default()
    };
    let mut rig = Rig::with(constant(-0.25), options);
    rig.set(100);
    assert_eq!(rig.read(0xFD, 6), [0x0F, 0xFF, 0x0F, 0x0F, 0x0F, 0x0F]);
}

/// Section 1.3, bus recovery: more than nine clocks with SDA high, then STOP, wherever the transfer stopped.
#[test]
fn clocks_and_a_stop_free_the_bus_wherever_a_transfer_was_left() {
    for left_after in 0..6 {
        let mut device = sensor();
        device.advance(ms(150));
        for step in 0..left_after {
            match step {
                0 => assert_eq!(device.start_write(ms(150)), Ack::Ack),
                1 => assert_eq!(device.write(0x80, ms(150)), Ack::Ack),
                2 => assert_eq!(device.start_read(ms(150)), Ack::Ack),
                _ => assert_ne!(device.read(ms(150)), 0xFF),
            }
        }
        // To a device that still drives the line, nine clocks are one more byte.
        device.read(ms(150));
        device.stop(ms(150));
        assert_eq!(registers(&mut device, 0x80, 2, 260), [2, 0], "{left_after}");
    }
}

/// Without START no device is addressed: bytes are not acknowledged, and the released line reads ones.
#[test]
fn nothing_answers_outside_a_transfer() {
    let mut device = sensor();
    assert_eq!(device.write(0x00, ms(0)), Ack::Nack);
    assert_eq!(device.read(ms(0)), 0xFF);
    device.start_read(ms(0));
    assert_eq!(
        device.write(0x00, ms(0)),
        Ack::Nack,
        "addressed for reading"
    );
    device.start_write(ms(0));
    assert_eq!(device.read(ms(0)), 0xFF, "addressed for writing");
    device.stop(ms(0));
    assert_eq!(device.refusals().nacks, 2);
}

/// Section 1.1: bits 7 to 4 of high bytes are unspecified; drivers that do not mask them rely on 0.
#[test]
fn unspecified_bits_read_ones_by_option() {
    let options = Options {
        unspecified_bits: UnspecifiedBits::Ones,
        ..Options::default()
    };
    let mut rig = Rig::with(constant(-0.25), options);
    rig.write(&[0x08, 0x78, 0x00, 0xEC, 0x0F, 0x04, 0x00]);
    rig.set(100);
    assert_eq!(
        rig.read(0x08, 8),
        [0x78, 0xF0, 0xEC, 0xFF, 0x04, 0xF0, 0x04, 0xF8]
    );
    assert_eq!(rig.read(0x80, 128), [0xFF, 0xFF].repeat(64));
    assert_eq!(rig.read(0x00, 8), [0; 8], "no words there");
    assert_eq!(rig.read(0x18, 8), [0; 8]);
    rig.write(&SLEEP);
    assert_eq!(rig.read(0x0E, 2), [0x00, 0x80], "the sleep image counts");
}

/// Sections 1.1 and 3.3: cold objects read below 0 °C, down to -50 °C and beyond, without clamping.
#[test]
fn nothing_is_clamped_at_zero() {
    for celsius in [-0.25_f32, -20.0, -50.0, -200.0] {
        let mut rig = Rig::new(constant(celsius));
        rig.set(100);
        let word = i16::try_from(rig.word()).unwrap();
        assert_eq!(f32::from((word << 4) >> 4) / 4.0, celsius);
        assert_eq!(rig.register(0x04) & 0x04, 0);
    }
}

/// Section 1.3: the sensor never stretches the clock, so 128 bytes at 400 kHz take 131 bytes of nine bits, START,
/// repeated START and STOP: 2.955 ms; a real sensor measured 2.9 ms.
#[test]
fn a_burst_takes_its_bits_and_no_more() {
    use amg8833_emulator::Clock;
    let mut rig = Rig::new(counting).at_scl(400_000);
    rig.read(0x80, 128);
    assert_eq!(rig.bus.clock().now().as_nanos(), 2_955_000);
}

/// `i2cdetect -r` reads one byte at the pointer; `-q` writes none.
#[test]
fn probes_are_acknowledged_in_every_mode() {
    for mode in [[0x00, 0x00], [0x00, 0x10], [0x00, 0x21]] {
        let mut rig = Rig::new(counting);
        rig.write(&mode);
        rig.bus.write(HIGH, &[]).unwrap();
        rig.bus.read(HIGH, &mut [0]).unwrap();
        rig.bus.read(HIGH, &mut []).unwrap();
        rig.bus
            .transaction(HIGH, &mut [Operation::Write(&[]), Operation::Read(&mut [])])
            .unwrap();
    }
}

/// Section 5: bytes, bits and time of one frame with its thermistor.
#[test]
fn a_frame_costs_what_the_reference_says() {
    for (hz, microseconds) in [(100_000, 12_300), (400_000, 3_075)] {
        let mut rig = Rig::new(constant(20.0)).at_scl(hz);
        rig.read(0x80, 128);
        rig.read(0x0E, 2);
        let traffic = rig.bus.traffic();
        assert_eq!(
            (traffic.transactions, traffic.bytes, traffic.bits),
            (2, 136, 1_230)
        );
        assert_eq!(now(&rig), Duration::from_micros(microseconds));
    }

    let mut rig = Rig::new(constant(20.0)).at_scl(100_000);
    for register in (0x80..=0xFF).step_by(2).chain([0x0E]) {
        rig.read(register, 2);
    }
    let traffic = rig.bus.traffic();
    assert_eq!(
        (traffic.transactions, traffic.bytes, traffic.bits),
        (65, 325, 3_120)
    );
    assert_eq!(now(&rig), Duration::from_micros(31_200));

    let mut rig = Rig::new(constant(20.0)).at_scl(100_000);
    let (mut thermistor, mut pixels) = ([0; 2], [0; 128]);
    rig.bus
        .transaction(
            HIGH,
            &mut [
                Operation::Write(&[0x0E]),
                Operation::Read(&mut thermistor),
                Operation::Write(&[0x80]),
                Operation::Read(&mut pixels),
            ],
        )
        .unwrap();
    let traffic = rig.bus.traffic();
    assert_eq!(
        (traffic.transactions, traffic.bytes, traffic.bits),
        (1, 136, 1_229)
    );
}

/// Section 5, the row of write, STOP, read: 4 transactions, 1,232 bits.
#[test]
fn a_stop_in_between_costs_a_bit() {
    let mut rig = Rig::new(constant(20.0));
    for (register, count) in [(0x80, 128), (0x0E, 2)] {
        rig.write(&[register]);
        rig.bus.read(HIGH, &mut vec![0; count]).unwrap();
    }
    let traffic = rig.bus.traffic();
    assert_eq!(
        (traffic.transactions, traffic.bytes, traffic.bits),
        (4, 136, 1_232)
    );
    assert_eq!(
        now(&rig),
        Duration::ZERO,
        "instant transactions take no time"
    );
}

#[test]
fn odd_frequencies_lose_no_time_over_many_transfers() {
    let mut rig = Rig::new(constant(20.0)).at_scl(333_333);
    for _ in 0..100 {
        rig.read(0x80, 128);
    }
    let bits = u128::from(rig.bus.traffic().bits);
    assert_eq!(now(&rig).as_nanos(), bits * 1_000_000_000 / 333_333);
}

fn now(rig: &Rig) -> Duration {
    use amg8833_emulator::Clock;
    rig.bus.clock().now()
}
