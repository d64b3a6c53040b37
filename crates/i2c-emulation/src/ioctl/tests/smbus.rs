//! SMBus calls: their messages, their answers, and their checksums.

use super::bench::*;
use crate::adapter::{ByFunction, Message};
use crate::ioctl::request::*;
use crate::ioctl::smbus_size::*;
use crate::ioctl::{AdapterMode, Errno, OpenFile, PointerWidth, message_flag};
use embedded_hal::i2c::Operation;

/// The messages in the SMBus protocol table of the kernel's `Documentation/i2c/smbus-protocol.rst`.
#[test]
fn each_smbus_call_is_made_of_the_right_messages() {
    let block = [3, 0xA1, 0xA2, 0xA3];
    for (read_write, size, data, expected) in [
        (0, QUICK, &[][..], "W"),
        (1, QUICK, &[], "R 0"),
        (0, BYTE, &[], "W 10"),
        (1, BYTE, &[], "R 1"),
        (0, BYTE_DATA, &[0xA1], "W 10 a1"),
        (1, BYTE_DATA, &[], "W 10, R 1"),
        (0, WORD_DATA, &[0xA1, 0xA2], "W 10 a1 a2"),
        (1, WORD_DATA, &[], "W 10, R 2"),
        (0, PROC_CALL, &[0xA1, 0xA2], "W 10 a1 a2, R 2"),
        (1, PROC_CALL, &[0xA1, 0xA2], "W 10 a1 a2, R 2"),
        (0, BLOCK_DATA, &block, "W 10 03 a1 a2 a3"),
        (0, I2C_BLOCK_DATA, &block, "W 10 a1 a2 a3"),
        (1, I2C_BLOCK_DATA, &[3], "W 10, R 3"),
        (0, I2C_BLOCK_BROKEN, &block, "W 10 a1 a2 a3"),
        (1, I2C_BLOCK_BROKEN, &[], "W 10, R 32"),
    ] {
        for width in [PointerWidth::Bits64, PointerWidth::Bits32] {
            let mut bench = Bench::with_width(AdapterMode::Pi, width);
            bench.memory.put(DATA, data);
            assert_eq!(bench.smbus(read_write, 0x10, size), Ok(0), "{expected}");
            assert_eq!(bench.seen(), [expected], "{width:?}");
        }
    }
}

#[test]
fn smbus_answers_arrive_where_they_belong() {
    let mut bench = Bench::new(AdapterMode::Pi);
    for (size, before, expected) in [
        (BYTE_DATA, &[][..], &[0xEF, 0xEE][..]),
        (WORD_DATA, &[], &[0xEF, 0xEE, 0xEE]),
        (I2C_BLOCK_DATA, &[3], &[3, 0xEF, 0xEE, 0xED]),
    ] {
        bench.memory.put(DATA, &[0xEE; 8]);
        bench.memory.put(DATA, before);
        bench.smbus(1, 0x10, size).unwrap();
        assert_eq!(bench.memory.at(DATA, expected.len()), expected);
    }
    bench.memory.put(DATA, &[7; 8]);
    bench.smbus(0, 0x10, WORD_DATA).unwrap();
    let data = bench.memory.at(DATA, 8);
    assert_eq!(data, [7; 8], "a write leaves the caller's data alone");
}

#[test]
fn a_block_that_tells_its_length_needs_an_adapter_that_can() {
    let mut pi = Bench::new(AdapterMode::Pi);
    assert_eq!(pi.smbus(1, 0x10, BLOCK_DATA), Err(Errno::OPNOTSUPP));
    assert_eq!(pi.seen(), [""; 0]);
    let mut pi5 = Bench::new(AdapterMode::Pi5);
    pi5.adapter.bus().registers[0x10..0x14].copy_from_slice(&[3, 0xB1, 0xB2, 0xB3]);
    assert_eq!(pi5.smbus(1, 0x10, BLOCK_DATA), Ok(0));
    assert_eq!(pi5.memory.at(DATA, 4), [3, 0xB1, 0xB2, 0xB3]);
    for right in [1, 32] {
        pi5.adapter.bus().registers[0x10] = right;
        assert_eq!(pi5.smbus(1, 0x10, BLOCK_DATA), Ok(0), "{right}");
    }
    for wrong in [0, 33, 255] {
        pi5.adapter.bus().registers[0x10] = wrong;
        assert_eq!(pi5.smbus(1, 0x10, BLOCK_DATA), Err(Errno::PROTO), "{wrong}");
    }
    pi5.adapter.bus().registers[0x13..0x16].copy_from_slice(&[2, 0xC1, 0xC2]);
    pi5.memory.put(DATA, &[2, 1, 1]);
    let outcome = pi5.smbus(0, 0x10, BLOCK_PROC_CALL);
    assert_eq!(outcome, Ok(0), "3 bytes there move the pointer to 0x13");
    assert_eq!(pi5.memory.at(DATA, 3), [2, 0xC1, 0xC2]);
}

