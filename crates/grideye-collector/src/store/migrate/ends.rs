//! The file that is migrated from, and the database that is migrated to.

use crate::limits::Limits;
use crate::store::error::{Result, StoreError};
use crate::store::location::PostgresUrl;
use crate::store::postgres::{Days, FrameColumns, Parameters, Session, UNFINISHED, prepare_tables};
use crate::store::row::{count, fitting, unsigned};
use crate::store::segment::SealedRow;
use crate::store::sqlite::{self, Found, rows_of};
use crate::store::types::Span;
use grideye_recording::StreamId;
use rusqlite::{Connection, OpenFlags, params};
use std::collections::{BTreeMap, HashMap};
use std::path::Path;
use std::sync::Arc;

/// The file, locked against writers until [`Source::unlock`].
pub(super) struct Source {
    connection: Connection,
    pub(super) streams: Vec<SourceStream>,
    pub(super) recordings: Vec<SourceRecording>,
    pub(super) rows: u64,
    pub(super) frames: u64,
    groups: i64,
    epoch: i64,
}

/// A stream as the file has it. Its number in the database counts within its device.
pub(super) struct SourceStream {
    pub(super) key: i64,
    pub(super) id: StreamId,
    pub(super) number: i32,
    pub(super) stored: i64,
    pub(super) missing: i64,
    pub(super) last_group: i64,
    pub(super) t_last_arrival_ns: i64,
    pub(super) account: Option<String>,
    pub(super) account_read: Option<i64>,
    pub(super) came_since_account: i64,
    pub(super) expired: i64,
}

pub(super) struct SourceRecording {
    pub(super) id: i64,
    pub(super) name: String,
    pub(super) note: String,
    pub(super) labels: Vec<(i64, String)>,
    pub(super) t_start_ns: i64,
    pub(super) t_stop_ns: Option<i64>,
    pub(super) after_epoch: i64,
    pub(super) through_epoch: Option<i64>,
}

/// The file's number of a stream, and a row of it.
pub(super) type SourceRow = (i64, SealedRow);

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Cursor {
    pub(super) stream_key: i64,
    pub(super) seq: i64,
    pub(super) rows: u64,
}

impl SourceStream {
    fn span(&self, stream_key: i64) -> Span {
        Span {
            stream: Arc::new(self.id.clone()),
            stream_key,
            seq: (0, i64::MAX),
            epochs: (i64::MIN, i64::MAX),
        }
    }

    /// All of the stream, for the store in the file.
    pub(super) fn span_in_file(&self) -> Span {
        self.span(self.key)
    }

    /// All of the stream, for the store in the database.
    pub(super) fn span_in_database(&self) -> Span {
        self.span(self.number.into())
    }
}

impl Source {
    pub(super) fn open(file: &Path, limits: &Limits) -> Result<Self> {
        let flags = OpenFlags::SQLITE_OPEN_READ_WRITE | OpenFlags::SQLITE_OPEN_NO_MUTEX;
        let mut connection = Connection::open_with_flags(file, flags)?;
        connection.busy_timeout(limits.store_lock_time_max)?;
        if sqlite::recognize(&connection)? == Found::Nothing {
            return Err(StoreError::Foreign);
        }
        sqlite::prepare(&mut connection, file)?;
        sqlite::settle(&connection, limits)?;
        // The lock stays with the connection: nobody adds to the file while it is copied.
        connection.execute_batch("BEGIN IMMEDIATE")?;
        let streams = streams(&connection)?;
        let recordings = recordings(&connection)?;
        let sql = "SELECT epoch, groups FROM counters";
        let (epoch, groups) =
            connection.query_row(sql, [], |row| Ok((row.get(0)?, row.get(1)?)))?;
        // What was deleted cannot be copied, and its numbers stay known.
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
        })
    }

    pub(super) fn unlock(&self) -> Result<()> {
        Ok(self.connection.execute_batch("COMMIT")?)
    }

    /// Tells whether a copy that was begun was one of this file as it is now.
    pub(super) fn fingerprint(&self) -> String {
        let newest = self.streams.iter().map(|s| s.t_last_arrival_ns).max();
        format!(
            "{} streams, {} rows, {} frames, {} recordings, epoch {}, group {} at {}",
            self.streams.len(),
            self.rows,
            self.frames,
            self.recordings.len(),
            self.epoch,
            self.groups,
            newest.unwrap_or(0),
        )
    }

    /// The epoch that all collectors begin with after the copy: later than all that were copied.
    pub(super) fn next_epoch(&self) -> i64 {
        self.epoch.saturating_add(1)
    }

    /// The next rows with their streams, ordered by stream and number: whole chunks, until there are as many rows.
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

    pub(super) fn runs(&self, stream_key: i64) -> Result<Vec<(i64, i64)>> {
        let mut statement = self
            .connection
            .prepare_cached("SELECT first, last FROM runs WHERE stream_id = ?")?;
        let rows = statement.query_map([stream_key], |row| Ok((row.get(0)?, row.get(1)?)))?;
        Ok(rows.collect::<Result<_, _>>()?)
    }

    /// What each epoch brought to a stream: epoch, first and last number, frames, missing ones.
    pub(super) fn shares(&self, stream_key: i64) -> Result<Vec<[i64; 5]>> {
        let mut statement = self.connection.prepare_cached(
            "SELECT epoch, first_seq, last_seq, stored, missing FROM shares WHERE stream_id = ? ORDER BY epoch",
        )?;
        let rows = statement.query_map([stream_key], |row| {
            Ok([
                row.get(0)?,
                row.get(1)?,
                row.get(2)?,
                row.get(3)?,
                row.get(4)?,
            ])
        })?;
        Ok(rows.collect::<Result<_, _>>()?)
    }
}

