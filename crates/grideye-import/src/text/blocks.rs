//! Frames in eight lines: where each begins and ends.

use super::facts::Fact;
use crate::cell::{Cell, Field};
use crate::error::ImportError;
use grideye_frame::{COLUMNS, PIXELS, ROWS};
use std::collections::BTreeMap;

/// A row of the sensor in a line.
#[derive(Debug, Clone)]
pub(super) struct BlockRow {
    pub(super) line: u64,
    pub(super) cells: Vec<Cell>,
    /// What stands beside the eight numbers; at last the cells of the line before them.
    pub(super) facts: Vec<Fact>,
    /// Cells of the line.
    pub(super) width: usize,
    pub(super) gap: Gap,
}

/// What stands between a line of a block and the one before: blank lines, and others.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Gap {
    pub(super) blanks: usize,
    pub(super) others: usize,
}

/// What marks where a frame begins.
#[derive(Debug, Clone, PartialEq)]
enum Border {
    /// The fact that counts the rows, and its first value.
    Index(String, i64),
    /// Every other gap is inside a frame.
    Gaps(Vec<Gap>),
    /// Nothing: the row of a frame in which the text begins is said.
    Said(usize),
}

/// Rows of the sensor become frames.
#[derive(Debug)]
pub(super) struct Blocks {
    border: Border,
    rows: Vec<BlockRow>,
    /// Whether a border was seen before the rows.
    has_begun: bool,
    /// Rows so far, where nothing marks a border.
    count: usize,
    /// Rows of frames that were cut by the beginning of the text.
    pub(super) cut: u64,
}

/// The rows of one frame, or of one of which rows lack.
#[derive(Debug)]
pub(super) struct Block {
    pub(super) line: u64,
    pub(super) facts: Vec<Fact>,
    /// The 64 cells; `None` if rows lack.
    pub(super) frame: Option<Vec<Field>>,
}

/// What a cell beside eight numbers is called, before its number.
pub(super) const BESIDE: &str = "beside";

impl BlockRow {
    /// The cells before the eight pixels.
    pub(super) fn beside(&self) -> impl Iterator<Item = &str> {
        let beside = self.facts.iter().rev().take(self.width - COLUMNS);
        beside.map(|(_, value)| value.as_str())
    }
}

impl Blocks {
    /// Whether a fact counts the rows.
    pub(super) fn are_counted(sample: &[BlockRow]) -> bool {
        index_of(sample).is_some()
    }

    /// Tells what marks a border from the rows of the first lines. `is_all` says that there are no others.
    pub(super) fn of(
        sample: &[BlockRow],
        said: Option<usize>,
        is_all: bool,
    ) -> Result<Self, ImportError> {
        let border = match (index_of(sample), said) {
            (_, Some(first)) => Border::Said(first),
            (Some((name, first)), None) => Border::Index(name, first),
            (None, None) => Border::Gaps(borders(sample, is_all)?),
        };
        Ok(Self {
            border,
            rows: Vec::new(),
            has_begun: false,
            count: 0,
            cut: 0,
        })
    }

    /// The fact that counts rows, and says nothing about a frame.
    pub(super) fn index(&self) -> Option<&str> {
        match &self.border {
            Border::Index(name, _) => Some(name),
            _ => None,
        }
    }

    /// The next row, and the frame that it ends.
    pub(super) fn push(&mut self, row: BlockRow) -> Option<Block> {
        let begins = self.begins(&row);
        let ended = if begins { self.end() } else { None };
        self.has_begun |= begins;
        self.count += 1;
        // More rows are no frame, however many they are.
        self.rows.truncate(ROWS);
        self.rows.push(row);
        ended
    }

    fn begins(&self, row: &BlockRow) -> bool {
        match &self.border {
            Border::Said(first) => (self.count + first) % ROWS == 0,
            // More than a border is one too: a frame cut short, then a border.
            Border::Gaps(borders) => borders
                .iter()
                .any(|border| row.gap.blanks >= border.blanks && row.gap.others >= border.others),
            Border::Index(name, first) => {
                let at = index(row, name);
                let last = self.rows.last().and_then(|last| index(last, name));
                at == Some(*first) || matches!((at, last), (Some(at), Some(last)) if at <= last)
            }
        }
    }

