//! Which broker, as whom, and whose certificate is believed.

use crate::cli::BrokerOptions;
use crate::exit::bad_input;
use crate::files;
use anyhow::{Context as _, Result, anyhow};
use rustls::crypto::ring::default_provider;
use rustls::pki_types::pem::PemObject as _;
use rustls::pki_types::{CertificateDer, ServerName};
use rustls::{ClientConfig, RootCertStore};
use std::fmt;
use std::io::Read as _;
use std::path::Path;
use std::sync::Arc;

/// Where the password is when no file has it.
pub(super) const PASSWORD_VARIABLE: &str = "GRIDEYE_MQTT_PASSWORD";
/// Longest file of a password or of authorities: Debian's file of all public ones has 220 kB.
const FILE_BYTES_MAX: u64 = 4 * 1024 * 1024;
/// Bytes of a user's name or a password.
const CREDENTIAL_BYTES_MAX: usize = 1024;

/// A broker that can be connected to.
#[derive(Debug, Clone)]
pub(super) struct Broker {
    pub(super) host: String,
    pub(super) port: u16,
    pub(super) user: Option<String>,
    pub(super) password: Option<Password>,
    pub(super) encryption: Option<Encryption>,
}

/// Shown to the broker and to nobody else: debugging does not show it.
#[derive(Clone, PartialEq, Eq)]
pub(super) struct Password(pub(super) Vec<u8>);

impl fmt::Debug for Password {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str("Password(…)")
    }
}

/// TLS, and the name that the broker's certificate must have.
#[derive(Debug, Clone)]
pub(super) struct Encryption {
    pub(super) config: Arc<ClientConfig>,
    pub(super) name: ServerName<'static>,
}

/// Without the user: for logs and people.
impl fmt::Display for Broker {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let scheme = self.encryption.as_ref().map_or("mqtt", |_| "mqtts");
        if self.host.contains(':') {
            write!(formatter, "{scheme}://[{}]:{}", self.host, self.port)
        } else {
            write!(formatter, "{scheme}://{}:{}", self.host, self.port)
        }
    }
}

/// A URL in its parts.
#[derive(Debug, PartialEq, Eq)]
struct Parts {
    is_encrypted: bool,
    user: Option<String>,
    host: String,
    port: u16,
}

impl Broker {
    /// The broker that the options name; `None` if they name none. `from_environment` is a password that stands there.
    ///
    /// # Errors
    /// Bad input when the URL, the password or the authority is none.
    pub(super) fn of(
        options: &BrokerOptions,
        from_environment: Option<Vec<u8>>,
    ) -> Result<Option<Self>> {
        let Some(url) = &options.url else {
            return Ok(None);
        };
        let parts = parts(url).map_err(|what| {
            // The URL is not repeated: there may be a password in it.
            bad_input(anyhow!("--mqtt: {what}\nhint: mqtt://[USER@]HOST[:PORT], and mqtts:// for a broker with TLS"))
        })?;
        let password = match &options.password_file {
            Some(path) => Some(password_of(path)?),
            None => from_environment.map(Password),
        };
        check_password(password.as_ref(), parts.user.as_ref())?;
        let encryption = match (parts.is_encrypted, &options.authority) {
            (true, Some(path)) => Some(encryption(path, &parts.host)?),
            (false, None) => None,
            (true, None) => {
                return Err(bad_input(anyhow!(
                    "--mqtt: the broker is encrypted, and nobody says whose certificate to believe\nhint: --mqtt-authority FILE, the authority's certificate in PEM; /etc/ssl/certs/ca-certificates.crt has the public ones"
                )));
            }
            (false, Some(_)) => {
                return Err(bad_input(anyhow!(
                    "--mqtt-authority is for a broker with TLS\nhint: --mqtt mqtts://HOST"
                )));
            }
        };
        Ok(Some(Self {
            host: parts.host,
            port: parts.port,
            user: parts.user,
            password,
            encryption,
        }))
    }
}

