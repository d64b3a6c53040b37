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
use std::future::poll_fn;
use std::sync::Arc;
use std::time::Duration;
use tokio::sync::{Notify, mpsc, watch};
use tokio::task::{JoinHandle, JoinSet};
use tokio_postgres::{AsyncMessage, NoTls};

/// Minimum time between two polls and between two notices: one notice covers many commits.
const PAUSE: Duration = Duration::from_millis(50);

/// Starts to follow from the database's current state. Ends with the task, or when nobody listens.
pub(super) async fn start(
    url: &PostgresUrl,
    limits: &Limits,
    writer: &Writer,
    news: mpsc::Sender<News>,
) -> Result<JoinHandle<()>> {
    let session = Session::open(url, limits).await?;
    let mut follower = Follower {
        url: url.clone(),
        limits: limits.clone(),
        session,
        seen: Seen::default(),
        shown: HashMap::new(),
        committed: writer.committed(),
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
    url: PostgresUrl,
    limits: Limits,
    session: Session,
    seen: Seen,
    /// The highest number passed on, by device and stream; at most `streams_listed_max`.
    shown: HashMap<(String, i32), i64>,
    committed: watch::Receiver<(i64, i64)>,
    news: mpsc::Sender<News>,
}

impl Follower {
    async fn run(mut self) {
        let worth_asking = Arc::new(Notify::new());
        // Both tasks end with this one.
        let mut beside = JoinSet::new();
        beside.spawn(listen(
            self.url.clone(),
            self.limits.follow_every,
            Arc::clone(&worth_asking),
        ));
        beside.spawn(tell(
            self.url.clone(),
            self.limits.clone(),
            self.committed.clone(),
        ));
        while !self.news.is_closed() {
            // A notice may be lost; then the timeout polls.
            let _ = tokio::time::timeout(self.limits.follow_every, worth_asking.notified()).await;
            if self.session.revive().await.is_err() {
                continue;
            }
            // A failed poll is repeated next time from the same place.
            let _ = self.pass_on().await;
            tokio::time::sleep(PAUSE).await;
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
        let own = self.committed.borrow().0;
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

/// Listens for notices, and reconnects if the connection breaks.
async fn listen(url: PostgresUrl, again_after: Duration, worth_asking: Arc<Notify>) {
    loop {
        // Whatever ended it, the follower polls meanwhile.
        let _ = hear(&url, &worth_asking).await;
        tokio::time::sleep(again_after).await;
    }
}

async fn hear(url: &PostgresUrl, worth_asking: &Notify) -> Result<(), tokio_postgres::Error> {
    let (client, mut connection) = url.config.connect(NoTls).await?;
    let hearing = async {
        while let Some(message) = poll_fn(|context| connection.poll_message(context)).await {
            if matches!(message, Ok(AsyncMessage::Notification(_)) | Err(_)) {
                worth_asking.notify_one();
            }
            message?;
        }
        Ok(())
    };
    let listening = async {
        client.batch_execute("LISTEN grideye").await?;
        // Keeps the client alive, and with it the connection.
        std::future::pending::<Result<(), tokio_postgres::Error>>().await
    };
    tokio::select! {
        heard = hearing => heard,
        failed = listening => failed,
    }
}

/// Notifies the other collectors that something was committed here, once for many commits.
async fn tell(url: PostgresUrl, limits: Limits, mut committed: watch::Receiver<(i64, i64)>) {
    let mut session: Option<Session> = None;
    while committed.changed().await.is_ok() {
        let open = match session.take().filter(|session| !session.is_closed()) {
            Some(open) => Ok(open),
            None => Session::open(&url, &limits).await,
        };
        // Without a notice the others poll after `follow_every`.
        if let Ok(open) = open {
            // A notice need not survive a power cut, so don't wait for the disk.
            let told = open
                .batch("SET synchronous_commit = off; NOTIFY grideye")
                .await;
            session = told.is_ok().then_some(open);
        }
        tokio::time::sleep(PAUSE).await;
    }
}
