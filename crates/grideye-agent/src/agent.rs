//! The agent as a whole: a thread for each bus, one for the uploads, and the account of what they did.

use crate::bus::OpenBus;
use crate::clock::Clock;
use crate::config::{BusConfig, Config, SpoolMode};
use crate::courier::Pace;
use crate::health::{Health, Identity};
use crate::keeper::Keeper;
use crate::log::{Level, Log};
use crate::ring::Ring;
use crate::shared::Shared;
use crate::spool::{Folder, FolderError, Limits, OpenError, Spool};
use crate::transport;
use crate::upload::{Http, Uploader};
use crate::watch::{HUNG_AFTER, Watched};
use crate::worker::{Sink, Worker};
use grideye_recording::Record;
use grideye_recording::wire::Account;
use std::collections::BTreeMap;
use std::fmt;
use std::hash::{BuildHasher as _, RandomState};
use std::io;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Condvar, Mutex, PoisonError};
use std::time::{Duration, Instant};

/// How long [`AgentHandle::stop`] waits for the bus threads; one that hangs longer in a transfer is left behind.
pub const BUS_STOP_MAX: Duration = Duration::from_secs(3);
/// How long [`AgentHandle::stop`] waits beyond its time for the uploader; one that hangs in a post is left behind.
pub const UPLOAD_STOP_MAX: Duration = Duration::from_secs(1);
/// How long [`AgentHandle::stop`] waits for what is left in memory to be on the disk.
pub const KEEPER_STOP_MAX: Duration = Duration::from_secs(5);
/// A full ring is said once in so many records, not for each.
const RING_FULL_SAID_EVERY: u64 = 100;
/// Stack of each thread. Only what is touched becomes resident.
const STACK_BYTES: usize = 1 << 20;

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

/// A bus of any kind, ready to be read by a thread of the agent.
pub struct AnyBus(Box<dyn FnOnce(BusThread) + Send>);

impl AnyBus {
    /// From something that opens a bus. The bus itself is opened on its thread and stays there.
    pub fn new(opener: impl OpenBus + Send + 'static) -> Self {
        Self(Box::new(move |thread| thread.run(opener)))
    }
}

impl fmt::Debug for AnyBus {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str("AnyBus")
    }
}

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

impl Agent {
    /// Starts a thread for each bus, one that delivers, and one that keeps the spool.
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
        let mut keeper = Keeper::new(Arc::clone(&shared), agent.spool.mode, log.clone());
        open_spool(&mut keeper, &agent, names, (device, boot.clone()), &log)?;
        let running = Arc::new(Running::new(buses.len()));
        let mut handle = AgentHandle {
            shared,
            running,
            uploading: Arc::new(Running::new(1)),
            keeping: Arc::new(Running::new(1)),
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
        spawn_until_ended("spool", &handle.keeping, move || keeper.run())?;
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

/// A running agent. Dropping it stops the reading without waiting and without delivering the rest.
#[derive(Debug)]
pub struct AgentHandle {
    shared: Arc<Shared>,
    running: Arc<Running>,
    uploading: Arc<Running>,
    keeping: Arc<Running>,
    bus_names: Vec<String>,
    identity: Identity,
}

/// What an agent did, by sensor.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Summary {
    /// The account of each sensor, by its name.
    pub sensors: BTreeMap<String, SensorSummary>,
    /// Buses whose thread hung in a transfer and was left behind.
    pub hung_buses: Vec<String>,
}

/// What became of one sensor's frames.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct SensorSummary {
    /// The agent's account.
    pub account: Account,
    /// Frames read that the collector has on disk.
    pub acknowledged: u64,
    /// Frames read that wait in the spool for the next run.
    pub on_disk: u64,
}

impl AgentHandle {
    /// How the agent does, for those who ask it on this machine.
    #[must_use]
    pub fn health(&self) -> Health {
        Health::new(Arc::clone(&self.shared), self.identity.clone())
    }

    /// Every sensor's account as of now.
    #[must_use]
    pub fn accounts(&self) -> BTreeMap<String, Account> {
        self.shared.with_ring(|ring| ring.accounts())
    }

    /// Records that the collector is not yet known to have, of all sensors together.
    #[must_use]
    pub fn held(&self) -> usize {
        self.shared.with_ring(|ring| ring.len())
    }

