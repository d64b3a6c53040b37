//! The running parts: the collector on its threads, the agent on its own, and the recording between them.

use super::show::Show;
use crate::cli::Demo;
use crate::client::{AuditRow, Client};
use crate::{collect, progress, scenes};
use amg8833_emulator::Address;
use anyhow::{Context as _, Result, anyhow};
use grideye_agent::agent::{Agent, AgentHandle, AnyBus, Start};
use grideye_agent::config::Config as AgentConfig;
use grideye_agent::log::{Level, Log};
use grideye_collector::{Collector, Config, StoreLocation, SystemClock};
use grideye_rig::{AgentClock, PacedClock, SCL_HZ, SharedBus};
use indicatif::ProgressBar;
use std::net::SocketAddr;
use std::sync::Arc;
use std::time::{Duration, Instant};
use tokio::runtime::Runtime;
use tokio::sync::watch;
use tokio::task::JoinHandle;

const DEVICE: &str = "demo";
/// The bus that the emulated sensor pretends to be on.
const BUS: &str = "/dev/i2c-1";
pub(super) const STORE: &str = "store.sqlite";
const LOOK_EVERY: Duration = Duration::from_millis(100);
/// Longest time without a new frame before the demonstration gives up.
const STALL_MAX: Duration = Duration::from_secs(30);
/// Longest wait for the last frames to be acknowledged.
const FLUSH_MAX: Duration = Duration::from_secs(20);

pub(super) struct Stage {
    runtime: Option<Runtime>,
    address: SocketAddr,
    pub(super) client: Client,
    interrupted: watch::Receiver<bool>,
    shut_down: watch::Sender<bool>,
    serving: Option<JoinHandle<Result<(), grideye_collector::CollectorError>>>,
}

/// A recording that is complete on the collector's disk.
pub(super) struct Delivered {
    pub(super) recording: i64,
    boot: String,
}

impl Stage {
    /// Binds the page's address, opens the store, and serves.
    pub(super) fn open(options: &Demo) -> Result<Self> {
        let runtime =
            grideye_collector::runtime().context("cannot start the collector's threads")?;
        let store = StoreLocation::File(options.out.join(STORE));
        let mut config = Config::new(options.listen, store, Arc::new(SystemClock::new()));
        config.annexes = scenes::annexes(&options.scenes)?;
        let collector = runtime.block_on(Collector::bind(config))?;
        let address = collector.local_addr();
        let (shut_down, mut is_shut_down) = watch::channel(false);
        let serving = runtime.spawn(collector.serve(async move {
            // A dropped sender is a shut-down too.
            let _asked_or_dropped = is_shut_down.wait_for(|asked| *asked).await;
        }));
        let (interrupt, interrupted) = watch::channel(false);
        let stop = {
            let _within = runtime.enter();
            collect::stop_signal().context("cannot catch Ctrl-C")?
        };
        runtime.spawn(async move {
            stop.await;
            interrupt.send_replace(true);
        });
        let client = Client::new(&format!("http://{address}"));
        Ok(Self {
            runtime: Some(runtime),
            address,
            client,
            interrupted,
            shut_down,
            serving: Some(serving),
        })
    }

    pub(super) fn page(&self) -> String {
        format!("http://{}/", self.address)
    }

    /// Records the show. `None` if Ctrl-C came first. The agent goes on running unless it has nothing more to read.
    pub(super) fn perform(
        &self,
        options: &Demo,
        show: &Show,
    ) -> Result<(Option<Delivered>, Option<AgentHandle>)> {
        let frames = show.frames();
        // With an end in sight the agent stops by itself, so that the recording holds exactly the show.
        let has_an_end = options.once || options.replay.is_some();
        let start = Start {
            frames_limit: has_an_end.then_some(frames),
            ..Start::new(self.agent_config()?, DEVICE)
        };
        let boot = start.boot.clone();
        let recording = self.client.start_recording(&format!("demo-{boot}"))?.id;
        let clock = Arc::new(PacedClock::new(options.speed));
        let bus = SharedBus::new(grideye_rig::bus(
            Arc::clone(&clock),
            Address::High,
            show.source(options.seed)?,
            SCL_HZ,
        ));
        let agent = start_agent(start, &bus, clock)?;
        let bar = progress::bar(frames, "recording");
        let is_complete = self.watch(&agent, frames, &bar)?;
        bar.finish_and_clear();
        say_traffic(&bus, frames);
        let agent = if has_an_end || !is_complete {
            let _summary = agent.stop(FLUSH_MAX);
            None
        } else {
            Some(agent)
        };
        self.client.stop_recording(recording)?;
        Ok((is_complete.then_some(Delivered { recording, boot }), agent))
    }

