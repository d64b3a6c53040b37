//! Which broker to use, with which user, and which certificate to trust.

use rustls::crypto::ring::default_provider;
use rustls::pki_types::pem::PemObject as _;
use rustls::pki_types::{CertificateDer, ServerName};
use rustls::{ClientConfig, RootCertStore};
use std::fmt;
use std::sync::Arc;

/// Maximum bytes of a user name or a password.
const CREDENTIAL_BYTES_MAX: usize = 1024;

/// The program's names for its settings, for hints: an option such as `--url`, or a configuration key.
#[derive(Debug, Clone, Copy)]
#[expect(missing_docs, reason = "the names say it")]
pub struct SettingNames {
    pub url: &'static str,
    pub password_file: &'static str,
    /// The environment variable for a password.
    pub password_variable: &'static str,
    /// The file with the authority's certificates.
    pub authority: &'static str,
    /// The setting for [`Topics::base`](crate::Topics::base).
    pub topic: &'static str,
}

/// A broker to connect to.
#[derive(Debug, Clone)]
pub struct Broker {
    pub(crate) host: String,
    pub(crate) port: u16,
    pub(crate) user: Option<String>,
    pub(crate) password: Option<Password>,
    pub(crate) encryption: Option<Encryption>,
    pub(crate) names: SettingNames,
}

/// Sent only to the broker; `Debug` hides it.
#[derive(Clone, PartialEq, Eq)]
pub struct Password(pub(crate) Vec<u8>);

impl Password {
    /// A password as the broker expects it.
    #[must_use]
    pub const fn new(bytes: Vec<u8>) -> Self {
        Self(bytes)
    }

    /// The first line of a file; `None` if it is empty.
    #[must_use]
    pub fn first_line_of(text: &[u8]) -> Option<Self> {
        let line = text.split(|byte| *byte == b'\n').next()?;
        let line = line.strip_suffix(b"\r").unwrap_or(line);
        (!line.is_empty()).then(|| Self(line.to_vec()))
    }
}

impl fmt::Debug for Password {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str("Password(…)")
    }
}

/// TLS, and the name required in the broker's certificate.
#[derive(Debug, Clone)]
pub(crate) struct Encryption {
    pub(crate) config: Arc<ClientConfig>,
    pub(crate) name: ServerName<'static>,
}

/// Without the user: for logs and people.
impl fmt::Display for Broker {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let scheme = self.encryption.as_ref().map_or("mqtt", |_| "mqtts");
        let Self { host, port, .. } = self;
        match host.contains(':') {
            true => write!(formatter, "{scheme}://[{host}]:{port}"),
            false => write!(formatter, "{scheme}://{host}:{port}"),
        }
    }
}

/// Why the broker's settings are invalid, with a hint. Holds no password.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct BrokerError(String);

/// The parts of a URL.
#[derive(Debug, PartialEq, Eq)]
struct Parts {
    is_encrypted: bool,
    user: Option<String>,
    host: String,
    port: u16,
}

impl Broker {
    /// The broker at `mqtt://[USER@]HOST[:PORT]`. One at `mqtts://` needs the authority of its certificate: the file's
    /// name, for messages, and its PEM certificates.
    ///
    /// # Errors
    /// If the URL, the password or the authority is invalid.
    pub fn new(
        url: &str,
        password: Option<Password>,
        authority: Option<(&str, &[u8])>,
        names: SettingNames,
    ) -> Result<Self, BrokerError> {
        let option = names.url;
        let parts = parts(url, names).map_err(|what| {
            // The URL is not repeated: it may contain a password.
            BrokerError(format!("{option}: {what}\nhint: mqtt://[USER@]HOST[:PORT], and mqtts:// for a broker with TLS"))
        })?;
        check_password(password.as_ref(), parts.user.as_ref(), names)?;
        let encryption = match (parts.is_encrypted, authority) {
            (true, Some(authority)) => Some(encryption(authority, &parts.host, names)?),
            (false, None) => None,
            (true, None) => Err(BrokerError(format!(
                "{option}: the broker uses TLS, but no authority is given for its certificate\nhint: {} FILE, the authority's certificate in PEM; /etc/ssl/certs/ca-certificates.crt has the public ones",
                names.authority
            )))?,
            (false, Some(_)) => Err(BrokerError(format!(
                "{} is for a broker with TLS\nhint: {option} mqtts://HOST",
                names.authority
            )))?,
        };
        Ok(Self {
            host: parts.host,
            port: parts.port,
            user: parts.user,
            password,
            encryption,
            names,
        })
    }
}

