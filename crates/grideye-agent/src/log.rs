//! Plain lines with a level, handed to whoever started the agent.

use std::fmt;
use std::sync::Arc;

/// How much a line matters.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Level {
    /// The course of things: started, stopped, recovered.
    Info,
    /// Something failed and is being tried again; nothing is lost yet.
    Warning,
    /// Frames were lost, or will be unless somebody acts.
    Error,
}

impl Level {
    /// `info`, `warning` or `error`.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Info => "info",
            Self::Warning => "warning",
            Self::Error => "error",
        }
    }
}

/// Where log lines go. Called from every thread of the agent; a line has no line break at its end.
#[derive(Clone)]
pub struct Log(Arc<Sink>);

type Sink = dyn Fn(Level, &str) + Send + Sync;

impl Log {
    /// Hands each line to a function.
    pub fn new(sink: impl Fn(Level, &str) + Send + Sync + 'static) -> Self {
        Self(Arc::new(sink))
    }

    /// Drops every line.
    #[must_use]
    pub fn silent() -> Self {
        Self::new(|_, _| ())
    }

    /// Writes each line to standard error with its level in front. A closed standard error is no reason to stop.
    #[must_use]
    pub fn to_stderr() -> Self {
        use std::io::Write as _;
        Self::new(|level, line| {
            let _ = writeln!(std::io::stderr().lock(), "{}: {line}", level.name());
        })
    }

    /// Hands on a line of this level.
    pub fn line(&self, level: Level, line: impl AsRef<str>) {
        (self.0)(level, line.as_ref());
    }

    pub(crate) fn info(&self, line: impl AsRef<str>) {
        self.line(Level::Info, line);
    }

    pub(crate) fn warning(&self, line: impl AsRef<str>) {
        self.line(Level::Warning, line);
    }

    pub(crate) fn error(&self, line: impl AsRef<str>) {
        self.line(Level::Error, line);
    }
}

impl fmt::Debug for Log {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str("Log")
    }
}
