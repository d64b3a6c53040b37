//! The configuration as values: what each part of the agent is told, and what a loss of power can cost.

use crate::join::{Credentials, Joined};
use crate::limits::{LOOK_EVERY, SYNC_MAX};
use amg8833::{Address, FrameRate};
use std::fmt;
use std::net::SocketAddr;
use std::path::PathBuf;
use std::time::Duration;

/// Frames that the ring holds unless told otherwise: 17 minutes of one sensor at 10 Hz, in about 2 MB.
pub const RING_FRAMES_DEFAULT: usize = 10_000;

/// How long a record waits in memory before it goes to the disk, unless told otherwise.
pub const SPOOL_AFTER_DEFAULT: Duration = Duration::from_secs(10);

/// Frames of the backlog that go to the collector in a second, unless told otherwise.
pub const BACKLOG_PER_S_DEFAULT: u32 = 1000;

/// The agent's configuration, checked.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Config {
    /// This agent's name. `None`: the host's.
    pub device: Option<String>,
    /// Where to deliver: `http://192.168.1.20:8833`. `None`: as joining said.
    pub collector: Option<String>,
    /// The file that joining left, if it is named.
    pub joined: Option<PathBuf>,
    /// Token and certificates, which [`Self::join`] adds.
    pub credentials: Credentials,
    /// The form of a post's body.
    pub body: Body,
    /// Pause between two posts while there is no backlog.
    pub post_every: Duration,
    /// Frames held in memory until the collector has them on disk; beyond, the oldest is dropped and counted.
    pub ring_frames: usize,
    /// How long one post may take from connecting to the end of the answer.
    pub request_timeout: Duration,
    /// What is kept on a disk.
    pub spool: SpoolConfig,
    /// Where the agent says how it does, on this machine alone. `None`: nowhere.
    pub health: Option<SocketAddr>,
    /// The buses, each read by a thread of its own.
    pub buses: Vec<BusConfig>,
}

impl Config {
    /// Frames a second of all sensors together, nominally.
    #[must_use]
    pub fn rate_hz(&self) -> u32 {
        let sensors = self.buses.iter().flat_map(|bus| &bus.sensors);
        sensors.map(|sensor| u32::from(sensor.rate.fps())).sum()
    }

    /// Adds what joining left.
    ///
    /// # Errors
    /// [`ConfigError::TwoCollectors`] if the configuration names one itself.
    pub fn join(&mut self, joined: Joined) -> Result<(), ConfigError> {
        if let Some(named) = &self.collector {
            return Err(ConfigError::TwoCollectors(named.clone(), joined.collector));
        }
        self.collector = Some(joined.collector);
        self.credentials = joined.credentials;
        self.device = self.device.take().or(joined.device);
        Ok(())
    }
}

/// The form of a post's body: the same meaning, the same checks.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Body {
    /// JSON, which a person can read.
    #[default]
    Json,
    /// Bytes, a quarter as long and cheaper on both sides. A collector that does not know them gets JSON.
    Binary,
}

/// What is kept on a disk while the collector is away.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SpoolConfig {
    /// When frames go to the disk.
    pub mode: SpoolMode,
    /// Where to. `None`: the caller takes the folder that systemd gives.
    pub folder: Option<PathBuf>,
    /// Bytes that the spool takes at most; beyond, the oldest backlog is dropped and counted.
    pub bytes_max: u64,
    /// Bytes of the disk that the spool leaves free.
    pub free_bytes_min: u64,
    /// Records of the backlog that go to the collector in a second at most.
    pub backlog_per_s: u32,
}

/// When frames go to the disk.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SpoolMode {
    /// Never.
    Ram,
    /// When one has not been acknowledged for so long; then all that are in memory.
    Outage {
        /// The time.
        after: Duration,
    },
    /// At once, and synced so often.
    Always {
        /// From one sync to the next.
        sync_every: Duration,
    },
}

impl SpoolMode {
    /// `ram`, `outage` or `always`.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Ram => "ram",
            Self::Outage { .. } => "outage",
            Self::Always { .. } => "always",
        }
    }
}

/// One I2C bus and the sensors on it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct BusConfig {
    /// The bus' device file.
    pub path: PathBuf,
    /// The sensors, at different addresses.
    pub sensors: Vec<SensorConfig>,
}

