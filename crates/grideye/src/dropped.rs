//! `POST /v1/files?name=NAME`: a recording of any format as the page plays it. Nothing of it is kept.

use axum::Router;
use axum::body::{Body, Bytes, to_bytes};
use axum::extract::Query;
use axum::http::StatusCode;
use axum::routing::post;
use grideye_collector::{Annex, Limits, Refusal, played};
use grideye_import::{ImportError, Options, open};
use grideye_inputs::InputError;
use grideye_recording::{Record, StreamId};
use serde::Deserialize;
use std::collections::BTreeMap;
use std::io::Cursor;
use std::path::Path;
use std::sync::Arc;
use tokio::sync::Semaphore;

/// A day of one sensor at 10 frames a second is about 250 megabytes of CSV, and too long to play.
const FILE_BYTES_MAX: usize = 128 * 1024 * 1024;
/// Files read at once; one more gets 503.
const READ_MAX: usize = 1;

#[derive(Deserialize)]
struct Named {
    name: String,
}

pub(crate) fn annex() -> Annex {
    let room = Arc::new(Semaphore::new(READ_MAX));
    Annex::new("files", move |_inside| {
        let room = Arc::clone(&room);
        let read = move |Query(Named { name }): Query<Named>, body: Body| async move {
            let busy = |_none_left| {
                let what = "another file is being read";
                Refusal::new(StatusCode::SERVICE_UNAVAILABLE, "busy", what)
                    .hint("try again in a second")
            };
            let turn = room.try_acquire_owned().map_err(busy)?;
            let bytes = to_bytes(body, FILE_BYTES_MAX).await.map_err(too_large)?;
            let read = tokio::task::spawn_blocking(move || {
                let _turn = turn;
                let rows_max = Limits::default().playback_rows_max;
                frames(
                    bytes,
                    &name,
                    usize::try_from(rows_max).unwrap_or(usize::MAX),
                )
            });
            read.await.unwrap_or_else(|error| {
                let what = format!("reading the file failed: {error}");
                Err(Refusal::new(
                    StatusCode::INTERNAL_SERVER_ERROR,
                    "broke_off",
                    what,
                ))
            })
        };
        Router::new().route("/v1/files", post(read))
    })
    .slow()
    .described_by(include_str!("../openapi/files.json"))
}

fn frames(bytes: Bytes, name: &str, rows_max: usize) -> Result<Vec<u8>, Refusal> {
    let refused = |error: ImportError| {
        let told = InputError::of_recording(Path::new(name), &error).to_string();
        refusal("not_a_recording", &told)
    };
    let mut streams: BTreeMap<StreamId, Vec<Record>> = BTreeMap::new();
    for (index, row) in open(Cursor::new(bytes), name, &Options::default())
        .map_err(refused)?
        .enumerate()
    {
        if index == rows_max {
            let what = format!("{name} has more than {rows_max} rows, too many for a browser");
            return Err(refusal("too_long_to_play", &what)
                .hint("cut it, or compare it with `grideye compare`"));
        }
        let row = row.map_err(refused)?;
        streams.entry(row.stream).or_default().push(row.record);
    }
    played(&streams)
}

fn too_large(_: axum::Error) -> Refusal {
    let what = format!("the file has more than {FILE_BYTES_MAX} bytes, or did not arrive whole");
    Refusal::new(StatusCode::PAYLOAD_TOO_LARGE, "too_large", what)
        .hint("play it with `grideye view FILE`")
}

fn refusal(kind: &'static str, what: &str) -> Refusal {
    Refusal::new(StatusCode::UNPROCESSABLE_ENTITY, kind, what)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_that_is_no_recording_or_too_long_says_so() {
        let said = |text: String, name| format!("{:?}", frames(text.into(), name, 3));
        let picture = said("GIF89a".to_owned(), "walk.gif");
        assert!(picture.contains("walk.gif"), "{picture}");
        let frame = format!("{}\n", ["20.25"; 64].join(","));
        assert!(frames(frame.repeat(3).into(), "short.csv", 3).is_ok());
        let long = said(frame.repeat(4), "long.csv");
        assert!(long.contains("more than 3 rows"), "{long}");
    }
}
