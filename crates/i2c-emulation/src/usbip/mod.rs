//! A real `/dev/i2c-N` of the real kernel, by an emulated USB adapter, the classic i2c-tiny-usb (0403:c631).
//!
//! The adapter supports only control transfers and speaks USB/IP to vhci-hcd; the kernel's i2c-tiny-usb and i2c-dev do
//! the rest. [`attach`] connects it to this machine's kernel; [`Server`] offers it to another machine or guest over
//! TCP.

mod device;
mod error;
mod server;
mod session;
#[cfg(test)]
mod tests;
mod vhci;
mod wire;

pub use device::HELD_MESSAGES_MAX;
pub use error::{BUSES_MAX, PORT_DEFAULT, UsbipError};
pub use server::{CONNECTIONS_MAX, FIRST_PHASE_MAX, Server};
pub use session::SessionError;
pub use vhci::{Attached, AttachedBus, Options, attach};
pub use wire::{Malformed, TRANSFER_BYTES_MAX, bus_id};
