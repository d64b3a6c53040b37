//! HTTP with the collector: time limits, and TLS with the one authority that is believed.

use crate::join::{ClientCertificate, Credentials};
use rustls::crypto::ring::default_provider;
use std::io;
use std::sync::Arc;
use std::time::Duration;
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

/// What a person can do where no answer came.
/// Begins with a line break; empty where there is nothing to say.
#[must_use]
pub fn hint(error: &ureq::Error) -> &'static str {
    use std::io::ErrorKind;
    match error {
        ureq::Error::HostNotFound => NAME_HINT,
        // The resolver's failures are an `io::Error` without a number or a kind of their own.
        ureq::Error::Io(error) if error.to_string().contains("lookup") => NAME_HINT,
        ureq::Error::Io(error) if error.kind() == ErrorKind::ConnectionRefused => {
            "\nhint: is `grideye collect` running there, on this port? On its own it listens on loopback alone; other machines \
             reach it with --listen 0.0.0.0:8833, and this agent joins it with the line that `grideye enroll DEVICE` prints"
        }
        // What the handshake fails with comes as an `io::Error` too.
        ureq::Error::Io(error) if in_handshake(error).is_some() => in_handshake(error)
            .and_then(certificate_hint)
            .unwrap_or(TLS_HINT),
        ureq::Error::Io(_) | ureq::Error::Timeout(_) | ureq::Error::ConnectionFailed => {
            "\nhint: is the network up, is this the collector's address, and does its firewall let the port through?"
        }
        ureq::Error::Rustls(error) => certificate_hint(error).unwrap_or(TLS_HINT),
        ureq::Error::Tls(_) => TLS_HINT,
        _ => "",
    }
}

/// What TLS says, where that is why reading or writing failed.
pub(crate) fn in_handshake(error: &io::Error) -> Option<&rustls::Error> {
    error.get_ref()?.downcast_ref()
}

/// What a person can do about a certificate of the right authority that is refused all the same. Begins with a line break.
pub(crate) fn certificate_hint(error: &rustls::Error) -> Option<&'static str> {
    use rustls::CertificateError as Refused;
    let rustls::Error::InvalidCertificate(refused) = error else {
        return None;
    };
    match refused {
        Refused::Expired
        | Refused::ExpiredContext { .. }
        | Refused::NotValidYet
        | Refused::NotValidYetContext { .. } => Some(CLOCK_HINT),
        Refused::NotValidForName | Refused::NotValidForNameContext { .. } => {
            Some(CERTIFICATE_NAME_HINT)
        }
        _ => None,
    }
}

const CLOCK_HINT: &str = "\nhint: what this machine's clock says decides that: see `timedatectl`. A Raspberry Pi has no battery clock, \
     and wants a network with NTP; if the clock is right, the collector needs a certificate that is valid now";
const CERTIFICATE_NAME_HINT: &str = "\nhint: the collector's certificate is for another name than the agent calls it by: start it with \
     `--host-name NAME`, or print a line with a name that stands in it: `grideye enroll DEVICE --url https://NAME:PORT`";
const TLS_HINT: &str = "\nhint: the collector must show a certificate of the authority that this agent joined; if that was made anew, join again";
const NAME_HINT: &str = "\nhint: is the host's name right, and the network up? An address such as 192.168.1.20 needs no name";
