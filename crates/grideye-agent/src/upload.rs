//! The uploader: posts what the ring holds and lets go of what the collector has on disk.
//!
//! It waits in real time on a thread of its own, so a bus that hangs does not keep it, and it keeps no bus.

use crate::clock::{Clock, unsigned_ns};
use crate::log::Log;
use crate::ring::Ring;
use grideye_recording::wire::{Acknowledgement, Batch, Limits};
use std::hash::{BuildHasher as _, RandomState};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// Records in one post at most, those of all sensors together: about 100 kB.
pub const BATCH_RECORDS_MAX: usize = 200;
/// Length of an answer at most, in bytes.
pub const ANSWER_BYTES_MAX: u64 = 1 << 20;
/// How often the account is posted when there is nothing else to say.
pub const HEARTBEAT_EVERY: Duration = Duration::from_secs(5);
/// The shortest pause after a failure.
pub const BACK_OFF_MIN: Duration = Duration::from_millis(500);
/// The longest pause after a failure of its own choice.
pub const BACK_OFF_MAX: Duration = Duration::from_secs(60);
/// The longest pause that a collector may ask for with `Retry-After`.
pub const RETRY_AFTER_MAX: Duration = Duration::from_secs(300);
/// The pause between attempts while the agent is stopping.
const FLUSH_PAUSE: Duration = Duration::from_millis(100);
/// How long connecting may take, beside the time for the whole request.
const CONNECT_TIMEOUT: Duration = Duration::from_secs(5);

/// What an uploader needs to know.
#[derive(Debug, Clone)]
pub struct Target {
    /// `http://HOST:PORT` of the collector.
    pub collector: String,
    /// The agent's name.
    pub device: String,
    /// The name of this run of the agent.
    pub boot: String,
    /// Pause between posts while there is no backlog.
    pub post_every: Duration,
    /// How long a post may take from connecting to the end of the answer.
    pub request_timeout: Duration,
}

/// The ring between bus threads and uploader.
#[derive(Debug)]
pub struct Shared {
    state: Mutex<State>,
    changed: Condvar,
}

#[derive(Debug)]
struct State {
    ring: Ring,
    flush_until: Option<Instant>,
}

impl Shared {
    /// Shares a ring.
    #[must_use]
    pub fn new(ring: Ring) -> Self {
        Self {
            state: Mutex::new(State {
                ring,
                flush_until: None,
            }),
            changed: Condvar::new(),
        }
    }

    /// Works on the ring. Short: the bus threads wait for it.
    pub fn with_ring<T>(&self, work: impl FnOnce(&mut Ring) -> T) -> T {
        work(&mut self.lock().ring)
    }

    /// Tells the uploader to deliver what is there and to end, at this moment at the latest.
    pub fn flush_until(&self, deadline: Instant) {
        self.lock().flush_until = Some(deadline);
        self.changed.notify_all();
    }

    fn flush_deadline(&self) -> Option<Instant> {
        self.lock().flush_until
    }

    /// Waits this long, or less if the agent is stopping.
    fn wait(&self, pause: Duration) {
        let until = Instant::now() + pause;
        let mut state = self.lock();
        loop {
            let left = until.saturating_duration_since(Instant::now());
            let left = match state.flush_until {
                Some(_) if pause > FLUSH_PAUSE => {
                    left.min(FLUSH_PAUSE.saturating_sub(pause.saturating_sub(left)))
                }
                _ => left,
            };
            if left.is_zero() {
                return;
            }
            state = self
                .changed
                .wait_timeout(state, left)
                .unwrap_or_else(PoisonError::into_inner)
                .0;
        }
    }

    /// A panic of another thread in the middle of a count would be a defect; going on loses less than stopping.
    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// What became of one post.
#[derive(Debug)]
enum Posted {
    /// The collector has it on disk.
    Durable(Acknowledgement),
    /// The collector will never take this body: 400, 413 or 422.
    Refused { status: u16, said: String },
    /// Anything else: try again later.
    Later {
        why: String,
        retry_after: Option<Duration>,
    },
}

/// Posts batches until it is told to stop.
pub struct Uploader {
    http: ureq::Agent,
    target: Target,
    shared: Arc<Shared>,
    clock: Arc<dyn Clock>,
    log: Log,
    batch_records: usize,
    failures: u32,
    /// The failure that the log has last said; another one is said anew, the same one is not.
    said: Option<String>,
    last_accepted: Option<Instant>,
}

impl Uploader {
    /// An uploader for this ring.
    #[must_use]
    pub fn new(target: Target, shared: Arc<Shared>, clock: Arc<dyn Clock>, log: Log) -> Self {
        let config = ureq::Agent::config_builder()
            .timeout_global(Some(target.request_timeout))
            .timeout_connect(Some(CONNECT_TIMEOUT.min(target.request_timeout)))
            .http_status_as_error(false)
            .max_redirects(0)
            .max_redirects_will_error(false)
            .max_idle_connections(1)
            // The environment is the caller's business, and a proxy between agent and collector is not asked for.
            .proxy(None)
            .user_agent(concat!("grideye-agent/", env!("CARGO_PKG_VERSION")))
            .build();
        Self {
            http: config.new_agent(),
            target,
            shared,
            clock,
            log,
            batch_records: BATCH_RECORDS_MAX,
            failures: 0,
            said: None,
            last_accepted: None,
        }
    }

