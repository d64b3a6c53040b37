//! Why the broker is not told, in words for who can mend it.

use std::fmt;
use std::io;
use std::time::Duration;

const AGAIN: &str = "it is tried again; the broker's log may say why";

/// What went wrong, and what to do about it. Holds no password.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{what}\nhint: {hint}")]
pub struct Fault {
    pub(crate) what: String,
    pub(crate) hint: &'static str,
}

impl Fault {
    fn new(what: impl Into<String>, hint: &'static str) -> Self {
        let what = what.into();
        Self { what, hint }
    }

    pub(crate) fn unreachable(reason: &io::Error) -> Self {
        Self::new(
            format!("no way to the broker: {reason}"),
            "is it running at that address? mosquitto listens on loopback alone until its configuration has a line `listener 1883`",
        )
    }

    pub(crate) fn silent(longest: Duration) -> Self {
        Self::new(
            format!("the broker did not answer within {} s", longest.as_secs()),
            "is there an MQTT broker at that port? 1883 is the usual one, 8883 with mqtts://",
        )
    }

    pub(crate) fn encryption(reason: &io::Error) -> Self {
        Self::new(
            format!("the broker's encryption is not to be trusted: {reason}"),
            "--mqtt-authority names the authority that signed the broker's certificate, which must be for the host in --mqtt",
        )
    }

    pub(crate) fn broken(reason: &io::Error) -> Self {
        if reason.kind() == io::ErrorKind::UnexpectedEof {
            return Self::closed();
        }
        Self::new(
            format!("the connection to the broker broke: {reason}"),
            AGAIN,
        )
    }

    pub(crate) fn closed() -> Self {
        Self::new(
            "the broker closed the connection",
            "if it does so again and again, another collector publishes at the same place: give one of them another --mqtt-topic",
        )
    }

    pub(crate) fn garbled(what: &impl fmt::Display) -> Self {
        Self::new(
            format!("what answers is no MQTT broker: it sent {what}"),
            "1883 is the usual port, 8883 with mqtts://; its web socket's port is another",
        )
    }

    /// A refusal by its code (mqtt-v3.1.1, table 3.1).
    pub(crate) fn refused(code: u8, has_password: bool) -> Self {
        let (what, hint) = match (code, has_password) {
            (4 | 5, true) => (
                "the broker refuses the user or the password",
                "the user stands in --mqtt as mqtt://USER@HOST, the password in --mqtt-password-file or GRIDEYE_MQTT_PASSWORD; mosquitto_passwd sets one, and Home Assistant's add-on takes those of its own users",
            ),
            (4 | 5, false) => (
                "the broker wants a user and a password",
                "--mqtt mqtt://USER@HOST with --mqtt-password-file FILE, or the password in GRIDEYE_MQTT_PASSWORD",
            ),
            (1, _) => (
                "the broker does not speak MQTT 3.1.1",
                "mosquitto 1.4 or later does",
            ),
            (2, _) => (
                "the broker refuses the name of this program",
                "another --mqtt-topic gives it another name",
            ),
            (3, _) => ("the broker says that it cannot serve now", AGAIN),
            _ => {
                let what = format!("the broker refuses the connection with code {code}");
                return Self::new(what, "the broker's log may say why");
            }
        };
        Self::new(what, hint)
    }
}
