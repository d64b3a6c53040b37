//! The sensor broken on command: what the host sees, and what is left when it is mended.

use crate::support::*;
use amg8833_emulator::{Address, BusError, Clock, Fault, HANG_TIMEOUT, InterruptPin, Options};
use embedded_hal::i2c::{Error, ErrorKind, I2c, NoAcknowledgeSource};

fn broken(fault: Fault) -> Rig {
    let mut rig = Rig::new(counting);
    rig.set(300);
    assert!(rig.bus.set_fault(Address::High, fault));
    rig
}

fn mended(rig: &mut Rig) {
    assert!(rig.bus.clear_fault(Address::High));
    assert_eq!(rig.device().fault(), None);
}

#[test]
fn faults_of_the_bus_are_the_controllers_errors() {
    let address = HIGH;
    let no_acknowledge = |source| BusError::NoAcknowledge { address, source };
    let faults = [
        (
            Fault::NackAddress,
            no_acknowledge(NoAcknowledgeSource::Address),
        ),
        (Fault::NackData, no_acknowledge(NoAcknowledgeSource::Data)),
        (Fault::BusError, BusError::Bus),
        (Fault::ArbitrationLoss, BusError::ArbitrationLoss),
        (Fault::Hang, BusError::Timeout),
        (Fault::Unplugged, BusError::Gone),
    ];
    for (fault, error) in faults {
        let mut rig = broken(fault);
        let mut bytes = [0xA5; 128];
        assert_eq!(
            rig.bus.write_read(HIGH, &[0x80], &mut bytes),
            Err(error),
            "{fault:?}"
        );
        assert_eq!(bytes, [0xA5; 128], "the buffer is not touched");
        assert_eq!(rig.device().fault(), Some(fault));
        mended(&mut rig);
        rig.pass(200);
        assert_ne!(rig.word(), 0, "{fault:?} mended");
    }
}

#[test]
fn every_error_has_its_kind_and_its_words() {
    let address = HIGH;
    let of = |source| BusError::NoAcknowledge { address, source };
    let kinds = [
        (
            of(NoAcknowledgeSource::Address),
            ErrorKind::NoAcknowledge(NoAcknowledgeSource::Address),
        ),
        (
            of(NoAcknowledgeSource::Data),
            ErrorKind::NoAcknowledge(NoAcknowledgeSource::Data),
        ),
        (BusError::Bus, ErrorKind::Bus),
        (BusError::ArbitrationLoss, ErrorKind::ArbitrationLoss),
        (BusError::Timeout, ErrorKind::Other),
        (BusError::Gone, ErrorKind::Other),
    ];
    for (error, kind) in kinds {
        assert_eq!(error.kind(), kind);
        let text = error.to_string();
        assert!(
            text.starts_with(char::is_lowercase) && !text.ends_with('.'),
            "{text}"
        );
    }
    let text = of(NoAcknowledgeSource::Address).to_string();
    assert_eq!(text, "no device acknowledged address 0x69");
}

#[test]
fn a_hang_takes_the_controllers_patience() {
    let mut rig = broken(Fault::Hang);
    let before = rig.bus.clock().now();
    assert!(rig.bus.write(HIGH, &[]).is_err());
    assert_eq!(rig.bus.clock().now() - before, HANG_TIMEOUT);
}

#[test]
fn what_takes_the_whole_bus_takes_its_other_sensor_too() {
    let faults = [
        (Fault::Hang, Err(BusError::Timeout)),
        (Fault::Unplugged, Err(BusError::Gone)),
        (Fault::NackAddress, Ok(())),
        (Fault::BusError, Ok(())),
    ];
    for (fault, neighbour) in faults {
        let mut rig = broken(fault);
        let source: Source = Box::new(counting);
        rig.bus.plug(Address::Low, source, Options::default());
        assert_eq!(rig.bus.write(0x68, &[0x80]), neighbour, "{fault:?}");
        let nobody = rig.bus.write(0x42, &[]).unwrap_err();
        assert_eq!(nobody, neighbour.err().unwrap_or(NOBODY), "{fault:?}");
        mended(&mut rig);
        assert_eq!(rig.bus.write(0x68, &[0x80]), Ok(()), "{fault:?} mended");
    }

    let mut rig = broken(Fault::Hang);
    let source: Source = Box::new(counting);
    rig.bus.plug(Address::Low, source, Options::default());
    rig.bus.set_fault(Address::Low, Fault::Unplugged);
    for address in [0x68, 0x69] {
        assert_eq!(
            rig.bus.write(address, &[]),
            Err(BusError::Gone),
            "no adapter, no wait"
        );
    }
}

const NOBODY: BusError = BusError::NoAcknowledge {
    address: 0x42,
    source: NoAcknowledgeSource::Address,
};

#[test]
fn stuck_lines_read_all_ones_or_all_zeros() {
    for (fault, byte) in [(Fault::StuckHigh, 0xFF), (Fault::AllZero, 0x00)] {
        let mut rig = broken(fault);
        assert_eq!(rig.read(0x80, 128), vec![byte; 128]);
        assert_eq!(rig.read(0x00, 16), vec![byte; 16]);
        rig.pass(100);
        mended(&mut rig);
        assert_eq!(rig.word(), 4, "it measured all the while");
    }
}

