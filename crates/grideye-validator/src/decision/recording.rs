//! The pictures that a scene is judged by: all frames of a recording, the means of neighbors if there are many.

use crate::align::Orientation;
use crate::decision::unit::Unit;
use crate::decision::view::{self, Image, PIXEL_COUNT, add, less};
use crate::numbers::{count, index, median, single, whole};
use grideye_frame::PIXELS;

/// Frames of a recording as they are judged.
#[derive(Clone)]
pub(crate) struct Recording {
    /// In scene time, the middle of each picture.
    pub(crate) times_s: Vec<f64>,
    pub(crate) pictures: Vec<Image>,
    /// The time that each picture is the mean of; 0 for single frames.
    pub(crate) within_s: f64,
    pub(crate) unit: Unit,
    /// How many frames resemble neither the frame before nor the one after, which resemble each other: left out.
    pub(crate) strays: usize,
    /// Pictures that have no frames: those are strays, or were not read.
    pub(crate) missing: Vec<usize>,
    pub(crate) frames: usize,
}

/// Shortest time between pictures of a recording that has many, seconds: a walking person moves half a pixel.
const PICTURE_S: f64 = 0.2;
/// Longest: longer pictures would show a walk as a smear, and nothing of its delay.
const PICTURE_MOST_S: f64 = 1.0;
/// More frames than this are averaged.
const FEW: usize = 150;
const PICTURES_MOST: usize = 2_000;
/// Of a recording with more pictures, runs of this many are judged.
const RUN: usize = 100;
/// No picture is of frames that are this many periods apart or more.
const GAP: f64 = 3.5;

impl Recording {
    /// `frames` less what is known of unit and room; `pattern_c` is the standard deviation of what is not.
    pub(crate) fn new(times_s: &[f64], frames: &[Image], pattern_c: Image, step_c: f64) -> Self {
        let strays = strays(times_s, frames, &Unit::of(frames, pattern_c, step_c));
        let kept: Vec<Image> = (0..frames.len())
            .filter(|index| !strays.contains(index))
            .map(|index| frames[index])
            .collect();
        let unit = Unit::of(&kept, pattern_c, step_c);
        let steps: Vec<f64> = times_s.windows(2).map(|pair| pair[1] - pair[0]).collect();
        let period_s = median(&steps).unwrap_or(0.0);
        let mut each = 1;
        if frames.len() > FEW && period_s > 0.0 {
            each = index((PICTURE_S / period_s).round())
                .max(frames.len().div_ceil(PICTURES_MOST))
                .min(index(PICTURE_MOST_S / period_s))
                .max(1);
        }
        let mut recording = Self {
            times_s: Vec::new(),
            pictures: Vec::new(),
            within_s: if each > 1 {
                count(each) * period_s
            } else {
                0.0
            },
            unit: unit.averaged(each),
            strays: strays.len(),
            missing: Vec::new(),
            frames: frames.len(),
        };
        let moments = moments(times_s, period_s, &strays);
        let groups: Vec<&[Moment]> = moments
            .chunk_by(|now, then| then.time_s - now.time_s < GAP * period_s)
            .flat_map(|run| run.chunks(each))
            .collect();
        for group in in_runs(&groups) {
            let kept: Vec<Moment> = group
                .iter()
                .copied()
                .filter(|moment| moment.frame.is_some())
                .collect();
            let timed = if kept.is_empty() {
                recording.missing.push(recording.pictures.len());
                group
            } else {
                &kept
            };
            let share = 1.0 / count(timed.len());
            let mut mean = [0.0; PIXELS];
            kept.iter()
                .filter_map(|moment| moment.frame)
                .for_each(|frame| add(&mut mean, &frames[frame], single(share)));
            recording.pictures.push(mean);
            let sum_s: f64 = timed.iter().map(|moment| moment.time_s).sum();
            recording.times_s.push(sum_s * share);
        }
        fill(&mut recording.pictures, &recording.missing);
        recording
    }
}

/// When a unit made a frame, and which it is if it is kept.
#[derive(Clone, Copy)]
struct Moment {
    time_s: f64,
    frame: Option<usize>,
}

