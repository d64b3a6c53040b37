//! Transactions decided byte by byte while they are open, as a microcontroller's hardware makes them.

use crate::random::Random;
use amg8833_emulator::{Address, Bus, BusError, Fault, ManualClock};
use core::time::Duration;
use embedded_hal::i2c::{I2c, NoAcknowledgeSource, Operation};
use grideye_frame::{Celsius, Frame};

type Source = fn(Duration) -> Frame;

/// A quarter of a degree more with every frame.
fn rising(t: Duration) -> Frame {
    let frames = u16::try_from(t.as_millis() / 100 % 400).unwrap();
    Frame::uniform(Celsius::new(f32::from(frames) / 4.0))
}

fn sensor(clock: &ManualClock) -> Bus<&ManualClock, Source> {
    let source: Source = rising;
    let bus = Bus::with_sensor(clock, Address::High, source);
    bus.with_scl_hz(400_000.try_into().unwrap())
}

/// What a transaction did: its outcome, and the bytes it read.
type Done = (Result<(), BusError>, Vec<u8>);

/// Writes these bytes and reads so many, in one call.
fn at_once(bus: &mut Bus<&ManualClock, Source>, address: u8, write: &[u8], read: usize) -> Done {
    let mut bytes = vec![0; read];
    let mut operations = [Operation::Write(write), Operation::Read(&mut bytes)];
    let outcome = bus.transaction(address, &mut operations);
    (outcome, bytes)
}

/// The same byte by byte; a controller stops at the first byte that is not acknowledged.
fn one_by_one(bus: &mut Bus<&ManualClock, Source>, address: u8, write: &[u8], read: usize) -> Done {
    let mut bytes = vec![0; read];
    let outcome = bus.converse(address, false, &mut |carry| {
        let mut all = || {
            carry(&mut Operation::Write(&[]))?;
            for byte in write {
                carry(&mut Operation::Write(&[*byte]))?;
            }
            carry(&mut Operation::Read(&mut []))?;
            for byte in bytes.chunks_mut(1) {
                carry(&mut Operation::Read(byte))?;
            }
            Ok::<(), NoAcknowledgeSource>(())
        };
        let _ = all();
    });
    (outcome, bytes)
}

/// The same, held open between calls.
fn held_open(bus: &mut Bus<&ManualClock, Source>, address: u8, write: &[u8], read: usize) -> Done {
    let mut bytes = vec![0; read];
    let mut open = bus.start(address, false).unwrap();
    let mut all = || {
        bus.step(&mut open, &mut Operation::Write(&[]))?;
        for byte in write {
            bus.step(&mut open, &mut Operation::Write(&[*byte]))?;
        }
        bus.step(&mut open, &mut Operation::Read(&mut []))?;
        for byte in bytes.chunks_mut(1) {
            bus.step(&mut open, &mut Operation::Read(byte))?;
        }
        Ok::<(), NoAcknowledgeSource>(())
    };
    let _ = all();
    (bus.stop(open), bytes)
}

#[test]
fn byte_by_byte_is_the_same_transaction_as_at_once() {
    let clocks = [const { ManualClock::new() }; 3];
    let mut buses = [sensor(&clocks[0]), sensor(&clocks[1]), sensor(&clocks[2])];
    let mut random = Random::new(3);
    for bus in &mut buses {
        assert!(bus.set_fault_with_chance(
            Address::High,
            Fault::NackByte(1),
            amg8833_emulator::Chance::new(0.2).unwrap(),
        ));
    }
    let mut refused = 0;
    for _ in 0..2_000 {
        let address = if random.below(10) == 0 { 0x20 } else { 0x69 };
        let register = random.below(256).to_le_bytes()[0];
        let write = [register, random.below(256).to_le_bytes()[0]];
        let write = &write[..1 + usize::try_from(random.below(2)).unwrap()];
        let read = usize::try_from(random.below(140)).unwrap();
        let wait = Duration::from_micros(random.below(40_000));
        clocks.iter().for_each(|clock| clock.advance(wait));
        let [first, second, third] = &mut buses;
        let known = at_once(first, address, write, read);
        assert_eq!(known, one_by_one(second, address, write, read));
        assert_eq!(known, held_open(third, address, write, read));
        assert_eq!(first.traffic(), second.traffic());
        assert_eq!(first.traffic(), third.traffic());
        assert_eq!(first.fault_counts(), third.fault_counts());
        refused += u32::from(known.0.is_err());
    }
    assert!((200..1_800).contains(&refused), "{refused}");
}

/// Reference section 1.4: within one transaction old and new pixels never mingle, however long it takes.
#[test]
fn the_registers_stand_still_until_the_stop() {
    let clock = ManualClock::new();
    let mut bus = sensor(&clock);
    clock.set(Duration::from_millis(500));
    let mut pixels = [0; 128];
    bus.converse(0x69, false, &mut |carry| {
        carry(&mut Operation::Write(&[0x80])).unwrap();
        for byte in pixels.chunks_mut(1) {
            carry(&mut Operation::Read(byte)).unwrap();
            clock.advance(Duration::from_millis(10));
        }
    })
    .unwrap();
    assert!(pixels.chunks(2).all(|pixel| *pixel == pixels[..2]));
    let mut after = [0; 2];
    bus.write_read(0x69, &[0x80], &mut after).unwrap();
    assert_ne!(after, pixels[..2]);
}

#[test]
fn a_bus_that_is_held_fails_before_the_first_byte() {
    let clock = ManualClock::new();
    let mut bus = sensor(&clock);
    assert!(bus.set_fault(None, Fault::Timeout));
    let held = bus.converse(0x69, true, &mut |_| panic!("there is no bus"));
    assert_eq!(held, Err(BusError::Timeout));
    assert_eq!(bus.start(0x69, true).err(), Some(BusError::Timeout));
}