    /// Posts until [`Shared::flush_until`]; then delivers what is left and ends with a last account.
    pub fn run(&mut self) {
        loop {
            let flush_until = self.shared.flush_deadline();
            if flush_until.is_some_and(|deadline| Instant::now() >= deadline) {
                return;
            }
            let batch = self.next_batch();
            let records = records(&batch);
            let is_silent = records == 0 && flush_until.is_none() && !self.is_heartbeat_due();
            let pause = if is_silent {
                self.target.post_every
            } else {
                self.deliver(&batch, records)
            };
            if flush_until.is_some() && records == 0 && self.failures == 0 {
                return;
            }
            self.shared.wait(pause);
        }
    }

    fn next_batch(&self) -> Batch {
        let sent = unsigned_ns(self.clock.boot());
        let (device, boot) = (&self.target.device, &self.target.boot);
        let mut batch = self
            .shared
            .with_ring(|ring| ring.batch(device, boot, self.batch_records));
        batch.t_sent_boot_ns = Some(sent);
        batch
    }

    fn is_heartbeat_due(&self) -> bool {
        self.last_accepted
            .is_none_or(|at| at.elapsed() >= HEARTBEAT_EVERY)
    }

    /// Posts a batch and draws the consequences. Returns the pause before the next.
    fn deliver(&mut self, batch: &Batch, records: usize) -> Duration {
        match self.post(batch) {
            Posted::Durable(answer) => self.accepted(&answer, records),
            Posted::Refused { status, said } if records > 0 => {
                self.refused(batch, records, status, &said)
            }
            Posted::Refused { status, said } => {
                self.failed(&format!("status {status}: {said}"), None)
            }
            Posted::Later { why, retry_after } => self.failed(&why, retry_after),
        }
    }

    fn accepted(&mut self, answer: &Acknowledgement, records: usize) -> Duration {
        let (freed, left) = self
            .shared
            .with_ring(|ring| (ring.acknowledge(answer), ring.len()));
        if records > 0 && freed == 0 {
            return self.failed(
                "the collector answered, but acknowledged nothing of what was sent",
                None,
            );
        }
        if self.failures > 0 {
            self.log
                .info(format!("delivering again; {left} records wait"));
        }
        self.failures = 0;
        self.said = None;
        self.last_accepted = Some(Instant::now());
        self.batch_records = (2 * self.batch_records).min(BATCH_RECORDS_MAX);
        if left >= self.batch_records {
            Duration::ZERO
        } else {
            self.target.post_every
        }
    }

    /// Halves a refused batch until the record that is refused stands alone, and sets that aside.
    fn refused(&mut self, batch: &Batch, records: usize, status: u16, said: &str) -> Duration {
        if records > 1 {
            self.batch_records = records / 2;
            return Duration::ZERO;
        }
        let reason = format!("refused-{status}");
        self.shared.with_ring(|ring| ring.set_aside(batch, &reason));
        self.log.error(format!(
            "the collector refused a record for ever, status {status}: {said}; set aside"
        ));
        self.target.post_every
    }

    fn failed(&mut self, why: &str, retry_after: Option<Duration>) -> Duration {
        if self.said.as_deref() != Some(why) {
            let held = self.shared.with_ring(|ring| ring.len());
            self.log.warning(format!(
                "delivery to {} failed, {held} records wait: {why}",
                self.target.collector
            ));
            self.said = Some(why.to_owned());
        }
        self.failures = self.failures.saturating_add(1);
        retry_after.map_or_else(
            || back_off(self.failures, RandomState::new().hash_one(self.failures)),
            |asked| asked.clamp(BACK_OFF_MIN, RETRY_AFTER_MAX),
        )
    }

