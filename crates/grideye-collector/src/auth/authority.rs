//! The site's own certificate authority, and the certificates it signs.

use crate::auth::error::{AccessError, Result};
use crate::auth::token::{hex, random_bytes, sha256};
use rcgen::{
    BasicConstraints, Certificate, CertificateParams, DnType, ExtendedKeyUsagePurpose, IsCa,
    Issuer, KeyPair, KeyUsagePurpose, date_time_ymd,
};
use rustls::pki_types::pem::PemObject as _;
use rustls::pki_types::{CertificateDer, PrivateKeyDer, PrivatePkcs8KeyDer};

/// Signs the collector's certificates. Agents identify it only by the SHA-256 of its own certificate.
#[derive(Debug)]
pub struct Authority {
    certificate: CertificateDer<'static>,
    certificate_pem: String,
    key: KeyPair,
}

pub(crate) struct Signed {
    pub(crate) chain: Vec<CertificateDer<'static>>,
    pub(crate) key: PrivateKeyDer<'static>,
}

impl Authority {
    pub(super) fn new() -> Result<Self> {
        let key = KeyPair::generate()?;
        let certificate = params(&[])?.self_signed(&key)?;
        Ok(Self {
            certificate_pem: certificate.pem(),
            certificate: der(&certificate),
            key,
        })
    }

    pub(super) fn from_pem(certificate_pem: &[u8], key_pem: &[u8]) -> Result<Self, String> {
        let text = |pem: &[u8]| String::from_utf8(pem.to_vec()).map_err(|error| error.to_string());
        let certificate = CertificateDer::from_pem_slice(certificate_pem)
            .map_err(|error| format!("this is not a certificate: {error}"))?;
        let key = KeyPair::from_pem(&text(key_pem)?)
            .map_err(|error| format!("the key beside it is invalid: {error}"))?;
        Ok(Self {
            certificate_pem: text(certificate_pem)?,
            certificate,
            key,
        })
    }

    /// `sha256-` and the certificate's SHA-256 in hexadecimal.
    #[must_use]
    pub fn pin(&self) -> String {
        pin(&self.certificate)
    }

    /// The certificate, for clients that should trust it: a browser, curl.
    #[must_use]
    pub fn certificate_pem(&self) -> &str {
        &self.certificate_pem
    }

    pub(super) fn key_pem(&self) -> String {
        self.key.serialize_pem()
    }

    pub(crate) fn sign(&self, names: &[String]) -> Result<Signed> {
        let key = KeyPair::generate()?;
        let issuer = Issuer::new(params(&[])?, &self.key);
        let mut leaf = params(names)?;
        leaf.is_ca = IsCa::ExplicitNoCa;
        leaf.key_usages = vec![KeyUsagePurpose::DigitalSignature];
        leaf.extended_key_usages = vec![ExtendedKeyUsagePurpose::ServerAuth];
        leaf.distinguished_name
            .push(DnType::CommonName, "grideye collector");
        leaf.serial_number = Some(random_bytes::<16>()?.to_vec().into());
        let certificate = leaf.signed_by(&key, &issuer)?;
        Ok(Signed {
            chain: vec![der(&certificate), self.certificate.clone()],
            key: PrivatePkcs8KeyDer::from(key.serialize_der()).into(),
        })
    }
}

pub(crate) fn pin(certificate: &CertificateDer<'_>) -> String {
    format!("sha256-{}", hex(&sha256(certificate)))
}

/// Common parts of all certificates. They are valid from 1970 and never expire: a Raspberry Pi has no battery-backed
/// clock.
fn params(names: &[String]) -> Result<CertificateParams, rcgen::Error> {
    let mut params = CertificateParams::new(names.to_vec())?;
    params.not_before = date_time_ymd(1970, 1, 1);
    params.not_after = date_time_ymd(9999, 12, 31);
    params.is_ca = IsCa::Ca(BasicConstraints::Constrained(0));
    params.key_usages = vec![
        KeyUsagePurpose::KeyCertSign,
        KeyUsagePurpose::DigitalSignature,
    ];
    params.use_authority_key_identifier_extension = true;
    params
        .distinguished_name
        .push(DnType::CommonName, "grideye authority");
    Ok(params)
}

fn der(certificate: &Certificate) -> CertificateDer<'static> {
    certificate.der().clone()
}

impl From<rcgen::Error> for AccessError {
    fn from(error: rcgen::Error) -> Self {
        Self::no_key(&error)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_authority_reads_back_and_signs_as_the_same() {
        let made = Authority::new().unwrap();
        let again =
            Authority::from_pem(made.certificate_pem().as_bytes(), made.key_pem().as_bytes())
                .unwrap();
        assert_eq!(again.pin(), made.pin());
        assert!(made.pin().starts_with("sha256-") && made.pin().len() == 7 + 64);
        let signed = again.sign(&["127.0.0.1".to_owned()]).unwrap();
        assert_eq!(pin(&signed.chain[1]), made.pin());
        assert_ne!(Authority::new().unwrap().pin(), made.pin());
    }

    #[test]
    fn an_invalid_certificate_or_key_is_reported() {
        let made = Authority::new().unwrap();
        let certificate = made.certificate_pem().as_bytes();
        let error = Authority::from_pem(b"nothing", made.key_pem().as_bytes()).unwrap_err();
        assert!(error.contains("not a certificate"), "{error}");
        let error = Authority::from_pem(certificate, certificate).unwrap_err();
        assert!(error.contains("the key beside it"), "{error}");
    }
}
