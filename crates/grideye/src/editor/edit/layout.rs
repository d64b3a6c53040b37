//! Lines of a text, where its tables begin and end, and which remarks are whose.

use std::ops::Range;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// Where a table that was written with a header lies in the text, in whole lines.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Block {
    /// From the remarks directly above the header to behind those directly below the last value.
    pub(super) whole: Range<usize>,
    /// From the header to behind the last value.
    pub(super) bare: Range<usize>,
}

/// The block of one of the document's tables; `None` if it has no header, or if tables of others stand within it.
pub(super) fn block(
    text: &str,
    document: &DeTable<'_>,
    table: &Spanned<DeValue<'_>>,
) -> Option<Block> {
    let mut own = Vec::new();
    headers(text, table, &mut own);
    let mut all = Vec::new();
    for value in document.values() {
        headers(text, value, &mut all);
    }
    all.sort_unstable();
    let header = line_start(text, *own.first()?);
    let is_foreign = |at: &&usize| **at > header && !own.contains(at);
    let next = all
        .iter()
        .find(is_foreign)
        .map_or(text.len(), |at| line_start(text, *at));
    let is_torn = own.iter().any(|at| *at >= next);
    let end = line_end(text, last_byte(text, table).max(header));
    (!is_torn).then(|| Block {
        whole: remarks_above(text, header)..remarks_below(text, end),
        bare: header..end,
    })
}

/// The bytes at which headers of tables begin, this value's own and those of what is in it.
fn headers(text: &str, value: &Spanned<DeValue<'_>>, found: &mut Vec<usize>) {
    match value.get_ref() {
        DeValue::Table(table) => {
            let at = value.span().start;
            if is_header(text, at) {
                found.push(at);
            }
            for inner in table.values() {
                headers(text, inner, found);
            }
        }
        DeValue::Array(list) => {
            for inner in list.iter() {
                headers(text, inner, found);
            }
        }
        _ => {}
    }
}

/// Whether a table was written with a header of its own, and not within braces or by dots.
pub(super) fn is_header(text: &str, at: usize) -> bool {
    let before = text.get(line_start(text, at)..at).unwrap_or("x");
    before.trim().is_empty() && text.get(at..).is_some_and(|rest| rest.starts_with('['))
}

/// Behind the last byte of a table's header and values, those of the tables in it included.
fn last_byte(text: &str, value: &Spanned<DeValue<'_>>) -> usize {
    let inner = match value.get_ref() {
        DeValue::Table(table) => table.values().map(|inner| last_byte(text, inner)).max(),
        // A list of tables may span whatever stands between them.
        DeValue::Array(list) if list.iter().any(|one| is_header(text, one.span().start)) => {
            return list
                .iter()
                .map(|one| last_byte(text, one))
                .max()
                .unwrap_or(0);
        }
        _ => None,
    };
    let own = match value.get_ref() {
        DeValue::Table(_) if is_header(text, value.span().start) => {
            line_end(text, value.span().start).saturating_sub(1)
        }
        _ => value.span().end,
    };
    inner.unwrap_or(0).max(own)
}

/// The byte at which the line of this byte begins.
pub(super) fn line_start(text: &str, at: usize) -> usize {
    text.get(..at)
        .and_then(|before| before.rfind('\n'))
        .map_or(0, |end| end + 1)
}

/// The byte behind the line of this byte and its end.
pub(super) fn line_end(text: &str, at: usize) -> usize {
    let rest = text.get(at..).unwrap_or_default();
    rest.find('\n').map_or(text.len(), |end| at + end + 1)
}

/// What ends the text's lines.
pub(super) fn newline(text: &str) -> &'static str {
    if text.contains("\r\n") { "\r\n" } else { "\n" }
}

fn is_remark(line: &str) -> bool {
    line.trim_start().starts_with('#')
}

/// The start of the remarks directly above a line, if an empty line divides them from what is before. Those that begin
/// the file speak of all of it, and those directly below a value may speak of that.
fn remarks_above(text: &str, at: usize) -> usize {
    let mut start = at;
    while start > 0 {
        let above = line_start(text, start - 1);
        let line = text.get(above..start).unwrap_or_default();
        if line.trim().is_empty() {
            return start;
        }
        if !is_remark(line) {
            return at;
        }
        start = above;
    }
    at
}

/// The end of the remarks directly below a line, if an empty line or the text's end divides them from what comes.
fn remarks_below(text: &str, at: usize) -> usize {
    let mut end = at;
    while end < text.len() {
        let below = line_end(text, end);
        let line = text.get(end..below).unwrap_or_default();
        if line.trim().is_empty() {
            return end;
        }
        if !is_remark(line) {
            return at;
        }
        end = below;
    }
    end
}

/// Behind the empty lines that begin here.
pub(super) fn behind_empty_lines(text: &str, at: usize) -> usize {
    let mut end = at;
    while end < text.len() {
        let below = line_end(text, end);
        if !text.get(end..below).unwrap_or("x").trim().is_empty() {
            break;
        }
        end = below;
    }
    end
}