fn streams(connection: &Connection) -> Result<Vec<SourceStream>> {
    let mut statement = connection.prepare(
        "SELECT id, device, sensor, boot, stored, missing, last_group, t_last_arrival_ns, account, account_read,
                came_since_account, expired FROM streams ORDER BY id",
    )?;
    let mut rows = statement.query([])?;
    let (mut streams, mut numbers) = (Vec::new(), BTreeMap::<String, i32>::new());
    while let Some(row) = rows.next()? {
        let device: String = row.get(1)?;
        let number = numbers.entry(device.clone()).or_insert(0);
        *number += 1;
        streams.push(SourceStream {
            key: row.get(0)?,
            number: *number,
            id: StreamId {
                device,
                sensor: row.get(2)?,
                boot: row.get(3)?,
            },
            stored: row.get(4)?,
            missing: row.get(5)?,
            last_group: row.get(6)?,
            t_last_arrival_ns: row.get(7)?,
            account: row.get(8)?,
            account_read: row.get(9)?,
            came_since_account: row.get(10)?,
            expired: row.get(11)?,
        });
    }
    Ok(streams)
}

fn recordings(connection: &Connection) -> Result<Vec<SourceRecording>> {
    let mut statement = connection.prepare(
        "SELECT id, name, t_start_ns, t_stop_ns, after_epoch, through_epoch, coalesce(note, '')
         FROM recordings LEFT JOIN notes ON recording_id = id ORDER BY id",
    )?;
    let rows = statement.query_map([], |row| {
        Ok(SourceRecording {
            id: row.get(0)?,
            name: row.get(1)?,
            note: row.get(6)?,
            labels: Vec::new(),
            t_start_ns: row.get(2)?,
            t_stop_ns: row.get(3)?,
            after_epoch: row.get(4)?,
            through_epoch: row.get(5)?,
        })
    })?;
    let mut recordings: Vec<SourceRecording> = rows.collect::<Result<_, _>>()?;
    for recording in &mut recordings {
        recording.labels = labels(connection, recording.id)?;
    }
    Ok(recordings)
}

fn labels(connection: &Connection, recording: i64) -> Result<Vec<(i64, String)>> {
    let mut statement = connection.prepare_cached(
        "SELECT number, label FROM labels WHERE recording_id = ? ORDER BY number",
    )?;
    let rows = statement.query_map([recording], |row| Ok((row.get(0)?, row.get(1)?)))?;
    Ok(rows.collect::<Result<_, _>>()?)
}

