//! `GET /v1/exports/1.npz`: a recording from the collector as a file for other programs, in the formats of `grideye
//! convert`.
//!
//! An annex of the collector, which itself writes only CSV. A file is written whole before its first byte is sent, so
//! that a failed export gets an error response, and nobody takes a part for the whole. Writing stops when the request
//! is dropped: by a client that is gone, or because it took too long.

use crate::error::ExportError;
use crate::recording::{self, Format, Row, Rows};
use axum::Router;
use axum::body::Body;
use axum::extract::{Path, Query, State};
use axum::http::{StatusCode, header};
use axum::response::{IntoResponse, Response};
use axum::routing::get;
use grideye_collector::store::{Members, Recording, Span, StoredRecord};
use grideye_collector::{Annex, FrameStore, Refusal, attachment};
use grideye_count::{Counter, Network, Room, celsius};
use grideye_recording::Record;
use serde::Deserialize;
use std::collections::VecDeque;
use std::fs::File;
use std::io::{self, BufWriter, Seek as _, Write as _};
use std::sync::{Arc, Weak};
use std::time::Duration;
use tokio::runtime::Handle;
use tokio::sync::{OwnedSemaphorePermit, Semaphore};
use tokio_util::io::ReaderStream;

const OFFERED: [(&str, &str); 5] = [
    ("npz", "application/zip"),
    ("parquet", "application/vnd.apache.parquet"),
    ("mcap", "application/octet-stream"),
    ("png", "image/png"),
    ("gif", "image/gif"),
];
/// The formats that are images: of one boot of one sensor.
const PICTURES: [&str; 2] = ["png", "gif"];
/// Files written at once; one more gets 503.
const WRITTEN_MAX: usize = 2;
/// Maximum rows of an export over HTTP; longer recordings get a hint to `grideye convert`.
const ROWS_MAX: u64 = 1_000_000;
/// Maximum rows of an image over HTTP, because its frames are held in memory.
const DRAWN_ROWS_MAX: u64 = 100_000;
/// Maximum streams named in an error.
const NAMED_MAX: usize = 8;
/// The column of how many people each frame shows.
const PEOPLE: &str = "people";
/// Rows read from the store at once.
const PAGE_ROWS: usize = 4_096;
/// Bytes sent at once.
const PIECE_BYTES: usize = 256 * 1024;

#[derive(Clone)]
struct Exports {
    store: Arc<dyn FrameStore>,
    room: Arc<Semaphore>,
    drawn_rows_max: u64,
    scratch: Scratch,
}

/// Creates an unnamed temporary file.
pub type Scratch = fn() -> io::Result<File>;

/// The requested frames: all, unless limited by sensor or boot.
#[derive(Debug, Default, Deserialize)]
struct Asked {
    /// The sensor's name, or `device/sensor`.
    sensor: Option<String>,
    /// One boot of the agent.
    boot: Option<String>,
    /// Whether to add how many people each frame shows.
    #[serde(default)]
    count: bool,
}

/// The routes, for the collector.
#[must_use]
pub fn annex(scratch: Scratch) -> Annex {
    Annex::new("exports", move |inside| {
        let exports = Exports {
            store: Arc::clone(&inside.store),
            room: Arc::new(Semaphore::new(WRITTEN_MAX)),
            drawn_rows_max: DRAWN_ROWS_MAX,
            scratch,
        };
        Router::new()
            .route("/v1/exports/{file}", get(export))
            .with_state(exports)
    })
    .slow()
    .described_by(include_str!("../openapi.json"))
}

async fn export(
    State(exports): State<Exports>,
    Path(file): Path<String>,
    Query(asked): Query<Asked>,
) -> Result<Response, Refusal> {
    let (id, extension) = file.rsplit_once('.').unwrap_or((&file, ""));
    let offered = OFFERED.iter().find(|(known, _)| *known == extension);
    let written = offered.and_then(|(known, _)| recording::format(known));
    let (Some((extension, content_type)), Some(format)) = (offered, written) else {
        return Err(unknown_format(extension));
    };
    let id = id.parse().map_err(|_not_a_number| unknown_recording())?;
    let mut members = exports.store.members(id).await.map_err(Refusal::from)?;
    check_length(&members.recording)?;
    members.spans = choose(members.spans, &asked)?;
    let is_picture = PICTURES.contains(extension);
    if is_picture {
        check_one(&members.spans)?;
    }
    let rows_max = is_picture.then_some(exports.drawn_rows_max);
    let room = exports.room.try_acquire_owned().map_err(|_none_left| {
        let what = format!("{WRITTEN_MAX} files are being written already");
        Refusal::new(StatusCode::SERVICE_UNAVAILABLE, "too_many_exports", what)
            .hint("retry in a few seconds")
    })?;
    let name = attachment(&members.recording.name, extension);
    let mut rows = Pages::new(exports.store, members, rows_max);
    rows.is_counting = asked.count;
    let file = write(rows, format, (room, exports.scratch)).await?;
    let headers = [(header::CONTENT_DISPOSITION, name)];
    let kind = [(header::CONTENT_TYPE, *content_type)];
    Ok((headers, kind, send(file)).into_response())
}

