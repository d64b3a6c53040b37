//! The numbers that errors name as well: how many buses, and which port.

/// Most buses of one rack that become adapters: a usual vhci_hcd has eight ports.
pub const BUSES_MAX: usize = 8;
/// The port that `usbip` asks unless told otherwise.
pub const PORT_DEFAULT: u16 = 3240;
