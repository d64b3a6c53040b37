//! `grideye convert`: one recording format into another.

use crate::cli::Convert;
use crate::exit::{Outcome, bad_input};
use crate::{files, progress, recordings};
use anyhow::{Result, anyhow};
use grideye_recording::csv::Writer;

/// Reads any recording and writes this project's CSV.
pub(crate) fn run(options: &Convert) -> Result<Outcome> {
    if options
        .output
        .extension()
        .is_none_or(|extension| extension != "csv")
    {
        return Err(bad_input(anyhow!(
            "cannot tell what to write from the name {}\nhint: end it with .csv",
            options.output.display()
        )));
    }
    let rows = recordings::open(&options.input)?;
    let mut written = 0;
    files::write_whole(&options.output, |out| {
        let mut writer = Writer::new(out)?;
        for row in rows {
            writer.write(&row?)?;
        }
        written = writer.rows();
        writer.finish()?;
        Ok(())
    })?;
    progress::say(&format!(
        "wrote {written} rows to {}",
        options.output.display()
    ));
    Ok(Outcome::Done)
}
