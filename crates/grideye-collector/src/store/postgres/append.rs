//! A group of batches in one transaction: what is known is read under lock, the rest is decided here, and each table
//! is written with one statement.

use crate::limits::Limits;
use crate::store::error::StoreError;
use crate::store::plan::{Contents, Plan, StreamName, Streams, Taken};
use crate::store::postgres::read::{record_of, state_of, stream_id};
use crate::store::postgres::save::{self, number};
use crate::store::postgres::session::{Parameters, Session};
use crate::store::row::count;
use crate::store::types::Appended;
use grideye_recording::StreamId;
use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::sync::Arc;

pub(super) struct Done {
    pub(super) n: i64,
    pub(super) appended: Vec<Result<Appended, StoreError>>,
}

pub(super) enum Undone {
    /// Somebody removed the lane: it has to be made again.
    NoLane,
    Error(StoreError),
}

impl From<StoreError> for Undone {
    fn from(error: StoreError) -> Self {
        Self::Error(error)
    }
}

/// The database's numbers of streams, which never change; as many as the store takes streams.
#[derive(Debug, Default)]
pub(super) struct Known(HashMap<StreamId, i32>);

/// A stream's key: the device, and the stream's number within it.
pub(super) type Key = (String, i32);

/// Keeps a group, or nothing of it.
pub(super) async fn group(
    session: &Session,
    lane: i64,
    taken: &[Taken],
    known: &mut Known,
    limits: &Limits,
) -> Result<Done, Undone> {
    session.batch("BEGIN").await?;
    match transact(session, lane, taken, known, limits).await {
        Ok((done, found)) => {
            session.end(Ok(())).await?;
            if known.0.len() + found.len() > limits.streams_max {
                known.0.clear();
            }
            known.0.extend(found);
            Ok(done)
        }
        Err(undone) => {
            let _ = session.batch("ROLLBACK").await;
            Err(undone)
        }
    }
}

/// Streams that the store's numbers were looked up for.
type Found = Vec<(StreamId, i32)>;

async fn transact(
    session: &Session,
    lane: i64,
    taken: &[Taken],
    known: &Known,
    limits: &Limits,
) -> Result<(Done, Found), Undone> {
    let sql = "UPDATE grideye.lanes SET n = n + 1 WHERE lane = $1 RETURNING n, epoch";
    let rows = session.query(sql, &[&lane]).await?;
    let row = rows.first().ok_or(Undone::NoLane)?;
    let n: i64 = row.try_get(0).map_err(StoreError::from)?;
    let epoch: i64 = row.try_get(1).map_err(StoreError::from)?;

    let names = taken.iter().flat_map(Taken::streams);
    let wanted: BTreeSet<StreamId> = names.map(StreamName::to_id).collect();
    let (keys, made) = keys(session, &wanted, known, limits).await?;
    let mut states = states(session, &keys, taken, limits).await?;
    let contents = contents(session, &states, taken).await?;
    let mut plan = Plan {
        streams: &mut states,
        contents: &contents,
        limits,
    };
    let appended = taken.iter().map(|taken| plan.take(taken)).collect();
    save::all(session, &states, (lane, n), epoch).await?;
    // Those that were made for batches which were then refused.
    let is_empty = |id: &&StreamId| states.get(*id).is_none_or(|state| !state.is_touched);
    let empty: BTreeSet<&StreamId> = made.iter().filter(is_empty).collect();
    save::without_empty(session, &empty).await?;
    let found = keys
        .into_iter()
        .filter(|(id, _)| !empty.contains(id))
        .map(|(id, key)| (id, key.1))
        .collect();
    Ok((Done { n, appended }, found))
}

/// The keys of streams; those that are new are made, as long as there is room, and named.
async fn keys(
    session: &Session,
    wanted: &BTreeSet<StreamId>,
    known: &Known,
    limits: &Limits,
) -> Result<(BTreeMap<StreamId, Key>, BTreeSet<StreamId>), StoreError> {
    let mut keys: BTreeMap<StreamId, Key> = BTreeMap::new();
    for id in wanted {
        if let Some(stream) = known.0.get(id) {
            keys.insert(id.clone(), (id.device.clone(), *stream));
        }
    }
    look_up(session, wanted, &mut keys).await?;
    let mut made = BTreeSet::new();
    if keys.len() == wanted.len() {
        return Ok((keys, made));
    }
    let rows = session
        .query("SELECT count(*) FROM grideye.streams", &[])
        .await?;
    let mut streams: i64 = rows[0].try_get(0)?;
    // In order, so that two collectors that make the same streams never wait for each other in a circle.
    let missing: Vec<&StreamId> = wanted.iter().filter(|id| !keys.contains_key(id)).collect();
    for id in missing {
        if streams >= count(limits.streams_max) {
            break;
        }
        // Another collector may make the same stream, or take the same number, at this moment: then nothing is done.
        let sql = "INSERT INTO grideye.streams (device, stream, sensor, boot, stored, missing, added, t_last_arrival_ns,
                                                came_since_account, lane, n)
                   SELECT $1, coalesce(max(stream), 0) + 1, $2, $3, 0, 0, 0, 0, 0, 0, 0
                   FROM grideye.streams WHERE device = $1
                   ON CONFLICT DO NOTHING";
        let added = session
            .execute(sql, &[&id.device, &id.sensor, &id.boot])
            .await?;
        if added == 1 {
            made.insert(id.clone());
            streams += 1;
        }
    }
    look_up(session, wanted, &mut keys).await?;
    let there = keys.len();
    if there < wanted.len() && streams < count(limits.streams_max) {
        // The number was taken by another stream of the device: from the beginning.
        let message = "a stream was made at the same moment by another collector".to_owned();
        return Err(StoreError::Contended(message));
    }
    Ok((keys, made))
}

async fn look_up(
    session: &Session,
    wanted: &BTreeSet<StreamId>,
    keys: &mut BTreeMap<StreamId, Key>,
) -> Result<(), StoreError> {
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

/// Locks the streams, ordered by key, and reads what is known of them.
async fn states(
    session: &Session,
    keys: &BTreeMap<StreamId, Key>,
    taken: &[Taken],
    limits: &Limits,
) -> Result<Streams, StoreError> {
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
    // The newest runs tell the gaps; those that the batch touches tell what is new.
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

/// For each stream, one less than the lowest number of the group and one more than the highest.
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

/// What the store holds under the numbers that came before, to be held against what comes again.
async fn contents(
    session: &Session,
    states: &Streams,
    taken: &[Taken],
) -> Result<Contents, StoreError> {
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
