//! What each request takes and refuses, whichever adapter it is for.

use std::time::Duration;

use super::bench::*;
use crate::ioctl::request::*;
use crate::ioctl::{AdapterMode, Errno, PointerWidth, message_flag};

#[test]
fn an_address_has_seven_bits_or_ten() {
    let mut bench = Bench::new(AdapterMode::Pi);
    for request in [I2C_SLAVE, I2C_SLAVE_FORCE] {
        assert_eq!(bench.call(request, 0x7F), Ok(0));
        assert_eq!(bench.call(request, 0x80), Err(Errno::EINVAL));
        assert_eq!(bench.call(request, u64::MAX), Err(Errno::EINVAL));
        assert_eq!(bench.call(I2C_TENBIT, 1), Ok(0));
        assert_eq!(bench.call(request, 0x3FF), Ok(0));
        assert_eq!(bench.call(request, 0x400), Err(Errno::EINVAL));
        assert_eq!(bench.call(I2C_TENBIT, 0), Ok(0));
    }
}

#[test]
fn nobody_answers_to_ten_bit_addresses() {
    let mut bench = Bench::new(AdapterMode::Pi);
    bench.call(I2C_TENBIT, 1).unwrap();
    assert_eq!(
        bench.file.write(&[1], &mut bench.adapter),
        Err(Errno::EREMOTEIO)
    );
    bench.call(I2C_TENBIT, 0).unwrap();
    assert_eq!(bench.file.write(&[1], &mut bench.adapter), Ok(1));
    assert_eq!(
        bench.rdwr(&[(TARGET, message_flag::TEN_BIT, 0, 0)]),
        Err(Errno::EREMOTEIO)
    );
    assert_eq!(
        bench.rdwr(&[(TARGET | 0x100, 0, 0, 0)]),
        Err(Errno::EREMOTEIO)
    );
}

#[test]
fn a_busy_address_can_only_be_forced() {
    let mut bench = Bench::new(AdapterMode::Busy);
    assert_eq!(
        bench.call(I2C_SLAVE, 0x80),
        Err(Errno::EINVAL),
        "the range is looked at first"
    );
    assert_eq!(bench.call(I2C_SLAVE, TARGET.into()), Err(Errno::EBUSY));
    assert_eq!(bench.call(I2C_SLAVE_FORCE, TARGET.into()), Ok(0));
    assert_eq!(
        bench.rdwr(&[(TARGET, READ, 1, BUFFER)]),
        Ok(1),
        "I2C_RDWR asks no driver"
    );
}

#[test]
fn an_unknown_request_is_enotty() {
    let known = [
        I2C_RETRIES,
        I2C_TIMEOUT,
        I2C_SLAVE,
        I2C_TENBIT,
        I2C_FUNCS,
        I2C_SLAVE_FORCE,
        I2C_RDWR,
        I2C_PEC,
        I2C_SMBUS,
    ];
    assert_eq!(
        known,
        [
            0x701, 0x702, 0x703, 0x704, 0x705, 0x706, 0x707, 0x708, 0x720
        ]
    );
    let mut bench = Bench::new(AdapterMode::Pi);
    for request in (0x0700..0x0800).chain([0, 0x5401, 0x8004_0700, u32::MAX]) {
        if !known.contains(&request) {
            assert_eq!(
                bench.call(request, BASE),
                Err(Errno::ENOTTY),
                "{request:#x}"
            );
        }
    }
}

#[test]
fn retries_and_timeout_are_not_negative() {
    let mut bench = Bench::new(AdapterMode::Pi);
    let most = u64::try_from(i32::MAX).unwrap();
    for request in [I2C_RETRIES, I2C_TIMEOUT] {
        assert_eq!(bench.call(request, most), Ok(0));
        assert_eq!(bench.call(request, most + 1), Err(Errno::EINVAL));
        assert_eq!(bench.call(request, u64::MAX), Err(Errno::EINVAL));
    }
    assert_eq!(bench.call(I2C_TIMEOUT, 25), Ok(0));
    assert_eq!(
        bench.file.timeout(),
        Duration::from_millis(250),
        "the unit is 10 ms"
    );
}

#[test]
fn functionality_is_as_wide_as_a_long() {
    for (width, expected) in [
        (PointerWidth::Bits64, [0x09, 0, 0xFF, 0x0E, 0, 0, 0, 0]),
        (
            PointerWidth::Bits32,
            [0x09, 0, 0xFF, 0x0E, 0xEE, 0xEE, 0xEE, 0xEE],
        ),
    ] {
        let mut bench = Bench::with_width(AdapterMode::Pi, width);
        assert_eq!(bench.call(I2C_FUNCS, DATA), Ok(0));
        assert_eq!(bench.memory.at(DATA, 8), expected, "{width:?}");
        assert_eq!(bench.call(I2C_FUNCS, 0), Err(Errno::EFAULT));
    }
}