    /// Whether every sensor has reached its limit of frames.
    #[must_use]
    pub fn is_finished(&self) -> bool {
        self.running.left() == 0
    }

    /// Waits until [`AgentHandle::is_finished`], or for this long. Returns which.
    #[must_use]
    pub fn wait_finished(&self, timeout: Duration) -> bool {
        self.running.wait(timeout)
    }

    /// Stops reading, delivers what is left for up to `flush_for`, and says what was done.
    #[must_use]
    pub fn stop(self, flush_for: Duration) -> Summary {
        self.running.is_stopping.store(true, Ordering::SeqCst);
        self.running.wait(BUS_STOP_MAX);
        self.shared.flush_until(Instant::now() + flush_for);
        // A panic of the uploader leaves the rest in the ring, which the summary shows; so does a post that began before
        // the stop and hangs: it may last as long as a request may, and is not waited for.
        self.uploading.wait(flush_for + UPLOAD_STOP_MAX);
        self.shared.end_keeper();
        self.keeping.wait(KEEPER_STOP_MAX);
        let on_disk = self
            .shared
            .spool_if_free()
            .map_or_else(BTreeMap::new, |spool| {
                spool
                    .as_ref()
                    .map(Spool::waiting_by_sensor)
                    .unwrap_or_default()
            });
        let sensors = self.shared.with_ring(|ring| {
            let named = |(sensor, account): (String, Account)| {
                let summary = SensorSummary {
                    account,
                    acknowledged: ring.acknowledged(&sensor),
                    on_disk: on_disk.get(&sensor).copied().unwrap_or(0),
                };
                (sensor, summary)
            };
            ring.accounts().into_iter().map(named).collect()
        });
        Summary {
            sensors,
            hung_buses: self.running.still_running(&self.bus_names),
        }
    }
}

impl Drop for AgentHandle {
    fn drop(&mut self) {
        self.running.is_stopping.store(true, Ordering::SeqCst);
        self.shared.flush_until(Instant::now());
        self.shared.end_keeper();
    }
}

impl Summary {
    /// Whether every frame of every sensor was read and is on a disk, the collector's or the spool's.
    #[must_use]
    pub fn is_complete(&self) -> bool {
        let is_complete = |sensor: &SensorSummary| {
            let account = &sensor.account;
            account.missing == 0 && account.dropped.is_empty() && account.spooled == sensor.on_disk
        };
        self.hung_buses.is_empty() && self.sensors.values().all(is_complete)
    }
}

impl fmt::Display for Summary {
    /// One line a sensor: `i2c-1:0x69: 100 read = 98 stored + 2 dropped + 0 in memory; 1 missing`, and `+ 5 on disk` in
    /// front of the semicolon where the spool holds some.
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (index, (name, sensor)) in self.sensors.iter().enumerate() {
            let account = &sensor.account;
            let dropped: u64 = account.dropped.values().sum();
            let line_break = if index == 0 { "" } else { "\n" };
            write!(
                formatter,
                "{line_break}{name}: {} read = {} stored + {dropped} dropped + {} in memory",
                account.read,
                sensor.acknowledged,
                account.spooled.saturating_sub(sensor.on_disk),
            )?;
            if sensor.on_disk > 0 {
                write!(formatter, " + {} on disk", sensor.on_disk)?;
            }
            write!(formatter, "; {} missing", account.missing)?;
        }
        for bus in &self.hung_buses {
            write!(formatter, "\n{bus}: hung in a transfer")?;
        }
        Ok(())
    }
}

/// All that a bus thread needs but the bus.
struct BusThread {
    config: BusConfig,
    index: usize,
    first_stream: usize,
    frames_limit: Option<u64>,
    hung_after: Duration,
    shared: Arc<Shared>,
    running: Arc<Running>,
    clock: Arc<dyn Clock>,
    log: Log,
}

impl BusThread {
    fn run(self, opener: impl OpenBus) {
        let _ended = Ended {
            running: &self.running,
            index: self.index,
        };
        let what = (&self.config, self.frames_limit);
        let mut worker = Worker::of_bus(opener, what, Arc::clone(&self.clock), self.log.clone());
        let watched = Arc::clone(&worker.watched);
        let bus = self.config.path.display().to_string();
        std::thread::scope(|scope| {
            let watchdog = std::thread::Builder::new()
                .name("watchdog".to_owned())
                .stack_size(STACK_BYTES)
                .spawn_scoped(scope, || {
                    let what = (bus.as_str(), self.hung_after);
                    watched.watch(what, &self, self.clock.as_ref(), &self.log);
                });
            if let Err(error) = watchdog {
                self.log
                    .warning(format!("{bus}: no thread to watch it: {error}"));
            }
            let _over = Over(&watched);
            worker.run(&self);
        });
    }
}

