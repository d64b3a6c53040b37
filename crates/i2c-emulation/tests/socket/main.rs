//! Way 2 as other processes meet it: the Rust client, the Python client, raw packets, and the socket's file.
//!
//! What a machine lacks must be named: `GRIDEYE_WITHOUT_FUSE=1` leaves out what compares with a real `/dev/i2c-N` user,
//! `GRIDEYE_WITHOUT_PYTHON=1` what needs Python, `GRIDEYE_WITHOUT_PYPI=1` what needs smbus2 from PyPI.
#![expect(
    clippy::unwrap_used,
    clippy::panic,
    reason = "helpers of tests are outside the functions that clippy knows as tests"
)]

mod bench;
mod client;
mod hostile;
mod place;
mod python;
mod readme;
