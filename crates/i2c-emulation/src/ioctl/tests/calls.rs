//! What each request accepts and rejects, whatever the adapter.

use super::bench::*;
use crate::adapter::Fault;
use crate::ioctl::request::*;
use crate::ioctl::{AdapterMode, Errno, PointerWidth, message_flag};
use proptest::prelude::*;

#[test]
fn an_address_has_seven_bits_or_ten() {
    let mut bench = Bench::new(AdapterMode::Pi);
    for request in [I2C_SLAVE, I2C_SLAVE_FORCE] {
        assert_eq!(bench.call(request, 0x7F), Ok(0));
        assert_eq!(bench.call(request, 0x80), Err(Errno::INVAL));
        assert_eq!(bench.call(request, u64::MAX), Err(Errno::INVAL));
        assert_eq!(bench.call(I2C_TENBIT, 1), Ok(0));
        assert_eq!(bench.call(request, 0x3FF), Ok(0));
        assert_eq!(bench.call(request, 0x400), Err(Errno::INVAL));
        assert_eq!(bench.call(I2C_TENBIT, 0), Ok(0));
    }
}

#[test]
fn nobody_answers_to_ten_bit_addresses() {
    let mut bench = Bench::new(AdapterMode::Pi);
    bench.call(I2C_TENBIT, 1).unwrap();
    assert_eq!(bench.write(&[1]), Err(Errno::REMOTEIO));
    bench.call(I2C_TENBIT, 0).unwrap();
    assert_eq!(bench.write(&[1]), Ok(1));
    let ten_bits = [(TARGET, message_flag::TEN_BIT, 0, 0)];
    assert_eq!(bench.rdwr(&ten_bits), Err(Errno::REMOTEIO));
    let nine_bits = [(TARGET | 0x100, 0, 0, 0)];
    assert_eq!(bench.rdwr(&nine_bits), Err(Errno::REMOTEIO));
}

#[test]
fn a_busy_address_can_only_be_forced() {
    let mut bench = Bench::new(AdapterMode::Busy);
    let beyond = bench.call(I2C_SLAVE, 0x80);
    assert_eq!(beyond, Err(Errno::INVAL), "range first");
    assert_eq!(bench.call(I2C_SLAVE, TARGET.into()), Err(Errno::BUSY));
    assert_eq!(bench.call(I2C_SLAVE_FORCE, TARGET.into()), Ok(0));
    assert_eq!(bench.rdwr(&[(TARGET, READ, 1, BUFFER)]), Ok(1), "no driver");
}

#[test]
fn an_unknown_request_is_enotty() {
    assert_eq!([I2C_RETRIES, I2C_TIMEOUT, I2C_SLAVE], [0x701, 0x702, 0x703]);
    let next = [I2C_TENBIT, I2C_FUNCS, I2C_SLAVE_FORCE];
    assert_eq!(next, [0x704, 0x705, 0x706]);
    assert_eq!([I2C_RDWR, I2C_PEC, I2C_SMBUS], [0x707, 0x708, 0x720]);
    let mut bench = Bench::new(AdapterMode::Pi);
    let unknown = (0x700..0x701).chain(0x709..0x720).chain(0x721..0x800);
    for request in unknown.chain([0, 0x5401, 0x8004_0700, u32::MAX]) {
        let outcome = bench.call(request, BASE);
        assert_eq!(outcome, Err(Errno::NOTTY), "{request:#x}");
    }
}

#[test]
fn retries_and_timeout_are_not_negative() {
    let mut bench = Bench::new(AdapterMode::Pi);
    let most = u64::try_from(i32::MAX).unwrap();
    for request in [I2C_RETRIES, I2C_TIMEOUT] {
        assert_eq!(bench.call(request, most), Ok(0));
        assert_eq!(bench.call(request, most + 1), Err(Errno::INVAL));
        assert_eq!(bench.call(request, u64::MAX), Err(Errno::INVAL));
    }
}

#[test]
fn functionality_is_as_wide_as_a_long() {
    for (width, upper) in [(PointerWidth::Bits64, 0), (PointerWidth::Bits32, 0xEE)] {
        let mut bench = Bench::with_width(AdapterMode::Pi, width);
        assert_eq!(bench.call(I2C_FUNCS, DATA), Ok(0));
        assert_eq!(bench.memory.at(DATA, 4), [0x09, 0, 0xFF, 0x0E], "{width:?}");
        assert_eq!(bench.memory.at(DATA + 4, 4), [upper; 4], "{width:?}");
        assert_eq!(bench.call(I2C_FUNCS, 0), Err(Errno::FAULT));
    }
}

#[test]
fn a_write_and_a_read_are_one_transaction_in_both_layouts() {
    for width in [PointerWidth::Bits64, PointerWidth::Bits32] {
        let mut bench = Bench::with_width(AdapterMode::Pi, width);
        bench.memory.put(DATA, &[0x80]);
        let outcome = bench.rdwr(&[(TARGET, 0, 1, DATA), (TARGET, READ, 128, BUFFER)]);
        assert_eq!(outcome, Ok(2));
        assert_eq!(bench.seen(), ["W 80, R 128"]);
        let expected: Vec<u8> = (0..0x80).rev().collect();
        assert_eq!(bench.memory.at(BUFFER, 128), expected, "{width:?}");
        assert_eq!(bench.memory.at(BUFFER + 128, 1), [0xEE], "not a byte more");
    }
}

