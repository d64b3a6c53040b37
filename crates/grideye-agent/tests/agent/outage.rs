//! Days without a collector (hours unless `GRIDEYE_ALL_SEEDS` is set) and catching up, in virtual time: ring, spooler,
//! spool and scheduler as in the agent.

use crate::model_disk::{Failure, ModelDisk};
use crate::spool::record;
use grideye_agent::config::SpoolMode;
use grideye_agent::deliver::Spooler;
use grideye_agent::deliver::{
    BACKLOG_RECORDS_MAX, BATCH_RECORDS_MAX, Pace, Post, Posted, Scheduler,
};
use grideye_agent::log::Log;
use grideye_agent::queue::Ring;
use grideye_agent::queue::Shared;
use grideye_agent::spool::{Disk as _, Limits, SPOOL_DAMAGED, SPOOL_FULL, Spool};
use grideye_recording::wire::{Acknowledgement, Batch, Gap};
use proptest::prelude::*;
use std::collections::BTreeMap;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex};
use std::time::Duration;

const SENSOR: &str = "i2c-1:0x69";
const MS: u64 = 1_000_000;
const S: u64 = 1000 * MS;

/// Virtual time.
#[derive(Debug, Clone, Default)]
struct Time(Arc<AtomicU64>);

impl Time {
    fn ns(&self) -> u64 {
        self.0.load(Ordering::SeqCst)
    }

    fn now(&self) -> Duration {
        Duration::from_nanos(self.ns())
    }
}

/// A collector that goes away, returns, and sometimes loses an answer; it counts like the real one.
#[derive(Debug)]
struct Books {
    is_away: bool,
    loses_every: Option<u64>,
    /// New records with these numbers are rejected.
    rejects: fn(u64) -> bool,
    posts: u64,
    attempts: u64,
    /// How often each number arrived.
    came: Vec<u8>,
    /// The numbers that arrived, as ranges.
    runs: BTreeMap<u64, u64>,
    stored: u64,
    twice: u64,
    unbalanced: u64,
    batches: BTreeMap<usize, u64>,
    newest_ns: u64,
}

#[derive(Debug, Clone)]
struct Collector {
    books: Arc<Mutex<Books>>,
    time: Time,
}

impl Post for Collector {
    fn post(&mut self, batch: &Batch, _: Duration) -> Posted {
        let mut books = self.books.lock().unwrap();
        books.attempts += 1;
        // A post takes time.
        self.time.0.fetch_add(20 * MS, Ordering::SeqCst);
        if books.is_away {
            return Posted::Later {
                why: "nobody there".to_owned(),
                retry_after: None,
                is_unstored: true,
            };
        }
        let mut frames = batch.sensors.iter().flat_map(|part| &part.frames);
        let is_new = |seq: u64| {
            let came = books.came.get(usize::try_from(seq).unwrap());
            came.is_none_or(|came| *came == 0)
        };
        if frames.any(|frame| (books.rejects)(frame.seq) && is_new(frame.seq)) {
            return Posted::Refused(422, "no".to_owned());
        }
        books.posts += 1;
        let answer = books.keep(batch, self.time.ns());
        if books
            .loses_every
            .is_some_and(|every| books.posts % every == 0)
        {
            return Posted::Later {
                why: "the answer was lost".to_owned(),
                retry_after: None,
                is_unstored: false,
            };
        }
        Posted::Durable(answer)
    }
}

impl Default for Books {
    fn default() -> Self {
        Self {
            is_away: false,
            loses_every: None,
            rejects: |_| false,
            posts: 0,
            attempts: 0,
            came: Vec::new(),
            runs: BTreeMap::new(),
            stored: 0,
            twice: 0,
            unbalanced: 0,
            batches: BTreeMap::new(),
            newest_ns: 0,
        }
    }
}

