//! Store time, by which frames age: it follows the collector's monotonic clock, stops while no collector runs, and is
//! stored in the file. So no step of the wall clock ages a frame.

use crate::clock::Clock;
use crate::store::error::Result;
use rusqlite::Connection;
use std::sync::Arc;
use std::time::Duration;

pub(super) struct StoreTime {
    /// Without a clock the time stands still, and nothing ages.
    clock: Option<Arc<dyn Clock>>,
    opened_at: Duration,
    opened_at_ns: i64,
}

impl StoreTime {
    pub(super) fn open(connection: &Connection, clock: Option<Arc<dyn Clock>>) -> Result<Self> {
        Ok(Self {
            opened_at: monotonic(clock.as_ref()),
            opened_at_ns: kept(connection)?,
            clock,
        })
    }

    pub(super) fn now_ns(&self) -> i64 {
        let passed = monotonic(self.clock.as_ref()).saturating_sub(self.opened_at);
        self.opened_at_ns.saturating_add(nanoseconds(passed))
    }
}

fn monotonic(clock: Option<&Arc<dyn Clock>>) -> Duration {
    clock.map_or(Duration::ZERO, |clock| clock.monotonic())
}

pub(super) fn nanoseconds(time: Duration) -> i64 {
    i64::try_from(time.as_nanos()).unwrap_or(i64::MAX)
}

pub(super) fn kept(connection: &Connection) -> Result<i64> {
    let mut statement = connection.prepare_cached("SELECT t_store_ns FROM counters")?;
    Ok(statement.query_row([], |row| row.get(0))?)
}

/// Stores the time in the file. The value always grows, so this write tests whether the store is writable.
pub(super) fn keep(connection: &Connection, now_ns: i64) -> Result<()> {
    connection
        .prepare_cached("UPDATE counters SET t_store_ns = max(t_store_ns + (t_store_ns < 9223372036854775807), ?)")?
        .execute([now_ns])?;
    Ok(())
}
