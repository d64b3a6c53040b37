//! The configuration as values, and what a power cut can cost with it.

use crate::join::{Credentials, Joined};
use crate::limits::{LOOK_EVERY, SYNC_MAX};
use amg8833::{Address, FrameRate};
use grideye_text::Refusal;
use std::fmt;
use std::net::SocketAddr;
use std::path::PathBuf;
use std::time::Duration;

/// Default size of the ring in frames: 17 minutes of one sensor at 10 Hz, in about 2 MB.
pub const RING_FRAMES_DEFAULT: usize = 10_000;

/// Default time a record waits in memory before it goes to the disk.
pub const SPOOL_AFTER_DEFAULT: Duration = Duration::from_secs(10);

/// Default number of backlog frames sent per second.
pub const BACKLOG_PER_S_DEFAULT: u32 = 1000;

/// The agent's checked configuration.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Config {
    /// This agent's name. `None`: the host's name.
    pub device: Option<String>,
    /// Where to deliver: `http://192.168.1.20:8833`. `None`: the joined collector.
    pub collector: Option<String>,
    /// The file that joining wrote, if it is named or was found.
    pub joined: Option<PathBuf>,
    /// Token and certificates; [`Self::join`] adds them.
    pub credentials: Credentials,
    /// The encoding of a post's body.
    pub body: Body,
    /// Pause between two posts while there is no backlog.
    pub post_every: Duration,
    /// Frames kept in memory until the collector has stored them. At the limit the oldest is dropped and counted.
    pub ring_frames: usize,
    /// Time limit of one post, from connecting to the end of the answer.
    pub request_timeout: Duration,
    /// The spool's settings.
    pub spool: SpoolConfig,
    /// Loopback address that serves the agent's health. `None`: not served.
    pub health: Option<SocketAddr>,
    /// The buses; each has its own reading thread.
    pub buses: Vec<BusConfig>,
}

impl Config {
    /// Nominal frames per second of all sensors together.
    #[must_use]
    pub fn rate_hz(&self) -> u32 {
        let sensors = self.buses.iter().flat_map(|bus| &bus.sensors);
        sensors.map(|sensor| u32::from(sensor.rate.fps())).sum()
    }

    /// Adds the settings that joining wrote.
    ///
    /// # Errors
    /// [`ConfigError::TwoCollectors`] if the configuration also names a collector.
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

/// The encoding of a post's body; meaning and checks are the same.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Body {
    /// JSON, readable for people.
    #[default]
    Json,
    /// Bytes: a quarter as long and cheaper on both sides. A collector that does not know them gets JSON.
    Binary,
}

/// Settings of the spool, which stores records on a disk while the collector is away.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SpoolConfig {
    /// When frames go to the disk.
    pub mode: SpoolMode,
    /// The spool's folder. `None`: the folder that systemd provides.
    pub folder: Option<PathBuf>,
    /// Maximum size of the spool in bytes. At the limit the oldest backlog is dropped and counted.
    pub bytes_max: u64,
    /// Bytes of the disk that the spool leaves free.
    pub free_bytes_min: u64,
    /// Maximum number of backlog records sent per second.
    pub backlog_per_s: u32,
}

/// When frames go to the disk.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SpoolMode {
    /// Never.
    Ram,
    /// When one has waited this long for its acknowledgement; then all records in memory.
    Outage {
        /// How long.
        after: Duration,
    },
    /// At once, with a sync at this interval.
    Always {
        /// Time between syncs.
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
    /// The device file.
    pub path: PathBuf,
    /// The sensors, each at another address.
    pub sensors: Vec<SensorConfig>,
}

/// One sensor.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SensorConfig {
    /// Its I2C address.
    pub address: Address,
    /// Nominal frame rate; real sensors deviate by several percent.
    pub rate: FrameRate,
    /// Whether the chip averages two frames ("twice moving average", AMG88 spec §4-11-7).
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

    /// The sensor's name, unique on this device: `i2c-1:0x69`.
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

/// The maximum loss from a power cut or a killed process while the disk syncs within [`SYNC_MAX`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Guarantee {
    /// Maximum number of lost frames, all sensors together.
    pub frames: u64,
    /// The lost frames were read in this time before the power cut.
    pub seconds: f64,
    /// Whether it depends on the disk.
    pub needs_disk: bool,
}

/// How fast a sensor's clock can be against its nominal rate.
const FASTEST_CLOCK: f64 = 1.06;

impl fmt::Display for Guarantee {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            formatter,
            "a power cut or a killed agent costs at most {} frames: those read in the last {:.2} s and not acknowledged",
            self.frames, self.seconds
        )?;
        if self.needs_disk {
            let sync_s = SYNC_MAX.as_secs_f64();
            write!(formatter, ", if the disk syncs within {sync_s:.3} s")?;
        }
        Ok(())
    }
}

impl Config {
    /// The maximum loss from a power cut while the disk syncs within [`SYNC_MAX`]. Without a disk and in mode `ram`: the whole
    /// ring.
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

/// Maximum size of the configuration file in bytes.
pub const CONFIG_BYTES_MAX: usize = 64 * 1024;

/// Why a configuration was rejected, where, and how to fix it.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ConfigError {
    /// Too long, not TOML, or a key that is unknown, missing, of the wrong type or out of range: `file:line:column` counted from
    /// 1, expected and found, and what to do.
    #[error(transparent)]
    Refused(#[from] Refusal),
    /// The configuration names one collector, and the agent joined another.
    #[error(
        "the configuration names collector {0}, but this agent joined {1}\nhint: remove the line `collector` from the configuration, or the file collector.toml"
    )]
    TwoCollectors(String, String),
}
