//! The thread of one bus: its worker, and the watchdog beside it.

use super::threads::{Ended, Running, STACK_BYTES};
use crate::bus::{OpenBus, Sink, Watched, Worker};
use crate::clock::Clock;
use crate::config::BusConfig;
use crate::log::Log;
use crate::queue::Shared;
use grideye_recording::Record;
use std::fmt;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::Duration;

/// A full ring is said once in so many records, not for each.
const RING_FULL_SAID_EVERY: u64 = 100;

/// A bus of any kind, ready to be read by a thread of the agent.
pub struct AnyBus(pub(super) Box<dyn FnOnce(BusThread) + Send>);

impl AnyBus {
    /// From something that opens a bus. The bus itself is opened on its thread and stays there.
    pub fn new(opener: impl OpenBus + Send + 'static) -> Self {
        Self(Box::new(move |thread| thread.run(opener)))
    }
}

impl fmt::Debug for AnyBus {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str("AnyBus")
    }
}

/// All that a bus thread needs but the bus.
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
        let _ended = Ended {
            running: &self.running,
            index: self.index,
        };
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
                    .warning(format!("{bus}: no thread to watch it: {error}"));
            }
            let _over = Over(&watched);
            worker.run(&self);
        });
    }
}

/// Ends the watchdog, however the thread that it watches ends.
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
        self.shared.observed().saw(stream, &record, now);
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
