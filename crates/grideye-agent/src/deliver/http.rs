//! Posts over HTTP, with TLS that trusts a single authority, and interprets the collector's answers.

use super::post::{Post, Posted, TOO_LARGE};
use crate::advice;
use crate::config::{Body, Config};
use crate::join::{ClientCertificate, Credentials, Joined, Secret};
use grideye_recording::wire::{Acknowledgement, BINARY_TYPE, Batch, JSON_TYPE};
use rustls::crypto::ring::default_provider;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::{Duration, Instant};
use ureq::RequestBuilder;
use ureq::tls::{Certificate, ClientCert, PrivateKey, RootCerts, TlsConfig, TlsProvider};

/// Maximum size of an answer in bytes.
pub const ANSWER_BYTES_MAX: u64 = 1 << 20;
/// How often the agent sends its own settings. A restarted collector knows them after this time.
pub const CONFIGURATION_EVERY: Duration = Duration::from_secs(60);
/// Maximum size of those settings in bytes; the agent does not send longer ones.
pub const CONFIGURATION_BYTES_MAX: usize = 4096;
const CONFIGURATION_HEADER: &str = "grideye-configuration";
/// How many characters of an answer to quote.
const EXCERPT_CHARS: usize = 200;
/// Time limit for connecting, within the limit for the whole request.
const CONNECT_TIMEOUT: Duration = Duration::from_secs(5);

const PATH: &str = "/v1/frames";
/// The status for a token that is not, or no longer, known.
const UNAUTHORIZED: u16 = 401;
/// The status for an unknown body encoding.
const UNSUPPORTED_MEDIA_TYPE: u16 = 415;
/// A collector's codes for a record whose content no collector takes. Other codes are about a batch's form, of which another
/// version of the collector may know more.
const OF_CONTENT: [&str; 3] = ["conflict", "number_too_large", "wrong_value"];

#[derive(Debug)]
pub(crate) struct Http {
    agent: ureq::Agent,
    url: String,
    token: Option<Secret>,
    /// The file that joining wrote, and writes again when the token is replaced.
    joined: Option<PathBuf>,
    body: Body,
    /// The agent's settings if they fit in a header, and when they were last sent.
    configuration: Option<(String, Option<Instant>)>,
}

impl Http {
    /// Posts to the collector at this URL with a [`client`]. Every [`CONFIGURATION_EVERY`] it also sends
    /// `configuration`, one JSON object with the agent's settings.
    pub(crate) fn new(
        collector: &str,
        client: ureq::Agent,
        config: &Config,
        configuration: &serde_json::Value,
    ) -> Self {
        let json = configuration.to_string();
        let is_plain = |byte: u8| byte.is_ascii_graphic() || byte == b' ';
        let is_a_header = json.len() <= CONFIGURATION_BYTES_MAX && json.bytes().all(is_plain);
        Self {
            agent: client,
            url: format!("{collector}{PATH}"),
            token: config.credentials.token.clone(),
            joined: config.joined.clone(),
            body: config.body,
            configuration: is_a_header.then_some((json, None)),
        }
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
        let is_due = |said: Option<Instant>| said.is_none_or(|at| now - at >= CONFIGURATION_EVERY);
        let due = self.configuration.as_mut().filter(|(_, at)| is_due(*at));
        if let Some((json, _)) = &due {
            request = request.header(CONFIGURATION_HEADER, json);
        }
        let request = request.config().timeout_global(Some(timeout)).build();
        let mut response = request.send(body)?;
        let status = response.status().as_u16();
        let retry_after = response.headers().get("retry-after");
        let retry_after = retry_after.and_then(|value| value.to_str().ok()?.trim().parse().ok());
        let media_type = response.headers().get("content-type");
        let is_json =
            media_type.is_some_and(|kind| kind.as_bytes().starts_with(JSON_TYPE.as_bytes()));
        let answer = response.body_mut().with_config();
        let answer = answer.limit(ANSWER_BYTES_MAX).read_to_vec()?;
        if let (Some((_, said)), 200) = (due, status) {
            *said = Some(now);
        }
        let retry_after = retry_after.map(Duration::from_secs);
        let error = error_of(&answer).filter(|_| is_json);
        Ok((status, understand((status, error), &answer, retry_after)))
    }

