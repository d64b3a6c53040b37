//! The database that is migrated to.

use crate::limits::Limits;
use crate::store::error::StoreError;
use crate::store::location::PostgresUrl;
use crate::store::migrate::source::{Cursor, Source, SourceRow};
use crate::store::postgres::{Days, FrameColumns, Session, UNFINISHED, prepare_tables};
use crate::store::row::{count, fitting, unsigned};
use std::collections::HashMap;

/// The database, with a table of its own that says how far the copy came.
pub(super) struct Target {
    session: Session,
}

impl Target {
    pub(super) async fn open(url: &PostgresUrl, limits: &Limits) -> Result<Self, StoreError> {
        let session = Session::open(url, limits).await?;
        match prepare_tables(&session).await {
            Ok(()) | Err(StoreError::Unfinished) => Ok(Self { session }),
            Err(error) => Err(error),
        }
    }

    /// Where to go on from, or `None` if all of this file is there already.
    pub(super) async fn begin(&self, fingerprint: &str) -> Result<Option<Cursor>, StoreError> {
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

    async fn claim(&self, fingerprint: &str) -> Result<(), StoreError> {
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
    ) -> Result<Option<Cursor>, StoreError> {
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

    async fn copy_rows(
        &self,
        source: &Source,
        page: &[SourceRow],
        next: &Cursor,
    ) -> Result<(), StoreError> {
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
    pub(super) async fn finish(&self, source: &Source) -> Result<(), StoreError> {
        self.session.batch("BEGIN").await?;
        let named = self.name_all(source).await;
        self.session.end(named).await
    }

    async fn name_all(&self, source: &Source) -> Result<(), StoreError> {
        for stream in &source.streams {
            let sql = "INSERT INTO grideye.streams (device, stream, sensor, boot, stored, missing, added, t_last_arrival_ns,
                           account, account_read, came_since_account, expired, lane, n)
                       VALUES ($1, $2, $3, $4, $5, $6, $7, $8, $9, $10, $11, $12, 0, 0)";
            self.session
                .execute(
                    sql,
                    &[
                        &stream.id.device,
                        &stream.number,
                        &stream.id.sensor,
                        &stream.id.boot,
                        &stream.stored,
                        &stream.missing,
                        &stream.last_group,
                        &stream.t_last_arrival_ns,
                        &stream.account,
                        &stream.account_read,
                        &stream.came_since_account,
                        &stream.expired,
                    ],
                )
                .await?;
            let (firsts, lasts): (Vec<i64>, Vec<i64>) =
                source.runs(stream.key)?.into_iter().unzip();
            let sql =
                "INSERT INTO grideye.runs SELECT $1, $2, * FROM unnest($3::BIGINT[], $4::BIGINT[])";
            let device = &stream.id.device;
            self.session
                .execute(sql, &[device, &stream.number, &firsts, &lasts])
                .await?;
            let shares = source.shares(stream.key)?;
            let column = |index: usize| -> Vec<i64> { shares.iter().map(|s| s[index]).collect() };
            let sql = "INSERT INTO grideye.shares SELECT $1, $2, *
                       FROM unnest($3::BIGINT[], $4::BIGINT[], $5::BIGINT[], $6::BIGINT[], $7::BIGINT[])";
            let (epochs, firsts, lasts) = (column(0), column(1), column(2));
            let (stored, missing) = (column(3), column(4));
            self.session
                .execute(
                    sql,
                    &[
                        device,
                        &stream.number,
                        &epochs,
                        &firsts,
                        &lasts,
                        &stored,
                        &missing,
                    ],
                )
                .await?;
        }
        self.name_recordings(source).await?;
        let epoch = source.next_epoch();
        self.session
            .execute("UPDATE grideye.lanes SET epoch = $1", &[&epoch])
            .await?;
        self.session
            .execute(
                "UPDATE grideye.layout SET epoch = $1, layout = 1",
                &[&epoch],
            )
            .await?;
        self.session
            .execute("UPDATE grideye.migration SET is_done = TRUE", &[])
            .await?;
        Ok(())
    }

    async fn name_recordings(&self, source: &Source) -> Result<(), StoreError> {
        for recording in &source.recordings {
            let after = recording.after_epoch;
            let through = recording.through_epoch;
            let sql = "INSERT INTO grideye.recordings (id, name, t_start_ns, t_stop_ns, after_epoch, through_epoch)
                       VALUES ($1, $2, $3, $4, $5, $6)";
            self.session
                .execute(
                    sql,
                    &[
                        &recording.id,
                        &recording.name,
                        &recording.t_start_ns,
                        &recording.t_stop_ns,
                        &after,
                        &through,
                    ],
                )
                .await?;
            if !recording.note.is_empty() {
                let sql = "INSERT INTO grideye.notes (recording, note) VALUES ($1, $2)";
                self.session
                    .execute(sql, &[&recording.id, &recording.note])
                    .await?;
            }
            for (number, label) in &recording.labels {
                let sql =
                    "INSERT INTO grideye.labels (recording, number, label) VALUES ($1, $2, $3)";
                self.session
                    .execute(sql, &[&recording.id, number, label])
                    .await?;
            }
        }
        Ok(())
    }
}
