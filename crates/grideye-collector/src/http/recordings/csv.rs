//! A recording as a CSV file.

use crate::http::recordings::download::{self, Form};
use crate::http::recordings::fields::attachment;
use crate::http::refusal::Refusal;
use crate::http::state::AppState;
use crate::lock::lock;
use crate::store::{Members, StoredRecord};
use axum::http::{HeaderValue, StatusCode, header};
use axum::response::{IntoResponse, Response};
use grideye_recording::Row;
use grideye_recording::csv::{STREAMS_MAX, Writer};
use std::io;
use std::sync::{Arc, Mutex};

pub(super) fn answer(state: AppState, members: Members) -> Result<Response, Refusal> {
    if members.spans.len() > STREAMS_MAX {
        let what = format!(
            "recording {} holds more than {STREAMS_MAX} streams, too many for one file",
            members.recording.id
        );
        let status = StatusCode::UNPROCESSABLE_ENTITY;
        return Err(Refusal::new(status, "too_many_streams", what));
    }
    let kind = HeaderValue::from_static("text/csv; charset=utf-8; header=present");
    let name = attachment(&members.recording.name, "csv");
    let headers = [
        (header::CONTENT_TYPE, kind),
        (header::CONTENT_DISPOSITION, name),
    ];
    let text = PageBuffer::default();
    let writer = Writer::new(text.clone()).map_err(|error| {
        let what = error.to_string();
        Refusal::new(StatusCode::INTERNAL_SERVER_ERROR, "not_written", what)
    })?;
    let file = CsvFile {
        text,
        writer: Some(writer),
    };
    Ok((headers, download::body(state, members, file)).into_response())
}

struct CsvFile {
    text: PageBuffer,
    writer: Option<Writer<PageBuffer>>,
}

impl Form for CsvFile {
    fn write(&mut self, _stream: usize, row: StoredRecord) -> io::Result<()> {
        let Some(writer) = &mut self.writer else {
            return Ok(());
        };
        let row = Row {
            stream: (*row.stream).clone(),
            record: row.record,
            t_arrival_ns: Some(row.t_arrival_ns),
        };
        writer.write(&row).map_err(io::Error::other)
    }

    fn take(&mut self) -> Vec<u8> {
        self.text.take()
    }

    fn finish(&mut self) -> io::Result<()> {
        match self.writer.take() {
            Some(writer) => writer.finish().map(drop).map_err(io::Error::other),
            None => Ok(()),
        }
    }
}

#[derive(Debug, Clone, Default)]
struct PageBuffer(Arc<Mutex<Vec<u8>>>);

impl PageBuffer {
    fn take(&self) -> Vec<u8> {
        std::mem::take(&mut lock(&self.0))
    }
}

impl io::Write for PageBuffer {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let mut page = lock(&self.0);
        page.extend_from_slice(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}
