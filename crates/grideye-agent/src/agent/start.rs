//! Starts an agent: one thread per bus, one for uploads, one for the spool.

use super::handle::AgentHandle;
use super::threads::{AnyBus, BusThread, Ended, Running, STACK_BYTES};
use crate::bus::HUNG_AFTER;
use crate::clock::{Clock, unsigned_ns};
use crate::config::{BusConfig, Config, SpoolMode};
use crate::deliver::{Http, Pace, Scheduler, Spooler, client};
use crate::health::Identity;
use crate::log::Log;
use crate::queue::{Ring, Shared};
use crate::spool::{Folder, FolderError, Limits, OpenError, Spool};
use serde_json::json;
use std::hash::{BuildHasher as _, RandomState};
use std::io;
use std::sync::Arc;
use std::time::Duration;

/// Why an agent did not start, and how to fix it.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum StartError {
    /// The system could not create the named thread.
    #[error("cannot start thread {0}: {1}\nhint: is the system out of memory?")]
    Thread(String, io::Error),
    /// Another agent uses the spool's folder, or a later version wrote it.
    #[error(transparent)]
    Spool(#[from] FolderError),
    /// No folder is named for the spool.
    #[error(
        "spool.folder: expected a folder, found none\nhint: under [spool], write folder = \"/home/pi/spool\" (any folder that this user may write), or mode = \"ram\" for no spool; systemd gives a folder with StateDirectory=grideye-agent"
    )]
    NoSpoolFolder,
    /// No collector is named.
    #[error(
        "no collector is named\nhint: paste the line that `grideye enroll DEVICE` prints on the collector's machine; or, for plain HTTP within a network that you trust, collector = \"http://HOST:8833\" in the configuration"
    )]
    NoCollector,
    /// The credentials that joining wrote are unusable.
    #[error(
        "{0}\nhint: join again: paste the line that `grideye enroll DEVICE` prints on the collector's machine"
    )]
    Credentials(String),
    /// Two sensors share this name.
    #[error("duplicate sensor {0}\nhint: name each bus and each address once")]
    SensorTwice(String),
}

/// The agent.
#[derive(Debug)]
pub struct Agent;

/// An agent's parameters, except its buses.
#[derive(Debug, Clone)]
pub struct Start {
    /// The configuration. Its buses are ignored: [`Agent::start`] takes them with their openers.
    pub config: Config,
    /// The device's name if the configuration has none.
    pub host_name: String,
    /// The boot's name, different at each start, because sequence numbers start again with it.
    pub boot: String,
    /// Stop reading each sensor after exactly this many frames.
    pub frames_limit: Option<u64>,
    /// A bus operation that takes this long counts as hung.
    pub hung_after: Duration,
}

impl Start {
    /// A boot with a random name, without a frame limit.
    #[must_use]
    pub fn new(config: Config, host_name: impl Into<String>) -> Self {
        Self {
            config,
            host_name: host_name.into(),
            // 64 random bits: the standard library seeds its hash maps from the system's randomness.
            boot: format!("{:016x}", RandomState::new().hash_one("boot")),
            frames_limit: None,
            hung_after: HUNG_AFTER,
        }
    }
    pub(crate) fn device(&self) -> &str {
        self.config.device.as_deref().unwrap_or(&self.host_name)
    }
}

impl Agent {
    /// Starts a thread for each bus, one that delivers, and one that writes the spool. If the spool's disk fails, logs
    /// it and keeps the frames in memory.
    ///
    /// # Errors
    /// [`StartError`].
    pub fn start(
        start: Start,
        buses: Vec<(BusConfig, AnyBus)>,
        clock: Arc<dyn Clock>,
        log: Log,
    ) -> Result<AgentHandle, StartError> {
        let names = sensor_names(&buses)?;
        let (device, boot) = (start.device().to_owned(), start.boot);
        let agent = start.config;
        let collector = agent.collector.clone().ok_or(StartError::NoCollector)?;
        let client = client(&agent.credentials, agent.request_timeout);
        let client = client.map_err(StartError::Credentials)?;
        let set_up = set_up(&agent, &names, &buses);
        let http = Http::new(&collector, client, &agent, &set_up);
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
                frames_limit: start.frames_limit,
                hung_after: start.hung_after,
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
        let shared = Arc::clone(&handle.shared);
        let timed = Arc::clone(&shared);
        let now = Box::new(move || (timed.now(), unsigned_ns(clock.boot())));
        let mut scheduler = Scheduler::new(http, pace, shared, now, log);
        spawn_until_ended("upload", &handle.uploading, move || scheduler.run())?;
        Ok(handle)
    }
}

/// The settings that the collector shows about this device.
fn set_up(agent: &Config, names: &[String], buses: &[(BusConfig, AnyBus)]) -> serde_json::Value {
    let sensors = buses.iter().flat_map(|(bus, _)| &bus.sensors);
    let sensors = names.iter().zip(sensors).map(|(name, sensor)| {
        let (rate_hz, average) = (sensor.rate.fps(), sensor.moving_average);
        let set_up = json!({ "part": "AMG8833", "rate_hz": rate_hz, "moving_average": average });
        (name.clone(), set_up)
    });
    let sensors: serde_json::Map<_, _> = sensors.collect();
    json!({
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
                return Err(StartError::SensorTwice(sensor));
            }
            names.push(sensor);
        }
    }
    Ok(names)
}

/// Opens the configured spool, and logs its guarantee.
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
    let folder = config.spool.folder.clone();
    let folder = folder.ok_or(StartError::NoSpoolFolder)?;
    let limits = Limits::new(config.spool.bytes_max, config.spool.free_bytes_min);
    spooler.open(Box::new(move || {
        let disk = Box::new(Folder::open(&folder)?);
        let spool = Spool::open(disk, limits, &device, &boot, &sensors);
        spool.map_err(|error| match error {
            OpenError::Disk(error) => FolderError::Unusable(folder.clone(), error),
            error => FolderError::Newer(folder.clone(), error),
        })
    }))?;
    log.info(format!("spool: {}", config.guarantee()));
    Ok(())
}

/// Starts a thread and tells [`Running`] when it ends, even by a panic.
fn spawn_until_ended(
    name: &str,
    running: &Arc<Running>,
    work: impl FnOnce() + Send + 'static,
) -> Result<(), StartError> {
    let running = Arc::clone(running);
    spawn(name, move || {
        let _ended = Ended(&running, 0);
        work();
    })
}

fn spawn(name: &str, work: impl FnOnce() + Send + 'static) -> Result<(), StartError> {
    let thread = std::thread::Builder::new().name(name.to_owned());
    let spawned = thread.stack_size(STACK_BYTES).spawn(work).map(drop);
    spawned.map_err(|source| StartError::Thread(name.to_owned(), source))
}
