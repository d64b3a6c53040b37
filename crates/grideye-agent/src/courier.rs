//! The courier: which records go to the collector when, and what becomes of them by its answers. It opens no socket and
//! reads no clock but those that it is handed.
//!
//! ```text
//!   live     in memory, younger than 10 s          every post_every, whatever else waits
//!   backlog  in memory, older; then on the disk    while live posts are accepted, in larger batches, at a capped rate
//! ```
//!
//! A post that got no clear answer may have arrived. Until it has an answer nothing else is sent: so the collector's count
//! and the agent's agree after every batch that arrives.

use crate::log::Log;
use crate::parcel::{Item, Lane, Parcel, is_durable};
use crate::shared::Shared;
use crate::spool::SPOOL_FULL;
use grideye_recording::wire::{Acknowledgement, Batch};
use std::collections::VecDeque;
use std::sync::Arc;
use std::time::Duration;

/// Records in one live post at most, those of all sensors together: about 50 kB.
pub const BATCH_RECORDS_MAX: usize = 200;
/// Records in one post of the backlog at most: about 240 kB.
pub const BACKLOG_RECORDS_MAX: usize = 1000;
/// How often the account is posted when there is nothing else to say.
pub const HEARTBEAT_EVERY: Duration = Duration::from_secs(5);
/// The shortest pause after a failure.
pub const BACK_OFF_MIN: Duration = Duration::from_millis(500);
/// The longest pause after a failure of its own choice.
pub const BACK_OFF_MAX: Duration = Duration::from_secs(60);
/// The longest pause that a collector may ask for with `Retry-After`.
pub const RETRY_AFTER_MAX: Duration = Duration::from_secs(300);
/// How often the disk is asked for a backlog when there was none.
const LOOK_EVERY: Duration = Duration::from_millis(500);

/// Who brings a batch to the collector.
pub trait Post {
    /// Posts a batch, within this time.
    fn post(&mut self, batch: &Batch, timeout: Duration) -> Posted;
}

/// What became of one post.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Posted {
    /// The collector has it on disk.
    Durable(Acknowledgement),
    /// The collector will never take this body.
    Refused {
        /// The answer's status: 400, 409, 413 or 422.
        status: u16,
        /// The beginning of what it said.
        said: String,
    },
    /// Anything else: try again later.
    Later {
        /// What happened, and what to do about it.
        why: String,
        /// The pause that the collector asked for.
        retry_after: Option<Duration>,
        /// Whether it is certain that nothing was stored.
        is_unstored: bool,
    },
}

/// How a courier works.
#[derive(Debug, Clone)]
pub struct Pace {
    /// The collector's address, to be named in the log.
    pub collector: String,
    /// The run that is going on.
    pub boot: String,
    /// Pause between posts while there is no backlog.
    pub post_every: Duration,
    /// How long a post may take.
    pub request_timeout: Duration,
    /// Records of the backlog a second, at most.
    pub backlog_per_s: u32,
    /// From what the pauses after failures are drawn.
    pub seed: u64,
}

/// Time since some moment, by a clock that only runs forward; and the boot clock in nanoseconds.
pub type Now = Box<dyn Fn() -> (Duration, u64) + Send>;

/// Sends what is due.
pub struct Courier<P> {
    post: P,
    pace: Pace,
    shared: Arc<Shared>,
    now: Now,
    log: Log,
    random: u64,
    live: Turn,
    backlog: Turn,
    /// The post of which it is not known whether it arrived.
    in_doubt: Option<Parcel>,
    /// Parts of a batch that was refused as a whole.
    pieces: VecDeque<Parcel>,
    last_account: Option<Duration>,
}

/// When a lane may send again, and how often it failed in a row.
#[derive(Debug, Default)]
struct Turn {
    due: Duration,
    failures: u32,
    /// The failure that the log has last said; another one is said anew, the same one is not.
    said: Option<String>,
}

impl<P: Post> Courier<P> {
    /// A courier with nothing on the way.
    pub fn new(post: P, pace: Pace, shared: Arc<Shared>, now: Now, log: Log) -> Self {
        Self {
            post,
            random: pace.seed,
            pace,
            shared,
            now,
            log,
            live: Turn::default(),
            backlog: Turn::default(),
            in_doubt: None,
            pieces: VecDeque::new(),
            last_account: None,
        }
    }