fn parts(url: &str) -> Result<Parts, &'static str> {
    let (is_encrypted, rest) = match (url.strip_prefix("mqtt://"), url.strip_prefix("mqtts://")) {
        (Some(rest), _) => (false, rest),
        (_, Some(rest)) => (true, rest),
        _ => return Err("it does not begin with mqtt:// or mqtts://"),
    };
    let rest = rest.strip_suffix('/').unwrap_or(rest);
    let (user, place) = match rest.rsplit_once('@') {
        Some((user, _)) if user.contains(':') => {
            return Err(
                "a password on the command line is seen by everybody on this machine: put it into a file for --mqtt-password-file, or into the environment variable GRIDEYE_MQTT_PASSWORD",
            );
        }
        Some((user, place)) => (Some(user.to_owned()), place),
        None => (None, rest),
    };
    let (host, port) = match place.strip_prefix('[').and_then(|six| six.split_once(']')) {
        Some((host, port)) => (host, port.strip_prefix(':')),
        None => match place.split_once(':') {
            Some((host, port)) => (host, Some(port)),
            None => (place, None),
        },
    };
    let is_host = |c: char| c.is_ascii_alphanumeric() || matches!(c, '.' | '-' | '_' | ':' | '%');
    if host.is_empty() || !host.chars().all(is_host) {
        return Err("there is no host in it");
    }
    let usual = if is_encrypted { 8883 } else { 1883 };
    let port = match port {
        None => usual,
        Some(port) => port
            .parse()
            .ok()
            .filter(|port| *port > 0)
            .ok_or("its port is not a number from 1 to 65535")?,
    };
    let user = user.filter(|user| !user.is_empty());
    Ok(Parts {
        is_encrypted,
        user,
        host: host.to_owned(),
        port,
    })
}

/// A broker takes no password without a user (mqtt-v3.1.1, §3.1.2.9).
fn check_password(password: Option<&Password>, user: Option<&String>) -> Result<()> {
    let bytes = password.map_or(0, |password| password.0.len());
    if password.is_some() && user.is_none() {
        return Err(bad_input(anyhow!(
            "--mqtt: there is a password and no user\nhint: --mqtt mqtt://USER@HOST"
        )));
    }
    if bytes > CREDENTIAL_BYTES_MAX || user.is_some_and(|user| user.len() > CREDENTIAL_BYTES_MAX) {
        return Err(bad_input(anyhow!(
            "--mqtt: user and password have {CREDENTIAL_BYTES_MAX} bytes at most\nhint: does --mqtt-password-file name the right file?"
        )));
    }
    Ok(())
}

/// The first line of a file.
fn password_of(path: &Path) -> Result<Password> {
    let text = read(path)?;
    let line = text.split(|byte| *byte == b'\n').next().unwrap_or_default();
    let line = line.strip_suffix(b"\r").unwrap_or(line);
    if line.is_empty() {
        return Err(bad_input(anyhow!(
            "{}: there is no password in its first line\nhint: printf %s 'PASSWORD' > FILE; chmod 600 FILE",
            path.display()
        )));
    }
    Ok(Password(line.to_vec()))
}

fn encryption(path: &Path, host: &str) -> Result<Encryption> {
    let refuse = |what: String| {
        bad_input(anyhow!(
            "{}: {what}\nhint: --mqtt-authority names certificates in PEM, which begin with -----BEGIN CERTIFICATE-----",
            path.display()
        ))
    };
    let mut roots = RootCertStore::empty();
    for certificate in CertificateDer::pem_slice_iter(&read(path)?) {
        let certificate = certificate.map_err(|error| refuse(error.to_string()))?;
        roots
            .add(certificate)
            .map_err(|error| refuse(error.to_string()))?;
    }
    if roots.is_empty() {
        return Err(refuse("there is no certificate in it".to_owned()));
    }
    let config = ClientConfig::builder_with_provider(Arc::new(default_provider()))
        .with_safe_default_protocol_versions()
        .context("TLS")?
        .with_root_certificates(roots)
        .with_no_client_auth();
    let name = ServerName::try_from(host.to_owned()).map_err(|error| {
        bad_input(anyhow!(
            "--mqtt: {host}: {error}\nhint: a host name or an address"
        ))
    })?;
    let config = Arc::new(config);
    Ok(Encryption { config, name })
}

