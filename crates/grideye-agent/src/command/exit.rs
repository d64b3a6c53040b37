//! How the program ends, and what it writes before.

use std::io::Write as _;
use std::process::ExitCode;

pub(super) const FAILED: u8 = 1;
const BAD_USAGE: u8 = 2;
pub(super) const DATA_LOST: u8 = 3;

/// The caller's mistake: exit code 2.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub(super) struct BadUsage(pub(super) String);

/// All is done, but nobody can say whether it went well: exit code 3.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub(super) struct Unanswered(pub(super) String);

/// A closed standard output (`grideye-agent … | head`) is no error.
pub(super) fn write_stdout(text: &str) -> std::io::Result<()> {
    match std::io::stdout().write_all(text.as_bytes()) {
        Err(error) if error.kind() == std::io::ErrorKind::BrokenPipe => Ok(()),
        other => other,
    }
}

/// The exit code of a failure.
pub(crate) fn code_of(error: &anyhow::Error) -> ExitCode {
    let is_usage = error.chain().any(<dyn std::error::Error>::is::<BadUsage>);
    let is_unanswered = error.chain().any(<dyn std::error::Error>::is::<Unanswered>);
    ExitCode::from(if is_usage {
        BAD_USAGE
    } else if is_unanswered {
        DATA_LOST
    } else {
        FAILED
    })
}
