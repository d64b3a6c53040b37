//! The collector's HTTP interface as the command line uses it.

use anyhow::{Context as _, Result, anyhow};
use serde::Deserialize;
use std::collections::BTreeMap;
use std::io::{Read, Write};
use std::time::Duration;

/// Longest wait for an answer that is not a download.
const ANSWER_TIMEOUT: Duration = Duration::from_secs(30);
/// Longest error answer that is read.
const ERROR_BYTES_MAX: u64 = 64 * 1024;

/// A collector at a base address such as `http://127.0.0.1:8833`.
#[derive(Debug, Clone)]
pub(crate) struct Client {
    base: String,
    agent: ureq::Agent,
}

/// A recording as the collector lists it.
#[derive(Debug, Clone, Deserialize)]
pub(crate) struct Recording {
    pub(crate) id: i64,
    pub(crate) name: String,
    #[serde(default)]
    pub(crate) frames: u64,
}

/// The count of one stream, agent's and collector's together.
#[derive(Debug, Clone, Deserialize, serde::Serialize)]
pub(crate) struct AuditRow {
    pub(crate) device: String,
    pub(crate) sensor: String,
    pub(crate) boot: String,
    /// `None`, as are the other counts of the agent, for frames that came without a count.
    pub(crate) read: Option<u64>,
    pub(crate) stored: u64,
    pub(crate) missing: u64,
    pub(crate) dropped: Option<BTreeMap<String, u64>>,
    pub(crate) spooled: Option<u64>,
    pub(crate) balanced: Option<bool>,
}

impl AuditRow {
    /// Frames dropped for any reason.
    pub(crate) fn dropped_total(&self) -> u64 {
        self.dropped.iter().flat_map(BTreeMap::values).sum()
    }
}

#[derive(Deserialize)]
struct ErrorAnswer {
    error: ErrorBody,
}

#[derive(Deserialize)]
struct ErrorBody {
    message: String,
    #[serde(default)]
    hint: Option<String>,
}

impl Client {
    /// A client of the collector at `base`; nothing is sent yet.
    pub(crate) fn new(base: &str) -> Self {
        let config = ureq::Agent::config_builder()
            .http_status_as_error(false)
            .timeout_connect(Some(ANSWER_TIMEOUT))
            .timeout_recv_response(Some(ANSWER_TIMEOUT))
            .build();
        Self {
            base: base.trim_end_matches('/').to_owned(),
            agent: config.new_agent(),
        }
    }

    /// Starts a recording of everything that arrives.
    pub(crate) fn start_recording(&self, name: &str) -> Result<Recording> {
        self.post("/v1/recordings", &serde_json::json!({ "name": name }))
    }

    /// Ends a recording.
    pub(crate) fn stop_recording(&self, id: i64) -> Result<Recording> {
        self.post(&format!("/v1/recordings/{id}/stop"), &serde_json::json!({}))
    }

    /// The count of every stream that the collector knows.
    pub(crate) fn audit(&self) -> Result<Vec<AuditRow>> {
        #[derive(Deserialize)]
        struct Audit {
            streams: Vec<AuditRow>,
        }
        let audit: Audit = self.get("/v1/audit")?;
        Ok(audit.streams)
    }

    /// Writes a recording as CSV; the number of bytes.
    pub(crate) fn download_csv(&self, id: i64, out: &mut impl Write) -> Result<u64> {
        let path = format!("/v1/recordings/{id}.csv");
        let mut response = self.checked(&path, self.agent.get(self.url(&path)).call())?;
        let mut body = response.body_mut().with_config().limit(u64::MAX).reader();
        std::io::copy(&mut body, out).with_context(|| format!("the download of {path} broke off"))
    }

    fn get<T: serde::de::DeserializeOwned>(&self, path: &str) -> Result<T> {
        let response = self.checked(path, self.agent.get(self.url(path)).call())?;
        self.decoded(path, response)
    }

    fn post<T: serde::de::DeserializeOwned>(
        &self,
        path: &str,
        body: &serde_json::Value,
    ) -> Result<T> {
        let response = self.checked(path, self.agent.post(self.url(path)).send_json(body))?;
        self.decoded(path, response)
    }

    fn url(&self, path: &str) -> String {
        format!("{}{path}", self.base)
    }

    fn decoded<T: serde::de::DeserializeOwned>(
        &self,
        path: &str,
        mut response: ureq::http::Response<ureq::Body>,
    ) -> Result<T> {
        response.body_mut().read_json().with_context(|| {
            format!(
                "{}{path} answered something else than a collector does",
                self.base
            )
        })
    }

    /// The response, if it is a success; otherwise the collector's own words.
    fn checked(
        &self,
        path: &str,
        result: Result<ureq::http::Response<ureq::Body>, ureq::Error>,
    ) -> Result<ureq::http::Response<ureq::Body>> {
        let mut response = result.map_err(|error| {
            anyhow!(
                "no answer from the collector at {}: {error}\nhint: start one with `grideye collect`, or name it with --collector",
                self.base
            )
        })?;
        if response.status().is_success() {
            return Ok(response);
        }
        let status = response.status();
        let mut text = String::new();
        response
            .body_mut()
            .as_reader()
            .take(ERROR_BYTES_MAX)
            .read_to_string(&mut text)?;
        Err(match serde_json::from_str::<ErrorAnswer>(&text) {
            Ok(ErrorAnswer { error }) => {
                let hint = error
                    .hint
                    .map(|hint| format!("\nhint: {hint}"))
                    .unwrap_or_default();
                anyhow!("{}{hint}", error.message)
            }
            Err(_) => anyhow!("{}{path} answered {status}", self.base),
        })
    }
}