fn read(path: &Path) -> Result<Vec<u8>> {
    let mut bytes = Vec::new();
    files::open(path)?
        .take(FILE_BYTES_MAX)
        .read_to_end(&mut bytes)
        .map_err(|error| {
            bad_input(anyhow!(
                "{}: {error}\nhint: a short text file is wanted",
                path.display()
            ))
        })?;
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn found(url: &str) -> (bool, Option<String>, String, u16) {
        let parts = parts(url).unwrap();
        (parts.is_encrypted, parts.user, parts.host, parts.port)
    }

    #[test]
    fn a_broker_is_named_by_its_url() {
        let none = None::<String>;
        let host = |name: &str| name.to_owned();
        for (url, expected) in [
            (
                "mqtt://pi.local",
                (false, none.clone(), host("pi.local"), 1883),
            ),
            (
                "mqtts://pi.local/",
                (true, none.clone(), host("pi.local"), 8883),
            ),
            (
                "mqtt://ana@10.0.0.7:1884",
                (false, Some(host("ana")), host("10.0.0.7"), 1884),
            ),
            (
                "mqtt://[::1]:1884",
                (false, none.clone(), host("::1"), 1884),
            ),
            (
                "mqtt://@[fd00::1]",
                (false, none.clone(), host("fd00::1"), 1883),
            ),
            ("mqtt://a@b@c", (false, Some(host("a@b")), host("c"), 1883)),
        ] {
            assert_eq!(found(url), expected, "{url}");
        }
        for bad in [
            "",
            "pi.local",
            "http://pi",
            "mqtt://",
            "mqtt://a:0",
            "mqtt://a:65536",
            "mqtt://a:x",
            "mqtt://a/b",
            "mqtt://a b",
        ] {
            assert!(parts(bad).is_err(), "{bad}");
        }
    }

    fn options(url: &str) -> BrokerOptions {
        BrokerOptions {
            url: Some(url.to_owned()),
            password_file: None,
            authority: None,
            prefix: "homeassistant".to_owned(),
            base: "grideye".to_owned(),
        }
    }

    #[test]
    fn a_password_is_refused_on_the_command_line_and_never_shown() {
        let refused = Broker::of(&options("mqtt://ana:hunter2@pi"), None).unwrap_err();
        let said = format!("{refused:?} {refused:#}");
        assert!(said.contains("--mqtt-password-file"), "{said}");
        assert!(!said.contains("hunter2"), "{said}");
        let broker = Broker::of(&options("mqtt://ana@pi"), Some(b"hunter2".to_vec()));
        let broker = broker.unwrap().unwrap();
        let said = format!("{broker:?} {broker}");
        assert!(
            !said.contains("hunter2") && !said.contains("104, 117"),
            "{said}"
        );
    }

    #[test]
    fn a_password_is_the_first_line_of_its_file_and_has_a_user() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("password");
        let with_file = |text: &str, url: &str| {
            std::fs::write(&path, text).unwrap();
            let mut options = options(url);
            options.password_file = Some(path.clone());
            Broker::of(&options, Some(b"other".to_vec()))
        };
        let broker = with_file("s3cret word\r\nmore\n", "mqtt://ana@pi")
            .unwrap()
            .unwrap();
        assert_eq!(broker.password, Some(Password(b"s3cret word".to_vec())));
        for (text, url) in [
            ("\n", "mqtt://ana@pi"),
            ("x", "mqtt://pi"),
            (&*"x".repeat(CREDENTIAL_BYTES_MAX + 1), "mqtt://ana@pi"),
        ] {
            let refused = with_file(text, url).unwrap_err().to_string();
            assert!(refused.contains("hint: "), "{refused}");
        }
        assert!(with_file(&"x".repeat(CREDENTIAL_BYTES_MAX), "mqtt://ana@pi").is_ok());
    }

    #[test]
    fn encryption_needs_an_authority() {
        let refused = Broker::of(&options("mqtts://pi"), None)
            .unwrap_err()
            .to_string();
        assert!(refused.contains("--mqtt-authority"), "{refused}");
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("authority.pem");
        std::fs::write(&path, "no certificate").unwrap();
        let mut options = options("mqtts://pi");
        options.authority = Some(path);
        let refused = Broker::of(&options, None).unwrap_err().to_string();
        assert!(refused.contains("no certificate"), "{refused}");
        options.url = Some("mqtt://pi".to_owned());
        let refused = Broker::of(&options, None).unwrap_err().to_string();
        assert!(refused.contains("mqtts://HOST"), "{refused}");
    }
}
