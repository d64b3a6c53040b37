//! The driver's waits, and its bytes on the wire.

use crate::buses::{Event, Tape, Yielding, block_on, waits};
use crate::settings;
use amg8833::timing::READ_BITS;
use amg8833::{Address, Amg8833, asynch};

#[test]
fn init_waits_where_the_specification_says() {
    let expected = |tape: Tape| {
        let events = tape.events.borrow();
        assert_eq!(
            events[..6],
            [
                Event::Write(vec![0x00, 0x00]),
                Event::WaitNs(50_000_000),
                Event::Write(vec![0x01, 0x3F]),
                Event::WaitNs(2_000_000),
                Event::Write(vec![0x01, 0x30]),
                Event::Write(vec![0x02, 0x01]),
            ]
        );
        assert_eq!(waits(&events[6..]), 0);
    };
    let tape = Tape::default();
    let mut sensor = Amg8833::new(tape.clone(), Address::High);
    sensor.init(&mut tape.clone(), &settings()).unwrap();
    expected(tape);

    let tape = Tape::default();
    let mut sensor = asynch::Amg8833::new(Yielding::new(tape.clone()), Address::High);
    block_on(sensor.init(&mut tape.clone(), &settings())).unwrap();
    expected(tape);
}

#[test]
fn sleep_does_not_return_before_the_sensor_may_be_woken() {
    let expected = [
        Event::Write(vec![0x00, 0x10]),
        Event::WaitNs(100_000_000),
        Event::Write(vec![0x00, 0x00]),
        Event::WaitNs(50_000_000),
        Event::Write(vec![0x01, 0x3F]),
        Event::WaitNs(2_000_000),
        Event::Write(vec![0x01, 0x30]),
    ];
    let tape = Tape::default();
    let mut sensor = Amg8833::new(tape.clone(), Address::High);
    sensor.sleep(&mut tape.clone()).unwrap();
    sensor.wake(&mut tape.clone()).unwrap();
    assert_eq!(*tape.events.borrow(), expected);

    let tape = Tape::default();
    let mut sensor = asynch::Amg8833::new(Yielding::new(tape.clone()), Address::High);
    block_on(sensor.sleep(&mut tape.clone())).unwrap();
    block_on(sensor.wake(&mut tape.clone())).unwrap();
    assert_eq!(*tape.events.borrow(), expected);
}

#[test]
fn the_initial_reset_waits_for_two_milliseconds() {
    let tape = Tape::default();
    let mut sensor = Amg8833::new(tape.clone(), Address::High);
    sensor.initial_reset(&mut tape.clone()).unwrap();
    assert_eq!(
        *tape.events.borrow(),
        [Event::Write(vec![0x01, 0x3F]), Event::WaitNs(2_000_000)]
    );
}

#[test]
fn a_frame_is_two_transactions_and_136_bytes_on_the_wire() {
    let tape = Tape::default();
    Amg8833::new(tape.clone(), Address::High)
        .read_frame()
        .unwrap();
    assert_eq!(tape.transactions(), 2);
    assert_eq!(tape.wire_bytes(), 136);
    assert_eq!(tape.wire_bits(), 1230);
    assert_eq!(READ_BITS, 1230);

    let tape = Tape::default();
    let bus = Yielding::new(tape.clone());
    block_on(asynch::Amg8833::new(bus, Address::High).read_frame()).unwrap();
    assert_eq!(tape.transactions(), 2);
    assert_eq!(tape.wire_bytes(), 136);
}

#[test]
fn every_setting_is_read_back_with_17_bytes_on_the_wire() {
    let tape = Tape::default();
    Amg8833::new(tape.clone(), Address::High)
        .configuration()
        .unwrap();
    assert_eq!((tape.transactions(), tape.wire_bytes()), (1, 17));
}
