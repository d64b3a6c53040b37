//! The collector's log: events with fields, passed to a function of the program.

use crate::lock::lock;
use serde_json::{Map, Value};
use std::collections::HashMap;
use std::fmt;
use std::sync::{Arc, Mutex};
use std::time::Duration;

grideye_frame::named! {
    /// The severity of an event.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
    pub enum Level {
        /// Normal operation.
        Info = "info";
        /// A request was rejected, or something is near its limit.
        Warning = "warning";
        /// Frames cannot be stored, or the collector itself has an error.
        Error = "error";
    }
}

/// A log event. Holds no token, no cookie, and nothing that a client could send unasked.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LogEvent {
    /// Its severity.
    pub level: Level,
    /// The event, one or two words joined by `_`, from a fixed set.
    pub event: &'static str,
    /// Details, in a fixed order.
    pub fields: Vec<(&'static str, String)>,
    /// How many of the same kind were suppressed since the last one logged.
    pub unsaid: u64,
}

impl LogEvent {
    /// An event without fields.
    #[must_use]
    pub fn new(level: Level, event: &'static str) -> Self {
        Self {
            level,
            event,
            fields: Vec::new(),
            unsaid: 0,
        }
    }

    /// Adds a field.
    #[must_use]
    pub fn with(mut self, name: &'static str, value: impl fmt::Display) -> Self {
        self.fields.push((name, value.to_string()));
        self
    }

    /// One JSON object on one line: `event`, `level`, then the fields.
    #[must_use]
    pub fn to_json(&self) -> String {
        let mut json = Map::new();
        json.insert("event".to_owned(), self.event.into());
        json.insert("level".to_owned(), self.level.name().into());
        for (name, value) in &self.fields {
            json.insert((*name).to_owned(), value.as_str().into());
        }
        if self.unsaid > 0 {
            json.insert("unsaid".to_owned(), self.unsaid.into());
        }
        Value::Object(json).to_string()
    }
}

/// `warning: refused code=bad_token peer=192.168.1.7 (and 12 more)`, with quotation marks around unusual values.
impl fmt::Display for LogEvent {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{}: {}", self.level.name(), self.event)?;
        for (name, value) in &self.fields {
            let is_plain = |c: char| c.is_ascii_graphic() && !matches!(c, '"' | '=' | '\\');
            if !value.is_empty() && value.chars().all(is_plain) {
                write!(formatter, " {name}={value}")?;
            } else {
                write!(formatter, " {name}={value:?}")?;
            }
        }
        match self.unsaid {
            0 => Ok(()),
            more => write!(formatter, " (and {more} more)"),
        }
    }
}

/// The destination of events. Called from every thread.
#[derive(Clone)]
pub struct Log(Arc<dyn Fn(&LogEvent) + Send + Sync>);

impl Log {
    /// Passes each event to a function.
    pub fn new(sink: impl Fn(&LogEvent) + Send + Sync + 'static) -> Self {
        Self(Arc::new(sink))
    }

    /// Drops every event.
    #[must_use]
    pub fn silent() -> Self {
        Self::new(|_| ())
    }

    /// Logs the event.
    pub fn say(&self, event: &LogEvent) {
        (self.0)(event);
    }
}

impl fmt::Debug for Log {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str("Log")
    }
}

/// Logs one event of a kind per interval and counts the others, so that a flood of rejections does not flood the log.
pub(crate) struct Seldom {
    log: Log,
    every: Duration,
    kinds: Mutex<HashMap<Kind, Said>>,
}

/// The event and its kind, both from fixed sets, so that there are few.
type Kind = (&'static str, &'static str);

#[derive(Default)]
struct Said {
    at: Option<Duration>,
    unsaid: u64,
}

impl Seldom {
    pub(crate) fn new(log: Log, every: Duration) -> Self {
        Self {
            log,
            every,
            kinds: Mutex::default(),
        }
    }

    /// Logs the event unless one of its kind was logged within the interval.
    pub(crate) fn say(&self, kind: &'static str, now: Duration, mut event: LogEvent) {
        let mut kinds = lock(&self.kinds);
        let said = kinds.entry((event.event, kind)).or_default();
        if said
            .at
            .is_some_and(|at| now.saturating_sub(at) < self.every)
        {
            said.unsaid += 1;
            return;
        }
        event.unsaid = std::mem::take(&mut said.unsaid);
        said.at = Some(now);
        drop(kinds);
        self.log.say(&event);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_flood_of_one_kind_is_one_line_and_a_count_and_hides_no_other() {
        let lines = Arc::new(Mutex::new(Vec::new()));
        let sink = Arc::clone(&lines);
        let log = Log::new(move |event| sink.lock().unwrap().push(event.to_string()));
        let seldom = Seldom::new(log, Duration::from_secs(1));
        let refuse = |code, ms| {
            let event = LogEvent::new(Level::Warning, "refused").with("code", code);
            seldom.say(code, Duration::from_millis(ms), event);
        };
        for ms in 0..1000 {
            refuse("a", ms);
        }
        refuse("b", 999);
        refuse("a", 1000);
        assert_eq!(
            *lines.lock().unwrap(),
            [
                "warning: refused code=a",
                "warning: refused code=b",
                "warning: refused code=a (and 999 more)"
            ]
        );
    }
}
