//! `grideye-agent check`: tests the sensors, and with a configuration also the clock, the connection to the collector,
//! and what a power cut can cost.

use super::common::{FAILED, host_name, prove, read_config, unreadable, with_joined};
use grideye_agent::bus::LinuxBus;
use grideye_agent::check::{self, Report};
use grideye_agent::cli::{BUS, CONFIG_FILE, CheckArgs};
use grideye_agent::clock::{Clock, SystemClock};
use grideye_agent::config::{BusConfig, Config, SensorConfig};
use grideye_agent::output;
use grideye_recording::ClockState;
use serde_json::{Value, json};
use std::io;
use std::path::Path;
use std::process::ExitCode;
use std::sync::Arc;

/// Exit code 0 if all is well, 1 if a sensor or the collector fails. A clock that was never set is reported, but is no
/// failure.
pub(crate) fn run(args: &CheckArgs) -> anyhow::Result<ExitCode> {
    let clock: Arc<dyn Clock> = Arc::new(SystemClock::default());
    let is_well = check_all(args, Path::new(CONFIG_FILE), &clock, &mut |text| {
        output::result(format_args!("{text}"))
    })?;
    Ok(ExitCode::from(if is_well { 0 } else { FAILED }))
}
struct Configured {
    config: Config,
    /// Why this user cannot read the file that joining wrote.
    unreadable: Option<String>,
    /// Named by `--config`, not found as the service's own.
    is_named: bool,
}

/// Checks what the arguments name, or else the service's configuration if there is one at `of_service`.
fn check_all(
    args: &CheckArgs,
    of_service: &Path,
    clock: &Arc<dyn Clock>,
    say: &mut dyn FnMut(&str) -> io::Result<()>,
) -> anyhow::Result<bool> {
    let configured = configured(args, of_service)?;
    if configured.as_ref().is_some_and(|found| !found.is_named) {
        let path = of_service.display().to_string();
        let text =
            format!("configuration: {path}; --bus or --address look at one sensor without it");
        say(&one_line(args.json, &json!({ "config": path }), &text))?;
    }
    let buses = match &configured {
        Some(configured) => configured.config.buses.clone(),
        None => {
            let bus = args.bus.as_deref().unwrap_or(Path::new(BUS));
            vec![BusConfig::with_one_sensor(bus, args.address())]
        }
    };
    let mut is_well = true;
    for bus in &buses {
        for sensor in &bus.sensors {
            let report = the_sensor(bus, sensor, clock);
            is_well &= report.ok;
            say(&if args.json {
                serde_json::to_string(&report)? + "\n"
            } else {
                report.to_string()
            })?;
        }
    }
    if let Some(configured) = &configured {
        say(&the_clock(clock.as_ref(), args.json))?;
        let (is_taken, text) = the_collector(configured, args.json);
        is_well &= is_taken;
        say(&text)?;
        say(&guarantee(&configured.config, args.json))?;
    }
    Ok(is_well)
}

fn configured(args: &CheckArgs, of_service: &Path) -> anyhow::Result<Option<Configured>> {
    let asks_for_one = args.bus.is_some() || args.address.is_some();
    let path = match &args.config {
        Some(path) => path,
        None if !asks_for_one && of_service.is_file() => of_service,
        None => return Ok(None),
    };
    let mut config = read_config(path)?;
    let unreadable = unreadable(&config, path);
    if unreadable.is_none() {
        config = with_joined(config, path)?;
    }
    Ok(Some(Configured {
        config,
        unreadable,
        is_named: args.config.is_some(),
    }))
}

/// One line, as JSON for programs or text for people.
fn one_line(is_json: bool, json: &Value, text: &str) -> String {
    match is_json {
        true => format!("{json}\n"),
        false => format!("{text}\n"),
    }
}

fn the_sensor(bus: &BusConfig, sensor: &SensorConfig, clock: &Arc<dyn Clock>) -> Report {
    let name = bus.sensor_id(sensor);
    let opener = LinuxBus::new(&bus.path, [sensor.address.get()]);
    let other = sensor.address.other();
    let is_taken = bus.sensors.iter().any(|sensor| sensor.address == other);
    let elsewhere = (!is_taken).then(|| LinuxBus::new(&bus.path, [other.get()]));
    check::check(opener, elsewhere, &name, sensor, clock)
}
fn the_clock(clock: &dyn Clock, is_json: bool) -> String {
    let (_, state) = clock.utc();
    let said = match state {
        ClockState::Synced | ClockState::Stepped => "set",
        ClockState::Unsynced => {
            "never set: frames are stamped `unsynced`, and their order and age are right all the same\n\
             hint: a Raspberry Pi has no battery clock; give it a network with NTP, and see `timedatectl`"
        }
    };
    let json = json!({ "clock": state.name() });
    one_line(is_json, &json, &format!("clock: {said}"))
}

/// Asks the collector, as the running agent would, whether it takes this agent's frames. If no collector is configured
/// yet, or this user may not read the token, reports that; it is a failure only for a configuration named by the user.
fn the_collector(configured: &Configured, is_json: bool) -> (bool, String) {
    let (config, unreadable) = (&configured.config, &configured.unreadable);
    let url = config.collector.as_deref();
    let asked = match (url, unreadable) {
        (_, Some(why)) => Err(why.clone()),
        (Some(url), None) => {
            let device = config.device.clone().unwrap_or_else(host_name);
            let taken = prove(url, &config.credentials, &device);
            taken.map(str::to_owned).map_err(|error| format!("{error:#}"))
        }
        (None, None) => Err("the configuration names none\nhint: paste the line that `grideye enroll DEVICE` prints on the collector's machine".to_owned()),
    };
    let is_asked = url.is_some() && unreadable.is_none();
    let is_taken = asked.is_ok();
    let said = asked.unwrap_or_else(|error| error);
    let (error, hint) = said.split_once("\nhint: ").unwrap_or((&said, ""));
    let failed = if is_asked { "failed" } else { "not asked" };
    let (json, text) = if is_taken {
        let text = format!("collector: {}: {said}", url.unwrap_or_default());
        (json!({ "url": url, "ok": true }), text)
    } else {
        let text = format!("collector: {failed}\nerror: {error}\nhint: {hint}");
        let json = json!({ "url": url, "ok": false, "error": error, "hint": hint });
        (json, text)
    };
    let is_well = is_taken || !(is_asked || configured.is_named);
    let line = one_line(is_json, &json!({ "collector": json }), &text);
    (is_well, line)
}