    /// Takes the token that joining has written since. A line of another collector needs a restart: its store begins its counts again.
    fn take_new_token(&mut self) -> bool {
        let joined = self
            .joined
            .as_deref()
            .and_then(|path| Joined::read(path).ok());
        let joined = joined.filter(|joined| self.url.strip_prefix(&joined.collector) == Some(PATH));
        let token = joined.and_then(|joined| joined.credentials.token);
        let is_new = token.is_some() && token != self.token;
        self.token = token.filter(|_| is_new).or(self.token.take());
        is_new
    }
}

impl Post for Http {
    fn post(&mut self, batch: &Batch, timeout: Duration) -> Posted {
        let encoded = match self.body {
            Body::Json => batch.to_json().map(|body| (body, JSON_TYPE)),
            Body::Binary => batch.to_binary().map(|body| (body, BINARY_TYPE)),
        };
        let (body, content_type) = match encoded {
            Ok(encoded) => encoded,
            Err(error) => return Posted::Refused(400, format!("not encoded: {error}")),
        };
        match self.send(&body, content_type, timeout) {
            // An older collector, which read nothing of this body.
            Ok((UNSUPPORTED_MEDIA_TYPE, _)) if self.body == Body::Binary => {
                self.body = Body::Json;
                self.post(batch, timeout)
            }
            // The collector refuses a token before it reads the body, which can look like a broken connection.
            Ok((UNAUTHORIZED, _)) | Err(_) if self.take_new_token() => self.post(batch, timeout),
            Ok((_, posted)) => posted,
            Err(error) => Posted::Later {
                is_unstored: is_before_sending(&error),
                why: format!("{error}{}", advice::network_hint(&error)),
                retry_after: None,
            },
        }
    }
}

/// Whether nothing can have arrived, because there was no connection.
fn is_before_sending(error: &ureq::Error) -> bool {
    match error {
        ureq::Error::HostNotFound | ureq::Error::ConnectionFailed => true,
        ureq::Error::Io(error) => error.kind() == std::io::ErrorKind::ConnectionRefused,
        _ => false,
    }
}

/// Code and message of a collector's error; `None` for an answer of anything else on the way, for example a proxy.
fn error_of(answer: &[u8]) -> Option<[String; 2]> {
    let answer: serde_json::Value = serde_json::from_slice(answer).ok()?;
    let text = |key| answer["error"][key].as_str().map(str::to_owned);
    Some([text("code")?, text("message").unwrap_or_default()])
}

fn understand(
    (status, error): (u16, Option<[String; 2]>),
    answer: &[u8],
    retry_after: Option<Duration>,
) -> Posted {
    let code = error.as_ref().map(|[code, _]| code.as_str());
    let message = error.as_ref().map(|[_, message]| message.as_bytes());
    let said = excerpt(message.filter(|said| !said.is_empty()).unwrap_or(answer));
    match status {
        200 => match Acknowledgement::from_json(answer) {
            Ok(answer) => Posted::Durable(answer),
            Err(error) => Posted::Later {
                why: format!("answer not understood: {error}"),
                retry_after,
                is_unstored: false,
            },
        },
        TOO_LARGE => Posted::Refused(status, said),
        // 409: another agent has sent different frames under these names.
        409 | 422 if code.is_some_and(|code| OF_CONTENT.contains(&code)) => {
            Posted::Refused(status, said)
        }
        UNAUTHORIZED | 403 => Posted::Forbidden(status, said),
        _ => Posted::Later {
            why: format!("status {status}: {said}"),
            retry_after,
            // Collectors answer these before they store anything; of other answers it is unknown.
            is_unstored: matches!(status, 300..=399 | 404 | 408 | 429 | 503 | 507)
                || matches!(status, 400 | 422) && code.is_some(),
        },
    }
}

/// The start of the answer on one line, without control characters that could disturb a terminal.
fn excerpt(answer: &[u8]) -> String {
    let text = String::from_utf8_lossy(answer.get(..4 * EXCERPT_CHARS).unwrap_or(answer));
    let plain = text.chars().map(|c| if c.is_control() { ' ' } else { c });
    let excerpt: String = plain.take(EXCERPT_CHARS).collect();
    excerpt.trim().to_owned()
}

