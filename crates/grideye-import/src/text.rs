//! Text: lines of fields, with one frame in a line or over eight, and lines of other facts between.

mod lines;
mod split;

pub(crate) use split::Separator;

use crate::cell::{Cell, Field, RawRow};
use crate::error::ImportError;
use crate::source::Rows;
use grideye_frame::{COLUMNS, PIXELS};
use lines::{Line, Lines};
use std::collections::{BTreeMap, VecDeque};
use std::io::Read;

/// Lines by which the layout is told.
const HEAD_LINES: usize = 256;
/// A line with as many cells was meant to be a frame.
const TORN_MIN: usize = PIXELS / 2;
/// Facts between two frames; more are none.
const BETWEEN_MAX: usize = 16;

/// How frames lie in the lines.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Frames {
    /// One in a line, or in a list over several.
    Lines,
    /// One in eight lines of eight numbers.
    Blocks,
}

pub(crate) struct TextRows<R> {
    lines: Lines<R>,
    /// Lines that were read to tell the layout.
    head: VecDeque<Line>,
    separator: Separator,
    frames: Frames,
    names: Option<Vec<String>>,
    /// The line of the header, which is no row.
    header: Option<u64>,
    /// The number of fields in lines between frames.
    between: usize,
    pending: Vec<Field>,
    block: Vec<Cell>,
    ends: Ends,
    skipped: u64,
}

impl<R: Read> TextRows<R> {
    pub(crate) fn new(input: R) -> Result<Self, ImportError> {
        Self::separated(input, None)
    }

    /// With a known separator.
    pub(crate) fn separated(input: R, separator: Option<Separator>) -> Result<Self, ImportError> {
        let mut lines = Lines::new(input);
        let mut head = VecDeque::new();
        while head.len() < HEAD_LINES {
            let Some(line) = lines.next()? else {
                break;
            };
            head.push_back(line);
        }
        let texts: Vec<&str> = head
            .iter()
            .filter(|line| !is_comment(&line.text))
            .map(|line| line.text.as_str())
            .collect();
        let separator = separator.unwrap_or_else(|| Separator::of(&texts));
        let mut rows = Self {
            lines,
            separator,
            frames: Frames::Lines,
            names: None,
            header: None,
            between: 0,
            pending: Vec::new(),
            block: Vec::new(),
            ends: Ends::default(),
            skipped: 0,
            head: VecDeque::new(),
        };
        rows.tell(&head)?;
        rows.head = head;
        Ok(rows)
    }

    /// Tells from the first lines how the frames lie, and what the columns are called.
    fn tell(&mut self, head: &VecDeque<Line>) -> Result<(), ImportError> {
        let fields = |line: &Line| self.fields(&line.text);
        let data = || head.iter().filter(|line| !is_comment(&line.text));
        let wide: Vec<Vec<Field>> = data().map(fields).filter(|row| is_wide(row)).collect();
        let blocks = data().map(fields).filter(|row| is_block_line(row)).count();
        if wide.is_empty() && blocks < COLUMNS {
            let widest = data().map(fields).map(|row| numbers(&row)).max();
            return Err(ImportError::no_frame(widest.unwrap_or(0)));
        }
        self.frames = match wide.is_empty() {
            true => Frames::Blocks,
            false => Frames::Lines,
        };
        let columns = wide.first().map_or(0, Vec::len);
        let (names, header) = self.header_of(head, columns);
        self.between = self.between_of(data().filter(|line| Some(line.number) != header));
        if let Some(names) = names {
            // Those of facts between frames have no name.
            let unnamed = vec![String::new(); self.between];
            self.names = Some([unnamed, names].concat());
        }
        self.header = header;
        Ok(())
    }

    /// The names of the columns, and the line in which they are.
    fn header_of(
        &self,
        head: &VecDeque<Line>,
        columns: usize,
    ) -> (Option<Vec<String>>, Option<u64>) {
        for line in head {
            let text = line.text.trim_start_matches(['#', '%', ' ']);
            let names: Vec<String> = self
                .separator
                .split(text)
                .iter()
                .map(|name| unquoted(name))
                .collect();
            let is_data = is_wide(&self.fields(&line.text));
            // A row of numbers names columns if they count up, as pandas writes them.
            let is_header = !is_data && names.iter().all(|name| name.parse::<f64>().is_err());
            if is_header || (is_data && counts_up(&names)) {
                match names.len() + 1 == columns {
                    // R writes no name above those of the rows.
                    true => {
                        return (
                            Some([vec![String::new()], names].concat()),
                            Some(line.number),
                        );
                    }
                    false if names.len() == columns => return (Some(names), Some(line.number)),
                    false => {}
                }
            }
            if is_data {
                break;
            }
        }
        (None, None)
    }

