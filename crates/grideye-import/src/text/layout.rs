//! How the frames of a text lie, told from its first lines.

use super::blocks::{BESIDE, BlockRow, Blocks, Gap};
use super::facts::{Fact, STAMPS, stated};
use super::hex;
use super::lead::Leads;
use super::lines::Line;
use super::split::{self, Separator};
use crate::cell::{Cell, Field};
use crate::columns::Unit;
use crate::error::ImportError;
use crate::moment::{Order, parse};
use grideye_frame::{COLUMNS, PIXELS};
use std::borrow::Cow;
use std::collections::BTreeMap;

/// A line with as many cells was meant to be a frame.
const TORN_MIN: usize = PIXELS / 2;
/// The sides of a table that is drawn with characters.
const FRAMES: [char; 3] = ['│', '┃', '║'];
/// Words that loggers write in place of a frame.
const ERRORS: [&str; 5] = ["err", "fail", "timeout", "nan", "none"];
/// Columns beside a row of the sensor.
const BESIDE_MAX: usize = 6;

#[derive(Debug)]
pub(super) struct Layout {
    pub(super) separator: Separator,
    leads: Leads,
    /// Whether a comma stands before the milliseconds of a time of day.
    has_clock_commas: bool,
    is_hex: bool,
    /// Where frames lie in eight lines.
    pub(super) blocks: Option<Blocks>,
    /// Cells of a row of a block, of which the last eight are pixels.
    block: Option<usize>,
    /// The names of the columns in a line, and the text of the header.
    pub(super) names: Option<Vec<String>>,
    headers: Vec<String>,
    /// The fields of a frame's line, where a frame is in a line.
    columns: usize,
    pub(super) unit: Option<Unit>,
}

/// What a line is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    Frame,
    /// A line that was meant to be a frame.
    Torn,
    BlockRow,
    Comment,
    Header,
    /// Nothing behind what a console wrote.
    Blank,
    Other,
}

#[derive(Debug)]
pub(super) struct Read {
    pub(super) kind: Kind,
    pub(super) fields: Vec<Field>,
    pub(super) facts: Vec<Fact>,
}

impl Layout {
    pub(super) fn of(
        head: &[Line],
        separator: Option<Separator>,
        first_row: Option<usize>,
        is_all: bool,
    ) -> Result<Self, ImportError> {
        let mut layout = Self {
            separator: Separator::Blank,
            leads: Leads::default(),
            has_clock_commas: false,
            is_hex: head.iter().any(|line| hex::decimal(&line.text).is_some()),
            blocks: None,
            block: None,
            names: None,
            headers: Vec::new(),
            columns: 0,
            unit: None,
        };
        layout.has_clock_commas = has_clock_commas(head);
        let texts: Vec<String> = head
            .iter()
            .map(|line| layout.text(line).into_owned())
            .collect();
        let texts = || {
            texts
                .iter()
                .map(String::as_str)
                .filter(|text| !is_comment(text))
        };
        layout.unit = if layout.is_hex {
            Some(Unit::Words)
        } else {
            unit_of(texts())
        };
        let wide = |layout: &Self| {
            texts()
                .filter(|text| is_wide(&layout.fields(layout.split(text).1)))
                .count()
        };
        let mut is_lines = false;
        for count in [None, Some(PIXELS), Some(COLUMNS)] {
            layout.separate(texts(), separator, count);
            is_lines = wide(&layout) > 0 && (count.is_some() || !layout.has_glued_lead(texts()));
            if is_lines {
                break;
            }
        }
        match is_lines {
            true => layout.with_lines(head, &texts().collect::<Vec<_>>()),
            false => layout.with_blocks(head, &texts().collect::<Vec<_>>(), first_row, is_all),
        }
    }