/// One sensor.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SensorConfig {
    /// Where it is on the bus.
    pub address: Address,
    /// How often it measures, nominally: a real sensor is off by several per cent.
    pub rate: FrameRate,
    /// Whether the chip itself averages two frames ("twice moving average", AMG88 spec §4-11-7).
    pub moving_average: bool,
}

impl BusConfig {
    /// A bus with one sensor at 10 Hz.
    #[must_use]
    pub fn with_one_sensor(path: impl Into<PathBuf>, address: Address) -> Self {
        let sensors = vec![SensorConfig::at(address)];
        let path = path.into();
        Self { path, sensors }
    }

    /// The sensor's name among all of this device: `i2c-1:0x69`.
    #[must_use]
    pub fn sensor_id(&self, sensor: &SensorConfig) -> String {
        let bus = self.path.file_name().unwrap_or(self.path.as_os_str());
        format!("{}:{}", bus.to_string_lossy(), sensor.address)
    }
}

impl SensorConfig {
    /// A sensor at 10 Hz without averaging.
    #[must_use]
    pub const fn at(address: Address) -> Self {
        Self {
            address,
            rate: FrameRate::Ten,
            moving_average: false,
        }
    }
}

/// What a loss of power or of the process can cost on a disk that syncs within [`SYNC_MAX`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Guarantee {
    /// Frames of all sensors together that may be lost at most.
    pub frames: u64,
    /// The time in which they were read, and not acknowledged, before the loss.
    pub seconds: f64,
    /// Whether it is the disk that keeps them.
    pub needs_disk: bool,
}

/// The fastest clock of a sensor against its nominal rate.
const FASTEST_CLOCK: f64 = 1.06;

impl fmt::Display for Guarantee {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            formatter,
            "a loss of power or a killed agent costs at most the {} frames that were read in the last {:.2} s and are not acknowledged",
            self.frames, self.seconds
        )?;
        if self.needs_disk {
            let sync_s = SYNC_MAX.as_secs_f64();
            write!(formatter, ", while the disk syncs within {sync_s:.3} s")?;
        }
        Ok(())
    }
}

impl Config {
    /// What a loss of power can cost while the disk works, and syncs within [`SYNC_MAX`]. Without it, and in mode `ram`, it is the whole ring.
    #[must_use]
    pub fn guarantee(&self) -> Guarantee {
        let rate_hz = f64::from(self.rate_hz()) * FASTEST_CLOCK;
        let ring_frames = u32::try_from(self.ring_frames).unwrap_or(u32::MAX);
        let seconds = match self.spool.mode {
            SpoolMode::Ram => f64::from(ring_frames) / rate_hz.max(1.0),
            SpoolMode::Outage { after: time } | SpoolMode::Always { sync_every: time } => {
                (time + LOOK_EVERY + SYNC_MAX).as_secs_f64()
            }
        };
        let frames = (seconds * rate_hz).ceil().min(f64::from(ring_frames));
        Guarantee {
            #[expect(
                clippy::as_conversions,
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "whole, positive, and at most the size of the ring"
            )]
            frames: frames as u64,
            seconds,
            needs_disk: self.spool.mode != SpoolMode::Ram,
        }
    }
}

/// Length of the configuration file at most, in bytes.
pub const CONFIG_BYTES_MAX: usize = 64 * 1024;

/// Why a configuration was refused, where, and what to do.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ConfigError {
    /// Not TOML, or a key that is unknown, missing, of the wrong type or out of range: `file:line:column` from 1, what was
    /// found and expected, and what to do.
    #[error("{0}: {1}\nhint: {2}")]
    Refused(String, String, String),
    /// The configuration names a collector, and the agent joined another.
    #[error(
        "the configuration names the collector {0}, and this agent joined {1}\nhint: take the line `collector` out of the configuration, or remove the file collector.toml"
    )]
    TwoCollectors(String, String),
    /// This file is longer than [`CONFIG_BYTES_MAX`]: so many bytes.
    #[error(
        "{0}: expected at most {CONFIG_BYTES_MAX} bytes, found {1}\nhint: is this really agent.toml?"
    )]
    TooLong(String, usize),
}
