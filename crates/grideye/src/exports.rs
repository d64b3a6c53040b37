//! `GET /v1/exports/1.npz`: a recording from the collector as a file for other programs, as `grideye convert` writes it.
//!
//! An annex of the collector, which knows no format but its own CSV. A file is written whole before its first byte is
//! sent, so that what cannot be written is refused, and nobody takes a part for the whole.

use crate::export::recording::{self, Format};
use anyhow::{Context as _, Result};
use axum::Router;
use axum::body::{Body, Bytes};
use axum::extract::{Path, State};
use axum::http::{StatusCode, header};
use axum::response::{IntoResponse, Response};
use axum::routing::get;
use grideye_collector::store::{Members, Recording};
use grideye_collector::{Annex, FrameStore, Refusal, attachment};
use grideye_recording::Row;
use std::collections::VecDeque;
use std::fs::File;
use std::io::{BufWriter, Read as _, Seek as _, Write as _};
use std::sync::Arc;
use tokio::runtime::Handle;
use tokio::sync::{OwnedSemaphorePermit, Semaphore, mpsc};
use tokio_stream::wrappers::ReceiverStream;

/// The formats that are offered, and their types. Pictures are left to `grideye convert`, which can be told of what.
const OFFERED: [(&str, &str); 3] = [
    ("npz", "application/zip"),
    ("parquet", "application/vnd.apache.parquet"),
    ("mcap", "application/octet-stream"),
];
/// Files that are written at once; one more is answered 503.
const WRITTEN_MAX: usize = 2;
/// Rows of a recording that is written while somebody waits for it; of one more, that person is told how to write it.
const ROWS_MAX: u64 = 1_000_000;
/// Rows that are asked of the store at once.
const PAGE_ROWS: usize = 4_096;
/// Bytes that are sent at once, and how many of these are ready before the peer takes them.
const PIECE_BYTES: usize = 256 * 1024;
const PIECES_READY_MAX: usize = 2;

#[derive(Clone)]
struct Exports {
    store: Arc<dyn FrameStore>,
    room: Arc<Semaphore>,
}

/// The routes, for the collector.
pub(crate) fn annex() -> Annex {
    Annex::new("exports", |inside| {
        let exports = Exports {
            store: Arc::clone(&inside.store),
            room: Arc::new(Semaphore::new(WRITTEN_MAX)),
        };
        Router::new()
            .route("/v1/exports/{file}", get(export))
            .with_state(exports)
    })
}

async fn export(
    State(exports): State<Exports>,
    Path(file): Path<String>,
) -> Result<Response, Refusal> {
    let (id, extension) = file.rsplit_once('.').unwrap_or((&file, ""));
    let offered = OFFERED.iter().find(|(known, _)| *known == extension);
    let written = offered.and_then(|(known, _)| recording::format(known));
    let (Some((extension, content_type)), Some(format)) = (offered, written) else {
        return Err(unknown_format(extension));
    };
    let id = id.parse().map_err(|_not_a_number| unknown_recording())?;
    let members = exports.store.members(id).await.map_err(Refusal::from)?;
    check_length(&members.recording)?;
    let room = exports.room.try_acquire_owned().map_err(|_none_left| {
        let what = format!("{WRITTEN_MAX} files are being written already");
        Refusal::new(StatusCode::SERVICE_UNAVAILABLE, "too_many_exports", what)
            .hint("ask again in a few seconds")
    })?;
    let name = attachment(&members.recording.name, extension);
    let file = write(exports.store, members, format, room).await?;
    let headers = [(header::CONTENT_DISPOSITION, name)];
    let kind = [(header::CONTENT_TYPE, *content_type)];
    Ok((headers, kind, send(file)).into_response())
}

fn unknown_format(extension: &str) -> Refusal {
    let names: Vec<String> = OFFERED
        .iter()
        .map(|(known, _)| format!(".{known}"))
        .collect();
    let shown: String = extension.chars().take(16).collect();
    let what = format!("there is no export as {shown:?}");
    Refusal::new(StatusCode::NOT_FOUND, "unknown_format", what).hint(format!(
        "end it with {}; GET /v1/recordings/1.csv is recording 1 as CSV",
        names.join(" or ")
    ))
}

fn unknown_recording() -> Refusal {
    let what = "recordings are known by number";
    Refusal::new(StatusCode::NOT_FOUND, "no_such_recording", what)
        .hint("GET /v1/recordings lists them")
}

fn check_length(recording: &Recording) -> Result<(), Refusal> {
    let rows = recording.frames.saturating_add(recording.missing);
    if rows <= ROWS_MAX {
        return Ok(());
    }
    let id = recording.id;
    let what = format!("recording {id} has {rows} rows, and {ROWS_MAX} are written here at most");
    Err(
        Refusal::new(StatusCode::UNPROCESSABLE_ENTITY, "too_long", what).hint(format!(
            "take /v1/recordings/{id}.csv, and `grideye convert` writes the others from it"
        )),
    )
}

