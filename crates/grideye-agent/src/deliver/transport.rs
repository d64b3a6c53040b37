//! HTTP with the collector: time limits, and TLS with the one authority that is believed.

use crate::join::{ClientCertificate, Credentials, Secret};
use rustls::crypto::ring::default_provider;
use std::sync::Arc;
use std::time::Duration;
use ureq::RequestBuilder;
use ureq::tls::{Certificate, ClientCert, PrivateKey, RootCerts, TlsConfig, TlsProvider};

/// How long connecting may take, beside the time for the whole request.
const CONNECT_TIMEOUT: Duration = Duration::from_secs(5);

/// A client that shows these credentials, token excepted, and gives up a request after so long.
///
/// # Errors
/// What is wrong with a certificate or a key.
pub fn client(credentials: &Credentials, request_timeout: Duration) -> Result<ureq::Agent, String> {
    let config = ureq::Agent::config_builder()
        .timeout_global(Some(request_timeout))
        .timeout_connect(Some(CONNECT_TIMEOUT.min(request_timeout)))
        .http_status_as_error(false)
        .max_redirects(0)
        .max_redirects_will_error(false)
        .max_idle_connections(1)
        // The environment is the caller's business, and a proxy between agent and collector is not asked for.
        .proxy(None)
        .tls_config(tls(credentials)?)
        .user_agent(concat!("grideye-agent/", env!("CARGO_PKG_VERSION")))
        .build();
    Ok(config.new_agent())
}

/// The request with this token, if there is one.
pub fn signed<B>(request: RequestBuilder<B>, token: Option<&Secret>) -> RequestBuilder<B> {
    match token {
        Some(token) => request.header("authorization", format!("Bearer {}", token.reveal())),
        None => request,
    }
}

/// Without an authority nobody is believed, and https goes nowhere.
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
    Ok(ClientCert::new_with_certs(
        &certificates(&client.chain)?,
        key,
    ))
}

fn certificates(pem: &str) -> Result<Vec<Certificate<'static>>, String> {
    let all: Result<Vec<_>, _> = ureq::tls::parse_pem(pem.as_bytes())
        .filter_map(|item| match item {
            Ok(ureq::tls::PemItem::Certificate(certificate)) => Some(Ok(certificate)),
            Ok(_) => None,
            Err(error) => Some(Err(error.to_string())),
        })
        .collect();
    match all {
        Ok(all) if all.is_empty() => Err("no certificate".to_owned()),
        other => other.map_err(|error| format!("a certificate: {error}")),
    }
}
