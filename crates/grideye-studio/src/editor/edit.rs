//! Edits of a scene's text: each replaces, inserts or deletes the characters of one value, key or table, where `toml_edit`
//! says they are. Every other character stays.
//!
//! | module | holds |
//! |---|---|
//! | `change` | the kinds of edits |
//! | `layout` | where tables, values and the comments between them are |
//! | `keys`, `tables` | the edits |

mod change;
mod keys;
mod layout;
mod tables;

pub(super) use change::{EDITS_MAX, Edit};

use super::fault::Fault;
use layout::Layout;
use toml_edit::Document;

/// The text after one edit.
///
/// # Errors
/// If there is nothing at the path, or the layout of the text would make the edit change more.
pub(super) fn edited(text: &str, edit: &Edit) -> Result<String, Fault> {
    let document = Document::parse(text).map_err(|error| Fault::of_toml(text, &error))?;
    let layout = Layout::of(text, &document);
    let mut splices = match edit {
        Edit::Set { path, to } => keys::set(&layout, path, to),
        Edit::Unset { path } => keys::unset(&layout, path),
        Edit::Add { kind, name, at_mm } => tables::add(&layout, *kind, name, *at_mm),
        Edit::Copy { path, name } => tables::copy(&layout, path, name),
        Edit::Remove { path } => tables::remove(&layout, path),
    }?;
    splices.sort_by_key(|(range, _)| range.start);
    let mut made = text.to_owned();
    for (range, new) in splices.into_iter().rev() {
        made.replace_range(range, &new);
    }
    Ok(made)
}

#[cfg(test)]
mod tests;
