//! Lines of a text; a list that goes over several of them is one.

use crate::error::ImportError;
use std::io::{BufRead, BufReader, Read};

/// Bytes of the longest line; a frame printed with 18 decimals has about 1,700.
const LINE_BYTES_MAX: usize = 1 << 20;
/// A list may go over as many lines.
const JOINED_MAX: usize = 24;
const BYTE_ORDER_MARK: char = '\u{feff}';

#[derive(Debug, Clone)]
pub(super) struct Line {
    /// Of its beginning, from 1.
    pub(super) number: u64,
    pub(super) text: String,
    /// Whether a newline followed.
    pub(super) ended: bool,
}

pub(super) struct Lines<R> {
    input: BufReader<R>,
    number: u64,
}

impl<R: Read> Lines<R> {
    pub(super) fn new(input: R) -> Self {
        Self {
            input: BufReader::new(input),
            number: 0,
        }
    }

    /// The next line that is not blank.
    pub(super) fn next(&mut self) -> Result<Option<Line>, ImportError> {
        loop {
            let Some(mut line) = self.physical()? else {
                return Ok(None);
            };
            if line.text.trim().is_empty() {
                continue;
            }
            let mut joined = 1;
            while is_open(&line.text) && joined < JOINED_MAX {
                let Some(more) = self.physical()? else {
                    line.ended = false;
                    break;
                };
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
        read.map_err(|error| ImportError::broken(place(), error.to_string()))?;
        if bytes.is_empty() {
            return Ok(None);
        }
        let ended = bytes.ends_with(b"\n");
        if !ended && bytes.len() == LINE_BYTES_MAX {
            let long = format!("more than {LINE_BYTES_MAX} bytes without a newline");
            return Err(ImportError::broken(place(), long));
        }
        self.number = number;
        let text = String::from_utf8_lossy(&bytes);
        let text = text.trim_end_matches(['\n', '\r']);
        let text = match number {
            1 => text.trim_start_matches(BYTE_ORDER_MARK),
            _ => text,
        };
        Ok(Some(Line {
            number,
            text: text.to_owned(),
            ended,
        }))
    }
}

/// Whether a list or a quotation goes on in the next line.
fn is_open(text: &str) -> bool {
    let (mut depth, mut quoted) = (0_i32, false);
    for byte in text.bytes() {
        match byte {
            b'"' => quoted = !quoted,
            b'[' => depth += 1,
            b']' => depth -= 1,
            _ => {}
        }
    }
    quoted || depth > 0
}
