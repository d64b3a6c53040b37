//! What an emulated adapter is to USB: its name, its number, its descriptor.

/// USB_SPEED_LOW of `linux/usb/ch9.h`, as the original has it. vhci-hcd complains in the kernel's log about full speed.
pub(super) const SPEED_LOW: u32 = 1;
pub(super) const BUS_NUMBER: u16 = 1;
/// USB 2.0, table 9-8: USB 1.1, a class of its own, eight bytes at a time, vendor 0403, product c631 (the first that the
/// kernel's i2c-tiny-usb knows), release 2.00, three strings, one configuration.
pub(super) const DESCRIPTOR: [u8; 18] = [
    18, 1, 0x10, 0x01, 0xFF, 0, 0, 8, 0x03, 0x04, 0x31, 0xC6, 0x00, 0x02, 1, 2, 3, 1,
];

#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Identity {
    pub(super) bus_id: String,
    pub(super) device_number: u16,
}

impl Identity {
    /// The adapter of one bus. `index` counts the buses of the rack from 0.
    pub(super) fn new(bus: u32, index: usize) -> Self {
        Self {
            bus_id: bus_id(bus),
            device_number: u16::try_from(index + 1).unwrap_or(u16::MAX),
        }
    }
}

/// The name under which a bus is offered, as `usbip attach -b` wants it: `1-N` for bus N of the rack.
#[must_use]
pub fn bus_id(bus: u32) -> String {
    format!("1-{bus}")
}
