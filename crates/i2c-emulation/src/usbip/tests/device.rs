//! The device against the kernel's driver of the i2c-tiny-usb.

use super::host::*;
use crate::adapter::Fault;
use crate::usbip::HELD_MESSAGES_MAX;
use std::io::Write as _;

#[test]
fn the_kernel_finds_an_i2c_tiny_usb() {
    let (_, mut client) = plugged_in();
    let device = client.descriptor(0x0100, 0, 18).data;
    assert_eq!(device.len(), 18);
    assert_eq!(device[0..2], [18, 1], "USB 2.0, table 9-8");
    assert_eq!(device[8..12], [0x03, 0x04, 0x31, 0xC6], "0403:c631");
    assert_eq!(device[17], 1, "one configuration");
    // The kernel asks for nine bytes first, then for the length they state.
    let start = client.descriptor(0x0200, 0, 9).data;
    assert_eq!(start.len(), 9);
    let total = u16::from_le_bytes([start[2], start[3]]);
    let all = client.descriptor(0x0200, 0, total).data;
    assert_eq!(all.len(), usize::from(total));
    assert_eq!(all[..9], start);
    assert_eq!(all[9..13], [9, 4, 0, 0], "interface 0 alone");
    assert_eq!(all[13], 0, "no endpoint beside the control endpoint");
    assert_eq!(client.control(setup(0x00, 9, 1, 0, 0), &[]).status, 0);
    assert_eq!(client.control(setup(0x80, 8, 0, 0, 1), &[]).data, [1]);
}

#[test]
fn strings_are_utf_16_with_their_length_in_front() {
    let (_, mut client) = plugged_in();
    let mut text = |index: u16| {
        let bytes = client.descriptor(0x0300 | index, 0x0409, 255).data;
        assert_eq!((usize::from(bytes[0]), bytes[1]), (bytes.len(), 3));
        let pairs = bytes[2..].chunks_exact(2);
        let units = pairs.map(|pair| u16::from_le_bytes([pair[0], pair[1]]));
        let letters = char::decode_utf16(units).map(Result::unwrap);
        letters.collect::<String>()
    };
    let expected = ["emulated", "i2c-tiny-usb", "1-1"];
    assert_eq!([text(1), text(2), text(3)], expected);
    let languages = client.descriptor(0x0300, 0, 255).data;
    assert_eq!(languages, [4, 3, 0x09, 0x04]);
    assert_eq!(client.descriptor(0x0304, 0x0409, 255).status, EPIPE);
}

#[test]
fn it_offers_what_the_kernels_driver_offers() {
    let (_, mut client) = plugged_in();
    let functionality = client.control(setup(0xC1, 1, 0, 0, 4), &[]).data;
    // I2C_FUNC_I2C | I2C_FUNC_SMBUS_EMUL of linux/i2c.h.
    assert_eq!(functionality, 0x0EFF_0009_u32.to_le_bytes());
    let delay = client.control(setup(0x41, 2, 10, 0, 0), &[]);
    assert_eq!(delay.status, 0);
    let echo = client.control(setup(0xC1, 0, 0x1234, 0, 2), &[]);
    assert_eq!(echo.data, [0x34, 0x12]);
    assert_eq!(client.status(), 0, "idle before the first message");
}

#[test]
fn a_register_and_its_value_are_one_transaction() {
    let (registers, mut client) = plugged_in();
    assert_eq!(client.write_message(BEGIN, 0x69, &[0x20]), 0);
    assert_eq!(client.status(), 1, "acknowledged before it is sent");
    assert!(registers.notes().is_empty(), "nothing has been sent yet");
    let read = client.read_message(END, 0x69, 128);
    assert_eq!(client.status(), 1);
    assert_eq!(read.data, (0x20..0xA0).collect::<Vec<u8>>());
    assert_eq!(registers.notes(), ["69 W[20] 69 R128"]);
}

#[test]
fn a_single_message_is_sent_at_once() {
    let (registers, mut client) = plugged_in();
    assert_eq!(client.write_message(WHOLE, 0x69, &[1, 0x3F]), 0);
    assert_eq!(registers.notes(), ["69 W[01, 3f]"]);
    assert_eq!(client.read_message(WHOLE, 0x69, 2).data, [0, 1]);
    assert_eq!(registers.notes(), ["69 R2"]);
    assert_eq!(client.write_message(WHOLE, 0x69, &[]), 0);
    assert_eq!(registers.notes(), ["69 W[]"], "SMBus quick");
    assert_eq!(client.status(), 1);
    client.control(setup(0x41, 4 | WHOLE, 0x10, 0x169, 1), &[1]);
    assert_eq!(registers.notes(), ["ten 169 !"], "ten bits are passed on");
}