/// The database, with a table of its own that says how far the copy came.
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

    /// Where to go on from, or `None` if all of this file is there already.
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
                // The file has changed, or is another one: what was copied of it is no use.
                (false, false) => self.session.batch("TRUNCATE grideye.frames").await?,
                (false, true) => return Err(StoreError::NotEmpty),
            }
        }
        let sql = "SELECT (SELECT count(*) FROM grideye.streams) + (SELECT count(*) FROM grideye.recordings)";
        let held: i64 = self.session.query(sql, &[]).await?[0].try_get(0)?;
        if held > 0 {
            return Err(StoreError::NotEmpty);
        }
        self.session.batch("BEGIN").await?;
        let begun = self.claim(fingerprint).await;
        self.session.end(begun).await?;
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

    /// Copies a page; `None` after the last one.
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
        self.session.batch("BEGIN").await?;
        let copied = self.copy_rows(source, page, &next).await;
        self.session.end(copied).await?;
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

    /// Names what was copied, and lets collectors in.
    pub(super) async fn finish(&self, source: &Source) -> Result<()> {
        self.session.batch("BEGIN").await?;
        let named = self.name_all(source).await;
        self.session.end(named).await
    }

    async fn name_all(&self, source: &Source) -> Result<()> {
        let session = &self.session;
        for stream in &source.streams {
            let StreamId {
                device,
                sensor,
                boot,
            } = &stream.id;
            let (number, stored, missing) = (&stream.number, &stream.stored, &stream.missing);
            let (group, arrival) = (&stream.last_group, &stream.t_last_arrival_ns);
            let (account, read) = (&stream.account, &stream.account_read);
            let (came, expired) = (&stream.came_since_account, &stream.expired);
            let sql = "INSERT INTO grideye.streams (device, stream, sensor, boot, stored, missing, added, t_last_arrival_ns,
                           account, account_read, came_since_account, expired, lane, n)
                       VALUES ($1, $2, $3, $4, $5, $6, $7, $8, $9, $10, $11, $12, 0, 0)";
            let parameters: Parameters<'_> = &[
                device, number, sensor, boot, stored, missing, group, arrival, account, read, came,
                expired,
            ];
            session.execute(sql, parameters).await?;
            let runs = source.runs(stream.key)?;
            let (firsts, lasts): (Vec<i64>, Vec<i64>) = runs.into_iter().unzip();
            let sql =
                "INSERT INTO grideye.runs SELECT $1, $2, * FROM unnest($3::BIGINT[], $4::BIGINT[])";
            let parameters: Parameters<'_> = &[device, number, &firsts, &lasts];
            session.execute(sql, parameters).await?;
            let shares = source.shares(stream.key)?;
            let column = |index: usize| -> Vec<i64> { shares.iter().map(|s| s[index]).collect() };
            let sql = "INSERT INTO grideye.shares SELECT $1, $2, *
                       FROM unnest($3::BIGINT[], $4::BIGINT[], $5::BIGINT[], $6::BIGINT[], $7::BIGINT[])";
            let [epochs, firsts, lasts, stored, missing] = [0, 1, 2, 3, 4].map(column);
            let parameters: Parameters<'_> =
                &[device, number, &epochs, &firsts, &lasts, &stored, &missing];
            session.execute(sql, parameters).await?;
        }
        self.name_recordings(source).await?;
        let epoch = source.next_epoch();
        for sql in [
            "UPDATE grideye.lanes SET epoch = $1",
            "UPDATE grideye.layout SET epoch = $1, layout = 1",
        ] {
            session.execute(sql, &[&epoch]).await?;
        }
        let done = "UPDATE grideye.migration SET is_done = TRUE";
        session.execute(done, &[]).await.map(drop)
    }

    async fn name_recordings(&self, source: &Source) -> Result<()> {
        for recording in &source.recordings {
            let (id, name) = (&recording.id, &recording.name);
            let (start, stop) = (&recording.t_start_ns, &recording.t_stop_ns);
            let (after, through) = (&recording.after_epoch, &recording.through_epoch);
            let sql = "INSERT INTO grideye.recordings (id, name, t_start_ns, t_stop_ns, after_epoch, through_epoch)
                       VALUES ($1, $2, $3, $4, $5, $6)";
            let parameters: Parameters<'_> = &[id, name, start, stop, after, through];
            self.session.execute(sql, parameters).await?;
            if !recording.note.is_empty() {
                let sql = "INSERT INTO grideye.notes (recording, note) VALUES ($1, $2)";
                self.session.execute(sql, &[id, &recording.note]).await?;
            }
            for (number, label) in &recording.labels {
                let sql =
                    "INSERT INTO grideye.labels (recording, number, label) VALUES ($1, $2, $3)";
                self.session.execute(sql, &[id, number, label]).await?;
            }
        }
        Ok(())
    }
}
