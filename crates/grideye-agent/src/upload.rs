//! The uploader: the courier's thread, and its posts over HTTP.
//!
//! It waits in real time on a thread of its own, so a bus that hangs does not keep it, and it keeps no bus.

use crate::clock::{Clock, unsigned_ns};
use crate::courier::{Courier, Pace, Post, Posted};
use crate::log::Log;
use crate::shared::Shared;
use grideye_recording::wire::{Acknowledgement, Batch, Limits};
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Length of an answer at most, in bytes.
pub const ANSWER_BYTES_MAX: u64 = 1 << 20;
/// The pause between attempts while the agent is stopping.
const FLUSH_PAUSE: Duration = Duration::from_millis(100);
/// How long connecting may take, beside the time for the whole request.
const CONNECT_TIMEOUT: Duration = Duration::from_secs(5);

/// Posts until it is told to stop.
pub struct Uploader {
    courier: Courier<Http>,
    shared: Arc<Shared>,
}

impl Uploader {
    /// An uploader of what is shared.
    #[must_use]
    pub fn new(pace: Pace, shared: Arc<Shared>, clock: Arc<dyn Clock>, log: Log) -> Self {
        let http = Http::new(&pace.collector, pace.request_timeout);
        let timed = Arc::clone(&shared);
        let now = Box::new(move || (timed.now(), unsigned_ns(clock.boot())));
        Self {
            courier: Courier::new(http, pace, Arc::clone(&shared), now, log),
            shared,
        }
    }

    /// Posts until [`Shared::flush_until`]; then delivers what is in memory and ends with a last account.
    pub fn run(&mut self) {
        loop {
            let pause = match self.shared.flush_deadline() {
                None => self.courier.step(),
                Some(deadline) => {
                    let left = deadline.saturating_duration_since(Instant::now());
                    if left.is_zero() || self.courier.flush(left) {
                        return;
                    }
                    if self.courier.failures() > 0 {
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

/// Posts over HTTP, on one connection that is kept.
#[derive(Debug)]
pub struct Http {
    agent: ureq::Agent,
    url: String,
}

impl Http {
    /// For the collector at `http://HOST:PORT`.
    #[must_use]
    pub fn new(collector: &str, request_timeout: Duration) -> Self {
        let config = ureq::Agent::config_builder()
            .timeout_global(Some(request_timeout))
            .timeout_connect(Some(CONNECT_TIMEOUT.min(request_timeout)))
            .http_status_as_error(false)
            .max_redirects(0)
            .max_redirects_will_error(false)
            .max_idle_connections(1)
            // The environment is the caller's business, and a proxy between agent and collector is not asked for.
            .proxy(None)
            .user_agent(concat!("grideye-agent/", env!("CARGO_PKG_VERSION")))
            .build();
        Self {
            agent: config.new_agent(),
            url: format!("{collector}/v1/frames"),
        }
    }

    fn send(&self, body: &[u8], timeout: Duration) -> Result<Posted, ureq::Error> {
        let request = self
            .agent
            .post(&self.url)
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

impl Post for Http {
    fn post(&mut self, batch: &Batch, timeout: Duration) -> Posted {
        let body = match batch.to_json() {
            Ok(body) => body,
            Err(error) => {
                return Posted::Refused {
                    status: 400,
                    said: format!("not encoded: {error}"),
                };
            }
        };
        match self.send(&body, timeout) {
            Ok(posted) => posted,
            Err(error) => Posted::Later {
                is_unstored: is_before_sending(&error),
                why: format!("{error}{}", hint(&error)),
                retry_after: None,
            },
        }
    }
}

/// Whether nothing can have arrived: there was no connection.
fn is_before_sending(error: &ureq::Error) -> bool {
    match error {
        ureq::Error::HostNotFound | ureq::Error::ConnectionFailed => true,
        ureq::Error::Io(error) => error.kind() == std::io::ErrorKind::ConnectionRefused,
        _ => false,
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
                is_unstored: false,
            },
        },
        // 409: another agent has sent other frames under these names.
        400 | 409 | 413 | 422 => Posted::Refused {
            status,
            said: excerpt(answer),
        },
        _ => Posted::Later {
            why: format!("status {status}: {}", excerpt(answer)),
            retry_after,
            // These are given before anything is stored; of the others it is not known.
            is_unstored: matches!(status, 300..=399 | 401 | 403 | 404 | 408 | 429 | 503 | 507),
        },
    }
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

    #[test]
    fn only_what_will_never_be_taken_is_refused() {
        for status in [400, 409, 413, 422] {
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
