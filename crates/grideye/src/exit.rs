//! How a command ends: the exit codes of the whole program, and the errors that choose between them.

use crate::progress::say;
use std::process::ExitCode;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Outcome {
    /// Done, or real and simulated agree: 0.
    Done,
    /// The check failed, or real and simulated disagree: 1.
    Disagrees,
    /// Finished without an answer, or with data lost: 3.
    NoAnswer,
    /// Another program ran and ended with this code, which is passed on.
    Passed(u8),
}

impl Outcome {
    pub(crate) const fn told(is_told: bool) -> Self {
        if is_told { Self::Done } else { Self::NoAnswer }
    }
}

impl From<Outcome> for ExitCode {
    fn from(outcome: Outcome) -> Self {
        match outcome {
            Outcome::Done => Self::SUCCESS,
            Outcome::Disagrees => Self::from(1),
            Outcome::NoAnswer => Self::from(3),
            Outcome::Passed(code) => Self::from(code),
        }
    }
}

/// Marks an error as bad input: an argument, scene, recording or configuration. Exit code 2.
#[derive(Debug, thiserror::Error)]
#[error("{}", told(.0))]
struct BadInput(anyhow::Error);

pub(crate) fn bad_input(error: impl Into<anyhow::Error>) -> anyhow::Error {
    anyhow::Error::new(BadInput(error.into()))
}

/// Whether it is bad input.
pub(crate) fn is_bad_input(error: &anyhow::Error) -> bool {
    error.chain().any(<dyn std::error::Error>::is::<BadInput>)
}

pub(crate) fn report(error: &anyhow::Error) -> ExitCode {
    say(&format_args!("error: {}", told(error)));
    ExitCode::from(if is_bad_input(error) { 2 } else { 1 })
}

/// The error and its causes, each once, and then the hint.
fn told(error: &anyhow::Error) -> String {
    error.chain().fold(String::new(), |told, cause| {
        match (told.split_once("\nhint: "), cause.to_string()) {
            (_, text) if told.is_empty() => text,
            (_, text) if told.contains(&text) => told,
            (Some((what, hint)), text) => format!("{what}: {text}\nhint: {hint}"),
            (None, text) => format!("{told}: {text}"),
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use anyhow::anyhow;

    #[test]
    fn a_cause_is_told_once() {
        let error = anyhow!("no rights").context("cannot start x: no rights\nhint: chmod");
        assert_eq!(told(&error), "cannot start x: no rights\nhint: chmod");
        let told =
            bad_input(anyhow!("no rights").context("cannot start x\nhint: chmod")).to_string();
        assert_eq!(told, "cannot start x: no rights\nhint: chmod");
    }
}
