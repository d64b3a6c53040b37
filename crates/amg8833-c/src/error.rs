//! What a call returns.

use amg8833_emulator::BusError;
use core::ffi::CStr;
use embedded_hal::i2c::NoAcknowledgeSource;

macro_rules! errors {
    ($($name:ident = $number:literal, $text:literal;)+) => {
        /// `amg8833_error` of the header.
        #[derive(Debug, Clone, Copy, PartialEq, Eq)]
        #[repr(C)]
        pub enum Error {
            $(#[doc = $text] $name = $number,)+
        }

        impl Error {
            /// The sentence for a number, of whatever origin.
            pub(crate) const fn text(number: i32) -> &'static CStr {
                let text = match number {
                    $($number => concat!($text, "\0"),)+
                    _ => "not a number of an error\0",
                };
                match CStr::from_bytes_with_nul(text.as_bytes()) {
                    Ok(text) => text,
                    Err(_) => c"",
                }
            }
        }
    };
}

errors! {
    Ok = 0, "done";
    NackAddress = 1, "no device acknowledged the address";
    NackByte = 2, "the device did not acknowledge a byte";
    Bus = 3, "a START or STOP was misplaced on the bus";
    ArbitrationLost = 4, "another controller drove the bus";
    Timeout = 5, "the bus was held low for a second";
    Gone = 6, "the bus adapter is gone";
    Late = 7, "the INT pin did not change in this time";
    Null = 16, "a pointer is NULL";
    NotABus = 17, "this memory holds no bus: amg8833_init() first, and do not move or copy a bus";
    Size = 18, "header and library are of different versions: the size of amg8833_bus differs";
    Busy = 19, "another call on this bus has not ended: of another thread, or of its own callback";
    Address = 20, "a sensor has the address 0x68 or 0x69";
    NoSensor = 21, "there is no sensor at this address";
    Value = 22, "a number is out of its range";
    Overlap = 23, "the bytes to read overlap those to write, or the bus";
    Open = 24, "a transaction is open: amg8833_stop() first";
    NotOpen = 25, "no transaction is open, or it goes in the other direction: amg8833_start() first";
    Full = 26, "no more faults fit on this bus";
    Scene = 27, "the scene was refused: the message says where";
    NoScenes = 28, "this library was built without the feature `scene`";
    Panic = 29, "an error of the library itself: standard error has it, and the bus is of no more use";
}

impl From<BusError> for Error {
    fn from(error: BusError) -> Self {
        match error {
            BusError::NoAcknowledge { source, .. } => source.into(),
            BusError::Bus => Self::Bus,
            BusError::ArbitrationLoss => Self::ArbitrationLost,
            BusError::Timeout => Self::Timeout,
            BusError::Gone => Self::Gone,
        }
    }
}

impl From<NoAcknowledgeSource> for Error {
    fn from(source: NoAcknowledgeSource) -> Self {
        match source {
            NoAcknowledgeSource::Data => Self::NackByte,
            _ => Self::NackAddress,
        }
    }
}
