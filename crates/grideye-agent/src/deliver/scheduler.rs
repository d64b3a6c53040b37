//! The scheduler: which records go to the collector when, and what becomes of them by its answers. It opens no socket and
//! reads no clock but those that it is handed.
//!
//! ```text
//!   live     in memory, younger than 10 s          every post_every, whatever else waits
//!   backlog  in memory, older; then on the disk    while live posts are accepted, in larger batches, at a capped rate
//! ```
//!
//! A post that got no clear answer may have arrived. Until it has an answer nothing else is sent: so the collector's count
//! and the agent's agree after every batch that arrives.
//!
//! What is left of an earlier run and is forbidden to this agent, whose name may have been another then, waits on the disk
//! for [`HELD_FOR`](super::HELD_FOR) and lets the rest pass.

use super::limits::BACKLOG_RECORDS_MAX;
use super::post::Post;
use crate::batch::{Batch, Lane};
use crate::log::Log;
use crate::queue::Shared;
use std::collections::{BTreeMap, VecDeque};
use std::sync::Arc;
use std::time::Duration;

/// How a scheduler works.
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
pub struct Scheduler<P> {
    pub(super) post: P,
    pub(super) pace: Pace,
    pub(super) shared: Arc<Shared>,
    pub(super) now: Now,
    pub(super) log: Log,
    pub(super) random: u64,
    pub(super) live: Turn,
    pub(super) backlog: Turn,
    /// The post of which it is not known whether it arrived.
    pub(super) in_doubt: Option<Batch>,
    /// Parts of a batch that was refused as a whole.
    pub(super) pieces: VecDeque<Batch>,
    pub(super) last_account: Option<Duration>,
    /// When what is held on the disk is tried again.
    pub(super) held_until: Option<Duration>,
    /// What the log has last said of a run that is held.
    pub(super) held_said: BTreeMap<String, String>,
}

/// When a lane may send again, and how often it failed in a row.
#[derive(Debug, Default)]
pub(super) struct Turn {
    pub(super) due: Duration,
    pub(super) failures: u32,
    /// The failure that was logged last; the same one is not logged again.
    pub(super) said: Option<String>,
}

impl<P: Post> Scheduler<P> {
    /// A scheduler with nothing on the way.
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
            held_until: None,
            held_said: BTreeMap::new(),
        }
    }

    /// Sends what is due, if anything is. Returns the pause until something may be.
    pub fn step(&mut self) -> Duration {
        let now = self.time();
        if let Some(batch) = self.choose(now) {
            self.send(batch, self.pace.request_timeout);
        }
        let now = self.time();
        self.next_due().saturating_sub(now)
    }

    /// Sends the next that is in memory, or at last the account, due or not. Returns whether all has arrived.
    pub fn flush(&mut self, time_left: Duration) -> bool {
        let now = self.time();
        let batch = self
            .in_doubt
            .take()
            .or_else(|| self.pieces.pop_front())
            .or_else(|| self.of_memory(Lane::Late, now, BACKLOG_RECORDS_MAX))
            .unwrap_or_else(|| self.live_batch(now));
        let is_account = batch.items.is_empty();
        let timeout = time_left.clamp(Duration::from_millis(1), self.pace.request_timeout);
        // An account that was in doubt from before is not yet the last one.
        let is_taken = self.send(batch, timeout);
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

    pub(super) fn time(&self) -> Duration {
        (self.now)().0
    }

    fn next_due(&self) -> Duration {
        match &self.in_doubt {
            Some(batch) => self.turn_of(batch.lane).due,
            None if !self.pieces.is_empty() => Duration::ZERO,
            None if self.live.failures > 0 => self.live.due,
            None => self.live.due.min(self.backlog.due),
        }
    }

    pub(super) fn turn_of(&self, lane: Lane) -> &Turn {
        match lane {
            Lane::Live => &self.live,
            Lane::Late | Lane::Disk => &self.backlog,
        }
    }

    pub(super) fn turn(&mut self, lane: Lane) -> &mut Turn {
        match lane {
            Lane::Live => &mut self.live,
            Lane::Late | Lane::Disk => &mut self.backlog,
        }
    }
}
