//! What the collector has to say while it runs: events with fields, handed to whoever started it.

use crate::lock::lock;
use serde_json::{Map, Value};
use std::collections::HashMap;
use std::fmt;
use std::sync::{Arc, Mutex};
use std::time::Duration;

/// How much an event matters.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Level {
    /// The course of things.
    Info,
    /// Somebody was refused, or something is near its limit.
    Warning,
    /// Frames cannot be kept, or the collector itself is at fault.
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

/// Something that happened. Holds no token, no cookie and nothing else that a request said without being asked for it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LogEvent {
    /// How much it matters.
    pub level: Level,
    /// What happened, in one or two words joined by `_`; one of a fixed set.
    pub event: &'static str,
    /// More of it, in a fixed order.
    pub fields: Vec<(&'static str, String)>,
    /// The same happened so often since it was last said.
    pub unsaid: u64,
}

impl LogEvent {
    /// Without fields yet.
    #[must_use]
    pub fn new(level: Level, event: &'static str) -> Self {
        Self {
            level,
            event,
            fields: Vec::new(),
            unsaid: 0,
        }
    }

    /// With one more field.
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

/// `warning: refused code=bad_token peer=192.168.1.7 (and 12 more)`, with values that would confuse in quotation marks.
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

/// Where events go. Called from every thread.
#[derive(Clone)]
pub struct Log(Arc<dyn Fn(&LogEvent) + Send + Sync>);

impl Log {
    /// Hands each event to a function.
    pub fn new(sink: impl Fn(&LogEvent) + Send + Sync + 'static) -> Self {
        Self(Arc::new(sink))
    }

    /// Drops every event.
    #[must_use]
    pub fn silent() -> Self {
        Self::new(|_| ())
    }

    /// Hands the event on.
    pub fn say(&self, event: &LogEvent) {
        (self.0)(event);
    }
}

impl fmt::Debug for Log {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str("Log")
    }
}

/// Says one event of a kind in a while, and counts the others: a flood of refusals must not become a flood of lines.
pub(crate) struct Seldom {
    log: Log,
    every: Duration,
    kinds: Mutex<HashMap<Kind, Said>>,
}

/// The event and what tells its kinds apart; both from fixed sets, so that there are few.
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

    /// Says the event unless one of its kind was said a short while ago.
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
