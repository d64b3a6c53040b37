//! How the adapters differ: what each rejects, and its errno for each fault.

use super::bench::*;
use crate::adapter::Fault;
use crate::ioctl::request::*;
use crate::ioctl::{AdapterMode, Errno, OpenFile, RETRIES_DONE_MAX, smbus_size};

#[test]
fn only_a_raspberry_pi_refuses_a_read_that_is_not_last() {
    let write = (TARGET, 0, 1, DATA);
    let read = (TARGET, READ, 1, BUFFER);
    for (messages, fits_a_pi) in [
        (vec![write], true),
        (vec![read], true),
        (vec![write, read], true),
        (vec![write, write, read], true),
        (vec![read, write], false),
        (vec![read, read], false),
        (vec![write, read, write], false),
        (vec![write, read, write, read], false),
    ] {
        let count = i32::try_from(messages.len()).unwrap();
        for (mode, is_pi) in [
            (AdapterMode::Pi, true),
            (AdapterMode::Busy, true),
            (AdapterMode::Pi5, false),
            (AdapterMode::Usb, false),
            (AdapterMode::Virtio, false),
        ] {
            let fits = fits_a_pi || !is_pi;
            let mut bench = Bench::new(mode);
            let expected = fits.then_some(count).ok_or(Errno::OPNOTSUPP);
            assert_eq!(bench.rdwr(&messages), expected, "{mode} {messages:?}");
            assert_eq!(bench.seen().is_empty(), !fits, "refused before the bus");
        }
    }
}

#[test]
fn a_usb_adapter_refuses_a_read_of_no_bytes() {
    let mut usb = Bench::new(AdapterMode::Usb);
    assert_eq!(usb.rdwr(&[(TARGET, READ, 0, 0)]), Err(Errno::OPNOTSUPP));
    assert_eq!(usb.smbus(1, 0, smbus_size::QUICK), Err(Errno::OPNOTSUPP));
    assert_eq!(usb.smbus(0, 0, smbus_size::QUICK), Ok(0));
    let mut pi = Bench::new(AdapterMode::Pi);
    assert_eq!(pi.rdwr(&[(TARGET, READ, 0, 0)]), Ok(1));
}

/// Each fault in each of the four kinds of access. The numbers are those of the kernel's drivers.
#[test]
fn a_fault_has_the_errno_of_the_mode_by_every_way() {
    use Fault::{Bus, Gone, NackAddress, NackData, Timeout};
    for (mode, fault, errno) in [
        (AdapterMode::Pi, NackAddress, 121),
        (AdapterMode::Pi, NackData, 121),
        (AdapterMode::Pi, Timeout, 110),
        (AdapterMode::Pi, Bus, 5),
        (AdapterMode::Pi, Gone, 19),
        (AdapterMode::Pi5, NackAddress, 121),
        (AdapterMode::Usb, NackAddress, 6),
        (AdapterMode::Usb, Timeout, 5),
        (AdapterMode::Gone, NackAddress, 19),
    ] {
        let failing = |way: fn(&mut Bench) -> Result<usize, Errno>| {
            let mut bench = Bench::new(mode);
            bench.fail_with(&[fault]);
            way(&mut bench).map_err(Errno::raw_os_error)
        };
        let case = format!("{mode} {fault:?}");
        let read = failing(|bench| bench.read(&mut [0; 4]));
        let written = failing(|bench| bench.write(&[0; 4]));
        assert_eq!([read, written], [Err(errno); 2], "{case}");
        let mut bench = Bench::new(mode);
        bench.fail_with(&[fault]);
        let outcome = bench.rdwr(&[(TARGET, 0, 1, DATA), (TARGET, READ, 4, BUFFER)]);
        assert_eq!(outcome.map_err(Errno::raw_os_error), Err(errno), "{case}");
        let buffer = bench.memory.at(BUFFER, 4);
        assert_eq!(buffer, [0xEE; 4], "after an errno no buffer is touched");
        bench.fail_with(&[fault]);
        let outcome = bench.smbus(1, 0x10, smbus_size::BYTE_DATA);
        assert_eq!(outcome.map_err(Errno::raw_os_error), Err(errno), "{case}");
        assert_eq!(bench.memory.at(DATA, 1), [0xEE]);
    }
}

