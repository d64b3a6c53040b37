//! `grideye-agent join`, step by step.

use super::common::{self, BadUsage, TIMEOUT, host_name, prove, read_config, with_joined};
use anyhow::Context as _;
use grideye_agent::cli::{JOINED_FILE, JoinArgs};
use grideye_agent::join::{
    ClientCertificate, Credentials, JoinLine, Joined, Secret, authority_of, read_text,
};
use grideye_agent::limits::JOINED_BYTES_MAX;
use grideye_agent::output;
use grideye_recording::whole::replace_private;
use service::{FirstFrame, Found, Service};
use std::io::{BufRead as _, IsTerminal as _, Read as _};
use std::path::Path;
use std::process::ExitCode;
use std::time::Duration;
use std::{fs, io};

mod service;
const STEPS: usize = 6;

/// The unit of `firmware-config/grideye-agent.service`.
const SERVICE: &str = "grideye-agent";

/// Joins. A failed step ends the program; the steps before it stay done.
pub(crate) fn run(args: &JoinArgs) -> anyhow::Result<ExitCode> {
    let (line, client) = Step::LINE.take(|| Ok((line(args)?, client(args)?)))?;
    let device = line.device.as_deref().unwrap_or("this device");
    Step::LINE.told(&format!("read: {device} joins {}", line.collector))?;
    let authority = Step::COLLECTOR.take(|| reach(&line, client.as_ref()))?;
    Step::COLLECTOR.told(match &authority {
        Some(_) => "reached, and its authority is the one that the line pins",
        None => "reached, without encryption",
    })?;
    let joined = Joined {
        collector: line.collector,
        device: line.device,
        credentials: Credentials {
            token: line.token,
            authority,
            client,
        },
    };
    let taken = Step::TOKEN.take(|| {
        let device = device_posting(args, &joined);
        prove(&joined.collector, &joined.credentials, &device)
    })?;
    Step::TOKEN.told(taken)?;
    Step::FILE.take(|| write(args, &joined))?;
    let out = args.out.display();
    Step::FILE.told(&format!("{out} written, for its owner alone"))?;
    let device = start(args, &joined)?;
    let collector = &joined.collector;
    output::result(format_args!("joined {collector} as {device}: {taken}\n"))?;
    Ok(ExitCode::SUCCESS)
}

/// Starts the service and waits for the first frame, or prints what to do instead. Returns the device's name.
fn start(args: &JoinArgs, joined: &Joined) -> anyhow::Result<String> {
    let config_path = args.out.with_file_name("agent.toml");
    let found = Step::SERVICE.take(|| find_service(args))?;
    let is_to_start = matches!(found, Found::Here(_));
    let named = Step::SERVICE.take(|| device_named(&config_path, joined, is_to_start))?;
    let device = named.unwrap_or_else(host_name);
    let service = match found {
        Found::Here(service) => service,
        Found::Not(why) => {
            Step::SERVICE.told(&format!("not started: {why}"))?;
            let instead = "not waited for; the collector's page shows it when the agent runs";
            Step::FIRST_FRAME.told(instead)?;
            return Ok(device);
        }
    };
    let first = FirstFrame::of(joined, &device);
    Step::SERVICE.take(|| service.start())?;
    Step::SERVICE.told(&format!("{} enabled and started", service.unit))?;
    let limit = Duration::from_secs(args.wait);
    let seen = Step::FIRST_FRAME.take(|| first.wait(&service, limit))?;
    Step::FIRST_FRAME.told(&seen)?;
    Ok(device)
}

/// The pinned authority's certificate from the collector; `None` without encryption.
fn reach(line: &JoinLine, client: Option<&ClientCertificate>) -> anyhow::Result<Option<String>> {
    match &line.pin {
        Some(pin) => Ok(Some(authority_of(&line.collector, pin, client, TIMEOUT)?)),
        None => {
            common::get(&line.collector, &Credentials::default(), "/healthz")?;
            Ok(None)
        }
    }
}

/// Finds the service that reads the written file, if there is one.
fn find_service(args: &JoinArgs) -> anyhow::Result<Found> {
    let config = args.out.with_file_name("agent.toml");
    let shown = config.display();
    let first = match config.exists() {
        true => String::new(),
        false => format!(
            "write {shown} (firmware-config/agent.toml is an example; without systemd, [spool] needs a folder), then "
        ),
    };
    let by_hand = format!("{first}start the agent with: grideye-agent run --config {shown}");
    if args.no_start {
        let running = match args.replace {
            true => {
                "; one that runs takes the new token once its collector refuses the old one; restart it for another collector, or if it is a service"
            }
            false => "",
        };
        return Ok(Found::Not(format!(
            "--no-start says so; {by_hand}{running}"
        )));
    }
    if args.service.is_none() && args.out != Path::new(JOINED_FILE) {
        return Ok(Found::Not(format!(
            "the service {SERVICE} reads {JOINED_FILE}, and this is another file; {by_hand}"
        )));
    }
    let unit = args.service.as_deref().unwrap_or(SERVICE);
    Service::find(unit, &by_hand)
}

