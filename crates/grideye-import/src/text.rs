//! Text: lines of fields, with one frame in a line or over eight, and lines of other facts between.

mod beside;
mod blocks;
mod facts;
mod hex;
mod layout;
mod lead;
mod lines;
mod split;

pub(crate) use facts::stated;
pub(crate) use split::{Separator, list};

use crate::cell::{Field, RawRow};
use crate::columns::{Columns, Unit};
use crate::error::ImportError;
use crate::source::Rows;
use beside::Beside;
use blocks::{Block, BlockRow, Gap};
use grideye_frame::{COLUMNS, PIXELS};
use layout::{Kind, Layout};
use lines::{Line, Lines};
use std::collections::VecDeque;
use std::io::Read;

/// Lines by which the layout is told, and bytes, where lines are long.
const HEAD_LINES: usize = 512;
const HEAD_BYTES: usize = 1 << 21;

pub(crate) struct TextRows<R> {
    lines: Lines<R>,
    /// Lines that were read to tell the layout.
    head: VecDeque<Line>,
    layout: Layout,
    beside: Beside,
    /// Since the last row of a block.
    gap: Gap,
    ready: VecDeque<RawRow>,
    ended: bool,
    ends: Ends,
    skipped: u64,
    /// What the container is, if it is more than a text.
    container: Option<String>,
}

impl<R: Read> TextRows<R> {
    pub(crate) fn new(input: R, said: &Columns) -> Result<Self, ImportError> {
        Self::separated(input, None, said)
    }

    /// With a known separator.
    pub(crate) fn separated(
        input: R,
        separator: Option<Separator>,
        said: &Columns,
    ) -> Result<Self, ImportError> {
        let mut lines = Lines::new(input);
        let (mut head, mut bytes, mut is_all) = (VecDeque::new(), 0, false);
        while head.len() < HEAD_LINES && bytes < HEAD_BYTES && !is_all {
            let line = lines.next()?;
            is_all = line.is_none();
            bytes += line.as_ref().map_or(0, |line| line.text.len());
            head.extend(line);
        }
        let layout = Layout::of(head.make_contiguous(), separator, said.first_row, is_all)?;
        let beside = Beside::of(&layout, head.make_contiguous(), said.between)?;
        Ok(Self {
            lines,
            head,
            layout,
            beside,
            gap: Gap::default(),
            ready: VecDeque::new(),
            ended: false,
            ends: Ends::default(),
            skipped: 0,
            container: None,
        })
    }

    #[cfg(feature = "xlsx")]
    pub(crate) fn called(self, container: String) -> Self {
        Self {
            container: Some(container),
            ..self
        }
    }

    fn line(&mut self) -> Result<Option<Line>, ImportError> {
        match self.head.pop_front() {
            Some(line) => Ok(Some(line)),
            None => self.lines.next(),
        }
    }

    fn take(&mut self, line: &Line) {
        let read = self.layout.read(line);
        self.gap.blanks += line.blanks;
        match read.kind {
            Kind::Blank => self.gap.blanks += 1,
            Kind::Comment | Kind::Header => self.gap.others += 1,
            Kind::Frame => {
                let is_whole = line.ended || self.ends.are_whole(&line.text);
                self.ends.take(&line.text);
                let row = self
                    .beside
                    .row(line.number, read.facts, Some(read.fields), is_whole);
                self.ready.extend(row);
            }
            Kind::Torn => {
                let row = self.beside.row(line.number, read.facts, None, true);
                self.ready.extend(row);
            }
            Kind::BlockRow => {
                let gap = std::mem::take(&mut self.gap);
                let cells = read.fields.iter().flat_map(Field::cells).cloned().collect();
                let row = BlockRow {
                    line: line.number,
                    width: COLUMNS,
                    cells,
                    facts: read.facts,
                    gap,
                };
                let ended = self
                    .layout
                    .blocks
                    .as_mut()
                    .and_then(|blocks| blocks.push(row));
                self.give(ended, true);
                let is_whole = line.ended || self.ends.are_whole(&line.text);
                self.ends.take(&line.text);
                if !is_whole {
                    self.ends.is_cut = true;
                }
            }
            Kind::Other => {
                self.gap.others += 1;
                if !self.beside.knows(&read.facts) {
                    self.skipped += 1;
                    return;
                }
                let ended = self.layout.blocks.as_mut().and_then(blocks::Blocks::end);
                self.give(ended, true);
                let lost = self.beside.between(line.number, read.facts);
                self.ready.extend(lost);
            }
        }
    }

