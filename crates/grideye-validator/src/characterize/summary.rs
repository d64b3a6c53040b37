//! What was found, for people and for programs.

use crate::characterize::characterization::{Characterization, NOMINAL_HZ};
use crate::characterize::presence::{Presence, Spot};
use crate::characterize::timing::Jump;
use grideye_draw::text::{fixed, signed};
use grideye_frame::COLUMNS;
use serde_json::{Map, Value, json};
use std::fmt;

/// One line of the table: what, how much, and what belongs to it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Line {
    /// What was measured, with its unit.
    pub label: &'static str,
    /// The value.
    pub value: String,
    /// What one has to know of it; may be empty.
    pub note: String,
}

impl Characterization {
    /// The table's lines, in order.
    #[must_use]
    pub fn lines(&self) -> Vec<Line> {
        let mut lines = Vec::new();
        self.add_frames(&mut lines);
        self.add_timing(&mut lines);
        self.add_noise(&mut lines);
        self.add_presence(&mut lines);
        self.add_common_mode(&mut lines);
        self.add_faults(&mut lines);
        self.add_thermistor(&mut lines);
        lines
    }

    /// The table, the noise map and the Allan deviations as text for a terminal.
    #[must_use]
    pub fn text(&self) -> String {
        let lines = self.lines();
        let width = |of: fn(&Line) -> &str| {
            lines
                .iter()
                .map(|line| of(line).chars().count())
                .max()
                .unwrap_or(0)
        };
        let (labels, values) = (width(|line| line.label), width(|line| &line.value));
        let mut text = String::new();
        for line in &lines {
            let row = format!(
                "{:<labels$}  {:>values$}  {}",
                line.label, line.value, line.note
            );
            text.push_str(row.trim_end());
            text.push('\n');
        }
        text.push_str("\nnoise of each pixel, °C\n");
        for row in self.noise.sigma_c.chunks(COLUMNS) {
            let row: Vec<String> = row.iter().map(|sigma| format!("{sigma:.2}")).collect();
            text.push_str(&format!("  {}\n", row.join(" ")));
        }
        if !self.allan.is_empty() {
            text.push_str("\nAllan deviation, °C\n    over s  one pixel  common mode\n");
        }
        for point in &self.allan {
            text.push_str(&format!(
                "  {:>8.2}  {:>9.4}  {:>11.4}\n",
                point.tau_s, point.pixel_c, point.common_c
            ));
        }
        text
    }

    /// The same as one JSON object; what could not be told is null. Temperatures are in °C, times in seconds, shares
    /// from 0 to 1.
    #[must_use]
    pub fn to_json(&self) -> String {
        let missing: Map<String, Value> = self
            .missing
            .iter()
            .map(|(reason, count)| (reason.name().to_owned(), json!(count)))
            .collect();
        let document = json!({
            "format": "grideye-characterization",
            "version": 1,
            "frames": self.frames,
            "missing": missing,
            "skipped": self.skipped,
            "gaps": self.gaps,
            "timing": self.timing_json(),
            "sensor_hz": self.sensor_hz(),
            "pixel_step_c": self.steps.pixel_c,
            "thermistor_step_c": self.steps.thermistor_c,
            "noise_sigma_c": self.noise.sigma_c.to_vec(),
            "noise_sigma_median_c": self.noise.median_c(),
            "common_mode": self.common_mode_json(),
            "pattern": self.pattern.map(|pattern| json!({
                "surface_c": pattern.surface_c.to_vec(),
                "offset_c": pattern.offset_c.to_vec(),
                "sd_c": pattern.sd_c,
                "mean_c": pattern.mean_c.to_vec(),
            })),
            "presence": self.presence_json(),
            "allan": self.allan.iter().map(|point| json!({
                "tau_s": point.tau_s,
                "pixel_c": point.pixel_c,
                "common_c": point.common_c,
            })).collect::<Vec<_>>(),
            "faults": self.faults_json(),
            "thermistor": {
                "mean_c": self.thermistor.mean_c,
                "scene_c": self.thermistor.scene_c,
                "offset_c": self.thermistor.offset_c,
                "sigma_c": self.thermistor.sigma_c,
                "drift_c_per_hour": self.thermistor.drift_c_per_hour,
            },
        });
        format!("{document:#}\n")
    }

