//! The collector's HTTP interface as the command line uses it.

use crate::cli::CollectorAddress;
use crate::exit::bad_input;
use crate::files;
use anyhow::{Context as _, Result, anyhow};
use grideye_agent::deliver::signed;
use grideye_agent::join::Secret;
use grideye_collector::Accounts;
use grideye_recording::printable;
use grideye_recording::wire::{Acknowledgement, Batch};
use rustls::crypto::ring::default_provider;
use serde::Deserialize;
use serde::de::DeserializeOwned;
use serde_json::{Value, json};
use std::fmt::Display;
use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;
use ureq::tls::{Certificate, RootCerts, TlsConfig, TlsProvider};
use ureq::{Body, http};

/// Longest wait for an answer, downloads aside.
const ANSWER_TIMEOUT: Duration = Duration::from_secs(30);
/// Largest error answer, token or authority.
const BYTES_MAX: u64 = 64 * 1024;

#[derive(Debug, Clone)]
pub(crate) struct Client {
    base: String,
    agent: ureq::Agent,
    token: Option<Secret>,
}

#[derive(Debug, Clone, Deserialize)]
pub(crate) struct Recording {
    pub(crate) id: i64,
    pub(crate) name: String,
    #[serde(default)]
    pub(crate) frames: u64,
    #[serde(default)]
    pub(crate) missing: u64,
}

const TOKEN_HINT: &str = "--token-file FILE; `grideye token make NAME --scope read --out FILE` makes one, and `--scope admin` one that may record";

type Response = http::Response<Body>;

impl Client {
    /// A client of a collector that requires no token. Sends nothing yet.
    pub(crate) fn new(base: &str) -> Self {
        Self::with(base, None, TlsConfig::default())
    }

