//! Calibrates a scene: values and warnings as text, as JSON, and as a scene file.

use crate::calibrate::document;
use crate::calibrate::frames::Frames;
use crate::calibrate::model::{Model, check_bounds, noise_key, unknowns};
use crate::calibrate::noise::Parts;
use crate::calibrate::search::{FineSearch, from_several_starts, steps_in_frames};
use crate::calibrate::types::{Calibration, Determined, Estimate, Law, Options, Pace, Progress};
use crate::calibrate::uncertainty::{UNIFORM_SD, Uncertainty, student_97_5};
use crate::constants::{CORRELATION_TOLD, PART_MIN, WIDENED_TOLD};
use crate::error::{ValidatorError, check_resolution};
use crate::frames::fitted::calibrated;
use crate::frames::timeline::{Joined, Timeline};
use crate::frames::types::STEP_VARIANCE;
use crate::linear::dot;
use crate::numbers::count;
use grideye_draw::text::fixed;
use grideye_frame::PIXELS;
use grideye_recording::Record;
use grideye_scene::uncertain::{RECORDING_START, Uncertain};
use grideye_scene::{Calibrated, Files, Scene};
use serde_json::json;
use std::time::Duration;

fn gathered(
    (text, scene, sensor, fitted): (&str, &Scene, &str, Calibrated),
    unknowns: &[Uncertain],
    model: &Model<'_>,
    frames: &Frames,
    fine: &FineSearch,
    before: &[f64],
    starts: [usize; 2],
) -> Calibration {
    let mut found = found(unknowns, model, fine);
    let white = fine.noise.white;
    put_noise(&mut found, sensor, white, frames.len());
    let parts = Parts::of(&fine.left_over, frames.len());
    let root = count(frames.len()).sqrt();
    let level = parts.together.iter().sum::<f64>() / count(frames.len()) / count(PIXELS).sqrt();
    let rmse = |left: &[f64]| (dot(left, left) / count(left.len())).sqrt();
    let correlation = correlation(&found, model, &fine.uncertainty);
    let warnings = warnings(&found, &correlation, model, &fine.uncertainty, starts);
    Calibration {
        scene: document::scene(text, (scene, unknowns), &found, &fitted),
        correlation,
        determined: determined(&found, model, &fine.uncertainty),
        warnings,
        frames: frames.len(),
        half: frames.half,
        frames_read: frames.read,
        frames_left_out: frames.left_out,
        rmse_c: [rmse(before), rmse(&fine.left_over)],
        noise_sigma_c: white.sqrt(),
        pattern_c: std::array::from_fn(|pixel| parts.pattern[pixel] / root + level),
        pattern_sd_c: fine.noise.pattern.sqrt(),
        common_sd_c: fine.noise.together[0].max(0.0).sqrt(),
        starts,
        evaluations: model.evaluations,
        found,
    }
}

fn found(unknowns: &[Uncertain], model: &Model<'_>, fine: &FineSearch) -> Vec<Estimate> {
    let values = model.values(&fine.solution.point);
    let mut found: Vec<Estimate> = unknowns
        .iter()
        .zip(values)
        .map(|(one, value)| Estimate {
            key: one.key.clone(),
            start: one.value,
            value,
            uncertainty: None,
            half_width_95: None,
            freedom: 0.0,
            bounds: one.bounds,
            at_bound: false,
            law: one.law.map(|law| Law {
                mean: law.mean,
                sd: law.sd,
            }),
            from_recording: None,
        })
        .collect();
    let known = &fine.uncertainty;
    for &place in &known.at_bound {
        found[model.searched[place]].at_bound = true;
    }
    for (number, &place) in known.told.iter().enumerate() {
        let found = &mut found[model.searched[place]];
        let width = found.bounds[1] - found.bounds[0];
        let uncertainty = known.covariance[number][number].sqrt() * width;
        found.freedom = known.freedom[number];
        found.uncertainty = Some(uncertainty);
        found.half_width_95 = Some(uncertainty * student_97_5(found.freedom));
        found.from_recording = Some(1.0 - known.from_prior[number]);
    }
    for found in &mut found {
        found.value = rounded(found.value, found.uncertainty, found.bounds);
    }
    found
}