#[test]
fn messages_after_a_read_are_their_own_transaction() {
    let (registers, mut client) = plugged_in();
    client.write_message(BEGIN, 0x69, &[4]);
    assert_eq!(client.read_message(0, 0x69, 1).data, [4]);
    client.write_message(0, 0x69, &[6]);
    assert_eq!(client.read_message(END, 0x69, 1).data, [6]);
    assert_eq!(registers.notes(), ["69 W[04] 69 R1", "69 W[06] 69 R1"]);
    client.write_message(BEGIN, 0x69, &[0x11]);
    client.write_message(BEGIN, 0x69, &[0x20]);
    assert_eq!(client.read_message(END, 0x69, 1).data, [0x20]);
    let notes = registers.notes();
    assert_eq!(
        notes,
        ["69 W[20] 69 R1"],
        "nothing of the broken-off transfer"
    );
}

/// `usb_xfer` turns status 2 into ENXIO, but only if as many bytes came back as requested.
#[test]
fn a_missing_target_is_told_by_the_status() {
    let (_, mut client) = plugged_in();
    let read = client.read_message(WHOLE, 0x68, 3);
    assert_eq!((read.status, read.actual_length), (0, 3));
    assert_eq!(client.status(), 2);
    assert_eq!(client.write_message(WHOLE, 0x68, &[]), 0);
    assert_eq!(client.status(), 2);
    client.write_message(BEGIN, 0x68, &[0x20]);
    let read = client.read_message(END, 0x68, 128);
    assert_eq!((read.status, read.actual_length), (0, 128));
    assert_eq!(client.status(), 2);
    assert_eq!(client.write_message(WHOLE, 0x69, &[]), 0);
    assert_eq!(client.status(), 1, "the next message starts over");
}

#[test]
fn every_other_fault_stalls() {
    for (fault, status) in [
        (Fault::NackData, EPIPE),
        (Fault::Bus, EPIPE),
        (Fault::ArbitrationLost, EPIPE),
        (Fault::Timeout, EPIPE),
        (Fault::Gone, ENODEV),
    ] {
        let (registers, mut client) = plugged_in();
        registers.fail_with(fault);
        assert_eq!(client.write_message(WHOLE, 0x69, &[1]), status, "{fault:?}");
        let read = client.read_message(WHOLE, 0x69, 1);
        assert_eq!((read.status, read.actual_length), (status, 0), "{fault:?}");
    }
}

#[test]
fn more_messages_are_held_than_one_ioctl_can_bring_but_no_more() {
    let (registers, mut client) = plugged_in();
    assert_eq!(HELD_MESSAGES_MAX, 42, "I2C_RDWR_IOCTL_MAX_MSGS");
    for message in 0..HELD_MESSAGES_MAX {
        let begin = if message == 0 { BEGIN } else { 0 };
        assert_eq!(client.write_message(begin, 0x69, &[1]), 0);
    }
    assert_eq!(client.write_message(0, 0x69, &[1]), EPIPE);
    assert_eq!(client.write_message(END, 0x69, &[2]), 0);
    assert_eq!(registers.notes(), ["69 W[02]"], "nothing of the long one");
}

#[test]
fn a_message_is_as_long_as_i2c_dev_allows_and_no_longer() {
    let (registers, mut client) = plugged_in();
    assert_eq!(client.write_message(WHOLE, 0x69, &[0; 8192]), 0);
    assert_eq!(client.write_message(WHOLE, 0x69, &[0; 8193]), EPIPE);
    assert_eq!(client.read_message(WHOLE, 0x69, 8192).actual_length, 8192);
    assert_eq!(client.read_message(WHOLE, 0x69, 8193).status, EPIPE);
    assert_eq!(registers.notes().len(), 2);
}

#[test]
fn unknown_requests_stall() {
    let (_, mut client) = plugged_in();
    for unknown in [
        setup(0xC1, 8, 0, 0, 1),
        setup(0x41, 1, 0, 0, 0),
        setup(DEVICE_TO_HOST, 6, 0x0600, 0, 10),
        setup(0x00, 9, 2, 0, 0),
        setup(0x01, 11, 1, 0, 0),
        setup(0xA1, 4, 0, 0, 1),
        // A read in a write's direction, and vice versa.
        setup(0x41, 4 | WHOLE, 1, 0x69, 0),
        setup(0xC1, 4 | WHOLE, 0, 0x69, 1),
    ] {
        assert_eq!(client.control(unknown, &[]).status, EPIPE, "{unknown:02x?}");
    }
    let more_than_room = setup(0xC1, 1, 0, 0, 4);
    for (endpoint, length, setup) in [(1, 8, [0; 8]), (0, 1, more_than_room)] {
        let odd = submit_bytes([9, IN, endpoint, length], setup);
        client.0.write_all(&odd).unwrap();
        let reply = client.reply(false);
        assert_eq!(reply.status, EPIPE, "endpoint {endpoint}, room {length}");
    }
    assert_eq!(client.status(), 0, "and the connection is alive");
}

#[test]
fn an_answered_transfer_cannot_be_cancelled() {
    let (_, mut client) = plugged_in();
    let words = [2, 99, 0x1_0001, 0, 0, 7, 0, 0, 0, 0, 0, 0].map(u32::to_be_bytes);
    client.0.write_all(words.as_flattened()).unwrap();
    let reply = client.reply(false);
    assert_eq!((reply.command, reply.sequence, reply.status), (4, 99, 0));
}
