//! Results on standard output.
//!
//! Whoever reads them may stop early (`grideye … | head`). That is no error: files are still written, and the exit code
//! is still the answer's.

use crate::files;
use anyhow::{Context as _, Result};
use std::fmt;
use std::io::{self, ErrorKind, Write as _};
use std::path::PathBuf;

/// [`print!`] that fails if results cannot be written, but not if the reader has gone.
macro_rules! out {
    ($($argument:tt)*) => { $crate::output::write(format_args!($($argument)*)) };
}

macro_rules! outln {
    ($($argument:tt)*) => { $crate::output::write(format_args!("{}\n", format_args!($($argument)*))) };
}

pub(crate) use {out, outln};

/// Writes and flushes, because a program may be waiting.
pub(crate) fn write(text: fmt::Arguments<'_>) -> Result<()> {
    let mut stdout = io::stdout().lock();
    match stdout.write_fmt(text).and_then(|()| stdout.flush()) {
        Err(error) if error.kind() == ErrorKind::BrokenPipe => Ok(()),
        written => written.context(
            "cannot write the result to standard output\nhint: is the disk that it goes to full?",
        ),
    }
}

/// Prints an answer and writes it as JSON to the file, if given; for `-`, prints only JSON.
pub(crate) fn answer(
    file: Option<&PathBuf>,
    json: impl FnOnce() -> String,
    text: impl FnOnce() -> String,
) -> Result<()> {
    match file {
        Some(path) if path.as_os_str() == "-" => return out!("{}", json()),
        Some(path) => files::write_text(path, &json())?,
        None => {}
    }
    out!("{}", text())
}
