//! The agent on the Raspberry Pi.

mod checking;
mod joining;

use anyhow::Context as _;
use grideye_agent::agent::{Agent, AgentHandle, AnyBus, Start, StartError, Summary};
use grideye_agent::bus::LinuxBus;
use grideye_agent::cli::{self, Command, LogFormat, RunArgs};
use grideye_agent::clock::SystemClock;
use grideye_agent::config::{BusConfig, CONFIG_BYTES_MAX, Config, SpoolMode};
use grideye_agent::health::serve;
use grideye_agent::log::{Level, Log};
use std::io::{Read as _, Write as _};
use std::net::{SocketAddr, TcpListener};
use std::path::Path;
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

const FAILED: u8 = 1;
const BAD_USAGE: u8 = 2;
const DATA_LOST: u8 = 3;
/// How long the last frames may take to the collector when the agent is told to stop.
const FLUSH_FOR: Duration = Duration::from_secs(10);
/// The same of a run that ended by itself and has waited for that long already.
const FLUSH_FOR_LEAST: Duration = Duration::from_secs(1);
/// How soon a signal is noticed.
const SIGNAL_EVERY: Duration = Duration::from_millis(100);

fn main() -> ExitCode {
    let outcome = match cli::parse().command {
        Command::Check(args) => checking::run(&args),
        Command::Join(args) => joining::run(&args),
        Command::Run(args) => run_agent(&args),
    };
    outcome.unwrap_or_else(|error| {
        let _ = writeln!(std::io::stderr(), "error: {error:#}");
        let is_usage = error.chain().any(<dyn std::error::Error>::is::<BadUsage>);
        let is_unanswered = error.chain().any(<dyn std::error::Error>::is::<Unanswered>);
        ExitCode::from(if is_usage {
            BAD_USAGE
        } else if is_unanswered {
            DATA_LOST
        } else {
            FAILED
        })
    })
}

fn run_agent(args: &RunArgs) -> anyhow::Result<ExitCode> {
    let config = joining::read(read_config(&args.config)?, &args.config)?;
    let stopping = Arc::new(AtomicBool::new(false));
    for signal in [signal_hook::consts::SIGINT, signal_hook::consts::SIGTERM] {
        // In this order: the first signal asks the agent to stop, and a second one ends it at once.
        let at_once = i32::from(DATA_LOST);
        signal_hook::flag::register_conditional_shutdown(signal, at_once, Arc::clone(&stopping))
            .and_then(|_| signal_hook::flag::register(signal, Arc::clone(&stopping)))
            .context("no handler for signals")?;
    }
    let config = with_spool_folder(config)?;
    let mut start = Start::new(config, host_name());
    start.frames_limit = args.frames;
    let buses = start
        .config
        .buses
        .iter()
        .map(|bus| (bus.clone(), linux_bus(bus)))
        .collect();
    let log = match args.log {
        LogFormat::Text => Log::to_stderr(),
        LogFormat::Json => Log::to_stderr_as_json(),
    };
    let health = start.config.health.map(listen).transpose()?;
    let agent =
        Agent::start(start, buses, Arc::new(SystemClock::new()), log.clone()).map_err(|error| {
            match error {
                StartError::NoCollector | StartError::Credentials(_) => {
                    anyhow::Error::new(BadUsage(error.to_string()))
                }
                other => other.into(),
            }
        })?;
    if let Some(listener) = health {
        let health = agent.health();
        std::thread::Builder::new()
            .name("health".to_owned())
            .spawn(move || serve(&listener, &health))
            .context("no thread for [health]")?;
    }
    wait(&agent, &stopping);
    let idle = deliver_rest(&agent, &stopping);
    if stopping.load(Ordering::SeqCst) {
        let held = agent.held();
        log.line(
            Level::Info,
            format!(
                "stopping; {held} records are being delivered, for {} s at most (a second signal ends at once and loses them)",
                FLUSH_FOR.as_secs()
            ),
        );
    }
    let summary = agent.stop(FLUSH_FOR.saturating_sub(idle).max(FLUSH_FOR_LEAST));
    write_stdout(&format!("{summary}\n"))?;
    Ok(exit_code(&summary))
}

