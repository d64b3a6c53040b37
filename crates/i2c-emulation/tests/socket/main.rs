//! The socket as other processes see it: a client by the document, the Python client, raw packets, and the socket's file.
//!
//! Name what the machine lacks: `GRIDEYE_WITHOUT_PYTHON_DRIVERS=1` skips the comparison with the real smbus2 from PyPI,
//! `GRIDEYE_WITHOUT_I2C_TOOLS=1` what needs Python, if there is none.
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
mod served;
#[expect(
    dead_code,
    unreachable_pub,
    reason = "the tests of the whole share this file"
)]
#[path = "../../../../tests/src/skip.rs"]
mod skip;
mod steps;