/// Takes the sensor's noise from the residuals, less the sensor's rounding.
fn put_noise(found: &mut [Estimate], sensor: &str, white: f64, frames: usize) {
    let key = noise_key(sensor);
    let Some(found) = found.iter_mut().find(|found| found.key == key) else {
        return;
    };
    let freedom = count(PIXELS - 1) * (count(frames) - 1.0);
    let sigma = (white - STEP_VARIANCE).max(0.0).sqrt();
    // Uncertainty of a variance with these degrees of freedom, propagated to its root.
    let uncertainty = white * (2.0 / freedom).sqrt() / (2.0 * sigma.max(1e-3));
    found.at_bound = !(found.bounds[0]..=found.bounds[1]).contains(&sigma);
    let within = sigma.clamp(found.bounds[0], found.bounds[1]);
    found.value = rounded(within, Some(uncertainty), found.bounds);
    if !found.at_bound {
        found.freedom = freedom;
        found.uncertainty = Some(uncertainty);
        found.half_width_95 = Some(uncertainty * student_97_5(freedom));
    }
}

/// Rounds to a hundredth of the uncertainty, or else to a millionth of the range between the bounds.
fn rounded(value: f64, uncertainty: Option<f64>, bounds: [f64; 2]) -> f64 {
    let hundredth = uncertainty.filter(|own| *own > 0.0).map(|own| own * 0.01);
    let finest = hundredth.unwrap_or((bounds[1] - bounds[0]) * 1e-6);
    let step = 10.0_f64.powf(finest.log10().floor());
    // Dividing by a power of ten above 1 gives the nearest decimal; multiplying by one below 1 does not.
    let per_step = (1.0 / step).round();
    let near = if per_step >= 1.0 {
        (value * per_step).round() / per_step
    } else {
        (value / step).round() * step
    };
    near.clamp(bounds[0], bounds[1])
}

fn determined(found: &[Estimate], model: &Model<'_>, known: &Uncertainty) -> Determined {
    let known = &known.determined;
    let named = known.places.iter().enumerate().map(|(number, &place)| {
        let found = &found[model.searched[place]];
        let unit = known.scales[number] * (found.bounds[1] - found.bounds[0]);
        (found.key.clone(), known.coefficients[number], unit)
    });
    let mut least: Vec<(String, f64, f64)> = named
        .filter(|(_, coefficient, _)| coefficient.abs() > PART_MIN)
        .collect();
    least.sort_by(|(_, one, _), (_, other, _)| other.abs().total_cmp(&one.abs()));
    if least
        .first()
        .is_some_and(|(_, coefficient, _)| *coefficient < 0.0)
    {
        least
            .iter_mut()
            .for_each(|(_, coefficient, _)| *coefficient = -*coefficient);
    }
    Determined {
        combinations: known.number,
        of: known.places.len(),
        least_from_recording: known.least,
        least,
    }
}

fn correlation(found: &[Estimate], model: &Model<'_>, known: &Uncertainty) -> Vec<Vec<f64>> {
    let mut correlation = vec![vec![0.0; found.len()]; found.len()];
    for (row, &from) in known.told.iter().enumerate() {
        for (column, &to) in known.told.iter().enumerate() {
            let scale = (known.covariance[row][row] * known.covariance[column][column]).sqrt();
            correlation[model.searched[from]][model.searched[to]] = if row == column {
                1.0
            } else {
                known.covariance[row][column] / scale
            };
        }
    }
    correlation
}

