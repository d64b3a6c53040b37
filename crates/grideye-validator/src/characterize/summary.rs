//! A characterization as text, table lines and JSON.

use crate::characterize::characterization::{Characterization, NOMINAL_HZ};
use crate::characterize::presence::Presence;
use crate::metrics::room_difference::Spot;
use crate::numbers::long_count;
use grideye_draw::text::{counted, fixed, signed};
use grideye_frame::COLUMNS;
use serde_json::{Map, Value, json};
use std::fmt::{self, Display};

/// One line of the table.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Line {
    /// What was measured, with its unit.
    pub label: &'static str,
    /// The value.
    pub value: String,
    /// A remark on the value; may be empty.
    pub note: String,
}

#[derive(Default)]
struct Lines(Vec<Line>);

impl Lines {
    fn add(&mut self, label: &'static str, value: impl Display, note: impl Display) {
        let (value, note) = (value.to_string(), note.to_string());
        self.0.push(Line { label, value, note });
    }
}

impl Characterization {
    /// The table, in order.
    #[must_use]
    pub fn lines(&self) -> Vec<Line> {
        let mut lines = Lines::default();
        self.add_frames(&mut lines);
        self.add_timing(&mut lines);
        self.add_noise(&mut lines);
        self.add_presence(&mut lines);
        self.add_common_mode(&mut lines);
        self.add_faults(&mut lines);
        self.add_thermistor(&mut lines);
        lines.0
    }

    /// The table and the noise map as text.
    #[must_use]
    pub fn text(&self) -> String {
        let lines = self.lines();
        let longest = |of: fn(&Line) -> &str| {
            let widths = lines.iter().map(|line| of(line).chars().count());
            widths.max().unwrap_or(0)
        };
        let (labels, values) = (longest(|line| line.label), longest(|line| &line.value));
        let mut text = String::new();
        for Line { label, value, note } in &lines {
            let row = format!("{label:<labels$}  {value:>values$}  {note}");
            text.push_str(row.trim_end());
            text.push('\n');
        }
        text.push_str("\nnoise of each pixel, °C\n");
        for row in self.noise.sigma_c.chunks(COLUMNS) {
            let row: Vec<String> = row.iter().map(|sigma| format!("{sigma:.2}")).collect();
            text.push_str(&format!("  {}\n", row.join(" ")));
        }
        text
    }

