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
//!
//! What is left of an earlier run and is forbidden to this agent, whose name may have been another then, waits on the disk
//! for [`HELD_FOR`] and lets the rest pass.

mod back_off;
mod choice;
mod hold;
mod outcome;

use crate::log::Log;
use crate::parcel::{Lane, Parcel};
use crate::shared::Shared;
use grideye_recording::wire::{Acknowledgement, Batch};
use std::collections::{BTreeMap, VecDeque};
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
/// How long what is left of an earlier run is held before it is tried again, after the collector has forbidden it.
pub const HELD_FOR: Duration = Duration::from_secs(600);
/// Under which name it is counted that the collector forbids what is left of an earlier run.
pub const BACKLOG_FORBIDDEN: &str = "backlog-forbidden";
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
    /// The collector knows this agent, or does not, and does not let it send that: nothing was stored.
    Forbidden {
        /// The answer's status: 401 or 403.
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
    /// When what is held on the disk is tried again.
    held_until: Option<Duration>,
    /// What the log has last said of a run that is held.
    held_said: BTreeMap<String, String>,
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
            held_until: None,
            held_said: BTreeMap::new(),
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
}
