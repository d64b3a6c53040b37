//! The comparison as JSON.

use crate::background::fit::BackgroundFit;
use crate::compare::{Comparison, FilmFrame, FrameScores};
use crate::metrics::score::{Measure, Score};
use crate::report::text::Context;
use crate::report::{alignment, paper};
use serde_json::{Map, Value, json};

/// One JSON object with stable field names; undefined values are `null`, shares 0 to 1, °C, seconds.
#[must_use]
pub fn json(comparison: &Comparison, context: &Context) -> String {
    let mut document = summary(comparison, context);
    let more = json!({
        "format": "grideye-comparison",
        "version": 1,
        "thresholds": context.thresholds,
        "nobody": comparison.nobody,
        "above_room": comparison.above_room.map(|above| json!({
            "correlation": above.value,
            "ceiling": above.ceiling,
            "room": above.from.in_words(),
        })),
        "warnings": comparison.warnings,
        "background": comparison.background.as_ref().map(background),
        "level_max_c": comparison.level_max_c,
        "units": {
            "pattern_c": comparison.pattern_c,
            "pattern_from": comparison.pattern_from,
        },
        "columns": comparison.shape.columns,
        "rows": comparison.shape.rows,
        "simulated_frames": comparison.simulated_frames,
        "pairs": comparison.pairs,
        "offset_c": comparison.offset_c,
        "drift_c": comparison.drift_c,
        "drift_c_per_min": comparison.drift_c_per_min,
        "warm_above_c": comparison.warm_above_c,
        "union_above_c": comparison.union_above_c,
        "warm_pixels": comparison.warm,
        "evaluation_graph": comparison.evaluation,
        "noise_fit": {
            "chi_squared": comparison.noise_fit.value,
            "degrees_of_freedom": comparison.noise_fit.degrees_of_freedom,
            "p": comparison.noise_fit.p_value(),
        },
        "maps": comparison.maps,
        "timeline": timeline(comparison),
        "film": film(comparison),
        "settings": comparison.settings,
        "context": self::context(comparison, context),
        "paper": { "citation": paper::CITATION, "experiment": context.experiment },
    });
    if let (Value::Object(document), Value::Object(more)) = (&mut document, more) {
        document.remove("notes");
        document.extend(more);
    }
    format!("{document:#}\n")
}

/// The part of this object that the page of live comparisons shows, with the comparison's notes.
#[must_use]
pub fn summary(comparison: &Comparison, context: &Context) -> Value {
    let judgment = &comparison.judgment;
    json!({
        "verdict": judgment.verdict,
        "headline": judgment.headline,
        "next_step": judgment.next_step,
        "reasons": judgment.reasons,
        "would_change": judgment.would_change,
        "criteria": judgment.criteria,
        "decision": comparison.decision,
        "protocol": comparison.settings.protocol,
        "real_frames": comparison.real_frames,
        "noise_sigma_c": comparison.noise_sigma_c,
        "alignment": comparison.alignment.as_ref().map(alignment::json),
        "scores": scores(comparison, context),
        "notes": comparison.notes,
    })
}

fn background(fit: &BackgroundFit) -> Value {
    let stretches: Vec<String> = fit.stretches.iter().map(ToString::to_string).collect();
    json!({
        "profile_rms_c": fit.profile_c,
        "own_rms_c": fit.own_c,
        "own_stretches": stretches,
    })
}

fn scores(comparison: &Comparison, context: &Context) -> Map<String, Value> {
    let experiment = context.experiment.and_then(paper::experiment);
    let entry = |score: &Score| {
        let figure = experiment.and_then(|experiment| experiment.figure(score.measure));
        (score.measure.name().to_owned(), self::score(score, figure))
    };
    comparison.scores.iter().map(entry).collect()
}

fn score(score: &Score, papers: Option<f64>) -> Value {
    json!({
        "title": score.measure.title(),
        "unit": unit(score.measure),
        "better": score.measure.better(),
        "value": score.value,
        "blank": score.blank,
        "shuffled": score.shuffled,
        "noise": score.noise,
        "ceiling": score.ceiling,
        "skill": score.skill(),
        "papers": papers,
    })
}

fn unit(measure: Measure) -> &'static str {
    match measure.unit() {
        "%" => "share",
        "" => "1",
        unit => unit,
    }
}

fn timeline(comparison: &Comparison) -> Value {
    let frames = &comparison.timeline;
    let of = |measure: &Measure| -> Option<(String, Value)> {
        let values: Vec<Option<f64>> = frames.iter().map(|frame| frame.get(*measure)).collect();
        let is_known = values.iter().any(Option::is_some);
        is_known.then(|| (measure.name().to_owned(), json!(values)))
    };
    let scores: Map<String, Value> = Measure::ALL.iter().filter_map(of).collect();
    let list = |value: &dyn Fn(&FrameScores) -> Value| -> Vec<Value> {
        frames.iter().map(value).collect()
    };
    json!({
        "time_s": list(&|frame| json!(frame.time.as_secs_f64())),
        "offset_c": list(&|frame| json!(frame.offset_c)),
        "scores": scores,
        "difference_c": list(&|frame| json!(frame.difference_c)),
        "structure": list(&|frame| json!(frame.structure)),
    })
}

fn film(comparison: &Comparison) -> Vec<Value> {
    let frame = |frame: &FilmFrame| json!({ "time_s": frame.time.as_secs_f64(), "real_c": frame.real, "simulated_c": frame.simulated });
    comparison.film.iter().map(frame).collect()
}

fn context(comparison: &Comparison, context: &Context) -> Value {
    let seeds: Map<String, Value> = context
        .seeds
        .iter()
        .map(|(name, seed)| (name.clone(), json!(seed)))
        .collect();
    let assumptions: Vec<&String> = context
        .assumptions
        .iter()
        .chain(&comparison.notes)
        .collect();
    let mut found = json!(context);
    found["seeds"] = json!(seeds);
    found["assumptions"] = json!(assumptions);
    found
}
