//! A profile as text that reads back to the same numbers.

use super::types::Profile;
use grideye_frame::{COLUMNS, PIXELS};

pub(crate) fn toml(profile: &Profile) -> String {
    let mut text = String::new();
    if !profile.name.is_empty() {
        let name = toml::Value::String(profile.name.clone());
        text.push_str(&format!("name = {name}\n"));
    }
    let common = &profile.common_mode;
    let (warm_up, thermistor) = (&profile.warm_up, &profile.thermistor);
    let time = |amount: f64, time: f64| if amount == 0.0 { 0.0 } else { time };
    let octaves = (common.sd_c != 0.0 && common.octaves != 1).then(|| common.octaves.to_string());
    let (noise, pattern, clock) = (
        &profile.noise_sigma_c,
        &profile.fixed_pattern,
        &profile.clock,
    );
    let correlation_s = time(common.sd_c, common.correlation_s);
    let time_constant_s = time(warm_up.start_c, warm_up.time_constant_s);
    let mut table = |name, keys| push_table(&mut text, name, keys);
    table("noise", vec![("sigma_c", map(noise))]);
    let common = vec![
        ("sd_c", number(common.sd_c)),
        ("correlation_s", number(correlation_s)),
        ("octaves", octaves),
        ("cycle_depth_c", number(common.cycle_depth_c)),
    ];
    table("common_mode", common);
    let pattern = vec![
        ("offset_c", map(&pattern.offset_c)),
        ("spread_c", number(pattern.spread_c)),
    ];
    table("fixed_pattern", pattern);
    let warm_up = vec![
        ("start_c", number(warm_up.start_c)),
        ("time_constant_s", number(time_constant_s)),
        ("drift_c_per_hour", number(warm_up.drift_c_per_hour)),
    ];
    table("warm_up", warm_up);
    let thermistor = vec![
        ("offset_c", number(thermistor.offset_c)),
        ("sigma_c", number(thermistor.sigma_c)),
        ("lag_s", number(thermistor.lag_s)),
    ];
    table("thermistor", thermistor);
    table(
        "glitches",
        vec![("probability", number(profile.glitch_probability))],
    );
    let drift_ppm = f64::from(clock.drift_ppm_per_hour);
    let clock = vec![
        ("error_ppm", number(f64::from(clock.error_ppm))),
        ("drift_ppm_per_hour", number(drift_ppm)),
    ];
    table("clock", clock);
    text
}

fn push_table(text: &mut String, name: &str, keys: Vec<(&str, Option<String>)>) {
    let mut keys = keys
        .into_iter()
        .filter_map(|(key, value)| Some((key, value?)))
        .peekable();
    if keys.peek().is_none() {
        return;
    }
    let gap = if text.is_empty() { "" } else { "\n" };
    text.push_str(&format!("{gap}[{name}]\n"));
    for (key, value) in keys {
        text.push_str(&format!("{key} = {value}\n"));
    }
}

/// The shortest decimal that is this number; nothing for zero.
fn number(number: f64) -> Option<String> {
    (number != 0.0).then(|| number.to_string())
}

/// One number where all are equal, else eight rows of eight.
fn map(map: &[f64; PIXELS]) -> Option<String> {
    if map.iter().all(|each| *each == map[0]) {
        return number(map[0]);
    }
    let mut text = "[\n".to_owned();
    for row in map.chunks(COLUMNS) {
        let row: Vec<String> = row.iter().map(f64::to_string).collect();
        text.push_str(&format!("  {},\n", row.join(", ")));
    }
    text.push(']');
    Some(text)
}