    fn timing_json(&self) -> Value {
        let timing = &self.timing;
        let jump = |jump: &Jump| json!({ "seq": jump.seq, "by_s": jump.by_s });
        json!({
            "span_s": timing.span_s,
            "rate_hz": timing.rate_hz,
            "period_s": timing.period_s,
            "jitter_s": timing.jitter_s,
            "shortest_percent_s": timing.shortest_percent_s,
            "longest_percent_s": timing.longest_percent_s,
            "longest_s": timing.longest_s,
            "stalls": timing.stalls,
            "bursts": timing.bursts,
            "jumps": timing.jumps,
            "listed_jumps": timing.listed_jumps.iter().map(jump).collect::<Vec<_>>(),
        })
    }

    fn presence_json(&self) -> Value {
        let (somebody, why, spot) = match &self.presence {
            Presence::Nobody => (Some(false), "nothing_moves", None),
            Presence::Somebody(spot) => (Some(true), "moves", Some(spot)),
            Presence::Still(spot) => (None, "stays_warm", Some(spot)),
            Presence::TooShort => (None, "too_short", None),
        };
        json!({
            "somebody": somebody,
            "why": why,
            "celsius": spot.map(|spot| spot.celsius),
            "row": spot.map(|spot| spot.row + 1),
            "column": spot.map(|spot| spot.column + 1),
        })
    }

    fn common_mode_json(&self) -> Value {
        let Some(common) = &self.common_mode else {
            return Value::Null;
        };
        json!({
            "sd_c": common.sd_c,
            "flicker": common.flicker.map(|flicker| json!({
                "sd_c": flicker.sd_c,
                "correlation_s": flicker.correlation_s,
                "octaves": flicker.octaves,
            })),
            "cycle": common.cycle.map(|cycle| json!({
                "frames": cycle.frames,
                "depth_c": cycle.depth_c,
                "contrast": cycle.contrast,
                "sensor_hz": cycle.sensor_hz,
            })),
        })
    }

    fn faults_json(&self) -> Value {
        let faults = &self.faults;
        json!({
            "compared": faults.compared,
            "torn": faults.torn,
            "torn_share": faults.torn_share(),
            "torn_by_chance": faults.torn_by_chance,
            "duplicates": faults.duplicates,
            "duplicates_in_a_row_max": faults.duplicates_in_a_row_max,
            "glitch_pixels": faults.glitch_pixels,
            "glitch_frames": faults.glitch_frames,
        })
    }

    fn add_frames(&self, lines: &mut Vec<Line>) {
        let missing: Vec<String> = self
            .missing
            .iter()
            .map(|(reason, count)| format!("{count} {reason}"))
            .collect();
        let missing_frames: u64 = self.missing.values().sum();
        add(lines, "frames read", self.frames.to_string(), "");
        add(
            lines,
            "frames recorded as missing",
            missing_frames.to_string(),
            &missing.join(", "),
        );
        let gaps = format!("at {}", times(self.gaps, "place"));
        let note = if self.gaps == 0 { "" } else { &gaps };
        add(
            lines,
            "sequence numbers left out",
            self.skipped.to_string(),
            note,
        );
    }

    fn add_timing(&self, lines: &mut Vec<Line>) {
        let timing = &self.timing;
        let milliseconds = |seconds: f64| fixed(1000.0 * seconds, 2);
        add(lines, "length, s", fixed(timing.span_s, 1), "");
        add(
            lines,
            "frame rate of the recording, Hz",
            fixed(timing.rate_hz, 3),
            "stalls left out",
        );
        let jitter = format!(
            "99 % between {} and {}",
            milliseconds(timing.shortest_percent_s),
            milliseconds(timing.longest_percent_s)
        );
        add(
            lines,
            "jitter of the interval, ms",
            milliseconds(timing.jitter_s),
            &jitter,
        );
        let longest = format!("longest interval {} ms", milliseconds(timing.longest_s));
        add(lines, "stalls", timing.stalls.to_string(), &longest);
        add(lines, "bursts", timing.bursts.to_string(), "");
        let jumps: Vec<String> = timing
            .listed_jumps
            .iter()
            .map(|jump| format!("{} s at frame {}", fixed(jump.by_s, 1), jump.seq))
            .collect();
        add(
            lines,
            "jumps of the clock",
            timing.jumps.to_string(),
            &jumps.join(", "),
        );
        let (rate, note) = match self.sensor_hz() {
            Some(rate) => (
                fixed(rate, 2),
                format!("clock {} %", signed(100.0 * (rate / NOMINAL_HZ - 1.0), 1)),
            ),
            None => ("unknown".to_owned(), String::new()),
        };
        add(lines, "frame rate of the sensor, Hz", rate, &note);
    }

