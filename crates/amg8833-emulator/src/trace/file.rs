//! The bounded writer of both trace formats; it keeps its first error.

use alloc::string::String;
use core::fmt;
use std::io::{self, BufWriter, Write};
use std::sync::{Arc, Mutex, PoisonError};

/// The default limit of a trace; later messages are counted but not written.
pub const TRACE_BYTES_MAX: u64 = 1 << 30;

/// The outcome of a trace.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct TraceSummary {
    /// Messages written to the file.
    pub messages: u64,
    /// Messages that came after the file was full.
    pub left_out: u64,
}

impl fmt::Display for TraceSummary {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{} messages", self.messages)?;
        if self.left_out > 0 {
            write!(formatter, ", {} more did not fit", self.left_out)?;
        }
        Ok(())
    }
}

/// A bus trace in format `D`, complete after [`finish`](Self::finish). Clones share the file.
pub struct TraceFile<W: Write, D>(Arc<Mutex<File<W, D>>>);

struct File<W: Write, D> {
    out: BufWriter<W>,
    drawing: D,
    bytes_left: u64,
    summary: TraceSummary,
    error: Option<io::Error>,
    line: String,
}

impl<W: Write, D> TraceFile<W, D> {
    pub(crate) fn begin(out: W, header: &str, bytes_max: u64, drawing: D) -> Self {
        let mut file = File {
            out: BufWriter::new(out),
            drawing,
            bytes_left: bytes_max,
            summary: TraceSummary::default(),
            error: None,
            line: String::from(header),
        };
        file.put();
        Self(Arc::new(Mutex::new(file)))
    }

    /// Writes one message: `put` appends its text.
    pub(crate) fn message(&self, put: impl FnOnce(&mut D, &mut String)) {
        let mut file = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let File { drawing, line, .. } = &mut *file;
        put(drawing, line);
        if file.put() {
            file.summary.messages += 1;
        } else {
            file.summary.left_out += 1;
        }
    }

    /// Flushes buffered text.
    ///
    /// # Errors
    /// The writer's first error; nothing was written after it.
    pub fn finish(&self) -> io::Result<TraceSummary> {
        let mut file = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        match file.error.take() {
            Some(error) => Err(error),
            None => file.out.flush().map(|()| file.summary),
        }
    }
}

impl<W: Write, D> File<W, D> {
    /// Writes the line and clears it; `false` if it did not reach the file.
    fn put(&mut self) -> bool {
        let length = u64::try_from(self.line.len()).unwrap_or(u64::MAX);
        let fits = length <= self.bytes_left && self.error.is_none();
        if fits {
            self.bytes_left -= length;
            self.error = self.out.write_all(self.line.as_bytes()).err();
        } else {
            // Once one line is dropped, no shorter one may follow.
            self.bytes_left = 0;
        }
        self.line.clear();
        fits && self.error.is_none()
    }
}

impl<W: Write, D> Clone for TraceFile<W, D> {
    fn clone(&self) -> Self {
        Self(Arc::clone(&self.0))
    }
}

impl<W: Write, D> fmt::Debug for TraceFile<W, D> {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.debug_struct("Trace").finish_non_exhaustive()
    }
}
