//! One TLS handshake with a collector known only by its pin, to fetch its authority's certificate.

use super::credentials::{ClientCertificate, NotJoined, Pin};
use crate::advice::{certificate_hint, in_handshake, is_plain};
use crate::lock::lock;
use base64::prelude::{BASE64_STANDARD, Engine as _};
use rustls::client::WebPkiServerVerifier;
use rustls::client::danger::{HandshakeSignatureValid, ServerCertVerified, ServerCertVerifier};
use rustls::crypto::CryptoProvider;
use rustls::crypto::ring::default_provider;
use rustls::pki_types::pem::PemObject as _;
use rustls::pki_types::{CertificateDer, PrivateKeyDer, ServerName, UnixTime};
use rustls::{
    ClientConfig, ClientConnection, DigitallySignedStruct, Error, RootCertStore, SignatureScheme,
};
use std::io;
use std::net::{TcpStream, ToSocketAddrs as _};
use std::sync::{Arc, Mutex};
use std::time::Duration;

/// Fetches the certificate with this pin, in PEM, from the collector at `https://HOST:PORT`. The collector must prove
/// that it has a certificate of that authority for its own name.
///
/// # Errors
/// [`NotJoined`].
pub fn authority_of(
    collector: &str,
    pin: &Pin,
    client: Option<&ClientCertificate>,
    timeout: Duration,
) -> Result<String, NotJoined> {
    let refuse = |what: String, hint: &str| NotJoined(format!("{collector}: {what}\nhint: {hint}"));
    let address = collector.trim_start_matches("https://");
    let (host, _port) = address.rsplit_once(':').unwrap_or((address, ""));
    let host = host.trim_start_matches('[').trim_end_matches(']');
    let misspelt = "is the collector's name spelt right?";
    let name = ServerName::try_from(host.to_owned())
        .map_err(|error| refuse(error.to_string(), misspelt))?;
    let provider = Arc::new(default_provider());
    let verifier = Arc::new(Pinned {
        pin: pin.clone(),
        provider: Arc::clone(&provider),
        found: Mutex::new(None),
    });
    let config = config(provider, Arc::clone(&verifier), client).map_err(|what| {
        let hint = "are the certificate and its key those of this agent, in PEM?";
        refuse(what, hint)
    })?;
    let mut connection = ClientConnection::new(Arc::new(config), name)
        .map_err(|error| refuse(error.to_string(), misspelt))?;
    let mut stream = connect(address, timeout).map_err(|error| {
        let hint =
            "is `grideye collect` running there, and does its firewall let the port through?";
        refuse(format!("no connection: {error}"), hint)
    })?;
    while connection.is_handshaking() {
        let done = connection.complete_io(&mut stream);
        done.map_err(|error| {
            let what = match in_handshake(&error).is_some_and(is_plain) {
                true => "it speaks plain HTTP, and the line asks for TLS".to_owned(),
                false => format!("no TLS: {error}"),
            };
            refuse(what, hint(&error))
        })?;
    }
    let found = lock(&verifier.found).take();
    let pem = found.map(|der| certificate_pem(&der));
    let what = "no certificate was shown";
    pem.ok_or_else(|| refuse(what.to_owned(), "is this a collector?"))
}

/// Verification looks at the authority first, then at the certificate's time and name.
fn hint(error: &io::Error) -> &'static str {
    let of_certificate = in_handshake(error).and_then(certificate_hint);
    of_certificate.map_or(
        "the line must be of this collector, and of its present authority: print a new one there with `grideye enroll`",
        |hint| hint.trim_start_matches("\nhint: "),
    )
}

fn connect(address: &str, timeout: Duration) -> io::Result<TcpStream> {
    let mut last = io::Error::from(io::ErrorKind::NotFound);
    for address in address.to_socket_addrs()? {
        match TcpStream::connect_timeout(&address, timeout) {
            Ok(stream) => {
                stream.set_read_timeout(Some(timeout))?;
                stream.set_write_timeout(Some(timeout))?;
                return Ok(stream);
            }
            Err(error) => last = error,
        }
    }
    Err(last)
}

