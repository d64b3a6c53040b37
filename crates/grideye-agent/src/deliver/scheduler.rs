//! The scheduler: chooses which records to post when, and acts on the collector's answers. It opens no socket and reads
//! no clock; callers hand in both.
//!
//! ```text
//!   live     younger than 10 s, in memory                     every post_every, whatever else waits
//!   backlog  all else, oldest first: the disk, then memory    while live posts are accepted, in larger batches, at a
//!                                                             capped rate
//! ```
//!
//! A post without a clear answer may have arrived. Nothing else is sent until it gets an answer, so the collector's
//! count and the agent's agree after every batch that arrives.
//!
//! A collector whose store was replaced by an older one lacks frames that it had acknowledged. Its answers show it:
//! acknowledged numbers are gaps, or above `durable_through`. Such frames go out again if the disk still has them, and
//! the others move from acknowledged to dropped (`lost-by-collector`). Then the last [`BOOTS_TOLD_AGAIN`](wire::BOOTS_TOLD_AGAIN) ended boots are
//! reported again, which shows their losses in the same way; the boot before is reported at each start. Retention
//! looks like no loss, because a collector keeps the numbers of that many boots when their frames are deleted.
//!
//! If the collector forbids records of the current boot, they are retried like any failure. Records of an earlier boot,
//! possibly under another device name, are held on the disk for [`HELD_FOR`] while the others go on.

use super::post::{
    BACK_OFF_MAX, BACK_OFF_MIN, BACKLOG_FORBIDDEN, BACKLOG_RECORDS_MAX, BATCH_RECORDS_MAX,
    HEARTBEAT_EVERY, HELD_FOR, Post, Posted, RETRY_AFTER_MAX, TOO_LARGE,
};
use crate::batch::{Batch, Item, Lane, is_durable};
use crate::log::Log;
use crate::queue::Shared;
use crate::spool::{QUARANTINE, RUNS_MAX};
use grideye_recording::wire::{self, Acknowledgement, LOST_BY_COLLECTOR};
use std::collections::{BTreeMap, VecDeque};
use std::sync::Arc;
use std::time::{Duration, Instant};

/// How often to look on the disk for a backlog when there was none.
const LOOK_EVERY: Duration = Duration::from_millis(500);
/// The pause between attempts while the agent is stopping.
const FLUSH_PAUSE: Duration = Duration::from_millis(100);

/// A scheduler's parameters.
#[derive(Debug, Clone)]
pub struct Pace {
    /// The collector's address, for the log.
    pub collector: String,
    /// The current boot.
    pub boot: String,
    /// Pause between posts while there is no backlog.
    pub post_every: Duration,
    /// Time limit of a post.
    pub request_timeout: Duration,
    /// Maximum backlog records per second.
    pub backlog_per_s: u32,
    /// Seed of the random pauses after failures.
    pub seed: u64,
}

/// Elapsed time on a clock that never goes back, and the boot clock in nanoseconds.
type Now = Box<dyn Fn() -> (Duration, u64) + Send>;

/// Sends whatever is due.
pub struct Scheduler<P> {
    post: P,
    pace: Pace,
    shared: Arc<Shared>,
    now: Now,
    log: Log,
    random: u64,
    live: Turn,
    backlog: Turn,
    /// Goes before all else: a post that may or may not have arrived, and the parts of one that was rejected as a whole.
    begun: VecDeque<Batch>,
    /// Whether the first of them may have arrived, now or by an earlier attempt.
    is_in_doubt: bool,
    last_account: Option<Duration>,
    /// When to retry the records held on the disk.
    held_until: Option<Duration>,
    /// The last log line about each held boot.
    held_said: BTreeMap<String, String>,
}

/// When a lane may send again, and its failures in a row.
#[derive(Debug, Default)]
struct Turn {
    due: Duration,
    failures: u32,
    /// The last failure logged; the same one is not logged again.
    said: Option<String>,
}