/// Ends the watchdog, however the thread that it watches ends.
struct Over<'a>(&'a Watched);

impl Drop for Over<'_> {
    fn drop(&mut self) {
        self.0.over();
    }
}

impl Sink for BusThread {
    fn record(&self, sensor: usize, record: Record) {
        let now = self.shared.now();
        let stream = self.first_stream + sensor;
        self.shared.observed().saw(stream, &record, now);
        let dropped = self.shared.with_ring(|ring| ring.push(stream, record, now));
        if dropped > 0 && record.seq % RING_FULL_SAID_EVERY == 0 {
            self.log
                .error("the ring is full: the oldest records are being dropped");
        }
    }

    fn fault(&self, sensor: usize, kind: &'static str) {
        self.shared
            .with_ring(|ring| ring.count_fault(self.first_stream + sensor, kind));
    }

    fn is_stopping(&self) -> bool {
        self.running.is_stopping.load(Ordering::SeqCst)
    }
}

/// Which of some threads still run, and whether they shall.
#[derive(Debug)]
struct Running {
    is_stopping: AtomicBool,
    is_running: Mutex<Vec<bool>>,
    ended: Condvar,
}

impl Running {
    fn new(buses: usize) -> Self {
        Self {
            is_stopping: AtomicBool::new(false),
            is_running: Mutex::new(vec![true; buses]),
            ended: Condvar::new(),
        }
    }

    fn left(&self) -> usize {
        let is_running = self
            .is_running
            .lock()
            .unwrap_or_else(PoisonError::into_inner);
        is_running.iter().filter(|is_running| **is_running).count()
    }

    fn wait(&self, timeout: Duration) -> bool {
        let is_running = self
            .is_running
            .lock()
            .unwrap_or_else(PoisonError::into_inner);
        let some_run = |is_running: &mut Vec<bool>| is_running.contains(&true);
        let waited = self.ended.wait_timeout_while(is_running, timeout, some_run);
        !waited.unwrap_or_else(PoisonError::into_inner).1.timed_out()
    }

    fn still_running(&self, names: &[String]) -> Vec<String> {
        let is_running = self
            .is_running
            .lock()
            .unwrap_or_else(PoisonError::into_inner);
        let running = names
            .iter()
            .zip(is_running.iter())
            .filter(|(_, is_running)| **is_running);
        running.map(|(name, _)| name.clone()).collect()
    }
}

/// Says that a thread has ended, however it ended.
struct Ended<'a> {
    running: &'a Running,
    index: usize,
}

impl Drop for Ended<'_> {
    fn drop(&mut self) {
        let mut is_running = self
            .running
            .is_running
            .lock()
            .unwrap_or_else(PoisonError::into_inner);
        if let Some(is_running) = is_running.get_mut(self.index) {
            *is_running = false;
        }
        self.running.ended.notify_all();
    }
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
    keeper: &mut Keeper,
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
    keeper.open(Box::new(move || {
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

/// A thread of which [`Running`] tells the end, however it comes.
fn spawn_until_ended(
    name: &str,
    running: &Arc<Running>,
    work: impl FnOnce() + Send + 'static,
) -> Result<(), StartError> {
    let running = Arc::clone(running);
    spawn(name, move || {
        let _ended = Ended {
            running: &running,
            index: 0,
        };
        work();
    })
}

fn spawn(name: &str, work: impl FnOnce() + Send + 'static) -> Result<(), StartError> {
    let thread = std::thread::Builder::new()
        .name(name.to_owned())
        .stack_size(STACK_BYTES);
    match thread.spawn(work) {
        Ok(_) => Ok(()),
        Err(source) => Err(StartError::Thread {
            name: name.to_owned(),
            source,
        }),
    }
}

/// 64 random bits in hexadecimal: the standard library seeds its hash maps with the system's randomness.
fn random_name() -> String {
    format!("{:016x}", RandomState::new().hash_one("boot"))
}
