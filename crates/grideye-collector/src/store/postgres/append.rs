//! Writes a group of batches in one transaction: reads the known state under lock, then writes each table with one
//! statement.

use crate::limits::Limits;
use crate::store::account;
use crate::store::error::{Result, StoreError};
use crate::store::plan::{Contents, Plan, StreamName, StreamState, Streams, Taken};
use crate::store::postgres::read::{record_of, state_of, stream_id};
use crate::store::postgres::session::{NO_THERMISTOR, Parameters, Session};
use crate::store::row::{count, fitting};
use crate::store::types::Appended;
use grideye_frame::Reading;
use grideye_recording::record::layout::words_to_bytes;
use grideye_recording::{Record, StreamId};
use serde_json::{Value, json};
use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::sync::Arc;

pub(super) enum Undone {
    /// The lane was deleted and must be created again.
    NoLane,
    Error(StoreError),
}

impl From<StoreError> for Undone {
    fn from(error: StoreError) -> Self {
        Self::Error(error)
    }
}

/// Streams whose numbers are held in memory, at most.
const KNOWN_MAX: usize = 20_000;

/// The database's numbers of streams, which do not change while there is a stream.
#[derive(Debug, Default)]
pub(super) struct Known(HashMap<StreamId, i32>);

/// A stream's key: the device, and the stream's number within it.
pub(super) type Key = (String, i32);

/// Stores the whole group, or nothing.
pub(super) async fn group(
    session: &Session,
    lane: i64,
    taken: &[Taken],
    known: &mut Known,
    limits: &Limits,
) -> Result<Vec<Result<Appended>>, Undone> {
    let work = transact(session, lane, taken, known, limits);
    let transacted = session.transact(work).await;
    if transacted.is_err() || known.0.len() > KNOWN_MAX {
        known.0.clear();
    }
    let (appended, found) = transacted?;
    known.0.extend(found);
    Ok(appended)
}

type Found = Vec<(StreamId, i32)>;

async fn transact(
    session: &Session,
    lane: i64,
    taken: &[Taken],
    known: &Known,
    limits: &Limits,
) -> Result<(Vec<Result<Appended>>, Found), Undone> {
    let sql = "UPDATE grideye.lanes SET n = n + 1 WHERE lane = $1 RETURNING n, epoch";
    let rows = session.query(sql, &[&lane]).await?;
    let row = rows.first().ok_or(Undone::NoLane)?;
    let n: i64 = row.try_get(0).map_err(StoreError::from)?;
    let epoch: i64 = row.try_get(1).map_err(StoreError::from)?;

    let names = taken.iter().flat_map(Taken::streams);
    let wanted: BTreeSet<StreamId> = names.map(StreamName::to_id).collect();
    let (keys, made) = keys(session, &wanted, known).await?;
    let mut states = states(session, &keys, taken, limits).await?;
    if states.len() < keys.len() {
        return Err(contended("a stream was deleted").into());
    }
    for id in &made {
        states
            .get_mut(id)
            .into_iter()
            .for_each(|state| state.is_new = true);
    }
    let contents = contents(session, &states, taken).await?;
    let mut plan = Plan {
        streams: &mut states,
        contents: &contents,
        limits,
    };
    let appended = taken.iter().map(|taken| plan.take(taken)).collect();
    for state in states.values_mut() {
        state.runs.note_newest();
    }
    save_all(session, &states, (lane, n), epoch).await?;
    // Streams created for batches that were then rejected.
    let is_empty = |id: &&StreamId| states.get(*id).is_none_or(|state| !state.is_touched);
    let empty: BTreeSet<&StreamId> = made.iter().filter(is_empty).collect();
    without_empty(session, &empty).await?;
    let found = keys
        .into_iter()
        .filter(|(id, _)| !empty.contains(id))
        .map(|(id, key)| (id, key.1))
        .collect();
    Ok((appended, found))
}