/// The device's name in its posts. An unusable configuration is reported at its own step.
fn device_posting(args: &JoinArgs, joined: &Joined) -> String {
    let enrolled = joined.device.clone();
    let configured = || {
        let path = args.out.with_file_name("agent.toml");
        read_config(&path).ok()?.device
    };
    enrolled.or_else(configured).unwrap_or_else(host_name)
}

/// The device's name, if any file has one. Errors that would stop the service appear here, where the user sees them.
fn device_named(
    config_path: &Path,
    joined: &Joined,
    is_to_start: bool,
) -> anyhow::Result<Option<String>> {
    if !is_to_start && !config_path.exists() {
        return Ok(joined.device.clone());
    }
    let config = read_config(config_path)?;
    if let (Some(named), Some(enrolled)) = (&config.device, &joined.device) {
        if named != enrolled {
            let path = config_path.display();
            return Err(BadUsage(format!(
                "{path} calls this device {named}, and the line is for {enrolled}\nhint: take `device` out of {path}, or print a line with `grideye enroll {named}`"
            ))
            .into());
        }
    }
    Ok(with_joined(config, config_path)?.device)
}

fn line(args: &JoinArgs) -> anyhow::Result<JoinLine> {
    let mut text = args.code.clone();
    if text == "-" {
        text.clear();
        let limit = u64::try_from(JOINED_BYTES_MAX).unwrap_or(u64::MAX);
        let stdin = io::stdin().lock();
        let is_person = stdin.is_terminal();
        let mut input = stdin.take(limit);
        let read = if is_person {
            output::say("paste the line that `grideye enroll DEVICE` printed, and press Enter:");
            input.read_line(&mut text)
        } else {
            input.read_to_string(&mut text)
        };
        read.context("standard input")?;
    }
    let line = text.parse::<JoinLine>();
    Ok(line.map_err(|error| BadUsage(error.to_string()))?)
}

fn client(args: &JoinArgs) -> anyhow::Result<Option<ClientCertificate>> {
    let (Some(chain), Some(key)) = (&args.client_cert, &args.client_key) else {
        return Ok(None);
    };
    let read = |path: &Path| {
        read_text(path, JOINED_BYTES_MAX).map_err(|error| {
            let hint = "name a PEM file that you may read";
            BadUsage(format!("{}: {error}\nhint: {hint}", path.display()))
        })
    };
    Ok(Some(ClientCertificate {
        chain: read(chain)?,
        key: Secret::pem(read(key)?),
    }))
}

/// Writes the file for its owner alone, whole or not at all; it takes no other's place unless told to.
fn write(args: &JoinArgs, joined: &Joined) -> anyhow::Result<()> {
    let path = args.out.as_path();
    let text = joined.to_toml()?;
    if path.symlink_metadata().is_ok() && !args.replace {
        // The same line may be pasted again.
        if path.is_file() && read_text(path, JOINED_BYTES_MAX).is_ok_and(|there| there == text) {
            return Ok(());
        }
        let path = path.display();
        let hint = "add --replace to join with this line instead, or name another file with --out";
        return Err(BadUsage(format!("{path} exists and is kept\nhint: {hint}")).into());
    }
    let write = || -> io::Result<()> {
        if let Some(folder) = path.parent() {
            fs::create_dir_all(folder)?;
        }
        replace_private(path, text.as_bytes())
    };
    write().map_err(|error| {
        let path = path.display();
        let hint = "run this as root (sudo), or name a file of your own with --out";
        anyhow::anyhow!("{path}: {error}\nhint: {hint}")
    })
}
#[derive(Clone, Copy)]
struct Step(usize, &'static str);

impl Step {
    const LINE: Self = Self(1, "the line");
    const COLLECTOR: Self = Self(2, "the collector");
    const TOKEN: Self = Self(3, "the token");
    const FILE: Self = Self(4, "the file");
    const SERVICE: Self = Self(5, "the service");
    const FIRST_FRAME: Self = Self(STEPS, "the first frame");
    fn told(self, how: &str) -> io::Result<()> {
        let Self(number, name) = self;
        output::result(format_args!("{number}/{STEPS} {name}: {how}\n"))
    }

    /// Runs the step. An error names the step and what remains of those before it.
    fn take<T>(self, step: impl FnOnce() -> anyhow::Result<T>) -> anyhow::Result<T> {
        let Self(number, name) = self;
        let stays = if number < Self::SERVICE.0 {
            "nothing was changed".to_owned()
        } else {
            let done = number - 1;
            format!("steps 1 to {done} are done and stay, and the line may be pasted again")
        };
        step().with_context(|| format!("step {number} of {STEPS}, {name}, failed ({stays})"))
    }
}
