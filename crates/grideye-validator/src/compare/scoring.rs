//! Runs a comparison: scores, floors, ceilings, verdict.

use crate::compare::comparison::{
    Comparison, EvaluationGraph, FilmFrame, drift_c_per_min, maps, noise_fit, timeline,
};
use crate::compare::floors::{blank, noise, shuffled};
use crate::compare::prepared::{ComparedFrames, FrameSet, Preparation, pairs, thinned};
use crate::compare::settings::{
    FILM_FRAMES_MAX, PLACED_PAIRS_MAX, Settings, check_frames, check_settings,
};
use crate::compare::sums::{Sums, sums};
use crate::error::ValidatorError;
use crate::frames::{RealFrame, Shape, SimulatedFrame};
use crate::metrics;
use crate::metrics::foreground::foreground_correlation;
use crate::metrics::gain::GainSums;
use crate::metrics::score::{Measure, Score, Scores};
use crate::numbers::{count, evenly, extremes, mean_square, median};
use crate::verdict::judgment::judge;
use crate::verdict::types::{Evidence, Prior};
use crate::verdict::{Nobody, WarmPixels};

/// Compares the frames of a recording with simulated ones.
///
/// # Errors
/// No frames or too many, frames of unequal size or not finite, unequal numbers (dynamic), a setting out of range.
pub fn compare(
    shape: Shape,
    real: &[RealFrame],
    simulated: &[SimulatedFrame],
    settings: &Settings,
) -> Result<Comparison, ValidatorError> {
    compare_with_prior(shape, real, simulated, settings, &Prior::default())
}

pub(crate) fn compare_with_prior(
    shape: Shape,
    real: &[RealFrame],
    simulated: &[SimulatedFrame],
    settings: &Settings,
    prior: &Prior,
) -> Result<Comparison, ValidatorError> {
    check_settings(settings)?;
    check_frames(shape, real, simulated, settings.protocol)?;
    let noise_sigma_c = noise_sigma(real);
    let sigma_c = noise_sigma_c.unwrap_or(settings.noise_sigma_c);
    let warm_above_c = settings.warm_above(sigma_c);
    let preparation = Preparation {
        shape,
        binning: settings.binning,
        warm_above_c,
    };
    let view = ComparedFrames::new(preparation, real, simulated, settings, sigma_c);
    let pairs = pairs(settings.protocol, real.len(), simulated.len());
    let repeat = noise_sigma_c.map(|sigma_c| Sums::of_repeat(&view, real, sigma_c));
    let threads = settings.threads;
    let found = sums(&view, &pairs, &view.simulated, (PLACED_PAIRS_MAX, threads));
    let blank = blank(&view, &pairs);
    let scores = scores(&view, &pairs, [&found, &blank], repeat.as_ref(), settings);
    let foreground = || foreground_correlation(real, simulated, &prior.nobody, &prior.room);
    let (low_c, high_c) = extremes(&found.offsets);
    let timeline = timeline(&view, real);
    let evidence = Evidence {
        real_frames: real.len(),
        has_repeat: noise_sigma_c.is_some(),
        offset_c: median(&found.offsets).unwrap_or(0.0),
        prior,
    };
    Ok(Comparison {
        judgment: judge(&evidence, &settings.thresholds),
        decision: prior.decision.clone(),
        nobody: nobody(&view, &pairs, simulated, prior),
        above_room: prior.has_people.then(foreground),
        pattern_c: mean_square(&pattern_c(settings, prior, view.pixels())).sqrt(),
        pattern_from: prior.pattern.from,
        level_max_c: prior.level_c.unwrap_or(settings.thresholds.offset_max_c),
        evaluation: EvaluationGraph {
            thresholds_c: metrics::thresholds_c().to_vec(),
            simulated: found.graph.shares().to_vec(),
            blank: blank.graph.shares().to_vec(),
            repeat: repeat.map(|repeat| repeat.graph.shares().to_vec()),
        },
        film: film(real, simulated),
        shape,
        real_frames: real.len(),
        simulated_frames: simulated.len(),
        pairs: found.pairs,
        noise_sigma_c,
        warm_above_c,
        union_above_c: view.warmth.real_above_c,
        offset_c: evidence.offset_c,
        drift_c: (high_c - low_c).max(0.0),
        drift_c_per_min: drift_c_per_min(&timeline),
        noise_fit: noise_fit(&view),
        maps: maps(&timeline),
        timeline,
        warm: warm_pixels(&view, &found.gain),
        settings: *settings,
        background: None,
        warnings: Vec::new(),
        notes: Vec::new(),
        alignment: None,
        scores,
    })
}

/// The sensor's temporal noise: RMS of frame less repeat over √2, median over the pixels.
fn noise_sigma(real: &[RealFrame]) -> Option<f64> {
    let repeats: Vec<(&[f64], &[f64])> = real
        .iter()
        .filter_map(|frame| Some((frame.celsius.as_slice(), frame.later.as_deref()?)))
        .collect();
    let pixels = repeats.first()?.0.len();
    let sigma = |pixel: usize| {
        let squares: f64 = repeats
            .iter()
            .map(|(now, later)| (later[pixel] - now[pixel]).powi(2))
            .sum();
        (squares / count(repeats.len()) / 2.0).sqrt()
    };
    let sigmas: Vec<f64> = (0..pixels).map(sigma).collect();
    median(&sigmas)
}

