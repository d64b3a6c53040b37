//! Writes a recording as CSV.

use crate::http::recordings::download::{self, Form};
use crate::http::recordings::fields::{csv_headers, not_written};
use crate::http::refusal::Refusal;
use crate::http::state::AppState;
use crate::store::{Members, StoredRecord};
use axum::http::StatusCode;
use axum::response::{IntoResponse, Response};
use grideye_recording::Row;
use grideye_recording::csv::{STREAMS_MAX, Writer};
use std::io;

pub(super) fn answer(state: AppState, members: Members) -> Result<Response, Refusal> {
    if members.spans.len() > STREAMS_MAX {
        let what = format!(
            "recording {} holds more than {STREAMS_MAX} streams, too many for one file",
            members.recording.id
        );
        let status = StatusCode::UNPROCESSABLE_ENTITY;
        return Err(Refusal::new(status, "too_many_streams", what));
    }
    let headers = csv_headers(&members.recording.name, "csv");
    let file = Writer::new(Vec::new()).map_err(not_written)?;
    Ok((headers, download::body(state, members, file)).into_response())
}

impl Form for Writer<Vec<u8>> {
    fn write(&mut self, _stream: usize, row: StoredRecord) -> io::Result<()> {
        let row = Row {
            stream: (*row.stream).clone(),
            record: row.record,
            t_arrival_ns: Some(row.t_arrival_ns),
            labels: Vec::new(),
        };
        Self::write(self, &row).map_err(io::Error::other)
    }

    fn take(&mut self) -> Vec<u8> {
        std::mem::take(self.output_mut())
    }

    fn finish(self) -> io::Result<Vec<u8>> {
        Self::finish(self).map_err(io::Error::other)
    }
}
