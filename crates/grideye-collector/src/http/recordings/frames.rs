//! The frames of a recording for playback in the page: one response with rows of fixed length, little-endian.
//!
//! | bytes | what |
//! |---|---|
//! | 4 | the mark `GEF1` |
//! | 4 | length of the head in bytes, a multiple of 8 including padding |
//! | … | the head: JSON, padded with spaces |
//! | 168 each | the rows, ordered by stream and sequence number |
//!
//! | at | type | of a row |
//! |---|---|---|
//! | 0 | u64 | sequence number |
//! | 8 | u64 | `t_boot_ns` |
//! | 16 | i64 | `t_utc_ns` |
//! | 24 | i64 | `t_arrival_ns` |
//! | 32 | u16 | index of the stream |
//! | 34 | u8 | 0: a frame; otherwise 1 + index of the reason why it is missing |
//! | 35 | u8 | index of the clock state |
//! | 36 | i16 | thermistor in steps; 0 without a frame, -32768 if not known |
//! | 38 | u16 | 0 |
//! | 40 | 64 × i16 | pixels in steps, pixel 1 first; 0 without a frame |

use crate::http::recordings::download::{self, Form};
use crate::http::recordings::fields::not_written;
use crate::http::refusal::Refusal;
use crate::http::state::AppState;
use crate::store::{Members, StoredRecord};
use axum::http::{StatusCode, header};
use axum::response::{IntoResponse, Response};
use grideye_frame::word;
use grideye_frame::{NoData, PIXELS, Reading, RecordedFrame};
use grideye_recording::record::layout::put_number_and_times;
use grideye_recording::{ClockState, Record, StreamId};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::io;

const MAGIC: &[u8; 4] = b"GEF1";
const ROW_BYTES: usize = 40 + 2 * PIXELS;

/// All rows of the recording, unless they are too many for a browser.
pub(super) fn answer(state: AppState, members: Members) -> Result<Response, Refusal> {
    let rows = members
        .recording
        .frames
        .saturating_add(members.recording.missing);
    let rows_max = state.limits().playback_rows_max;
    if rows > rows_max {
        let id = members.recording.id;
        let what = format!("recording {id} has {rows} rows; a browser can play at most {rows_max}");
        return Err(
            Refusal::new(StatusCode::UNPROCESSABLE_ENTITY, "too_long_to_play", what)
                .hint(format!("GET /v1/recordings/{id}.csv downloads all of it")),
        );
    }
    let streams = members.spans.iter().map(|span| &*span.stream);
    let frames = Rows {
        bytes: head(streams, rows)?,
    };
    let kind = [(header::CONTENT_TYPE, "application/octet-stream")];
    Ok((kind, download::body(state, members, frames)).into_response())
}

/// The same of frames that the collector does not have: each arrived when its device measured it.
///
/// # Errors
/// If these are more streams than a recording may hold.
pub fn played(streams: &BTreeMap<StreamId, Vec<Record>>) -> Result<Vec<u8>, Refusal> {
    let rows = streams.values().map(Vec::len).sum::<usize>();
    let mut frames = Rows {
        bytes: head(streams.keys(), u64::try_from(rows).unwrap_or(u64::MAX))?,
    };
    for (stream, records) in streams.values().enumerate() {
        for record in records {
            let t_arrival_ns = i64::try_from(record.stamp.t_boot_ns).unwrap_or(i64::MAX);
            let put = frames.put(stream, record, t_arrival_ns);
            put.map_err(not_written)?;
        }
    }
    Ok(frames.bytes)
}

fn head<'a>(
    streams: impl ExactSizeIterator<Item = &'a StreamId>,
    rows: u64,
) -> Result<Vec<u8>, Refusal> {
    let too_many =
        |what: &str| Refusal::new(StatusCode::UNPROCESSABLE_ENTITY, "too_many_streams", what);
    if u16::try_from(streams.len()).is_err() {
        return Err(too_many("the recording holds too many streams"));
    }
    let streams: Vec<Value> = streams
        .map(|stream| {
            json!({ "device": stream.device, "sensor": stream.sensor, "boot": stream.boot })
        })
        .collect();
    let reasons: Vec<&str> = NoData::ALL.iter().map(|reason| reason.name()).collect();
    let head = json!({
        "row_bytes": ROW_BYTES,
        "rows": rows,
        "streams": streams,
        "reasons": reasons,
        "clocks": ClockState::ALL.map(ClockState::name),
        "pixel_step_celsius": word::PIXEL_STEP.get(),
        "thermistor_step_celsius": word::THERMISTOR_STEP.get(),
    });
    let mut head = head.to_string().into_bytes();
    head.resize(head.len().next_multiple_of(8), b' ');
    let length = u32::try_from(head.len())
        .map_err(|_too_long| too_many("the names of the streams are too long"))?;
    let mut bytes = MAGIC.to_vec();
    bytes.extend(length.to_le_bytes());
    bytes.extend(head);
    Ok(bytes)
}

struct Rows {
    bytes: Vec<u8>,
}

impl Form for Rows {
    fn write(&mut self, stream: usize, row: StoredRecord) -> io::Result<()> {
        self.put(stream, &row.record, row.t_arrival_ns)
    }

    fn take(&mut self) -> Vec<u8> {
        std::mem::take(&mut self.bytes)
    }

    fn finish(self) -> io::Result<Vec<u8>> {
        Ok(self.bytes)
    }
}

impl Rows {
    fn put(&mut self, stream: usize, record: &Record, t_arrival_ns: i64) -> io::Result<()> {
        let (kind, frame) = match &record.reading {
            Reading::Frame(raw) => (0, Some(raw)),
            Reading::NoData(reason) => (
                1 + index_in(&NoData::ALL, reason).map_err(io::Error::other)?,
                None,
            ),
        };
        let clock = index_in(&ClockState::ALL, &record.stamp.clock).map_err(io::Error::other)?;
        let stream = u16::try_from(stream).map_err(io::Error::other)?;
        put_number_and_times(&mut self.bytes, record);
        self.bytes.extend(t_arrival_ns.to_le_bytes());
        self.bytes.extend(stream.to_le_bytes());
        self.bytes.extend([kind, clock]);
        self.put_frame(frame);
        Ok(())
    }

    fn put_frame(&mut self, frame: Option<&RecordedFrame>) {
        let Some(raw) = frame else {
            self.bytes.extend([0; 4 + 2 * PIXELS]);
            return;
        };
        let thermistor = raw.thermistor.map_or(i16::MIN, word::thermistor_steps);
        self.bytes.extend(thermistor.to_le_bytes());
        self.bytes.extend([0; 2]);
        for pixel in raw.pixels {
            self.bytes.extend(word::pixel_steps(pixel).to_le_bytes());
        }
    }
}

/// The index of a value in the list of its kind.
fn index_in<T: PartialEq>(all: &[T], one: &T) -> Result<u8, &'static str> {
    let index = all.iter().position(|other| other == one);
    index
        .and_then(|index| u8::try_from(index).ok())
        .ok_or("a value that is not in the list of its kind")
}