/// The folder that systemd makes for the service, where the configuration names none.
fn with_spool_folder(mut config: Config) -> Result<Config, BadUsage> {
    let given = std::env::var_os("STATE_DIRECTORY");
    let first = given
        .as_ref()
        .and_then(|given| std::env::split_paths(given).next());
    let given = first.map(|folder| folder.join("spool"));
    config.spool.folder = config.spool.folder.or(given);
    if config.spool.mode != SpoolMode::Ram && config.spool.folder.is_none() {
        return Err(BadUsage(StartError::NoSpoolFolder.to_string()));
    }
    Ok(config)
}

fn listen(address: SocketAddr) -> anyhow::Result<TcpListener> {
    TcpListener::bind(address).map_err(|error| {
        anyhow::anyhow!("[health] listen = \"{address}\": {error}\nhint: does another agent run? Choose another port")
    })
}

fn wait(agent: &AgentHandle, stopping: &AtomicBool) {
    while !stopping.load(Ordering::SeqCst) && !agent.wait_finished(SIGNAL_EVERY) {}
}

/// A run that ends by itself takes the time that the delivery of its last frames takes, while it goes on. Returns for
/// how long nothing has arrived.
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

fn exit_code(summary: &Summary) -> ExitCode {
    if summary.is_complete() {
        ExitCode::SUCCESS
    } else {
        ExitCode::from(DATA_LOST)
    }
}

fn linux_bus(bus: &BusConfig) -> AnyBus {
    let addresses = bus.sensors.iter().map(|sensor| sensor.address.get());
    AnyBus::new(LinuxBus::new(&bus.path, addresses))
}

fn read_config(path: &Path) -> anyhow::Result<Config> {
    let origin = path.display().to_string();
    let text = read_text(path, CONFIG_BYTES_MAX).map_err(|error| {
        let hint = match error.kind() {
            std::io::ErrorKind::NotFound => "copy firmware-config/agent.toml there and edit it",
            std::io::ErrorKind::PermissionDenied => {
                "make the file readable for the user that runs the agent"
            }
            _ => "name the agent's configuration, a text file such as firmware-config/agent.toml",
        };
        BadUsage(format!("{origin}: {error}\nhint: {hint}"))
    })?;
    Ok(Config::parse(&text, &origin).map_err(|error| BadUsage(error.to_string()))?)
}

/// A text file, and one byte more than allowed of one that is too long.
fn read_text(path: &Path, bytes_max: usize) -> std::io::Result<String> {
    let mut text = String::new();
    let limit = u64::try_from(bytes_max).unwrap_or(u64::MAX) + 1;
    std::fs::File::open(path)?
        .take(limit)
        .read_to_string(&mut text)?;
    Ok(text)
}

/// The host's name where it can name a device; otherwise a name that can.
fn host_name() -> String {
    let system = rustix::system::uname();
    let name = system.nodename().to_string_lossy();
    let plain: String = name
        .chars()
        .filter(|c| c.is_ascii_alphanumeric() || matches!(c, '-' | '_' | '.'))
        .take(64)
        .collect();
    if plain.is_empty() {
        "grideye-agent".to_owned()
    } else {
        plain
    }
}

/// A closed standard output (`grideye-agent … | head`) is no error.
fn write_stdout(text: &str) -> std::io::Result<()> {
    match std::io::stdout().write_all(text.as_bytes()) {
        Err(error) if error.kind() == std::io::ErrorKind::BrokenPipe => Ok(()),
        other => other,
    }
}

/// The caller's mistake: exit code 2.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
struct BadUsage(String);

/// All is done, but nobody can say whether it went well: exit code 3.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
struct Unanswered(String);
