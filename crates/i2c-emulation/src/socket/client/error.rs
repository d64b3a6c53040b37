//! Client errors, for people, drivers and the bus layer.

use crate::adapter::{BusFault, Fault};
use crate::socket::wire::ByeReason;
use embedded_hal::i2c::{self, ErrorKind, NoAcknowledgeSource};
use std::io;
use std::path::PathBuf;
use std::time::Duration;

/// Why a client got no answer, or an error.
#[derive(Debug, thiserror::Error)]
#[expect(missing_docs, reason = "the messages say what each is")]
pub enum ClientError {
    #[error("{}", fault_text(*fault))]
    Fault {
        fault: Fault,
        completed: usize,
        /// The errno that a program at `/dev/i2c-N` would see; `None` if the adapter hides the fault.
        errno: Option<i32>,
    },
    #[error("refused: {text}")]
    Refused { errno: i32, text: String },
    /// The adapter carried out fewer messages than requested without an error (mode `virtio`).
    #[error("the adapter carried out {completed} of {messages} messages")]
    Short { completed: usize, messages: usize },
    #[error(
        "{found} {unit}, at most {most} are possible\nhint: cut the transfer into several, if the target allows it"
    )]
    TooLong {
        unit: &'static str,
        found: usize,
        most: usize,
    },
    #[error(
        "cannot connect to {0}: {1}\nhint: start the server first: grideye emulate --scene SCENE --socket {0}"
    )]
    NoServer(PathBuf, #[source] io::Error),
    #[error(
        "{0} does not speak the protocol of i2c-emulation: {1}\nhint: is that the right socket?"
    )]
    NotOurs(PathBuf, String),
    #[error("the server at {} turned this client away: {text}{}", path.display(), hint_of(*reason))]
    TurnedAway {
        path: PathBuf,
        reason: ByeReason,
        text: String,
    },
    #[error("the server at {} has no bus {bus}\nhint: it has {}", path.display(), list(buses))]
    NoSuchBus {
        path: PathBuf,
        bus: u32,
        buses: Vec<u32>,
    },
    /// No answer came in this time. The connection is closed, since a late answer would be taken for the next one's.
    #[error(
        "no answer from {0} within {1:?}\nhint: is the server stopped, or the bus held by another client?"
    )]
    Timeout(PathBuf, Duration),
    #[error("the server at {} went away{}\nhint: start it again, and connect again", .0.display(), .1.as_ref().map(|text| format!(": {text}")).unwrap_or_default())]
    ServerGone(PathBuf, Option<String>),
}

impl ClientError {
    pub(super) fn ends_connection(&self) -> bool {
        matches!(
            self,
            Self::NotOurs { .. } | Self::Timeout { .. } | Self::ServerGone { .. }
        )
    }
}

impl BusFault for ClientError {
    fn fault(&self) -> Fault {
        match self {
            Self::Fault { fault, .. } => *fault,
            Self::Timeout { .. } => Fault::Timeout,
            Self::Refused { .. } | Self::TooLong { .. } | Self::Short { .. } => Fault::Bus,
            _ => Fault::Gone,
        }
    }
}

impl i2c::Error for ClientError {
    fn kind(&self) -> ErrorKind {
        match self {
            Self::Fault { fault, .. } => match fault {
                Fault::NackAddress => ErrorKind::NoAcknowledge(NoAcknowledgeSource::Address),
                Fault::NackData => ErrorKind::NoAcknowledge(NoAcknowledgeSource::Data),
                Fault::ArbitrationLost => ErrorKind::ArbitrationLoss,
                Fault::Bus => ErrorKind::Bus,
                Fault::Timeout | Fault::Gone => ErrorKind::Other,
            },
            _ => ErrorKind::Other,
        }
    }
}

const fn fault_text(fault: Fault) -> &'static str {
    match fault {
        Fault::NackAddress => "nobody acknowledged the address",
        Fault::NackData => "the target did not acknowledge a byte",
        Fault::Bus => "the bus failed",
        Fault::ArbitrationLost => "another controller won the bus",
        Fault::Timeout => "the bus was held for too long",
        Fault::Gone => "the adapter is gone",
    }
}

const fn hint_of(reason: ByeReason) -> &'static str {
    match reason {
        ByeReason::Version => "\nhint: use client and server of the same release",
        ByeReason::TooManyClients => "\nhint: close unused clients",
        _ => "",
    }
}

fn list(buses: &[u32]) -> String {
    let numbers: Vec<String> = buses.iter().map(|number| format!("bus {number}")).collect();
    numbers.join(", ")
}