fn unknown_format(extension: &str) -> Refusal {
    let names = OFFERED.map(|(known, _)| format!(".{known}")).join(" or ");
    let shown: String = extension.chars().take(16).collect();
    let what = format!("there is no export as {shown:?}");
    Refusal::new(StatusCode::NOT_FOUND, "unknown_format", what).hint(format!(
        "end it with {names}; GET /v1/recordings/1.csv is recording 1 as CSV"
    ))
}

fn unknown_recording() -> Refusal {
    let what = "recordings are known by number";
    Refusal::new(StatusCode::NOT_FOUND, "no_such_recording", what)
        .hint("GET /v1/recordings lists them")
}

fn choose(spans: Vec<Span>, asked: &Asked) -> Result<Vec<Span>, Refusal> {
    if asked.sensor.is_none() && asked.boot.is_none() {
        return Ok(spans);
    }
    let names = names(&spans);
    let is_asked = |Span { stream, .. }: &Span| {
        let sensor = asked.sensor.as_deref();
        sensor.is_none_or(|sensor| stream.is_of(sensor))
            && asked.boot.as_deref().is_none_or(|boot| boot == stream.boot)
    };
    let chosen: Vec<Span> = spans.into_iter().filter(is_asked).collect();
    if chosen.is_empty() {
        let what = "this recording has no frames of that sensor and boot";
        let has = if names.is_empty() {
            "none at all"
        } else {
            &names
        };
        let refusal = Refusal::new(StatusCode::NOT_FOUND, "no_such_sensor", what);
        return Err(refusal.hint(format!("it has {has}")));
    }
    Ok(chosen)
}

fn check_one(spans: &[Span]) -> Result<(), Refusal> {
    if spans.len() <= 1 {
        return Ok(());
    }
    let what = "an image shows one boot of one sensor, but this recording has several";
    let refusal = Refusal::new(StatusCode::UNPROCESSABLE_ENTITY, "several_streams", what);
    Err(refusal.hint(format!("add one of {}", names(spans))))
}

/// The queries that select each of the first spans.
fn names(spans: &[Span]) -> String {
    let named = spans.iter().take(NAMED_MAX).map(|Span { stream, .. }| {
        let (device, sensor, boot) = (&stream.device, &stream.sensor, &stream.boot);
        format!("?sensor={device}/{sensor}&boot={boot}")
    });
    let more = if spans.len() > NAMED_MAX {
        " and more"
    } else {
        ""
    };
    format!("{}{more}", named.collect::<Vec<_>>().join(", "))
}

fn check_length(recording: &Recording) -> Result<(), Refusal> {
    let rows = recording.frames.saturating_add(recording.missing);
    if rows <= ROWS_MAX {
        return Ok(());
    }
    let id = recording.id;
    let what = format!("recording {id} has {rows} rows; this export writes at most {ROWS_MAX}");
    let refusal = Refusal::new(StatusCode::UNPROCESSABLE_ENTITY, "too_long", what);
    Err(refusal.hint(format!(
        "download /v1/recordings/{id}.csv and convert it with `grideye convert`"
    )))
}

/// Writes the rows to an unnamed file, off the threads that serve requests, until the request is dropped.
async fn write(
    mut rows: Pages,
    format: Format,
    (room, scratch): (OwnedSemaphorePermit, Scratch),
) -> Result<File, Refusal> {
    // Dropped with the request.
    let asking = Arc::new(());
    let request = Arc::downgrade(&asking);
    rows.request = request.clone();
    let work = tokio::task::spawn_blocking(move || {
        let _room = room;
        let no_room = |error| io::Error::other(format!("cannot create a temporary file: {error}"));
        let mut file = scratch().map_err(no_room)?;
        let mut out = WhileAsked {
            out: BufWriter::new(&file),
            request: request.clone(),
        };
        let labels = rows.is_counting.then(|| PEOPLE.to_owned());
        let mut rows = rows.map(|row| {
            check_asked(&request)?;
            row
        });
        format(Rows::of_recording(labels.as_slice(), &mut rows), &mut out)?;
        out.flush()?;
        drop(out);
        file.rewind()?;
        Ok(file)
    });
    let failed = |what: String| {
        Refusal::new(StatusCode::INTERNAL_SERVER_ERROR, "not_written", what)
            .hint("the folder for temporary files (TMPDIR) needs room for the whole file")
    };
    let written: Result<File, ExportError> =
        work.await.map_err(|error| failed(error.to_string()))?;
    written.map_err(|error| match error.is_of_the_frames() {
        // With the messages of `grideye convert`.
        true => {
            let (status, what) = (StatusCode::UNPROCESSABLE_ENTITY, error.to_string());
            Refusal::new(status, "cannot_be_written", what)
        }
        false => failed(format!("the file cannot be written: {error}")),
    })
}

