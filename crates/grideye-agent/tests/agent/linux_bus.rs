//! The kernel's bus files: which ones open, and what their errors mean for a frame.

use embedded_hal::i2c::{ErrorKind, NoAcknowledgeSource};
use grideye_agent::bus::{LinuxBus, LinuxError, OpenBus as _, OpenError, by_kind};
use grideye_frame::NoData;
use std::io;

#[test]
fn errno_is_read_as_raspberry_pi_adapters_use_it() {
    let meanings = [
        (121, NoData::Nack),
        (6, NoData::Nack),
        (110, NoData::BusTimeout),
        (5, NoData::BusError),
        (11, NoData::BusError),
        (95, NoData::BusError),
        (19, NoData::Unplugged),
        (107, NoData::Unplugged),
    ];
    for (errno, meaning) in meanings {
        let error = LinuxError::System(io::Error::from_raw_os_error(errno));
        let found = LinuxBus::new("/dev/null", [0x69]).classify(&error);
        assert_eq!(found, meaning, "errno {errno}");
    }
    let nobody = ErrorKind::NoAcknowledge(NoAcknowledgeSource::Address);
    assert_eq!(by_kind(nobody), NoData::Nack);
    assert_eq!(by_kind(ErrorKind::ArbitrationLoss), NoData::BusError);
}

/// i2c-tiny-usb returns EIO for every transfer after its device was pulled out; observed in the guest of tests/guests.
#[test]
fn an_adapter_whose_file_is_gone_is_unplugged_whatever_the_errno() {
    let gone = LinuxBus::new("/nonexistent/i2c-9", [0x69]);
    let classify = |errno| gone.classify(&LinuxError::System(io::Error::from_raw_os_error(errno)));
    assert_eq!(classify(5), NoData::Unplugged);
    assert_eq!(classify(121), NoData::Nack, "somebody drives the bus");
}

#[test]
fn a_file_that_is_no_bus_is_refused_and_a_missing_one_is_named() {
    let mut missing = LinuxBus::new("/nonexistent/i2c-9", [0x69]);
    assert!(
        matches!(missing.open(), Err(OpenError::NoSuchBus(path)) if path == "/nonexistent/i2c-9")
    );
    let error = LinuxBus::new("/dev/null", [0x69]).open().err().unwrap();
    assert!(matches!(error, OpenError::Unusable(..)), "{error}");
    assert_eq!(missing.open().err().unwrap().reason(), NoData::Unplugged);
}
