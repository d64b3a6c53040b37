//! Watches the frames that other collectors store, for this collector's live page.

use crate::limits::Limits;
use crate::store::error::Result;
use crate::store::location::PostgresUrl;
use crate::store::postgres::read::{self, record_of};
use crate::store::postgres::session::{Parameters, Session};
use crate::store::postgres::writer::Writer;
use crate::store::row::{count, unsigned};
use crate::store::types::{Elsewhere, News, StoredRecord};
use std::collections::{BTreeMap, HashMap};
use std::sync::Arc;
use std::sync::atomic::{AtomicI64, Ordering};
use tokio::sync::mpsc;
use tokio::task::JoinHandle;

/// Starts to follow from the database's current state. Ends with the task, or when nobody listens.
pub(super) async fn start(
    url: &PostgresUrl,
    limits: &Limits,
    writer: &Writer,
    news: mpsc::Sender<News>,
) -> Result<JoinHandle<()>> {
    let session = Session::open(url, limits).await?;
    let mut follower = Follower {
        limits: limits.clone(),
        session,
        seen: Seen::default(),
        shown: HashMap::new(),
        own_lane: writer.lane(),
        news,
    };
    // The store's own queries already show what exists now.
    follower.seen = follower.look().await?;
    Ok(tokio::spawn(follower.run()))
}

/// The counts of the lanes at the last poll.
#[derive(Debug, Default, Clone, PartialEq, Eq)]
struct Seen {
    epoch: i64,
    counts: BTreeMap<i64, i64>,
}

struct Follower {
    limits: Limits,
    session: Session,
    seen: Seen,
    /// The highest number passed on, by device and stream; at most `streams_listed_max`.
    shown: HashMap<(String, i32), i64>,
    own_lane: Arc<AtomicI64>,
    news: mpsc::Sender<News>,
}

impl Follower {
    async fn run(mut self) {
        while !self.news.is_closed() {
            tokio::time::sleep(self.limits.follow_every).await;
            // A failed poll is repeated next time from the same place.
            if self.session.revive().await.is_ok() {
                let _ = self.pass_on().await;
            }
        }
    }

    /// The lanes now. A lane's count covers everything committed in it before.
    async fn look(&self) -> Result<Seen> {
        let sql = "SELECT 0 AS lane, epoch FROM grideye.layout UNION ALL SELECT lane, n FROM grideye.lanes";
        let mut seen = Seen::default();
        for row in self.session.query(sql, &[]).await? {
            let (lane, n): (i64, i64) = (row.try_get(0)?, row.try_get(1)?);
            if lane == 0 {
                seen.epoch = n;
            } else {
                seen.counts.insert(lane, n);
            }
        }
        Ok(seen)
    }

    async fn pass_on(&mut self) -> Result<()> {
        let now = self.look().await?;
        let own = self.own_lane.load(Ordering::Relaxed);
        let (mut lanes, mut counts) = (Vec::new(), Vec::new());
        for (lane, n) in &now.counts {
            let before = self.seen.counts.get(lane).copied().unwrap_or(0);
            if *lane != own && *n > before {
                lanes.push(*lane);
                counts.push(before);
            }
        }
        if !lanes.is_empty() {
            let newest = count(self.limits.gaps_listed_max.saturating_add(1));
            let sql = "SELECT s.*, r.firsts, r.lasts
                       FROM unnest($1::BIGINT[], $2::BIGINT[]) AS k (lane, n)
                       JOIN grideye.streams s ON s.lane = k.lane AND s.n > k.n, LATERAL (
                           SELECT array_agg(first_seq) AS firsts, array_agg(last_seq) AS lasts FROM (
                               SELECT first_seq, last_seq FROM grideye.runs
                               WHERE device = s.device AND stream = s.stream ORDER BY first_seq DESC LIMIT $3) newest
                       ) r";
            let rows = self.session.query(sql, &[&lanes, &counts, &newest]).await?;
            self.pass_on_streams(&rows).await?;
        }
        if now.epoch != self.seen.epoch {
            self.send(News::Recordings);
        }
        self.seen = now;
        Ok(())
    }

    async fn pass_on_streams(&mut self, rows: &[tokio_postgres::Row]) -> Result<()> {
        if self.shown.len() > self.limits.streams_listed_max {
            self.shown.clear();
        }
        let (mut changed, mut devices) = (Vec::new(), Vec::new());
        let (mut streams, mut afters) = (Vec::new(), Vec::new());
        for row in rows {
            let stream = read::summary(row, &self.limits)?;
            let key = (stream.id.device.clone(), row.try_get::<_, i32>("stream")?);
            let sent: Option<i64> = row.try_get("t_sent_boot_ns")?;
            devices.push(key.0.clone());
            streams.push(key.1);
            afters.push(self.shown.get(&key).copied().unwrap_or(-1));
            let sent = sent
                .map(|sent| unsigned("t_sent_boot_ns", sent))
                .transpose()?;
            changed.push((key, stream, sent));
        }
        let most = count(self.limits.live_frames_max.max(1));
        let sql = "SELECT k.device, k.stream, f.seq, f.t_boot_ns, f.t_utc_ns, f.clock, f.missing, f.thermistor, f.pixels,
                          f.t_arrival_ns
                   FROM unnest($1::TEXT[], $2::INT[], $3::BIGINT[]) AS k (device, stream, after_seq), LATERAL (
                       SELECT * FROM grideye.frames WHERE device = k.device AND stream = k.stream AND seq > k.after_seq
                       ORDER BY seq DESC LIMIT $4
                   ) f ORDER BY f.seq";
        let parameters: Parameters<'_> = &[&devices, &streams, &afters, &most];
        let mut records: HashMap<(String, i32), Vec<tokio_postgres::Row>> = HashMap::new();
        for row in self.session.query(sql, parameters).await? {
            let key = (row.try_get(0)?, row.try_get(1)?);
            records.entry(key).or_default().push(row);
        }
        for (key, stream, t_sent_boot_ns) in changed {
            let id = Arc::clone(&stream.id);
            let rows = records.remove(&key).unwrap_or_default();
            let stored: Result<Vec<_>> = rows
                .iter()
                .map(|row| {
                    Ok(StoredRecord {
                        stream: Arc::clone(&id),
                        record: record_of(row, 2)?,
                        t_arrival_ns: row.try_get(9)?,
                    })
                })
                .collect();
            let records = stored?;
            if let Some(last) = records.last() {
                let last = i64::try_from(last.record.seq).unwrap_or(i64::MAX);
                self.shown.insert(key, last);
            }
            self.send(News::Frames(Box::new(Elsewhere {
                stream,
                t_sent_boot_ns,
                records,
            })));
        }
        Ok(())
    }

    /// A page that falls behind misses frames, which the store has; the next ones bring it up to date.
    fn send(&self, news: News) {
        let _ = self.news.try_send(news);
    }
}