fn warnings(
    found: &[Estimate],
    correlation: &[Vec<f64>],
    model: &Model<'_>,
    known: &Uncertainty,
    starts: [usize; 2],
) -> Vec<String> {
    let mut warnings = Vec::new();
    let keys = |places: &[usize]| {
        let key = |&place: &usize| format!("`{}`", found[model.searched[place]].key);
        places.iter().map(key).collect::<Vec<_>>().join(" and ")
    };
    if !known.tangled.is_empty() {
        warnings.push(format!(
            "{} cannot be told apart: many of their values make the same frames\nhint: measure one, write it into the scene and remove its [[uncertain]]",
            keys(&known.tangled)
        ));
    }
    for &place in &known.idle {
        warnings.push(format!(
            "{} has no effect on the frames and keeps its value\nhint: check that it is in view of this sensor",
            keys(&[place])
        ));
    }
    for (row, values) in correlation.iter().enumerate() {
        for (column, value) in values[..row].iter().enumerate() {
            if value.abs() > CORRELATION_TOLD {
                let (one, other) = (&found[column].key, &found[row].key);
                let value = fixed(*value, 3);
                warnings.push(format!(
                    "`{one}` and `{other}` can hardly be told apart (correlation {value}): an error in one hides in the other\nhint: measure one, write it into the scene and remove its [[uncertain]]"
                ));
            }
        }
    }
    for found in found {
        let (key, value) = (&found.key, found.value);
        let widest = UNIFORM_SD * (found.bounds[1] - found.bounds[0]);
        if found.at_bound {
            warnings.push(format!(
                "`{key}` lies at a bound, {value}: it has no uncertainty, and the other uncertainties hold only if the bound is right\nhint: widen the bounds if you can; otherwise the scene lacks something"
            ));
        } else if found.uncertainty.is_some_and(|own| own > widest) {
            warnings.push(format!(
                "the recording determines `{key}` less well than its bounds do\nhint: remove its [[uncertain]], or record something that shows it"
            ));
        }
    }
    if known.widened.iter().any(|widened| *widened > WIDENED_TOLD) {
        let most = known.widened.iter().copied().fold(1.0, f64::max).sqrt();
        warnings.push(format!(
            "the residuals repeat from frame to frame or are larger than noise, so something moves differently than in the scene; uncertainties were widened up to {} times\nhint: check the trajectory, the shapes and recording.start_s",
            fixed(most, 1)
        ));
    }
    if starts[1] * 4 < starts[0] {
        warnings.push(format!(
            "only {} of {} starts reached the best end: there may be a better one\nhint: narrow the bounds or raise --starts",
            starts[1], starts[0]
        ));
    }
    warnings
}

impl Estimate {
    /// `84.97 ± 0.12 (95 %: 84.73 to 85.21)`, or why there is no uncertainty.
    #[must_use]
    pub fn told(&self) -> String {
        let (Some(uncertainty), Some(half)) = (self.uncertainty, self.half_width_95) else {
            let why =
                ["not determined by the recording", "at its bound"][usize::from(self.at_bound)];
            return format!("{} ({why})", self.value);
        };
        let digits = digits(uncertainty);
        let source = match (self.law, self.from_recording) {
            (Some(law), Some(share)) => format!(
                "; {} % from the recording, the rest from {} ± {}",
                fixed(100.0 * share, 0),
                law.mean,
                law.sd
            ),
            _ => String::new(),
        };
        format!(
            "{:.digits$} ± {uncertainty:.digits$} (95 %: {:.digits$} to {:.digits$}{source})",
            self.value,
            self.value - half,
            self.value + half
        )
    }
}

/// Decimals that show two digits of an uncertainty.
fn digits(uncertainty: f64) -> usize {
    let place = 1.0 - uncertainty.max(1e-9).log10().floor();
    (0..10).find(|digits| count(*digits) >= place).unwrap_or(10)
}

impl Determined {
    fn text(&self) -> String {
        let (number, of) = (fixed(self.combinations, 1), self.of);
        let mut text =
            format!("the recording determines {number} of {of} combinations of the unknowns");
        for (place, (key, coefficient, unit)) in self.least.iter().enumerate() {
            let sign = match (place, *coefficient < 0.0) {
                (0, _) => "; the least: ",
                (_, true) => " - ",
                (_, false) => " + ",
            };
            let (size, unit) = (fixed(coefficient.abs(), 2), fixed(*unit, digits(*unit)));
            text.push_str(&format!("{sign}{size} {key} / {unit}"));
        }
        if !self.least.is_empty() {
            let share = fixed(100.0 * self.least_from_recording, 0);
            text.push_str(&format!(", {share} % from the recording"));
        }
        text + "\n"
    }
}

impl Calibration {
    /// A table of the unknowns, the residuals and the warnings.
    #[must_use]
    pub fn text(&self) -> String {
        let keys = self.found.iter().map(|found| found.key.chars().count());
        let width = keys.max().unwrap_or(0);
        let mut text = String::new();
        for found in &self.found {
            let (key, told, start) = (&found.key, found.told(), found.start);
            text.push_str(&format!("{key:<width$}  {told}  from {start}\n"));
        }
        let (frames, read, left_out) = (self.frames, self.frames_read, self.frames_left_out);
        let [before, after] = self.rmse_c.map(|rmse_c| fixed(rmse_c, 3));
        text.push_str(&format!(
            "\n{frames} of {read} frames; {left_out} left out as torn or repeated\nresidual: {before} °C with the scene as written, {after} with the values found\n"
        ));
        let parts = [self.noise_sigma_c, self.pattern_sd_c, self.common_sd_c];
        let [noise, pattern, common] = parts.map(|part_c| fixed(part_c, 3));
        text.push_str(&format!(
            "of which noise {noise} °C per pixel, pattern {pattern} °C between pixels, common mode {common} °C\n"
        ));
        text.push_str(&self.determined.text());
        text.push_str(&match self.half {
            Some(half) => format!(
                "fitted to the {} half: `grideye compare` judges the scene by the other\n",
                half.name()
            ),
            None => "fitted to all frames: `grideye compare` needs another recording to judge the scene (or --half first)\n".to_owned(),
        });
        text.push_str("not in the uncertainties: the sensor's overall accuracy, typ. ±2.5 °C, and drift slower than the recording\n");
        for warning in &self.warnings {
            text.push_str(&format!("warning: {warning}\n"));
        }
        text
    }