/// The keys of the wanted streams, and the ids of those just created.
async fn keys(
    session: &Session,
    wanted: &BTreeSet<StreamId>,
    known: &Known,
) -> Result<(BTreeMap<StreamId, Key>, BTreeSet<StreamId>)> {
    let mut keys: BTreeMap<StreamId, Key> = BTreeMap::new();
    for id in wanted {
        if let Some(stream) = known.0.get(id) {
            keys.insert(id.clone(), (id.device.clone(), *stream));
        }
    }
    look_up(session, wanted, &mut keys).await?;
    let mut made = BTreeSet::new();
    // In order, so that two collectors that create the same streams never deadlock.
    for id in wanted.iter().filter(|id| !keys.contains_key(id)) {
        // Another collector may create the same stream or take the same number right now: then the insert does nothing.
        let sql = "INSERT INTO grideye.streams (device, stream, sensor, boot, stored, missing, added, t_last_arrival_ns,
                                                came_since_account, lane, n)
                   SELECT $1, coalesce(max(stream), 0) + 1, $2, $3, 0, 0, 0, 0, 0, 0, 0
                   FROM grideye.streams WHERE device = $1
                   ON CONFLICT DO NOTHING";
        let name: Parameters<'_> = &[&id.device, &id.sensor, &id.boot];
        if session.execute(sql, name).await? == 1 {
            made.insert(id.clone());
        }
    }
    look_up(session, wanted, &mut keys).await?;
    if keys.len() < wanted.len() {
        return Err(contended(
            "a stream was made at the same moment by another collector",
        ));
    }
    Ok((keys, made))
}

/// The group is tried again.
fn contended(why: &str) -> StoreError {
    StoreError::Contended(why.to_owned())
}

async fn look_up(
    session: &Session,
    wanted: &BTreeSet<StreamId>,
    keys: &mut BTreeMap<StreamId, Key>,
) -> Result<()> {
    let (mut devices, mut sensors, mut boots) = (Vec::new(), Vec::new(), Vec::new());
    for id in wanted.iter().filter(|id| !keys.contains_key(id)) {
        devices.push(id.device.as_str());
        sensors.push(id.sensor.as_str());
        boots.push(id.boot.as_str());
    }
    if devices.is_empty() {
        return Ok(());
    }
    let sql = "SELECT s.device, s.sensor, s.boot, s.stream
               FROM unnest($1::TEXT[], $2::TEXT[], $3::TEXT[]) AS w (device, sensor, boot)
               JOIN grideye.streams s ON s.device = w.device AND s.sensor = w.sensor AND s.boot = w.boot";
    for row in session.query(sql, &[&devices, &sensors, &boots]).await? {
        let id = stream_id(&row)?;
        let key = (id.device.clone(), row.try_get("stream")?);
        keys.insert(id, key);
    }
    Ok(())
}

/// Locks the streams in the order of their keys, and reads their state.
async fn states(
    session: &Session,
    keys: &BTreeMap<StreamId, Key>,
    taken: &[Taken],
    limits: &Limits,
) -> Result<Streams> {
    let ids: HashMap<&Key, &StreamId> = keys.iter().map(|(id, key)| (key, id)).collect();
    let devices: Vec<&str> = keys.values().map(|key| key.0.as_str()).collect();
    let streams: Vec<i32> = keys.values().map(|key| key.1).collect();
    let sql = "SELECT * FROM grideye.streams WHERE (device, stream) IN (SELECT * FROM unnest($1::TEXT[], $2::INT[]))
               ORDER BY device, stream FOR UPDATE";
    let mut states = Streams::new();
    for row in session.query(sql, &[&devices, &streams]).await? {
        states.insert(Arc::new(stream_id(&row)?), state_of(&row)?);
    }
    let reach = reach(taken);
    let span = |id| reach.get(id).copied().unwrap_or((0, 0));
    let lows: Vec<i64> = keys.keys().map(|id| span(id).0).collect();
    let highs: Vec<i64> = keys.keys().map(|id| span(id).1).collect();
    let newest = count(limits.gaps_listed_max.saturating_add(1));
    // The newest runs give the gaps; the runs that the batch touches decide which numbers are new.
    let sql = "SELECT k.device, k.stream, r.first_seq, r.last_seq
               FROM unnest($1::TEXT[], $2::INT[], $3::BIGINT[], $4::BIGINT[]) AS k (device, stream, low, high),
               LATERAL (
                   (SELECT first_seq, last_seq FROM grideye.runs
                    WHERE device = k.device AND stream = k.stream ORDER BY first_seq DESC LIMIT $5)
                   UNION
                   (SELECT first_seq, last_seq FROM grideye.runs
                    WHERE device = k.device AND stream = k.stream AND first_seq <= k.high AND last_seq >= k.low)
               ) r";
    let parameters: Parameters<'_> = &[&devices, &streams, &lows, &highs, &newest];
    for row in session.query(sql, parameters).await? {
        let key: Key = (row.try_get(0)?, row.try_get(1)?);
        if let Some(state) = ids.get(&key).and_then(|id| states.get_mut(*id)) {
            state.restore_run(row.try_get(2)?, row.try_get(3)?)?;
        }
    }
    Ok(states)
}

