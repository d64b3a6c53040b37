//! Labels of a recording as a CSV file: which frames of which sensor have which label.
//!
//! One line per range of frames. A label on several sensors has a line for each, all with its number. The keys are
//! those of the recording's rows, so that the two files join without a clock.
//!
//! ```
//! use grideye_recording::labels::{LabeledFrames, to_csv};
//!
//! let (label, device, sensor, boot) = ("two people", "pi-1", "i2c-1:0x69", "b1");
//! let range = LabeledFrames { number: 1, label, device, sensor, boot, first_seq: 10, last_seq: 25 };
//! let text = to_csv([range])?;
//! assert!(text.ends_with(b"\n1,two people,pi-1,i2c-1:0x69,b1,10,25\n"));
//! # Ok::<(), csv::Error>(())
//! ```

use serde::Serialize;

const HEADER: [&str; 7] = [
    "number",
    "label",
    "device",
    "sensor",
    "boot",
    "first_seq",
    "last_seq",
];

/// One labeled range of frames of one stream.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct LabeledFrames<'l> {
    /// The label's number in its recording, from 1.
    pub number: i64,
    /// Its text.
    pub label: &'l str,
    /// The agent's name.
    pub device: &'l str,
    /// The sensor.
    pub sensor: &'l str,
    /// The boot.
    pub boot: &'l str,
    /// The first frame.
    pub first_seq: u64,
    /// The last frame.
    pub last_seq: u64,
}

/// The file's bytes; without labels, just the header.
///
/// # Errors
/// None known, because it writes to memory.
pub fn to_csv<'l>(
    ranges: impl IntoIterator<Item = LabeledFrames<'l>>,
) -> Result<Vec<u8>, ::csv::Error> {
    let mut writer = ::csv::WriterBuilder::new()
        .has_headers(false)
        .from_writer(Vec::new());
    writer.write_record(HEADER)?;
    for range in ranges {
        writer.serialize(range)?;
    }
    writer
        .into_inner()
        .map_err(|error| ::csv::Error::from(error.into_error()))
}