    fn give(&mut self, block: Option<Block>, is_whole: bool) {
        if let Some(block) = block {
            let rows = self
                .beside
                .row(block.line, block.facts, block.frame, is_whole);
            self.ready.extend(rows);
        }
    }

    /// The last frame, which its end may have cut.
    fn end(&mut self) {
        let last = self.layout.blocks.as_mut().and_then(blocks::Blocks::end);
        let is_whole = last.as_ref().is_none_or(|last| last.frame.is_some()) && !self.ends.is_cut;
        self.give(last, is_whole);
        let held = self.beside.end();
        self.ready.extend(held);
    }
}

impl<R: Read> Rows for TextRows<R> {
    fn names(&self) -> Option<&[String]> {
        self.beside.names()
    }

    fn next(&mut self) -> Result<Option<RawRow>, ImportError> {
        loop {
            if let Some(row) = self.ready.pop_front() {
                return Ok(Some(row));
            }
            if self.ended {
                return Ok(None);
            }
            match self.line()? {
                Some(line) => self.take(&line),
                None => {
                    self.ended = true;
                    self.end();
                }
            }
        }
    }

    fn skipped(&self) -> u64 {
        self.skipped
    }

    fn cut(&self) -> u64 {
        self.layout.blocks.as_ref().map_or(0, |blocks| blocks.cut)
    }

    fn unit(&self) -> Option<Unit> {
        self.layout.unit
    }

    fn container(&self) -> String {
        if let Some(container) = &self.container {
            return container.clone();
        }
        match self.layout.blocks {
            None => format!(
                "a text of fields separated by {}",
                self.layout.separator.name()
            ),
            Some(_) => "a text with a frame in eight lines".to_owned(),
        }
    }
}

/// What the last numbers of all frames so far have in common.
#[derive(Debug, Default)]
struct Ends {
    count: u64,
    /// Of the first of them, and whether the others have as many.
    decimals: usize,
    is_fixed: bool,
    is_quarters: bool,
    /// Whether the last row of a block may be cut.
    is_cut: bool,
}

impl Ends {
    fn take(&mut self, text: &str) {
        let decimals = decimals_at_end(text);
        let is_first = self.count == 0;
        if is_first {
            (self.decimals, self.is_fixed, self.is_quarters) = (decimals, true, true);
        }
        self.is_fixed &= decimals == self.decimals;
        self.is_quarters &= ends_in_number(text) && is_quarter(text);
        self.count += 1;
    }

    /// Whether a line without a newline cannot have been cut within its last number: it has as many decimals as the others,
    /// or a fraction that no quarter but itself begins with.
    fn are_whole(&self, text: &str) -> bool {
        if !ends_in_number(text) {
            return true;
        }
        if self.count == 0 {
            // The first line: as the numbers before its last one.
            let numbers = text
                .rsplit([',', ';', ' ', '\t'])
                .take(PIXELS)
                .map(decimals_at_end);
            let decimals: Vec<usize> = numbers.collect();
            return decimals[0] > 0
                && decimals.len() >= COLUMNS
                && decimals.iter().all(|count| *count == decimals[0]);
        }
        let decimals = decimals_at_end(text);
        let is_fixed = self.is_fixed && decimals == self.decimals;
        let has_fractions = !self.is_fixed || self.decimals > 0;
        let is_quarter = self.is_quarters && has_fractions && is_quarter(text);
        decimals > 0 && (is_fixed || is_quarter)
    }
}

fn ends_in_number(text: &str) -> bool {
    text.ends_with(|last: char| last.is_ascii_digit() || last == '.')
}

fn decimals_at_end(text: &str) -> usize {
    let digits = text.bytes().rev().take_while(u8::is_ascii_digit).count();
    match text[..text.len() - digits].ends_with('.') {
        true => digits,
        false => 0,
    }
}

fn is_quarter(text: &str) -> bool {
    let decimals = &text[text.len() - decimals_at_end(text)..];
    ["", "25", "5", "75"].contains(&decimals.trim_end_matches('0'))
}
