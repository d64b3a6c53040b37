//! Way 4: a real `/dev/i2c-N` of the real kernel, by an emulated USB adapter.
//!
//! ```text
//!  this program                                  the kernel                                        any program
//!  ────────────                                  ──────────                                        ───────────
//!  rack ─▶ adapter ─▶ i2c-tiny-usb, emulated ──▶ vhci-hcd ─▶ i2c-tiny-usb ─▶ i2c-core ─▶ i2c-dev ─▶ /dev/i2c-N
//!                     (USB/IP, over a socketpair                             └▶ the kernel's own drivers
//!                      or over TCP)
//! ```
//!
//! The adapter is the classic i2c-tiny-usb (0403:c631), which knows control transfers only. [`attach`] hands it to this
//! machine's kernel; [`Server`] offers it to another machine or guest, where `usbip attach` fetches it.

mod device;
mod error;
mod identity;
mod server;
mod session;
#[cfg(test)]
mod tests;
mod vhci;
mod wire;

pub use device::HELD_MESSAGES_MAX;
pub use error::{BUSES_MAX, PORT_DEFAULT, UsbipError};
pub use identity::bus_id;
pub use server::{CONNECTIONS_MAX, FIRST_PHASE_MAX, Server};
pub use session::SessionError;
pub use vhci::{Attached, AttachedBus, Options, attach};
pub use wire::{Malformed, TRANSFER_BYTES_MAX};
