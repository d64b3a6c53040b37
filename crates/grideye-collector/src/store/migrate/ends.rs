//! The two ends of a migration: the file it reads and the database it writes.

use crate::limits::Limits;
use crate::store::error::{Result, StoreError};
use crate::store::location::PostgresUrl;
use crate::store::postgres::{Days, FrameColumns, Session, UNFINISHED, prepare_tables};
use crate::store::row::{count, fitting, unsigned};
use crate::store::segment::SealedRow;
use crate::store::sqlite::{self, rows_of, stream_id};
use crate::store::types::Span;
use grideye_recording::StreamId;
use rusqlite::{Connection, Params, params};
use std::collections::{BTreeMap, HashMap};
use std::path::Path;
use std::sync::Arc;

/// The SQLite file, locked against writers until [`Source::unlock`].
pub(super) struct Source {
    connection: Connection,
    pub(super) streams: Vec<SourceStream>,
    pub(super) recordings: i64,
    pub(super) rows: u64,
    pub(super) frames: u64,
    groups: i64,
    epoch: i64,
    t_last_arrival_ns: i64,
}

/// A stream of the file. Its number in the database counts within its device.
pub(super) struct SourceStream {
    pub(super) key: i64,
    pub(super) id: StreamId,
    pub(super) number: i32,
}

/// The file's key of a stream, and one of its rows.
pub(super) type SourceRow = (i64, SealedRow);

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Cursor {
    pub(super) stream_key: i64,
    pub(super) seq: i64,
    pub(super) rows: u64,
}

impl SourceStream {
    /// The whole stream, for the store that knows it by this key: the file's key, or the number in the database.
    pub(super) fn span(&self, stream_key: i64) -> Span {
        Span {
            stream: Arc::new(self.id.clone()),
            stream_key,
            seq: (0, i64::MAX),
            epochs: (i64::MIN, i64::MAX),
        }
    }
}

impl Source {
    pub(super) fn open(file: &Path, limits: &Limits) -> Result<Self> {
        let mut connection = sqlite::open_store(file, limits)?;
        sqlite::prepare(&mut connection, file)?;
        // The connection holds the lock: nobody adds to the file while it is copied.
        connection.execute_batch("BEGIN IMMEDIATE")?;
        sqlite::move_arrivals(&connection)?;
        let streams = streams(&connection)?;
        let sql = "SELECT epoch, groups, (SELECT coalesce(max(t_last_arrival_ns), 0) FROM streams),
                          (SELECT count(*) FROM recordings) FROM counters";
        let (epoch, groups, t_last_arrival_ns, recordings) =
            connection.query_row(sql, [], |row| {
                Ok((row.get(0)?, row.get(1)?, row.get(2)?, row.get(3)?))
            })?;
        // Deleted rows cannot be copied, but their numbers stay known.
        let sql = "SELECT coalesce(sum(last_seq - first_seq + 1), 0), coalesce(sum(frames), 0) FROM chunks";
        let (rows, frames): (i64, i64) =
            connection.query_row(sql, [], |row| Ok((row.get(0)?, row.get(1)?)))?;
        Ok(Self {
            connection,
            streams,
            recordings,
            rows: unsigned("rows", rows)?,
            frames: unsigned("frames", frames)?,
            groups,
            epoch,
            t_last_arrival_ns,
        })
    }

    pub(super) fn unlock(&self) -> Result<()> {
        Ok(self.connection.execute_batch("COMMIT")?)
    }

    /// Identifies the state of the file, so that a later migration resumes only a copy of the same state.
    pub(super) fn fingerprint(&self) -> String {
        format!(
            "{} streams, {} rows, {} frames, {} recordings, epoch {}, group {} at {}",
            self.streams.len(),
            self.rows,
            self.frames,
            self.recordings,
            self.epoch,
            self.groups,
            self.t_last_arrival_ns,
        )
    }

    /// The next rows with their streams, ordered by stream and number: whole chunks, until there are at least `rows`.
    pub(super) fn page(&self, after: &Cursor, rows: usize) -> Result<Vec<SourceRow>> {
        let mut statement = self.connection.prepare_cached(
            "SELECT first_seq, last_seq, epoch, is_sealed, rows, stream_id FROM chunks
             WHERE (stream_id, first_seq) > (?, ?) ORDER BY stream_id, first_seq",
        )?;
        let mut chunks = statement.query(params![after.stream_key, after.seq])?;
        let mut frames = Vec::with_capacity(rows);
        while frames.len() < rows {
            let Some(chunk) = chunks.next()? else { break };
            let stream_key: i64 = chunk.get(5)?;
            frames.extend(rows_of(chunk)?.into_iter().map(|row| (stream_key, row)));
        }
        Ok(frames)
    }