/// Writes the recording into a file without a name, away from the threads that serve requests.
async fn write(
    store: Arc<dyn FrameStore>,
    members: Members,
    format: Format,
    room: OwnedSemaphorePermit,
) -> Result<File, Refusal> {
    let runtime = Handle::current();
    let work = tokio::task::spawn_blocking(move || {
        let _room = room;
        let mut file = tempfile::tempfile().context("there is no room for a temporary file")?;
        let mut rows = Pages::of(store, members, runtime);
        let mut buffered = BufWriter::new(&file);
        format(&mut rows, &mut buffered)?;
        buffered.flush()?;
        drop(buffered);
        file.rewind()?;
        Ok(file)
    });
    let failed = |what: String| {
        Refusal::new(StatusCode::INTERNAL_SERVER_ERROR, "not_written", what)
            .hint("the folder for temporary files (TMPDIR) needs room for the whole file")
    };
    let written: Result<File> = work.await.map_err(|error| failed(error.to_string()))?;
    written.map_err(|error| failed(format!("the file cannot be written: {error:#}")))
}

/// The rows of a recording, page by page from the store.
struct Pages {
    store: Arc<dyn FrameStore>,
    runtime: Handle,
    members: Members,
    span: usize,
    after_seq: Option<u64>,
    ready: VecDeque<Row>,
}

impl Pages {
    const fn of(store: Arc<dyn FrameStore>, members: Members, runtime: Handle) -> Self {
        Self {
            store,
            runtime,
            members,
            span: 0,
            after_seq: None,
            ready: VecDeque::new(),
        }
    }

    /// Takes the next page, of the next span where one has ended; nothing is ready after the last.
    fn fill(&mut self) -> Result<()> {
        while self.ready.is_empty() {
            let Some(span) = self.members.spans.get(self.span) else {
                return Ok(());
            };
            let page = self.store.page(span.clone(), self.after_seq, PAGE_ROWS);
            let page = self.runtime.block_on(page)?;
            match page.last() {
                Some(last) => self.after_seq = Some(last.record.seq),
                None => (self.span, self.after_seq) = (self.span + 1, None),
            }
            self.ready.extend(page.into_iter().map(|stored| Row {
                stream: (*stored.stream).clone(),
                record: stored.record,
                t_arrival_ns: Some(stored.t_arrival_ns),
            }));
        }
        Ok(())
    }
}

impl Iterator for Pages {
    type Item = Result<Row>;

    fn next(&mut self) -> Option<Self::Item> {
        match self.fill() {
            Ok(()) => self.ready.pop_front().map(Ok),
            Err(error) => Some(Err(error)),
        }
    }
}

/// Sends a file piece by piece; the one who takes it sets the pace.
fn send(mut file: File) -> Body {
    let (pieces, ready) = mpsc::channel(PIECES_READY_MAX);
    tokio::task::spawn_blocking(move || {
        loop {
            let mut piece = vec![0; PIECE_BYTES];
            let length = match file.read(&mut piece) {
                Ok(0) => return,
                Ok(length) => length,
                Err(error) => {
                    // Cuts the transfer.
                    let _ = pieces.blocking_send(Err(error));
                    return;
                }
            };
            piece.truncate(length);
            if pieces.blocking_send(Ok(Bytes::from(piece))).is_err() {
                // The one who asked has gone.
                return;
            }
        }
    });
    Body::from_stream(ReceiverStream::new(ready))
}

#[cfg(test)]
mod tests {
    use super::*;
    use grideye_collector::store::{RecordingId, StoreLocation};
    use grideye_collector::{Limits, SqliteStore};

    async fn exports(written_max: usize) -> Exports {
        let store = SqliteStore::open(&StoreLocation::Memory, &Limits::default()).unwrap();
        store.start_recording("r".to_owned(), 1).await.unwrap();
        Exports {
            store: Arc::new(store),
            room: Arc::new(Semaphore::new(written_max)),
        }
    }

    async fn status(exports: &Exports, file: &str) -> u16 {
        let answer = export(State(exports.clone()), Path(file.to_owned())).await;
        answer.into_response().status().as_u16()
    }

    #[tokio::test]
    async fn what_is_not_there_is_not_found() {
        let exports = exports(1).await;
        assert_eq!(status(&exports, "1.npz").await, 200);
        for none in ["1.png", "1.csv", "1", "", ".npz", "x.npz", "2.npz"] {
            assert_eq!(status(&exports, none).await, 404, "{none}");
        }
    }

    #[tokio::test]
    async fn no_more_are_written_at_once_than_there_is_room_for() {
        let exports = exports(1).await;
        let room = Arc::clone(&exports.room).try_acquire_owned().unwrap();
        assert_eq!(status(&exports, "1.mcap").await, 503);
        drop(room);
        assert_eq!(status(&exports, "1.mcap").await, 200);
    }

    #[test]
    fn a_recording_that_takes_too_long_is_refused() {
        let mut recording = Recording {
            id: RecordingId(1),
            name: "long".to_owned(),
            note: String::new(),
            t_start_ns: 1,
            t_stop_ns: None,
            frames: ROWS_MAX - 1,
            missing: 1,
            sensors: 1,
        };
        check_length(&recording).unwrap();
        recording.missing = 2;
        let refused = check_length(&recording).unwrap_err().into_response();
        assert_eq!(refused.status(), 422);
    }
}
