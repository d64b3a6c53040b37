//! `grideye-agent check`: the sensors, and with a configuration the clock, the way to the collector and what a loss of
//! power can cost.

use crate::{FAILED, joining, read_config, write_stdout};
use grideye_agent::bus::LinuxBus;
use grideye_agent::camera::{VideoDevice, check_camera};
use grideye_agent::check::{self, Report};

use grideye_agent::cli::CheckArgs;
use grideye_agent::clock::{Clock, SystemClock};
use grideye_agent::config::{BusConfig, Config};
use grideye_recording::ClockState;
use serde_json::json;
use std::process::ExitCode;
use std::sync::Arc;

/// Exit code 0 if all is well, 1 if a sensor or the collector is not; a clock that was never set is said, and costs nothing.
pub(crate) fn run(args: &CheckArgs) -> anyhow::Result<ExitCode> {
    let config = match &args.config {
        Some(path) => Some(joining::read(read_config(path)?, path)?),
        None => None,
    };
    let buses = match &config {
        Some(config) => config.buses.clone(),
        None => vec![BusConfig::with_one_sensor(&args.bus, args.address)],
    };
    let clock: Arc<dyn Clock> = Arc::new(SystemClock::new());
    let mut all_ok = true;
    for bus in &buses {
        for sensor in &bus.sensors {
            if let Some(camera) = bus.camera() {
                let opener = VideoDevice::new(camera, sensor.rate);
                let report =
                    check_camera(opener, &bus.sensor_id(sensor), sensor.rate, clock.as_ref());
                all_ok &= report.ok;
                write_stdout(&told(&report, args.json)?)?;
                continue;
            }
            let opener = LinuxBus::new(&bus.path, [sensor.address.get()]);
            let other = sensor.address.other();
            let is_taken = bus.sensors.iter().any(|sensor| sensor.address == other);
            let elsewhere = (!is_taken).then(|| LinuxBus::new(&bus.path, [other.get()]));
            let report = check::check(opener, elsewhere, &bus.sensor_id(sensor), sensor, &clock);
            all_ok &= report.ok;
            write_stdout(&told(&report, args.json)?)?;
        }
    }
    if let Some(config) = &config {
        write_stdout(&the_clock(clock.as_ref(), args.json))?;
        let (is_well, text) = the_collector(config, args.json);
        all_ok &= is_well;
        write_stdout(&text)?;
        write_stdout(&guarantee(config, args.json))?;
    }
    Ok(if all_ok {
        ExitCode::SUCCESS
    } else {
        ExitCode::from(FAILED)
    })
}

fn told(report: &Report, is_json: bool) -> anyhow::Result<String> {
    Ok(if is_json {
        serde_json::to_string(report)? + "\n"
    } else {
        report.to_string()
    })
}

/// Whether the wall clock was set.
fn the_clock(clock: &dyn Clock, is_json: bool) -> String {
    let (_, state) = clock.utc();
    if is_json {
        return format!("{}\n", json!({ "clock": state.name() }));
    }
    let said = match state {
        ClockState::Synced | ClockState::Stepped => "set",
        ClockState::Unsynced => {
            "never set: frames are stamped `unsynced`, and their order and age are right all the same\n\
             hint: a Raspberry Pi has no battery clock; give it a network with NTP, and see `timedatectl`"
        }
    };
    format!("clock: {said}\n")
}

/// Whether the collector takes this agent's frames, asked in the agent's own way.
fn the_collector(config: &Config, is_json: bool) -> (bool, String) {
    let url = config.collector.as_deref();
    let asked = match url {
        Some(url) => joining::whoami(url, &config.credentials).map_err(|error| format!("{error:#}")),
        None => Err("the configuration names none\nhint: paste the line of `grideye enroll DEVICE` behind `grideye-agent join`".to_owned()),
    };
    let (is_well, said) = match asked {
        Ok(scope) => (true, scope),
        Err(error) => (false, error),
    };
    let (error, hint) = said.split_once("\nhint: ").unwrap_or((&said, ""));
    let text = match (is_json, is_well) {
        (true, true) => json!({ "collector": { "url": url, "ok": true } }).to_string(),
        (true, false) => {
            let said = json!({ "url": url, "ok": false, "error": error, "hint": hint });
            json!({ "collector": said }).to_string()
        }
        (false, true) => format!("collector: {}: {said}", url.unwrap_or_default()),
        (false, false) => format!("collector: failed\nerror: {error}\nhint: {hint}"),
    };
    (is_well, text + "\n")
}

/// What a loss of power can cost with this configuration, for a person or a program.
fn guarantee(config: &Config, is_json: bool) -> String {
    let (mode, guarantee) = (config.spool.mode.name(), config.guarantee());
    if !is_json {
        return format!("spool: mode {mode}: {guarantee}\n");
    }
    let json = json!({ "spool": {
        "mode": mode,
        "frames_at_risk": guarantee.frames,
        "seconds_at_risk": guarantee.seconds,
    } });
    format!("{json}\n")
}
