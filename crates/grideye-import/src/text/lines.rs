//! Lines of a text; a list that goes over several of them is one.

use crate::error::ImportError;
use std::io::{BufRead, BufReader, Read};

/// Bytes of the longest line; a frame printed with 18 decimals has about 1,700, an image of 160 x 120 pixels 120,000.
const LINE_BYTES_MAX: usize = 1 << 18;
/// A list may go over as many lines.
const JOINED_MAX: usize = 24;
const BYTE_ORDER_MARK: char = '\u{feff}';

#[derive(Debug, Clone, Default)]
pub(super) struct Line {
    /// Of its beginning, from 1.
    pub(super) number: u64,
    pub(super) text: String,
    /// Whether a newline followed.
    pub(super) ended: bool,
    /// Blank lines before it; a cleared screen is one.
    pub(super) blanks: usize,
}

pub(super) struct Lines<R> {
    input: BufReader<R>,
    number: u64,
    /// A line that begins a list while another was open.
    begun: Option<Line>,
}

impl<R: Read> Lines<R> {
    pub(super) fn new(input: R) -> Self {
        Self {
            input: BufReader::new(input),
            number: 0,
            begun: None,
        }
    }

    /// The next line that is not blank.
    pub(super) fn next(&mut self) -> Result<Option<Line>, ImportError> {
        let mut blanks = 0;
        loop {
            let begun = self.begun.take();
            let Some(mut line) = begun.map_or_else(|| self.physical(), |line| Ok(Some(line)))?
            else {
                return Ok(None);
            };
            blanks += line.blanks;
            if line.text.trim().is_empty() {
                blanks += 1;
                continue;
            }
            line.blanks = blanks;
            let mut joined = 1;
            let quoted = line.text.matches('"').count() % 2 == 1;
            while joined < JOINED_MAX && line.text.len() < LINE_BYTES_MAX && is_open(&line.text) {
                let Some(more) = self.physical()? else {
                    line.ended = false;
                    break;
                };
                if more.text.trim_start().starts_with("[[") || !quoted && !continues(&more.text) {
                    self.begun = Some(more);
                    break;
                }
                line.text.push(' ');
                line.text.push_str(&more.text);
                line.ended = more.ended;
                joined += 1;
            }
            return Ok(Some(line));
        }
    }

    fn physical(&mut self) -> Result<Option<Line>, ImportError> {
        let number = self.number + 1;
        let mut bytes = Vec::new();
        let limit = u64::try_from(LINE_BYTES_MAX).unwrap_or(u64::MAX);
        let mut limited = (&mut self.input).take(limit);
        let place = || format!("line {number}");
        let read = limited.read_until(b'\n', &mut bytes);
        read.map_err(|error| ImportError::unread(place(), &error))?;
        if bytes.is_empty() {
            return Ok(None);
        }
        let ended = bytes.ends_with(b"\n");
        if !ended && bytes.len() == LINE_BYTES_MAX {
            let long = format!("more than {LINE_BYTES_MAX} bytes without a newline");
            return Err(ImportError::broken(place(), long));
        }
        self.number = number;
        let text = decoded(bytes);
        let text = text.trim_end_matches(['\n', '\r']);
        let text = match number {
            1 => text.trim_start_matches(BYTE_ORDER_MARK),
            _ => text,
        };
        let (text, blanks) = without_escapes(text);
        Ok(Some(Line {
            number,
            text,
            ended,
            blanks,
        }))
    }
}

/// UTF-8, else Latin-1, in which every byte is a character.
fn decoded(bytes: Vec<u8>) -> String {
    String::from_utf8(bytes)
        .unwrap_or_else(|error| error.into_bytes().into_iter().map(char::from).collect())
}

/// Without a terminal's control sequences (ECMA-48), and whether one of them cleared the screen.
fn without_escapes(text: &str) -> (String, usize) {
    let (mut plain, mut rest, mut cleared) = (String::new(), text, 0);
    while let Some((before, sequence)) = rest.split_once('\u{1b}') {
        plain += before;
        let end = sequence.find(|last: char| last.is_ascii_alphabetic());
        let (code, after) = sequence.split_at(end.map_or(sequence.len(), |end| end + 1));
        if code.ends_with(['J', 'H']) {
            cleared = 1;
        }
        rest = after;
    }
    (plain + rest, cleared)
}

/// Whether a line has nothing but numbers of a list, and what numpy writes behind them.
fn continues(text: &str) -> bool {
    let numbers = text.split("dtype").next().unwrap_or_default();
    numbers
        .chars()
        .all(|letter| letter.is_ascii_digit() || " \t+-.,;eE[]()naN'".contains(letter))
}

/// Whether a quotation or a list of numbers goes on in the next line.
fn is_open(text: &str) -> bool {
    let (mut opened, mut quoted) = (Vec::new(), false);
    for (at, byte) in text.bytes().enumerate() {
        match byte {
            b'"' => quoted = !quoted,
            b'[' => opened.push(at),
            b']' => {
                opened.pop();
            }
            _ => {}
        }
    }
    let is_of_numbers = |from: usize| {
        let mut inside = text[from..].chars();
        !inside.any(|letter| letter.is_alphabetic() && !"eEnaNrym".contains(letter))
    };
    quoted || opened.first().is_some_and(|from| is_of_numbers(*from))
}
