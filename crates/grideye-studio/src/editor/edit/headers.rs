//! The tables of a text in order, and the text above each.

use super::change::Step;
use toml_edit::{DocumentMut, Item, Table};

/// A table with its own header.
pub(super) struct Header {
    pub(super) path: Vec<Step>,
    pub(super) position: isize,
}

pub(super) fn headers(document: &DocumentMut) -> Vec<Header> {
    let mut found = Vec::new();
    below(document.as_table(), &mut Vec::new(), &mut found);
    found.sort_by_key(|header| header.position);
    found
}

fn below(table: &Table, path: &mut Vec<Step>, found: &mut Vec<Header>) {
    for (key, item) in table {
        path.push(Step::Key(key.to_owned()));
        match item {
            Item::Table(table) => one(table, path, found),
            Item::ArrayOfTables(list) => {
                for (index, table) in list.iter().enumerate() {
                    path.push(Step::Index(index));
                    one(table, path, found);
                    path.pop();
                }
            }
            Item::None | Item::Value(_) => {}
        }
        path.pop();
    }
}

fn one(table: &Table, path: &mut Vec<Step>, found: &mut Vec<Header>) {
    let is_written = !table.is_implicit() && !table.is_dotted();
    if let Some(position) = table.position().filter(|_| is_written) {
        let path = path.clone();
        found.push(Header { path, position });
    }
    below(table, path, found);
}

pub(super) fn table_at<'a>(document: &'a mut DocumentMut, path: &[Step]) -> Option<&'a mut Table> {
    path.chunk_by(|_, step| matches!(step, Step::Index(_)))
        .try_fold(document.as_table_mut(), |table, steps| match steps {
            [Step::Key(key)] => table.get_mut(key)?.as_table_mut(),
            [Step::Key(key), Step::Index(index)] => table
                .get_mut(key)?
                .as_array_of_tables_mut()?
                .get_mut(*index),
            _ => None,
        })
}

/// The text above a header since the last value; for `None`, at the end.
pub(super) fn lead(document: &mut DocumentMut, header: Option<&Header>) -> String {
    let lead = match header {
        Some(header) => {
            table_at(document, &header.path).and_then(|table| table.decor().prefix().cloned())
        }
        None => Some(document.trailing().clone()),
    };
    lead.and_then(|lead| lead.as_str().map(str::to_owned))
        .unwrap_or_default()
}

/// Replaces that text.
pub(super) fn set_lead(document: &mut DocumentMut, header: Option<&Header>, lead: &str) {
    match header {
        None => document.set_trailing(lead),
        Some(header) => {
            if let Some(table) = table_at(document, &header.path) {
                table.decor_mut().set_prefix(lead);
            }
        }
    }
}
