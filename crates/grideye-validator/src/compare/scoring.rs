//! Runs a comparison: scores, floors, ceilings, verdict.

use crate::compare::comparison::{Comparison, EvaluationGraph, FilmFrame, maps, timeline};
use crate::compare::floors::shuffled;
use crate::compare::prepared::{ComparedFrames, Preparation, pairs};
use crate::compare::settings::{FILM_FRAMES_MAX, Settings, check_frames, check_settings};
use crate::compare::sums::{Sums, noise_once};
use crate::error::ValidatorError;
use crate::frames::noise::noise_of;
use crate::frames::{RealFrame, SimulatedFrame};
use crate::metrics::score::{Measure, Score, Scores};
use crate::metrics::thresholds_c;
use crate::numbers::{evenly, extremes, mean_frame, mean_square, median, sum_of};
use crate::verdict::judgment::judge;
use crate::verdict::types::{Evidence, Prior};
use grideye_frame::PIXELS;

/// Compares the frames of a recording with simulated ones.
///
/// # Errors
/// No frames or too many, frames of unequal size or not finite, unequal numbers (dynamic), a setting out of range.
pub fn compare(
    real: &[RealFrame],
    simulated: &[SimulatedFrame],
    settings: &Settings,
) -> Result<Comparison, ValidatorError> {
    compare_with_prior(real, simulated, settings, &Prior::default())
}

pub(crate) fn compare_with_prior(
    real: &[RealFrame],
    simulated: &[SimulatedFrame],
    settings: &Settings,
    prior: &Prior,
) -> Result<Comparison, ValidatorError> {
    check_settings(settings)?;
    check_frames(real, simulated, settings.protocol)?;
    let repeats = real.iter();
    let repeats = repeats.filter_map(|frame| Some((frame.later.as_ref()?, &frame.celsius)));
    let noise_sigma_c = noise_of(repeats);
    let preparation = Preparation {
        warm_above_c: settings.warm_above(noise_sigma_c.unwrap_or(settings.noise_sigma_c)),
    };
    let view = ComparedFrames::new(preparation, real, simulated, settings);
    let pairs = pairs(settings.protocol, real.len(), simulated.len());
    let both = |&(real, put): &(usize, usize)| (&view.real[real], &view.simulated[put]);
    let found = Sums::of(pairs.iter().map(both));
    let blanks = view.real.iter().map(|frame| (frame, &view.blank));
    let blank = Sums::of(blanks);
    let repeat = noise_sigma_c.map(|sigma_c| (repeat(&view, real), sigma_c));
    let timeline = timeline(&view, real);
    let offsets: Vec<f64> = timeline.iter().map(|frame| frame.offset_c).collect();
    let (low_c, high_c) = extremes(&offsets);
    let evidence = Evidence {
        real_frames: real.len(),
        has_repeat: noise_sigma_c.is_some(),
        offset_c: median(&offsets).unwrap_or(0.0),
        prior,
    };
    Ok(Comparison {
        judgment: judge(&evidence, &settings.thresholds),
        decision: prior.decision.clone(),
        pattern_c: mean_square(&pattern_c(settings, prior)).sqrt(),
        pattern_from: prior.pattern.from,
        level_max_c: prior.level_c.unwrap_or(settings.thresholds.offset_max_c),
        evaluation: EvaluationGraph {
            thresholds_c: thresholds_c().to_vec(),
            simulated: found.graph.shares().to_vec(),
            blank: blank.graph.shares().to_vec(),
            repeat: repeat
                .as_ref()
                .map(|(sums, _)| sums.graph.shares().to_vec()),
        },
        film: film(real, simulated),
        real_frames: real.len(),
        simulated_frames: simulated.len(),
        pairs: pairs.len(),
        noise_sigma_c,
        warm_above_c: preparation.warm_above_c,
        offset_c: evidence.offset_c,
        drift_c: (high_c - low_c).max(0.0),
        maps: maps(&timeline),
        timeline,
        settings: *settings,
        background: None,
        warnings: Vec::new(),
        notes: Vec::new(),
        alignment: None,
        scores: scores(&view, &pairs, [&found, &blank], repeat.as_ref(), settings),
    })
}

