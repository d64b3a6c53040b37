//! Sensor faults that a recording shows by itself: stuck pixels, wrong steps, pixels that do not fit the thermistor, a wrong
//! frame rate. Correlation and gain do not see these.

use crate::frames::noise::{PixelHistograms, apart};
use crate::frames::types::{STEP_VARIANCE, decoded};
use crate::numbers::{CommonStep, count, median, normal_tail};
use crate::thresholds::Thresholds;
use crate::verdict::types::{Criterion, Question, State};
use grideye_draw::text::fixed;
use grideye_frame::word::pixel_steps;
use grideye_frame::{PIXELS, RecordedFrame};
use grideye_recording::Record;

#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Inspection {
    /// Frames that differ from the frame before.
    frames: usize,
    /// Each pixel's longest run of frames without a change.
    longest: [usize; PIXELS],
    /// The highest probability that a quiet pixel keeps its value for one more frame; `None` without noise.
    stays: Option<f64>,
    /// The largest step, in raw words, of which all differences are multiples; 0 if nothing changes.
    step_words: u16,
    /// Median of the pixels, and the thermistor, °C; `None` if it was not recorded.
    pixels_c: f64,
    thermistor_c: Option<f64>,
    /// Frames per second by the recording's timestamps.
    rate_hz: Option<f64>,
}

/// The quietest pixels have at least this share of the median noise; we measured 0.67, 0.78 and 0.88.
const QUIETEST: f64 = 0.6;
/// Fewest pairs of consecutive frames that tell a rate.
const STEPS_MIN: usize = 5;

impl Inspection {
    pub(crate) fn new(records: &[Record], step_c: f64) -> Option<Self> {
        let frames = distinct(records);
        let (first, last) = (frames.first()?, frames.last()?);
        let thermistor = |frame: &RecordedFrame| {
            let word = frame.thermistor?;
            Some(f64::from(
                grideye_frame::word::thermistor_celsius(word).get(),
            ))
        };
        let all: Vec<f64> = [first, last]
            .into_iter()
            .flat_map(|frame| decoded(&frame.raw))
            .collect();
        Some(Self {
            frames: frames.len(),
            longest: longest_runs(&frames),
            stays: noise(&frames).map(|sigma_c| stays(sigma_c, step_c)),
            step_words: common_step(&frames),
            pixels_c: median(&all).unwrap_or_default(),
            thermistor_c: thermistor(&first.raw)
                .zip(thermistor(&last.raw))
                .map(|(first, last)| f64::midpoint(first, last)),
            rate_hz: rate_hz(&frames),
        })
    }

    /// The criteria, given the scene's frame rate and air temperature.
    pub(crate) fn criteria(
        &self,
        thresholds: &Thresholds,
        scene_hz: f64,
        ambient_c: f64,
    ) -> Vec<Criterion> {
        vec![
            self.stuck(thresholds),
            self.steps(),
            self.thermistor(thresholds, ambient_c),
            self.rate(thresholds, scene_hz),
        ]
    }

    fn stuck(&self, thresholds: &Thresholds) -> Criterion {
        let asked = Question("moving_pixels", "Every pixel moves", &["false_alarm_max"]);
        let (frames, rate) = (self.frames, thresholds.false_alarm_max);
        let Some(stays) = self.stays else {
            let why = "The recording has no noise, so an unchanging pixel is no fault.";
            return asked.answered(State::NotAsked, why);
        };
        let by_chance = |run: usize| count(PIXELS) * count(frames) * stays.powf(count(run));
        let needed = (1..=RUN_MAX).find(|&run| by_chance(run) <= rate);
        let Some(needed) = needed.filter(|&needed| needed <= frames) else {
            let why =
                format!("{frames} frames are too few to tell a stuck pixel from a quiet one.");
            return asked.answered(State::NotAsked, why);
        };
        let stuck: Vec<String> = (0..PIXELS)
            .filter(|&pixel| self.longest[pixel] >= needed)
            .map(|pixel| (pixel + 1).to_string())
            .collect();
        let longest = self.longest.iter().max().copied().unwrap_or_default();
        if stuck.is_empty() {
            let found = format!(
                "No pixel keeps its value for more than {longest} frames; from {needed} on it would be stuck (false alarms: below {rate} per recording)."
            );
            return asked.answered(State::Met, found);
        }
        let others = match stuck.len().saturating_sub(NAMED_MAX) {
            0 => String::new(),
            others => format!(" and {others} more"),
        };
        let stuck = stuck[..stuck.len().min(NAMED_MAX)].join(", ") + &others;
        let found = format!(
            "Pixel {stuck} (of 1 to 64) did not change for up to {longest} frames; noise changes every pixel within {needed} (false alarms: below {rate} per recording)."
        );
        asked.failed(
            found,
            "Switch the sensor off and on and record again; replace it if the pixel stays stuck.",
        )
    }

