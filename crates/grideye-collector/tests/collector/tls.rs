//! TLS on real sockets: what clients trust, who is admitted, and that nothing else is offered.

use crate::socket::{PATIENCE, Running, anywhere, at};
use grideye_collector::auth::{AccessFolder, Scope, Token};
use grideye_collector::{Certificates, Collector, CollectorError, Config, StoreLocation, Tls};
use rcgen::{BasicConstraints, CertificateParams, IsCa, Issuer, KeyPair};
use rustls::pki_types::pem::PemObject as _;
use rustls::pki_types::{CertificateDer, PrivateKeyDer, ServerName};
use rustls::{ClientConfig, RootCertStore};
use std::net::SocketAddr;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpStream;
use tokio_rustls::TlsConnector;

pub(crate) struct Place {
    folder: AccessFolder,
    around: tempfile::TempDir,
}

impl Place {
    pub(crate) fn new() -> Self {
        let around = tempfile::tempdir().unwrap();
        Self {
            folder: AccessFolder::new(around.path().join("access")),
            around,
        }
    }

    pub(crate) fn token(&self, scope: Scope) -> Token {
        self.folder
            .change(|book| book.add("ana", scope, 1))
            .unwrap()
    }

    pub(crate) fn config(&self, listen: SocketAddr, tls: Option<Tls>) -> Config {
        Config {
            access: Some(self.folder.clone()),
            tls,
            ..at(listen, StoreLocation::Memory)
        }
    }

    pub(crate) fn encrypted(&self) -> Config {
        self.config(anywhere(), Some(own()))
    }

    pub(crate) fn authority(&self) -> String {
        self.folder
            .authority()
            .unwrap()
            .certificate_pem()
            .to_owned()
    }

    fn file(&self, name: &str, text: &str) -> PathBuf {
        let path = self.around.path().join(name);
        std::fs::write(&path, text).unwrap();
        path
    }
}

fn own() -> Tls {
    Tls {
        certificates: Certificates::OwnAuthority,
        client_authorities: None,
    }
}

fn roots(authority: &str) -> RootCertStore {
    let mut roots = RootCertStore::empty();
    roots
        .add(CertificateDer::from_pem_slice(authority.as_bytes()).unwrap())
        .unwrap();
    roots
}

pub(crate) fn believing(authority: &str) -> ClientConfig {
    let provider = Arc::new(rustls::crypto::ring::default_provider());
    ClientConfig::builder_with_provider(provider)
        .with_safe_default_protocol_versions()
        .unwrap()
        .with_root_certificates(roots(authority))
        .with_no_client_auth()
}

/// One request over TLS; returns the whole response, or the error.
pub(crate) async fn ask(
    address: SocketAddr,
    config: ClientConfig,
    name: &str,
    request: &str,
) -> Result<String, String> {
    let asked = async {
        let stream = TcpStream::connect(address).await?;
        let name = ServerName::try_from(name.to_owned()).unwrap();
        let mut stream = TlsConnector::from(Arc::new(config))
            .connect(name, stream)
            .await?;
        stream.write_all(request.as_bytes()).await?;
        let mut answer = Vec::new();
        stream.read_to_end(&mut answer).await?;
        Ok::<_, std::io::Error>(String::from_utf8_lossy(&answer).into_owned())
    };
    tokio::time::timeout(PATIENCE, asked)
        .await
        .expect("no answer and no end")
        .map_err(|error| error.to_string())
}

pub(crate) fn get_once(path: &str, more: &str) -> String {
    format!("GET {path} HTTP/1.1\r\nhost: 127.0.0.1\r\nconnection: close\r\n{more}\r\n")
}

#[tokio::test]
async fn beyond_loopback_tokens_and_tls_are_there_or_nothing_is() {
    let everywhere = SocketAddr::from(([0, 0, 0, 0], 0));
    let place = Place::new();
    let refused = |config: Config| async {
        let error = Collector::bind(config).await.err().unwrap();
        let text = error.to_string();
        assert!(text.contains("\nhint: "), "{text}");
        (error, text)
    };
    let (error, text) = refused(place.config(everywhere, Some(own()))).await;
    assert!(matches!(error, CollectorError::NoTokens { .. }));
    assert!(text.contains("grideye enroll DEVICE"), "{text}");
    assert!(
        !place.folder.path().exists(),
        "a rejected start creates no authority"
    );
    let (error, _) = refused(at(everywhere, StoreLocation::Memory)).await;
    assert!(matches!(error, CollectorError::NoTokens { .. }));
    place.token(Scope::Read);
    let (error, text) = refused(place.config(everywhere, None)).await;
    assert!(matches!(error, CollectorError::NoTls { .. }));
    assert!(text.contains("--trust-network"), "{text}");
    Collector::bind(place.config(everywhere, Some(own())))
        .await
        .unwrap();
    let trusted = Config {
        network_trusted: true,
        ..place.config(everywhere, None)
    };
    Collector::bind(trusted).await.unwrap();
}