    /// Sends what is due, if anything is. Returns the pause until something may be.
    pub fn step(&mut self) -> Duration {
        let now = self.time();
        if let Some(parcel) = self.choose(now) {
            self.send(parcel, self.pace.request_timeout);
        }
        let now = self.time();
        self.next_due().saturating_sub(now)
    }

    /// Sends the next that is in memory, or at last the account, due or not. Returns whether all has arrived.
    pub fn flush(&mut self, time_left: Duration) -> bool {
        let now = self.time();
        let parcel = self
            .in_doubt
            .take()
            .or_else(|| self.pieces.pop_front())
            .or_else(|| self.of_memory(Lane::Late, now, BACKLOG_RECORDS_MAX))
            .unwrap_or_else(|| self.live_parcel(now));
        let is_account = parcel.items.is_empty();
        let timeout = time_left.clamp(Duration::from_millis(1), self.pace.request_timeout);
        // An account that was in doubt from before is not yet the last one.
        let is_taken = self.send(parcel, timeout);
        is_taken && is_account && self.shared.with_ring(|ring| ring.is_empty())
    }

    /// Posts that failed in a row, of the lane that failed more often.
    #[must_use]
    pub fn failures(&self) -> u32 {
        self.live.failures.max(self.backlog.failures)
    }

    /// Who posts.
    pub fn post_mut(&mut self) -> &mut P {
        &mut self.post
    }

    fn time(&self) -> Duration {
        (self.now)().0
    }

    fn next_due(&self) -> Duration {
        match &self.in_doubt {
            Some(parcel) => self.turn_of(parcel.lane).due,
            None if !self.pieces.is_empty() => Duration::ZERO,
            None if self.live.failures > 0 => self.live.due,
            None => self.live.due.min(self.backlog.due),
        }
    }

    fn turn_of(&self, lane: Lane) -> &Turn {
        match lane {
            Lane::Live => &self.live,
            Lane::Late | Lane::Disk => &self.backlog,
        }
    }

    fn turn(&mut self, lane: Lane) -> &mut Turn {
        match lane {
            Lane::Live => &mut self.live,
            Lane::Late | Lane::Disk => &mut self.backlog,
        }
    }

    // ---- what goes next ------------------------------------------------------------------------------------------

    fn choose(&mut self, now: Duration) -> Option<Parcel> {
        if let Some(parcel) = self.in_doubt.take() {
            if now >= self.turn_of(parcel.lane).due {
                return Some(parcel);
            }
            self.in_doubt = Some(parcel);
            return None;
        }
        if let Some(piece) = self.pieces.pop_front() {
            return Some(piece);
        }
        if now >= self.live.due {
            let parcel = self.live_parcel(now);
            if !parcel.items.is_empty() || self.is_account_due(now) {
                return Some(parcel);
            }
            self.live.due = now + self.pace.post_every;
        }
        if now < self.backlog.due || self.live.failures > 0 {
            return None;
        }
        let parcel = self.backlog_parcel(now);
        if parcel.is_none() {
            self.backlog.due = now + LOOK_EVERY;
        }
        parcel
    }

    fn live_parcel(&self, now: Duration) -> Parcel {
        self.shared
            .with_ring(|ring| ring.parcel(Lane::Live, now, BATCH_RECORDS_MAX))
    }

    fn of_memory(&self, lane: Lane, now: Duration, records_max: usize) -> Option<Parcel> {
        let parcel = self
            .shared
            .with_ring(|ring| ring.parcel(lane, now, records_max));
        (!parcel.items.is_empty()).then_some(parcel)
    }

    /// The oldest first: what is on the disk is older than what is in memory.
    fn backlog_parcel(&mut self, now: Duration) -> Option<Parcel> {
        let shared = Arc::clone(&self.shared);
        if let Some(spool) = shared
            .spool_if_free()
            .as_deref_mut()
            .and_then(Option::as_mut)
        {
            match spool.next_parcel(BACKLOG_RECORDS_MAX) {
                Ok(Some(parcel)) => return Some(parcel),
                Ok(None) => {
                    if let Some(ended) = spool.ended_run() {
                        return Some(ended);
                    }
                }
                Err(error) => {
                    self.say_failure(Lane::Disk, &format!("the spool cannot be read: {error}"));
                }
            }
        }
        self.of_memory(Lane::Late, now, BACKLOG_RECORDS_MAX)
    }

    fn is_account_due(&self, now: Duration) -> bool {
        self.last_account
            .is_none_or(|at| now >= at + HEARTBEAT_EVERY)
    }