    /// The single value of a query.
    fn text(&self, sql: &str, parameters: impl Params) -> Result<String> {
        let mut statement = self.connection.prepare_cached(sql)?;
        Ok(statement.query_row(parameters, |row| row.get(0))?)
    }
}

fn streams(connection: &Connection) -> Result<Vec<SourceStream>> {
    let mut statement =
        connection.prepare("SELECT device, sensor, boot, id FROM streams ORDER BY id")?;
    let mut rows = statement.query([])?;
    let (mut streams, mut numbers) = (Vec::new(), BTreeMap::<String, i32>::new());
    while let Some(row) = rows.next()? {
        let id = stream_id(row, 0)?;
        let number = numbers.entry(id.device.clone()).or_insert(0);
        *number += 1;
        streams.push(SourceStream {
            key: row.get(3)?,
            number: *number,
            id,
        });
    }
    Ok(streams)
}

/// For each table of a stream: its name in the database, and SQL that reads its rows as JSON with the database's column
/// names, by the stream's key and its number in the database.
const OF_STREAMS: [(&str, &str); 3] = [
    (
        "streams",
        "SELECT json_group_array(json_object('device', device, 'stream', ?2, 'sensor', sensor, 'boot', boot,
             'stored', stored, 'missing', missing, 'added', last_group, 't_last_arrival_ns', t_last_arrival_ns,
             'account', account, 'account_read', account_read, 'came_since_account', came_since_account,
             'expired', expired, 'lane', 0, 'n', 0)) FROM streams WHERE id = ?1",
    ),
    (
        "runs",
        "SELECT json_group_array(json_object('device', device, 'stream', ?2, 'first_seq', first, 'last_seq',
             iif(first = (SELECT max(first) FROM runs WHERE stream_id = ?1), max(last, last_seq), last)))
         FROM runs JOIN streams ON id = stream_id WHERE stream_id = ?1",
    ),
    (
        "shares",
        "SELECT json_group_array(json_object('device', device, 'stream', ?2, 'epoch', epoch, 'first_seq', first_seq,
             'last_seq', last_seq, 'stored', stored, 'missing', missing)) FROM (
                 SELECT s.device, a.epoch, min(a.first_seq) AS first_seq, max(a.last_seq) AS last_seq,
                     sum(a.stored) AS stored, sum(a.missing) AS missing
                 FROM all_shares a JOIN streams s ON s.id = a.stream_id WHERE a.stream_id = ?1 GROUP BY a.epoch)",
    ),
];

/// The same for the tables of recordings, and what is known of the store.
const OF_RECORDINGS: [(&str, &str); 5] = [
    (
        "leases",
        "SELECT json_group_array(json_object('recording', recording_id, 'renewals', renewals)) FROM leases",
    ),
    (
        "facts",
        "SELECT json_group_array(json_object('fact', fact)) FROM facts",
    ),
    (
        "recordings",
        "SELECT json_group_array(json_object('id', id, 'name', name, 't_start_ns', t_start_ns, 't_stop_ns', t_stop_ns,
             'after_epoch', after_epoch, 'through_epoch', through_epoch)) FROM recordings",
    ),
    (
        "notes",
        "SELECT json_group_array(json_object('recording', recording_id, 'note', note)) FROM notes WHERE note <> ''",
    ),
    (
        "labels",
        "SELECT json_group_array(json_object('recording', recording_id, 'number', number, 'label', label)) FROM labels",
    ),
];

fn insert(table: &str) -> String {
    format!(
        "INSERT INTO grideye.{table} SELECT * FROM json_populate_recordset(NULL::grideye.{table}, $1::TEXT::JSON)"
    )
}

fn not_empty() -> StoreError {
    let what = "the database holds frames or recordings already\nhint: migrate into a new database (`createdb`)";
    StoreError::Refused(what.to_owned())
}

/// The database, with a table of its own for the progress of the copy.
pub(super) struct Target {
    session: Session,
}

impl Target {
    pub(super) async fn open(url: &PostgresUrl, limits: &Limits) -> Result<Self> {
        let session = Session::open(url, limits).await?;
        match prepare_tables(&session).await {
            Ok(()) | Err(StoreError::Unfinished) => Ok(Self { session }),
            Err(error) => Err(error),
        }
    }

