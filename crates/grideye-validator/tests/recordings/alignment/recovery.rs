//! Alignment must find known delays and rates, and regain the correlation that they cost.

use crate::alignment::bench::{
    WALK, closing_note, compared, correlation, quantile, record, seeds, with,
};
use grideye_recording::Record;
use grideye_scene::Scene;
use grideye_validator::Comparison;
use grideye_validator::align::TimeAlignment;

struct Truth {
    name: &'static str,
    shift_s: f64,
    rate: f64,
    shift_max_s: f64,
}

const fn narrow(name: &'static str, shift_s: f64, rate: f64) -> Truth {
    Truth {
        name,
        shift_s,
        rate,
        shift_max_s: 0.5,
    }
}

const fn wide(name: &'static str, shift_s: f64, rate: f64) -> Truth {
    Truth {
        shift_max_s: 3.0,
        ..narrow(name, shift_s, rate)
    }
}

const TRUTHS: [Truth; 7] = [
    narrow("none", 0.0, 0.0),
    narrow("0.25 s", 0.25, 0.0),
    narrow("-0.43 s", -0.43, 0.0),
    narrow("4 % fast", 0.0, 0.04),
    narrow("0.3 s and 5 % slow", 0.3, -0.05),
    wide("1.5 s, up to 3 s allowed", 1.5, 0.0),
    wide("-2.2 s and 4 % fast, up to 3 s", -2.2, 0.04),
];

/// Errors of known delays and rates, and the share of the lost C regained.
#[test]
fn delay_and_rate_are_found_and_the_correlation_regained() {
    let scene = WALK.scene();
    println!(
        "\n{:<34}{:>12}{:>12}{:>12}{:>12}{:>11}{:>11}",
        "truth", "|shift| med", "95 %, s", "|rate| med", "95 %", "regained", "10 %"
    );
    let ideal: Vec<f64> = (0..seeds())
        .map(|seed| {
            correlation(&unaligned(
                &record(&scene, seed, |time_s| time_s),
                &scene,
                seed,
            ))
        })
        .collect();
    let found: Vec<Recovered> = TRUTHS
        .iter()
        .map(|truth| recovered(&scene, truth, &ideal))
        .collect();
    closing_note();
    for (truth, found) in TRUTHS.iter().zip(found) {
        found.hold_to(truth);
    }
}

fn unaligned(records: &[Record], claimed: &Scene, seed: u64) -> Comparison {
    compared(records, claimed, with(TimeAlignment::None, 0.5), seed)
}

/// Results for one truth over the seeds.
struct Recovered {
    /// 95 % quantiles of the errors.
    shift_s: f64,
    rate: f64,
    /// 10 % quantile of the share of C regained.
    regained: f64,
}

fn recovered(scene: &Scene, truth: &Truth, ideal: &[f64]) -> Recovered {
    let (mut shifts, mut rates, mut regained) = (vec![], vec![], vec![]);
    let align = with(TimeAlignment::Rate, truth.shift_max_s);
    for (seed, ideal) in (0..).zip(ideal) {
        let warped = record(scene, seed, |time_s| {
            time_s + truth.shift_s + truth.rate * time_s
        });
        let aligned = compared(&warped, scene, align, seed);
        let before = correlation(&unaligned(&warped, scene, seed));
        let time = aligned.alignment.as_ref().unwrap().time.unwrap();
        assert!(time.applied, "{}: {time:?}", truth.name);
        shifts.push((time.shift_s - truth.shift_s).abs());
        rates.push((time.rate - truth.rate).abs());
        regained.push((correlation(&aligned) - before) / (ideal - before));
    }
    let found = Recovered {
        shift_s: quantile(&mut shifts, 0.95),
        rate: quantile(&mut rates, 0.95),
        regained: quantile(&mut regained, 0.1),
    };
    let share = |regained: f64| {
        if truth.shift_s == 0.0 && truth.rate == 0.0 {
            "-".to_owned()
        } else {
            format!("{:.0} %", 100.0 * regained)
        }
    };
    println!(
        "{:<34}{:>12.4}{:>12.4}{:>12.5}{:>12.5}{:>11}{:>11}",
        truth.name,
        quantile(&mut shifts, 0.5),
        found.shift_s,
        quantile(&mut rates, 0.5),
        found.rate,
        share(quantile(&mut regained, 0.5)),
        share(found.regained)
    );
    found
}

impl Recovered {
    /// Half a frame, and the same at the ends of the recording.
    fn hold_to(&self, truth: &Truth) {
        let name = truth.name;
        assert!(self.shift_s < 0.05, "{name}: {} s", self.shift_s);
        assert!(self.rate < 0.01, "{name}: {}", self.rate);
        if truth.shift_s != 0.0 {
            assert!(self.regained > 0.8, "{name}: {}", self.regained);
        }
    }
}