/// Those of the frames, and of frames that were not read between them.
fn moments(times_s: &[f64], period_s: f64, strays: &[usize]) -> Vec<Moment> {
    /// Periods by which a frame may be late.
    const LATE: f64 = 0.25;
    let mut all: Vec<Moment> = Vec::with_capacity(times_s.len());
    for (index, &time_s) in times_s.iter().enumerate() {
        if let Some(&Moment { time_s: last_s, .. }) = all.last() {
            let gap_s = time_s - last_s;
            let periods = whole((gap_s / period_s.max(1e-9) - LATE).round());
            if gap_s < GAP * period_s {
                all.extend((1..periods).map(|period| Moment {
                    time_s: last_s + gap_s * f64::from(period) / f64::from(periods),
                    frame: None,
                }));
            }
        }
        all.push(Moment {
            time_s,
            frame: (!strays.contains(&index)).then_some(index),
        });
    }
    all
}

/// Fills missing pictures with the mean of their neighbors. Worlds are filled alike: with a picture fewer each would be
/// another world, and a recording near a limit would get another verdict.
pub(crate) fn fill(pictures: &mut [Image], missing: &[usize]) {
    let is_there = |index: &usize| !missing.contains(index);
    for &index in missing {
        let before = (0..index).rev().find(is_there);
        let after = (index + 1..pictures.len()).find(is_there);
        let neighbors = [before.or(after), after.or(before)];
        let mut mean = [0.0; PIXELS];
        for neighbor in neighbors.into_iter().flatten() {
            add(&mut mean, &pictures[neighbor], 0.5);
        }
        pictures[index] = mean;
    }
}

impl Recording {
    /// The same with all images turned.
    pub(crate) fn turned(&self, orientation: Orientation) -> Self {
        let mut all = self.clone();
        all.pictures = view::turned(&all.pictures, orientation);
        all.unit.noise_c = orientation.apply(&all.unit.noise_c);
        all.unit.pattern_c = orientation.apply(&all.unit.pattern_c);
        for (_, shows) in &mut all.unit.open {
            *shows = orientation.apply(shows);
        }
        all
    }

    /// Frames in a second.
    pub(crate) fn hz(&self) -> f64 {
        let [Some(first), Some(last)] = [self.times_s.first(), self.times_s.last()] else {
            return 0.0;
        };
        count(self.frames.saturating_sub(1)) / (last - first + self.within_s).max(1e-9)
    }

    /// The same with values that were read in another unit.
    pub(crate) fn converted(&self, (times, more_c): (f32, f32)) -> Self {
        let mut all = self.clone();
        for image in &mut all.pictures {
            *image = image.map(|value| times * value + more_c);
        }
        all.unit.noise_c = all.unit.noise_c.map(|noise| times * noise);
        all
    }
}

/// All of them, or evenly spread runs of neighbors.
fn in_runs<'a, 'f>(groups: &'a [&'f [Moment]]) -> impl Iterator<Item = &'f [Moment]> + use<'a, 'f> {
    let runs = PICTURES_MOST / RUN;
    let apart = match groups.len() > PICTURES_MOST {
        true => groups.len() / runs,
        false => RUN,
    };
    let runs = groups.chunks(apart);
    runs.flat_map(|run| run.iter().copied().take(RUN))
}

/// Frames that a transfer tore or swapped: far from both neighbors, which are near each other.
fn strays(times_s: &[f64], frames: &[Image], unit: &Unit) -> Vec<usize> {
    const FAR: f64 = 3.0;
    const NEAR: f64 = 0.5;
    let apart = |one: usize, other: usize| -> f64 {
        let difference = less(&frames[one], &frames[other]);
        let mean = difference.iter().sum::<f32>() / PIXEL_COUNT;
        let pixels = difference.iter().zip(&unit.noise_c);
        let squares =
            pixels.map(|(difference, noise_c)| f64::from((difference - mean) / noise_c).powi(2));
        squares.sum::<f64>() / count(2 * PIXELS)
    };
    let is_stray = |&index: &usize| {
        let [before, after] = match index {
            0 => [1, 2],
            index if index + 1 == frames.len() => [index.saturating_sub(2), index - 1],
            _ => [index - 1, index + 1],
        };
        let own = apart(index, before).min(apart(index, after));
        // Before or after a gap, who walks is farther from the nearer of two than these are from each other.
        let gap_s = |one: usize, other: usize| (times_s[one] - times_s[other]).abs();
        if gap_s(index, before).min(gap_s(index, after)) > 1.5 * gap_s(before, after) {
            return false;
        }
        own > FAR && apart(before, after) < 1.0 + NEAR * (own - 1.0)
    };
    if frames.len() < 3 {
        return Vec::new();
    }
    (0..frames.len()).filter(is_stray).collect()
}
