//! The kinds of edits and their paths.

use crate::editor::fault::Fault;
use serde::Deserialize;
use serde_json::Value;

pub(crate) const EDITS_MAX: usize = 64;
/// Maximum steps of a path, such as the four of `agent 0 part 1 size_mm`.
const STEPS_MAX: usize = 6;

/// One edit of the scene's own text.
#[derive(Debug, Clone, Deserialize)]
#[serde(tag = "does", rename_all = "kebab-case", deny_unknown_fields)]
pub(crate) enum Edit {
    /// Sets a key to a value, whether or not it exists.
    Set {
        path: Vec<Step>,
        /// A number, a text, a Boolean, or a list of these.
        to: Value,
    },
    /// Deletes a key, so that its default applies.
    Unset { path: Vec<Step> },
    /// Adds a table after the others of its kind.
    Add {
        kind: Kind,
        name: String,
        at_mm: [f64; 3],
    },
    /// Copies a table under another name, after the others of its kind.
    Copy {
        /// The table, such as `object 2`.
        path: Vec<Step>,
        name: String,
    },
    /// Deletes a table with its own comments.
    Remove { path: Vec<Step> },
}

/// A key, or an index in a list.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
#[serde(untagged)]
pub(crate) enum Step {
    /// From 0.
    Index(usize),
    /// As spelled in the file.
    Key(String),
}

/// The kinds of tables that can be added.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum Kind {
    /// A box.
    Object,
    /// A standing person.
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

/// In words: `sensor 0 position_mm`.
pub(super) fn said(path: &[Step]) -> String {
    let steps = path.iter().map(|step| match step {
        Step::Index(index) => index.to_string(),
        Step::Key(key) => key.clone(),
    });
    steps.collect::<Vec<_>>().join(" ")
}