/// A client with these credentials (except the token) and this time limit per request.
///
/// # Errors
/// The problem with a certificate or key.
pub fn client(credentials: &Credentials, request_timeout: Duration) -> Result<ureq::Agent, String> {
    let config = ureq::Agent::config_builder()
        .timeout_global(Some(request_timeout))
        .timeout_connect(Some(CONNECT_TIMEOUT.min(request_timeout)))
        .http_status_as_error(false)
        .max_redirects(0)
        .max_redirects_will_error(false)
        .max_idle_connections(1)
        // Leave the environment to the caller, and use no proxy between agent and collector.
        .proxy(None)
        .tls_config(tls(credentials)?)
        .user_agent(concat!("grideye-agent/", env!("CARGO_PKG_VERSION")))
        .build();
    Ok(config.new_agent())
}

/// Adds the token, if there is one.
pub fn signed<B>(request: RequestBuilder<B>, token: Option<&Secret>) -> RequestBuilder<B> {
    match token {
        Some(token) => request.header("authorization", format!("Bearer {}", token.reveal())),
        None => request,
    }
}

/// Without an authority, nothing is trusted and every https request fails.
fn tls(credentials: &Credentials) -> Result<TlsConfig, String> {
    let authority = credentials.authority.as_deref();
    let roots = authority.map(certificates).transpose()?.unwrap_or_default();
    let client = credentials.client.as_ref().map(client_certificate);
    Ok(TlsConfig::builder()
        .provider(TlsProvider::Rustls)
        .unversioned_rustls_crypto_provider(Arc::new(default_provider()))
        .root_certs(RootCerts::new_with_certs(&roots))
        .client_cert(client.transpose()?)
        .build())
}

fn client_certificate(client: &ClientCertificate) -> Result<ClientCert, String> {
    let key = PrivateKey::from_pem(client.key.reveal().as_bytes())
        .map_err(|error| format!("the agent's own key: {error}"))?;
    let chain = certificates(&client.chain)?;
    Ok(ClientCert::new_with_certs(&chain, key))
}

fn certificates(pem: &str) -> Result<Vec<Certificate<'static>>, String> {
    let all: Result<Vec<_>, _> = ureq::tls::parse_pem(pem.as_bytes())
        .filter_map(|item| match item {
            Ok(ureq::tls::PemItem::Certificate(certificate)) => Some(Ok(certificate)),
            Ok(_) => None,
            Err(error) => Some(Err(format!("a certificate: {error}"))),
        })
        .collect();
    match all {
        Ok(all) if all.is_empty() => Err("no certificate".to_owned()),
        other => other,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_a_collectors_word_on_the_content_or_a_size_counts_as_rejected() {
        let error = |code: Option<&str>| code.map(|code| [code.to_owned(), String::new()]);
        let kind = |status, code, answer| match understand((status, error(code)), answer, None) {
            Posted::Durable(_) => "durable",
            Posted::Refused(..) => "refused",
            Posted::Forbidden(..) => "forbidden",
            Posted::Later { .. } => "later",
        };
        for (statuses, code, expected) in [
            (&[400, 409, 422][..], None, "later"),
            (&[400, 409, 422], Some("unknown_field"), "later"),
            (&[409, 422], Some("conflict"), "refused"),
            (&[409, 422], Some("wrong_value"), "refused"),
            (&[409, 422], Some("number_too_large"), "refused"),
            (&[413], None, "refused"),
            (&[201, 301, 404, 408, 429, 500, 503], None, "later"),
            (&[401, 403], None, "forbidden"),
        ] {
            for status in statuses {
                assert_eq!(kind(*status, code, b""), expected, "{status} {code:?}");
            }
        }
        assert_eq!(kind(200, None, b"<html>"), "later");
        let found = error_of(br#"{"error":{"code":"conflict","message":"no"}}"#);
        assert_eq!(found, Some(["conflict".to_owned(), "no".to_owned()]));
        assert_eq!(error_of(br#"{"error":"no"}"#), None);
    }

    #[test]
    fn the_collectors_answer_is_cut_and_cannot_move_the_cursor() {
        assert_eq!(excerpt(b"no\x1b[2J\n"), "no [2J");
        assert_eq!(excerpt(&vec![b'x'; 10_000]).len(), 200);
    }
}
