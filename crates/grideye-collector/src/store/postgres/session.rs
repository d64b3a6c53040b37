//! A connection with its prepared statements, the mapping of database errors to store errors, and the tables.

use crate::limits::Limits;
use crate::lock::lock;
use crate::store::error::{Result, StoreError};
use crate::store::location::PostgresUrl;
use std::collections::HashMap;
use std::sync::{Arc, Mutex};
use std::time::Duration;
use tokio_postgres::error::SqlState;
use tokio_postgres::types::ToSql;
use tokio_postgres::{Client, NoTls, Row, Statement};

pub(crate) type Parameters<'a> = &'a [&'a (dyn ToSql + Sync)];

/// A connection that prepares each statement once.
pub(crate) struct Session {
    url: PostgresUrl,
    limits: Limits,
    client: Client,
    /// At most one entry per SQL text of the stores.
    prepared: Mutex<HashMap<String, Statement>>,
}

impl Session {
    /// Connects, and sets time limits on the database's side too.
    pub(crate) async fn open(url: &PostgresUrl, limits: &Limits) -> Result<Self> {
        let mut config = url.config.clone();
        config
            .connect_timeout(limits.store_lock_time_max)
            .tcp_user_timeout(limits.store_lock_time_max)
            .application_name("grideye");
        let connected = tokio::time::timeout(limits.store_lock_time_max, config.connect(NoTls));
        let (client, connection) = connected.await.map_err(|_elapsed| {
            StoreError::Unreachable(format!("no answer within {:?}", limits.store_lock_time_max))
        })??;
        // Ends when the client is dropped or the database is gone; every later request then fails.
        tokio::spawn(connection);
        let session = Self {
            url: url.clone(),
            limits: limits.clone(),
            client,
            prepared: Mutex::default(),
        };
        let wait_ms = limits.store_lock_time_max.as_millis();
        // Acknowledged frames must be on disk, whatever the database's own setting.
        session
            .batch(&format!(
                "SET synchronous_commit = on; SET lock_timeout = {wait_ms}; SET statement_timeout = {};
                 SET idle_in_transaction_session_timeout = {wait_ms}; SET client_min_messages = warning",
                4 * wait_ms
            ))
            .await?;
        Ok(session)
    }

    pub(crate) fn is_closed(&self) -> bool {
        self.client.is_closed()
    }

    /// Reconnects if the connection is gone, for example after a restart of the database.
    pub(super) async fn revive(&mut self) -> Result<()> {
        if self.is_closed() {
            *self = Self::open(&self.url, &self.limits).await?;
        }
        Ok(())
    }

    pub(crate) async fn query(&self, sql: &str, parameters: Parameters<'_>) -> Result<Vec<Row>> {
        let statement = self.prepare(sql).await?;
        Ok(self.client.query(&statement, parameters).await?)
    }

    pub(crate) async fn execute(&self, sql: &str, parameters: Parameters<'_>) -> Result<u64> {
        let statement = self.prepare(sql).await?;
        Ok(self.client.execute(&statement, parameters).await?)
    }

    pub(crate) async fn batch(&self, sql: &str) -> Result<()> {
        Ok(self.client.batch_execute(sql).await?)
    }

    /// Runs `work` in a transaction: commits on success, otherwise rolls back.
    pub(crate) async fn transact<T, E: From<StoreError>>(
        &self,
        work: impl Future<Output = Result<T, E>>,
    ) -> Result<T, E> {
        self.batch("BEGIN").await?;
        let done = work.await;
        if done.is_ok() {
            self.batch("COMMIT").await?;
        } else {
            // Return the work's error; a lost connection rolls back by itself.
            let _ = self.batch("ROLLBACK").await;
        }
        done
    }

    async fn prepare(&self, sql: &str) -> Result<Statement> {
        let known = lock(&self.prepared).get(sql).cloned();
        if let Some(statement) = known {
            return Ok(statement);
        }
        let statement = self.client.prepare(sql).await?;
        lock(&self.prepared).insert(sql.to_owned(), statement.clone());
        Ok(statement)
    }
}

/// A session that many requests use at once for single statements; reconnects when it is gone.
pub(super) struct Shared {
    url: PostgresUrl,
    limits: Limits,
    session: tokio::sync::Mutex<Held>,
}

enum Held {
    Nothing,
    Open(Arc<Session>),
    Closed,
}

impl Shared {
    pub(super) fn new(url: &PostgresUrl, limits: &Limits) -> Self {
        Self {
            url: url.clone(),
            limits: limits.clone(),
            session: tokio::sync::Mutex::new(Held::Nothing),
        }
    }

    pub(super) async fn session(&self) -> Result<Arc<Session>> {
        let mut held = self.session.lock().await;
        match &*held {
            Held::Closed => return Err(StoreError::Closed),
            Held::Open(session) if !session.is_closed() => return Ok(Arc::clone(session)),
            Held::Open(_) | Held::Nothing => {}
        }
        let session = Arc::new(Session::open(&self.url, &self.limits).await?);
        *held = Held::Open(Arc::clone(&session));
        Ok(session)
    }

    pub(super) async fn close(&self) {
        *self.session.lock().await = Held::Closed;
    }
}

impl From<tokio_postgres::Error> for StoreError {
    fn from(error: tokio_postgres::Error) -> Self {
        let Some(refused) = error.as_db_error() else {
            let message = std::error::Error::source(&error)
                .map_or_else(|| error.to_string(), |source| format!("{error}: {source}"));
            return Self::Unreachable(message);
        };
        let message = refused.message().to_owned();
        let code = refused.code();
        // https://www.postgresql.org/docs/15/errcodes-appendix.html
        match code.code().get(..2) {
            _ if *code == SqlState::DISK_FULL => Self::Full,
            // Serialization failure, deadlock, lock not available, statement cancelled.
            Some("40" | "55") => Self::Contended(message),
            _ if *code == SqlState::QUERY_CANCELED => Self::Contended(message),
            // Connection, authorization, unknown database, insufficient resources, operator intervention.
            Some("08" | "28" | "3D" | "53" | "57") => Self::Unreachable(message),
            _ => Self::Failed(format!("{message} (SQLSTATE {})", code.code())),
        }
    }
}

/// The layout number of a database whose migration is not finished.
pub(crate) const UNFINISHED: i32 = 0;

const LAYOUT: i32 = 1;
/// Collectors that start together all try to create the tables; one succeeds, the others check again.
const ATTEMPTS_MAX: u32 = 20;
const PAUSE: Duration = Duration::from_millis(100);
/// Frames that arrive on one day of the collector's clock share a partition.
const DAY_NS: i64 = 86_400_000_000_000;

/// The thermistor of a frame whose thermistor is not known: the layout's tables ask for a number beside pixels.
pub(crate) const NO_THERMISTOR: i32 = -1;

/// In a separate schema. Text compares byte by byte, as in Rust.
const TABLES: &str = "
CREATE TABLE grideye.layout (
    only_row INT NOT NULL PRIMARY KEY CHECK (only_row = 1), layout INT NOT NULL, epoch BIGINT NOT NULL
);
INSERT INTO grideye.layout VALUES (1, 1, 1);
CREATE TABLE grideye.lanes (lane BIGINT NOT NULL PRIMARY KEY, epoch BIGINT NOT NULL, n BIGINT NOT NULL);
CREATE TABLE grideye.streams (
    device TEXT NOT NULL, stream INT NOT NULL, sensor TEXT NOT NULL, boot TEXT NOT NULL,
    stored BIGINT NOT NULL, missing BIGINT NOT NULL, added BIGINT NOT NULL, t_last_arrival_ns BIGINT NOT NULL,
    account TEXT, account_read BIGINT, came_since_account BIGINT NOT NULL, expired BIGINT NOT NULL DEFAULT 0,
    lane BIGINT NOT NULL, n BIGINT NOT NULL, t_sent_boot_ns BIGINT,
    PRIMARY KEY (device, stream), UNIQUE (device, sensor, boot)
);
CREATE TABLE grideye.runs (
    device TEXT NOT NULL, stream INT NOT NULL, first_seq BIGINT NOT NULL, last_seq BIGINT NOT NULL,
    PRIMARY KEY (device, stream, first_seq)
);
CREATE TABLE grideye.shares (
    device TEXT NOT NULL, stream INT NOT NULL, epoch BIGINT NOT NULL, first_seq BIGINT NOT NULL, last_seq BIGINT NOT NULL,
    stored BIGINT NOT NULL, missing BIGINT NOT NULL, PRIMARY KEY (device, stream, epoch)
);
CREATE INDEX shares_of_epoch ON grideye.shares (epoch);
CREATE TABLE grideye.recordings (
    id BIGINT NOT NULL PRIMARY KEY, name TEXT NOT NULL UNIQUE, t_start_ns BIGINT NOT NULL, t_stop_ns BIGINT,
    after_epoch BIGINT NOT NULL, through_epoch BIGINT
);
CREATE TABLE grideye.frames (
    device TEXT NOT NULL, stream INT NOT NULL, seq BIGINT NOT NULL, t_boot_ns BIGINT NOT NULL, t_utc_ns BIGINT NOT NULL,
    clock SMALLINT NOT NULL CHECK (clock BETWEEN 0 AND 2), t_arrival_ns BIGINT NOT NULL, epoch BIGINT NOT NULL,
    missing TEXT, thermistor INT, pixels BYTEA CHECK (pixels IS NULL OR length(pixels) = 128),
    PRIMARY KEY (device, stream, seq, t_arrival_ns),
    CHECK ((missing IS NULL) = (pixels IS NOT NULL)), CHECK ((missing IS NULL) = (thermistor IS NOT NULL))
)";

/// Not part of the layout: older versions of this program neither need nor touch this table.
const NOTES: &str = "CREATE TABLE IF NOT EXISTS grideye.notes (recording BIGINT NOT NULL PRIMARY KEY, note TEXT NOT NULL)";

/// A label is stored as JSON: its name and its frames.
const LABELS: &str = "CREATE TABLE IF NOT EXISTS grideye.labels (
    recording BIGINT NOT NULL, number BIGINT NOT NULL, label TEXT NOT NULL, PRIMARY KEY (recording, number))";

