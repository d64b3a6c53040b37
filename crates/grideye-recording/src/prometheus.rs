//! Prometheus text format 0.0.4, for the counts of both programs.

use std::fmt::{Display, Write as _};

/// The media type of the format.
pub const CONTENT_TYPE: &str = "text/plain; version=0.0.4; charset=utf-8";

/// A page of metrics being written.
#[derive(Debug, Default)]
pub struct Text {
    text: String,
    family: &'static str,
}

impl Text {
    /// An empty page.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// Begins a family of values that go up and down.
    pub fn gauge(&mut self, family: &'static str, help: &str) {
        self.begin(family, help, "gauge");
    }

    /// Begins a family of counts that only grow.
    pub fn counter(&mut self, family: &'static str, help: &str) {
        self.begin(family, help, "counter");
    }

    /// A complete histogram. `counts` has one more entry than `ends`: the values above the last end.
    pub fn histogram(
        &mut self,
        family: &'static str,
        help: &str,
        ends: &[f64],
        counts: &[u64],
        sum: f64,
    ) {
        self.begin(family, help, "histogram");
        let mut below = 0;
        let ends = ends.iter().map(ToString::to_string);
        for (end, count) in ends.chain(["+Inf".to_owned()]).zip(counts) {
            below += count;
            self.line("_bucket", &[("le", &end)], below);
        }
        self.line("_sum", &[], sum);
        self.line("_count", &[], below);
    }

    /// Adds a sample to the current family.
    pub fn sample(&mut self, labels: &[(&str, &str)], value: impl Display) {
        self.line("", labels, value);
    }

    /// The page.
    #[must_use]
    pub fn into_string(self) -> String {
        self.text
    }

    fn begin(&mut self, family: &'static str, help: &str, kind: &str) {
        self.family = family;
        self.write(format_args!(
            "# HELP {family} {help}\n# TYPE {family} {kind}\n"
        ));
    }

    fn line(&mut self, suffix: &str, labels: &[(&str, &str)], value: impl Display) {
        let family = self.family;
        self.write(format_args!("{family}{suffix}"));
        for (index, (name, value)) in labels.iter().enumerate() {
            let before = if index == 0 { '{' } else { ',' };
            let value = escaped(value);
            self.write(format_args!("{before}{name}=\"{value}\""));
        }
        let after = if labels.is_empty() { "" } else { "}" };
        self.write(format_args!("{after} {value}\n"));
    }

    fn write(&mut self, what: std::fmt::Arguments<'_>) {
        // Writing to a string cannot fail.
        let _ = self.text.write_fmt(what);
    }
}

fn escaped(value: &str) -> String {
    value
        .replace('\\', "\\\\")
        .replace('"', "\\\"")
        .replace('\n', "\\n")
}
