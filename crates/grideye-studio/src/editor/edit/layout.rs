//! Where the tables and values of a text are, and which comments between two tables belong to which.

use super::change::Step;
use std::ops::Range;
use toml_edit::{Document, Item, Table};

/// A part of the text, and what takes its place.
pub(super) type Splice = (Range<usize>, String);

pub(super) struct Layout<'a> {
    pub(super) text: &'a str,
    root: &'a Item,
    /// The tables with a header of their own, in the order of the text.
    pub(super) headers: Vec<Header>,
    /// `\n`, or `\r\n` if the text has it anywhere.
    pub(super) newline: &'static str,
}

/// A table with its own header.
pub(super) struct Header {
    pub(super) path: Vec<Step>,
    /// From the start of its header's line to the end of the line of its last value.
    pub(super) lines: Range<usize>,
}

impl<'a> Layout<'a> {
    pub(super) fn of(text: &'a str, document: &'a Document<&str>) -> Self {
        let newline = if text.contains("\r\n") { "\r\n" } else { "\n" };
        let mut layout = Self {
            text,
            root: document.as_item(),
            headers: Vec::new(),
            newline,
        };
        let mut headers = Vec::new();
        layout.below(document.as_table(), &mut Vec::new(), &mut headers);
        headers.sort_by_key(|header| header.lines.start);
        layout.headers = headers;
        layout
    }

    fn below(&self, table: &Table, path: &mut Vec<Step>, found: &mut Vec<Header>) {
        for (key, item) in table {
            path.push(Step::Key(key.to_owned()));
            match item {
                Item::Table(table) => self.header(table, path, found),
                Item::ArrayOfTables(list) => {
                    for (index, table) in list.iter().enumerate() {
                        path.push(Step::Index(index));
                        self.header(table, path, found);
                        path.pop();
                    }
                }
                Item::None | Item::Value(_) => {}
            }
            path.pop();
        }
    }

    fn header(&self, table: &Table, path: &mut Vec<Step>, found: &mut Vec<Header>) {
        if let Some(span) = table.span().filter(|_| has_header(table)) {
            found.push(Header {
                path: path.clone(),
                lines: self.line_start(span.start)..self.end_of(table),
            });
        }
        self.below(table, path, found);
    }

    pub(super) fn at(&self, path: &[Step]) -> Option<&'a Item> {
        path.iter().try_fold(self.root, |item, step| match step {
            Step::Index(index) => item.get(index),
            Step::Key(key) => item.get(key),
        })
    }

    /// The end of the line of a table's last value, or of its header.
    pub(super) fn end_of(&self, table: &Table) -> usize {
        let values = table.get_values().into_iter();
        let ends = values.filter_map(|(_, value)| Some(value.span()?.end));
        // The span of the root is empty.
        let header = table
            .span()
            .filter(|span| has_header(table) && !span.is_empty());
        let last = ends.chain(header.map(|span| span.end)).max();
        last.map_or(0, |last| self.line_end(last))
    }

    /// The text between the table before a header, or before the end, and that header.
    pub(super) fn between(&self, header: usize) -> Range<usize> {
        let before = match header.checked_sub(1) {
            Some(before) => self.headers[before].lines.end,
            None => self.root.as_table().map_or(0, |root| self.end_of(root)),
        };
        let next = self.headers.get(header);
        before..next.map_or(self.text.len(), |next| next.lines.start)
    }

    /// The first part of [`between`](Self::between), which belongs to the table above: the comments directly below its last
    /// value, if an empty line or the end of the text follows.
    pub(super) fn remarks_below(&self, header: usize) -> Range<usize> {
        let Range { start, end } = self.between(header);
        let mut below = start;
        for line in self.part(start..end).split_inclusive('\n') {
            if line.trim().is_empty() {
                return start..below;
            }
            below += line.len();
        }
        let is_end = header == self.headers.len();
        start..if is_end { below } else { start }
    }

    /// Where the comments of a table begin: those directly above its header, if an empty line separates them from the text
    /// before. Comments at the start of the file are about the whole file, and those directly below a value may be about
    /// that value.
    pub(super) fn remarks_above(&self, header: usize) -> usize {
        let between = self.between(header);
        let mut start = between.end;
        for line in self.part(between.clone()).split_inclusive('\n').rev() {
            if line.trim().is_empty() {
                return start;
            }
            start -= line.len();
        }
        between.end
    }

    pub(super) fn part(&self, range: Range<usize>) -> &'a str {
        self.text.get(range).unwrap_or_default()
    }

    pub(super) fn line_start(&self, at: usize) -> usize {
        self.part(0..at).rfind('\n').map_or(0, |end| end + 1)
    }

    /// Behind the line's newline.
    pub(super) fn line_end(&self, at: usize) -> usize {
        let rest = self.part(at..self.text.len());
        rest.find('\n').map_or(self.text.len(), |end| at + end + 1)
    }

    /// Puts whole lines, each ending in `\n`, where a line begins or at the end of the text.
    pub(super) fn insert(&self, at: usize, lines: &str) -> Splice {
        let is_open = at > 0 && !self.part(0..at).ends_with('\n');
        let lines = format!("{}{lines}", if is_open { "\n" } else { "" });
        (at..at, lines.replace('\n', self.newline))
    }
}

/// Whether a table is neither implied by others nor made of dotted keys.
fn has_header(table: &Table) -> bool {
    !table.is_implicit() && !table.is_dotted()
}
