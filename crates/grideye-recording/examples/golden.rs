//! Writes the golden recording to standard output: see `recordings/README.md`.

#[path = "../tests/suite/golden.rs"]
mod golden;

use grideye_recording::RecordingError;
use grideye_recording::csv::Writer;
use std::io;

fn main() -> Result<(), RecordingError> {
    let mut writer = Writer::new(io::stdout().lock())?;
    for row in golden::rows() {
        writer.write(&row)?;
    }
    writer.finish().map(drop)
}
