//! Standard output and standard error of both programs.
//!
//! Whoever reads them may stop early (`grideye … | head`), and a log's disk may be full. Neither changes what a program
//! does or its exit code; only a result that cannot be written is an error. `print!` and its kin panic instead, so
//! nothing else writes there. What others named (files, columns, sensors) controls no terminal: see [`printable`].
//!
//! [`printable`]: grideye_recording::printable

use clap::{ArgMatches, Command, FromArgMatches};
use grideye_recording::printable_lines;
use std::fmt::{Arguments, Display};
use std::io::{self, ErrorKind, Write as _};
use std::process;

/// Writes a result to standard output, and flushes it, because a program may be waiting.
/// # Errors
/// If it cannot be written, but not if the reader has gone.
pub fn result(text: Arguments<'_>) -> io::Result<()> {
    let mut stdout = io::stdout().lock();
    let text = printable_lines(&text.to_string());
    match stdout
        .write_all(text.as_bytes())
        .and_then(|()| stdout.flush())
    {
        Err(error) if error.kind() != ErrorKind::BrokenPipe => {
            let told = format!(
                "cannot write the result to standard output: {error}\nhint: is the disk that it goes to full?"
            );
            Err(io::Error::new(error.kind(), told))
        }
        _written_or_unread => Ok(()),
    }
}

/// Writes a line to standard error; where that is closed or full, the line is lost and nothing else.
pub fn say(line: &(impl Display + ?Sized)) {
    let line = printable_lines(&line.to_string());
    let _ = writeln!(io::stderr().lock(), "{line}");
}

/// The arguments of this program. Exits if they are wrong (2) or ask for help (0, or 1 if it cannot be written).
#[must_use]
pub fn arguments<T: FromArgMatches>(command: Command) -> T {
    let matches = command.try_get_matches();
    let parsed = matches.and_then(|matches: ArgMatches| T::from_arg_matches(&matches));
    parsed.unwrap_or_else(|told| {
        let text = told.render().to_string();
        if told.use_stderr() {
            say(text.trim_end());
        } else if let Err(error) = told.print() {
            if error.kind() != ErrorKind::BrokenPipe {
                say(&format_args!("error: cannot write the help: {error}"));
                process::exit(1)
            }
        }
        process::exit(told.exit_code())
    })
}