fn config(
    provider: Arc<CryptoProvider>,
    verifier: Arc<Pinned>,
    client: Option<&ClientCertificate>,
) -> Result<ClientConfig, String> {
    let builder = ClientConfig::builder_with_provider(provider)
        .with_protocol_versions(&[&rustls::version::TLS13])
        .map_err(|error| error.to_string())?
        .dangerous()
        .with_custom_certificate_verifier(verifier);
    let Some(client) = client else {
        return Ok(builder.with_no_client_auth());
    };
    let chain = CertificateDer::pem_slice_iter(client.chain.as_bytes());
    let chain = chain.collect::<Result<Vec<_>, _>>();
    let chain = chain.map_err(|error| error.to_string())?;
    let key = PrivateKeyDer::from_pem_slice(client.key.reveal().as_bytes())
        .map_err(|error| error.to_string())?;
    builder
        .with_client_auth_cert(chain, key)
        .map_err(|error| error.to_string())
}

/// Trusts only the authority with this pin, which the collector must show.
#[derive(Debug)]
struct Pinned {
    pin: Pin,
    provider: Arc<CryptoProvider>,
    found: Mutex<Option<Vec<u8>>>,
}

impl ServerCertVerifier for Pinned {
    fn verify_server_cert(
        &self,
        end_entity: &CertificateDer<'_>,
        intermediates: &[CertificateDer<'_>],
        server_name: &ServerName<'_>,
        ocsp_response: &[u8],
        now: UnixTime,
    ) -> Result<ServerCertVerified, Error> {
        let mut shown = intermediates.iter();
        let Some(pinned) = shown.find(|certificate| Pin::of(certificate) == self.pin) else {
            let what = "the collector shows another authority than the line's pin says";
            return Err(Error::General(what.to_owned()));
        };
        let mut roots = RootCertStore::empty();
        roots.add(pinned.clone().into_owned())?;
        let provider = Arc::clone(&self.provider);
        let verifier = WebPkiServerVerifier::builder_with_provider(Arc::new(roots), provider)
            .build()
            .map_err(|error| Error::General(error.to_string()))?;
        let verified = verifier.verify_server_cert(
            end_entity,
            intermediates,
            server_name,
            ocsp_response,
            now,
        )?;
        *lock(&self.found) = Some(pinned.to_vec());
        Ok(verified)
    }

    fn verify_tls12_signature(
        &self,
        _message: &[u8],
        _certificate: &CertificateDer<'_>,
        _signed: &DigitallySignedStruct,
    ) -> Result<HandshakeSignatureValid, Error> {
        Err(Error::General("only TLS 1.3 is supported".to_owned()))
    }

    fn verify_tls13_signature(
        &self,
        message: &[u8],
        certificate: &CertificateDer<'_>,
        signed: &DigitallySignedStruct,
    ) -> Result<HandshakeSignatureValid, Error> {
        rustls::crypto::verify_tls13_signature(
            message,
            certificate,
            signed,
            &self.provider.signature_verification_algorithms,
        )
    }

    fn supported_verify_schemes(&self) -> Vec<SignatureScheme> {
        self.provider
            .signature_verification_algorithms
            .supported_schemes()
    }
}

/// A certificate in PEM (RFC 7468).
fn certificate_pem(der: &[u8]) -> String {
    const LINE_CHARS: usize = 64;
    let digits = BASE64_STANDARD.encode(der);
    let mut pem = String::from("-----BEGIN CERTIFICATE-----\n");
    for line in digits.as_bytes().chunks(LINE_CHARS) {
        pem.extend(line.iter().copied().map(char::from));
        pem.push('\n');
    }
    pem + "-----END CERTIFICATE-----\n"
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn another_reader_gets_the_same_bytes() {
        let der: Vec<u8> = (0..=255).chain([1, 2]).collect();
        let read = CertificateDer::from_pem_slice(certificate_pem(&der).as_bytes()).unwrap();
        assert_eq!(&*read, &*der);
    }
}
