//! What the buses of a rack are to USB/IP: how many there may be, and how each is named and described.

use super::device::{SPEED_LOW, device_descriptor};
use super::error::UsbipError;
use super::limits::BUSES_MAX;
use super::wire::Described;

/// The name under which a bus is offered, as `usbip attach -b` wants it: `1-N` for bus N of the rack.
#[must_use]
pub fn bus_id(bus: u32) -> String {
    format!("1-{bus}")
}

/// The emulated adapter of one bus. `index` counts the buses of the rack from 0.
pub(super) fn identity(bus: u32, index: usize) -> Described {
    Described {
        bus_id: bus_id(bus),
        bus_number: 1,
        device_number: u16::try_from(index + 1).unwrap_or(u16::MAX),
        speed: SPEED_LOW,
        descriptor: device_descriptor(),
    }
}

/// What [`Server`] and [`attach`] check before anything is started.
pub(super) fn check_number(buses: usize) -> Result<(), UsbipError> {
    match buses {
        0 => Err(UsbipError::NoBus),
        found if found > BUSES_MAX => Err(UsbipError::TooManyBuses { found }),
        _ => Ok(()),
    }
}