impl Books {
    fn keep(&mut self, batch: &Batch, now_ns: u64) -> Acknowledgement {
        let part = &batch.sensors[0];
        *self.batches.entry(part.frames.len()).or_default() += 1;
        let mut came = 0;
        for frame in &part.frames {
            assert_eq!(*frame, record(frame.seq), "bytes as read");
            let is_frame = u64::from(frame.reading.frame().is_some());
            came += is_frame;
            let at = usize::try_from(frame.seq).unwrap();
            if self.came.len() <= at {
                self.came.resize(at + 1, 0);
            }
            self.twice += u64::from(self.came[at] > 0);
            self.stored += if self.came[at] == 0 { is_frame } else { 0 };
            if self.came[at] == 0 {
                self.join(frame.seq);
            }
            self.came[at] = self.came[at].saturating_add(1);
            self.newest_ns = self.newest_ns.max(frame.stamp.t_boot_ns);
        }
        assert!(part.frames.windows(2).all(|pair| pair[0].seq < pair[1].seq));
        let account = part.account.as_ref().unwrap();
        let dropped: u64 = account.dropped.values().sum();
        self.unbalanced +=
            u64::from(account.read != self.stored + dropped + account.spooled - came);
        assert!(now_ns >= self.newest_ns);
        self.answer()
    }

    fn join(&mut self, seq: u64) {
        let end = self.runs.remove(&(seq + 1)).unwrap_or(seq);
        match self.runs.range_mut(..seq).next_back() {
            Some((_, before)) if *before + 1 == seq => *before = end,
            _ => {
                self.runs.insert(seq, end);
            }
        }
    }

    fn answer(&self) -> Acknowledgement {
        let Some(last) = self.came.len().checked_sub(1) else {
            return Acknowledgement::default();
        };
        // Lists only the newest gaps, like the real one.
        let starts = self.runs.keys().rev();
        let ends = self
            .runs
            .values()
            .rev()
            .skip(1)
            .map(|end| end + 1)
            .chain([0]);
        let gap = |(start, from): (&u64, u64)| Gap {
            sensor: SENSOR.to_owned(),
            from,
            to: start.saturating_sub(1),
        };
        let gaps = starts
            .zip(ends)
            .filter(|(start, from)| from < *start)
            .take(64);
        Acknowledgement {
            durable_through: [(SENSOR.to_owned(), u64::try_from(last).unwrap())].into(),
            gaps: gaps.map(gap).collect(),
        }
    }
}

/// An agent in virtual time.
struct Agent {
    time: Time,
    shared: Arc<Shared>,
    spooler: Spooler,
    scheduler: Scheduler<Collector>,
    books: Arc<Mutex<Books>>,
    scheduler_at: u64,
    next: u64,
    disk: ModelDisk,
}

impl Agent {
    fn new(mode: SpoolMode, limits: Limits, seed: u64) -> Self {
        Self::with_memory(10_000, mode, limits, seed)
    }

    fn with_memory(records: usize, mode: SpoolMode, limits: Limits, seed: u64) -> Self {
        let time = Time::default();
        let sensors = vec![SENSOR.to_owned()];
        let ring = Ring::new(records, "pi", "b1", sensors.clone());
        let disk = ModelDisk::default();
        let spool = Spool::open(Box::new(disk.clone()), limits, "pi", "b1", &sensors).unwrap();
        let shared = Arc::new(Shared::new(ring, Some(spool)));
        let books: Arc<Mutex<Books>> = Arc::default();
        let collector = Collector {
            books: Arc::clone(&books),
            time: time.clone(),
        };
        let pace = Pace {
            collector: "http://test".to_owned(),
            boot: "b1".to_owned(),
            post_every: Duration::from_millis(500),
            request_timeout: Duration::from_secs(10),
            backlog_per_s: 1000,
            seed,
        };
        let timed = time.clone();
        let now = Box::new(move || (timed.now(), timed.ns()));
        Self {
            spooler: Spooler::new(Arc::clone(&shared), mode, Log::silent()),
            scheduler: Scheduler::new(collector, pace, Arc::clone(&shared), now, Log::silent()),
            time,
            shared,
            books,
            scheduler_at: 0,
            next: 0,
            disk,
        }
    }

    /// Reads a frame every 100 ms, runs the spooler every 500 ms, and the scheduler when due.
    fn run(&mut self, seconds: u64) {
        let until = self.next + 10 * seconds;
        while self.next < until {
            let at = self.next * 100 * MS;
            while self.scheduler_at <= at {
                self.time.0.fetch_max(self.scheduler_at, Ordering::SeqCst);
                let pause = self.scheduler.step();
                self.scheduler_at = self.time.ns() + u64::try_from(pause.as_nanos()).unwrap();
            }
            self.time.0.fetch_max(at, Ordering::SeqCst);
            let now = self.time.now();
            let next = self.next;
            self.shared
                .with_ring(|ring| ring.push(0, record(next), now));
            if self.next % 5 == 0 {
                self.spooler.step(now);
            }
            self.next += 1;
        }
    }

