//! What stands beside a frame, in its line or in lines between frames, and to which frame it belongs.

use super::facts::{Fact, TAG};
use super::layout::{Kind, Layout, Read};
use super::lines::Line;
use crate::cell::{Cell, Field, RawRow};
use crate::columns::Between;
use crate::error::ImportError;
use grideye_frame::ROWS;
use std::collections::{BTreeMap, BTreeSet};

/// Columns of facts; more are none.
const FACTS_MAX: usize = 16;
/// Tags that are told apart.
const TAGS_MAX: usize = 16;

/// A fact of which each frame has one.
#[derive(Debug)]
struct Column {
    name: String,
    /// Whether it stands in lines of its own, behind the frame.
    is_behind: bool,
}

#[derive(Debug)]
pub(super) struct Beside {
    columns: Vec<Column>,
    names: Option<Vec<String>>,
    /// What was said since the last frame.
    pending: Vec<Option<Cell>>,
    /// The last frame, while facts behind it may follow.
    held: Option<RawRow>,
    /// The last line of facts.
    line: u64,
    /// The names in lines of facts.
    lines: Vec<Vec<String>>,
}

impl Beside {
    /// Tells the columns from the first lines.
    pub(super) fn of(
        layout: &Layout,
        head: &[Line],
        said: Option<Between>,
    ) -> Result<Self, ImportError> {
        let lines: Vec<(usize, Read)> = head
            .iter()
            .map(|line| (line.blanks, layout.read(line)))
            .collect();
        let of_kind = |kind| {
            lines
                .iter()
                .filter(move |(_, read)| read.kind == kind)
                .map(|(_, read)| read)
        };
        let index = layout.blocks.as_ref().and_then(|blocks| blocks.index());
        let (frames, per_frame) = match layout.blocks {
            Some(_) => (of_kind(Kind::BlockRow), ROWS),
            None => (of_kind(Kind::Frame), 1),
        };
        let count = frames.clone().count().div_ceil(per_frame);
        let is_new = |name: &str, columns: &[Column]| {
            Some(name) != index && columns.iter().all(|column| column.name != name)
        };
        let mut columns = Vec::new();
        for name in common(frames, count * per_frame) {
            if is_new(&name, &columns) {
                columns.push(Column {
                    name,
                    is_behind: false,
                });
            }
        }
        let between = common_lines(of_kind(Kind::Other), count);
        let is_between =
            |read: &Read| read.kind == Kind::Other && between.contains(&names_of(&read.facts));
        let facts = lines
            .iter()
            .map(|(_, read)| read)
            .filter(|read| is_between(read));
        for name in common(facts, count) {
            if is_new(&name, &columns) {
                let is_fact = |read: &Read| {
                    is_between(read) && read.facts.iter().any(|(found, _)| *found == name)
                };
                let is_behind = match said {
                    Some(said) => said == Between::Behind,
                    None => is_behind(&name, &is_fact, &lines, per_frame)?,
                };
                // What follows a frame alone may belong to one that is cut.
                if count > 1 || !is_behind {
                    columns.push(Column { name, is_behind });
                }
            }
        }
        columns.truncate(FACTS_MAX);
        let of_line = layout.names.clone().filter(|_| layout.blocks.is_none());
        let names = (of_line.is_some() || !columns.is_empty()).then(|| {
            let facts = columns.iter().map(|column| column.name.clone());
            facts.chain(of_line.unwrap_or_default()).collect()
        });
        Ok(Self {
            pending: vec![None; columns.len()],
            columns,
            names,
            held: None,
            line: 0,
            lines: between,
        })
    }

    pub(super) fn names(&self) -> Option<&[String]> {
        self.names.as_deref()
    }

    pub(super) fn knows(&self, facts: &[Fact]) -> bool {
        let is_known = |(name, _): &Fact| self.columns.iter().any(|column| column.name == *name);
        facts.iter().any(is_known) && self.lines.contains(&names_of(facts))
    }

    /// A frame, or one without pixels; gives what is complete.
    pub(super) fn row(
        &mut self,
        number: u64,
        facts: Vec<Fact>,
        frame: Option<Vec<Field>>,
        is_whole: bool,
    ) -> Option<RawRow> {
        for (name, value) in facts {
            if let Some(at) = self
                .columns
                .iter()
                .position(|column| column.name == name && !column.is_behind)
            {
                self.pending[at].get_or_insert(Cell::of_text(&value));
            }
        }
        let is_torn = frame.is_none();
        let beside = self
            .pending
            .iter_mut()
            .map(|cell| Field::One(cell.take().unwrap_or(Cell::Empty)));
        let fields = beside.chain(frame.unwrap_or_default()).collect();
        let row = RawRow {
            number,
            fields,
            is_whole,
            is_torn,
        };
        match self.columns.iter().any(|column| column.is_behind) {
            true => self.held.replace(row),
            false => Some(row),
        }
    }