#[tokio::test]
async fn clients_that_trust_the_authority_are_served_and_the_cookie_is_never_sent_in_the_clear() {
    let place = Place::new();
    let token = place.token(Scope::Read);
    let server = Running::new(place.encrypted()).await;
    let authority = place.authority();
    let bearer = format!("authorization: Bearer {}\r\n", token.reveal());
    let request = get_once("/v1/sensors", &bearer);
    for name in ["127.0.0.1", "localhost"] {
        let answer = ask(server.address, believing(&authority), name, &request)
            .await
            .unwrap();
        assert!(answer.starts_with("HTTP/1.1 200"), "{answer}");
    }
    let body = format!("{{\"token\":\"{}\"}}", token.reveal());
    let login = format!(
        "POST /v1/login HTTP/1.1\r\nhost: 127.0.0.1\r\norigin: https://127.0.0.1\r\nconnection: close\r\ncontent-length: {}\r\n\r\n{body}",
        body.len()
    );
    let answer = ask(server.address, believing(&authority), "127.0.0.1", &login)
        .await
        .unwrap();
    let set = answer
        .lines()
        .find_map(|line| line.strip_prefix("set-cookie: "))
        .unwrap();
    assert!(
        set.starts_with("__Host-grideye-session=") && set.contains("; Secure"),
        "{set}"
    );
    let plain = login.replace("origin: https", "origin: http");
    let answer = ask(server.address, believing(&authority), "127.0.0.1", &plain)
        .await
        .unwrap();
    assert!(
        answer.starts_with("HTTP/1.1 403"),
        "a plain HTTP origin is foreign: {answer}"
    );
    server.stop().await;
}

#[tokio::test]
async fn a_wrong_authority_a_wrong_name_and_plain_http_all_fail() {
    let place = Place::new();
    place.token(Scope::Read);
    let server = Running::new(place.encrypted()).await;
    let request = get_once("/healthz", "");
    let other = Place::new().authority();
    let error = ask(server.address, believing(&other), "127.0.0.1", &request)
        .await
        .unwrap_err();
    assert!(error.contains("invalid peer certificate"), "{error}");
    for name in ["pc.local", "127.0.0.2"] {
        let authority = believing(&place.authority());
        let error = ask(server.address, authority, name, &request)
            .await
            .unwrap_err();
        assert!(error.contains("not valid for name"), "{error}");
    }
    let mut plain = TcpStream::connect(server.address).await.unwrap();
    plain.write_all(request.as_bytes()).await.unwrap();
    let mut answer = Vec::new();
    let _ = plain.read_to_end(&mut answer).await;
    assert!(!String::from_utf8_lossy(&answer).contains("HTTP/1.1 200"));
    server.stop().await;
}

#[tokio::test]
async fn a_name_that_it_answers_for_stands_in_its_certificate() {
    let place = Place::new();
    place.token(Scope::Read);
    let config = Config {
        host_names: vec!["pc.local".to_owned(), "10.0.2.2".to_owned()],
        ..place.encrypted()
    };
    let server = Running::new(config).await;
    for name in ["pc.local", "10.0.2.2"] {
        let request = get_once("/healthz", "").replace("host: 127.0.0.1", &format!("host: {name}"));
        let answer = ask(
            server.address,
            believing(&place.authority()),
            name,
            &request,
        )
        .await;
        assert!(answer.unwrap().starts_with("HTTP/1.1 200"));
    }
    server.stop().await;
}

#[tokio::test]
async fn a_handshake_that_does_not_come_to_an_end_is_cut_off_and_counted() {
    let place = Place::new();
    let token = place.token(Scope::Read);
    let mut config = place.encrypted();
    config.limits.header_time_max = Duration::from_millis(200);
    let server = Running::new(config).await;
    let began = Instant::now();
    let mut silent = TcpStream::connect(server.address).await.unwrap();
    let mut half = TcpStream::connect(server.address).await.unwrap();
    // The start of a ClientHello that announces more.
    half.write_all(&[22, 3, 1, 2, 0, 1, 0]).await.unwrap();
    for stream in [&mut silent, &mut half] {
        let mut rest = Vec::new();
        let _ = tokio::time::timeout(PATIENCE, stream.read_to_end(&mut rest))
            .await
            .unwrap();
    }
    assert!(began.elapsed() >= Duration::from_millis(200));
    let bearer = format!("authorization: Bearer {}\r\n", token.reveal());
    let health = get_once("/v1/health", &bearer);
    let answer = ask(
        server.address,
        believing(&place.authority()),
        "127.0.0.1",
        &health,
    )
    .await;
    let answer = answer.unwrap();
    assert!(answer.contains("\"tls_failed\":2"), "{answer}");
    server.stop().await;
}