/// A fact is a sentence about the store.
const FACTS: &str = "CREATE TABLE IF NOT EXISTS grideye.facts (fact TEXT NOT NULL PRIMARY KEY)";

/// A running recording with a lease ends if it is not renewed.
const LEASES: &str = "CREATE TABLE IF NOT EXISTS grideye.leases (recording BIGINT NOT NULL PRIMARY KEY, renewals BIGINT NOT NULL)";

/// Creates the tables in an empty database, or checks that the existing ones are ours.
pub(crate) async fn prepare(session: &Session) -> Result<()> {
    let mut last = None;
    for _ in 0..ATTEMPTS_MAX {
        let is_there = recognize(session).await?;
        let made = async {
            if !is_there {
                make(session).await?;
            }
            add_what_is_written(session).await
        };
        match made.await {
            Ok(()) => return Ok(()),
            Err(error) => last = Some(error),
        }
        tokio::time::sleep(PAUSE).await;
    }
    Err(last.unwrap_or_else(StoreError::foreign))
}

/// Checks, without changing anything, whether the tables exist. Rejects those of a later version.
async fn recognize(session: &Session) -> Result<bool> {
    let sql = "SELECT count(*) FROM information_schema.tables
               WHERE table_schema = 'grideye' AND table_name = 'layout'";
    let tables: i64 = session.query(sql, &[]).await?[0].try_get(0)?;
    if tables == 0 {
        return Ok(false);
    }
    let sql = "SELECT layout FROM grideye.layout";
    let rows = session.query(sql, &[]).await?;
    let layout = rows.first().map(|row| row.try_get::<_, i32>(0));
    match layout.transpose()? {
        Some(LAYOUT) => Ok(true),
        Some(UNFINISHED) => Err(StoreError::Unfinished),
        Some(found) if found > LAYOUT => Err(StoreError::newer(found.into(), LAYOUT.into())),
        _ => Err(StoreError::foreign()),
    }
}

