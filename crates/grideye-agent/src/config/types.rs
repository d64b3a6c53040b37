//! The configuration as values: what each part of the agent is told.

use super::error::ConfigError;
use crate::join::{Credentials, Joined};
use amg8833::{Address, FrameRate};
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
    /// The name under which this agent's frames are kept. `None`: the caller takes the host's name.
    pub device: Option<String>,
    /// Where to deliver, without a trailing slash: `http://192.168.1.20:8833`. `None`: as joining said.
    pub collector: Option<String>,
    /// The file that `grideye-agent join` wrote, if it is named. The caller reads it.
    pub joined: Option<PathBuf>,
    /// Token and certificates. The file does not hold them; the caller adds what joining left ([`Self::join`]).
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
            return Err(ConfigError::TwoCollectors {
                named: named.clone(),
                joined: joined.collector,
            });
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
        Self {
            path: path.into(),
            sensors: vec![SensorConfig::at(address)],
        }
    }

    /// The sensor's name among all of this device: `i2c-1:0x69`.
    #[must_use]
    pub fn sensor_id(&self, sensor: &SensorConfig) -> String {
        let bus = self.path.file_name().map_or_else(
            || self.path.to_string_lossy(),
            |name| name.to_string_lossy(),
        );
        format!("{bus}:{}", sensor.address)
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