/// The kernel copies from any address; only missing memory is an error.
#[test]
fn unaligned_pointers_are_as_good_as_any() {
    let mut bench = Bench::new(AdapterMode::Pi);
    let messages = [(TARGET, READ, 1, BUFFER + 3)];
    let array = bench.memory.put_messages(BASE + 0x101, &messages);
    let argument = bench.memory.put_rdwr(BASE + 7, array, 1);
    assert_eq!(bench.call(I2C_RDWR, argument), Ok(1));
    assert_eq!(bench.memory.at(BUFFER + 3, 1), [0xFF]);
}

#[test]
fn a_transfer_has_1_to_42_messages_of_at_most_8192_bytes() {
    let mut bench = Bench::new(AdapterMode::Pi);
    let message = (TARGET, 0, 0, 0);
    assert_eq!(bench.rdwr(&[message; 42]), Ok(42));
    assert_eq!(bench.rdwr(&[message; 43]), Err(Errno::INVAL));
    assert_eq!(bench.rdwr(&[]), Err(Errno::INVAL));
    let argument = bench.memory.put_rdwr(BASE, BASE + 0x100, u32::MAX);
    assert_eq!(bench.call(I2C_RDWR, argument), Err(Errno::INVAL));
    assert_eq!(bench.rdwr(&[(TARGET, READ, 8192, BUFFER)]), Ok(1));
    bench.seen();
    let too_long = [message, (TARGET, READ, 8193, BUFFER)];
    assert_eq!(bench.rdwr(&too_long), Err(Errno::INVAL));
    assert_eq!(bench.seen(), [""; 0], "nothing of it reaches the bus");
}

#[test]
fn a_pointer_that_leads_nowhere_stops_a_transfer_before_the_bus() {
    let end = BASE + 0x1_0000;
    let mut bench = Bench::new(AdapterMode::Pi);
    for argument in [0, 1, BASE - 1, end, end - 15, u64::MAX, u64::MAX - 8] {
        let outcomes = [I2C_RDWR, I2C_SMBUS].map(|request| bench.call(request, argument));
        assert_eq!(outcomes, [Err(Errno::FAULT); 2], "{argument:#x}");
    }
    let null = bench.memory.put_rdwr(BASE, 0, 1);
    assert_eq!(bench.call(I2C_RDWR, null), Err(Errno::INVAL), "null");
    for array in [1, end - 15, u64::MAX] {
        let argument = bench.memory.put_rdwr(BASE, array, 1);
        let outcome = bench.call(I2C_RDWR, argument);
        assert_eq!(outcome, Err(Errno::FAULT), "{array:#x}");
    }
    for buffer in [0, end - 1, u64::MAX] {
        let outcome = bench.rdwr(&[(TARGET, 0, 1, DATA), (TARGET, READ, 2, buffer)]);
        assert_eq!(outcome, Err(Errno::FAULT), "{buffer:#x}");
    }
    assert_eq!(bench.seen(), [""; 0]);
    let empty = bench.rdwr(&[(TARGET, 0, 0, 0)]);
    assert_eq!(empty, Ok(1), "a message of no bytes needs no buffer");
}

#[test]
fn a_buffer_that_may_not_be_written_is_efault_after_the_transfer() {
    let mut bench = Bench::new(AdapterMode::Pi);
    bench.memory.read_only_from = BUFFER;
    assert_eq!(bench.rdwr(&[(TARGET, READ, 1, BUFFER)]), Err(Errno::FAULT));
    assert_eq!(bench.seen(), ["R 1"]);
    assert_eq!(bench.rdwr(&[(TARGET, 0, 1, BUFFER)]), Ok(1), "sending");
}

/// Pointers that are usually valid.
fn pointer() -> impl Strategy<Value = u64> {
    prop_oneof![8 => BASE..BASE + 0x1_0000, 1 => any::<u64>(), 1 => Just(0), 1 => BASE + 0xFF00..BASE + 0x1_0100]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    /// Whatever a program asks and its memory holds, the answer is of a documented kind, and nothing panics.
    #[test]
    fn no_request_can_break_the_layer(
        mode in prop::sample::select(AdapterMode::ALL.to_vec()),
        width in prop::sample::select(vec![PointerWidth::Bits32, PointerWidth::Bits64]),
        faults in prop::collection::vec(prop::sample::select(vec![Fault::NackAddress, Fault::ArbitrationLost, Fault::Timeout]), 0..4),
        calls in prop::collection::vec((prop_oneof![8 => 0x0700..0x0722u32, 1 => any::<u32>()], pointer(), any::<u8>()), 1..12),
        smbus in (0..3u8, any::<u8>(), 0..10u32, pointer()),
        messages in prop::collection::vec((any::<u16>(), any::<u16>(), any::<u16>(), pointer()), 0..5),
        filling in prop::collection::vec(any::<u8>(), 64),
    ) {
        let mut bench = Bench::with_width(mode, width);
        bench.fail_with(&faults);
        bench.memory.put(DATA, &filling);
        let mut outcomes = Vec::new();
        for (request, argument, value) in calls {
            let argument = if value & 1 == 0 { argument } else { u64::from(value) };
            outcomes.push(bench.call(request, argument));
        }
        let argument = bench.memory.put_smbus(BASE + 0x40, smbus.0, smbus.1, smbus.2, smbus.3);
        outcomes.push(bench.call(I2C_SMBUS, argument));
        outcomes.push(bench.rdwr(&messages));
        for outcome in outcomes {
            match outcome {
                Ok(count) => prop_assert!((0..=42).contains(&count)),
                Err(errno) => prop_assert!(
                    [5, 6, 11, 14, 16, 19, 22, 25, 71, 74, 95, 110, 121].contains(&errno.raw_os_error()),
                    "errno {errno:?}"
                ),
            }
        }
    }
}
