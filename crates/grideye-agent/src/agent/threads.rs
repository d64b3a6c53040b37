//! The agent's threads: which ones still run, and each bus thread with its watchdog.

use crate::bus::{OpenBus, Sink, Watched, Worker};
use crate::clock::Clock;
use crate::config::BusConfig;
use crate::lock::lock;
use crate::log::Log;
use crate::queue::Shared;
use grideye_recording::Record;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Condvar, Mutex, PoisonError};
use std::time::Duration;

/// Stack of each thread. Only touched pages become resident.
pub(super) const STACK_BYTES: usize = 1 << 20;
/// A full ring is logged once per this many records.
const RING_FULL_SAID_EVERY: u64 = 100;

/// Which threads of a set still run, and whether they should stop.
#[derive(Debug)]
pub(super) struct Running {
    pub(super) is_stopping: AtomicBool,
    is_running: Mutex<Vec<bool>>,
    ended: Condvar,
}

impl Running {
    pub(super) fn new(threads: usize) -> Self {
        Self {
            is_stopping: AtomicBool::new(false),
            is_running: Mutex::new(vec![true; threads]),
            ended: Condvar::new(),
        }
    }

    /// Waits until none runs, at most this long. Returns whether none does.
    pub(super) fn wait(&self, timeout: Duration) -> bool {
        let some_run = |is_running: &mut Vec<bool>| is_running.contains(&true);
        let is_running = lock(&self.is_running);
        let waited = self.ended.wait_timeout_while(is_running, timeout, some_run);
        !waited.unwrap_or_else(PoisonError::into_inner).1.timed_out()
    }

    pub(super) fn still_running(&self, names: &[String]) -> Vec<String> {
        let is_running = lock(&self.is_running);
        let running = names.iter().zip(is_running.iter());
        let running = running.filter(|(_, is_running)| **is_running);
        running.map(|(name, _)| name.clone()).collect()
    }
}

/// Marks the thread with this index as ended on drop, so even after a panic.
pub(super) struct Ended<'a>(pub(super) &'a Running, pub(super) usize);

impl Drop for Ended<'_> {
    fn drop(&mut self) {
        let Self(running, index) = self;
        if let Some(is_running) = lock(&running.is_running).get_mut(*index) {
            *is_running = false;
        }
        running.ended.notify_all();
    }
}

/// A bus of any kind, ready for a thread of the agent.
pub struct AnyBus(pub(super) Box<dyn FnOnce(BusThread) + Send>);

impl AnyBus {
    /// From its opener. The thread opens the bus, and the bus stays there.
    pub fn new(opener: impl OpenBus + Send + 'static) -> Self {
        Self(Box::new(move |thread| thread.run(opener)))
    }
}
pub(super) struct BusThread {
    pub(super) config: BusConfig,
    pub(super) index: usize,
    pub(super) first_stream: usize,
    pub(super) frames_limit: Option<u64>,
    pub(super) hung_after: Duration,
    pub(super) shared: Arc<Shared>,
    pub(super) running: Arc<Running>,
    pub(super) clock: Arc<dyn Clock>,
    pub(super) log: Log,
}

impl BusThread {
    fn run(self, opener: impl OpenBus) {
        let _ended = Ended(&self.running, self.index);
        let what = (&self.config, self.frames_limit);
        let mut worker = Worker::of_bus(opener, what, Arc::clone(&self.clock), self.log.clone());
        let watched = Arc::clone(&worker.watched);
        let bus = self.config.path.display().to_string();
        std::thread::scope(|scope| {
            let watchdog = std::thread::Builder::new()
                .name("watchdog".to_owned())
                .stack_size(STACK_BYTES)
                .spawn_scoped(scope, || {
                    let what = (bus.as_str(), self.hung_after);
                    watched.watch(what, &self, self.clock.as_ref(), &self.log);
                });
            if let Err(error) = watchdog {
                self.log
                    .warning(format!("{bus}: cannot start its watchdog: {error}"));
            }
            let _over = Over(&watched);
            worker.run(&self);
        });
    }
}

/// Ends the watchdog, however the watched thread ends.
struct Over<'a>(&'a Watched);

impl Drop for Over<'_> {
    fn drop(&mut self) {
        self.0.over();
    }
}

impl Sink for BusThread {
    fn record(&self, sensor: usize, record: Record) {
        let now = self.shared.now();
        let stream = self.first_stream + sensor;
        self.shared.notes().saw(stream, &record, now);
        let dropped = self.shared.with_ring(|ring| ring.push(stream, record, now));
        if dropped > 0 && record.seq % RING_FULL_SAID_EVERY == 0 {
            self.log
                .error("the ring is full: the oldest records are being dropped");
        }
    }

    fn fault(&self, sensor: usize, kind: &'static str) {
        self.shared
            .with_ring(|ring| ring.count_fault(self.first_stream + sensor, kind));
    }

    fn is_stopping(&self) -> bool {
        self.running.is_stopping.load(Ordering::SeqCst)
    }
}
