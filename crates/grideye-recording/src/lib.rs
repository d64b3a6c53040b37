//! Sensor frames on the wire and on disk: the record, and the formats that carry it.
//!
//! ```text
//!  agent ──▶ wire::Batch ──JSON──▶ collector ──▶ csv::Writer ──▶ recording.csv ──▶ csv::Reader ──▶ Row
//!        ◀── wire::Acknowledgement ◀──┘
//! ```
//!
//! | format | carries | bits of a word | error |
//! |---|---|---|---|
//! | [`wire`] (JSON) | one batch per device and half second, and its answer | all 16 | [`wire::WireError`]: path, expected, found |
//! | [`wire`] (bytes) | the same batch, about a quarter as long | all 16 | the same, with the place in the body |
//! | [`mod@csv`] (`recordings/README.md`) | one row per sensor frame, missing ones with a reason | the 12 that mean degrees | [`RecordingError`]: line, column, expected, found |
//!
//! Memory does not grow with the recording. Only `grideye_frame::word` converts words to degrees. The crate must not know
//! I2C transfers, HTTP servers, scenes, sockets or clocks, and uses files only in [`whole`].
//!
//! ```
//! use grideye_frame::{NoData, Reading};
//! use grideye_recording::csv::{Reader, Writer};
//! use grideye_recording::{ClockState, Record, Row, Stamp, StreamId};
//!
//! let row = Row {
//!     stream: StreamId { device: "pi-1".to_owned(), sensor: "i2c-1:0x69".to_owned(), boot: "5f0c1d2e".to_owned() },
//!     record: Record {
//!         seq: 17,
//!         stamp: Stamp { t_boot_ns: 1_700_000_000, t_utc_ns: 0, clock: ClockState::Unsynced },
//!         reading: Reading::NoData(NoData::ShortTransfer),
//!     },
//!     t_arrival_ns: None,
//!     labels: Vec::new(),
//! };
//! let mut writer = Writer::new(Vec::new())?;
//! writer.write(&row)?;
//! let recording = writer.finish()?;
//! assert_eq!(Reader::new(recording.as_slice())?.next().expect("one row was written")?, row);
//! # Ok::<(), grideye_recording::RecordingError>(())
//! ```

mod cell;
mod error;
mod lines;
mod sniff;
mod text;

pub mod csv;
pub mod labels;
pub mod level;
pub mod prometheus;
pub mod record;
pub mod whole;
pub mod wire;

pub use error::RecordingError;
pub use grideye_frame::NAME_CHARS_MAX;
pub use record::{
    COUNT_MAX, ClockState, NameError, Record, Row, Stamp, StreamId, UnknownClockState, check_name,
};
pub use sniff::{is_known_size, is_recording, sensor_of};
pub use text::{is_hidden, printable, printable_lines};
