//! What an edit is: what it does, and where.

use crate::editor::fault::Fault;
use serde::Deserialize;
use serde_json::Value;

/// Edits of one request.
pub(crate) const EDITS_MAX: usize = 64;
/// Steps of a path, such as the four of `agent 0 part 1 size_mm`.
const STEPS_MAX: usize = 6;

/// One edit of the scene's own text.
#[derive(Debug, Clone, Deserialize)]
#[serde(tag = "does", rename_all = "kebab-case", deny_unknown_fields)]
pub(crate) enum Edit {
    /// Gives a key a value, whether or not it has one.
    Set {
        path: Vec<Step>,
        /// A number, a text, a truth, or a list of these.
        to: Value,
    },
    /// Takes a key away, so that its default holds.
    Unset { path: Vec<Step> },
    /// Writes a new table behind the others of its kind.
    Add {
        kind: Kind,
        name: String,
        at_mm: [f64; 3],
    },
    /// Writes a table once more, under another name, behind the others of its kind.
    Copy {
        /// The table, as `object 2`.
        path: Vec<Step>,
        name: String,
    },
    /// Takes a table away, with the remarks that are its own.
    Remove { path: Vec<Step> },
}

/// A key, or a place in a list.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
#[serde(untagged)]
pub(crate) enum Step {
    /// Counted from 0.
    Index(usize),
    /// As the file spells it.
    Key(String),
}

/// What can be added.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum Kind {
    /// A box.
    Object,
    /// A person who stands.
    Agent,
    /// A Grid-EYE that looks straight down.
    Sensor,
}

pub(super) fn check_path(path: &[Step]) -> Result<(), Fault> {
    if path.is_empty() || path.len() > STEPS_MAX {
        let what = format!("a path of {} steps, expected 1 to {STEPS_MAX}", path.len());
        return Err(Fault::unfit(&what));
    }
    Ok(())
}

pub(super) fn nothing_at(path: &[Step]) -> Fault {
    Fault::unfit(&format!("the scene has no {}", said(path)))
}

/// As a person would say it: `sensor 0 position_mm`.
pub(super) fn said(path: &[Step]) -> String {
    let steps = path.iter().map(|step| match step {
        Step::Index(index) => index.to_string(),
        Step::Key(key) => key.clone(),
    });
    steps.collect::<Vec<_>>().join(" ")
}