    fn steps(&self) -> Criterion {
        let asked = Question("steps", "The steps are the sensor's", &[]);
        match self.step_words {
            0 => {
                let why = "Nothing in the recording changes, so its steps are unknown.";
                asked.answered(State::NotAsked, why)
            }
            1 => asked.answered(State::Met, "The pixels use every step of the sensor."),
            more => {
                let found = format!(
                    "All pixels differ by multiples of {more} sensor steps: they were rounded, or decoded with a wrong scale."
                );
                asked.failed(
                    found,
                    "Store the raw words of the sensor, or correct the scale in the program that wrote the recording.",
                )
            }
        }
    }

    fn thermistor(&self, thresholds: &Thresholds, ambient_c: f64) -> Criterion {
        let asked = Question(
            "thermistor",
            "Pixels and thermistor belong together",
            &["thermistor_apart_max_c"],
        );
        let most = thresholds.thermistor_apart_max_c;
        let Some(thermistor_c) = self.thermistor_c else {
            return asked.answered(State::NotAsked, "The recording has no thermistor.");
        };
        let pixels_c = self.pixels_c;
        let (pixels, thermistor) = (fixed(pixels_c, 1), fixed(thermistor_c, 1));
        let both = format!("the pixels show {pixels} °C, the thermistor {thermistor} °C");
        if (pixels_c - thermistor_c).abs() <= most {
            let found = format!(
                "Pixels and thermistor fit one sensor: {both}; up to {most} °C apart is usual."
            );
            return asked.answered(State::Met, found);
        }
        if (ambient_c - thermistor_c).abs() > most && (ambient_c - pixels_c).abs() <= most {
            let ambient = fixed(ambient_c, 1);
            let why =
                format!("The scene's air, {ambient} °C, is far from the thermistor too: {both}.");
            return asked.answered(State::NotAsked, why);
        }
        let scale = scale(pixels_c, thermistor_c);
        let found = format!(
            "The pixels do not fit the thermistor: {both}, more than {most} °C apart{scale}."
        );
        asked.failed(
            found,
            "Check the scales in the program that wrote the recording: 0.25 °C per pixel step, 0.0625 °C per thermistor step.",
        )
    }

    fn rate(&self, thresholds: &Thresholds, scene_hz: f64) -> Criterion {
        let asked = Question("frame_rate", "The rate is the scene's", &["rate_error_max"]);
        let Some(found_hz) = self.rate_hz else {
            let why = "Too few consecutive frames to tell their rate.";
            return asked.answered(State::NotAsked, why);
        };
        let off = found_hz / scene_hz - 1.0;
        let (found, scene) = (fixed(found_hz, 2), fixed(scene_hz, 2));
        let percent = fixed(100.0 * off.abs(), 1);
        let relation = if off < 0.0 { "slower" } else { "faster" };
        let allowed = fixed(100.0 * thresholds.rate_error_max, 0);
        let sentence = format!(
            "The recording has {found} new frames per second, {percent} % {relation} than the scene's {scene}; {allowed} % is allowed."
        );
        let step = "Set sampling_hz of the scene's sensor to the real rate, or check why the recording misses frames.";
        asked.met_or(off.abs() <= thresholds.rate_error_max, sentence, step)
    }
}

const RUN_MAX: usize = 100_000;
/// Stuck pixels that are named.
const NAMED_MAX: usize = 6;

/// Swapped scales make a factor of four.
fn scale(pixels_c: f64, thermistor_c: f64) -> &'static str {
    let ratio = pixels_c / thermistor_c;
    if (0.17..0.33).contains(&ratio) {
        ", as if the pixels were decoded with the thermistor's step of 0.0625 °C"
    } else if (3.0..6.0).contains(&ratio) {
        ", as if the thermistor were decoded with the pixels' step of 0.25 °C"
    } else {
        ""
    }
}