    fn waiting(&self) -> usize {
        let on_disk = self.shared.spool().as_ref().unwrap().waiting_frames().0;
        self.shared.with_ring(|ring| ring.len()) + usize::try_from(on_disk).unwrap()
    }

    fn with_books<T>(&self, work: impl FnOnce(&mut Books) -> T) -> T {
        work(&mut self.books.lock().unwrap())
    }
}

fn frames(through: u64) -> u64 {
    through - through / 10 - u64::from(through % 10 > 7)
}

#[test]
fn days_without_a_collector_arrive_once_in_order_while_the_live_frames_go_first() {
    let mode = SpoolMode::Outage {
        after: Duration::from_secs(10),
    };
    let mut agent = Agent::new(mode, Limits::new(1 << 30, 0), 1);
    agent.run(60);
    assert!(
        agent.shared.spool().as_ref().unwrap().bytes() == 0,
        "no outage, nothing on the disk"
    );
    agent.with_books(|books| books.is_away = true);
    let is_long = std::env::var_os("GRIDEYE_ALL_SEEDS").is_some();
    let hours = if is_long { 3 * 24 } else { 6 };
    agent.run(hours * 3600);
    let bytes = agent.shared.spool().as_ref().unwrap().bytes();
    assert!(
        agent.shared.with_ring(|ring| ring.len()) <= 120,
        "the rest is on the disk"
    );
    let attempts = agent.with_books(|books| {
        books.is_away = false;
        books.loses_every = Some(97);
        books.attempts
    });
    let mut longest_lag_s = 0;
    let mut seconds = 0;
    while agent.waiting() > 20 {
        agent.run(10);
        seconds += 10;
        assert!(seconds < 4 * 3600, "{} wait", agent.waiting());
        // The first minute is the pause chosen before.
        if seconds > 60 {
            let newest_ns = agent.with_books(|books| books.newest_ns);
            longest_lag_s = longest_lag_s.max((agent.time.ns() - newest_ns) / S);
        }
    }
    agent.with_books(|books| books.loses_every = None);
    agent.run(5);
    let read = agent.next;
    agent.with_books(|books| {
        println!(
            "{hours} hours away: {read} rows read, {bytes} bytes on the disk, {attempts} attempts; caught up in {seconds} s of the agent's time; \
             newest live frame at most {longest_lag_s} s old meanwhile; {} posts, {} rows came a second time and changed nothing; unbalanced after a batch: {}",
            books.posts, books.twice, books.unbalanced
        );
        let lost = books.came.iter().filter(|came| **came == 0).count();
        assert_eq!(lost, 0);
        assert!(read - u64::try_from(books.came.len()).unwrap() < 20, "the newest arrived too");
        assert_eq!(books.unbalanced, 0);
        assert!(books.batches.keys().all(|records| *records <= BACKLOG_RECORDS_MAX));
        assert!(books.batches[&BACKLOG_RECORDS_MAX] > 20 * hours, "larger batches");
        assert!(books.batches.keys().any(|records| *records <= BATCH_RECORDS_MAX));
        assert!(books.twice <= 2 * books.posts / 97 * u64::try_from(BACKLOG_RECORDS_MAX).unwrap());
    });
    assert!(
        longest_lag_s <= 70,
        "a lost answer costs one pause, not the backlog"
    );
    // At most 1000 per second while 10 more arrive, and no faster.
    assert!(seconds >= hours * 3600 / 100, "{seconds}");
    let left = agent.shared.spool().as_ref().unwrap().bytes();
    assert_eq!(left, 0, "nothing is left on the disk");
}