impl<P: Post> Scheduler<P> {
    /// A scheduler with no post under way.
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
            begun: VecDeque::new(),
            is_in_doubt: false,
            last_account: None,
            held_until: None,
            held_said: BTreeMap::new(),
        }
    }

    /// Posts until [`Shared::flush_until`], then delivers the rest of memory and ends with a last account.
    pub(crate) fn run(&mut self) {
        loop {
            let pause = match self.shared.flush_deadline() {
                None => self.step(),
                Some(deadline) => {
                    let left = deadline.saturating_duration_since(Instant::now());
                    if left.is_zero() || self.flush(left) {
                        return;
                    }
                    FLUSH_PAUSE * self.failures().min(1)
                }
            };
            self.shared.wait(pause);
        }
    }

    /// Sends what is due, if anything. Returns the pause until the next look.
    pub fn step(&mut self) -> Duration {
        if let Some(batch) = self.choose(self.time()) {
            self.send(batch, self.pace.request_timeout);
        }
        self.next_due().saturating_sub(self.time())
    }

    /// Sends the next batch in memory, or finally the account, due or not. Returns whether everything has arrived.
    pub fn flush(&mut self, time_left: Duration) -> bool {
        let now = self.time();
        let begun = self.begun.pop_front();
        let batch = begun
            .or_else(|| self.late_batch(now))
            .unwrap_or_else(|| self.of_memory(Lane::Live, now, BATCH_RECORDS_MAX));
        let is_account = batch.items.is_empty();
        let timeout = time_left.clamp(Duration::from_millis(1), self.pace.request_timeout);
        // An account left in doubt from before the stop is not the last one.
        let is_taken = self.send(batch, timeout);
        is_taken && is_account && self.shared.with_ring(|ring| ring.is_empty())
    }

    /// Failed posts in a row, of the lane with more of them.
    #[must_use]
    pub fn failures(&self) -> u32 {
        self.live.failures.max(self.backlog.failures)
    }

    fn time(&self) -> Duration {
        (self.now)().0
    }

    fn next_due(&self) -> Duration {
        match self.begun.front() {
            Some(batch) if batch.lane == Lane::Live => self.live.due,
            Some(_) => self.backlog.due,
            None if self.live.failures > 0 => self.live.due,
            None => self.live.due.min(self.backlog.due),
        }
    }

    fn turn(&mut self, lane: Lane) -> &mut Turn {
        match lane {
            Lane::Live => &mut self.live,
            Lane::Backlog => &mut self.backlog,
        }
    }

    fn choose(&mut self, now: Duration) -> Option<Batch> {
        if let Some(lane) = self.begun.front().map(|batch| batch.lane) {
            let is_due = now >= self.turn(lane).due;
            return if is_due { self.begun.pop_front() } else { None };
        }
        if now >= self.live.due {
            let batch = self.of_memory(Lane::Live, now, BATCH_RECORDS_MAX);
            let is_account_due = |at| now >= at + HEARTBEAT_EVERY;
            if !batch.items.is_empty() || self.last_account.is_none_or(is_account_due) {
                return Some(batch);
            }
            self.live.due = now + self.pace.post_every;
        }
        if now < self.backlog.due || self.live.failures > 0 {
            return None;
        }
        self.try_held(now);
        let batch = self.backlog_batch(now);
        if batch.is_none() {
            self.backlog.due = now + LOOK_EVERY;
        }
        batch
    }

    fn of_memory(&self, lane: Lane, now: Duration, records_max: usize) -> Batch {
        self.shared
            .with_ring(|ring| ring.batch(lane, now, records_max))
    }

    fn late_batch(&self, now: Duration) -> Option<Batch> {
        let batch = self.of_memory(Lane::Backlog, now, BACKLOG_RECORDS_MAX);
        (!batch.items.is_empty()).then_some(batch)
    }

    /// Oldest first: records on the disk are older than those in memory.
    fn backlog_batch(&mut self, now: Duration) -> Option<Batch> {
        match self.shared.next_on_disk(BACKLOG_RECORDS_MAX) {
            Ok(None) => {}
            Ok(batch) => return batch,
            Err(error) => {
                let why = format!("the spool cannot be read: {error}");
                self.say_failure(Lane::Backlog, &why, &why);
            }
        }
        self.late_batch(now)
    }

    /// Returns whether the collector stored it.
    fn send(&mut self, batch: Batch, timeout: Duration) -> bool {
        let body = self.to_wire(&batch);
        let was_in_doubt = std::mem::take(&mut self.is_in_doubt);
        match self.post.post(&body, timeout) {
            Posted::Durable(answer) => return self.taken(batch, &answer),
            Posted::Refused(status, said) => self.refused(batch, status, &said),
            Posted::Forbidden(status, said) => {
                self.begun.clear();
                self.forbidden(&batch, status, &said);
            }
            Posted::Later {
                why,
                retry_after,
                is_unstored,
            } => {
                let lane = batch.lane;
                self.is_in_doubt = was_in_doubt || !is_unstored;
                if self.is_in_doubt {
                    self.begun.push_front(batch);
                } else {
                    // The next look finds it again where it waits, and so its remaining parts.
                    self.begun.clear();
                }
                self.failed(lane, &why, retry_after, !is_unstored);
            }
        }
        false
    }

    fn to_wire(&self, batch: &Batch) -> wire::Batch {
        let is_own = self.is_own(batch);
        let accounts = if is_own {
            Some(self.shared.with_ring(|ring| ring.accounts()))
        } else {
            let spool = self.shared.spool();
            spool
                .as_ref()
                .and_then(|spool| spool.ended_accounts(&batch.boot))
        };
        let mut body = batch.to_wire(&accounts.unwrap_or_default());
        // Another boot's clock may not be this one.
        body.t_sent_boot_ns = is_own.then(|| (self.now)().1);
        body
    }

    fn is_own(&self, batch: &Batch) -> bool {
        batch.boot == self.pace.boot
    }

    fn taken(&mut self, mut batch: Batch, answer: &Acknowledgement) -> bool {
        let sent = batch.items.len();
        let is_stored = |item: &&Item| is_durable(answer, item);
        let stored = batch.items.iter().take_while(is_stored).count();
        batch.items.truncate(stored);
        let is_own = self.is_own(&batch);
        let (lane, boot) = (batch.lane, batch.boot);
        self.shared.settle(batch.items, None);
        let went_back = stored == sent && self.went_back(&boot, is_own, answer);
        if sent == 0 && !is_own && !went_back {
            self.told(&boot);
        }
        if stored < sent {
            self.begun.clear();
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
        if self.turn(lane).said.take().is_some() {
            let left = self.shared.with_ring(|ring| ring.len());
            let spool = self.shared.spool_if_free();
            let spool = spool.as_ref().and_then(|spool| spool.as_ref());
            let on_disk = spool.map_or_else(String::new, |spool| {
                let (own, earlier) = spool.waiting_frames();
                format!(" and {} frames on the disk", own + earlier)
            });
            self.log.info(format!(
                "delivering again; {left} records wait in memory{on_disk}"
            ));
        }
        if self.held_said.remove(&boot).is_some() {
            let line = format!("the rest of boot {boot} is being delivered again");
            self.log.info(line);
        }
        // Long enough to limit the backlog's rate.
        let records = u32::try_from(stored).unwrap_or(u32::MAX);
        let backlog_pause = Duration::from_secs(1) * records / self.pace.backlog_per_s.max(1);
        let pause = match lane {
            _ if !self.begun.is_empty() => Duration::ZERO,
            Lane::Live if sent >= BATCH_RECORDS_MAX => Duration::ZERO,
            Lane::Live => self.pace.post_every,
            Lane::Backlog => backlog_pause,
        };
        self.shared.notes().accepted(now);
        let turn = self.turn(lane);
        (turn.failures, turn.due) = (0, now + pause);
        true
    }

    /// Whether the collector lost frames of this boot that it had acknowledged.
    fn went_back(&self, boot: &str, is_own: bool, answer: &Acknowledgement) -> bool {
        let lost = self.shared.look_back(boot, is_own, answer);
        if let Some((again, gone)) = lost {
            self.log.error(format!(
                "the collector no longer has {} frames of boot {boot} that it had acknowledged: {again} are still here and are sent again, {gone} are lost and count as {LOST_BY_COLLECTOR}, as after the restore of an older store",
                again + gone
            ));
        }
        lost.is_some()
    }

    /// The collector knows that this boot ended.
    fn told(&self, boot: &str) {
        if let Some(spool) = self.shared.spool().as_mut() {
            spool.told(boot);
        }
    }

    /// Halves a rejected batch until a single record is rejected, and sets that one aside.
    fn refused(&mut self, batch: Batch, status: u16, said: &str) {
        let lane = batch.lane;
        match batch.items.as_slice() {
            [] => {
                if !self.is_own(&batch) {
                    self.told(&batch.boot);
                }
                self.failed(lane, &format!("status {status}: {said}"), None, false);
            }
            [_] if status == TOO_LARGE => {
                self.begun.clear();
                self.failed(lane, &format!("status {status}: {said}"), None, true);
            }
            [item] => {
                let kept = self.drop_refused(item, status);
                self.log.error(format!(
                    "the collector rejected a record permanently, status {status}: {said}; set aside{kept}"
                ));
                self.turn(lane).due = self.time();
            }
            _ => {
                let (first, second) = batch.halves();
                self.begun.push_front(second);
                self.begun.push_front(first);
                self.turn(lane).due = self.time();
            }
        }
    }

    /// Returns a suffix for the log line.
    fn drop_refused(&self, item: &Item, status: u16) -> String {
        let reason = format!("refused-{status}");
        self.shared.settle(vec![item.clone()], Some(&reason));
        let mut spool = self.shared.spool();
        match spool.as_mut().map(|spool| spool.quarantine(item)) {
            None => String::new(),
            Some(Ok(())) => format!(" in {QUARANTINE}"),
            Some(Err(error)) => format!(", but not kept: {error}"),
        }
    }

    fn forbidden(&mut self, batch: &Batch, status: u16, said: &str) {
        let why = format!("the collector forbids it, status {status}: {said}");
        if self.is_own(batch) {
            let why = format!(
                "{why}\nhint: print a line with `grideye enroll {}` on the collector's machine, and paste it here to `sudo grideye-agent join --replace -`",
                batch.device
            );
            return self.failed(batch.lane, &why, None, false);
        }
        let (device, boot) = (&batch.device, &batch.boot);
        let mut spool = self.shared.spool();
        let frames = spool.as_mut().map_or(0, |spool| spool.hold(boot));
        drop(spool);
        self.shared
            .with_ring(|ring| ring.count_fault_of_all(BACKLOG_FORBIDDEN));
        let now = self.time();
        self.held_until.get_or_insert(now + HELD_FOR);
        self.turn(batch.lane).due = now;
        // Log at most as many boots as a spool remembers.
        if self.held_said.get(boot) == Some(&why) || self.held_said.len() >= RUNS_MAX {
            return;
        }
        self.log.error(format!(
            "{why}; {frames} frames of device {device}, boot {boot}, stay in the spool and are retried every {} min; all others continue\n\
             hint: allow this agent to send as {device} too, or set `device` in its configuration back to {device} until they have arrived",
            HELD_FOR.as_secs() / 60
        ));
        self.held_said.insert(boot.clone(), why);
    }

    fn try_held(&mut self, now: Duration) {
        if self.held_until.is_some_and(|until| now >= until) {
            self.held_until = None;
            if let Some(spool) = self.shared.spool().as_mut() {
                spool.try_held();
            }
        }
    }

    fn failed(&mut self, lane: Lane, why: &str, retry_after: Option<Duration>, is_for_all: bool) {
        let held = self.shared.with_ring(|ring| ring.len());
        let collector = &self.pace.collector;
        let line = format!("delivery to {collector} failed, {held} records wait: {why}");
        self.say_failure(lane, why, &line);
        let random = self.next_random();
        let now = self.time();
        self.shared.notes().failed(why);
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

    /// Logs a failure unless it repeats the lane's last one.
    fn say_failure(&mut self, lane: Lane, why: &str, line: &str) {
        if self.turn(lane).said.as_deref() != Some(why) {
            self.log.warning(line);
            self.turn(lane).said = Some(why.to_owned());
        }
    }

    /// SplitMix64 (Steele, Lea and Flood 2014), so that the seed reproduces a boot's pauses.
    fn next_random(&mut self) -> u64 {
        self.random = self.random.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut mixed = self.random;
        mixed = (mixed ^ (mixed >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        mixed ^ (mixed >> 31)
    }
}

/// The pause after this many failures in a row: random between the shortest and a bound that doubles ("full jitter"),
/// so that a fleet does not return all at once.
fn back_off(failures: u32, entropy: u64) -> Duration {
    let bound = BACK_OFF_MIN
        .saturating_mul(1 << failures.min(16))
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
        for (failures, longest) in [(1, 1), (3, 4), (40, 60)] {
            let pauses = (0..100_000).map(|entropy| back_off(failures, entropy));
            assert_eq!(pauses.max(), Some(Duration::from_secs(longest)));
        }
    }
}
