//! Whole tables: objects, people and sensors that come, go or come again.

use super::layout::{Block, behind_empty_lines, block, newline};
use super::set::{value_at, written};
use super::{Kind, Step, check_path, said};
use crate::editor::fault::Fault;
use serde_json::json;
use toml::de::DeTable;

/// The text with a new table behind the others of its kind, or at its end.
pub(super) fn add(
    text: &str,
    document: &DeTable<'_>,
    kind: Kind,
    name: &str,
    at_mm: [f64; 3],
) -> String {
    let (key, rest) = template(kind);
    let number = |length: f64| written(&json!(length.round())).unwrap_or_default();
    let name = written(&json!(name)).unwrap_or_default();
    let at_mm = at_mm.map(|length| number(length).trim_end_matches(".0").to_owned());
    let table = format!(
        "[[{key}]]\nname = {name}\nposition_mm = [{}]\n{rest}",
        at_mm.join(", ")
    );
    inserted(text, document, key, &table.replace('\n', newline(text)))
}

/// The table's key, and its lines but for name and place.
fn template(kind: Kind) -> (&'static str, &'static str) {
    match kind {
        Kind::Object => ("object", "size_mm = [600, 400, 500]\n"),
        Kind::Agent => ("agent", "size_mm = [200, 500, 1750]\ntemperature_c = 28\n"),
        Kind::Sensor => (
            "sensor",
            "preset = \"grid-eye\"\nelevation_deg = 90\nazimuth_deg = -90\n",
        ),
    }
}

/// The text with a table once more, under another name.
pub(super) fn copy(
    text: &str,
    document: &DeTable<'_>,
    path: &[Step],
    name: &str,
) -> Result<String, Fault> {
    let (key, block) = table_at(text, document, path)?;
    let named: Vec<Step> = path
        .iter()
        .cloned()
        .chain([Step::Key("name".to_owned())])
        .collect();
    let known = value_at(document, &named).map(toml::Spanned::span);
    let known = known.filter(|span| block.bare.start <= span.start && span.end <= block.bare.end);
    let (Some(known), Some(bare)) = (known, text.get(block.bare.clone())) else {
        return Err(Fault::unfit(&format!("{} has no name", said(path))));
    };
    let mut table = bare.to_owned();
    let within = known.start - block.bare.start..known.end - block.bare.start;
    table.replace_range(within, &written(&json!(name))?);
    if !table.ends_with('\n') {
        table.push_str(newline(text));
    }
    Ok(inserted(text, document, key, &table))
}

/// The text without a table and the remarks that are its own.
pub(super) fn remove(text: &str, document: &DeTable<'_>, path: &[Step]) -> Result<String, Fault> {
    let (_, Block { whole, .. }) = table_at(text, document, path)?;
    let mut made = text.to_owned();
    made.replace_range(whole.start..behind_empty_lines(text, whole.end), "");
    // What was the last table leaves the empty line behind that divided it from the one before.
    if whole.start == made.len() {
        let kept = made.trim_end().len();
        made.truncate(kept);
        made.push_str(newline(text));
    }
    Ok(made)
}

fn table_at<'p>(
    text: &str,
    document: &DeTable<'_>,
    path: &'p [Step],
) -> Result<(&'p str, Block), Fault> {
    check_path(path)?;
    let [Step::Key(key), Step::Index(_)] = path else {
        return Err(Fault::unfit(&format!(
            "{} is no table of a list",
            said(path)
        )));
    };
    let table = value_at(document, path)
        .ok_or_else(|| Fault::unfit(&format!("the scene has no {}", said(path))))?;
    let block = block(text, document, table).ok_or_else(|| {
        Fault::unfit(&format!(
            "{} is not written in one piece under [[{key}]]; change it in the text",
            said(path)
        ))
    })?;
    Ok((key, block))
}

/// The text with lines behind the last table of a kind, divided from it by an empty line.
fn inserted(text: &str, document: &DeTable<'_>, key: &str, table: &str) -> String {
    let tables = document.get(key).and_then(|list| list.get_ref().as_array());
    let last = tables.and_then(|list| list.iter().last());
    let block = last.and_then(|last| block(text, document, last));
    let at = block.map_or(text.len(), |block| block.whole.end);
    let (before, behind) = text.split_at(at);
    let end = newline(text);
    let open = if before.is_empty() || before.ends_with('\n') {
        ""
    } else {
        end
    };
    let divided = if before.is_empty() { "" } else { end };
    let follows = if behind.is_empty() || behind.starts_with(['\n', '\r']) {
        ""
    } else {
        end
    };
    format!("{before}{open}{divided}{table}{follows}{behind}")
}