    pub(crate) fn of(options: &CollectorAddress) -> Result<Self> {
        let (_, host) = options.url.split_once("://").unwrap_or_default();
        if host.trim_end_matches('/').contains('/') || !options.url.starts_with("http") {
            return Err(bad_input(anyhow!(
                "--collector is {}, expected http://HOST:PORT or https://HOST:PORT\nhint: `grideye collect` prints its address as it starts",
                options.url
            )));
        }
        let named = |path: &Path, error: &dyn Display, hint: &str| {
            bad_input(anyhow!("{}: {error}\nhint: {hint}", path.display()))
        };
        let token = options.token_file.as_deref().map(|path| {
            let hint = "`grideye token make NAME --scope read --out FILE` writes one";
            let text = files::short(path, BYTES_MAX)?;
            let token = Secret::new(String::from_utf8_lossy(&text).trim());
            token.map_err(|error| named(path, &error, hint))
        });
        let authority = options.authority.as_deref().map(|path| {
            let hint = "name the collector's grideye-access/authority.pem";
            let authority = Certificate::from_pem(&files::short(path, BYTES_MAX)?);
            authority.map_err(|error| named(path, &error, hint))
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
            // The token goes only to the given collector, never to a host that it redirects to.
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

    pub(crate) fn start_recording(&self, name: &str) -> Result<Recording> {
        self.post("/v1/recordings", &json!({ "name": name }))
    }

    pub(crate) fn stop_recording(&self, id: i64) -> Result<Recording> {
        self.post(&format!("/v1/recordings/{id}/stop"), &json!({}))
    }

    /// Posts records as an agent does.
    pub(crate) fn deliver(&self, batch: &Batch) -> Result<Acknowledgement> {
        self.post("/v1/frames", &serde_json::to_value(batch)?)
    }

    /// Keeps the collector from ending the recording as abandoned.
    pub(crate) fn renew_recording(&self, id: i64) -> Result<Value> {
        self.post(&format!("/v1/recordings/{id}/renew"), &json!({}))
    }

    pub(crate) fn recordings(&self) -> Result<Vec<Recording>> {
        #[derive(Deserialize)]
        struct All {
            recordings: Vec<Recording>,
        }
        let path = "/v1/recordings";
        let all: All = self.decoded(path, self.get(path)?)?;
        Ok(all.recordings)
    }

    pub(crate) fn delete_recording(&self, id: i64) -> Result<()> {
        let path = format!("/v1/recordings/{id}");
        let request = signed(self.agent.delete(self.url(&path)), self.token.as_ref());
        self.checked(&path, request.call()).map(drop)
    }

    pub(crate) fn audit(&self) -> Result<Accounts> {
        let path = "/v1/audit";
        self.decoded(path, self.get(path)?)
    }

    pub(crate) fn download_csv(&self, id: i64, out: &mut impl Write) -> Result<()> {
        let path = format!("/v1/recordings/{id}.csv");
        let body = self.get(&path)?.into_body().into_with_config();
        std::io::copy(&mut body.limit(u64::MAX).reader(), out)
            .with_context(|| format!("the download of {path} broke off"))?;
        Ok(())
    }

    /// The collector's server-sent events, at least one every few seconds.
    pub(crate) fn live(&self) -> Result<impl BufRead + 'static> {
        let body = self.get("/v1/live")?.into_body().into_with_config();
        Ok(BufReader::new(body.limit(u64::MAX).reader()))
    }

    fn get(&self, path: &str) -> Result<Response> {
        let request = signed(self.agent.get(self.url(path)), self.token.as_ref());
        self.checked(path, request.call())
    }

    fn post<T: DeserializeOwned>(&self, path: &str, body: &Value) -> Result<T> {
        let request = signed(self.agent.post(self.url(path)), self.token.as_ref());
        self.decoded(path, self.checked(path, request.send_json(body))?)
    }

    fn url(&self, path: &str) -> String {
        format!("{}{path}", self.base)
    }

    fn decoded<T: DeserializeOwned>(&self, path: &str, mut response: Response) -> Result<T> {
        response.body_mut().read_json().with_context(|| {
            let url = self.url(path);
            format!("{url} answered something else than a collector does\nhint: is this the address of `grideye collect`?")
        })
    }

    /// The response if it is a success, else the collector's error.
    fn checked(&self, path: &str, result: Result<Response, ureq::Error>) -> Result<Response> {
        let mut response = result.map_err(|error| self.unanswered(&error))?;
        let status = response.status();
        if status.is_success() {
            return Ok(response);
        }
        let body = response.body_mut().with_config().limit(BYTES_MAX);
        let answer: Value = body.read_json().unwrap_or_default();
        let error = &answer["error"];
        let hint = match status {
            http::StatusCode::UNAUTHORIZED => Some(TOKEN_HINT),
            _ => error["hint"].as_str(),
        };
        let hint = hint.unwrap_or("is this the address of `grideye collect`?");
        Err(match error["message"].as_str() {
            Some(message) => anyhow!("{}\nhint: {}", printable(message), printable(hint)),
            None => anyhow!("{} answered {status}\nhint: {hint}", self.url(path)),
        })
    }

    /// The reason for a missing answer, with a hint.
    fn unanswered(&self, error: &ureq::Error) -> anyhow::Error {
        let base = &self.base;
        let tls = match error {
            ureq::Error::Io(error) => error.get_ref().and_then(|error| error.downcast_ref()),
            ureq::Error::Rustls(error) => Some(error),
            _ => None,
        };
        match (error, tls) {
            (_, Some(rustls::Error::InvalidMessage(_))) => anyhow!(
                "the collector at {base} speaks plain HTTP, not TLS\nhint: --collector http://{}",
                base.trim_start_matches("https://")
            ),
            (_, Some(rustls::Error::InvalidCertificate(_))) => anyhow!(
                "cannot trust the certificate of {base}: {error}\nhint: --authority FILE is the grideye-access/authority.pem of this collector; a name that its certificate lacks is added with `grideye collect --host-name NAME`"
            ),
            (ureq::Error::Protocol(_), None) => anyhow!(
                "{base} does not answer in plain HTTP: it speaks TLS, or is no collector\nhint: --collector https://{} --authority FILE, the collector's grideye-access/authority.pem",
                base.trim_start_matches("http://")
            ),
            _ => anyhow!(
                "no answer from the collector at {base}: {error}\nhint: start one with `grideye collect`, or name it with --collector"
            ),
        }
    }
}