    // ---- what becomes of it --------------------------------------------------------------------------------------

    /// Returns whether the collector took it.
    fn send(&mut self, parcel: Parcel, timeout: Duration) -> bool {
        self.shared.with_ring(|ring| ring.doubt(Some(&parcel)));
        let batch = self.batch(&parcel);
        match self.post.post(&batch, timeout) {
            Posted::Durable(answer) => self.taken(parcel, &answer),
            Posted::Refused { status, said } => {
                self.clear_doubt();
                self.refused(parcel, status, &said);
                false
            }
            Posted::Later {
                why,
                retry_after,
                is_unstored,
            } => {
                let lane = parcel.lane;
                if is_unstored {
                    self.clear_doubt();
                    // It is found again where it is held, and so are the parts behind it.
                    self.pieces.clear();
                } else {
                    self.in_doubt = Some(parcel);
                }
                self.failed(lane, &why, retry_after, !is_unstored);
                false
            }
        }
    }

    fn batch(&self, parcel: &Parcel) -> Batch {
        let is_own = parcel.boot == self.pace.boot;
        let accounts = if is_own {
            Some(self.shared.with_ring(|ring| ring.accounts()))
        } else {
            let spool = self.shared.spool();
            spool
                .as_ref()
                .and_then(|spool| spool.ended_accounts(&parcel.boot))
        };
        let mut batch = parcel.batch(&accounts.unwrap_or_default());
        // Of a run that has ended it is not known whether its boot clock is this one.
        batch.t_sent_boot_ns = is_own.then(|| (self.now)().1);
        batch
    }

    fn taken(&mut self, mut parcel: Parcel, answer: &Acknowledgement) -> bool {
        let sent = parcel.items.len();
        let stored = parcel
            .items
            .iter()
            .take_while(|item| is_durable(answer, item))
            .count();
        parcel.items.truncate(stored);
        let (lane, is_own) = (parcel.lane, parcel.boot == self.pace.boot);
        self.let_go(parcel, sent);
        self.clear_doubt();
        if stored < sent {
            self.pieces.clear();
        }
        if sent > 0 && stored == 0 {
            let why = "the collector answered, but acknowledged nothing of what was sent";
            self.failed(lane, why, None, false);
            return false;
        }
        let now = self.time();
        if is_own {
            self.last_account = Some(now);
        }
        self.recovered(lane);
        let post_every = self.pace.post_every;
        let backlog_pause = self.backlog_pause(stored);
        let turn = self.turn(lane);
        turn.failures = 0;
        turn.due = match lane {
            Lane::Live if sent >= BATCH_RECORDS_MAX => now,
            Lane::Live => now + post_every,
            Lane::Late | Lane::Disk => now + backlog_pause,
        };
        true
    }

    /// So long that the backlog does not go faster than it may.
    fn backlog_pause(&self, records: usize) -> Duration {
        let records = u32::try_from(records).unwrap_or(u32::MAX);
        Duration::from_secs(1) * records / self.pace.backlog_per_s.max(1)
    }

    fn let_go(&mut self, parcel: Parcel, sent: usize) {
        let is_own = parcel.boot == self.pace.boot;
        match parcel.lane {
            Lane::Live | Lane::Late => {
                self.shared
                    .with_ring(|ring| ring.acknowledge(&parcel.items));
            }
            Lane::Disk => {
                let shared = Arc::clone(&self.shared);
                let mut spool = shared.spool();
                let Some(spool) = spool.as_mut() else { return };
                if sent == 0 {
                    spool.told(&parcel.boot);
                }
                let (delivered, returned) = spool.release(parcel.items);
                if is_own {
                    shared.with_ring(|ring| {
                        ring.delivered_from_disk(&delivered);
                        ring.take_back(&returned, SPOOL_FULL);
                    });
                }
            }
        }
    }

    /// Halves a refused batch until the record that is refused stands alone, and sets that aside.
    fn refused(&mut self, parcel: Parcel, status: u16, said: &str) {
        let lane = parcel.lane;
        match parcel.items.as_slice() {
            [] => self.refused_account(&parcel, status, said),
            [item] => {
                let kept = self.set_aside(lane, item, status);
                self.log.error(format!(
                    "the collector refused a record for ever, status {status}: {said}; set aside{kept}"
                ));
                let now = self.time();
                self.turn(lane).due = now;
            }
            _ => {
                let (first, second) = parcel.halves();
                self.pieces.push_front(second);
                self.pieces.push_front(first);
            }
        }
    }