    pub(super) fn audit(&self, delivered: &Delivered) -> Result<AuditRow> {
        let rows = self.client.audit()?.streams;
        let row = rows.into_iter().find(|row| row.boot == delivered.boot);
        row.ok_or_else(|| anyhow!("the collector knows nothing of this run"))
    }

    pub(super) fn wait_for_interrupt(&self) {
        let mut interrupted = self.interrupted.clone();
        if let Some(runtime) = &self.runtime {
            // A closed channel means that the signal can come no more; leaving is then all that is left.
            let _ = runtime.block_on(interrupted.wait_for(|interrupted| *interrupted));
        }
    }

    fn agent_config(&self) -> Result<AgentConfig> {
        let text = format!(
            "device = \"{DEVICE}\"\ncollector = \"http://{}\"\n[[bus]]\npath = \"{BUS}\"\n[[bus.sensor]]\naddress = 0x69\n",
            self.address
        );
        AgentConfig::parse(&text, "the demonstration's own configuration")
            .context("cannot configure the agent")
    }

    /// Whether the show was delivered whole; not if Ctrl-C came first.
    fn watch(&self, agent: &AgentHandle, frames: u64, bar: &ProgressBar) -> Result<bool> {
        let (mut seen, mut since) = (0, Instant::now());
        loop {
            let (mut read, mut delivered) = (0, 0);
            for account in agent.accounts().values() {
                let waiting = account.spooled + account.dropped.values().sum::<u64>();
                read += account.read;
                delivered += account.read.saturating_sub(waiting);
            }
            bar.set_position(read.min(frames));
            if agent.is_finished() || delivered >= frames {
                return Ok(true);
            }
            if *self.interrupted.borrow() {
                return Ok(false);
            }
            if read > seen {
                (seen, since) = (read, Instant::now());
            } else if since.elapsed() > STALL_MAX {
                let seconds = STALL_MAX.as_secs();
                return Err(anyhow!(
                    "no new frame for {seconds} s; {read} of {frames} were read"
                ));
            }
            std::thread::sleep(LOOK_EVERY);
        }
    }
}

impl Drop for Stage {
    fn drop(&mut self) {
        self.shut_down.send_replace(true);
        let (Some(runtime), Some(serving)) = (self.runtime.take(), self.serving.take()) else {
            return;
        };
        if let Ok(Err(error)) = runtime.block_on(serving) {
            progress::say(&format!("warning: {error}"));
        }
        runtime.shutdown_timeout(Duration::from_secs(1));
    }
}

fn start_agent(start: Start, bus: &SharedBus, clock: Arc<PacedClock>) -> Result<AgentHandle> {
    let bus_config = start.config.buses.first().cloned();
    let bus_config = bus_config.context("the demonstration has one bus")?;
    let log = Log::new(|level, line| {
        if level > Level::Info {
            progress::say(&format!("agent: {}: {line}", level.name()));
        }
    });
    let clock = Arc::new(AgentClock::new(clock));
    let buses = vec![(bus_config, AnyBus::new(bus.clone()))];
    Ok(Agent::start(start, buses, clock, log)?)
}

fn say_traffic(bus: &SharedBus, frames: u64) {
    let traffic = bus.with(amg8833_emulator::Bus::traffic);
    if let Some(bytes) = traffic.bytes.checked_div(frames) {
        progress::say(&format!(
            "bus        {} transactions, {bytes} bytes for each frame recorded, looks for the moment of update included",
            traffic.transactions
        ));
    }
}
