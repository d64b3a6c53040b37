//! Edits of a scene's text: each replaces, adds or takes away a few characters and leaves all others, remarks and layout
//! among them, as somebody wrote them.

mod layout;
mod set;
mod tables;

use super::fault::Fault;
use serde::Deserialize;
use serde_json::Value;
use toml::de::DeTable;

/// Edits of one request.
pub(super) const EDITS_MAX: usize = 64;
/// Steps of a path, such as the four of `agent 0 part 1 size_mm`.
const STEPS_MAX: usize = 6;

/// One edit of the scene's own text.
#[derive(Debug, Clone, Deserialize)]
#[serde(tag = "does", rename_all = "kebab-case", deny_unknown_fields)]
pub(super) enum Edit {
    /// Gives a key a value, whether or not it has one.
    Set {
        /// Where it is.
        path: Vec<Step>,
        /// A number, a text, a truth, or a list of these.
        to: Value,
    },
    /// Takes a key away, so that its default holds.
    Unset {
        /// Where it is.
        path: Vec<Step>,
    },
    /// Writes a new table behind the others of its kind.
    Add {
        /// What it is.
        kind: Kind,
        /// Its name.
        name: String,
        /// Where it is, millimetres.
        at_mm: [f64; 3],
    },
    /// Writes a table once more, under another name, behind the others of its kind.
    Copy {
        /// The table, as `object 2`.
        path: Vec<Step>,
        /// The copy's name.
        name: String,
    },
    /// Takes a table away, with the remarks that are its own.
    Remove {
        /// The table.
        path: Vec<Step>,
    },
}

/// A key, or a place in a list.
#[derive(Debug, Clone, Deserialize)]
#[serde(untagged)]
pub(super) enum Step {
    /// Counted from 0.
    Index(usize),
    /// As the file spells it.
    Key(String),
}

/// What can be added.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(super) enum Kind {
    /// A box.
    Object,
    /// A person who stands.
    Agent,
    /// A Grid-EYE that looks straight down.
    Sensor,
}

/// The text with one edit made.
///
/// # Errors
/// When there is nothing at the path, or the text is laid out so that the edit would do something else.
pub(super) fn edited(text: &str, edit: &Edit) -> Result<String, Fault> {
    let document = DeTable::parse(text).map_err(|error| Fault::of_toml(text, &error))?;
    let document = document.get_ref();
    let made = match edit {
        Edit::Set { path, to } => set::set(text, document, path, to),
        Edit::Unset { path } => set::unset(text, document, path),
        Edit::Add { kind, name, at_mm } => Ok(tables::add(text, document, *kind, name, *at_mm)),
        Edit::Copy { path, name } => tables::copy(text, document, path, name),
        Edit::Remove { path } => tables::remove(text, document, path),
    }?;
    // Whatever the layout: a text that is no TOML any more is never handed on.
    match DeTable::parse(&made) {
        Ok(_) => Ok(made),
        Err(_broken) => Err(Fault::unfit(
            "the scene's text is laid out so that this cannot be done in it",
        )),
    }
}

fn check_path(path: &[Step]) -> Result<(), Fault> {
    if path.is_empty() || path.len() > STEPS_MAX {
        let what = format!("a path of {} steps, expected 1 to {STEPS_MAX}", path.len());
        return Err(Fault::unfit(&what));
    }
    Ok(())
}

/// As a person would say it: `sensor 0 position_mm`.
fn said(path: &[Step]) -> String {
    let steps = path.iter().map(|step| match step {
        Step::Index(index) => index.to_string(),
        Step::Key(key) => key.clone(),
    });
    steps.collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests;