#[test]
fn a_frozen_sensor_answers_and_measures_no_more() {
    let mut rig = broken(Fault::Freeze);
    rig.set(1_000);
    assert_eq!(rig.word(), 3);
    assert_eq!(rig.device().next_tick_at(), None);
    rig.write(&ONE_FPS);
    assert_eq!(rig.register(0x02), 0x01);
    rig.write(&INITIAL_RESET);
    rig.set(3_000);
    assert_eq!(
        rig.word(),
        0,
        "a reset empties the pixels and brings no frame"
    );
    rig.write(&[0x02, 0x00]);
    mended(&mut rig);
    rig.set(3_100);
    assert_eq!(rig.word(), 31);
}

#[test]
fn a_brown_out_silently_restores_the_defaults() {
    let mut rig = Rig::new(counting);
    rig.write(&[0x03, 0x03]);
    rig.write(&ONE_FPS);
    rig.set(1_050);
    assert_eq!(rig.word(), 6);
    rig.write(&[0x80]);
    rig.bus.set_fault(Address::High, Fault::BrownOut);
    assert_eq!(rig.device().fault(), None, "it is over at once");
    rig.pass(100);
    let mut bytes = [0xA5; 3];
    rig.bus.read(HIGH, &mut bytes).unwrap();
    assert_eq!(bytes, [0, 0, 0], "the pointer too is back at 0x00");
    rig.write(&[0x80]);
    rig.bus.read(HIGH, &mut bytes[..1]).unwrap();
    assert_eq!(bytes, [11, 0, 0], "where the pixels are not");
    rig.bus.set_fault(Address::High, Fault::BrownOut);
    assert_eq!(rig.image(), vec![0; 256]);
    rig.set(1_249);
    assert_eq!(rig.word(), 0);
    rig.set(1_250);
    assert_eq!(rig.word(), 12, "a new phase, at ten frames a second");
}

#[test]
fn an_unplugged_sensor_starts_anew_when_it_is_back() {
    let mut rig = Rig::new(counting);
    rig.write(&[0x03, 0x03]);
    rig.set(300);
    assert_eq!(
        rig.bus.interrupt_pin(Address::High),
        Some(InterruptPin::Low)
    );
    rig.bus.set_fault(Address::High, Fault::Unplugged);
    assert_eq!(
        rig.bus.interrupt_pin(Address::High),
        Some(InterruptPin::HighZ)
    );
    let bits = rig.bus.traffic().bits;
    assert_eq!(rig.bus.write(HIGH, &[]), Err(BusError::Gone));
    assert_eq!(rig.bus.traffic().bits, bits, "no wire, no traffic");
    rig.set(5_010);
    mended(&mut rig);
    assert_eq!(rig.image(), vec![0; 256]);
    rig.set(5_110);
    assert_eq!(rig.frames(), 3 + 1);
}

#[test]
fn one_fault_replaces_another() {
    let mut rig = broken(Fault::Unplugged);
    rig.bus.set_fault(Address::High, Fault::StuckHigh);
    assert_eq!(rig.register(0x00), 0xFF);
    mended(&mut rig);
    assert_eq!(rig.word(), 0, "plugged in again by the second fault");
    assert!(
        !rig.bus.set_fault(Address::Low, Fault::Hang),
        "nobody there"
    );
    assert!(!rig.bus.clear_fault(Address::Low));
}

#[test]
fn refused_bytes_are_counted() {
    let mut rig = broken(Fault::NackData);
    assert!(rig.bus.write(HIGH, &[0x00, 0x10]).is_err());
    assert_eq!(rig.device().refusals().nacks, 1);
    let traffic = rig.bus.traffic();
    assert_eq!(
        (traffic.nacks, traffic.bytes, traffic.bits),
        (1, 2, 20),
        "it stops at the first"
    );
    mended(&mut rig);
    assert_eq!(rig.register(0x00), 0x00);
}

/// Section 2.1: woken within 100 ms of falling asleep.
#[test]
fn a_wake_too_fast_freezes_by_option() {
    for (freezes_on_fast_wake, asleep_ms, word) in [(true, 99, 0), (true, 100, 11), (false, 99, 11)]
    {
        let options = Options {
            freezes_on_fast_wake,
            ..Options::default()
        };
        let mut rig = Rig::with(counting, options);
        rig.set(300);
        rig.write(&SLEEP);
        rig.pass(asleep_ms);
        rig.write(&NORMAL);
        rig.set(450);
        rig.write(&INITIAL_RESET);
        rig.set(1_100);
        assert_eq!(rig.word(), word, "{asleep_ms} ms");
        rig.write(&SLEEP);
        rig.pass(100);
        rig.write(&NORMAL);
        rig.set(1_300);
        assert_eq!(rig.word(), 13, "a proper sleep mends it");
    }
}