fn parts(url: &str, names: SettingNames) -> Result<Parts, String> {
    let (is_encrypted, rest) = match (url.strip_prefix("mqtt://"), url.strip_prefix("mqtts://")) {
        (Some(rest), _) => (false, rest),
        (_, Some(rest)) => (true, rest),
        _ => return Err("the URL must begin with mqtt:// or mqtts://".to_owned()),
    };
    let rest = rest.strip_suffix('/').unwrap_or(rest);
    let (user, place) = match rest.rsplit_once('@') {
        Some((user, _)) if user.contains(':') => {
            return Err(format!(
                "everyone on this machine can see a password on the command line: put it into a file for {}, or into the environment variable {}",
                names.password_file, names.password_variable
            ));
        }
        Some((user, place)) => (Some(user.to_owned()), place),
        None => (None, rest),
    };
    let (host, port) = match place.strip_prefix('[').and_then(|six| six.split_once(']')) {
        Some((host, port)) => (host, port.strip_prefix(':')),
        None => place
            .split_once(':')
            .map_or((place, None), |(host, port)| (host, Some(port))),
    };
    let is_host = |c: char| c.is_ascii_alphanumeric() || matches!(c, '.' | '-' | '_' | ':' | '%');
    if host.is_empty() || !host.chars().all(is_host) {
        return Err("the URL has no host".to_owned());
    }
    let usual = if is_encrypted { 8883 } else { 1883 };
    let port = port.map_or(Some(usual), |port| port.parse().ok());
    let port = port.filter(|port| *port > 0);
    let port = port.ok_or("the port must be a number from 1 to 65535")?;
    let user = user.filter(|user| !user.is_empty());
    Ok(Parts {
        is_encrypted,
        user,
        host: host.to_owned(),
        port,
    })
}

/// MQTT allows no password without a user (mqtt-v3.1.1, §3.1.2.9).
fn check_password(
    password: Option<&Password>,
    user: Option<&String>,
    names: SettingNames,
) -> Result<(), BrokerError> {
    let (option, password_file) = (names.url, names.password_file);
    let bytes = password.map_or(0, |password| password.0.len());
    if password.is_some() && user.is_none() {
        return Err(BrokerError(format!(
            "{option}: a password needs a user\nhint: {option} mqtt://USER@HOST"
        )));
    }
    if bytes > CREDENTIAL_BYTES_MAX || user.is_some_and(|user| user.len() > CREDENTIAL_BYTES_MAX) {
        return Err(BrokerError(format!(
            "{option}: user and password may have at most {CREDENTIAL_BYTES_MAX} bytes each\nhint: does {password_file} name the right file?"
        )));
    }
    Ok(())
}

fn encryption(
    (file, pem): (&str, &[u8]),
    host: &str,
    names: SettingNames,
) -> Result<Encryption, BrokerError> {
    let refuse = |what: String| {
        BrokerError(format!(
            "{file}: {what}\nhint: {} names certificates in PEM, which begin with -----BEGIN CERTIFICATE-----",
            names.authority
        ))
    };
    let mut roots = RootCertStore::empty();
    for certificate in CertificateDer::pem_slice_iter(pem) {
        let certificate = certificate.map_err(|error| refuse(error.to_string()))?;
        let added = roots.add(certificate);
        added.map_err(|error| refuse(error.to_string()))?;
    }
    if roots.is_empty() {
        return Err(refuse("the file contains no certificate".to_owned()));
    }
    let config = ClientConfig::builder_with_provider(Arc::new(default_provider()))
        .with_safe_default_protocol_versions()
        .map_err(|error| BrokerError(format!("TLS: {error}")))?
        .with_root_certificates(roots)
        .with_no_client_auth();
    let name = ServerName::try_from(host.to_owned()).map_err(|error| {
        BrokerError(format!(
            "{}: {host}: {error}\nhint: a host name or an address",
            names.url
        ))
    })?;
    let config = Arc::new(config);
    Ok(Encryption { config, name })
}