    /// With a frame in a line.
    fn with_lines(mut self, head: &[Line], texts: &[&str]) -> Result<Self, ImportError> {
        let wide = texts
            .iter()
            .map(|text| self.fields(self.split(text).1))
            .filter(|row| is_wide(row));
        self.columns = wide.map(|row| row.len()).max().unwrap_or(0);
        self.name_columns(head, self.columns);
        if texts.iter().any(|text| list_in(self.split(text).0)) {
            return Err(ImportError::refused(
                "lines have more than one list of numbers",
                "take one of them to a line, and convert one after the other; --columns says what is in a line",
            ));
        }
        Ok(self)
    }

    /// With a frame in eight lines.
    fn with_blocks(
        mut self,
        head: &[Line],
        texts: &[&str],
        first_row: Option<usize>,
        is_all: bool,
    ) -> Result<Self, ImportError> {
        let is_mask = |text: &str| {
            text.split([',', ';', ' ', '\t'])
                .filter(|word| ["true", "false", "True", "False"].contains(word))
                .count()
                >= PIXELS
        };
        if texts.iter().any(|text| is_mask(text)) {
            return Err(ImportError::refused(
                "the pixels are true or false: a mask, no temperatures",
                "record the numbers; of a mask nothing is read, whatever --columns says",
            ));
        }
        let widest = texts
            .iter()
            .map(|text| numbers(&self.fields(text)))
            .max()
            .unwrap_or(0);
        let lines = texts
            .iter()
            .filter(|text| numbers(&self.fields(text)) == widest)
            .count();
        let width = self
            .block_width(texts.iter().copied())
            .ok_or_else(|| ImportError::no_frame(widest, lines))?;
        self.block = Some(width);
        self.name_columns(head, width);
        let rows = self.block_rows(head);
        // Of lines of nine numbers and more it is not known whether eight are the pixels, unless one of them counts the rows.
        // Nothing beyond a thousand is a pixel.
        let is_plain = rows.iter().all(|row| {
            row.beside()
                .all(|value| value.parse::<f64>().map_or(true, |value| value > 1e3))
        });
        if !is_plain && !Blocks::are_counted(&rows) {
            return Err(ImportError::no_frame(widest, lines));
        }
        self.blocks = Some(Blocks::of(&rows, first_row, is_all)?);
        Ok(self)
    }