/// For each stream, the lowest number of the group minus one and the highest plus one.
fn reach(taken: &[Taken]) -> HashMap<StreamId, (i64, i64)> {
    let mut reach: HashMap<StreamId, (i64, i64)> = HashMap::new();
    for taken in taken {
        for (name, part) in taken.parts() {
            for record in &part.frames {
                let seq = i64::try_from(record.seq).unwrap_or(i64::MAX);
                let (low, high) = (seq.saturating_sub(1), seq.saturating_add(1));
                reach
                    .entry(name.to_id())
                    .and_modify(|span| *span = (span.0.min(low), span.1.max(high)))
                    .or_insert((low, high));
            }
        }
    }
    reach
}

/// Reads the stored records under numbers that came again, to compare with the new ones.
async fn contents(session: &Session, states: &Streams, taken: &[Taken]) -> Result<Contents> {
    let (mut devices, mut streams, mut seqs) = (Vec::new(), Vec::new(), Vec::new());
    let mut asked: HashMap<Key, Arc<StreamId>> = HashMap::new();
    for taken in taken {
        for (name, part) in taken.parts() {
            let Some((id, state)) = states.get_key_value(&name) else {
                continue;
            };
            for record in &part.frames {
                if state.is_settled(record.seq) {
                    let key = (id.device.clone(), number(state));
                    devices.push(key.0.clone());
                    streams.push(key.1);
                    asked.insert(key, Arc::clone(id));
                    seqs.push(i64::try_from(record.seq).unwrap_or(i64::MAX));
                }
            }
        }
    }
    let mut contents = Contents::new();
    if seqs.is_empty() {
        return Ok(contents);
    }
    let sql = "SELECT f.device, f.stream, f.seq, f.t_boot_ns, f.t_utc_ns, f.clock, f.missing, f.thermistor, f.pixels
               FROM unnest($1::TEXT[], $2::INT[], $3::BIGINT[]) AS k (device, stream, seq)
               JOIN grideye.frames f ON f.device = k.device AND f.stream = k.stream AND f.seq = k.seq";
    for row in session.query(sql, &[&devices, &streams, &seqs]).await? {
        let key: Key = (row.try_get(0)?, row.try_get(1)?);
        let record = record_of(&row, 2)?;
        if let Some(id) = asked.get(&key) {
            let of_stream = contents.entry(Arc::clone(id)).or_default();
            of_stream.insert(record.seq, record);
        }
    }
    Ok(contents)
}

type Touched<'s> = BTreeMap<&'s StreamId, &'s StreamState>;

async fn save_all(session: &Session, states: &Streams, lane: (i64, i64), epoch: i64) -> Result<()> {
    let touched: Touched<'_> = states
        .iter()
        .filter(|(_, state)| state.is_touched)
        .map(|(id, state)| (&**id, state))
        .collect();
    save_frames(session, &touched, epoch).await?;
    save_runs(session, &touched).await?;
    save_shares(session, &touched, epoch).await?;
    save_streams(session, &touched, lane).await
}

/// Deletes streams that were created for batches that were then rejected.
async fn without_empty(session: &Session, empty: &BTreeSet<&StreamId>) -> Result<()> {
    for id in empty {
        let sql = "DELETE FROM grideye.streams WHERE device = $1 AND sensor = $2 AND boot = $3";
        let name: Parameters<'_> = &[&id.device, &id.sensor, &id.boot];
        session.execute(sql, name).await?;
    }
    Ok(())
}

async fn save_frames(session: &Session, touched: &Touched<'_>, epoch: i64) -> Result<()> {
    let mut frames = FrameColumns::default();
    for (id, state) in touched {
        for (record, t_arrival_ns) in state.fresh.values() {
            let key = (id.device.as_str(), number(state));
            frames.push(key, record, *t_arrival_ns, epoch)?;
        }
    }
    frames.insert(session).await
}

/// Rows of `frames` as columns, for one statement.
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
    missing: Vec<Option<&'static str>>,
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
    ) -> Result<()> {
        let (seq, stamp) = (fitting("seq", record.seq)?, &record.stamp);
        let t_boot_ns = fitting("t_boot_ns", stamp.t_boot_ns)?;
        let (missing, raw) = match &record.reading {
            Reading::Frame(raw) => (None, Some(raw)),
            Reading::NoData(reason) => (Some(reason.name()), None),
        };
        self.devices.push(device);
        self.streams.push(stream);
        self.seqs.push(seq);
        self.t_boots.push(t_boot_ns);
        self.t_utcs.push(stamp.t_utc_ns);
        self.clocks.push(stamp.clock.code().into());
        self.t_arrivals.push(t_arrival_ns);
        self.epochs.push(epoch);
        self.missing.push(missing);
        self.thermistors
            .push(raw.map(|raw| raw.thermistor.map_or(NO_THERMISTOR, |word| word.0.into())));
        let pixels = raw.map(|raw| words_to_bytes(&raw.pixels));
        self.pixels.push(pixels.map(Vec::from));
        Ok(())
    }

    pub(crate) async fn insert(&self, session: &Session) -> Result<()> {
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
            &self.missing,
            &self.thermistors,
            &self.pixels,
        ];
        session.execute(sql, parameters).await?;
        Ok(())
    }
}