    /// The result as one JSON object: °C, seconds, shares from 0 to 1; null where unknown.
    #[must_use]
    pub fn to_json(&self) -> String {
        let missing = self.missing.iter();
        let missing: Map<String, Value> = missing
            .map(|(reason, count)| (reason.name().to_owned(), json!(count)))
            .collect();
        let mut faults = json!(self.faults);
        faults["torn_share"] = json!(self.faults.torn_share());
        let document = json!({
            "format": "grideye-characterization",
            "version": 1,
            "frames": self.frames,
            "missing": missing,
            "skipped": self.skipped,
            "gaps": self.gaps,
            "timing": self.timing,
            "sensor_hz": self.sensor_hz(),
            "pixel_step_c": self.steps.pixel_c,
            "thermistor_step_c": self.steps.thermistor_c,
            "noise_sigma_c": self.noise.sigma_c.to_vec(),
            "noise_sigma_median_c": self.noise.median_c(),
            "common_mode": self.common_mode,
            "pattern": self.pattern.map(|pattern| json!({
                "surface_c": pattern.surface_c.to_vec(),
                "offset_c": pattern.offset_c.to_vec(),
                "sd_c": pattern.sd_c,
                "mean_c": pattern.mean_c.to_vec(),
            })),
            "presence": self.presence_json(),
            "allan": self.allan,
            "faults": faults,
            "thermistor": self.thermistor,
        });
        format!("{document:#}\n")
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

    fn add_frames(&self, lines: &mut Lines) {
        let missing = self.missing.iter();
        let why: Vec<String> = missing
            .map(|(reason, count)| format!("{count} {reason}"))
            .collect();
        let (number, why) = (self.missing.values().sum::<u64>(), why.join(", "));
        lines.add("frames read", self.frames, "");
        lines.add("frames recorded as missing", number, why);
        let gaps = match self.gaps {
            0 => String::new(),
            gaps => format!("at {}", counted(gaps, "place")),
        };
        lines.add("sequence numbers left out", self.skipped, gaps);
    }

    fn add_timing(&self, lines: &mut Lines) {
        let timing = &self.timing;
        lines.add("length, s", fixed(timing.span_s, 1), "");
        let rate = fixed(timing.rate_hz, 3);
        lines.add("frame rate of the recording, Hz", rate, "stalls left out");
        let longest = fixed(1000.0 * timing.longest_s, 2);
        let longest = format!("longest interval {longest} ms");
        lines.add("stalls", timing.stalls, longest);
        let jumps = timing.listed_jumps.iter();
        let jumps: Vec<String> = jumps
            .map(|jump| format!("{} s at frame {}", fixed(jump.by_s, 1), jump.seq))
            .collect();
        lines.add("jumps of the clock", timing.jumps, jumps.join(", "));
        let (rate, note) = match self.sensor_hz() {
            Some(rate) => {
                let off = signed(100.0 * (rate / NOMINAL_HZ - 1.0), 1);
                (fixed(rate, 2), format!("clock {off} %"))
            }
            None => ("unknown".to_owned(), String::new()),
        };
        lines.add("frame rate of the sensor, Hz", rate, note);
    }

    fn add_noise(&self, lines: &mut Lines) {
        let step = |step: Option<f64>| step.map_or("unknown".to_owned(), |step| step.to_string());
        let [pixel, thermistor] = [self.steps.pixel_c, self.steps.thermistor_c].map(step);
        lines.add("step of the pixels, °C", pixel, "");
        lines.add("step of the thermistor, °C", thermistor, "");
        let (least, most) = self.noise.range_c();
        let range = format!("{} to {} over the pixels", fixed(least, 2), fixed(most, 2));
        let middle = fixed(self.noise.median_c(), 3);
        lines.add("noise of the median pixel, °C", middle, range);
        let pattern = self.pattern.map(|pattern| fixed(pattern.sd_c, 3));
        let pattern = pattern.unwrap_or("unknown".to_owned());
        lines.add("fixed pattern, sd, °C", pattern, "beyond a smooth surface");
    }

    fn add_presence(&self, lines: &mut Lines) {
        let by = |spot: &Spot| fixed(spot.celsius, 2);
        let (somebody, note) = match &self.presence {
            Presence::Nobody => ("no", String::new()),
            Presence::Somebody(spot) => ("yes", format!("{spot} change by {} °C", by(spot))),
            Presence::Still(spot) => ("unknown", format!("{spot} stay {} °C warm", by(spot))),
            Presence::TooShort => ("unknown", "less than half a minute".to_owned()),
        };
        lines.add("somebody in view", somebody, note);
    }

    fn add_common_mode(&self, lines: &mut Lines) {
        let Some(common) = &self.common_mode else {
            lines.add("common mode", "unknown", "no hundred frames in a row");
            return;
        };
        let time = common.flicker.map_or(String::new(), |flicker| {
            let (sd, longest) = (fixed(flicker.sd_c, 3), fixed(flicker.correlation_s, 1));
            let octaves = flicker.octaves;
            format!("flickers with sd {sd} in {octaves} octaves up to {longest} s")
        });
        lines.add("slow common mode, sd, °C", fixed(common.sd_c, 3), time);
        let Some(cycle) = common.cycle else {
            lines.add("cycle, frames", "none", "");
            return;
        };
        let times = fixed(cycle.contrast, 0);
        let note = format!("one frame colder, {times} times the spectrum's median");
        lines.add("cycle, frames", fixed(cycle.frames, 2), note);
        lines.add("its depth, °C", fixed(cycle.depth_c, 3), "");
    }

    fn add_faults(&self, lines: &mut Lines) {
        let faults = &self.faults;
        let percent = |share: f64| fixed(100.0 * share, 2);
        let compared = faults.compared;
        let chance = fixed(faults.torn_by_chance * long_count(compared), 1);
        let torn = format!(
            "{} of {compared}; {chance} expected by chance in whole frames",
            faults.torn
        );
        let share = percent(faults.torn_share());
        lines.add("partly repeated (torn) frames, %", share, torn);
        let in_a_row = match faults.duplicates {
            0 => String::new(),
            _ => format!("up to {} in a row", faults.duplicates_in_a_row_max),
        };
        let share = percent(faults.duplicate_share());
        lines.add("duplicate frames, %", share, in_a_row);
        let pixels = match faults.glitch_frames {
            0 => String::new(),
            _ => counted(faults.glitch_pixels, "pixel"),
        };
        lines.add("frames with a glitch", faults.glitch_frames, pixels);
    }

    fn add_thermistor(&self, lines: &mut Lines) {
        let Some(thermistor) = &self.thermistor else {
            lines.add("thermistor over the scene, °C", "not recorded", "");
            return;
        };
        let (mean, scene) = (fixed(thermistor.mean_c, 2), fixed(thermistor.scene_c, 2));
        let above = fixed(thermistor.offset_c, 2);
        let both = format!("{mean} over {scene}");
        lines.add("thermistor over the scene, °C", above, both);
        let sigma = fixed(thermistor.sigma_c, 3);
        lines.add("noise of the thermistor, °C", sigma, "");
    }
}

impl Display for Spot {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (row, column) = (self.row + 1, self.column + 1);
        let (next_row, next_column) = (row + 1, column + 1);
        write!(
            formatter,
            "rows {row} and {next_row}, columns {column} and {next_column}"
        )
    }
}
