//! The comparison as JSON.

use crate::align::Alignment;
use crate::background::fit::BackgroundFit;
use crate::compare::{Comparison, FilmFrame, FrameScores};
use crate::metrics::score::{Measure, Score};
use crate::report::paper;
use crate::report::text::Context;
use grideye_frame::{COLUMNS, ROWS};
use serde_json::{Map, Value, json};

/// One JSON object with stable field names; undefined values are `null`, shares 0 to 1, °C, seconds.
#[must_use]
pub fn json(comparison: &Comparison, context: &Context) -> String {
    let mut document = summary(comparison, context);
    let more = json!({
        "format": "grideye-comparison",
        "version": 1,
        "thresholds": context.thresholds,
        "warnings": comparison.warnings,
        "background": comparison.background.as_ref().map(background),
        "level_max_c": comparison.level_max_c,
        "units": {
            "pattern_c": comparison.pattern_c,
            "pattern_from": comparison.pattern_from,
        },
        "columns": COLUMNS,
        "rows": ROWS,
        "simulated_frames": comparison.simulated_frames,
        "pairs": comparison.pairs,
        "offset_c": comparison.offset_c,
        "drift_c": comparison.drift_c,
        "warm_above_c": comparison.warm_above_c,
        "evaluation_graph": comparison.evaluation,
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
        "criteria": judgment.criteria,
        "decision": comparison.decision,
        "protocol": comparison.settings.protocol,
        "real_frames": comparison.real_frames,
        "noise_sigma_c": comparison.noise_sigma_c,
        "alignment": comparison.alignment.as_ref().map(alignment),
        "scores": scores(comparison, context),
        "notes": comparison.notes,
    })
}

fn alignment(found: &Alignment) -> Value {
    let left_out = found.left_out.iter();
    let left_out: Vec<Value> = left_out
        .map(|left| {
            json!({
                "reason": left.reason.name(),
                "text": left.reason.to_string(),
                "rows": left.rows,
                "first_seq": left.first_seq,
            })
        })
        .collect();
    json!({
        "left_out": left_out,
        "drift_c": found.drift_c,
        "time": found.time,
        "orientation": found.orientation,
        "offset": found.offset.map(|found| json!({
            "right_px": found.right_down_px[0],
            "down_px": found.right_down_px[1],
            "likeness_before": found.likeness[0],
            "likeness": found.likeness[1],
            "applied": found.applied,
        })),
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
        let figure = experiment.and_then(|one| one.figure(score.measure));
        (score.measure.name().to_owned(), self::score(score, figure))
    };
    comparison.scores.iter().map(entry).collect()
}

fn score(score: &Score, papers: Option<f64>) -> Value {
    json!({
        "title": score.measure.to_string(),
        "unit": unit(score.measure),
        "better": score.measure.better(),
        "value": score.value,
        "blank": score.blank,
        "shuffled": score.shuffled,
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
    let of = |measure: Measure| -> Option<(String, Value)> {
        let values: Vec<Option<f64>> = frames.iter().map(|frame| frame.get(measure)).collect();
        let is_known = values.iter().any(Option::is_some);
        is_known.then(|| (measure.name().to_owned(), json!(values)))
    };
    let scores: Map<String, Value> = Measure::ALL.into_iter().filter_map(of).collect();
    let list = |value: &dyn Fn(&FrameScores) -> Value| -> Vec<Value> {
        frames.iter().map(value).collect()
    };
    json!({
        "time_s": list(&|frame| json!(frame.time.as_secs_f64())),
        "offset_c": list(&|frame| json!(frame.offset_c)),
        "scores": scores,
        "difference_c": list(&|frame| json!(frame.difference_c)),
    })
}

fn film(comparison: &Comparison) -> Vec<Value> {
    let frame = |frame: &FilmFrame| json!({ "time_s": frame.time.as_secs_f64(), "scene_time_s": frame.scene_time.as_secs_f64(), "real_c": frame.real, "simulated_c": frame.simulated });
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
