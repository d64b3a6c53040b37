//! Writes what a plan decided: one statement for each table.

use crate::store::account;
use crate::store::error::StoreError;
use crate::store::plan::{StreamState, Streams};
use crate::store::postgres::session::{Parameters, Session};
use crate::store::row::Columns;
use grideye_recording::{Record, StreamId};
use std::collections::{BTreeMap, BTreeSet};

/// What changed, ordered by key.
type Touched<'s> = BTreeMap<&'s StreamId, &'s StreamState>;

pub(super) async fn all(
    session: &Session,
    states: &Streams,
    lane: (i64, i64),
    epoch: i64,
) -> Result<(), StoreError> {
    let touched: Touched<'_> = states
        .iter()
        .filter(|(_, state)| state.is_touched)
        .map(|(id, state)| (&**id, state))
        .collect();
    frames(session, &touched, epoch).await?;
    runs(session, &touched).await?;
    shares(session, &touched, epoch).await?;
    streams(session, &touched, lane).await
}

/// Takes streams away that were made for batches which were then refused.
pub(super) async fn without_empty(
    session: &Session,
    empty: &BTreeSet<&StreamId>,
) -> Result<(), StoreError> {
    for id in empty {
        let sql = "DELETE FROM grideye.streams WHERE device = $1 AND sensor = $2 AND boot = $3";
        session
            .execute(sql, &[&id.device, &id.sensor, &id.boot])
            .await?;
    }
    Ok(())
}

async fn frames(session: &Session, touched: &Touched<'_>, epoch: i64) -> Result<(), StoreError> {
    let mut frames = FrameColumns::default();
    for (id, state) in touched {
        for (record, t_arrival_ns) in state.fresh.iter() {
            let key = (id.device.as_str(), number(state));
            frames.push(key, record, *t_arrival_ns, epoch)?;
        }
    }
    frames.insert(session).await
}

/// Rows of `frames`, column by column, for one statement.
#[derive(Default)]
pub(crate) struct FrameColumns<'d> {
    devices: Vec<&'d str>,
    streams: Vec<i32>,
    seqs: Vec<i64>,
    t_boots: Vec<i64>,
    t_utcs: Vec<i64>,
    clocks: Vec<i16>,
    t_arrivals: Vec<i64>,
    epochs: Vec<i64>,
    missings: Vec<Option<&'static str>>,
    thermistors: Vec<Option<i32>>,
    pixels: Vec<Option<Vec<u8>>>,
}

impl<'d> FrameColumns<'d> {
    pub(crate) fn push(
        &mut self,
        (device, stream): (&'d str, i32),
        record: &Record,
        t_arrival_ns: i64,
        epoch: i64,
    ) -> Result<(), StoreError> {
        let columns = Columns::of(record)?;
        self.devices.push(device);
        self.streams.push(stream);
        self.seqs.push(columns.seq);
        self.t_boots.push(columns.t_boot_ns);
        self.t_utcs.push(columns.t_utc_ns);
        self.clocks.push(columns.clock);
        self.t_arrivals.push(t_arrival_ns);
        self.epochs.push(epoch);
        self.missings.push(columns.missing);
        self.thermistors.push(columns.thermistor.map(i32::from));
        self.pixels.push(columns.pixels.map(Vec::from));
        Ok(())
    }

    pub(crate) async fn insert(&self, session: &Session) -> Result<(), StoreError> {
        if self.seqs.is_empty() {
            return Ok(());
        }
        let sql = "INSERT INTO grideye.frames (device, stream, seq, t_boot_ns, t_utc_ns, clock, t_arrival_ns, epoch, missing, thermistor, pixels)
                   SELECT * FROM unnest($1::TEXT[], $2::INT[], $3::BIGINT[], $4::BIGINT[], $5::BIGINT[], $6::SMALLINT[],
                                        $7::BIGINT[], $8::BIGINT[], $9::TEXT[], $10::INT[], $11::BYTEA[])";
        let parameters: Parameters<'_> = &[
            &self.devices,
            &self.streams,
            &self.seqs,
            &self.t_boots,
            &self.t_utcs,
            &self.clocks,
            &self.t_arrivals,
            &self.epochs,
            &self.missings,
            &self.thermistors,
            &self.pixels,
        ];
        session.execute(sql, parameters).await?;
        Ok(())
    }
}

async fn runs(session: &Session, touched: &Touched<'_>) -> Result<(), StoreError> {
    let (mut gone, mut changed) = (RunColumns::default(), RunColumns::default());
    for (id, state) in touched {
        let (gone_runs, changed_runs) = state.changed_runs();
        for first in gone_runs {
            gone.push(id, state, (first, first));
        }
        for (first, last) in changed_runs {
            changed.push(id, state, (first, last));
        }
    }
    if !gone.streams.is_empty() {
        let sql = "DELETE FROM grideye.runs
                   WHERE (device, stream, first_seq) IN (SELECT * FROM unnest($1::TEXT[], $2::INT[], $3::BIGINT[]))";
        session
            .execute(sql, &[&gone.devices, &gone.streams, &gone.firsts])
            .await?;
    }
    if !changed.streams.is_empty() {
        let sql = "INSERT INTO grideye.runs (device, stream, first_seq, last_seq)
                   SELECT * FROM unnest($1::TEXT[], $2::INT[], $3::BIGINT[], $4::BIGINT[])
                   ON CONFLICT (device, stream, first_seq) DO UPDATE SET last_seq = excluded.last_seq";
        let parameters: Parameters<'_> = &[
            &changed.devices,
            &changed.streams,
            &changed.firsts,
            &changed.lasts,
        ];
        session.execute(sql, parameters).await?;
    }
    Ok(())
}

