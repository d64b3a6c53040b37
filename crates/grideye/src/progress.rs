//! Progress on a terminal; nothing where no person is looking.

use indicatif::{ProgressBar, ProgressStyle};

/// A bar on standard error that counts to `total`; invisible unless standard error is a terminal.
pub(crate) fn bar(total: u64, what: &'static str) -> ProgressBar {
    let bar = ProgressBar::new(total).with_message(what);
    if let Ok(style) =
        ProgressStyle::with_template("  {msg:<12} {bar:32} {pos}/{len}  {per_sec}, {eta} left")
    {
        bar.set_style(style);
    }
    bar
}

/// A count on standard error of what has no known end; invisible unless standard error is a terminal.
pub(crate) fn count(what: &'static str) -> ProgressBar {
    let spinner = ProgressBar::new_spinner().with_message(what);
    if let Ok(style) = ProgressStyle::with_template("  {spinner} {pos} {msg}  {per_sec}") {
        spinner.set_style(style);
    }
    spinner
}

/// One line of what happens, on standard error.
pub(crate) fn say(line: &str) {
    eprintln!("{line}");
}
