//! Migrates an SQLite file to a PostgreSQL database: resumable, and compared with the file at the end.
//!
//! Each transaction copies a page of frames and the progress. Streams and recordings come in one last transaction;
//! until then the layout is `UNFINISHED`, which no collector opens. The file stays locked against writers meanwhile.

mod ends;

use crate::limits::Limits;
use crate::store::error::Result;
use crate::store::frame_store::FrameStore;
use crate::store::location::{PostgresUrl, StoreLocation};
use crate::store::migrate::ends::{Source, Target};
use crate::store::postgres::PostgresStore;
use crate::store::row::count;
use crate::store::sqlite::SqliteStore;
use crate::store::types::Stage;
use std::path::Path;

/// Frames in one transaction of the copy, and in one comparison.
const PAGE_ROWS: usize = 5_000;

/// The result of a migration.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Migrated {
    /// Frames with pixels.
    pub frames: u64,
    /// Rows that say why a frame is missing.
    pub missing: u64,
    /// Streams (device, sensor, boot).
    pub streams: usize,
    /// Recordings.
    pub recordings: usize,
    /// Rows that an interrupted migration had already copied.
    pub resumed_after: u64,
    /// The first difference between database and file, if any.
    pub difference: Option<String>,
}

/// Copies the file's store into the database, or resumes that, then compares both. `progress` receives the stage, the
/// rows done and the total rows.
///
/// # Errors
/// [`StoreError`](crate::StoreError) of either side. Call again to resume; nothing is lost.
pub async fn migrate(
    file: &Path,
    url: &PostgresUrl,
    mut progress: impl FnMut(Stage, u64, u64),
) -> Result<Migrated> {
    let limits = Limits {
        streams_listed_max: usize::MAX,
        recordings_max: usize::MAX,
        ..Limits::default()
    };
    let source = Source::open(file, &limits)?;
    let target = Target::open(url, &limits).await?;
    let total = source.rows;
    let mut resumed_after = 0;
    if let Some(mut cursor) = target.begin(&source.fingerprint()).await? {
        resumed_after = cursor.rows;
        progress(Stage::Copying, cursor.rows, total);
        loop {
            let page = source.page(&cursor, PAGE_ROWS)?;
            let Some(next) = target.copy(&source, &cursor, &page).await? else {
                break;
            };
            cursor = next;
            progress(Stage::Copying, cursor.rows, total);
        }
        target.finish(&source).await?;
    }
    source.unlock()?;
    let difference = compare(file, url, &limits, &source, &mut progress).await?;
    Ok(Migrated {
        frames: source.frames,
        missing: source.rows - source.frames,
        streams: source.streams.len(),
        recordings: usize::try_from(source.recordings).unwrap_or(usize::MAX),
        resumed_after,
        difference,
    })
}

/// The first difference between the two, found through the trait that a collector uses: streams, recordings, frames.
async fn compare(
    file: &Path,
    url: &PostgresUrl,
    limits: &Limits,
    source: &Source,
    progress: &mut impl FnMut(Stage, u64, u64),
) -> Result<Option<String>> {
    let old = SqliteStore::open(&StoreLocation::File(file.to_owned()), limits)?;
    let new = PostgresStore::open(url, limits).await?;
    let difference = async {
        let (kept, copied) = (old.streams().await?, new.streams().await?);
        if let Some((kept, copied)) = kept
            .iter()
            .zip(&copied)
            .find(|(kept, copied)| kept != copied)
        {
            return Ok(Some(format!(
                "stream {:?}: {kept:?} became {copied:?}",
                copied.id
            )));
        }
        if kept.len() != copied.len() {
            let (kept, copied) = (kept.len(), copied.len());
            return Ok(Some(format!("{kept} streams became {copied}")));
        }
        let (kept, copied) = (old.recordings().await?, new.recordings().await?);
        if kept != copied {
            return Ok(Some(format!("recordings {kept:?} became {copied:?}")));
        }
        for recording in kept {
            let id = recording.id;
            let (kept, copied) = (old.labels(id).await?, new.labels(id).await?);
            if kept != copied {
                let what = format!("labels of recording {id}: {kept:?} became {copied:?}");
                return Ok(Some(what));
            }
        }
        compare_frames(&old, &new, source, progress).await
    }
    .await;
    old.close().await?;
    new.close().await?;
    difference
}

async fn compare_frames(
    old: &SqliteStore,
    new: &PostgresStore,
    source: &Source,
    progress: &mut impl FnMut(Stage, u64, u64),
) -> Result<Option<String>> {
    let mut compared = 0;
    for stream in &source.streams {
        let mut after = None;
        loop {
            let kept = old.page(stream.span(stream.key), after, PAGE_ROWS).await?;
            let copied = new
                .page(stream.span(stream.number.into()), after, PAGE_ROWS)
                .await?;
            if let Some((kept, _)) = kept
                .iter()
                .zip(&copied)
                .find(|(kept, copied)| kept != copied)
            {
                let (id, seq) = (&kept.stream, kept.record.seq);
                return Ok(Some(format!("seq {seq} of {id:?}")));
            }
            if kept.len() != copied.len() {
                let (kept, copied) = (kept.len(), copied.len());
                return Ok(Some(format!(
                    "{kept} rows of {:?} became {copied}",
                    stream.id
                )));
            }
            let Some(last) = kept.last() else { break };
            after = Some(last.record.seq);
            compared += count(kept.len()).unsigned_abs();
            progress(Stage::Comparing, compared, source.rows);
        }
    }
    Ok(None)
}