    fn add_noise(&self, lines: &mut Vec<Line>) {
        let step = |step: Option<f64>| step.map_or("unknown".to_owned(), |step| step.to_string());
        add(
            lines,
            "step of the pixels, °C",
            step(self.steps.pixel_c),
            "",
        );
        add(
            lines,
            "step of the thermistor, °C",
            step(self.steps.thermistor_c),
            "",
        );
        let (least, most) = self.noise.range_c();
        let range = format!("{} to {} over the pixels", fixed(least, 2), fixed(most, 2));
        add(
            lines,
            "noise of the middle pixel, °C",
            fixed(self.noise.median_c(), 3),
            &range,
        );
        let pattern = self
            .pattern
            .map_or("unknown".to_owned(), |pattern| fixed(pattern.sd_c, 3));
        add(
            lines,
            "fixed pattern, sd, °C",
            pattern,
            "beyond a smooth surface",
        );
    }

    fn add_presence(&self, lines: &mut Vec<Line>) {
        let (somebody, note) = match &self.presence {
            Presence::Nobody => ("no", String::new()),
            Presence::Somebody(spot) => (
                "yes",
                format!("{spot} change by {} °C", fixed(spot.celsius, 2)),
            ),
            Presence::Still(spot) => (
                "unknown",
                format!("{spot} stay {} °C warm", fixed(spot.celsius, 2)),
            ),
            Presence::TooShort => ("unknown", "less than half a minute".to_owned()),
        };
        add(lines, "somebody in view", somebody.to_owned(), &note);
    }

    fn add_common_mode(&self, lines: &mut Vec<Line>) {
        let Some(common) = &self.common_mode else {
            add(
                lines,
                "common mode",
                "unknown".to_owned(),
                "no hundred frames in a row",
            );
            return;
        };
        let time = common.flicker.map_or(String::new(), |flicker| {
            format!(
                "flickers with sd {} in {} octaves up to {} s",
                fixed(flicker.sd_c, 3),
                flicker.octaves,
                fixed(flicker.correlation_s, 1)
            )
        });
        add(
            lines,
            "slow common mode, sd, °C",
            fixed(common.sd_c, 3),
            &time,
        );
        match common.cycle {
            Some(cycle) => {
                let note = format!(
                    "one frame colder, {} times the spectrum's middle",
                    fixed(cycle.contrast, 0)
                );
                add(lines, "cycle, frames", fixed(cycle.frames, 2), &note);
                add(lines, "its depth, °C", fixed(cycle.depth_c, 3), "");
            }
            None => add(lines, "cycle, frames", "none".to_owned(), ""),
        }
    }

    fn add_faults(&self, lines: &mut Vec<Line>) {
        let faults = &self.faults;
        let percent = |share: f64| fixed(100.0 * share, 2);
        let torn = format!(
            "{} of {}; by chance {}",
            faults.torn,
            faults.compared,
            percent(faults.torn_by_chance)
        );
        add(
            lines,
            "partly repeated (torn) frames, %",
            percent(faults.torn_share()),
            &torn,
        );
        let in_a_row = match faults.duplicates {
            0 => String::new(),
            _ => format!("up to {} in a row", faults.duplicates_in_a_row_max),
        };
        add(
            lines,
            "duplicate frames, %",
            percent(faults.duplicate_share()),
            &in_a_row,
        );
        let pixels = match faults.glitch_frames {
            0 => String::new(),
            _ => times(faults.glitch_pixels, "pixel"),
        };
        add(
            lines,
            "frames with a glitch",
            faults.glitch_frames.to_string(),
            &pixels,
        );
    }

    fn add_thermistor(&self, lines: &mut Vec<Line>) {
        let thermistor = &self.thermistor;
        let above = format!(
            "{} over {}",
            fixed(thermistor.mean_c, 2),
            fixed(thermistor.scene_c, 2)
        );
        add(
            lines,
            "thermistor over the scene, °C",
            fixed(thermistor.offset_c, 2),
            &above,
        );
        let trend = thermistor.drift_c_per_hour.map_or(String::new(), |trend| {
            format!("trend {} °C an hour", signed(trend, 1))
        });
        add(
            lines,
            "noise of the thermistor, °C",
            fixed(thermistor.sigma_c, 3),
            &trend,
        );
    }
}

impl fmt::Display for Spot {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            formatter,
            "rows {} and {}, columns {} and {}",
            self.row + 1,
            self.row + 2,
            self.column + 1,
            self.column + 2
        )
    }
}

fn add(lines: &mut Vec<Line>, label: &'static str, value: String, note: &str) {
    lines.push(Line {
        label,
        value,
        note: note.to_owned(),
    });
}

fn times(count: u64, what: &str) -> String {
    let plural = if count == 1 { "" } else { "s" };
    format!("{count} {what}{plural}")
}
