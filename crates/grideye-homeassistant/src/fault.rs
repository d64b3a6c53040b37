//! Why the broker is not reachable, with advice for the user.

use crate::broker::SettingNames;
use grideye_collector::Refusal;
use std::fmt;
use std::io;
use std::time::Duration;

const AGAIN: &str = "the bridge retries; the broker's log may say why";

/// An error with a hint. Holds no password.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{what}\nhint: {hint}")]
pub struct Fault {
    pub(crate) what: String,
    pub(crate) hint: String,
}

impl Fault {
    fn new(what: impl Into<String>, hint: impl Into<String>) -> Self {
        let (what, hint) = (what.into(), hint.into());
        Self { what, hint }
    }

    pub(crate) fn unreachable(reason: &io::Error) -> Self {
        Self::new(
            format!("cannot reach the broker: {reason}"),
            "is it running at that address? mosquitto listens only on loopback unless its configuration has a line `listener 1883`",
        )
    }

    pub(crate) fn silent(longest: Duration) -> Self {
        Self::new(
            format!("the broker did not answer within {} s", longest.as_secs()),
            "is there an MQTT broker at that port? 1883 is the usual one, 8883 with mqtts://",
        )
    }

    pub(crate) fn encryption(reason: &io::Error, names: SettingNames) -> Self {
        let SettingNames { url, authority, .. } = names;
        Self::new(
            format!("cannot trust the broker's certificate: {reason}"),
            format!(
                "{authority} names the authority that signed the broker's certificate, which must be for the host in {url}"
            ),
        )
    }

    pub(crate) fn broken(reason: &io::Error, names: SettingNames) -> Self {
        if reason.kind() == io::ErrorKind::UnexpectedEof {
            return Self::closed(names);
        }
        let what = format!("the connection to the broker broke: {reason}");
        Self::new(what, AGAIN)
    }

    pub(crate) fn closed(names: SettingNames) -> Self {
        let hint = format!(
            "if it happens repeatedly, another collector uses the same topics: give one of them another {}",
            names.topic
        );
        Self::new("the broker closed the connection", hint)
    }

    /// The collector takes no frames now.
    pub(crate) fn not_stored(refusal: &Refusal) -> Self {
        let refusal = refusal.to_string();
        let (what, hint) = refusal.split_once("\nhint: ").unwrap_or((&refusal, AGAIN));
        Self::new(format!("frames wait at the broker: {what}"), hint)
    }

    pub(crate) fn garbled(what: &impl fmt::Display) -> Self {
        Self::new(
            format!("this is not an MQTT broker: it sent {what}"),
            "1883 is the usual port, 8883 with mqtts://; its web socket's port is another",
        )
    }

    /// A rejection, by its code (mqtt-v3.1.1, table 3.1).
    pub(crate) fn refused(code: u8, has_password: bool, names: SettingNames) -> Self {
        let SettingNames {
            url,
            password_file: file,
            password_variable: variable,
            topic,
            ..
        } = names;
        match (code, has_password) {
            (4 | 5, true) => Self::new(
                "the broker refuses the user or the password",
                format!(
                    "the user stands in {url} as mqtt://USER@HOST, the password in {file} or {variable}; mosquitto_passwd sets one, and Home Assistant's add-on takes those of its own users"
                ),
            ),
            (4 | 5, false) => Self::new(
                "the broker requires a user and a password",
                format!("{url} mqtt://USER@HOST with {file} FILE, or the password in {variable}"),
            ),
            (1, _) => Self::new(
                "the broker does not speak MQTT 3.1.1",
                "mosquitto 1.4 or later does",
            ),
            (2, _) => Self::new(
                "the broker refuses this program's client id",
                format!("another {topic} gives it another one"),
            ),
            (3, _) => Self::new("the broker is unavailable", AGAIN),
            _ => Self::new(
                format!("the broker refuses the connection with code {code}"),
                "the broker's log may say why",
            ),
        }
    }
}