    /// The result as one JSON object, in the keys' own units; null where unknown.
    #[must_use]
    pub fn to_json(&self) -> String {
        let document = json!({
            "format": "grideye-calibration",
            "version": 1,
            "found": self.found,
            "correlation": self.correlation,
            "determined": self.determined,
            "warnings": self.warnings,
            "frames": self.frames,
            "half": self.half,
            "frames_read": self.frames_read,
            "frames_left_out": self.frames_left_out,
            "rmse_before_c": self.rmse_c[0],
            "rmse_after_c": self.rmse_c[1],
            "noise_sigma_c": self.noise_sigma_c,
            "pattern_c": self.pattern_c.to_vec(),
            "pattern_sd_c": self.pattern_sd_c,
            "common_sd_c": self.common_sd_c,
            "starts": self.starts[0],
            "starts_at_best": self.starts[1],
            "evaluations": self.evaluations,
        });
        format!("{document:#}\n")
    }
}

/// Finds the unknowns that a scene marks, from the whole frames during the scene; times count from `recording.start_s`.
///
/// `tell` receives the progress after each step of the search.
///
/// # Errors
/// [`ValidatorError`].
pub fn calibrate(
    records: &[Record],
    (text, origin): (&str, &str),
    files: &dyn Files,
    sensor: &str,
    options: &Options,
    tell: &mut dyn FnMut(Progress),
) -> Result<Calibration, ValidatorError> {
    let loaded = Scene::parse_without_variants(text, origin, files)?;
    let unknowns = unknowns(&loaded.scene);
    if unknowns.is_empty() {
        return Err(ValidatorError::Refused(format!(
            "{origin} marks no number to find\nhint: add an [[uncertain]] table, key = \"room.ambient_c\" and bounds = [15, 30] for example; those of keys without a number are for `grideye compare`; scenes/README.md describes them"
        )));
    }
    check_resolution(loaded.scene.sensor(sensor)?)?;
    check_bounds((text, origin), &unknowns, files)?;
    let begins = unknowns.iter().find(|one| one.key == RECORDING_START);
    let [earliest_s, latest_s] = begins.map_or([0.0, 0.0], |one| one.bounds);
    let timeline = Timeline::new(records, &loaded.scene, None)?;
    let within = (!loaded.scene.is_static()).then(|| {
        let at = |seconds: f64| Duration::try_from_secs_f64(seconds).unwrap_or(Duration::MAX);
        let end_s = loaded.scene.duration().as_secs_f64() - latest_s;
        // Frames that may be from before the scene's start are left out, unless the first frame is that start.
        let begin_s = match timeline.joined() {
            Joined::Utc => -earliest_s,
            Joined::Given | Joined::ClockNeverSet => 0.0,
        };
        at(begin_s.max(0.0))..=at(end_s.max(0.0))
    });
    let frames = Frames::of(records, &timeline, within.as_ref(), options)?;
    let pace = Pace::new(steps_in_frames(&frames, options), tell);
    let mut model = Model::new(text, origin, files, sensor, pace)?;
    let before = model.left_over(&model.start(), &frames)?;
    let (coarse, noise, starts) = from_several_starts(&mut model, &frames, options)?;
    let fine = FineSearch::search(&mut model, &frames, (&coarse, noise), options)?;
    let keys = unknowns.iter().map(|one| one.key.clone());
    let keys = keys.filter(|key| key != RECORDING_START).collect();
    let fitted = calibrated(records, &timeline, frames.span(), keys);
    let asked = (text, &loaded.scene, sensor, fitted);
    Ok(gathered(
        asked, &unknowns, &model, &frames, &fine, &before, starts,
    ))
}