/// Runs a statement on rows in JSON with the names of a table's columns, if there are any.
async fn save(session: &Session, sql: &'static str, rows: Vec<Value>) -> Result<()> {
    if rows.is_empty() {
        return Ok(());
    }
    let rows = Value::from(rows).to_string();
    session.execute(sql, &[&rows]).await.map(drop)
}

async fn save_runs(session: &Session, touched: &Touched<'_>) -> Result<()> {
    let (mut gone, mut changed) = (Vec::new(), Vec::new());
    for (id, state) in touched {
        let run = |first: u64, last: u64| json!({ "device": id.device, "stream": state.key, "first_seq": first, "last_seq": last });
        let (gone_runs, changed_runs) = state.runs.changes();
        gone.extend(gone_runs.into_iter().map(|first| run(first, first)));
        changed.extend(
            changed_runs
                .into_iter()
                .map(|(first, last)| run(first, last)),
        );
    }
    let sql = "DELETE FROM grideye.runs r USING json_populate_recordset(NULL::grideye.runs, $1::TEXT::JSON) g
               WHERE r.device = g.device AND r.stream = g.stream AND r.first_seq = g.first_seq";
    save(session, sql, gone).await?;
    let sql = "INSERT INTO grideye.runs SELECT * FROM json_populate_recordset(NULL::grideye.runs, $1::TEXT::JSON)
               ON CONFLICT (device, stream, first_seq) DO UPDATE SET last_seq = excluded.last_seq";
    save(session, sql, changed).await
}

/// Adds what this epoch brought to each stream: one row per stream and epoch.
async fn save_shares(session: &Session, touched: &Touched<'_>, epoch: i64) -> Result<()> {
    let shares = touched.iter().filter_map(|(id, state)| {
        let (first, last, stored, missing) = state.share()?;
        Some(
            json!({ "device": id.device, "stream": state.key, "epoch": epoch, "first_seq": first, "last_seq": last,
                "stored": stored, "missing": missing }),
        )
    });
    let sql = "INSERT INTO grideye.shares AS s
               SELECT * FROM json_populate_recordset(NULL::grideye.shares, $1::TEXT::JSON)
               ON CONFLICT (device, stream, epoch) DO UPDATE SET
                   first_seq = least(s.first_seq, excluded.first_seq), last_seq = greatest(s.last_seq, excluded.last_seq),
                   stored = s.stored + excluded.stored, missing = s.missing + excluded.missing";
    save(session, sql, shares.collect()).await
}

/// `added` orders the streams of one sensor by their last addition, without a counter that all devices share; in the
/// rows it says whether something was added.
async fn save_streams(
    session: &Session,
    touched: &Touched<'_>,
    (lane, n): (i64, i64),
) -> Result<()> {
    let streams = touched.iter().map(|(id, state)| {
        json!({ "device": id.device, "stream": state.key, "stored": state.stored, "missing": state.missing,
            "t_last_arrival_ns": state.t_last_arrival_ns, "account": state.account.as_ref().map(account::to_text),
            "account_read": state.account_read, "came_since_account": state.came_since_account,
            "t_sent_boot_ns": state.t_sent_boot_ns, "added": u8::from(!state.fresh.is_empty()), "lane": lane, "n": n })
    });
    let sql = "UPDATE grideye.streams s SET
                   stored = u.stored, missing = u.missing, t_last_arrival_ns = u.t_last_arrival_ns, account = u.account,
                   account_read = u.account_read, came_since_account = u.came_since_account,
                   t_sent_boot_ns = u.t_sent_boot_ns, lane = u.lane, n = u.n,
                   added = CASE WHEN u.added > 0 THEN
                       (SELECT max(o.added) + 1 FROM grideye.streams o WHERE o.device = s.device AND o.sensor = s.sensor)
                       ELSE s.added END
               FROM json_populate_recordset(NULL::grideye.streams, $1::TEXT::JSON) u
               WHERE s.device = u.device AND s.stream = u.stream";
    save(session, sql, streams.collect()).await
}

fn number(state: &StreamState) -> i32 {
    i32::try_from(state.key).unwrap_or(i32::MAX)
}