#[cfg(test)]
mod tests {
    use super::*;

    const NAMES: SettingNames = SettingNames {
        url: "--url",
        password_file: "--password-file",
        password_variable: "PASSWORD",
        authority: "--authority",
        topic: "--topic",
    };

    #[test]
    fn a_broker_is_named_by_its_url() {
        for (url, (is_encrypted, user, host, port)) in [
            ("mqtt://pi.local", (false, None, "pi.local", 1883)),
            ("mqtts://pi.local/", (true, None, "pi.local", 8883)),
            (
                "mqtt://ana@10.0.0.7:1884",
                (false, Some("ana"), "10.0.0.7", 1884),
            ),
            ("mqtt://[::1]:1884", (false, None, "::1", 1884)),
            ("mqtt://@[fd00::1]", (false, None, "fd00::1", 1883)),
            ("mqtt://a@b@c", (false, Some("a@b"), "c", 1883)),
        ] {
            let (user, host) = (user.map(str::to_owned), host.to_owned());
            let wanted = Parts {
                is_encrypted,
                user,
                host,
                port,
            };
            assert_eq!(parts(url, NAMES), Ok(wanted), "{url}");
        }
        let bad = "|pi.local|http://pi|mqtt://|mqtt://a:0|mqtt://a:65536|mqtt://a:x|mqtt://a/b|mqtt://a b";
        for bad in bad.split('|') {
            assert!(parts(bad, NAMES).is_err(), "{bad}");
        }
    }

    fn refused(url: &str, password: Option<&str>, authority: Option<(&str, &[u8])>) -> String {
        let password = password.map(|password| Password::new(password.into()));
        let error = Broker::new(url, password, authority, NAMES).unwrap_err();
        format!("{error:?} {error}")
    }

    #[test]
    fn a_password_is_refused_on_the_command_line_and_never_shown() {
        let said = refused("mqtt://ana:hunter2@pi", None, None);
        let places = "a file for --password-file, or into the environment variable PASSWORD";
        assert!(said.contains(places), "{said}");
        assert!(!said.contains("hunter2"), "{said}");
        let password = Password::new(b"hunter2".to_vec());
        let broker = Broker::new("mqtt://ana@pi", Some(password), None, NAMES).unwrap();
        let said = format!("{broker:?} {broker}");
        let is_shown = said.contains("hunter2") || said.contains("104, 117");
        assert!(!is_shown, "{said}");
    }

    #[test]
    fn a_password_is_the_first_line_of_its_file_and_has_a_user() {
        let password = Password::first_line_of(b"s3cret word\r\nmore\n");
        assert_eq!(password, Some(Password(b"s3cret word".to_vec())));
        assert_eq!(Password::first_line_of(b"\n"), None);
        let longest = "x".repeat(CREDENTIAL_BYTES_MAX);
        let longer = format!("{longest}x");
        for (password, url) in [("x", "mqtt://pi"), (&longer, "mqtt://ana@pi")] {
            let said = refused(url, Some(password), None);
            assert!(said.contains("hint: "), "{said}");
        }
        let password = Password::new(longest.into_bytes());
        assert!(Broker::new("mqtt://ana@pi", Some(password), None, NAMES).is_ok());
    }

    #[test]
    fn encryption_needs_an_authority() {
        let said = refused("mqtts://pi", None, None);
        assert!(said.contains("hint: --authority FILE"), "{said}");
        let authority = Some(("authority.pem", &b"no certificate"[..]));
        let said = refused("mqtts://pi", None, authority);
        assert!(said.contains("no certificate"), "{said}");
        let said = refused("mqtt://pi", None, authority);
        assert!(said.contains("hint: --url mqtts://HOST"), "{said}");
    }
}
