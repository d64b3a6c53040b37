//! The figures as Prometheus' families.

use super::look::{Look, SensorLook};
use grideye_recording::ClockState;
use grideye_recording::prometheus::Text;
use std::collections::BTreeMap;

pub(super) fn page(look: &Look) -> String {
    let mut text = Text::new();
    of_the_program(&mut text, look);
    of_the_delivery(&mut text, look);
    of_the_sensors(&mut text, look);
    of_the_newest(&mut text, look);
    text.into_string()
}

fn of_the_program(text: &mut Text, look: &Look) {
    text.gauge("grideye_agent_build_info", "The program's version.");
    text.sample(&[("version", env!("CARGO_PKG_VERSION"))], 1);
    text.gauge(
        "grideye_agent_up",
        "1 while every sensor gives frames and the collector takes them.",
    );
    text.sample(&[], u8::from(look.faults().is_empty()));
    text.gauge("grideye_agent_uptime_seconds", "Seconds since the start.");
    text.sample(&[], look.now.as_secs());
    text.gauge("grideye_agent_memory_records", "Records in memory.");
    text.sample(&[], look.held);
    if let Some((bytes, frames)) = look.spool {
        text.gauge("grideye_agent_spool_bytes", "Bytes that the spool takes.");
        text.sample(&[], bytes);
        text.gauge("grideye_agent_spool_frames", "Frames in the spool.");
        text.sample(&[], frames);
    }
}

fn of_the_delivery(text: &mut Text, look: &Look) {
    let delivery = &look.delivery;
    text.counter(
        "grideye_agent_posts_total",
        "Posts to the collector, by outcome.",
    );
    text.sample(&[("outcome", "accepted")], delivery.posts_accepted);
    text.sample(&[("outcome", "failed")], delivery.posts_failed);
    text.gauge(
        "grideye_agent_post_failures_in_a_row",
        "Posts that failed since the last that was accepted.",
    );
    text.sample(&[], delivery.failures_in_a_row);
    if let Some(age_s) = look.since(delivery.last_accepted) {
        text.gauge(
            "grideye_agent_last_accepted_age_seconds",
            "Seconds since a post was accepted.",
        );
        text.sample(&[], age_s);
    }
}

fn of_the_sensors(text: &mut Text, look: &Look) {
    text.counter("grideye_agent_sensor_read_total", "Frames read.");
    of_each(text, look, |sensor| sensor.account.read);
    text.counter(
        "grideye_agent_sensor_missing_total",
        "Frames missed, each a row.",
    );
    of_each(text, look, |sensor| sensor.account.missing);
    text.counter(
        "grideye_agent_sensor_stored_total",
        "Frames that the collector has on disk.",
    );
    of_each(text, look, |sensor| sensor.acknowledged);
    text.gauge(
        "grideye_agent_sensor_spooled",
        "Frames read and not acknowledged.",
    );
    of_each(text, look, |sensor| sensor.account.spooled);
    text.counter(
        "grideye_agent_sensor_dropped_total",
        "Frames given up, by reason.",
    );
    by_reason(text, look, |sensor| &sensor.account.dropped);
    text.counter("grideye_agent_sensor_errors_total", "Faults, by kind.");
    by_reason(text, look, |sensor| &sensor.account.errors);
}

fn of_each(text: &mut Text, look: &Look, count: impl Fn(&SensorLook) -> u64) {
    for sensor in &look.sensors {
        text.sample(&[("sensor", &sensor.name)], count(sensor));
    }
}

fn by_reason(text: &mut Text, look: &Look, counts: impl Fn(&SensorLook) -> &BTreeMap<String, u64>) {
    for sensor in &look.sensors {
        for (reason, count) in counts(sensor) {
            text.sample(&[("sensor", &sensor.name), ("reason", reason)], count);
        }
    }
}

fn of_the_newest(text: &mut Text, look: &Look) {
    let seen = || {
        let sensors = look.sensors.iter();
        sensors.filter_map(|sensor| Some((sensor.name.as_str(), sensor.seen?)))
    };
    text.gauge(
        "grideye_agent_sensor_frame_age_seconds",
        "Seconds since the newest frame was read.",
    );
    for (sensor, seen) in seen() {
        let age = look.now.saturating_sub(seen.frame_at);
        text.sample(&[("sensor", sensor)], age.as_secs_f64());
    }
    text.gauge(
        "grideye_agent_sensor_clock",
        "1 for the state of the wall clock at the newest record.",
    );
    for (sensor, seen) in seen() {
        for state in [
            ClockState::Unsynced,
            ClockState::Synced,
            ClockState::Stepped,
        ] {
            let labels = [("sensor", sensor), ("state", state.name())];
            text.sample(&labels, u8::from(state == seen.clock));
        }
    }
}
