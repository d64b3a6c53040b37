//! `grideye-agent run`: reads and delivers until it gets a signal or reaches its frame limit.

use super::common::{BadUsage, DATA_LOST, host_name, read_config, with_joined, with_spool_folder};
use anyhow::Context as _;
use grideye_agent::agent::{Agent, AgentHandle, AnyBus, Start, StartError};
use grideye_agent::bus::LinuxBus;
use grideye_agent::cli::{LogFormat, RunArgs};
use grideye_agent::clock::SystemClock;
use grideye_agent::config::BusConfig;
use grideye_agent::health::serve;
use grideye_agent::log::{Level, Log};
use grideye_agent::output;
use std::net::{SocketAddr, TcpListener};
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// How long the last frames may take to reach the collector after a signal.
const FLUSH_FOR: Duration = Duration::from_secs(10);
/// The same after the frame limit, when the agent has already waited that long.
const FLUSH_FOR_LEAST: Duration = Duration::from_secs(1);
const SIGNAL_EVERY: Duration = Duration::from_millis(100);

pub(crate) fn run(args: &RunArgs) -> anyhow::Result<ExitCode> {
    let config = with_joined(read_config(&args.config)?, &args.config)?;
    let stopping = Arc::new(AtomicBool::new(false));
    for signal in [signal_hook::consts::SIGINT, signal_hook::consts::SIGTERM] {
        // In this order: the first signal asks the agent to stop, and a second one ends it at once.
        let at_once = i32::from(DATA_LOST);
        signal_hook::flag::register_conditional_shutdown(signal, at_once, Arc::clone(&stopping))
            .and_then(|_| signal_hook::flag::register(signal, Arc::clone(&stopping)))
            .context("no handler for signals")?;
    }
    let config = with_spool_folder(config, &args.config)?;
    let mut start = Start::new(config, host_name());
    start.frames_limit = args.frames;
    let buses = start.config.buses.iter();
    let buses = buses.map(|bus| (bus.clone(), linux_bus(bus))).collect();
    let log = match args.log {
        LogFormat::Text => Log::to_stderr(),
        LogFormat::Json => Log::to_stderr_as_json(),
    };
    let health = start.config.health.map(listen).transpose()?;
    let clock = Arc::new(SystemClock::default());
    let agent = match Agent::start(start, buses, clock, log.clone()) {
        Err(error @ (StartError::NoCollector | StartError::Credentials(_))) => {
            return Err(BadUsage(error.to_string()).into());
        }
        other => other?,
    };
    if let Some(listener) = health {
        let health = agent.health();
        std::thread::Builder::new()
            .name("health".to_owned())
            .spawn(move || serve(&listener, &health))
            .context("no thread for [health]")?;
    }
    while !stopping.load(Ordering::SeqCst) && !agent.wait_finished(SIGNAL_EVERY) {}
    let idle = deliver_rest(&agent, &stopping);
    if stopping.load(Ordering::SeqCst) {
        let (held, flush_s) = (agent.held(), FLUSH_FOR.as_secs());
        let line = format!(
            "stopping; delivering {held} records for up to {flush_s} s (a second signal exits at once and loses them)"
        );
        log.line(Level::Info, line);
    }
    let summary = agent.stop(FLUSH_FOR.saturating_sub(idle).max(FLUSH_FOR_LEAST));
    output::result(format_args!("{summary}\n"))?;
    let code = if summary.is_complete() { 0 } else { DATA_LOST };
    Ok(code.into())
}

fn listen(address: SocketAddr) -> anyhow::Result<TcpListener> {
    TcpListener::bind(address).map_err(|error| {
        anyhow::anyhow!("[health] listen = \"{address}\": {error}\nhint: does another agent run? Choose another port")
    })
}

/// After the frame limit, waits while the last frames arrive. Returns the time since the last one.
fn deliver_rest(agent: &AgentHandle, stopping: &AtomicBool) -> Duration {
    let (mut held, mut since) = (agent.held(), Instant::now());
    while held > 0 && since.elapsed() < FLUSH_FOR && !stopping.load(Ordering::SeqCst) {
        std::thread::sleep(SIGNAL_EVERY);
        let left = agent.held();
        if left < held {
            (held, since) = (left, Instant::now());
        }
    }
    since.elapsed()
}

fn linux_bus(bus: &BusConfig) -> AnyBus {
    let addresses = bus.sensors.iter().map(|sensor| sensor.address.get());
    AnyBus::new(LinuxBus::new(&bus.path, addresses))
}
