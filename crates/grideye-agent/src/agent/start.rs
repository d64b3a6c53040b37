//! How an agent starts: a thread for each bus, one for the uploads, one for the spool.

use super::bus_thread::{AnyBus, BusThread};
use super::error::StartError;
use super::handle::AgentHandle;
use super::threads::{Running, spawn, spawn_until_ended};
use crate::bus::HUNG_AFTER;
use crate::clock::Clock;
use crate::config::{BusConfig, Config, SpoolMode};
use crate::deliver::{Http, Pace, Spooler, Uploader, transport};
use crate::health::Identity;
use crate::log::{Level, Log};
use crate::queue::{Ring, Shared};
use crate::spool::{Folder, FolderError, Limits, OpenError, Spool};
use std::hash::{BuildHasher as _, RandomState};
use std::sync::Arc;
use std::time::Duration;

/// The agent.
#[derive(Debug)]
pub struct Agent;

/// What an agent is to run with, beside its buses.
#[derive(Debug, Clone)]
pub struct Start {
    /// The configuration. Its buses are not used: they are handed in open-able.
    pub config: Config,
    /// The device's name if the configuration gives none.
    pub host_name: String,
    /// The name of this run, different at each start: sequence numbers begin again with it.
    pub boot: String,
    /// Stop reading each sensor after exactly this many frames read.
    pub frames_limit: Option<u64>,
    /// How long an operation on a bus may take until it counts as hung.
    pub hung_after: Duration,
}

impl Start {
    /// A run with a name of its own, without a limit of frames.
    #[must_use]
    pub fn new(config: Config, host_name: impl Into<String>) -> Self {
        Self {
            config,
            host_name: host_name.into(),
            boot: random_name(),
            frames_limit: None,
            hung_after: HUNG_AFTER,
        }
    }

    /// The name under which the frames are kept.
    #[must_use]
    pub fn device(&self) -> &str {
        self.config.device.as_deref().unwrap_or(&self.host_name)
    }
}

impl Agent {
    /// Starts a thread for each bus, one that delivers, and one that writes the spool.
    ///
    /// A spool whose disk does not work is no reason not to start: the frames stay in memory, and that is said.
    ///
    /// # Errors
    /// [`StartError`] if the sensors' names are not unique, if another agent uses the spool, or if the system gives no
    /// threads.
    pub fn start(
        start: Start,
        buses: Vec<(BusConfig, AnyBus)>,
        clock: Arc<dyn Clock>,
        log: Log,
    ) -> Result<AgentHandle, StartError> {
        let names = sensor_names(&buses)?;
        let device = start.device().to_owned();
        let Start {
            config: agent,
            boot,
            frames_limit,
            hung_after,
            ..
        } = start;
        let (collector, http) = http(&agent, &names, &buses)?;
        let identity = Identity {
            device: device.clone(),
            boot: boot.clone(),
            collector: collector.clone(),
            spool_mode: agent.spool.mode.name(),
            sensors: names.clone(),
        };
        let ring = Ring::new(agent.ring_frames, &device, &boot, names.clone());
        let shared = Arc::new(Shared::new(ring, None));
        let mut spooler = Spooler::new(Arc::clone(&shared), agent.spool.mode, log.clone());
        open_spool(&mut spooler, &agent, names, (device, boot.clone()), &log)?;
        let running = Arc::new(Running::new(buses.len()));
        let mut handle = AgentHandle {
            shared,
            running,
            uploading: Arc::new(Running::new(1)),
            spooling: Arc::new(Running::new(1)),
            bus_names: Vec::new(),
            identity,
        };
        let mut first_stream = 0;
        for (config, bus) in buses {
            let name = config.path.display().to_string();
            let thread = BusThread {
                first_stream,
                frames_limit,
                hung_after,
                shared: Arc::clone(&handle.shared),
                running: Arc::clone(&handle.running),
                index: handle.bus_names.len(),
                clock: Arc::clone(&clock),
                log: log.clone(),
                config,
            };
            first_stream += thread.config.sensors.len();
            handle.bus_names.push(name.clone());
            spawn(&name, move || bus.0(thread))?;
        }
        let pace = Pace {
            collector,
            seed: RandomState::new().hash_one(&boot),
            boot,
            post_every: agent.post_every,
            request_timeout: agent.request_timeout,
            backlog_per_s: agent.spool.backlog_per_s,
        };
        spawn_until_ended("spool", &handle.spooling, move || spooler.run())?;
        let mut uploader = Uploader::new(http, pace, Arc::clone(&handle.shared), clock, log);
        spawn_until_ended("upload", &handle.uploading, move || uploader.run())?;
        Ok(handle)
    }
}

