//! Finds where a key is, or would go, in a scene's text.

use super::error::Mistake;
use grideye_scene::key::{Table, names};
use std::ops::Range;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// A range of the text that a value replaces, and the text to insert before and after the value.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Edit {
    pub(crate) range: Range<usize>,
    pub(crate) before: String,
    pub(crate) after: String,
}

impl Edit {
    /// Replaces the present value.
    pub(crate) fn in_place(range: Range<usize>) -> Self {
        let (before, after) = (String::new(), String::new());
        Self {
            range,
            before,
            after,
        }
    }
}

/// The keys of a walking agent.
const OF_A_WAY: [&str; 5] = [
    "trajectory",
    "speed_mm_per_s",
    "motion",
    "acceleration_mm_per_s2",
    "faces",
];

/// The place of a key such as `agent.person.temperature_c` in the text.
pub(crate) fn edit(
    text: &str,
    document: &Spanned<DeTable<'_>>,
    path: &str,
) -> Result<Edit, Mistake> {
    match Table::root(text, document.get_ref()).find(path)? {
        (_, _, Some(value)) => Ok(Edit::in_place(value.span())),
        (table, key, None) => addition(&table, key),
    }
}

pub(crate) fn floor(
    text: &str,
    document: &Spanned<DeTable<'_>>,
    agent: &str,
) -> Result<Vec<Edit>, Mistake> {
    let path = format!("agent.{agent}.position_mm");
    let mut edits = vec![edit(text, document, &path)?];
    let (table, ..) = Table::root(text, document.get_ref()).find(&path)?;
    for (key, value) in OF_A_WAY.iter().filter_map(|key| table.entry(key)) {
        if table.is_inline {
            return Err(Mistake::not_addable("position_mm"));
        }
        edits.push(Edit::in_place(key.span().start..value.span().end));
    }
    Ok(edits)
}

pub(crate) fn has(document: &Spanned<DeTable<'_>>, text: &str, path: &str) -> bool {
    edit(text, document, path).is_ok_and(|edit| edit.before.is_empty())
}

pub(crate) fn agents(document: &Spanned<DeTable<'_>>) -> Vec<String> {
    let agents = document.get_ref().get("agent");
    agents.into_iter().flat_map(names).collect()
}

/// Where to add a key that the table lacks: after one that it has.
fn addition(table: &Table<'_, '_>, key: &str) -> Result<Edit, Mistake> {
    if table.is_root {
        return Ok(Edit {
            range: 0..0,
            before: format!("{key} = "),
            after: "\n".to_owned(),
        });
    }
    let is_plain = |value: &DeValue<'_>| match value {
        DeValue::Table(_) => false,
        DeValue::Array(list) => !list.iter().any(|item| item.get_ref().is_table()),
        _ => true,
    };
    let values = table
        .entries
        .values()
        .filter(|value| is_plain(value.get_ref()));
    let Some(end) = values.map(|value| value.span().end).min() else {
        return Err(Mistake::not_addable(key));
    };
    let separator = if table.is_inline { ", " } else { "\n" };
    Ok(Edit {
        before: format!("{separator}{key} = "),
        ..Edit::in_place(end..end)
    })
}

#[derive(Debug, Clone)]
pub(crate) struct Placed {
    pub(crate) asked: String,
    pub(crate) agent: String,
    /// The first is the edit of its position.
    pub(crate) edits: Vec<Edit>,
}

/// The text with values inserted by edits that do not overlap.
pub(crate) fn edited(text: &str, mut edits: Vec<(&Edit, String)>) -> String {
    edits.sort_by_key(|(edit, _)| (edit.range.start, edit.range.end));
    let mut whole = String::with_capacity(text.len() + 32 * edits.len());
    let mut copied = 0;
    for (edit, value) in edits {
        whole.push_str(text.get(copied..edit.range.start).unwrap_or_default());
        whole.push_str(&edit.before);
        whole.push_str(&value);
        whole.push_str(&edit.after);
        copied = edit.range.end;
    }
    whole.push_str(text.get(copied..).unwrap_or_default());
    whole
}
