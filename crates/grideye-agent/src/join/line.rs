//! The line that `grideye enroll` prints, and the file that joining writes.

use super::credentials::{ClientCertificate, Credentials, NotJoined, Pin, Secret, check_url};
use crate::limits::JOINED_BYTES_MAX;
use grideye_recording::check_name;
use serde::{Deserialize, Serialize};
use std::fs::File as Opened;
use std::io::{self, Read as _};
use std::path::Path;
use std::str::FromStr;

const SCHEME: &str = "grideye:";
/// The command around the code. A shell's built-in `echo` keeps the token out of the process list.
const COMMAND: (&str, &str) = ("echo ", " | sudo grideye-agent join -");
/// The command before a code given as an argument.
const COMMAND_WITH_ARGUMENT: &str = "sudo grideye-agent join ";

/// The line that `grideye enroll` prints for one agent.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct JoinLine {
    /// `https://HOST:PORT` or `http://HOST:PORT`.
    pub collector: String,
    /// The device's name, if the token is for one device only.
    pub device: Option<String>,
    /// The token for its frames; `None` if the collector requires none.
    pub token: Option<Secret>,
    /// SHA-256 of the certificate of the collector's authority; only with `https`.
    pub pin: Option<Pin>,
}

impl JoinLine {
    /// The command to paste on the device, including the token. No character of a code has a meaning to the shell
    /// inside these quotes.
    #[must_use]
    pub fn command(&self) -> String {
        let (before, after) = COMMAND;
        format!("{before}'{}'{after}", self.reveal())
    }

    /// The code alone, including the token.
    #[must_use]
    pub fn reveal(&self) -> String {
        let mut line = format!("{SCHEME}{}", self.collector);
        let pin = self.pin.as_ref().map(Pin::to_string);
        let fields = [
            ("device", self.device.as_deref()),
            ("token", self.token.as_ref().map(Secret::reveal)),
            ("pin", pin.as_deref()),
        ];
        for (name, value) in fields {
            let field = value.map(|value| format!(",{name}={value}"));
            line.extend(field);
        }
        line
    }
}

impl FromStr for JoinLine {
    type Err = NotJoined;
    fn from_str(text: &str) -> Result<Self, NotJoined> {
        let refuse = |what: &str| {
            NotJoined(format!(
                "this is no join line: {what}\nhint: copy the whole line that `grideye enroll DEVICE` printed, with its quotation marks, and paste it as it is"
            ))
        };
        let text = code_in(text.trim());
        let rest = text
            .strip_prefix(SCHEME)
            .filter(|_| text.len() <= JOINED_BYTES_MAX)
            .ok_or_else(|| refuse("it does not begin with `grideye:`"))?;
        let mut parts = rest.split(',');
        let collector = parts.next().unwrap_or_default();
        check_url(collector).map_err(|what| refuse(&what))?;
        let mut line = Self {
            collector: collector.to_owned(),
            device: None,
            token: None,
            pin: None,
        };
        for part in parts {
            let (name, value) = part
                .split_once('=')
                .ok_or_else(|| refuse("a part of it has no `=`"))?;
            let is_new = match name {
                "device" => {
                    check_name(value).map_err(|_no_name| refuse("its device name is not valid"))?;
                    line.device.replace(value.to_owned()).is_none()
                }
                "token" => {
                    let token = Secret::new(value).map_err(|error| refuse(&error.0))?;
                    line.token.replace(token).is_none()
                }
                "pin" => {
                    let pin = value.parse().map_err(|error: NotJoined| refuse(&error.0))?;
                    line.pin.replace(pin).is_none()
                }
                _ => Err(refuse(
                    "a part of it is not known: is the agent older than the collector?",
                ))?,
            };
            if !is_new {
                return Err(refuse("a part of it is duplicated"));
            }
        }
        if line.collector.starts_with("https://") != line.pin.is_some() {
            return Err(refuse("https requires a pin, and http allows none"));
        }
        Ok(line)
    }
}

/// The code within a command; a shell may already have removed the quotation marks.
fn code_in(text: &str) -> &str {
    let (before, after) = COMMAND;
    text.strip_prefix(before)
        .and_then(|rest| rest.strip_suffix(after))
        .or_else(|| text.strip_prefix(COMMAND_WITH_ARGUMENT))
        .map_or(text, |quoted| quoted.trim_matches('\''))
}