    /// A line between frames; gives the frame that it ends, and frames of which nothing but facts is there.
    pub(super) fn between(&mut self, number: u64, facts: Vec<Fact>) -> Vec<RawRow> {
        let mut given = Vec::new();
        for (name, value) in facts {
            let Some(at) = self.columns.iter().position(|column| column.name == name) else {
                continue;
            };
            let cell = Cell::of_text(&value);
            if self.columns[at].is_behind {
                let is_taken = |row: &RawRow| row.fields.get(at) != Some(&Field::One(Cell::Empty));
                if self.held.as_ref().is_none_or(is_taken) {
                    // What stands behind no frame is at the beginning of the text, or a frame is lost.
                    if self.held.is_some() {
                        given.extend(self.row(number, Vec::new(), None, true));
                    }
                }
                if let Some(field) = self.held.as_mut().and_then(|row| row.fields.get_mut(at)) {
                    *field = Field::One(cell);
                }
            } else {
                if self.pending[at].is_some() {
                    given.extend(self.row(self.line, Vec::new(), None, true));
                }
                self.pending[at] = Some(cell);
            }
        }
        self.line = number;
        given
    }

    /// The last frame. Facts of one that does not follow are nobody's.
    pub(super) fn end(&mut self) -> Option<RawRow> {
        self.held.take()
    }
}

fn names_of(facts: &[Fact]) -> Vec<String> {
    facts.iter().map(|(name, _)| name.clone()).collect()
}

/// The names in lines that come about once a frame.
fn common_lines<'r>(reads: impl Iterator<Item = &'r Read>, count: usize) -> Vec<Vec<String>> {
    let mut counts = BTreeMap::<Vec<String>, usize>::new();
    for read in reads.filter(|read| !read.facts.is_empty()) {
        *counts.entry(names_of(&read.facts)).or_default() += 1;
    }
    let common = counts.into_iter().filter(|(_, found)| found * 2 > count);
    common.map(|(names, _)| names).collect()
}

/// The names of facts that come about once a frame, in the order in which they first come.
fn common<'r>(reads: impl Iterator<Item = &'r Read> + Clone, count: usize) -> Vec<String> {
    let mut values = BTreeMap::<&str, Vec<&str>>::new();
    let mut order = Vec::new();
    for (name, value) in reads.flat_map(|read| &read.facts) {
        let found = values.entry(name).or_default();
        if found.is_empty() {
            order.push(name.as_str());
        }
        found.push(value);
    }
    let is_common = |name: &&str| {
        let found = &values[name];
        let distinct: BTreeSet<&&str> = found.iter().collect();
        // Words that are always the same say nothing, unless they are an MQTT topic; of many others, neither.
        let says = match *name == TAG {
            true => {
                found[0].contains('/')
                    || (2..=TAGS_MAX).contains(&distinct.len()) && distinct.len() < found.len()
            }
            false => true,
        };
        says && found.len() * 2 > count && found.len() * 2 <= count * 3 + 2
    };
    order
        .into_iter()
        .filter(is_common)
        .map(str::to_owned)
        .collect()
}

/// Whether a fact between frames belongs to the one before it: told by the blank lines around it, then by which comes first.
fn is_behind(
    name: &str,
    is_fact: &dyn Fn(&Read) -> bool,
    lines: &[(usize, Read)],
    per_frame: usize,
) -> Result<bool, ImportError> {
    let is_frame = |read: &Read| matches!(read.kind, Kind::Frame | Kind::BlockRow | Kind::Torn);
    let (mut near_before, mut near_behind) = (0, 0);
    for (at, _) in lines
        .iter()
        .enumerate()
        .filter(|(_, (_, read))| is_fact(read))
    {
        let blanks = |at: usize| lines[at].0 > 0 || lines[at].1.kind == Kind::Blank;
        // Up to the next frame on each side.
        let to_next = (at + 1..lines.len())
            .find(|at| is_frame(&lines[*at].1))
            .map(|next| (at + 1..=next).any(blanks));
        let from_last = (0..at)
            .rev()
            .find(|at| is_frame(&lines[*at].1))
            .map(|last| (last + 1..=at).any(blanks));
        if let (Some(to_next), Some(from_last)) = (to_next, from_last) {
            near_before += usize::from(from_last && !to_next);
            near_behind += usize::from(to_next && !from_last);
        }
    }
    if near_before != near_behind && near_before.min(near_behind) * 4 < near_before.max(near_behind)
    {
        return Ok(near_behind > near_before);
    }
    let facts = lines
        .iter()
        .position(|(_, read)| is_fact(read))
        .unwrap_or(0);
    let before = lines[..facts]
        .iter()
        .filter(|(_, read)| is_frame(read))
        .count();
    match before {
        0 => Ok(false),
        rows if rows % per_frame == 0 => Ok(true),
        _ => Err(ImportError::refused(
            format!(
                "whether the lines with {name:?} belong to the frame before or behind them is not clear"
            ),
            "the text begins in the middle of a frame: say which, --columns between=before or --columns between=behind",
        )),
    }
}
