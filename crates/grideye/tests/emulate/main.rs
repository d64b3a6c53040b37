//! `grideye emulate` as its users have it: the program, its ways, its errors, and what it leaves behind, which is nothing.
#![expect(
    clippy::unwrap_used,
    clippy::panic,
    reason = "what fails in a helper fails the test"
)]

#[path = "../../../i2c-emulation/tests/socket/client.rs"]
mod client;
mod ending;
mod examples;
mod faults;
#[expect(unreachable_pub, reason = "the tests of the whole share this file")]
#[path = "../../../../tests/src/patience.rs"]
mod patience;
mod rack;
mod refusals;
mod shipped;
#[expect(unreachable_pub, reason = "the tests of the whole share this file")]
#[path = "../../../../tests/src/skip.rs"]
mod skip;
mod support;
mod time;