struct Distinct {
    raw: RecordedFrame,
    boot_ns: u64,
    seq: u64,
    /// The sequence number of the last record of the frame before.
    follows_seq: u64,
}

fn distinct(records: &[Record]) -> Vec<Distinct> {
    let mut frames: Vec<Distinct> = Vec::new();
    let mut last_seq = 0;
    for record in records {
        let Some(raw) = record.reading.frame() else {
            continue;
        };
        let is_new = frames
            .last()
            .is_none_or(|last| last.raw.pixels != raw.pixels);
        if is_new {
            frames.push(Distinct {
                raw: *raw,
                boot_ns: record.stamp.t_boot_ns,
                seq: record.seq,
                follows_seq: last_seq,
            });
        }
        last_seq = record.seq;
    }
    frames
}

/// Pairs of consecutive frames without a gap.
fn steps(frames: &[Distinct]) -> impl Iterator<Item = (&Distinct, &Distinct)> {
    frames
        .windows(2)
        .map(|pair| (&pair[0], &pair[1]))
        .filter(|(_, next)| next.seq == next.follows_seq.wrapping_add(1))
}

fn longest_runs(frames: &[Distinct]) -> [usize; PIXELS] {
    std::array::from_fn(|pixel| {
        frames
            .chunk_by(|a, b| a.raw.pixels[pixel] == b.raw.pixels[pixel])
            .map(<[Distinct]>::len)
            .max()
            .unwrap_or_default()
    })
}

/// The median pixel's noise without rounding, °C; `None` without noise, or with too few frames to tell.
fn noise(frames: &[Distinct]) -> Option<f64> {
    let mut differences = PixelHistograms::default();
    for (now, next) in steps(frames) {
        differences.push(&apart(&decoded(&next.raw), &decoded(&now.raw)));
    }
    let variance = median(&differences.noise_c())?.powi(2) - STEP_VARIANCE;
    (variance > 0.0).then(|| variance.sqrt())
}

/// The highest probability that one of the quietest pixels rounds to the same value again: it lies in the middle of a step.
fn stays(sigma_c: f64, step_c: f64) -> f64 {
    let half_step = step_c / 2.0 / (QUIETEST * sigma_c);
    1.0 - 2.0 * normal_tail(half_step)
}

/// The greatest step of which all differences between pixel words are multiples.
fn common_step(frames: &[Distinct]) -> u16 {
    let mut common = CommonStep::default();
    for &word in frames.iter().flat_map(|frame| &frame.raw.pixels) {
        common.push(pixel_steps(word));
    }
    common.step
}

fn rate_hz(frames: &[Distinct]) -> Option<f64> {
    let periods_s: Vec<f64> = steps(frames)
        .filter_map(|(now, next)| {
            let ns = next.boot_ns.checked_sub(now.boot_ns)?;
            Some(std::time::Duration::from_nanos(ns).as_secs_f64())
        })
        .collect();
    if periods_s.len() < STEPS_MIN {
        return None;
    }
    let period_s = median(&periods_s).unwrap_or_default();
    (period_s > 0.0).then(|| 1.0 / period_s)
}

#[cfg(test)]
mod tests {
    use super::*;

    impl Inspection {
        /// Fails every criterion.
        pub(crate) const fn faulty() -> Self {
            Self {
                frames: 1000,
                longest: [500; PIXELS],
                stays: Some(0.2),
                step_words: 4,
                pixels_c: 5.0,
                thermistor_c: Some(20.0),
                rate_hz: Some(5.0),
            }
        }
    }

    #[test]
    fn a_recording_without_a_thermistor_is_not_asked_about_it() {
        let bare = Inspection {
            thermistor_c: None,
            ..Inspection::faulty()
        };
        let state = |inspection: &Inspection| {
            let thresholds = Thresholds::default();
            inspection.thermistor(&thresholds, 20.0).state
        };
        assert_eq!(state(&Inspection::faulty()), State::Failed);
        assert_eq!(state(&bare), State::NotAsked);
    }

    /// Half a step is 0.3 sigma of the quietest, within which 0.2358 of normal draws lie.
    #[test]
    fn a_quiet_pixel_stays_as_a_normal_draw_does() {
        let sigma_c = 0.25 / 0.6 / 0.6;
        crate::numbers::assert_near(stays(sigma_c, 0.25), 0.2358, 1e-3);
    }
}