    /// The frame of the rows so far; `None` if there are none, or if the text began inside it.
    pub(super) fn end(&mut self) -> Option<Block> {
        let rows = std::mem::take(&mut self.rows);
        let is_whole = rows.len() == ROWS && self.is_in_order(&rows);
        if rows.is_empty() || (!is_whole && !self.has_begun) {
            self.cut += u64::from(!rows.is_empty());
            return None;
        }
        self.has_begun = true;
        let first = rows.first()?;
        let (line, facts) = (first.line, first.facts.clone());
        let cells = rows.into_iter().flat_map(|row| row.cells);
        Some(Block {
            line,
            facts,
            frame: is_whole.then(|| vec![Field::Many(cells.collect())]),
        })
    }

    fn is_in_order(&self, rows: &[BlockRow]) -> bool {
        let Border::Index(name, first) = &self.border else {
            return true;
        };
        rows.iter()
            .zip(*first..)
            .all(|(row, expected)| index(row, name) == Some(expected))
    }
}

fn index(row: &BlockRow, name: &str) -> Option<i64> {
    let found = row.facts.iter().find(|(found, _)| found == name)?;
    found.1.parse().ok()
}

/// The fact that counts from 0 to 7, or from 1 to 8, from row to row.
fn index_of(sample: &[BlockRow]) -> Option<(String, i64)> {
    let names = sample.first()?.facts.iter().map(|(name, _)| name.clone());
    names.into_iter().find_map(|name| {
        let found: Vec<i64> = sample.iter().filter_map(|row| index(row, &name)).collect();
        let (first, last) = (*found.iter().min()?, *found.iter().max()?);
        let steps = found
            .windows(2)
            .filter(|pair| pair[1] == pair[0] + 1 || (pair[1] == first && pair[0] == last));
        let counts = steps.count() * 4 >= 3 * found.len().saturating_sub(1);
        let is_index = (0..=1).contains(&first)
            && last == first + 7
            && counts
            && found.len() * 4 >= sample.len() * 3;
        is_index.then_some((name, first))
    })
}

/// The gaps between frames, told by how often they come and by the eight rows between them.
fn borders(sample: &[BlockRow], is_all: bool) -> Result<Vec<Gap>, ImportError> {
    let mut counts = BTreeMap::<Gap, usize>::new();
    for row in sample.iter().skip(1) {
        *counts.entry(row.gap).or_default() += 1;
    }
    let inside = counts
        .iter()
        .max_by_key(|(_, count)| **count)
        .map(|(gap, _)| *gap);
    let often = sample.len() / PIXELS;
    let regular = counts
        .iter()
        .filter(|(gap, count)| Some(**gap) != inside && **count > often);
    let regular: Vec<Gap> = regular.map(|(gap, _)| *gap).collect();
    if regular.is_empty() && is_all && sample.len() == ROWS {
        return Ok(regular);
    }
    let mut lengths = BTreeMap::<usize, usize>::new();
    let mut length = 0;
    for row in sample.iter().skip(1) {
        length += 1;
        if regular.contains(&row.gap) {
            *lengths.entry(length).or_default() += 1;
            length = 0;
        }
    }
    let most = lengths
        .into_iter()
        .max_by_key(|(length, count)| (*count, *length == ROWS));
    match most {
        Some((ROWS, _)) => Ok(regular),
        Some((other, _)) => Err(ImportError::refused(
            format!(
                "most groups of lines of {COLUMNS} numbers have {other} lines, where a frame of a Grid-EYE has {ROWS}"
            ),
            "if each eight lines are a frame, say which row of a frame the first line has: --columns first-row=N, N from 1 to 8",
        )),
        None => Err(ImportError::refused(
            format!("nothing marks where a frame begins in lines of {COLUMNS} numbers"),
            "if each eight lines are a frame and none lacks, say which row of a frame the first line has: --columns first-row=N, N from 1 to 8; better print a blank line between frames",
        )),
    }
}