/// Adds the tables for notes, labels, facts and leases to a store that lacks them.
async fn add_what_is_written(session: &Session) -> Result<()> {
    let sql = "SELECT count(*) FROM information_schema.tables
               WHERE table_schema = 'grideye' AND table_name = $1";
    for (name, table) in [
        ("notes", NOTES),
        ("labels", LABELS),
        ("facts", FACTS),
        ("leases", LEASES),
    ] {
        // Checked first, because a user who may only read and write tables cannot create one.
        let tables: i64 = session.query(sql, &[&name]).await?[0].try_get(0)?;
        if tables == 0 {
            session.batch(table).await?;
        }
    }
    Ok(())
}

async fn make(session: &Session) -> Result<()> {
    let version: String = session.query("SELECT version()", &[]).await?[0].try_get(0)?;
    let made = if version.contains("CockroachDB") {
        format!("CREATE SCHEMA IF NOT EXISTS grideye;{TABLES}")
    } else {
        // The default partition takes what fits no day: no frame is rejected for lack of a partition.
        format!(
            "CREATE SCHEMA IF NOT EXISTS grideye;{TABLES} PARTITION BY RANGE (t_arrival_ns);
             CREATE TABLE grideye.frames_other PARTITION OF grideye.frames DEFAULT"
        )
    };
    session.transact(session.batch(&made)).await
}

#[derive(Debug, Default)]
pub(crate) struct Days(Option<(i64, i64)>);

impl Days {
    /// Creates the partitions of this day and the next. Frames that came before their partition stay in the default
    /// one.
    pub(crate) async fn prepare(&mut self, session: &Session, t_arrival_ns: i64) {
        let day = t_arrival_ns.div_euclid(DAY_NS);
        if self
            .0
            .is_some_and(|(first, last)| (first..last).contains(&day))
        {
            return;
        }
        for day in [day, day + 1] {
            let (Some(from), Some(to)) = (day.checked_mul(DAY_NS), (day + 1).checked_mul(DAY_NS))
            else {
                continue;
            };
            let sql = format!(
                "CREATE TABLE IF NOT EXISTS grideye.{} PARTITION OF grideye.frames FOR VALUES FROM ({from}) TO ({to})",
                name_of(day)
            );
            // If this fails, the default partition or the unpartitioned table takes the day.
            let _ = session.batch(&sql).await;
        }
        self.0 = Some((day, day + 1));
    }
}

/// `frames_18952`: days since 1970-01-01; `frames_m1` is the day before that.
fn name_of(day: i64) -> String {
    let sign = if day < 0 { "m" } else { "" };
    format!("frames_{sign}{}", day.unsigned_abs())
}