/// How many people a frame shows; empty where it is missing.
fn people(counter: &mut Counter, record: &Record) -> String {
    let at_s = Duration::from_nanos(record.stamp.t_boot_ns).as_secs_f64();
    let frame = record.reading.frame().map(celsius);
    let count = frame.and_then(|frame| counter.see(&Network::default(), at_s, &frame));
    count
        .map(|count| count.people.to_string())
        .unwrap_or_default()
}

/// A file that takes bytes as long as its request is not dropped.
struct WhileAsked<W> {
    out: W,
    request: Weak<()>,
}

fn check_asked(request: &Weak<()>) -> io::Result<()> {
    match request.strong_count() {
        0 => Err(io::Error::other("the request was dropped")),
        _ => Ok(()),
    }
}

impl<W: io::Write> io::Write for WhileAsked<W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        check_asked(&self.request)?;
        self.out.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.out.flush()
    }
}

impl<W: io::Seek> io::Seek for WhileAsked<W> {
    fn seek(&mut self, to: io::SeekFrom) -> io::Result<u64> {
        self.out.seek(to)
    }
}

/// The rows of a recording, read page by page from the store.
struct Pages {
    store: Arc<dyn FrameStore>,
    runtime: Handle,
    members: Members,
    /// The limit on rows, and how many were read.
    rows_max: Option<u64>,
    taken: u64,
    span: usize,
    after_seq: Option<u64>,
    ready: VecDeque<Row>,
    /// Nothing is read for a request that was dropped.
    request: Weak<()>,
    is_counting: bool,
    /// Counts the people of the span that is read.
    counter: Option<Counter>,
}

impl Pages {
    fn new(store: Arc<dyn FrameStore>, members: Members, rows_max: Option<u64>) -> Self {
        Self {
            store,
            runtime: Handle::current(),
            members,
            rows_max,
            taken: 0,
            span: 0,
            after_seq: None,
            ready: VecDeque::new(),
            request: Weak::new(),
            is_counting: false,
            counter: None,
        }
    }

    /// Reads the next page, across spans; leaves nothing ready after the last.
    fn fill(&mut self) -> Result<(), ExportError> {
        while self.ready.is_empty() {
            let Some(span) = self.members.spans.get(self.span) else {
                return Ok(());
            };
            let span = span.clone();
            if self.is_counting && self.counter.is_none() {
                self.counter = Some(self.counter_of(&span)?);
            }
            let page = self.page(&span, self.after_seq)?;
            match page.last() {
                Some(last) => self.after_seq = Some(last.record.seq),
                None => (self.span, self.after_seq, self.counter) = (self.span + 1, None, None),
            }
            let mut counter = self.counter.as_mut();
            self.ready.extend(page.into_iter().map(|stored| {
                let labels = counter
                    .as_deref_mut()
                    .map(|counter| people(counter, &stored.record));
                Row::from(grideye_recording::Row {
                    stream: (*stored.stream).clone(),
                    record: stored.record,
                    t_arrival_ns: Some(stored.t_arrival_ns),
                    labels: labels.into_iter().collect(),
                })
            }));
        }
        Ok(())
    }

    fn page(&self, span: &Span, after_seq: Option<u64>) -> Result<Vec<StoredRecord>, ExportError> {
        check_asked(&self.request)?;
        let page = self.store.page(span.clone(), after_seq, PAGE_ROWS);
        let page = self.runtime.block_on(page);
        page.map_err(|error| ExportError::Source(error.into()))
    }

    /// A counter that knows the empty room from all frames of a span, as `grideye count` does.
    fn counter_of(&self, span: &Span) -> Result<Counter, ExportError> {
        let mut room = Room::default();
        let mut after_seq = None;
        loop {
            let page = self.page(span, after_seq)?;
            let Some(last) = page.last() else {
                return Ok(Counter::with_background(room.celsius()));
            };
            after_seq = Some(last.record.seq);
            let frames = page
                .iter()
                .filter_map(|stored| stored.record.reading.frame());
            frames.for_each(|frame| room.see(&celsius(frame)));
        }
    }

    fn count(&mut self, row: Row) -> Result<Row, ExportError> {
        self.taken += 1;
        match self.rows_max {
            Some(rows_max) if self.taken > rows_max => Err(ExportError::Row(format!(
                "this export draws at most {rows_max} rows\nhint: download /v1/recordings/{}.csv; `grideye convert --sensor {}/{}` draws it",
                self.members.recording.id, row.stream.device, row.stream.sensor
            ))),
            _ => Ok(row),
        }
    }
}

impl Iterator for Pages {
    type Item = Result<Row, ExportError>;

    fn next(&mut self) -> Option<Self::Item> {
        match self.fill() {
            Ok(()) => self.ready.pop_front().map(|row| self.count(row)),
            Err(error) => Some(Err(error)),
        }
    }
}

/// Sends a file piece by piece, at the receiver's pace.
fn send(file: File) -> Body {
    let file = tokio::fs::File::from_std(file);
    Body::from_stream(ReaderStream::with_capacity(file, PIECE_BYTES))
}

#[cfg(test)]
mod tests;