#[derive(Default)]
struct RunColumns<'s> {
    devices: Vec<&'s str>,
    streams: Vec<i32>,
    firsts: Vec<i64>,
    lasts: Vec<i64>,
}

impl<'s> RunColumns<'s> {
    fn push(&mut self, id: &'s StreamId, state: &StreamState, (first, last): (u64, u64)) {
        // Numbers were checked to fit before they came into a run.
        let fitting = |seq| i64::try_from(seq).unwrap_or(i64::MAX);
        self.devices.push(&id.device);
        self.streams.push(number(state));
        self.firsts.push(fitting(first));
        self.lasts.push(fitting(last));
    }
}

/// What this epoch brought to each stream: one row for as long as the epoch lasts.
async fn shares(session: &Session, touched: &Touched<'_>, epoch: i64) -> Result<(), StoreError> {
    let (mut devices, mut streams) = (Vec::new(), Vec::new());
    let (mut firsts, mut lasts) = (Vec::new(), Vec::new());
    let (mut stored, mut missing) = (Vec::new(), Vec::new());
    for (id, state) in touched {
        if let Some(share) = state.share() {
            devices.push(id.device.as_str());
            streams.push(number(state));
            firsts.push(share.0);
            lasts.push(share.1);
            stored.push(share.2);
            missing.push(share.3);
        }
    }
    if streams.is_empty() {
        return Ok(());
    }
    let sql = "INSERT INTO grideye.shares AS s (device, stream, epoch, first_seq, last_seq, stored, missing)
               SELECT device, stream, $7, first_seq, last_seq, stored, missing
               FROM unnest($1::TEXT[], $2::INT[], $3::BIGINT[], $4::BIGINT[], $5::BIGINT[], $6::BIGINT[])
               AS a (device, stream, first_seq, last_seq, stored, missing)
               ON CONFLICT (device, stream, epoch) DO UPDATE SET
                   first_seq = least(s.first_seq, excluded.first_seq), last_seq = greatest(s.last_seq, excluded.last_seq),
                   stored = s.stored + excluded.stored, missing = s.missing + excluded.missing";
    let parameters: Parameters<'_> = &[
        &devices, &streams, &firsts, &lasts, &stored, &missing, &epoch,
    ];
    session.execute(sql, parameters).await?;
    Ok(())
}

/// `added` orders the streams of one sensor by when they were added to, without a counter that all devices share.
async fn streams(
    session: &Session,
    touched: &Touched<'_>,
    (lane, n): (i64, i64),
) -> Result<(), StoreError> {
    if touched.is_empty() {
        return Ok(());
    }
    let devices: Vec<&str> = touched.keys().map(|id| id.device.as_str()).collect();
    let streams: Vec<i32> = touched.values().map(|state| number(state)).collect();
    let stored: Vec<i64> = touched.values().map(|state| state.stored).collect();
    let missing: Vec<i64> = touched.values().map(|state| state.missing).collect();
    let arrivals: Vec<i64> = touched.values().map(|s| s.t_last_arrival_ns).collect();
    let accounts: Vec<Option<String>> = touched
        .values()
        .map(|state| state.account.as_ref())
        .map(|account| account.map(account::to_text))
        .collect();
    let reads: Vec<Option<i64>> = touched.values().map(|state| state.account_read).collect();
    let came: Vec<i64> = touched.values().map(|s| s.came_since_account).collect();
    let sent: Vec<Option<i64>> = touched.values().map(|state| state.t_sent_boot_ns).collect();
    let added: Vec<bool> = touched.values().map(|s| !s.fresh.is_empty()).collect();
    let sql = "UPDATE grideye.streams s SET
                   stored = u.stored, missing = u.missing, t_last_arrival_ns = u.t_last_arrival_ns, account = u.account,
                   account_read = u.account_read, came_since_account = u.came, t_sent_boot_ns = u.sent, lane = $11, n = $12,
                   added = CASE WHEN u.is_added THEN
                       (SELECT max(o.added) + 1 FROM grideye.streams o WHERE o.device = s.device AND o.sensor = s.sensor)
                       ELSE s.added END
               FROM unnest($1::TEXT[], $2::INT[], $3::BIGINT[], $4::BIGINT[], $5::BIGINT[], $6::TEXT[], $7::BIGINT[],
                           $8::BIGINT[], $9::BIGINT[], $10::BOOLEAN[])
               AS u (device, stream, stored, missing, t_last_arrival_ns, account, account_read, came, sent, is_added)
               WHERE s.device = u.device AND s.stream = u.stream";
    let parameters: Parameters<'_> = &[
        &devices, &streams, &stored, &missing, &arrivals, &accounts, &reads, &came, &sent, &added,
        &lane, &n,
    ];
    session.execute(sql, parameters).await?;
    Ok(())
}

pub(super) fn number(state: &StreamState) -> i32 {
    i32::try_from(state.key).unwrap_or(i32::MAX)
}
