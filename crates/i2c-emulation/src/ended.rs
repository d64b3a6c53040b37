//! How a program ended that ran with emulated devices.

use std::process::ExitStatus;

/// How the program ended, and how often it had opened its devices.
pub(crate) struct Ended {
    pub(crate) status: ExitStatus,
    pub(crate) opens: u64,
}