/// The collector's address, and what posts to it.
fn http(
    agent: &Config,
    names: &[String],
    buses: &[(BusConfig, AnyBus)],
) -> Result<(String, Http), StartError> {
    let collector = agent.collector.clone().ok_or(StartError::NoCollector)?;
    let client = transport::client(&agent.credentials, agent.request_timeout)
        .map_err(StartError::Credentials)?;
    let http = Http::new(&collector, client, agent.credentials.token.clone())
        .saying(&set_up(agent, names, buses))
        .with_body(agent.body);
    Ok((collector, http))
}

/// What a person who looks at the device wants to know of its configuration.
fn set_up(agent: &Config, names: &[String], buses: &[(BusConfig, AnyBus)]) -> serde_json::Value {
    let sensors = buses.iter().flat_map(|(bus, _)| &bus.sensors);
    let sensors: serde_json::Map<_, _> = names
        .iter()
        .zip(sensors)
        .map(|(name, sensor)| {
            let set_up = serde_json::json!({
                "part": "AMG8833",
                "rate_hz": sensor.rate.fps(),
                "moving_average": sensor.moving_average,
            });
            (name.clone(), set_up)
        })
        .collect();
    serde_json::json!({
        "post_every_ms": u64::try_from(agent.post_every.as_millis()).unwrap_or(u64::MAX),
        "ring_frames": agent.ring_frames,
        "spool": agent.spool.mode.name(),
        "sensors": sensors,
    })
}

fn sensor_names(buses: &[(BusConfig, AnyBus)]) -> Result<Vec<String>, StartError> {
    let mut names = Vec::new();
    for (bus, _) in buses {
        for sensor in &bus.sensors {
            let sensor = bus.sensor_id(sensor);
            if names.contains(&sensor) {
                return Err(StartError::SensorTwice { sensor });
            }
            names.push(sensor);
        }
    }
    Ok(names)
}

/// Opens the spool that the configuration asks for, and says what it is good for.
fn open_spool(
    spooler: &mut Spooler,
    config: &Config,
    sensors: Vec<String>,
    (device, boot): (String, String),
    log: &Log,
) -> Result<(), StartError> {
    if config.spool.mode == SpoolMode::Ram {
        return Ok(());
    }
    let folder = config
        .spool
        .folder
        .clone()
        .ok_or(StartError::NoSpoolFolder)?;
    let limits = Limits::new(config.spool.bytes_max, config.spool.free_bytes_min);
    spooler.open(Box::new(move || {
        let disk = Box::new(Folder::open(&folder)?);
        let spool = Spool::open(disk, limits, &device, &boot, &sensors);
        let folder = folder.clone();
        spool.map_err(|error| match error {
            OpenError::Disk(source) => FolderError::Unusable { folder, source },
            error => FolderError::Newer { folder, error },
        })
    }))?;
    log.line(Level::Info, format!("spool: {}", config.guarantee()));
    Ok(())
}

/// 64 random bits in hexadecimal: the standard library seeds its hash maps with the system's randomness.
fn random_name() -> String {
    format!("{:016x}", RandomState::new().hash_one("boot"))
}
