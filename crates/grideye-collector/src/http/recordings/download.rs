//! Sends the frames of a recording, page by page from the store, in a given format.

use crate::http::state::AppState;
use crate::store::{Members, Span, StoredRecord};
use axum::body::{Body, Bytes};
use std::io;
use tokio::sync::mpsc;
use tokio_stream::wrappers::ReceiverStream;

/// Pages buffered ahead of the receiver.
const PAGES_READY_MAX: usize = 2;

pub(super) trait Form: Send + 'static {
    fn write(&mut self, stream: usize, row: StoredRecord) -> io::Result<()>;

    /// The bytes to send before the first row, and after each page.
    fn take(&mut self) -> Vec<u8>;

    /// The bytes after the last page.
    fn finish(self) -> io::Result<Vec<u8>>;
}

/// The recording in this format, as a response body.
pub(super) fn body(state: AppState, members: Members, form: impl Form) -> Body {
    let (pages, ready) = mpsc::channel(PAGES_READY_MAX);
    tokio::spawn(download(state, members, form, pages));
    Body::from_stream(ReceiverStream::new(ready))
}

type Pages = mpsc::Sender<io::Result<Bytes>>;

/// Sends a recording page by page; an error cuts the transfer, so that nobody takes a part for the whole.
async fn download(state: AppState, members: Members, form: impl Form, pages: Pages) {
    let mut stopping = state.0.stopping.subscribe();
    let written = tokio::select! {
        written = write_pages(&state, members, form, &pages) => written,
        _ = stopping.wait_for(|stopping| *stopping) => Err(io::Error::other("the collector is stopping")),
    };
    if let Err(error) = written {
        // The receiver may be gone.
        let _ = pages.send(Err(error)).await;
    }
}

async fn write_pages(
    state: &AppState,
    members: Members,
    mut form: impl Form,
    pages: &Pages,
) -> io::Result<()> {
    send(pages, form.take()).await?;
    for (stream, span) in members.spans.into_iter().enumerate() {
        let mut after_seq = None;
        loop {
            let page = page(state, &span, after_seq).await?;
            let Some(last) = page.last() else { break };
            after_seq = Some(last.record.seq);
            for row in page {
                form.write(stream, row)?;
            }
            send(pages, form.take()).await?;
        }
    }
    // What was deleted meanwhile may lack frames: its labels are refused.
    let labels = state.store().labels(members.recording.id).await;
    labels.map_err(io::Error::other)?;
    send(pages, form.finish()?).await
}

/// The next rows of a span; empty at its end.
async fn page(
    state: &AppState,
    span: &Span,
    after_seq: Option<u64>,
) -> io::Result<Vec<StoredRecord>> {
    let rows = state.limits().page_rows.max(1);
    let page = state.store().page(span.clone(), after_seq, rows).await;
    page.map_err(io::Error::other)
}

async fn send(pages: &Pages, page: Vec<u8>) -> io::Result<()> {
    if page.is_empty() {
        return Ok(());
    }
    let sent = pages.send(Ok(page.into())).await;
    sent.map_err(|_gone| io::Error::from(io::ErrorKind::BrokenPipe))
}
