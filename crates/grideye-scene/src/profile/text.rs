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
    let tables = [
        ("noise", vec![("sigma_c", map(&profile.noise_sigma_c))]),
        (
            "common_mode",
            vec![
                ("sd_c", number(common.sd_c)),
                (
                    "correlation_s",
                    number(time(common.sd_c, common.correlation_s)),
                ),
                ("octaves", octaves),
                ("cycle_depth_c", number(common.cycle_depth_c)),
            ],
        ),
        (
            "fixed_pattern",
            vec![
                ("offset_c", map(&profile.fixed_pattern.offset_c)),
                ("spread_c", number(profile.fixed_pattern.spread_c)),
            ],
        ),
        (
            "warm_up",
            vec![
                ("start_c", number(warm_up.start_c)),
                (
                    "time_constant_s",
                    number(time(warm_up.start_c, warm_up.time_constant_s)),
                ),
                ("drift_c_per_hour", number(warm_up.drift_c_per_hour)),
            ],
        ),
        (
            "thermistor",
            vec![
                ("offset_c", number(thermistor.offset_c)),
                ("sigma_c", number(thermistor.sigma_c)),
                ("lag_s", number(thermistor.lag_s)),
            ],
        ),
        (
            "glitches",
            vec![("probability", number(profile.glitch_probability))],
        ),
        (
            "clock",
            vec![
                ("error_ppm", number(f64::from(profile.clock.error_ppm))),
                (
                    "drift_ppm_per_hour",
                    number(f64::from(profile.clock.drift_ppm_per_hour)),
                ),
            ],
        ),
    ];
    for (name, keys) in tables {
        push_table(&mut text, name, keys);
    }
    text
}

/// A table with the keys that have an effect, if there are any.
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
