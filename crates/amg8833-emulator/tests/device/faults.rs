//! Injected faults: what the host sees, and what remains after they are cleared.

use crate::support::*;
use amg8833_emulator::{
    Address, BusError, Clock, FAULTS_MAX, Fault, FaultKind, HANG_TIMEOUT, InterruptPin, Options,
};
use core::time::Duration;
use embedded_hal::i2c::{Error, ErrorKind, I2c, NoAcknowledgeSource};
#[test]
fn faults_of_the_bus_are_the_controllers_errors() {
    let address = HIGH;
    let no_acknowledge = |source| BusError::NoAcknowledge { address, source };
    let faults = [
        (
            Fault::NackAddress,
            no_acknowledge(NoAcknowledgeSource::Address),
        ),
        (
            Fault::NackByte(0),
            no_acknowledge(NoAcknowledgeSource::Data),
        ),
        (Fault::Timeout, BusError::Timeout),
        (
            Fault::Unplugged,
            no_acknowledge(NoAcknowledgeSource::Address),
        ),
        (Fault::BusError, BusError::Bus),
        (Fault::ArbitrationLoss, BusError::ArbitrationLoss),
        (Fault::Hang, BusError::Timeout),
        (Fault::AdapterGone, BusError::Gone),
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
        let set: Vec<_> = rig.bus.faults(Address::High).iter().collect();
        assert_eq!(set, [fault.kind()]);
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
fn a_fault_of_the_whole_bus_affects_its_other_sensor_too() {
    let faults = [
        (Fault::Hang, Err(BusError::Timeout)),
        (Fault::AdapterGone, Err(BusError::Gone)),
        (Fault::Unplugged, Ok(())),
        (Fault::Timeout, Ok(())),
        (Fault::NackAddress, Ok(())),
        (Fault::BusError, Ok(())),
    ];
    for (fault, neighbor) in faults {
        let mut rig = broken(fault);
        let source: Source = Box::new(counting);
        rig.bus.plug(Address::Low, source, Options::default());
        assert_eq!(rig.bus.write(0x68, &[0x80]), neighbor, "{fault:?}");
        let nobody = rig.bus.write(0x42, &[]).unwrap_err();
        assert_eq!(nobody, neighbor.err().unwrap_or(NOBODY), "{fault:?}");
        mended(&mut rig);
        assert_eq!(rig.bus.write(0x68, &[0x80]), Ok(()), "{fault:?} mended");
    }

    let mut rig = broken(Fault::Hang);
    let source: Source = Box::new(counting);
    rig.bus.plug(Address::Low, source, Options::default());
    rig.bus.set_fault(Address::Low, Fault::AdapterGone);
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
    assert!(
        rig.bus.faults(Address::High).is_empty(),
        "it is over at once"
    );
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
fn without_an_adapter_there_is_no_traffic_and_no_power() {
    let mut rig = Rig::new(counting);
    let source: Source = Box::new(counting);
    rig.bus.plug(Address::Low, source, Options::default());
    rig.write(&[0x03, 0x03]);
    rig.set(300);
    assert_eq!(
        rig.bus.interrupt_pin(Address::High),
        Some(InterruptPin::Low)
    );
    rig.bus.set_fault(Address::High, Fault::AdapterGone);
    assert_eq!(
        rig.bus.interrupt_pin(Address::High),
        Some(InterruptPin::HighZ)
    );
    let bits = rig.bus.traffic().bits;
    assert_eq!(rig.bus.write(HIGH, &[]), Err(BusError::Gone));
    assert_eq!(
        rig.bus.transaction(HIGH, &mut []),
        Err(BusError::Gone),
        "even an empty transaction fails"
    );
    assert_eq!(rig.bus.traffic().bits, bits, "no wire, no traffic");
    rig.set(5_010);
    mended(&mut rig);
    assert_eq!(rig.image(), vec![0; 256]);
    let mut neighbor = [0xA5; 2];
    rig.bus.write_read(0x68, &[0x80], &mut neighbor).unwrap();
    assert_eq!(neighbor, [0, 0], "its neighbor had no power either");
    rig.set(5_110);
    assert_eq!(rig.frames(), 3 + 1);
}

#[test]
fn an_unplugged_sensor_is_off_the_bus_and_restarts_when_it_is_back() {
    let mut rig = Rig::new(counting);
    let source: Source = Box::new(counting);
    rig.bus.plug(Address::Low, source, Options::default());
    rig.write(&[0x03, 0x03]);
    rig.set(300);
    rig.bus.set_fault(Address::High, Fault::Unplugged);
    assert_eq!(
        rig.bus.interrupt_pin(Address::High),
        Some(InterruptPin::HighZ)
    );
    assert_eq!(rig.device().next_tick_at(), None);
    assert_eq!(
        rig.bus.write(HIGH, &[]).map_err(|error| error.kind()),
        Err(ErrorKind::NoAcknowledge(NoAcknowledgeSource::Address))
    );
    let mut neighbor = [0xA5; 2];
    rig.bus.write_read(0x68, &[0x80], &mut neighbor).unwrap();
    assert_eq!(neighbor, [3, 0], "its neighbor kept its power");
    rig.set(5_010);
    mended(&mut rig);
    assert_eq!(rig.image(), vec![0; 256]);
    rig.set(5_110);
    assert_eq!(rig.frames(), 3 + 1);
    assert_eq!(rig.bus.fault_counts().of(FaultKind::Unplugged), 1);
}

#[test]
fn faults_act_together_and_the_first_on_the_wire_hides_the_rest() {
    let mut rig = broken(Fault::StuckHigh);
    rig.bus.set_fault(Address::High, Fault::AllZero);
    assert_eq!(rig.register(0x80), 0x00, "low wins over released");
    let layers = [
        (Fault::NackAddress, FaultKind::NackAddress),
        (Fault::Unplugged, FaultKind::Unplugged),
        (Fault::BusError, FaultKind::BusError),
        (Fault::ArbitrationLoss, FaultKind::ArbitrationLoss),
        (Fault::Timeout, FaultKind::Timeout),
        (Fault::Hang, FaultKind::Hang),
        (Fault::AdapterGone, FaultKind::AdapterGone),
    ];
    let errors = [
        NOBODY_HIGH,
        NOBODY_HIGH,
        BusError::Bus,
        BusError::ArbitrationLoss,
        BusError::Timeout,
        BusError::Timeout,
        BusError::Gone,
    ];
    for ((fault, kind), error) in layers.into_iter().zip(errors) {
        assert!(rig.bus.set_fault(Address::High, fault));
        assert_eq!(rig.bus.write(HIGH, &[0x80]), Err(error));
        assert_eq!(rig.bus.fault_counts().of(kind), 1, "{kind}");
    }
    assert_eq!(
        rig.bus.fault_counts().of(FaultKind::AllZero),
        1,
        "hidden faults are not counted"
    );
    assert_eq!(rig.bus.faults(Address::High).iter().count(), 9);
    mended(&mut rig);
    assert_eq!(rig.register(0x80), 0x00, "powered on again");
    assert!(
        !rig.bus.set_fault(Address::Low, Fault::Hang),
        "nobody there"
    );
    assert!(!rig.bus.clear_fault(Address::Low));
}

#[test]
fn a_fault_of_the_same_kind_replaces_the_one_before() {
    let mut rig = broken(Fault::NackByte(1));
    assert!(rig.bus.write(HIGH, &[0x80, 0x00]).is_err());
    rig.bus.set_fault(Address::High, Fault::NackByte(2));
    assert!(rig.bus.write(HIGH, &[0x80, 0x00]).is_ok());
    assert!(rig.bus.write(HIGH, &[0x80, 0x00, 0x00]).is_err());
}

#[test]
fn no_more_faults_than_there_is_room_for() {
    let mut rig = Rig::new(counting);
    let source: Source = Box::new(counting);
    rig.bus.plug(Address::Low, source, Options::default());
    let lasting = [
        Fault::NackAddress,
        Fault::NackByte(0),
        Fault::BusError,
        Fault::ArbitrationLoss,
        Fault::Timeout,
        Fault::StuckHigh,
        Fault::AllZero,
        Fault::FastWake,
    ];
    assert_eq!(FAULTS_MAX, 2 * lasting.len());
    for address in Address::ALL {
        for fault in lasting {
            assert!(rig.bus.set_fault(address, fault));
        }
    }
    assert!(!rig.bus.set_fault(Address::High, Fault::Freeze));
    assert!(!rig.bus.set_fault(None::<Address>, Fault::Hang));
    assert!(rig.bus.set_fault(Address::High, Fault::NackByte(3)));
    rig.bus.clear_fault(Address::Low);
    assert!(rig.bus.set_fault(None::<Address>, Fault::Hang));
    rig.bus.clear_fault(None::<Address>);
    rig.bus.clear_fault(Address::High);
    assert!(rig.bus.faults(Address::High).is_empty());
}

#[test]
fn another_speed_of_the_sensor_keeps_its_phase_and_its_own_comes_back() {
    let mut rig = Rig::new(counting);
    rig.set(250);
    rig.bus
        .set_fault(Address::High, Fault::ClockError { ppm: 250_000 });
    assert_eq!(
        rig.device().next_tick_at(),
        Some(Duration::from_millis(290)),
        "half a period left, at 5/4 of the speed"
    );
    rig.set(370);
    assert_eq!(rig.frames(), 4);
    mended(&mut rig);
    assert_eq!(
        rig.device().next_tick_at(),
        Some(Duration::from_millis(470))
    );
    rig.bus
        .set_fault(Address::High, Fault::ClockError { ppm: -500_000 });
    rig.bus.set_fault(Address::High, Fault::BrownOut);
    assert_eq!(
        rig.device().next_tick_at(),
        Some(Duration::from_millis(570)),
        "it outlasts a brown-out"
    );
}

#[test]
fn another_speed_of_the_bus_takes_other_time() {
    let hz = |hz: u32| Fault::SclSpeed {
        hz: hz.try_into().unwrap(),
    };
    let mut rig = Rig::new(counting).at_scl(400_000);
    let took = |rig: &mut Rig| {
        let before = rig.bus.clock().now();
        rig.read(0x80, 128);
        rig.bus.clock().now() - before
    };
    // START, address, register, repeated START, address, 128 bytes, STOP: 1182 bits.
    let own = Duration::from_nanos(1_182 * 2_500);
    assert_eq!(took(&mut rig), own);
    rig.bus.set_fault(None::<Address>, hz(10_000));
    assert_eq!(took(&mut rig), Duration::from_micros(118_200));
    rig.bus.clear_fault(None::<Address>);
    assert_eq!(took(&mut rig), own);
    let mut rig = Rig::new(counting);
    assert_eq!(took(&mut rig), Duration::ZERO);
    rig.bus.set_fault(None::<Address>, hz(100_000));
    assert_eq!(took(&mut rig), Duration::from_micros(11_820));
}

/// Section 2.1, as with the option, but temporary.
#[test]
fn a_wake_too_fast_freezes_by_fault() {
    let mut rig = broken(Fault::FastWake);
    rig.write(&SLEEP);
    rig.pass(50);
    rig.write(&NORMAL);
    rig.set(1_000);
    assert_eq!(rig.word(), 3);
    mended(&mut rig);
    rig.set(2_000);
    assert_eq!(rig.word(), 3, "frozen stays frozen");
    rig.write(&SLEEP);
    rig.pass(50);
    rig.write(&NORMAL);
    rig.set(2_200);
    assert_eq!(rig.word(), 22, "until it sleeps again");
}

#[test]
fn a_new_sensor_meets_the_faults_of_the_bus_and_an_old_one_leaves_them_there() {
    let mut rig = Rig::new(counting);
    rig.bus.set_fault(None::<Address>, Fault::Freeze);
    let source: Source = Box::new(counting);
    rig.bus.plug(Address::Low, source, Options::default());
    rig.set(500);
    let mut word = [0xA5; 2];
    rig.bus.write_read(0x68, &[0x80], &mut word).unwrap();
    assert_eq!(word, [0, 0]);
    let mut device = rig.bus.unplug(Address::Low).unwrap();
    device.advance(Duration::from_millis(600));
    assert_eq!(device.frames(), 1);
}

const NOBODY_HIGH: BusError = BusError::NoAcknowledge {
    address: HIGH,
    source: NoAcknowledgeSource::Address,
};

#[test]
fn refused_bytes_are_counted() {
    let mut rig = broken(Fault::NackByte(0));
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
