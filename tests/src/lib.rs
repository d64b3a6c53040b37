//! What the tests of the whole share: starting the real programs, and a small WebDriver client.

pub mod programs;
