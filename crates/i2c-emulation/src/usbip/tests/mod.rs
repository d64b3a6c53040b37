//! Tests of the protocol against its specification, of the device against the kernel's driver, and of sysfs against a
//! folder like it.

mod device;
mod host;
mod server;
mod session;
mod vhci;