    /// The number of fields that most frames have in the lines before them.
    fn between_of<'l>(&self, data: impl Iterator<Item = &'l Line>) -> usize {
        let (mut counts, mut before, mut in_block) = (BTreeMap::<usize, usize>::new(), 0, 0);
        for line in data {
            let fields = self.fields(&line.text);
            let is_frame = match self.frames {
                Frames::Lines => is_wide(&fields),
                Frames::Blocks if is_block_line(&fields) => {
                    in_block = (in_block + 1) % COLUMNS;
                    if in_block != 0 {
                        continue;
                    }
                    true
                }
                Frames::Blocks => false,
            };
            if is_frame {
                *counts.entry(before).or_default() += 1;
                before = 0;
            } else if is_fact(&line.text, &fields) {
                before += self.fields(stated(&line.text)).len();
            }
        }
        let most = counts.into_iter().max_by_key(|(_, count)| *count);
        most.map_or(0, |(between, _)| between).min(BETWEEN_MAX)
    }

    fn fields(&self, text: &str) -> Vec<Field> {
        let texts = self.separator.split(text);
        texts
            .into_iter()
            .map(|text| self.separator.field(text))
            .collect()
    }

    fn line(&mut self) -> Result<Option<Line>, ImportError> {
        match self.head.pop_front() {
            Some(line) => Ok(Some(line)),
            None => self.lines.next(),
        }
    }

    /// The row of this frame, with the facts before it.
    fn row(&mut self, line: &Line, frame: Vec<Field>) -> RawRow {
        let mut fields = std::mem::take(&mut self.pending);
        fields.resize(self.between, Field::One(Cell::Empty));
        fields.extend(frame);
        let is_whole = line.ended || self.ends.are_whole(&line.text);
        self.ends.take(&line.text);
        RawRow {
            number: line.number,
            fields,
            is_whole,
        }
    }

    /// A line between frames. A block that it cuts short is a torn frame.
    fn between(&mut self, line: &Line, fields: Vec<Field>) -> Option<RawRow> {
        let torn = std::mem::take(&mut self.block);
        let row = (!torn.is_empty()).then(|| self.row(line, vec![Field::Many(torn)]));
        if self.between > 0 && is_fact(&line.text, &fields) {
            let facts = self.fields(stated(&line.text));
            self.pending.extend(facts);
            self.pending.truncate(BETWEEN_MAX);
        } else if row.is_none() && cells(&fields) >= TORN_MIN {
            return Some(self.row(line, fields));
        } else {
            self.skipped += 1;
        }
        row
    }
}

impl<R: Read> Rows for TextRows<R> {
    fn names(&self) -> Option<&[String]> {
        self.names.as_deref()
    }

    fn next(&mut self) -> Result<Option<RawRow>, ImportError> {
        while let Some(line) = self.line()? {
            if is_comment(&line.text) || Some(line.number) == self.header {
                continue;
            }
            let fields = self.fields(&line.text);
            match self.frames {
                Frames::Lines if is_wide(&fields) => return Ok(Some(self.row(&line, fields))),
                Frames::Blocks if is_block_line(&fields) => {
                    self.block
                        .extend(fields.iter().flat_map(Field::cells).cloned());
                    if self.block.len() == PIXELS {
                        let frame = std::mem::take(&mut self.block);
                        return Ok(Some(self.row(&line, vec![Field::Many(frame)])));
                    }
                }
                _ => {
                    if let Some(torn) = self.between(&line, fields) {
                        return Ok(Some(torn));
                    }
                }
            }
        }
        let torn = std::mem::take(&mut self.block);
        if torn.is_empty() {
            return Ok(None);
        }
        let end = Line {
            number: 0,
            text: String::new(),
            ended: false,
        };
        let row = self.row(&end, vec![Field::Many(torn)]);
        Ok(Some(RawRow {
            is_whole: false,
            ..row
        }))
    }

    fn skipped(&self) -> u64 {
        self.skipped
    }

    fn container(&self) -> String {
        match self.frames {
            Frames::Lines => format!("a text of fields separated by {}", self.separator.name()),
            Frames::Blocks => "a text with a frame in eight lines".to_owned(),
        }
    }
}

fn is_comment(text: &str) -> bool {
    text.trim_start().starts_with(['#', '%'])
}

fn unquoted(text: &str) -> String {
    text.trim().trim_matches(['"', '\'']).trim().to_owned()
}

fn cells(row: &[Field]) -> usize {
    row.iter().map(|field| field.cells().len()).sum()
}

fn numbers(row: &[Field]) -> usize {
    let cells = row.iter().flat_map(Field::cells);
    cells.filter(|cell| cell.number().is_some()).count()
}

/// Whether a frame fits into the row.
fn is_wide(row: &[Field]) -> bool {
    let cells = row.iter().flat_map(Field::cells);
    cells
        .filter(|cell| cell.is_empty() || cell.number().is_some())
        .count()
        >= PIXELS
}

fn is_block_line(row: &[Field]) -> bool {
    cells(row) == COLUMNS && numbers(row) == COLUMNS
}

/// Whether a line between frames may say when or what, and is not a caption.
fn is_fact(text: &str, row: &[Field]) -> bool {
    cells(row) < TORN_MIN && text.bytes().any(|byte| byte.is_ascii_digit())
}

/// What a line between frames says, without the words around it: `12.5` of `Time: 12.5 s`.
fn stated(text: &str) -> &str {
    let value = text
        .split_once([':', '='])
        .filter(|(caption, _)| !caption.contains(|letter: char| letter.is_ascii_digit()));
    let value = value.map_or(text, |(_, value)| value).trim();
    match value.split_once(' ') {
        Some((number, unit))
            if number.parse::<f64>().is_ok() && unit.chars().all(char::is_alphabetic) =>
        {
            number
        }
        _ => value,
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
        let decimals = decimals_at_end(text);
        let is_fixed = self.is_fixed && decimals == self.decimals;
        let has_fractions = !self.is_fixed || self.decimals > 0;
        let is_quarter = self.is_quarters && has_fractions && is_quarter(text);
        self.count > 0 && decimals > 0 && (is_fixed || is_quarter)
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

/// Whether 64 of the names are numbers that count up from 0 or 1.
fn counts_up(names: &[String]) -> bool {
    let numbers = names.iter().map(|name| name.parse::<u64>().ok());
    let numbers: Vec<Option<u64>> = numbers.collect();
    numbers.windows(PIXELS).any(|window| {
        let from = |first: u64| {
            window
                .iter()
                .zip(first..)
                .all(|(found, number)| *found == Some(number))
        };
        from(0) || from(1)
    })
}