#[test]
fn frames_on_a_disk_that_cannot_be_read_are_counted_while_the_collector_is_away_and_when_the_agent_ends()
 {
    let mode = SpoolMode::Outage {
        after: Duration::from_secs(10),
    };
    for is_running in [true, false] {
        let mut agent = Agent::new(mode, Limits::new(1 << 30, 0), 1);
        agent.with_books(|books| books.is_away = true);
        agent.run(60);
        let waited = agent.shared.spool().as_ref().unwrap().waiting_frames().0;
        assert!(waited > 300, "{waited}");
        agent.disk.fail(Some(Failure::Io));
        // Shorter than a disk may be away for.
        agent.run(if is_running { 40 } else { 5 });
        agent.disk.fail(None);
        if !is_running {
            let account = agent
                .shared
                .with_ring(|ring| ring.accounts())
                .remove(SENSOR)
                .unwrap();
            assert_eq!(account.dropped, BTreeMap::new());
            agent.disk.remove("segment-0000000000000001").unwrap();
            agent.spooler.finish(agent.time.now());
        }
        let account = agent
            .shared
            .with_ring(|ring| ring.accounts())
            .remove(SENSOR)
            .unwrap();
        assert!(account.dropped[SPOOL_DAMAGED] >= waited, "{account:?}");
        assert_eq!(
            account.read,
            account.spooled + account.dropped[SPOOL_DAMAGED]
        );
    }
}

#[test]
fn an_outage_that_is_longer_than_the_disk_costs_the_oldest_and_every_one_is_counted() {
    let mode = SpoolMode::Outage {
        after: Duration::from_secs(10),
    };
    let mut agent = Agent::new(mode, Limits::new(1 << 20, 0), 2);
    agent.with_books(|books| books.is_away = true);
    agent.run(3600);
    agent.with_books(|books| books.is_away = false);
    agent.run(600);
    let account = agent
        .shared
        .with_ring(|ring| ring.accounts()[SENSOR].clone());
    agent.with_books(|books| {
        let lost = books.came.iter().filter(|came| **came == 0).count();
        let first = books.came.iter().position(|came| *came > 0).unwrap();
        assert_eq!(lost, first, "the oldest, and no other");
        assert!(lost > 20_000);
        assert_eq!(
            account.dropped[SPOOL_FULL],
            frames(u64::try_from(first).unwrap())
        );
        assert_eq!(books.unbalanced, 0);
    });
}

#[test]
fn in_mode_always_everything_is_on_the_disk_within_a_sync_and_goes_from_there_when_it_is_delivered()
{
    let sync_every = Duration::from_secs(1);
    let mut agent = Agent::new(SpoolMode::Always { sync_every }, Limits::new(1 << 30, 0), 3);
    agent.run(1800);
    let bytes = agent.shared.spool().as_ref().unwrap().bytes();
    assert!(
        bytes > 0 && bytes < 2 << 20,
        "{bytes}: the segment that is written, and no more"
    );
    let now = agent.time.now();
    let unwritten = agent
        .shared
        .with_ring(|ring| ring.claim(now, Duration::ZERO, 1000).len());
    assert!(unwritten <= 16, "{unwritten}");
    agent.with_books(|books| books.is_away = true);
    agent.run(600);
    agent.with_books(|books| books.is_away = false);
    agent.run(120);
    agent.with_books(|books| {
        assert_eq!(books.came.iter().filter(|came| **came != 1).count(), 0);
        assert_eq!(books.unbalanced, 0);
    });
}

#[test]
fn an_account_in_doubt_when_the_agent_stops_is_not_the_last_one() {
    let after = Duration::from_secs(10);
    let mut agent = Agent::new(SpoolMode::Outage { after }, Limits::new(1 << 30, 0), 4);
    agent.with_books(|books| books.loses_every = Some(1));
    agent.scheduler.step();
    agent.with_books(|books| books.loses_every = None);
    agent.time.0.fetch_max(S, Ordering::SeqCst);
    let now = agent.time.now();
    for seq in 0..3 {
        agent
            .shared
            .with_ring(|ring| ring.push(0, record(seq), now));
    }
    let left = Duration::from_secs(9);
    let rounds = (0..9).take_while(|_| !agent.scheduler.flush(left)).count();
    assert_eq!(
        rounds, 2,
        "the account in doubt, the frames, and the last account"
    );
    agent.with_books(|books| assert_eq!(books.came, [1, 1, 1]));
}

#[derive(Debug, Clone)]
enum Action {
    /// This many seconds pass.
    Run(u64),
    Away(bool),
    LoseEvery(Option<u64>),
    Reject(bool),
    Fail(Option<Failure>),
}