#[test]
fn rdwr_can_ask_the_target_for_the_length() {
    let length_first = READ | message_flag::LENGTH_FIRST;
    let mut bench = Bench::new(AdapterMode::Pi5);
    bench.adapter.bus().registers[..4].copy_from_slice(&[3, 0xB1, 0xB2, 0xB3]);
    bench.memory.put(BUFFER, &[1]);
    assert_eq!(bench.rdwr(&[(TARGET, length_first, 33, BUFFER)]), Ok(1));
    assert_eq!(bench.memory.at(BUFFER, 5), [3, 0xB1, 0xB2, 0xB3, 0xEE]);
    for (first, length, flags) in [
        (0, 33, length_first),
        (1, 32, length_first),
        (2, 33, length_first),
        (1, 33, message_flag::LENGTH_FIRST),
    ] {
        bench.memory.put(BUFFER, &[first]);
        let outcome = bench.rdwr(&[(TARGET, flags, length, BUFFER)]);
        assert_eq!(outcome, Err(Errno::INVAL), "{first} {length}");
    }
    let mut pi = Bench::new(AdapterMode::Pi);
    pi.memory.put(BUFFER, &[1]);
    let outcome = pi.rdwr(&[(TARGET, length_first, 33, BUFFER)]);
    assert_eq!(outcome, Err(Errno::OPNOTSUPP));
}

#[test]
fn smbus_values_out_of_range_are_einval() {
    let mut bench = Bench::new(AdapterMode::Pi);
    for size in [9, 10, u32::MAX] {
        assert_eq!(bench.smbus(1, 0, size), Err(Errno::INVAL), "{size}");
    }
    for read_write in [2, 255] {
        assert_eq!(bench.smbus(read_write, 0, QUICK), Err(Errno::INVAL));
    }
    let null = bench.memory.put_smbus(BASE, 1, 0, BYTE_DATA, 0);
    assert_eq!(bench.call(I2C_SMBUS, null), Err(Errno::INVAL), "null");
    let quick = bench.memory.put_smbus(BASE, 0, 0, QUICK, 0);
    assert_eq!(bench.call(I2C_SMBUS, quick), Ok(0), "quick has no data");
    let nowhere = bench.memory.put_smbus(BASE, 0, 0, BYTE_DATA, 8);
    assert_eq!(bench.call(I2C_SMBUS, nowhere), Err(Errno::FAULT));
    bench.seen();
    for size in [BLOCK_DATA, I2C_BLOCK_DATA, I2C_BLOCK_BROKEN] {
        bench.memory.put(DATA, &[33]);
        assert_eq!(bench.smbus(0, 0, size), Err(Errno::INVAL), "{size}");
        bench.memory.put(DATA, &[32]);
        assert_eq!(bench.smbus(0, 0, size), Ok(0), "{size}");
    }
    assert_eq!(bench.seen().len(), 3, "only those in range");
}

/// The examples in the MLX90614's datasheet (SMBus communication): target 0x5A, a read of 0x07 returns 0x3AD2 with the
/// checksum 0x30; a write of 0xC807 to 0x22 has the checksum 0x48.
#[test]
fn checksums_are_those_of_a_printed_example() {
    let mut memory = Memory::new(PointerWidth::Bits64);
    let mut file = OpenFile::new(AdapterMode::Pi);
    // Sends one request to a target with this checksum; returns what was written to it.
    let mut ask = |memory: &mut Memory, request, argument, checksum| {
        let mut written = Vec::new();
        let mut device = ByFunction(|messages: &mut [Message<'_>]| {
            for message in messages {
                assert_eq!(message.address, 0x5A);
                match &mut message.operation {
                    Operation::Write(bytes) => written = bytes.to_vec(),
                    Operation::Read(buffer) => buffer.copy_from_slice(&[0xD2, 0x3A, checksum]),
                }
            }
            Ok(())
        });
        let outcome = file.ioctl(request, argument, memory, &mut device);
        outcome.map(|done| (done, written))
    };
    ask(&mut memory, I2C_SLAVE, 0x5A, 0).unwrap();
    ask(&mut memory, I2C_PEC, 1, 0).unwrap();
    let read = memory.put_smbus(BASE, 1, 0x07, WORD_DATA, DATA);
    let right = ask(&mut memory, I2C_SMBUS, read, 0x30);
    assert_eq!(right, Ok((0, vec![0x07])));
    assert_eq!(memory.at(DATA, 3), [0xD2, 0x3A, 0xEE]);
    let wrong = ask(&mut memory, I2C_SMBUS, read, 0x31);
    assert_eq!(wrong, Err(Errno::BADMSG));
    memory.put(DATA, &[0x07, 0xC8]);
    let write = memory.put_smbus(BASE, 0, 0x22, WORD_DATA, DATA);
    let checked = ask(&mut memory, I2C_SMBUS, write, 0);
    assert_eq!(checked, Ok((0, vec![0x22, 0x07, 0xC8, 0x48])));
    ask(&mut memory, I2C_PEC, 0, 0).unwrap();
    let unchecked = ask(&mut memory, I2C_SMBUS, write, 0);
    assert_eq!(unchecked, Ok((0, vec![0x22, 0x07, 0xC8])));
}
