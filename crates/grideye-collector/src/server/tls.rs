//! TLS 1.3: certificates of our own authority for each local address, or those of the site.

use crate::auth::{AccessFolder, Authority, pin};
use crate::lock::lock;
use crate::server::error::CollectorError;
use rustls::crypto::ring::default_provider;
use rustls::pki_types::pem::PemObject as _;
use rustls::pki_types::{CertificateDer, PrivateKeyDer};
use rustls::server::WebPkiClientVerifier;
use rustls::{RootCertStore, ServerConfig};
use std::collections::HashMap;
use std::error::Error;
use std::fs::File;
use std::io::Read as _;
use std::net::IpAddr;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};
use tokio_rustls::TlsAcceptor;

const PEM_BYTES_MAX: u64 = 1024 * 1024;
/// Local addresses with cached certificates. Beyond this, the cache is emptied.
const ADDRESSES_MAX: usize = 64;

/// The source of the collector's certificates.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Certificates {
    /// The authority in the folder of tokens, created if missing. Agents that join know its pin.
    OwnAuthority,
    /// PEM files from the site's authority: the certificate with its chain, and its key.
    Files {
        /// The certificate, followed by its chain.
        chain: PathBuf,
        /// Its key.
        key: PathBuf,
    },
}

/// The collector's TLS configuration.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Tls {
    /// The server's certificates.
    pub certificates: Certificates,
    /// Authorities in PEM; every client must show a certificate of one. `None`: clients need only a token.
    pub client_authorities: Option<PathBuf>,
}

/// Gives each connection the certificate for the address it came to.
pub(crate) struct Acceptors {
    source: Source,
    client_roots: Option<Arc<RootCertStore>>,
}

enum Source {
    Fixed(TlsAcceptor),
    Authority {
        authority: Box<Authority>,
        names: Vec<String>,
        made: Mutex<HashMap<IpAddr, TlsAcceptor>>,
    },
}

impl Acceptors {
    /// Loads or creates the certificates. Those created here include `host_names`.
    pub(crate) fn new(
        tls: &Tls,
        access: Option<&AccessFolder>,
        host_names: &[String],
    ) -> Result<Self, CollectorError> {
        let client_roots = tls
            .client_authorities
            .as_deref()
            .map(client_roots)
            .transpose()?;
        let source = match (&tls.certificates, access) {
            (Certificates::Files { chain, key }, _) => {
                let config = config(
                    certificates(chain)?,
                    private_key(key)?,
                    client_roots.as_ref(),
                )
                .map_err(|error| {
                    refuse(chain, format!("with the key {}: {error}", key.display()))
                })?;
                Source::Fixed(TlsAcceptor::from(config))
            }
            (Certificates::OwnAuthority, Some(access)) => Source::Authority {
                authority: Box::new(access.authority()?),
                names: host_names.to_vec(),
                made: Mutex::default(),
            },
            (Certificates::OwnAuthority, None) => return Err(CollectorError::NoAuthority),
        };
        Ok(Self {
            source,
            client_roots,
        })
    }

    /// The pin of our own authority, for logs; `None` with the site's certificates.
    pub(crate) fn pin(&self) -> Option<String> {
        match &self.source {
            Source::Fixed(_) => None,
            Source::Authority { authority, .. } => Some(authority.pin()),
        }
    }

    /// For a connection that came to this local address.
    pub(crate) fn for_address(&self, address: IpAddr) -> Result<TlsAcceptor, CollectorError> {
        let (authority, names, made) = match &self.source {
            Source::Fixed(acceptor) => return Ok(acceptor.clone()),
            Source::Authority {
                authority,
                names,
                made,
            } => (authority, names, made),
        };
        let address = address.to_canonical();
        let mut made = lock(made);
        if let Some(acceptor) = made.get(&address) {
            return Ok(acceptor.clone());
        }
        let mut all = vec![address.to_string(), "localhost".to_owned()];
        all.extend(names.iter().cloned());
        let signed = authority.sign(&all)?;
        let config = config(signed.chain, signed.key, self.client_roots.as_ref())
            .map_err(|error| CollectorError::Tls(error.to_string()))?;
        if made.len() >= ADDRESSES_MAX {
            made.clear();
        }
        let acceptor = TlsAcceptor::from(config);
        made.insert(address, acceptor.clone());
        Ok(acceptor)
    }
}

/// The pin of the last certificate in a file, which ends the chain.
///
/// # Errors
/// [`CollectorError::TlsFile`] if there is none.
pub fn pin_of_file(path: &Path) -> Result<String, CollectorError> {
    let all = certificates(path)?;
    let last = all.last().ok_or_else(|| no_certificate(path))?;
    Ok(pin(last))
}

fn config(
    chain: Vec<CertificateDer<'static>>,
    key: PrivateKeyDer<'static>,
    client_roots: Option<&Arc<RootCertStore>>,
) -> Result<Arc<ServerConfig>, Box<dyn Error>> {
    let provider = Arc::new(default_provider());
    let builder = ServerConfig::builder_with_provider(Arc::clone(&provider))
        .with_protocol_versions(&[&rustls::version::TLS13])?;
    let builder = match client_roots {
        None => builder.with_no_client_auth(),
        Some(roots) => builder.with_client_cert_verifier(
            WebPkiClientVerifier::builder_with_provider(Arc::clone(roots), provider).build()?,
        ),
    };
    let mut config = builder.with_single_cert(chain, key)?;
    config.alpn_protocols = vec![b"http/1.1".to_vec()];
    Ok(Arc::new(config))
}

fn client_roots(path: &Path) -> Result<Arc<RootCertStore>, CollectorError> {
    let mut roots = RootCertStore::empty();
    for certificate in certificates(path)? {
        roots
            .add(certificate)
            .map_err(|error| refuse(path, error.to_string()))?;
    }
    Ok(Arc::new(roots))
}

fn certificates(path: &Path) -> Result<Vec<CertificateDer<'static>>, CollectorError> {
    let pem = read(path)?;
    let all: Result<Vec<_>, _> = CertificateDer::pem_slice_iter(&pem).collect();
    let all = all.map_err(|error| refuse(path, error.to_string()))?;
    if all.is_empty() {
        return Err(no_certificate(path));
    }
    Ok(all)
}

fn private_key(path: &Path) -> Result<PrivateKeyDer<'static>, CollectorError> {
    PrivateKeyDer::from_pem_slice(&read(path)?)
        .map_err(|error| refuse(path, format!("no private key: {error}")))
}

fn read(path: &Path) -> Result<Vec<u8>, CollectorError> {
    let mut pem = Vec::new();
    File::open(path)
        .and_then(|file| file.take(PEM_BYTES_MAX).read_to_end(&mut pem))
        .map_err(|error| refuse(path, error.to_string()))?;
    Ok(pem)
}

fn no_certificate(path: &Path) -> CollectorError {
    refuse(path, "no certificate in it")
}

fn refuse(path: &Path, what: impl Into<String>) -> CollectorError {
    CollectorError::TlsFile {
        path: path.to_owned(),
        what: what.into(),
    }
}