fn action() -> impl Strategy<Value = Action> {
    let failures = [Failure::Full, Failure::Sync, Failure::Io].map(Some);
    let failures = [&[None, None, None], &failures[..]].concat();
    prop_oneof![
        8 => (1..40_u64).prop_map(Action::Run),
        3 => any::<bool>().prop_map(Action::Away),
        2 => prop::option::of(1..6_u64).prop_map(Action::LoseEvery),
        1 => any::<bool>().prop_map(Action::Reject),
        2 => prop::sample::select(failures).prop_map(Action::Fail),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 300, ..ProptestConfig::default() })]
    /// Memory for 15 s and a disk for 30 s, so that both run full.
    #[test]
    fn every_frame_comes_or_is_counted_whatever_fails_and_the_count_is_right_with_every_post(
        is_always: bool,
        bytes_max in prop::sample::select(vec![50_000_u64, 1 << 20]),
        seed: u64,
        actions in prop::collection::vec(action(), 1..30),
    ) {
        let second = Duration::from_secs(1);
        let mode = match is_always {
            true => SpoolMode::Always { sync_every: second },
            false => SpoolMode::Outage { after: second },
        };
        let mut agent = Agent::with_memory(150, mode, Limits::new(bytes_max, 0), seed);
        let mut loses_any = false;
        for action in actions {
            match action {
                Action::Run(seconds) => agent.run(seconds),
                Action::Away(is_away) => agent.with_books(|books| books.is_away = is_away),
                Action::LoseEvery(every) => {
                    loses_any |= every.is_some();
                    agent.with_books(|books| books.loses_every = every);
                }
                Action::Reject(is_on) => agent.with_books(|books| {
                    books.rejects = if is_on { |seq| seq % 50 == 11 } else { |_| false };
                }),
                Action::Fail(failure) => agent.disk.fail(failure),
            }
        }
        agent.disk.fail(None);
        agent.with_books(|books| (books.is_away, books.loses_every) = (false, None));
        // The longest pause after a failure, and the backlog.
        agent.run(90);
        let account = agent.shared.with_ring(|ring| ring.accounts()[SENSOR].clone());
        let dropped: u64 = account.dropped.values().sum();
        agent.with_books(|books| {
            prop_assert_eq!(books.unbalanced, 0);
            prop_assert!(loses_any || books.twice == 0, "{} came twice", books.twice);
            prop_assert!(account.spooled <= 20, "{account:?}");
            prop_assert_eq!(account.read, books.stored + dropped + account.spooled);
            Ok(())
        })?;
    }
}

/// An older store in the collector's place: what the disk still has comes again, the rest counts as lost, nothing twice.
#[test]
fn a_collector_that_went_back_gets_what_the_disk_has_and_the_rest_is_counted() {
    let always = SpoolMode::Always {
        sync_every: Duration::from_secs(1),
    };
    let outage = SpoolMode::Outage {
        after: Duration::from_secs(10),
    };
    for (mode, is_on_disk) in [(always, true), (outage, false)] {
        let mut agent = Agent::new(mode, Limits::new(1 << 30, 0), 3);
        agent.run(100);
        let older = {
            let books = agent.books.lock().unwrap();
            (books.came.clone(), books.runs.clone(), books.stored)
        };
        agent.run(100);
        let mut lost_before = 0;
        for _ in 0..2 {
            let mut books = agent.books.lock().unwrap();
            let before = books.stored;
            (books.came, books.runs, books.stored) = older.clone();
            drop(books);
            agent.run(30);
            let accounts = agent.shared.with_ring(|ring| ring.accounts());
            let account = &accounts[SENSOR];
            let lost = account.dropped.get("lost-by-collector").copied();
            let lost = lost.unwrap_or(0);
            let stored = agent.books.lock().unwrap().stored;
            let sum = stored + lost + account.spooled;
            assert_eq!(account.read, sum, "{account:?}");
            // In mode `always`, what was delivered before the next sync is not on the disk.
            let (gone, all) = (lost - lost_before, before - older.2);
            assert!(
                if is_on_disk { gone < all } else { gone == all },
                "{gone} of {all}"
            );
            lost_before = lost;
        }
        let books = agent.books.lock().unwrap();
        assert_eq!((books.twice, books.unbalanced), (0, 2));
    }
}