#[test]
fn a_write_and_a_read_are_one_transaction_in_both_layouts() {
    for width in [PointerWidth::Bits64, PointerWidth::Bits32] {
        let mut bench = Bench::with_width(AdapterMode::Pi, width);
        bench.memory.put(DATA, &[0x80]);
        assert_eq!(
            bench.rdwr(&[(TARGET, 0, 1, DATA), (TARGET, READ, 128, BUFFER)]),
            Ok(2)
        );
        assert_eq!(bench.seen(), ["W 80, R 128"]);
        let expected: Vec<u8> = (0..0x80).rev().collect();
        assert_eq!(bench.memory.at(BUFFER, 128), expected, "{width:?}");
        assert_eq!(bench.memory.at(BUFFER + 128, 1), [0xEE], "not a byte more");
    }
}

/// The kernel copies from any address; only what is not there is a fault.
#[test]
fn unaligned_pointers_are_as_good_as_any() {
    let mut bench = Bench::new(AdapterMode::Pi);
    let array = bench
        .memory
        .put_messages(BASE + 0x101, &[(TARGET, READ, 1, BUFFER + 3)]);
    let argument = bench.memory.put_rdwr(BASE + 7, array, 1);
    assert_eq!(bench.call(I2C_RDWR, argument), Ok(1));
    assert_eq!(bench.memory.at(BUFFER + 3, 1), [0xFF]);
}

#[test]
fn a_transfer_has_1_to_42_messages_of_at_most_8192_bytes() {
    let mut bench = Bench::new(AdapterMode::Pi);
    let message = (TARGET, 0, 0, 0);
    assert_eq!(bench.rdwr(&[message; 42]), Ok(42));
    assert_eq!(bench.rdwr(&[message; 43]), Err(Errno::EINVAL));
    assert_eq!(bench.rdwr(&[]), Err(Errno::EINVAL));
    let argument = bench.memory.put_rdwr(BASE, BASE + 0x100, u32::MAX);
    assert_eq!(bench.call(I2C_RDWR, argument), Err(Errno::EINVAL));
    assert_eq!(bench.rdwr(&[(TARGET, READ, 8192, BUFFER)]), Ok(1));
    bench.seen();
    assert_eq!(
        bench.rdwr(&[message, (TARGET, READ, 8193, BUFFER)]),
        Err(Errno::EINVAL)
    );
    assert_eq!(bench.seen(), [""; 0], "nothing of it reaches the bus");
}

#[test]
fn a_pointer_that_leads_nowhere_stops_a_transfer_before_the_bus() {
    let end = BASE + 0x1_0000;
    let mut bench = Bench::new(AdapterMode::Pi);
    for argument in [0, 1, BASE - 1, end, end - 15, u64::MAX, u64::MAX - 8] {
        assert_eq!(
            bench.call(I2C_RDWR, argument),
            Err(Errno::EFAULT),
            "{argument:#x}"
        );
        assert_eq!(
            bench.call(I2C_SMBUS, argument),
            Err(Errno::EFAULT),
            "{argument:#x}"
        );
    }
    let null = bench.memory.put_rdwr(BASE, 0, 1);
    assert_eq!(
        bench.call(I2C_RDWR, null),
        Err(Errno::EINVAL),
        "a null array is a wrong value to the kernel"
    );
    for array in [1, end - 15, u64::MAX] {
        let argument = bench.memory.put_rdwr(BASE, array, 1);
        assert_eq!(
            bench.call(I2C_RDWR, argument),
            Err(Errno::EFAULT),
            "{array:#x}"
        );
    }
    for buffer in [0, end - 1, u64::MAX] {
        assert_eq!(
            bench.rdwr(&[(TARGET, 0, 1, DATA), (TARGET, READ, 2, buffer)]),
            Err(Errno::EFAULT),
            "{buffer:#x}"
        );
    }
    assert_eq!(bench.seen(), [""; 0]);
    assert_eq!(
        bench.rdwr(&[(TARGET, 0, 0, 0)]),
        Ok(1),
        "a message of no bytes needs no buffer"
    );
}

#[test]
fn a_buffer_that_may_not_be_written_is_efault_after_the_transfer() {
    let mut bench = Bench::new(AdapterMode::Pi);
    bench.memory.read_only_from = BUFFER;
    assert_eq!(bench.rdwr(&[(TARGET, READ, 1, BUFFER)]), Err(Errno::EFAULT));
    assert_eq!(bench.seen(), ["R 1"]);
    assert_eq!(
        bench.rdwr(&[(TARGET, 0, 1, BUFFER)]),
        Ok(1),
        "sending from it is no fault"
    );
}
