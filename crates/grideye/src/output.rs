//! Results on standard output, and answers as JSON.

use crate::files;
use anyhow::Result;
use std::fmt;
use std::path::PathBuf;

/// [`print!`] that fails if results cannot be written, but not if the reader has gone.
macro_rules! out {
    ($($argument:tt)*) => { $crate::output::write(format_args!($($argument)*)) };
}

macro_rules! outln {
    ($($argument:tt)*) => { $crate::output::write(format_args!("{}\n", format_args!($($argument)*))) };
}

pub(crate) use {out, outln};

pub(crate) fn write(text: fmt::Arguments<'_>) -> Result<()> {
    Ok(grideye_agent::output::result(text)?)
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
