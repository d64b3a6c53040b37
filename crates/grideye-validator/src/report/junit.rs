//! The verdict as JUnit XML for continuous integration.

use crate::compare::Comparison;
use crate::report::text::Context;
use crate::verdict::{Criterion, State, Verdict};
use grideye_draw::text::escape;
use std::fmt::Write;

/// One test case per criterion and one for the verdict: failure, error (cannot tell) or skipped (not asked); times are 0.
#[must_use]
pub fn junit(comparison: &Comparison, context: &Context) -> String {
    let class = text(&format!("grideye.compare.{}", context.sensor));
    let judgment = &comparison.judgment;
    let mut cases: Vec<Case> = judgment.criteria.iter().map(Case::of).collect();
    cases.insert(0, Case::verdict(comparison));
    let number = |state| cases.iter().filter(|case| case.state == state).count();
    let counts = format!(
        "tests=\"{}\" failures=\"{}\" errors=\"{}\" skipped=\"{}\" time=\"0\"",
        cases.len(),
        number(State::Failed),
        number(State::Open),
        number(State::NotAsked)
    );
    let body: String = cases.iter().map(|case| case.xml(&class)).collect();
    format!(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuites name=\"grideye compare\" {counts}>\n\
         <testsuite name=\"{}\" {}>\n{}{body}</testsuite>\n</testsuites>\n",
        text(&format!("{} beside {}", context.recording, context.scene)),
        counts,
        properties(comparison, context),
    )
}

struct Case {
    name: String,
    state: State,
    message: String,
    details: String,
}

impl Case {
    fn of(criterion: &Criterion) -> Self {
        Self {
            name: criterion.name.to_owned(),
            state: criterion.state,
            message: format!("{}: {}", criterion.title, criterion.sentence),
            details: format!("{} {}", criterion.sentence, criterion.next_step)
                .trim_end()
                .to_owned(),
        }
    }

    fn verdict(comparison: &Comparison) -> Self {
        let judgment = &comparison.judgment;
        Self {
            name: "verdict".to_owned(),
            state: match judgment.verdict {
                Verdict::Agrees => State::Met,
                Verdict::Disagrees => State::Failed,
                Verdict::CannotTell => State::Open,
            },
            message: judgment.headline.clone(),
            details: judgment.to_string(),
        }
    }

    fn xml(&self, class: &str) -> String {
        let (message, details) = (text(&self.message), text(&self.details));
        let inside = match self.state {
            State::Met => format!("<system-out>{details}</system-out>"),
            State::Failed => {
                format!("<failure message=\"{message}\" type=\"disagrees\">{details}</failure>")
            }
            State::Open => {
                format!("<error message=\"{message}\" type=\"cannot tell\">{details}</error>")
            }
            State::NotAsked => format!("<skipped message=\"{message}\"/>"),
        };
        format!(
            "<testcase classname=\"{class}\" name=\"{}\" time=\"0\">{inside}</testcase>\n",
            self.name
        )
    }
}

fn properties(comparison: &Comparison, context: &Context) -> String {
    let mut properties = String::from("<properties>\n");
    let mut add = |name: &str, value: &str| {
        // Writing into a string does not fail.
        let _ = writeln!(
            properties,
            "<property name=\"{}\" value=\"{}\"/>",
            text(name),
            text(value)
        );
    };
    add("verdict", comparison.judgment.verdict.name());
    add("command", &context.command);
    add("program", &context.program);
    for (name, seed) in &context.seeds {
        add(&format!("seed, {name}"), &seed.to_string());
    }
    for input in &context.inputs {
        add(&input.name, &input.hash);
    }
    for line in &context.thresholds {
        let value = format!("{} ({}: {})", line.value, line.file, line.source);
        add(&format!("threshold, {}", line.key), &value);
    }
    properties.push_str("</properties>\n");
    properties
}

/// Escaped text in which a character that XML 1.0 lacks becomes U+FFFD.
fn text(text: &str) -> String {
    let is_char = |character: &char| matches!(character, '\t' | '\n' | '\r' | ' '..='\u{FFFD}' | '\u{10000}'..);
    let allowed: String = text
        .chars()
        .map(|character| Some(character).filter(is_char).unwrap_or('\u{FFFD}'))
        .collect();
    escape(&allowed)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_xml_has_no_character_for_is_replaced() {
        let replaced = text("a\u{0}b\u{1b}c\td<&\"");
        assert_eq!(replaced, "a\u{FFFD}b\u{FFFD}c\td&lt;&amp;&quot;");
        assert_eq!(text("\u{FFFE}°C 👍"), "\u{FFFD}°C 👍");
    }
}
