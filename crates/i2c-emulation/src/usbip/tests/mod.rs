//! The protocol against its document, the device against the kernel's driver, sysfs against a folder that looks like it.

mod device;
mod host;
mod server;
mod session;
mod vhci;
