//! Third-party drivers, unmodified from crates.io, on the emulated sensor: their values against the true ones. The
//! reference lists their known faults in sections 4.8 and 6.1.
#![expect(clippy::unwrap_used, reason = "what fails in a helper fails the test")]

mod amg88_0_4;
mod grideye_0_3;
mod sensor;