/// The file that joining writes: `collector.toml`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Joined {
    /// `https://HOST:PORT` or `http://HOST:PORT`.
    pub collector: String,
    /// The device's name, if the token is for one device only.
    pub device: Option<String>,
    /// Token and certificates.
    pub credentials: Credentials,
}

impl Joined {
    /// Reads the file.
    ///
    /// # Errors
    /// [`NotJoined`] if it cannot be read, or for anything that [`Self::to_toml`] did not write.
    pub fn read(path: &Path) -> Result<Self, NotJoined> {
        let origin = path.display().to_string();
        let text = read_text(path, JOINED_BYTES_MAX).map_err(|error| {
            NotJoined(format!(
                "{origin}: {error}\nhint: `grideye-agent join` writes it; it must be readable for the user that runs the agent"
            ))
        })?;
        Self::parse(&text, &origin)
    }

    /// Reads the file's text. `origin` is its name in errors.
    ///
    /// # Errors
    /// [`NotJoined`] for anything that [`Self::to_toml`] did not write.
    pub fn parse(text: &str, origin: &str) -> Result<Self, NotJoined> {
        let refuse = |what: String| {
            NotJoined(format!(
                "{origin}: {what}\nhint: join again: paste the line that `grideye enroll DEVICE` prints on the collector's machine"
            ))
        };
        let file: File = toml::from_str(text).map_err(|error| {
            let line = error.span().map_or(1, |span| {
                text[..span.start.min(text.len())].matches('\n').count() + 1
            });
            // The parser's message may quote a secret, so name only the place.
            refuse(format!("line {line} is not understood"))
        })?;
        check_url(&file.collector).map_err(refuse)?;
        if file.collector.starts_with("https://") != file.authority.is_some() {
            let what = "https requires an authority, and http allows none";
            return Err(refuse(what.to_owned()));
        }
        let is_pem = |text: &String| text.contains("-----BEGIN CERTIFICATE-----");
        if !file.authority.as_ref().is_none_or(is_pem) {
            return Err(refuse(
                "the authority is not a certificate in PEM".to_owned(),
            ));
        }
        let token = file.token.map(|token| Secret::new(&token)).transpose();
        let client = match (file.client_certificate, file.client_key) {
            (None, None) => None,
            (Some(chain), Some(key)) => Some(ClientCertificate { chain, key }),
            _ => {
                return Err(refuse(
                    "a certificate and its key must both be there".to_owned(),
                ));
            }
        };
        Ok(Self {
            collector: file.collector,
            device: file.device,
            credentials: Credentials {
                token: token.map_err(|error| refuse(error.0))?,
                authority: file.authority,
                client,
            },
        })
    }

    /// The file's text, including the token; only its owner may read it.
    ///
    /// # Errors
    /// [`NotJoined`] if this cannot be TOML, which no value here causes.
    pub fn to_toml(&self) -> Result<String, NotJoined> {
        let client = self.credentials.client.as_ref();
        let token = self.credentials.token.as_ref();
        let file = File {
            collector: self.collector.clone(),
            device: self.device.clone(),
            token: token.map(|token| token.reveal().to_owned()),
            authority: self.credentials.authority.clone(),
            client_certificate: client.map(|client| client.chain.clone()),
            client_key: client.map(|client| client.key.clone()),
        };
        toml::to_string_pretty(&file).map_err(|error| NotJoined(error.to_string()))
    }
}

/// Reads a text file, at most one byte beyond the limit, so that the caller notices one too long.
///
/// # Errors
/// The failure to open or read it, also if it is not UTF-8.
pub fn read_text(path: &Path, bytes_max: usize) -> io::Result<String> {
    let mut text = String::new();
    let limit = u64::try_from(bytes_max).unwrap_or(u64::MAX) + 1;
    Opened::open(path)?.take(limit).read_to_string(&mut text)?;
    Ok(text)
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    collector: String,
    device: Option<String>,
    token: Option<String>,
    authority: Option<String>,
    client_certificate: Option<String>,
    client_key: Option<Secret>,
}
