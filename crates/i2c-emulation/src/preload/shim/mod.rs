//! The inside of the preloaded library: which descriptors may be tokens, and a few connections for their calls.
//!
//! It allocates nothing, takes no lock that a fork or a signal handler could find held forever, and calls the kernel
//! directly, so that it never meets its own interception or a cancellation point.
#![expect(
    unsafe_code,
    reason = "a library that stands between programs and the C library is handed addresses, not references"
)]

#[macro_use]
mod intercept;

mod calls;
mod channel;
mod descriptor;
mod path;
mod setting;
mod system;
mod transfers;

#[cfg(not(test))]
pub(crate) use system::abort;