    fn refused_account(&mut self, parcel: &Parcel, status: u16, said: &str) {
        if parcel.boot != self.pace.boot {
            if let Some(spool) = self.shared.spool().as_mut() {
                spool.told(&parcel.boot);
            }
        }
        self.failed(
            parcel.lane,
            &format!("status {status}: {said}"),
            None,
            false,
        );
    }

    /// Returns what the log should add.
    fn set_aside(&mut self, lane: Lane, item: &Item, status: u16) -> String {
        let reason = format!("refused-{status}");
        let shared = Arc::clone(&self.shared);
        let mut spool = shared.spool();
        shared.with_ring(|ring| match lane {
            Lane::Live | Lane::Late => {
                ring.set_aside(std::slice::from_ref(item), &reason);
            }
            Lane::Disk => ring.refused_from_disk(item, &reason),
        });
        match spool.as_mut().map(|spool| spool.set_aside(item, &reason)) {
            None => String::new(),
            Some(Ok(())) => format!(" in {}", crate::spool::QUARANTINE),
            Some(Err(error)) => format!(", but not kept: {error}"),
        }
    }

    fn clear_doubt(&mut self) {
        self.shared.with_ring(|ring| ring.doubt(None));
    }

    fn recovered(&mut self, lane: Lane) {
        if self.turn(lane).said.take().is_some() {
            let left = self.shared.with_ring(|ring| ring.len());
            self.log
                .info(format!("delivering again; {left} records wait in memory"));
        }
    }

    fn failed(&mut self, lane: Lane, why: &str, retry_after: Option<Duration>, is_for_all: bool) {
        let held = self.shared.with_ring(|ring| ring.len());
        let collector = &self.pace.collector;
        let line = format!("delivery to {collector} failed, {held} records wait: {why}");
        if self.turn_of(lane).said.as_deref() != Some(why) {
            self.log.warning(line);
            self.turn(lane).said = Some(why.to_owned());
        }
        let random = self.next_random();
        let now = self.time();
        let turn = self.turn(lane);
        turn.failures = turn.failures.saturating_add(1);
        let pause = retry_after.map_or_else(
            || back_off(turn.failures, random),
            |asked| asked.clamp(BACK_OFF_MIN, RETRY_AFTER_MAX),
        );
        turn.due = now + pause;
        if is_for_all || retry_after.is_some() {
            self.live.due = self.live.due.max(now + pause);
            self.backlog.due = self.backlog.due.max(now + pause);
        }
    }

    fn say_failure(&mut self, lane: Lane, why: &str) {
        if self.turn_of(lane).said.as_deref() != Some(why) {
            self.log.warning(why);
            self.turn(lane).said = Some(why.to_owned());
        }
    }

    /// SplitMix64 (Steele, Lea and Flood 2014): the pauses of one run can be had again from its seed.
    fn next_random(&mut self) -> u64 {
        self.random = self.random.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut mixed = self.random;
        mixed = (mixed ^ (mixed >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        mixed ^ (mixed >> 31)
    }
}

/// The pause after this many failures in a row: anywhere between the shortest and a bound that doubles ("full
/// jitter"), so that a fleet does not come back all at once.
fn back_off(failures: u32, entropy: u64) -> Duration {
    let doublings = failures.min(16);
    let bound = BACK_OFF_MIN
        .saturating_mul(1 << doublings)
        .min(BACK_OFF_MAX);
    let span_ms = u64::try_from((bound - BACK_OFF_MIN).as_millis()).unwrap_or(0) + 1;
    BACK_OFF_MIN + Duration::from_millis(entropy % span_ms)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn the_pause_lies_between_half_a_second_and_a_minute(failures in 0..u32::MAX, entropy: u64) {
            let pause = back_off(failures, entropy);
            prop_assert!((BACK_OFF_MIN..=BACK_OFF_MAX).contains(&pause));
            prop_assert!(failures > 3 || pause <= BACK_OFF_MIN * 8);
        }
    }

    #[test]
    fn the_bound_of_the_pause_doubles_and_is_used_in_full() {
        let longest = |failures| {
            (0..100_000)
                .map(|entropy| back_off(failures, entropy))
                .max()
        };
        assert_eq!(longest(1), Some(Duration::from_secs(1)));
        assert_eq!(longest(3), Some(Duration::from_secs(4)));
        assert_eq!(longest(40), Some(BACK_OFF_MAX));
    }
}