fn guarantee(config: &Config, is_json: bool) -> String {
    let (mode, guarantee) = (config.spool.mode.name(), config.guarantee());
    let (frames, seconds) = (guarantee.frames, guarantee.seconds);
    let spool = json!({ "mode": mode, "frames_at_risk": frames, "seconds_at_risk": seconds });
    let text = format!("spool: mode {mode}: {guarantee}");
    one_line(is_json, &json!({ "spool": spool }), &text)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;
    use std::time::Duration;

    /// A clock that was never set, and on which every wait ends at once.
    #[derive(Default)]
    struct NeverSet {
        boot: std::sync::Mutex<Duration>,
    }

    impl Clock for NeverSet {
        fn boot(&self) -> Duration {
            let mut boot = self.boot.lock().unwrap();
            *boot += Duration::from_millis(1);
            *boot
        }
        fn utc(&self) -> (i64, ClockState) {
            (0, ClockState::Unsynced)
        }
        fn sleep_until(&self, until: Duration) {
            let mut boot = self.boot.lock().unwrap();
            *boot = until.max(*boot);
        }
    }

    const CONFIG: &str = "[[bus]]\npath = \"/nonexistent/i2c-7\"\n[[bus.sensor]]\naddress = 0x68\n";

    /// Result and output of `check` with these arguments, with the service's configuration at `of_service`.
    fn checked(words: &[&str], of_service: &Path) -> (bool, String) {
        let words = ["grideye-agent", "check"].iter().chain(words);
        let matches = grideye_agent::cli::command().get_matches_from(words);
        let (_, matches) = matches.subcommand().unwrap();
        let args = <CheckArgs as clap::FromArgMatches>::from_arg_matches(matches).unwrap();
        let clock: Arc<dyn Clock> = Arc::new(NeverSet::default());
        let mut said = String::new();
        let mut say = |text: &str| {
            said.push_str(text);
            Ok(())
        };
        let is_well = check_all(&args, of_service, &clock, &mut say).unwrap();
        (is_well, said)
    }

    #[test]
    fn a_clock_that_was_never_set_is_said_with_what_to_do_and_costs_nothing() {
        let folder = tempfile::tempdir().unwrap();
        let config = folder.path().join("agent.toml");
        fs::write(&config, CONFIG).unwrap();
        let (nowhere, config) = (Path::new("/nonexistent"), config.to_str().unwrap());
        let (_, said) = checked(&["--config", config], nowhere);
        let clock = "\nclock: never set: frames are stamped `unsynced`, and their order and age are right all the same\n\
                     hint: a Raspberry Pi has no battery clock; give it a network with NTP, and see `timedatectl`\ncollector: ";
        assert!(said.contains(clock), "{said}");
        let (_, said) = checked(&["--json", "--config", config], nowhere);
        assert!(said.contains("\n{\"clock\":\"unsynced\"}\n"), "{said}");
    }

    #[test]
    fn the_service_s_configuration_is_checked_where_nothing_is_named_and_is_said() {
        let folder = tempfile::tempdir().unwrap();
        let of_service = folder.path().join("agent.toml");
        let one = "i2c-1:0x69: ";
        let (_, said) = checked(&[], &of_service);
        assert!(said.starts_with(one) && !said.contains("clock: "), "{said}");
        fs::write(&of_service, CONFIG).unwrap();
        let (is_well, said) = checked(&[], &of_service);
        let begin = format!(
            "configuration: {}; --bus or --address look at one sensor without it\ni2c-7:0x68: failed\n",
            of_service.display()
        );
        assert!(!is_well && said.starts_with(&begin), "{said}");
        for part in [
            "\nclock: never set",
            "\ncollector: not asked\nerror: the configuration names none\nhint: paste the line that `grideye enroll DEVICE` prints",
            "\nspool: mode ram",
        ] {
            assert!(said.contains(part), "{part}: {said}");
        }
        let (_, json) = checked(&["--json"], &of_service);
        assert!(json.starts_with("{\"config\":"), "{json}");
        for words in [&["--bus", "/nonexistent/i2c-1"][..], &["--address", "0x69"]] {
            let (_, said) = checked(words, &of_service);
            assert!(said.starts_with(one) && !said.contains("clock: "), "{said}");
        }
    }

    #[test]
    fn a_collector_that_the_service_was_not_told_yet_is_a_failure_of_a_named_configuration_alone() {
        let config = Config::parse(CONFIG, "agent.toml").unwrap();
        let asked = |unreadable: Option<&str>, is_named| {
            let configured = Configured {
                config: config.clone(),
                unreadable: unreadable.map(str::to_owned),
                is_named,
            };
            the_collector(&configured, false)
        };
        assert_eq!((asked(None, true).0, asked(None, false).0), (false, true));
        let why = "collector.toml: permission denied\nhint: sudo";
        let said = format!("collector: not asked\nerror: {why}\n");
        assert_eq!(asked(Some(why), false), (true, said));
    }
}
