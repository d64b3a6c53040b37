//! The steps of joining, as they are told.

use crate::command::exit::write_stdout;

/// What joining does, in this order.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Step {
    Line,
    Collector,
    Token,
    File,
    Service,
    FirstFrame,
}

/// How many there are.
const STEPS: usize = 6;

impl Step {
    const fn number(self) -> usize {
        match self {
            Self::Line => 1,
            Self::Collector => 2,
            Self::Token => 3,
            Self::File => 4,
            Self::Service => 5,
            Self::FirstFrame => STEPS,
        }
    }

    const fn name(self) -> &'static str {
        match self {
            Self::Line => "the line",
            Self::Collector => "the collector",
            Self::Token => "the token",
            Self::File => "the file",
            Self::Service => "the service",
            Self::FirstFrame => "the first frame",
        }
    }

    /// Says that it is done, and how.
    pub(super) fn told(self, how: &str) -> std::io::Result<()> {
        let (number, name) = (self.number(), self.name());
        write_stdout(&format!("{number}/{STEPS} {name}: {how}\n"))
    }

    /// Takes the step; an error says which one failed, and what stays of those before.
    pub(super) fn take<T>(self, step: impl FnOnce() -> anyhow::Result<T>) -> anyhow::Result<T> {
        step().map_err(|error| {
            let (number, name) = (self.number(), self.name());
            let stays = match self {
                Self::Line | Self::Collector | Self::Token | Self::File => {
                    "nothing was changed".to_owned()
                }
                Self::Service | Self::FirstFrame => format!(
                    "steps 1 to {} are done and stay, and the line may be pasted again",
                    number - 1
                ),
            };
            error.context(format!(
                "step {number} of {STEPS}, {name}, failed ({stays})"
            ))
        })
    }
}