/// The trap of i2c-virtio: no errno, a smaller count, and the caller's old bytes in the buffer.
#[test]
fn virtio_hides_a_fault_in_the_count() {
    let mut bench = Bench::new(AdapterMode::Virtio);
    let missing = 0x10;
    let nobody = [(missing, 0, 1, DATA), (missing, READ, 4, BUFFER)];
    assert_eq!(bench.rdwr(&nobody), Ok(0));
    assert_eq!(bench.memory.at(BUFFER, 4), [0xEE; 4]);
    let one = [(TARGET, READ, 2, BUFFER), (missing, READ, 2, BUFFER + 2)];
    assert_eq!(bench.rdwr(&one), Ok(1));
    let arrived = bench.memory.at(BUFFER, 4);
    assert_eq!(arrived, [0xFF, 0xFE, 0xEE, 0xEE], "the bytes that arrived");
    bench.call(I2C_SLAVE, missing.into()).unwrap();
    assert_eq!(bench.read(&mut [0; 4]), Ok(0));
    assert_eq!(bench.write(&[1, 2]), Ok(0));
    let outcome = bench.smbus(1, 0, smbus_size::BYTE_DATA);
    assert_eq!(outcome, Err(Errno::IO), "SMBus does count");
}

#[test]
fn an_smbus_only_adapter_has_no_plain_messages_and_one_that_is_gone_reaches_nothing() {
    let read = [(TARGET, READ, 1, BUFFER)];
    let mut gone = Bench::new(AdapterMode::Gone);
    assert_eq!(gone.rdwr(&read), Err(Errno::NODEV));
    assert_eq!(gone.seen(), [""; 0]);
    let mut bench = Bench::new(AdapterMode::SmbusOnly);
    assert_eq!(bench.rdwr(&read), Err(Errno::OPNOTSUPP));
    assert_eq!(bench.rdwr(&[]), Err(Errno::INVAL), "values come first");
    assert_eq!(bench.read(&mut [0]), Err(Errno::OPNOTSUPP));
    assert_eq!(bench.write(&[0]), Err(Errno::OPNOTSUPP));
    assert_eq!(bench.seen(), [""; 0]);
    assert_eq!(bench.smbus(1, 0x10, smbus_size::BYTE_DATA), Ok(0));
    assert_eq!(bench.memory.at(DATA, 1), [0xEF]);
}

#[test]
fn lost_arbitration_is_tried_again_where_the_driver_says_so() {
    let lost = Fault::ArbitrationLost;
    let mut bench = Bench::new(AdapterMode::Pi5);
    let read = [(TARGET, READ, 1, BUFFER)];
    bench.fail_with(&[lost; 3]);
    assert_eq!(bench.rdwr(&read), Ok(1), "three retries by default");
    bench.fail_with(&[lost; 4]);
    assert_eq!(bench.rdwr(&read), Err(Errno::AGAIN));
    bench.call(I2C_RETRIES, 0).unwrap();
    bench.fail_with(&[lost]);
    assert_eq!(bench.rdwr(&read), Err(Errno::AGAIN));

    let mut pi = Bench::new(AdapterMode::Pi);
    pi.call(I2C_RETRIES, 3).unwrap();
    pi.fail_with(&[lost]);
    assert_eq!(pi.rdwr(&read), Err(Errno::IO), "it knows no arbitration");

    let mut bench = Bench::new(AdapterMode::Pi5);
    let most = u64::try_from(i32::MAX).unwrap();
    bench.call(I2C_RETRIES, most).unwrap();
    bench.fail_with(&[lost; 5000]);
    assert_eq!(bench.rdwr(&read), Err(Errno::AGAIN));
    let tries = usize::try_from(RETRIES_DONE_MAX).unwrap() + 1;
    assert_eq!(bench.seen().len(), tries);
}

#[test]
fn plain_read_and_write_are_one_message_of_at_most_8192_bytes() {
    let mut bench = Bench::new(AdapterMode::Pi);
    assert_eq!(bench.write(&[0x20, 1, 2]), Ok(3));
    let mut buffer = [0xEE; 9000];
    assert_eq!(bench.read(&mut buffer), Ok(8192));
    assert_eq!(bench.write(&[0; 9000]), Ok(8192));
    assert_eq!(bench.read(&mut []), Ok(0));
    let seen = bench.seen();
    assert_eq!(seen[..2], ["W 20 01 02", "R 8192"]);
    assert_eq!(seen[2].len(), 1 + 3 * 8192);
    assert_eq!(buffer[8192..], [0xEE; 808]);
    // A new file has address 0, the general call, which this chip ignores.
    bench.file = OpenFile::new(AdapterMode::Pi);
    assert_eq!(bench.read(&mut [0]), Err(Errno::REMOTEIO));
}
