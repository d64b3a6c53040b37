//! A connection with its prepared statements, and what the database's errors mean here.

use crate::limits::Limits;
use crate::store::error::StoreError;
use crate::store::location::PostgresUrl;
use std::collections::HashMap;
use std::sync::{Arc, Mutex, PoisonError};
use tokio_postgres::error::SqlState;
use tokio_postgres::types::ToSql;
use tokio_postgres::{Client, NoTls, Row, Statement};

pub(crate) type Parameters<'a> = &'a [&'a (dyn ToSql + Sync)];

/// A connection; its statements are prepared once.
pub(crate) struct Session {
    client: Client,
    /// As many as there are texts of statements in this module.
    prepared: Mutex<HashMap<&'static str, Statement>>,
}

impl Session {
    /// Connects, with time limits on the database's side as well.
    pub(crate) async fn open(url: &PostgresUrl, limits: &Limits) -> Result<Self, StoreError> {
        let mut config = url.config.clone();
        config
            .connect_timeout(limits.store_lock_time_max)
            .tcp_user_timeout(limits.store_lock_time_max)
            .application_name("grideye");
        let connected = tokio::time::timeout(limits.store_lock_time_max, config.connect(NoTls));
        let (client, connection) = connected.await.map_err(|_elapsed| {
            StoreError::Unreachable(format!("no answer within {:?}", limits.store_lock_time_max))
        })??;
        // Ends when the client is dropped or the database is gone; every later request then says so.
        tokio::spawn(connection);
        let session = Self {
            client,
            prepared: Mutex::default(),
        };
        let wait_ms = limits.store_lock_time_max.as_millis();
        // What is acknowledged must be on disk, whatever the database's own setting says.
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

    pub(crate) async fn query(
        &self,
        sql: &'static str,
        parameters: Parameters<'_>,
    ) -> Result<Vec<Row>, StoreError> {
        let statement = self.prepare(sql).await?;
        Ok(self.client.query(&statement, parameters).await?)
    }

    pub(crate) async fn execute(
        &self,
        sql: &'static str,
        parameters: Parameters<'_>,
    ) -> Result<u64, StoreError> {
        let statement = self.prepare(sql).await?;
        Ok(self.client.execute(&statement, parameters).await?)
    }

    pub(crate) async fn batch(&self, sql: &str) -> Result<(), StoreError> {
        Ok(self.client.batch_execute(sql).await?)
    }

    /// Ends a transaction: commits what went well, undoes the rest.
    pub(crate) async fn end<T>(&self, done: Result<T, StoreError>) -> Result<T, StoreError> {
        match done {
            Ok(done) => {
                self.batch("COMMIT").await?;
                Ok(done)
            }
            Err(error) => {
                // The error is the one that counts; a connection that is gone undoes by itself.
                let _ = self.batch("ROLLBACK").await;
                Err(error)
            }
        }
    }

    async fn prepare(&self, sql: &'static str) -> Result<Statement, StoreError> {
        let known = self.lock().get(sql).cloned();
        if let Some(statement) = known {
            return Ok(statement);
        }
        let statement = self.client.prepare(sql).await?;
        self.lock().insert(sql, statement.clone());
        Ok(statement)
    }

    fn lock(&self) -> std::sync::MutexGuard<'_, HashMap<&'static str, Statement>> {
        self.prepared.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// A session that many use at once for single statements, and that is made again when it is gone.
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

    pub(super) async fn session(&self) -> Result<Arc<Session>, StoreError> {
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