    /// The separator, and what is written before each line of at least so many numbers; nothing, if there is no count.
    fn separate<'t>(
        &mut self,
        texts: impl Iterator<Item = &'t str> + Clone,
        said: Option<Separator>,
        count: Option<usize>,
    ) {
        self.leads = count.map_or_else(Leads::default, |count| Leads::of(texts.clone(), count));
        let count = count.unwrap_or(COLUMNS);
        let rests = texts.clone().map(|text| self.leads.split(text, count).1);
        let with_numbers: Vec<&str> = rests.filter(|rest| Leads::ends_in(rest, count)).collect();
        let all: Vec<&str> = texts.collect();
        let separated = if with_numbers.is_empty() {
            &all
        } else {
            &with_numbers
        };
        self.separator = said.unwrap_or_else(|| Separator::of(separated));
        self.leads.keep_unless_separated(self.separator);
    }

    /// Whether the first fields of frames are more than a column: a number behind what a console wrote, a stamp among other
    /// words, or an MQTT topic.
    fn has_glued_lead<'t>(&self, texts: impl Iterator<Item = &'t str>) -> bool {
        let wide = texts
            .map(|text| self.fields(text))
            .filter(|row| is_wide(row));
        let is_glued = |row: &Vec<Field>| {
            let Some(Field::One(Cell::Text(text))) = row.first() else {
                return false;
            };
            let last = text.rsplit(char::is_whitespace).next().unwrap_or(text);
            let is_number_behind = last != text && split::number(last).is_some();
            let is_stamp_inside = || {
                stated(text)
                    .iter()
                    .any(|(name, _)| STAMPS.contains(&name.as_str()))
            };
            parse(text, Some(Order::DayFirst)).is_none()
                && (is_number_behind || text.contains('/') || is_stamp_inside())
        };
        let (mut rows, mut glued) = (0, 0);
        for row in wide {
            rows += 1;
            glued += usize::from(is_glued(&row));
        }
        glued * 2 > rows
    }

    /// What a line says, and how.
    pub(super) fn read(&self, line: &Line) -> Read {
        let text = self.text(line);
        let nothing = |kind| Read {
            kind,
            fields: Vec::new(),
            facts: Vec::new(),
        };
        if is_comment(&text) {
            return nothing(Kind::Comment);
        }
        if self.headers.iter().any(|header| header == text.trim()) {
            return nothing(Kind::Header);
        }
        let (lead, rest) = self.split(&text);
        let fields = self.fields(rest);
        let facts = || {
            if lead.is_empty() {
                Vec::new()
            } else {
                stated(lead)
            }
        };
        if self.block.is_some() {
            if let Some((cells, beside)) = self.block_row(&fields) {
                let facts = [facts(), beside].concat();
                return Read {
                    kind: Kind::BlockRow,
                    fields: cells,
                    facts,
                };
            }
        } else if is_wide(&fields) {
            return Read {
                kind: Kind::Frame,
                fields,
                facts: facts(),
            };
        } else if cells(&fields) >= TORN_MIN && numbers(&fields) > 0 || self.is_error(&fields) {
            return Read {
                kind: Kind::Torn,
                fields: Vec::new(),
                facts: facts(),
            };
        }
        if rest.trim().is_empty() {
            return nothing(Kind::Blank);
        }
        Read {
            kind: Kind::Other,
            fields: Vec::new(),
            facts: stated(rest),
        }
    }

    /// Whether a row of a table with names has an error's text in place of its pixels.
    fn is_error(&self, fields: &[Field]) -> bool {
        let text = fields
            .last()
            .map(|field| field.cells()[0].text().to_lowercase());
        let is_error = |text: &String| ERRORS.iter().any(|word| text.contains(word));
        let first = fields.first().map(|field| field.cells()[0].text());
        let is_time = first.is_some_and(|first| parse(&first, Some(Order::DayFirst)).is_some());
        self.names.is_some()
            && self.block.is_none()
            && is_time
            && text.as_ref().is_some_and(is_error)
    }

    /// The text of a line, with points for commas in times and decimals for hexadecimal numbers.
    fn text<'l>(&self, line: &'l Line) -> Cow<'l, str> {
        if self.is_hex {
            if let Some(decimal) = hex::decimal(&line.text) {
                return Cow::Owned(decimal);
            }
        }
        if line.text.contains(FRAMES) {
            // A table drawn around.
            return Cow::Owned(line.text.replace(FRAMES, "|"));
        }
        if let Some((_, values)) = line.text.split_once("VALUES") {
            // A statement of SQL.
            return Cow::Borrowed(values.trim().trim_end_matches(';').trim_matches(['(', ')']));
        }
        // With the checksum of NMEA.
        if let Some((sentence, sum)) = line
            .text
            .strip_prefix('$')
            .and_then(|text| text.rsplit_once('*'))
        {
            if sum.trim().len() == 2 {
                return Cow::Borrowed(sentence);
            }
        }
        match clock_comma(&line.text).filter(|_| self.has_clock_commas) {
            Some(at) => Cow::Owned(format!("{}.{}", &line.text[..at], &line.text[at + 1..])),
            None => Cow::Borrowed(line.text.as_str()),
        }
    }

    fn split<'t>(&self, text: &'t str) -> (&'t str, &'t str) {
        let count = if self.block.is_some() {
            COLUMNS
        } else {
            PIXELS
        };
        self.leads.split(text, count)
    }

    fn fields(&self, text: &str) -> Vec<Field> {
        // A frame drawn around.
        // A separator at the end ends a cell.
        let text = text.trim_matches([' ', '\r']).trim_matches(['*', '|', '#']);
        let texts = self.separator.split(text);
        let mut fields: Vec<Field> = texts
            .into_iter()
            .map(|text| self.separator.field(text))
            .collect();
        if fields.len() + 1 == self.columns && self.separator.is_at_end(text) {
            // A last cell that is empty.
            fields.push(Field::One(Cell::Empty));
        }
        fields
    }

    /// The most common number of cells of lines that end in eight numbers.
    fn block_width<'t>(&self, texts: impl Iterator<Item = &'t str>) -> Option<usize> {
        let mut counts = BTreeMap::<usize, usize>::new();
        for text in texts {
            let fields = self.fields(self.leads.split(text, COLUMNS).1);
            if let Some(width) = cells_of_block(&fields) {
                *counts.entry(width).or_default() += 1;
            }
        }
        let (width, count) = counts.into_iter().max_by_key(|(_, count)| *count)?;
        (count >= COLUMNS).then_some(width)
    }

    /// The eight cells of a row of a block, and what stands beside them.
    fn block_row(&self, fields: &[Field]) -> Option<(Vec<Field>, Vec<Fact>)> {
        let width = self
            .block
            .filter(|width| cells_of_block(fields) == Some(*width))?;
        let from = width - COLUMNS;
        let cells: Vec<Cell> = fields.iter().flat_map(Field::cells).cloned().collect();
        let name = |column: usize| {
            let named = self
                .names
                .as_ref()
                .and_then(|names| names.get(column))
                .cloned();
            named.unwrap_or_else(|| format!("{BESIDE}{}", column + 1))
        };
        let facts = (0..from).map(|column| (name(column), cells[column].text().into_owned()));
        let pixels = Field::Many(cells[from..].to_vec());
        Some((vec![pixels], facts.collect()))
    }

    fn block_rows(&self, head: &[Line]) -> Vec<BlockRow> {
        let (mut rows, mut gap) = (Vec::new(), Gap::default());
        for line in head {
            gap.blanks += line.blanks;
            let text = self.text(line);
            let (lead, rest) = self.leads.split(&text, COLUMNS);
            match self.block_row(&self.fields(rest)) {
                Some((fields, beside)) => rows.push(BlockRow {
                    line: line.number,
                    cells: fields.iter().flat_map(Field::cells).cloned().collect(),
                    facts: [stated(lead), beside].concat(),
                    width: self.block.unwrap_or(COLUMNS),
                    gap: std::mem::take(&mut gap),
                }),
                None if rest.trim().is_empty() => gap.blanks += 1,
                None => gap.others += 1,
            }
        }
        rows
    }

    /// The names of the columns, in a line before the first frame.
    fn name_columns(&mut self, head: &[Line], columns: usize) {
        for line in head {
            let text = self.text(line).into_owned();
            let rest = self.leads.split(&text, columns.min(PIXELS)).1;
            let caption = rest
                .trim_start_matches(['#', '%', ' '])
                .trim_matches(['*', '|']);
            let names: Vec<String> = self
                .separator
                .split(caption)
                .iter()
                .map(|name| unquoted(name))
                .collect();
            let fields = self.fields(rest);
            // `(0, 0)` is a name, and no list.
            let pairs = fields
                .iter()
                .filter(|field| matches!(field, Field::Many(cells) if cells.len() == 2))
                .count();
            let is_row = is_wide(&fields)
                && !(pairs >= PIXELS && rest.contains('('))
                && numbers(&fields) > 0
                && !is_comment(rest);
            let is_data = is_row || (columns < PIXELS && cells_of_block(&fields) == Some(columns));
            // A row of numbers names columns if they count up, as pandas writes them.
            let is_name = |name: &String| {
                name.parse::<f64>().is_err()
                    && (name.is_empty() || name.contains(char::is_alphanumeric))
            };
            let is_header = !is_data && names.iter().all(is_name);
            if is_header || (is_data && counts_up(&names)) {
                // R writes no name above those of the rows.
                let unnamed = usize::from(names.len() + 1 == columns);
                if names.len() + unnamed == columns {
                    if self.names.is_none()
                        || is_comment(self.headers.last().map_or("", String::as_str))
                        || counts_up(&names)
                        || names.iter().any(|name| name.len() > 3)
                    {
                        self.names = Some([vec![String::new(); unnamed], names].concat());
                    } else {
                        // A second line has the units.
                        self.unit = self.unit.or_else(|| Unit::behind(names.last()?));
                    }
                    self.headers.push(text.trim().to_owned());
                    if is_data {
                        return;
                    }
                }
            }
            if is_data {
                return;
            }
        }
    }
}

