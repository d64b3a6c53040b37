//! Log lines with a level, handed to the caller's function.

use crate::output::say;
use std::fmt;
use std::sync::Arc;

grideye_frame::named! {
    /// How serious a line is.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
    pub enum Level {
        /// Normal events: started, stopped, recovered.
        Info = "info";
        /// Something failed and is being retried; nothing is lost yet.
        Warning = "warning";
        /// Frames were lost, or will be unless a person acts.
        Error = "error";
    }
}

/// Where log lines go. Every thread of the agent calls it; a line does not end with a line break.
#[derive(Clone)]
pub struct Log(Arc<Sink>);

type Sink = dyn Fn(Level, &str) + Send + Sync;

impl Log {
    /// Passes each line to a function.
    pub fn new(sink: impl Fn(Level, &str) + Send + Sync + 'static) -> Self {
        Self(Arc::new(sink))
    }

    /// Drops every line.
    #[must_use]
    pub fn silent() -> Self {
        Self::new(|_, _| ())
    }

    /// Writes each line to standard error with its level in front.
    #[must_use]
    pub fn to_stderr() -> Self {
        Self::new(|level, line| say(&format_args!("{}: {line}", level.name())))
    }

    /// Writes each line to standard error as one JSON object: `level`, `part` (the thread), `message`, and `hint` if any.
    #[must_use]
    pub fn to_stderr_as_json() -> Self {
        Self::new(|level, line| {
            let thread = std::thread::current();
            say(&as_json(level, thread.name().unwrap_or_default(), line));
        })
    }

    /// Logs a line at this level.
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

fn as_json(level: Level, part: &str, line: &str) -> serde_json::Value {
    let (message, hint) = line.split_once("\nhint: ").unwrap_or((line, ""));
    let mut json = serde_json::json!({ "level": level.name(), "part": part, "message": message });
    if !hint.is_empty() {
        json["hint"] = hint.into();
    }
    json
}

impl fmt::Debug for Log {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str("Log")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_json_log_line_is_one_object_with_a_separate_hint() {
        let json = as_json(Level::Warning, "upload", "a \"b\"\nc\nhint: d");
        assert_eq!(json.to_string().lines().count(), 1);
        let expected = serde_json::json!({"level": "warning", "part": "upload", "message": "a \"b\"\nc", "hint": "d"});
        assert_eq!(json, expected);
        assert!(as_json(Level::Info, "main", "a").get("hint").is_none());
    }
}