fn warm_pixels(view: &ComparedFrames, gain: &GainSums) -> WarmPixels {
    let frames = view.real.iter().map(|frame| frame.celsius.as_slice());
    let claims = view.simulated.frames.iter();
    let claims = claims.map(|frame| frame.steady.as_slice());
    let above_c = view.preparation.warm_above_c;
    WarmPixels {
        real: warm_of_themselves(frames, above_c),
        claimed: warm_of_themselves(claims, above_c),
        overlap: (gain.pixels > 0).then(|| count(gain.both) / count(gain.pixels)),
    }
}

/// Mean number of warm pixels per frame, against the frame's own median: whether a recording is empty must not depend
/// on the scene's claim.
fn warm_of_themselves<'a>(
    frames: impl ExactSizeIterator<Item = &'a [f64]>,
    warm_above_c: f64,
) -> f64 {
    let number = count(frames.len());
    let warm = |frame: &[f64]| {
        let background = median(frame).unwrap_or(0.0);
        frame
            .iter()
            .filter(|&&value| value - background > warm_above_c)
            .count()
    };
    count(frames.map(warm).sum()) / number
}

/// Scores of the scene without its people, under the noise of the simulated frames.
fn nobody(
    view: &ComparedFrames,
    pairs: &[(usize, usize)],
    simulated: &[SimulatedFrame],
    prior: &Prior,
) -> Option<Nobody> {
    if prior.nobody.len() != simulated.len() {
        return None;
    }
    let frame = |(simulated, nobody): (&SimulatedFrame, &Vec<f64>)| {
        let noisy = simulated.under_noise(nobody);
        view.preparation.simulated(&noisy, nobody, None)
    };
    let side = FrameSet::new(simulated.iter().zip(&prior.nobody).map(frame).collect());
    let thinned = thinned(pairs, PLACED_PAIRS_MAX);
    let sums = sums(view, &thinned, &side, (1, 1));
    Some(Nobody {
        correlation: sums.means.get(Measure::Correlation),
        gain: sums.means.get(Measure::Gain),
        has_people: prior.has_people,
    })
}

fn scores(
    view: &ComparedFrames,
    pairs: &[(usize, usize)],
    [found, blank]: [&Sums; 2],
    repeat: Option<&Sums>,
    settings: &Settings,
) -> Scores {
    let shuffled = shuffled(view, pairs, settings);
    let noise = noise(view, settings.seed);
    let score = |&measure: &Measure| Score {
        measure,
        value: found.means.get(measure),
        blank: blank.means.get(measure),
        shuffled: shuffled
            .iter()
            .find(|(of, _)| *of == measure)
            .map(|&(_, shuffled)| shuffled),
        noise: noise.means.get(measure),
        ceiling: repeat.and_then(|repeat| repeat.means.get(measure)),
    };
    Scores::new(Measure::ALL.iter().map(score).collect())
}

fn film(real: &[RealFrame], simulated: &[SimulatedFrame]) -> Vec<FilmFrame> {
    let pair = |index: usize| FilmFrame {
        time: real[index].time,
        real: real[index].celsius.clone(),
        simulated: simulated[index].celsius.clone(),
    };
    evenly(real.len().min(simulated.len()), FILM_FRAMES_MAX)
        .into_iter()
        .map(pair)
        .collect()
}

/// Standard deviation of the unknown part of a unit's pattern, row by row, °C.
pub(crate) fn pattern_c(settings: &Settings, prior: &Prior, pixels: usize) -> Vec<f64> {
    let any = || vec![settings.thresholds.background_spread_c; pixels];
    prior.pattern.left_c.clone().unwrap_or_else(any)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frames::types::Protocol;
    use std::time::Duration;

    #[test]
    fn protocols_pair_as_the_paper_says() {
        assert_eq!(pairs(Protocol::Static, 10, 10).len(), 100);
        let all = [(0, 0), (0, 1), (1, 0), (1, 1)];
        assert_eq!(pairs(Protocol::Static, 2, 2), all);
        assert_eq!(pairs(Protocol::Dynamic, 3, 3), [(0, 0), (1, 1), (2, 2)]);
    }

    #[test]
    fn noise_is_measured_on_the_repeat() {
        let frame = |now: f64, later: f64| RealFrame {
            time: Duration::ZERO,
            celsius: vec![now; 3],
            later: Some(vec![later; 3]),
        };
        let sigma = noise_sigma(&[frame(20.0, 20.5), frame(20.0, 19.5)]).unwrap();
        assert!((sigma - 0.5 / 2.0_f64.sqrt()).abs() < 1e-12);
        let mut alone = frame(20.0, 0.0);
        alone.later = None;
        assert_eq!(noise_sigma(&[alone]), None);
    }
}