/// The repeat of each real frame in place of the simulation, where there is one.
fn repeat(view: &ComparedFrames, real: &[RealFrame]) -> Sums {
    let mut sums = Sums::default();
    for (now, frame) in view.real.iter().zip(real) {
        if let Some(later) = &frame.later {
            sums.pair(now, &view.preparation.frame(later, later));
        }
    }
    sums
}

fn scores(
    view: &ComparedFrames,
    pairs: &[(usize, usize)],
    [found, blank]: [&Sums; 2],
    repeat: Option<&(Sums, f64)>,
    settings: &Settings,
) -> Scores {
    let (value, blank) = (found.means(), blank.means());
    let shuffled = shuffled(view, pairs, settings);
    let ceiling = repeat.map(|(sums, sigma_c)| noise_once(sums.means(), *sigma_c));
    Scores(Measure::ALL.map(|measure| {
        let place = measure.place();
        Score {
            measure,
            value: value[place],
            blank: blank[place],
            shuffled: shuffled[place],
            ceiling: ceiling.and_then(|ceiling| ceiling[place]),
        }
    }))
}

/// Of each part of the time the frame that is farthest from the mean over time: where something happens.
fn film(real: &[RealFrame], simulated: &[SimulatedFrame]) -> Vec<FilmFrame> {
    let number = real.len().min(simulated.len());
    let mean_c = mean_frame(real.iter().map(|frame| frame.celsius));
    let apart = |index: &usize| sum_of(&real[*index].celsius, &mean_c, |x, y| (x - y) * (x - y));
    let ends = evenly(number + 1, FILM_FRAMES_MAX + 1);
    let parts = ends.windows(2).map(|ends| ends[0]..ends[1]);
    let shown = parts.filter_map(|part| part.max_by(|a, b| apart(a).total_cmp(&apart(b))));
    let pair = |index: usize| FilmFrame {
        time: real[index].time,
        scene_time: simulated[index].time,
        real: real[index].celsius.to_vec(),
        simulated: simulated[index].celsius.to_vec(),
    };
    shown.map(pair).collect()
}

/// Standard deviation of the unknown part of a unit's pattern, row by row, °C.
pub(crate) fn pattern_c(settings: &Settings, prior: &Prior) -> Vec<f64> {
    let any = || vec![settings.thresholds.background_spread_c; PIXELS];
    prior.pattern.left_c.clone().unwrap_or_else(any)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frames::types::Protocol;
    use std::time::Duration;

    /// Somebody is there for a tenth of a minute, warmest in its middle.
    #[test]
    fn the_film_shows_when_something_happens() {
        let celsius = |index: u32| {
            let warm = if (312..372).contains(&index) {
                4.0
            } else {
                0.0
            };
            let mut celsius = [20.0; PIXELS];
            celsius[9] += warm;
            celsius[10] += if index == 340 { 2.0 } else { 0.0 };
            celsius
        };
        let time = |index: u32| Duration::from_millis(100) * index;
        let real = (0..600).map(|index| RealFrame {
            time: time(index),
            celsius: celsius(index),
            later: None,
        });
        let simulated = (0..600).map(|index| SimulatedFrame {
            time: time(index + 50),
            celsius: celsius(index),
            noise_free: celsius(index),
        });
        let film = film(&real.collect::<Vec<_>>(), &simulated.collect::<Vec<_>>());
        let shown = film.iter().find(|frame| frame.time == time(340)).unwrap();
        assert_eq!((film.len(), shown.scene_time), (6, time(390)));
        assert_eq!(shown.real[9..11], [24.0, 22.0]);
        assert!(film.is_sorted_by_key(|frame| frame.time));
    }

    #[test]
    fn protocols_pair_as_the_paper_says() {
        assert_eq!(pairs(Protocol::Static, 10, 10).len(), 100);
        let all = [(0, 0), (0, 1), (1, 0), (1, 1)];
        assert_eq!(pairs(Protocol::Static, 2, 2), all);
        assert_eq!(pairs(Protocol::Dynamic, 3, 3), [(0, 0), (1, 1), (2, 2)]);
    }
}
