//! The uploader's thread. It waits in real time on a thread of its own, so a bus that hangs does not keep it, and it keeps no bus.

use super::http::Http;
use super::scheduler::{Pace, Scheduler};
use crate::clock::{Clock, unsigned_ns};
use crate::log::Log;
use crate::queue::Shared;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// The pause between attempts while the agent is stopping.
const FLUSH_PAUSE: Duration = Duration::from_millis(100);

/// Posts until it is told to stop.
pub struct Uploader {
    scheduler: Scheduler<Http>,
    shared: Arc<Shared>,
}

impl Uploader {
    /// An uploader of what is shared.
    #[must_use]
    pub fn new(
        http: Http,
        pace: Pace,
        shared: Arc<Shared>,
        clock: Arc<dyn Clock>,
        log: Log,
    ) -> Self {
        let timed = Arc::clone(&shared);
        let now = Box::new(move || (timed.now(), unsigned_ns(clock.boot())));
        Self {
            scheduler: Scheduler::new(http, pace, Arc::clone(&shared), now, log),
            shared,
        }
    }

    /// Posts until [`Shared::flush_until`]; then delivers what is in memory and ends with a last account.
    pub fn run(&mut self) {
        loop {
            let pause = match self.shared.flush_deadline() {
                None => self.scheduler.step(),
                Some(deadline) => {
                    let left = deadline.saturating_duration_since(Instant::now());
                    if left.is_zero() || self.scheduler.flush(left) {
                        return;
                    }
                    if self.scheduler.failures() > 0 {
                        FLUSH_PAUSE
                    } else {
                        Duration::ZERO
                    }
                }
            };
            self.shared.wait(pause);
        }
    }
}
