//! Drivers of other authors, unmodified from crates.io, against the emulated sensor: what they make of the chip's
//! bytes, and what is true. Their known faults are in the reference's sections 4.8 and 6.1.
#![expect(clippy::unwrap_used, reason = "what fails in a helper fails the test")]

mod amg88_0_4;
mod grideye_0_3;
mod sensor;