/// Whether a lead has a frame's numbers itself.
fn list_in(lead: &str) -> bool {
    let tokens = lead.split(|letter: char| letter.is_whitespace() || ",;[]()".contains(letter));
    tokens
        .filter(|token| split::number(token).is_some())
        .count()
        >= PIXELS
}

/// The unit that stands behind the numbers of most lines.
fn unit_of<'t>(texts: impl Iterator<Item = &'t str>) -> Option<Unit> {
    let between = |letter: char| letter.is_whitespace() || ",;[](){}|*\"'".contains(letter);
    let mut counts = BTreeMap::<&str, usize>::new();
    for text in texts {
        let found = text.split(between).filter_map(split::unit_of);
        let found: Vec<&'static str> = found.collect();
        if found.len() >= COLUMNS {
            *counts.entry(found[0]).or_default() += 1;
        }
    }
    let (unit, _) = counts.into_iter().max_by_key(|(_, count)| *count)?;
    Unit::behind(unit)
}

pub(super) fn is_comment(text: &str) -> bool {
    // Between signs is a frame that is drawn around.
    let text = text.trim();
    text.starts_with(['#', '%']) && !(text.len() > 1 && text.ends_with('#'))
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

/// The number of cells of a row of a block: eight numbers at the end, and a few cells before them.
fn cells_of_block(row: &[Field]) -> Option<usize> {
    let cells: Vec<&Cell> = row.iter().flat_map(Field::cells).collect();
    let fits = (COLUMNS..=COLUMNS + BESIDE_MAX).contains(&cells.len());
    let is_number = |cell: &&Cell| cell.number().is_some();
    (fits && cells.iter().rev().take(COLUMNS).all(is_number)).then_some(cells.len())
}

/// Where the comma of `16:00:00,123` stands.
fn clock_comma(text: &str) -> Option<usize> {
    let bytes = text.as_bytes();
    let digit = |at: usize| bytes.get(at).is_some_and(u8::is_ascii_digit);
    let is_clock = |at: usize| {
        let colon = |back: usize| at >= back && bytes[at - back] == b':';
        let fraction = [1, 2, 3].iter().all(|ahead| digit(at + ahead))
            && !digit(at + 4)
            && bytes.get(at + 4) != Some(&b'.');
        at >= 7 && colon(3) && colon(6) && digit(at - 1) && digit(at - 2) && fraction
    };
    let found = text
        .match_indices(',')
        .map(|(at, _)| at)
        .find(|at| is_clock(*at));
    found.filter(|at| bytes[..*at].iter().filter(|byte| **byte == b',').count() <= 2)
}

/// Whether what follows a comma behind a time of day are milliseconds in all lines, and no column.
fn has_clock_commas(head: &[Line]) -> bool {
    let clocks =
        |line: &&Line| line.text.matches(':').count() >= 2 && Leads::ends_in(&line.text, COLUMNS);
    let mut millis = Vec::new();
    for line in head.iter().filter(clocks) {
        let Some(at) = clock_comma(&line.text) else {
            return false;
        };
        millis.push(line.text[at + 1..at + 4].to_owned());
        let after = &line.text[at + 5..];
        if line.text.as_bytes().get(at + 4) == Some(&b',')
            && !(Leads::ends_in(after, PIXELS) || after.contains('['))
        {
            return false;
        }
    }
    let values = millis.iter().filter_map(|text| text.parse::<u16>().ok());
    let spread = values.clone().max().unwrap_or(0) - values.min().unwrap_or(0);
    !millis.is_empty() && (spread >= 100 || millis.iter().any(|text| text.starts_with('0')))
}

/// Whether 64 of the names are numbers that count up from 0 or 1.
fn counts_up(names: &[String]) -> bool {
    let numbers: Vec<Option<u64>> = names.iter().map(|name| name.parse::<u64>().ok()).collect();
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
