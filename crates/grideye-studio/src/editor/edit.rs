//! Edits of a scene's text: each changes one value, key or table and preserves everything else, including comments and
//! layout.
//!
//! | module | holds |
//! |---|---|
//! | `change` | the kinds of edits |
//! | `remarks` | which table owns a comment between two tables |
//! | `headers` | the tables of a text in order, and the text above each |
//! | `keys`, `tables` | the edits |

mod change;
mod headers;
mod keys;
mod remarks;
mod tables;

pub(super) use change::{EDITS_MAX, Edit};

use super::fault::Fault;
use toml_edit::{Document, DocumentMut};

/// The text after one edit.
///
/// # Errors
/// If there is nothing at the path, or the layout of the text would make the edit change more.
pub(super) fn edited(text: &str, edit: &Edit) -> Result<String, Fault> {
    let document = Document::parse(text).map_err(|error| Fault::of_toml(text, &error))?;
    let mut document = document.into_mut();
    if written(text, &document).trim_end() != text.trim_end() {
        return Err(Fault::unfit(
            "the layout of the scene file does not allow edits here",
        ));
    }
    match edit {
        Edit::Set { path, to } => keys::set(&mut document, path, to),
        Edit::Unset { path } => keys::unset(&mut document, path),
        Edit::Add { kind, name, at_mm } => tables::add(&mut document, *kind, name, *at_mm),
        Edit::Copy { path, name } => tables::copy(&mut document, path, name),
        Edit::Remove { path } => tables::remove(&mut document, path),
    }?;
    Ok(written(text, &document))
}

/// The document with the line endings of the text.
fn written(text: &str, document: &DocumentMut) -> String {
    let made = document.to_string();
    if text.contains("\r\n") {
        return made.replace('\n', "\r\n");
    }
    made
}

#[cfg(test)]
mod tests;