/// A site's authority and its signatures.
struct Site {
    pem: String,
    params: CertificateParams,
    key: KeyPair,
}

impl Site {
    fn new() -> Self {
        let key = KeyPair::generate().unwrap();
        let mut params = CertificateParams::new(vec![]).unwrap();
        params.is_ca = IsCa::Ca(BasicConstraints::Unconstrained);
        let pem = params.self_signed(&key).unwrap().pem();
        Self { pem, params, key }
    }

    /// Certificate and key, in PEM.
    fn sign(&self, name: &str) -> (String, String) {
        let key = KeyPair::generate().unwrap();
        let issuer = Issuer::from_params(&self.params, &self.key);
        let params = CertificateParams::new(vec![name.to_owned()]).unwrap();
        let certificate = params.signed_by(&key, &issuer).unwrap();
        (certificate.pem(), key.serialize_pem())
    }
}

#[tokio::test]
async fn a_fleets_clients_show_a_certificate_of_its_authority_beside_the_token() {
    let (place, site, stranger) = (Place::new(), Site::new(), Site::new());
    let token = place.token(Scope::Read);
    let tls = Tls {
        client_authorities: Some(place.file("clients.pem", &site.pem)),
        ..own()
    };
    let server = Running::new(place.config(anywhere(), Some(tls))).await;
    let authority = place.authority();
    let bearer = format!("authorization: Bearer {}\r\n", token.reveal());
    let request = get_once("/v1/sensors", &bearer);
    let showing = |site: &Site| {
        let (certificate, key) = site.sign("pi-1");
        let provider = Arc::new(rustls::crypto::ring::default_provider());
        ClientConfig::builder_with_provider(provider)
            .with_safe_default_protocol_versions()
            .unwrap()
            .with_root_certificates(roots(&authority))
            .with_client_auth_cert(
                vec![CertificateDer::from_pem_slice(certificate.as_bytes()).unwrap()],
                PrivateKeyDer::from_pem_slice(key.as_bytes()).unwrap(),
            )
            .unwrap()
    };
    let address = server.address;
    let answer = ask(address, showing(&site), "127.0.0.1", &request)
        .await
        .unwrap();
    assert!(answer.starts_with("HTTP/1.1 200"), "{answer}");
    let no_token = ask(
        address,
        showing(&site),
        "127.0.0.1",
        &get_once("/v1/sensors", ""),
    )
    .await;
    assert!(
        no_token.unwrap().starts_with("HTTP/1.1 401"),
        "both are required"
    );
    for config in [believing(&authority), showing(&stranger)] {
        let refused = ask(address, config, "127.0.0.1", &request).await;
        assert!(
            !refused
                .as_ref()
                .is_ok_and(|answer| answer.contains("HTTP/1.1")),
            "{refused:?}"
        );
    }
    server.stop().await;
}

#[tokio::test]
async fn the_sites_own_certificate_is_shown_and_a_wrong_file_is_named() {
    let (place, site) = (Place::new(), Site::new());
    let (certificate, key) = site.sign("127.0.0.1");
    let chain = place.file("chain.pem", &format!("{certificate}{}", site.pem));
    let key = place.file("key.pem", &key);
    let tls = |chain: &Path, key: &Path| Tls {
        certificates: Certificates::Files {
            chain: chain.to_owned(),
            key: key.to_owned(),
        },
        client_authorities: None,
    };
    let server = Running::new(place.config(anywhere(), Some(tls(&chain, &key)))).await;
    let answer = ask(
        server.address,
        believing(&site.pem),
        "127.0.0.1",
        &get_once("/healthz", ""),
    )
    .await;
    assert!(answer.unwrap().starts_with("HTTP/1.1 200"));
    assert!(
        grideye_collector::pin_of_file(&chain)
            .unwrap()
            .starts_with("sha256-")
    );
    server.stop().await;
    let other_key = place.file("other.pem", &site.sign("127.0.0.1").1);
    let missing = place.around.path().join("missing.pem");
    for (chain, key, named) in [
        (&chain, &other_key, "chain.pem: with the key"),
        (&key, &key, "key.pem: no certificate in it"),
        (&chain, &chain, "chain.pem: no private key"),
        (&missing, &key, "missing.pem: "),
    ] {
        let config = place.config(anywhere(), Some(tls(chain, key)));
        let text = Collector::bind(config).await.err().unwrap().to_string();
        assert!(text.contains(named) && text.contains("\nhint: "), "{text}");
    }
}
