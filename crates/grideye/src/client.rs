//! The collector's HTTP interface as the command line uses it.

use crate::cli::CollectorAddress;
use crate::exit::bad_input;
use crate::files;
use anyhow::{Context as _, Result, anyhow};
use grideye_agent::join::Secret;
use rustls::crypto::ring::default_provider;
use serde::Deserialize;
use std::collections::BTreeMap;
use std::io::{BufRead, BufReader, Read, Write};
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;
use ureq::tls::{Certificate, RootCerts, TlsConfig, TlsProvider};

/// Longest wait for an answer that is not a download.
const ANSWER_TIMEOUT: Duration = Duration::from_secs(30);
/// Longest error answer that is read.
const ERROR_BYTES_MAX: u64 = 64 * 1024;

/// A collector at a base address such as `http://127.0.0.1:8833`.
#[derive(Debug, Clone)]
pub(crate) struct Client {
    base: String,
    agent: ureq::Agent,
    token: Option<Secret>,
}

/// Longest file of a token or an authority, in bytes.
const FILE_BYTES_MAX: u64 = 64 * 1024;

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
    /// Of those, how many were let go again.
    #[serde(default)]
    pub(crate) expired: u64,
    pub(crate) missing: u64,
    pub(crate) dropped: Option<BTreeMap<String, u64>>,
    pub(crate) spooled: Option<u64>,
    pub(crate) balanced: Option<bool>,
}

/// The books as the collector has them.
#[derive(Debug, Clone, Deserialize)]
pub(crate) struct AuditAnswer {
    pub(crate) streams: Vec<AuditRow>,
    #[serde(default)]
    pub(crate) rivals: Vec<Rivals>,
}

/// Several agents that send as one device.
#[derive(Debug, Clone, Deserialize)]
pub(crate) struct Rivals {
    pub(crate) device: String,
    pub(crate) boots: Vec<String>,
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
    /// A client of the collector at `base` that asks for no token; nothing is sent yet.
    pub(crate) fn new(base: &str) -> Self {
        Self::with(base, None, TlsConfig::default())
    }

    /// A client of the collector that the options name, with the token and the authority that they name.
    pub(crate) fn of(options: &CollectorAddress) -> Result<Self> {
        let token = options.token_file.as_deref().map(|path| -> Result<Secret> {
            let text = read(path)?;
            Secret::new(text.trim())
                .map_err(|error| bad_input(anyhow!("{}: {error}\nhint: `grideye token make NAME --scope read --out FILE` writes one", path.display())))
        });
        let authority = options.authority.as_deref().map(|path| {
            let pem = read(path)?;
            Certificate::from_pem(pem.as_bytes()).map_err(|error| {
                bad_input(anyhow!(
                    "{}: {error}\nhint: name the collector's grideye-access/authority.pem",
                    path.display()
                ))
            })
        });
        let authority = authority.transpose()?;
        if authority.is_none() && options.url.starts_with("https://") {
            return Err(bad_input(anyhow!(
                "{} is encrypted, and nobody says whose certificate to believe\nhint: --authority FILE, the collector's grideye-access/authority.pem",
                options.url
            )));
        }
        let roots: Vec<Certificate<'static>> = authority.into_iter().collect();
        let tls = TlsConfig::builder()
            .provider(TlsProvider::Rustls)
            .unversioned_rustls_crypto_provider(Arc::new(default_provider()))
            .root_certs(RootCerts::new_with_certs(&roots))
            .build();
        Ok(Self::with(&options.url, token.transpose()?, tls))
    }

    fn with(base: &str, token: Option<Secret>, tls: TlsConfig) -> Self {
        let config = ureq::Agent::config_builder()
            .http_status_as_error(false)
            .timeout_connect(Some(ANSWER_TIMEOUT))
            .timeout_recv_response(Some(ANSWER_TIMEOUT))
            // A token goes to the collector that was named and to nobody that it points to.
            .max_redirects(0)
            .max_redirects_will_error(false)
            .tls_config(tls)
            .build();
        Self {
            base: base.trim_end_matches('/').to_owned(),
            agent: config.new_agent(),
            token,
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
    pub(crate) fn audit(&self) -> Result<AuditAnswer> {
        self.get("/v1/audit")
    }

    /// Writes a recording as CSV; the number of bytes.
    pub(crate) fn download_csv(&self, id: i64, out: &mut impl Write) -> Result<u64> {
        let path = format!("/v1/recordings/{id}.csv");
        let mut response =
            self.checked(&path, self.signed(self.agent.get(self.url(&path))).call())?;
        let mut body = response.body_mut().with_config().limit(u64::MAX).reader();
        std::io::copy(&mut body, out).with_context(|| format!("the download of {path} broke off"))
    }

    /// What the collector says as it happens, as server-sent events; it says something every few seconds.
    pub(crate) fn live(&self) -> Result<impl BufRead + 'static> {
        let path = "/v1/live";
        let response = self.checked(path, self.signed(self.agent.get(self.url(path))).call())?;
        let body = response.into_body().into_with_config().limit(u64::MAX);
        Ok(BufReader::new(body.reader()))
    }

    fn get<T: serde::de::DeserializeOwned>(&self, path: &str) -> Result<T> {
        let response = self.checked(path, self.signed(self.agent.get(self.url(path))).call())?;
        self.decoded(path, response)
    }

    fn post<T: serde::de::DeserializeOwned>(
        &self,
        path: &str,
        body: &serde_json::Value,
    ) -> Result<T> {
        let response = self.checked(
            path,
            self.signed(self.agent.post(self.url(path))).send_json(body),
        )?;
        self.decoded(path, response)
    }

    fn signed<B>(&self, request: ureq::RequestBuilder<B>) -> ureq::RequestBuilder<B> {
        match &self.token {
            Some(token) => request.header("authorization", format!("Bearer {}", token.reveal())),
            None => request,
        }
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

fn read(path: &Path) -> Result<String> {
    let mut text = String::new();
    files::open(path)?
        .take(FILE_BYTES_MAX)
        .read_to_string(&mut text)
        .map_err(|error| {
            bad_input(anyhow!(
                "{}: {error}\nhint: a short text file is wanted",
                path.display()
            ))
        })?;
    Ok(text)
}
