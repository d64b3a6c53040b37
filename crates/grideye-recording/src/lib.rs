//! Sensor frames on the wire and on disk: the record, and the formats that carry it.
//!
//! | format | carries | bits of a word | error |
//! |---|---|---|---|
//! | [`wire`] (JSON) | one batch per device and half second, and its answer | all 16 | [`wire::WireError`]: path, expected, found |
//! | [`wire`] (bytes) | the same batch, about a quarter as long | all 16 | the same, with the place in the body |
//! | [`mod@csv`] (`recordings/README.md`) | one row per sensor frame, missing ones with a reason | the 12 that mean degrees | [`RecordingError`]: line, column, expected, found |
//! | [`linaige`] (read only) | frames with labels | as above | [`RecordingError`] |
//!
//! The crate uses no sockets and no clocks, and files only in [`whole`]. Memory does not grow with the recording.
//!
//! ```
//! use grideye_recording::csv::{Reader, Writer};
//! use grideye_recording::linaige::{self, Date, stream_from_file_name};
//!
//! // A LINAIGE session, cut down to one frame, becomes a recording and is read back.
//! let name = "Session2_2021-07-01_RoomB_v2.csv";
//! let session = format!("{}\n18_14_07.274925,30.625{},0,e\n", linaige::header(), ",26.5".repeat(64));
//! let rows = linaige::Reader::new(session.as_bytes(), Date::from_file_name(name)?, stream_from_file_name(name))?;
//!
//! let mut writer = Writer::new(Vec::new())?;
//! for labeled in rows {
//!     writer.write(&labeled?.row)?;
//! }
//! let recording = writer.finish()?;
//! let row = Reader::new(recording.as_slice())?.next().expect("one row was written")?;
//! assert_eq!(row.record.stamp.t_utc_ns, 1_625_163_247_274_925_000);
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
pub mod linaige;
pub mod prometheus;
pub mod record;
pub mod whole;
pub mod wire;

pub use error::RecordingError;
pub use grideye_frame::NAME_CHARS_MAX;
pub use record::{
    COUNT_MAX, ClockState, NameError, Record, Row, Stamp, StreamId, UnknownClockState, check_name,
};
pub use sniff::{Layout, is_known_size, sensor_of, sniff};
