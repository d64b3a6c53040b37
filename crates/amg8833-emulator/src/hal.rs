//! The same bus for drivers on traits other than `embedded-hal` 1.0.

#[cfg(feature = "async")]
mod asynchronous;
#[cfg(feature = "hal-0-2")]
mod v0_2;
