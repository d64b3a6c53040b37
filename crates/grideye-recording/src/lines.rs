//! Reads a text file line by line, with a length limit and line numbers, and detects a cut line.

use crate::error::RecordingError;
use std::io::{BufRead, BufReader, Read};

/// Maximum line of any layout here in bytes: several times the longest written one.
pub(crate) const LINE_BYTES_MAX: usize = 4096;

/// U+FEFF in UTF-8.
pub(crate) const BYTE_ORDER_MARK: &[u8] = b"\xef\xbb\xbf";

#[derive(Debug)]
pub(crate) struct Lines<R> {
    input: BufReader<R>,
    buffer: Vec<u8>,
    number: u64,
}

/// One line without its end.
pub(crate) struct Line<'l> {
    /// From 1.
    pub(crate) number: u64,
    pub(crate) text: &'l str,
    /// Whether a newline followed; if not, the file may have been cut within this line.
    pub(crate) ended: bool,
}

impl<R: Read> Lines<R> {
    pub(crate) fn new(input: R) -> Self {
        Self {
            input: BufReader::new(input),
            buffer: Vec::new(),
            number: 0,
        }
    }

    pub(crate) fn next(&mut self) -> Result<Option<Line<'_>>, RecordingError> {
        let line = self.number + 1;
        self.buffer.clear();
        self.fill(line)?;
        if self.buffer.is_empty() {
            return Ok(None);
        }
        self.number = line;
        let ended = self.buffer.last() == Some(&b'\n');
        let mut bytes = self.buffer.as_slice();
        if ended {
            bytes = bytes.strip_suffix(b"\n").unwrap_or(bytes);
            // Spreadsheets write both.
            bytes = bytes.strip_suffix(b"\r").unwrap_or(bytes);
        }
        if line == 1 {
            // Some editors put this before UTF-8; ignore it.
            bytes = bytes.strip_prefix(BYTE_ORDER_MARK).unwrap_or(bytes);
        }
        match core::str::from_utf8(bytes) {
            Ok(text) => Ok(Some(Line {
                number: line,
                text,
                ended,
            })),
            Err(error) => {
                let byte = bytes.get(error.valid_up_to()).copied().unwrap_or_default();
                let column = error.valid_up_to() + 1;
                let what =
                    format!(": expected text in UTF-8, found byte {byte:#04x} at column {column}");
                Err(RecordingError::refused(line, what))
            }
        }
    }

    /// Reads through the next newline into the buffer.
    fn fill(&mut self, line: u64) -> Result<(), RecordingError> {
        loop {
            let available = match self.input.fill_buf() {
                Ok(available) => available,
                Err(error) if error.kind() == std::io::ErrorKind::Interrupted => continue,
                Err(source) => return Err(RecordingError::Io { line, source }),
            };
            let newline = available.iter().position(|byte| *byte == b'\n');
            let taken = newline.map_or(available.len(), |place| place + 1);
            if self.buffer.len() + taken > LINE_BYTES_MAX {
                let what = format!(": expected at most {LINE_BYTES_MAX} bytes, found more");
                return Err(RecordingError::refused(line, what));
            }
            self.buffer
                .extend_from_slice(available.get(..taken).unwrap_or(available));
            self.input.consume(taken);
            if newline.is_some() || taken == 0 {
                return Ok(());
            }
        }
    }
}

impl<'l> Line<'l> {
    /// The line without its last fields, and these, if there are `after` of them behind `before` others.
    pub(crate) fn split_after(
        self,
        before: usize,
        after: usize,
    ) -> Result<(Line<'l>, Vec<String>), RecordingError> {
        if after == 0 {
            return Ok((self, Vec::new()));
        }
        let commas = self.text.match_indices(',');
        let Some((at, _)) = commas
            .clone()
            .nth(before - 1)
            .filter(|_| commas.count() == before + after - 1)
        else {
            let found = self.text.split(',').count();
            return Err(RecordingError::field_count(
                self.number,
                before + after,
                found,
            ));
        };
        let labels = self.text[at + 1..].split(',').map(str::to_owned).collect();
        let text = &self.text[..at];
        Ok((Self { text, ..self }, labels))
    }

    pub(crate) fn cut(&self) -> RecordingError {
        RecordingError::CutLine {
            line: self.number,
            bytes: self.text.len(),
        }
    }

    /// The fields between the commas, if there are as many as the layout has.
    pub(crate) fn fields<const N: usize>(&self) -> Result<[&str; N], RecordingError> {
        let mut fields = [""; N];
        let mut found = 0;
        for field in self.text.split(',') {
            if let Some(slot) = fields.get_mut(found) {
                *slot = field;
            }
            found += 1;
        }
        if found == N {
            Ok(fields)
        } else {
            Err(RecordingError::field_count(self.number, N, found))
        }
    }
}
