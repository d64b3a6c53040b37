//! Transactions byte by byte, time and pins, by packets made from the document alone.

use std::sync::Arc;
use std::time::Duration;

use i2c_emulation::rack::{Rack, SharedAdapter};
use i2c_emulation::socket::{Options, PASS_MAX, STEP_WAIT_MAX};

use crate::bench::{
    Bench, ByHand, FAILING, Log, RegisterFile, first_value, read, step, transfer, write,
};
use crate::python::{output, python};

const STOP: [u8; 1] = [5];
const DONE: u8 = 0x82;

fn pass(nanoseconds: u64, pin: u16, level: u8) -> Vec<u8> {
    [
        &[6][..],
        &nanoseconds.to_le_bytes(),
        &pin.to_le_bytes(),
        &[level],
    ]
    .concat()
}

fn passed(now_ns: u64, pins: &[u8]) -> Vec<u8> {
    let count = u16::try_from(pins.len()).unwrap().to_le_bytes();
    [&[0x86][..], &now_ns.to_le_bytes(), &count, pins].concat()
}

#[test]
fn bytes_go_and_come_within_one_transaction() {
    let bench = Bench::new(Options::default());
    let mut raw = bench.greeted();
    for message in [write(0x69, &[]), write(0x69, &[0x42]), read(0x69, 0)] {
        assert_eq!(raw.ask(&step(1, &message)), [DONE, 1, 0]);
    }
    for register in 0x42..0x45 {
        let answer = raw.ask(&step(1, &read(0x69, 1)));
        assert_eq!(answer, [DONE, 1, 0, first_value(register)]);
    }
    assert_eq!(bench.transfers(), ["69 opens, reads: false"]);
    assert_eq!(raw.ask(&STOP), [DONE, 0, 0]);
    assert_eq!(bench.transfers(), ["69 opens, reads: false", "69 stops"]);
    // A stop without a transaction does nothing.
    assert_eq!(raw.ask(&STOP), [DONE, 0, 0]);
    assert_eq!(raw.ask(&step(3, &read(0x69, 1)))[..3], [0x84, 19, 0]);
}

#[test]
fn another_target_and_a_transfer_stop_first() {
    let bench = Bench::new(Options::default());
    let mut raw = bench.greeted();
    raw.ask(&step(1, &write(0x69, &[1])));
    raw.ask(&step(1, &write(0x50, &[1])));
    raw.ask(&transfer(1, 0, &[write(0x69, &[2])]));
    let expected = [
        "69 opens, reads: false",
        "69 stops",
        "50 opens, reads: false",
        "50 stops",
        "69W[02]",
    ];
    assert_eq!(bench.transfers(), expected);
}

#[test]
fn a_transaction_has_the_bus_to_itself_until_it_stops_or_its_client_goes() {
    let bench = Bench::new(Options::default());
    let (mut holder, mut other) = (bench.greeted(), bench.greeted());
    holder.ask(&step(1, &write(0x69, &[0x10])));
    other.send(&transfer(1, 0, &[read(0x69, 1)]));
    assert_eq!(
        holder.ask(&step(1, &read(0x69, 1))),
        [DONE, 1, 0, first_value(0x10)]
    );
    drop(holder);
    assert_eq!(other.receive(), [DONE, 1, 0, first_value(0x11)]);
}

#[test]
fn faults_are_told_and_only_a_missing_acknowledge_leaves_it_open() {
    let bench = Bench::new(Options::default());
    let mut raw = bench.greeted();
    for (address, number, errno) in [
        (0x30, 1, 121),
        (0x31, 2, 121),
        (0x32, 3, 5),
        (0x33, 4, 5),
        (0x34, 5, 110),
    ] {
        assert!(FAILING.iter().any(|(failing, _)| *failing == address));
        for _ in 0..2 {
            let answer = raw.ask(&step(1, &write(address, &[1])));
            assert_eq!(answer, [0x83, number, errno, 0, 0, 0]);
        }
    }
    let opened = |address: &str| {
        let opened = bench.transfers().into_iter();
        opened
            .filter(|line| line.starts_with(address) && line.contains("opens"))
            .count()
    };
    assert_eq!(["30", "31", "32", "33", "34"].map(opened), [1, 1, 2, 2, 2]);
}

#[test]
fn a_silent_transaction_frees_the_bus_and_is_told_so() {
    let bench = Bench::new(Options::default());
    let (mut silent, mut other) = (bench.greeted(), bench.greeted());
    silent.ask(&step(1, &write(0x69, &[0x10])));
    std::thread::sleep(STEP_WAIT_MAX + Duration::from_millis(500));
    assert_eq!(other.ask(&transfer(1, 0, &[read(0x69, 1)]))[0], DONE);
    assert_eq!(
        silent.ask(&step(1, &read(0x69, 1))),
        [0x83, 5, 110, 0, 0, 0]
    );
    assert_eq!(silent.ask(&step(1, &read(0x69, 1)))[0], DONE);
}

/// A server with time and pins.
fn by_hand() -> Bench {
    let mut rack = Rack::new();
    rack.insert(1, SharedAdapter::new(RegisterFile::new(Log::default())));
    let rack = rack.within(Arc::new(ByHand::default()));
    Bench::with_rack(rack, Options::default(), Log::default())
}

#[test]
fn time_passes_by_request_and_a_pin_ends_it() {
    let bench = by_hand();
    let mut raw = bench.greeted();
    assert_eq!(raw.ask(&pass(0, u16::MAX, 0)), passed(0, &[1, 1]));
    assert_eq!(
        raw.ask(&pass(100_000_000, u16::MAX, 0)),
        passed(100_000_000, &[1, 1])
    );
    let most = u64::try_from(PASS_MAX.as_nanos()).unwrap();
    assert_eq!(raw.ask(&pass(most, 1, 0)), passed(250_000_000, &[1, 0]));
    assert_eq!(raw.ask(&pass(most + 1, 1, 0))[..3], [0x84, 22, 0]);
    // Nobody can look at the pins of a bus that is held, but its time goes on.
    raw.ask(&step(1, &write(0x69, &[1])));
    assert_eq!(raw.ask(&pass(1_000_000, 1, 0)), passed(251_000_000, &[]));
    let without = Bench::new(Options::default());
    let mut bare = without.greeted();
    assert_eq!(bare.ask(&pass(0, u16::MAX, 0))[..3], [0x84, 95, 0]);
    raw.send(&pass(0, 0, 2));
    assert_eq!(raw.farewell().1, "no such level: 2");
}

#[test]
fn python_waits_for_an_interrupt_and_moves_time() {
    let Some(mut python) = python() else { return };
    let bench = by_hand();
    python.env("GRIDEYE_I2C_SOCKET", &bench.path).args(["-c", "if True:
        import grideye_i2c as i2c
        print(i2c.pass_time(0.1), i2c.wait_for_interrupt(0.1, sensor=1), i2c.wait_for_interrupt(5, sensor=1))
        print(i2c.pass_time(2.5), i2c.wait_for_interrupt(0, sensor=0))
        try:
            i2c.wait_for_interrupt(0, sensor=2)
        except ValueError as error:
            print(error)
    "]);
    assert_eq!(
        output(&mut python),
        "(0.1, [True, True]) False True\n(2.75, [True, False]) False\nno sensor 2; the server has 2\n"
    );
}
