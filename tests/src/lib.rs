//! What the tests of the whole share: starting the real programs, what they are shown, and a small WebDriver client.

#[expect(
    clippy::unwrap_used,
    clippy::panic,
    reason = "what fails here fails the test that asked for it"
)]
pub mod broker;

#[expect(
    clippy::unwrap_used,
    reason = "what fails here fails the test that asked for it"
)]
pub mod c_library;

pub mod comparing;

pub mod live_page;

pub mod patience;

#[expect(
    clippy::unwrap_used,
    reason = "what fails here fails the test that asked for it"
)]
pub mod emulated;

#[expect(
    clippy::unwrap_used,
    reason = "what fails here fails the test that asked for it"
)]
pub mod mounted;

#[expect(
    clippy::unwrap_used,
    reason = "what fails here fails the test that asked for it"
)]
pub mod programs;

#[expect(
    clippy::unwrap_used,
    reason = "what fails here fails the test that asked for it"
)]
pub mod postgres;

#[expect(
    clippy::unwrap_used,
    reason = "what fails here fails the test that asked for it"
)]
pub mod python;

pub mod skip;

#[expect(
    clippy::unwrap_used,
    clippy::panic,
    reason = "what fails here fails the test that asked for it"
)]
pub mod walkthrough;

pub mod webdriver;

#[expect(
    clippy::unwrap_used,
    reason = "what fails here fails the test that asked for it"
)]
pub mod workflow;