    fn post(&self, batch: &Batch) -> Posted {
        let body = match batch.to_json() {
            Ok(body) => body,
            Err(error) => {
                return Posted::Refused {
                    status: 400,
                    said: format!("not encoded: {error}"),
                };
            }
        };
        match self.send(&body) {
            Ok(posted) => posted,
            Err(error) => Posted::Later {
                why: format!("{error}{}", hint(&error)),
                retry_after: None,
            },
        }
    }

    fn send(&self, body: &[u8]) -> Result<Posted, ureq::Error> {
        let url = format!("{}/v1/frames", self.target.collector);
        let timeout =
            self.shared
                .flush_deadline()
                .map_or(self.target.request_timeout, |deadline| {
                    let left = deadline.saturating_duration_since(Instant::now());
                    left.clamp(Duration::from_millis(1), self.target.request_timeout)
                });
        let request = self
            .http
            .post(url)
            .header("content-type", "application/json");
        let mut response = request
            .config()
            .timeout_global(Some(timeout))
            .build()
            .send(body)?;
        let status = response.status().as_u16();
        let retry_after = response
            .headers()
            .get("retry-after")
            .and_then(|value| value.to_str().ok());
        let retry_after = retry_after
            .and_then(|value| value.trim().parse().ok())
            .map(Duration::from_secs);
        let answer = response
            .body_mut()
            .with_config()
            .limit(ANSWER_BYTES_MAX)
            .read_to_vec()?;
        Ok(understand(status, &answer, retry_after))
    }
}

/// What a person can do where no answer came.
fn hint(error: &ureq::Error) -> &'static str {
    use std::io::ErrorKind;
    match error {
        ureq::Error::HostNotFound => NAME_HINT,
        // The resolver's failures are an `io::Error` without a number or a kind of their own.
        ureq::Error::Io(error) if error.to_string().contains("lookup") => NAME_HINT,
        ureq::Error::Io(error) if error.kind() == ErrorKind::ConnectionRefused => {
            "\nhint: is `grideye collect` running there, on this port? On its own it listens on loopback alone; other machines \
             reach it with --listen 0.0.0.0:8833 --trust-network"
        }
        ureq::Error::Io(_) | ureq::Error::Timeout(_) | ureq::Error::ConnectionFailed => {
            "\nhint: is the network up, is this the collector's address, and does its firewall let the port through?"
        }
        _ => "",
    }
}

const NAME_HINT: &str = "\nhint: is the host's name right, and the network up? An address such as 192.168.1.20 needs no name";

fn understand(status: u16, answer: &[u8], retry_after: Option<Duration>) -> Posted {
    match status {
        200 => match Acknowledgement::from_json(answer, &Limits::default()) {
            Ok(answer) => Posted::Durable(answer),
            Err(error) => Posted::Later {
                why: format!("answer not understood: {error}"),
                retry_after,
            },
        },
        400 | 413 | 422 => Posted::Refused {
            status,
            said: excerpt(answer),
        },
        _ => Posted::Later {
            why: format!("status {status}: {}", excerpt(answer)),
            retry_after,
        },
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

fn records(batch: &Batch) -> usize {
    batch.sensors.iter().map(|sensor| sensor.frames.len()).sum()
}

/// The beginning of what the collector said, on one line and without anything that could disturb a terminal.
fn excerpt(answer: &[u8]) -> String {
    const EXCERPT_CHARS: usize = 200;
    let text =
        String::from_utf8_lossy(answer.get(..4 * EXCERPT_CHARS).unwrap_or(answer)).into_owned();
    let plain = text.chars().map(|c| if c.is_control() { ' ' } else { c });
    plain
        .take(EXCERPT_CHARS)
        .collect::<String>()
        .trim()
        .to_owned()
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

    #[test]
    fn only_what_will_never_be_taken_is_refused() {
        for status in [400, 413, 422] {
            assert!(
                matches!(understand(status, b"", None), Posted::Refused { .. }),
                "{status}"
            );
        }
        for status in [201, 301, 401, 403, 404, 408, 429, 500, 503] {
            assert!(
                matches!(understand(status, b"", None), Posted::Later { .. }),
                "{status}"
            );
        }
        assert!(matches!(
            understand(200, b"<html>", None),
            Posted::Later { .. }
        ));
    }

    #[test]
    fn what_the_collector_says_is_cut_and_cannot_move_the_cursor() {
        assert_eq!(excerpt(b"no\x1b[2J\n"), "no [2J");
        assert_eq!(excerpt(&vec![b'x'; 10_000]).len(), 200);
    }
}
