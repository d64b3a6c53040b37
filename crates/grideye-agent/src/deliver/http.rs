//! Posts over HTTP, and what the collector's answers mean.

use super::post::{Post, Posted};
use super::transport::signed;
use crate::advice;
use crate::config::Body;
use crate::join::Secret;
use grideye_recording::wire::{Acknowledgement, BINARY_TYPE, Batch, JSON_TYPE, Limits, WireError};
use std::time::{Duration, Instant};

/// Length of an answer at most, in bytes.
pub const ANSWER_BYTES_MAX: u64 = 1 << 20;
/// How often the agent says how it is set up: a collector that was restarted knows it after so long.
pub const CONFIGURATION_EVERY: Duration = Duration::from_secs(60);
/// Bytes of that at most; an agent that has more to say does not say it.
pub const CONFIGURATION_BYTES_MAX: usize = 4096;
const CONFIGURATION_HEADER: &str = "grideye-configuration";

/// The answer to a form of body that is not known.
const UNSUPPORTED_MEDIA_TYPE: u16 = 415;

/// Posts over HTTP, on one connection that is kept.
#[derive(Debug)]
pub struct Http {
    agent: ureq::Agent,
    url: String,
    token: Option<Secret>,
    body: Body,
    configuration: Option<Configuration>,
}

/// What the agent says of its own set-up, for whoever looks at its device: with the first post, and now and then.
#[derive(Debug)]
struct Configuration {
    json: String,
    said: Option<Instant>,
}

impl Http {
    /// For the collector at `http://HOST:PORT` or `https://HOST:PORT`, by a [`transport::client`](super::transport::client); the token goes with every
    /// post.
    #[must_use]
    pub fn new(collector: &str, client: ureq::Agent, token: Option<Secret>) -> Self {
        Self {
            agent: client,
            url: format!("{collector}/v1/frames"),
            token,
            body: Body::Json,
            configuration: None,
        }
    }

    /// Says with a post every [`CONFIGURATION_EVERY`] how the agent is set up: one JSON object.
    #[must_use]
    pub fn saying(mut self, configuration: &serde_json::Value) -> Self {
        let json = configuration.to_string();
        let is_a_header = json.len() <= CONFIGURATION_BYTES_MAX
            && json
                .bytes()
                .all(|byte| byte.is_ascii_graphic() || byte == b' ');
        self.configuration = is_a_header.then_some(Configuration { json, said: None });
        self
    }

    /// Posts in this form, until a collector answers that it does not know it.
    #[must_use]
    pub fn with_body(self, body: Body) -> Self {
        Self { body, ..self }
    }

    fn send(
        &mut self,
        body: &[u8],
        content_type: &str,
        timeout: Duration,
    ) -> Result<(u16, Posted), ureq::Error> {
        let mut request = signed(self.agent.post(&self.url), self.token.as_ref())
            .header("content-type", content_type);
        let now = Instant::now();
        let due = self.configuration.as_mut().filter(|configuration| {
            configuration
                .said
                .is_none_or(|said| now - said >= CONFIGURATION_EVERY)
        });
        if let Some(configuration) = &due {
            request = request.header(CONFIGURATION_HEADER, &configuration.json);
        }
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
        if let (Some(configuration), 200) = (due, status) {
            configuration.said = Some(now);
        }
        Ok((status, understand(status, &answer, retry_after)))
    }
}

impl Post for Http {
    fn post(&mut self, batch: &Batch, timeout: Duration) -> Posted {
        let (body, content_type) = match encode(batch, self.body) {
            Ok(encoded) => encoded,
            Err(error) => {
                return Posted::Refused {
                    status: 400,
                    said: format!("not encoded: {error}"),
                };
            }
        };
        match self.send(&body, content_type, timeout) {
            // An older collector: nothing of it was read.
            Ok((UNSUPPORTED_MEDIA_TYPE, _)) if self.body == Body::Binary => {
                self.body = Body::Json;
                self.post(batch, timeout)
            }
            Ok((_, posted)) => posted,
            Err(error) => Posted::Later {
                is_unstored: is_before_sending(&error),
                why: format!("{error}{}", advice::network::hint(&error)),
                retry_after: None,
            },
        }
    }
}

/// The body, and its content type.
fn encode(batch: &Batch, body: Body) -> Result<(Vec<u8>, &'static str), WireError> {
    Ok(match body {
        Body::Json => (batch.to_json()?, JSON_TYPE),
        Body::Binary => (batch.to_binary()?, BINARY_TYPE),
    })
}

/// Whether nothing can have arrived: there was no connection.
fn is_before_sending(error: &ureq::Error) -> bool {
    match error {
        ureq::Error::HostNotFound | ureq::Error::ConnectionFailed => true,
        ureq::Error::Io(error) => error.kind() == std::io::ErrorKind::ConnectionRefused,
        _ => false,
    }
}

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
        401 | 403 => Posted::Forbidden {
            status,
            said: excerpt(answer),
        },
        _ => Posted::Later {
            why: format!("status {status}: {}", excerpt(answer)),
            retry_after,
            // These are given before anything is stored; of the others it is not known.
            is_unstored: matches!(status, 300..=399 | 404 | 408 | 429 | 503 | 507),
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
        for status in [201, 301, 404, 408, 429, 500, 503] {
            assert!(
                matches!(understand(status, b"", None), Posted::Later { .. }),
                "{status}"
            );
        }
        for status in [401, 403] {
            assert!(matches!(
                understand(status, b"", None),
                Posted::Forbidden { .. }
            ));
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