    /// Where to resume, or `None` if the database already has all of this file.
    pub(super) async fn begin(&self, fingerprint: &str) -> Result<Option<Cursor>> {
        self.session
            .batch(
                "CREATE TABLE IF NOT EXISTS grideye.migration (
                     only_row INT NOT NULL PRIMARY KEY, fingerprint TEXT NOT NULL, is_done BOOLEAN NOT NULL,
                     stream_key BIGINT NOT NULL, seq BIGINT NOT NULL, copied BIGINT NOT NULL)",
            )
            .await?;
        let sql = "SELECT fingerprint, is_done, stream_key, seq, copied FROM grideye.migration";
        let rows = self.session.query(sql, &[]).await?;
        if let Some(row) = rows.first() {
            let found: String = row.try_get(0)?;
            let is_done: bool = row.try_get(1)?;
            match (found == fingerprint, is_done) {
                (true, true) => return Ok(None),
                (true, false) => {
                    return Ok(Some(Cursor {
                        stream_key: row.try_get(2)?,
                        seq: row.try_get(3)?,
                        rows: unsigned("copied", row.try_get(4)?)?,
                    }));
                }
                // The file changed or is another one: the rows copied so far are useless.
                (false, false) => self.session.batch("TRUNCATE grideye.frames").await?,
                (false, true) => return Err(not_empty()),
            }
        }
        let sql = "SELECT (SELECT count(*) FROM grideye.streams) + (SELECT count(*) FROM grideye.recordings)";
        let held: i64 = self.session.query(sql, &[]).await?[0].try_get(0)?;
        if held > 0 {
            return Err(not_empty());
        }
        self.session.transact(self.claim(fingerprint)).await?;
        Ok(Some(Cursor {
            stream_key: i64::MIN,
            seq: i64::MIN,
            rows: 0,
        }))
    }

    async fn claim(&self, fingerprint: &str) -> Result<()> {
        let sql = "UPDATE grideye.layout SET layout = $1";
        self.session.execute(sql, &[&UNFINISHED]).await?;
        let sql = "DELETE FROM grideye.migration";
        self.session.execute(sql, &[]).await?;
        let sql = "INSERT INTO grideye.migration VALUES (1, $1, FALSE, $2, $2, 0)";
        self.session
            .execute(sql, &[&fingerprint, &i64::MIN])
            .await?;
        Ok(())
    }

    /// Copies a page and returns the next position; `None` after the last page.
    pub(super) async fn copy(
        &self,
        source: &Source,
        after: &Cursor,
        page: &[SourceRow],
    ) -> Result<Option<Cursor>> {
        let Some((stream_key, last)) = page.last() else {
            return Ok(None);
        };
        let mut days = Days::default();
        for (_, row) in page {
            days.prepare(&self.session, row.t_arrival_ns).await;
        }
        let next = Cursor {
            stream_key: *stream_key,
            seq: fitting("seq", last.record.seq)?,
            rows: after.rows + count(page.len()).unsigned_abs(),
        };
        let rows = self.copy_rows(source, page, &next);
        self.session.transact(rows).await?;
        Ok(Some(next))
    }

    async fn copy_rows(&self, source: &Source, page: &[SourceRow], next: &Cursor) -> Result<()> {
        let streams: HashMap<i64, (&str, i32)> = source
            .streams
            .iter()
            .map(|stream| (stream.key, (stream.id.device.as_str(), stream.number)))
            .collect();
        let mut frames = FrameColumns::default();
        for (stream_key, row) in page {
            let key = streams.get(stream_key).copied().unwrap_or(("", 0));
            frames.push(key, &row.record, row.t_arrival_ns, row.arrival)?;
        }
        frames.insert(&self.session).await?;
        let sql = "UPDATE grideye.migration SET stream_key = $1, seq = $2, copied = $3";
        let copied = i64::try_from(next.rows).unwrap_or(i64::MAX);
        self.session
            .execute(sql, &[&next.stream_key, &next.seq, &copied])
            .await?;
        Ok(())
    }

    /// Copies streams and recordings, and lets collectors open the database.
    pub(super) async fn finish(&self, source: &Source) -> Result<()> {
        self.session.transact(self.name_all(source)).await
    }

    async fn name_all(&self, source: &Source) -> Result<()> {
        let session = &self.session;
        for stream in &source.streams {
            for (table, read) in OF_STREAMS {
                let rows = source.text(read, params![stream.key, stream.number])?;
                session.execute(&insert(table), &[&rows]).await?;
            }
        }
        for (table, read) in OF_RECORDINGS {
            let rows = source.text(read, [])?;
            session.execute(&insert(table), &[&rows]).await?;
        }
        // Every collector starts with this epoch, which is later than all copied ones.
        let epoch = source.epoch.saturating_add(1);
        for sql in [
            "UPDATE grideye.lanes SET epoch = $1",
            "UPDATE grideye.layout SET epoch = $1, layout = 1",
        ] {
            session.execute(sql, &[&epoch]).await?;
        }
        let done = "UPDATE grideye.migration SET is_done = TRUE";
        session.execute(done, &[]).await.map(drop)
    }
}
