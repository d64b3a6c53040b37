//! Why an agent did not start, and what to do about it.

use crate::spool::FolderError;
use std::io;

/// Why an agent did not start.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum StartError {
    /// The system gave no thread.
    #[error("no thread for {name}: {source}\nhint: is the system out of memory?")]
    Thread {
        /// What the thread was for.
        name: String,
        /// What the system said.
        source: io::Error,
    },
    /// Another agent uses the spool's folder, or a later version wrote it.
    #[error("{0}")]
    Spool(#[from] FolderError),
    /// No folder was named for the spool.
    #[error(
        "spool.folder: expected a folder, found none\nhint: name one, for example /var/lib/grideye-agent/spool; systemd gives one with StateDirectory=grideye-agent"
    )]
    NoSpoolFolder,
    /// Nobody said where to deliver.
    #[error(
        "no collector is named\nhint: paste the line that `grideye enroll DEVICE` prints on the collector's machine; or, for plain HTTP within a network that you trust, collector = \"http://HOST:8833\" in the configuration"
    )]
    NoCollector,
    /// The credentials that joining left cannot be used.
    #[error(
        "{0}\nhint: join again: paste the line that `grideye enroll DEVICE` prints on the collector's machine"
    )]
    Credentials(String),
    /// Two sensors have the same name.
    #[error("sensor {sensor} is there twice\nhint: name each bus and each address once")]
    SensorTwice {
        /// The sensor.
        sensor: String,
    },
}
