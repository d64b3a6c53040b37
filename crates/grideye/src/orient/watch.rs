//! What is seen in a sensor's frames, one after the other: an empty view, a hand at the left, none, a hand at the top.

use super::mounting::Side;
use grideye_frame::{COLUMNS, PIXELS, ROWS};
use serde::Serialize;
use std::collections::VecDeque;

/// The temperatures of a frame, °C, pixel 1 first.
pub(super) type Picture = [f64; PIXELS];

/// Frames of an empty view from which the background is taken.
const EMPTY_FRAMES: usize = 20;
/// In an empty view no pixel changes by more than this, K: the noise of a unit at 10 Hz is some tenths, of which 20 frames
/// of 64 pixels show about five times as much.
const STILL_K: f64 = 2.5;
/// A pixel that is so much warmer than the background sees somebody, K: some five times the noise of a unit at 10 Hz, and
/// less than half of what the simulated person of the tests shows. How a hand shows on a real unit was never measured here.
const WARM_K: f64 = 1.25;
/// Frames in a row in which a hand is at one side before that is believed.
const STEADY_FRAMES: usize = 10;
/// Frames in a row without a hand before it is believed to be gone.
const GONE_FRAMES: usize = 5;
/// How far off the middle of the picture a hand has to be, in pixels.
const OFF_THE_MIDDLE: f64 = 1.0;
/// How much further off it has to be along one axis than along the other.
const ONE_AXIS: f64 = 1.5;

/// What is waited for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Step {
    Empty,
    Left,
    Gone,
    Top,
    Done,
}

/// A hand that was seen at a side.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub(super) struct Hand {
    pub(super) side: Side,
    /// Its middle in the sensor's own picture, in pixels from 1 to 8.
    pub(super) column: f64,
    pub(super) row: f64,
    /// How much warmer than the background its warmest pixel was, K.
    pub(super) contrast_k: f64,
    /// Of the frames in which anybody was seen, the share that had the hand at this side.
    pub(super) confidence: f64,
}

/// Somebody in one frame.
struct Seen {
    x: f64,
    y: f64,
    contrast_k: f64,
}

/// What was seen so far.
#[derive(Debug)]
pub(super) struct Watch {
    step: Step,
    empty: VecDeque<Picture>,
    background: Picture,
    /// Frames with somebody since this step began, and those in a row at one side.
    seen: usize,
    at_side: [usize; 4],
    steady: Vec<(Side, f64, f64, f64)>,
    without: usize,
    hands: Vec<Hand>,
}

impl Watch {
    pub(super) fn new() -> Self {
        Self {
            step: Step::Empty,
            empty: VecDeque::new(),
            background: [0.0; PIXELS],
            seen: 0,
            at_side: [0; 4],
            steady: Vec::new(),
            without: 0,
            hands: Vec::new(),
        }
    }

    pub(super) const fn step(&self) -> Step {
        self.step
    }

    /// The hands at the left and at the top, where both were seen.
    pub(super) fn hands(&self) -> Option<(Hand, Hand)> {
        match self.hands.as_slice() {
            [left, top] => Some((*left, *top)),
            _ => None,
        }
    }

    /// Whether somebody is seen, but at no side.
    pub(super) fn is_unclear(&self) -> bool {
        self.seen >= 2 * STEADY_FRAMES && self.steady.is_empty()
    }

    /// Takes a frame; the step that is waited for now.
    pub(super) fn push(&mut self, picture: &Picture) -> Step {
        match self.step {
            Step::Empty => self.learn(picture),
            Step::Left | Step::Top => self.look(picture),
            Step::Gone => self.wait(picture),
            Step::Done => {}
        }
        self.step
    }

    fn learn(&mut self, picture: &Picture) {
        self.empty.push_back(*picture);
        if self.empty.len() < EMPTY_FRAMES {
            return;
        }
        let of_pixel = |index: usize| self.empty.iter().map(move |frame| frame[index]);
        let is_still = (0..PIXELS).all(|index| {
            let most = of_pixel(index).fold(f64::NEG_INFINITY, f64::max);
            let least = of_pixel(index).fold(f64::INFINITY, f64::min);
            most - least <= STILL_K
        });
        if is_still {
            self.background = std::array::from_fn(|index| {
                let mut values: Vec<f64> = of_pixel(index).collect();
                values.sort_by(f64::total_cmp);
                values[EMPTY_FRAMES / 2]
            });
            self.step = Step::Left;
        } else {
            self.empty.pop_front();
        }
    }

    fn look(&mut self, picture: &Picture) {
        let Some(seen) = self.seen_in(picture) else {
            self.steady.clear();
            return;
        };
        self.seen += 1;
        let Some(side) = side_of(&seen) else {
            self.steady.clear();
            return;
        };
        self.at_side[place_of(side)] += 1;
        if self
            .steady
            .last()
            .is_some_and(|(before, ..)| *before != side)
        {
            self.steady.clear();
        }
        self.steady.push((side, seen.x, seen.y, seen.contrast_k));
        if self.steady.len() >= STEADY_FRAMES {
            self.hands.push(self.hand(side));
            self.step = if self.step == Step::Left {
                Step::Gone
            } else {
                Step::Done
            };
            self.without = 0;
        }
    }

    fn hand(&self, side: Side) -> Hand {
        let frames = number(self.steady.len());
        let mean = |of: fn(&(Side, f64, f64, f64)) -> f64| {
            self.steady.iter().map(of).sum::<f64>() / frames
        };
        Hand {
            side,
            column: mean(|seen| seen.1) + middle(COLUMNS) + 1.0,
            row: mean(|seen| seen.2) + middle(ROWS) + 1.0,
            contrast_k: mean(|seen| seen.3),
            confidence: number(self.at_side[place_of(side)]) / number(self.seen),
        }
    }

    fn wait(&mut self, picture: &Picture) {
        if self.seen_in(picture).is_some() {
            self.without = 0;
            return;
        }
        self.without += 1;
        if self.without >= GONE_FRAMES {
            (self.seen, self.at_side) = (0, [0; 4]);
            self.steady.clear();
            self.step = Step::Top;
        }
    }

    /// The middle of what is warmer than the background, weighted by how much.
    fn seen_in(&self, picture: &Picture) -> Option<Seen> {
        let (mut sum, mut x, mut y, mut contrast_k) = (0.0, 0.0, 0.0, 0.0_f64);
        for (index, (now, before)) in picture.iter().zip(&self.background).enumerate() {
            let excess = now - before;
            if excess < WARM_K {
                continue;
            }
            sum += excess;
            x += excess * (number(index % COLUMNS) - middle(COLUMNS));
            y += excess * (number(index / COLUMNS) - middle(ROWS));
            contrast_k = contrast_k.max(excess);
        }
        (sum > 0.0).then(|| Seen {
            x: x / sum,
            y: y / sum,
            contrast_k,
        })
    }
}

fn side_of(seen: &Seen) -> Option<Side> {
    let (across, along) = (seen.x.abs(), seen.y.abs());
    if across >= OFF_THE_MIDDLE && across >= ONE_AXIS * along {
        Some(if seen.x < 0.0 {
            Side::Left
        } else {
            Side::Right
        })
    } else if along >= OFF_THE_MIDDLE && along >= ONE_AXIS * across {
        Some(if seen.y < 0.0 {
            Side::Top
        } else {
            Side::Bottom
        })
    } else {
        None
    }
}

const fn place_of(side: Side) -> usize {
    match side {
        Side::Left => 0,
        Side::Top => 1,
        Side::Right => 2,
        Side::Bottom => 3,
    }
}

/// The middle of so many cells, counted from 0.
fn middle(cells: usize) -> f64 {
    (number(cells) - 1.0) / 2.0
}

/// A count that is far below what a float holds exactly.
fn number(count: usize) -> f64 {
    f64::from(u32::try_from(count).unwrap_or(u32::MAX))
}

#[cfg(test)]
mod tests {
    use super::*;

    const ROOM: Picture = [22.0; PIXELS];

    fn with(column: usize, row: usize) -> Picture {
        let mut picture = ROOM;
        picture[row * COLUMNS + column] = 27.0;
        picture
    }

    fn watched(pictures: impl IntoIterator<Item = Picture>) -> Watch {
        let mut watch = Watch::new();
        for picture in pictures {
            watch.push(&picture);
        }
        watch
    }

    fn times(picture: Picture, count: usize) -> impl Iterator<Item = Picture> {
        std::iter::repeat_n(picture, count)
    }

    #[test]
    fn two_hands_are_seen_one_after_the_other() {
        let frames = times(ROOM, EMPTY_FRAMES)
            .chain(times(with(0, 4), STEADY_FRAMES))
            .chain(times(ROOM, GONE_FRAMES))
            .chain(times(with(3, 7), STEADY_FRAMES));
        let watch = watched(frames);
        assert_eq!(watch.step(), Step::Done);
        let (left, top) = watch.hands().unwrap();
        assert_eq!((left.side, left.column, left.row), (Side::Left, 1.0, 5.0));
        assert_eq!((top.side, top.column, top.row), (Side::Bottom, 4.0, 8.0));
        assert_eq!((left.contrast_k, left.confidence), (5.0, 1.0));
    }

    #[test]
    fn a_view_in_which_something_moves_is_not_taken_for_empty() {
        let moving = (0..40).map(|at| with(at % 8, 3));
        assert_eq!(watched(moving).step(), Step::Empty);
    }

    #[test]
    fn a_hand_in_the_middle_or_in_a_corner_is_at_no_side() {
        for (column, row) in [(3, 4), (0, 0), (7, 6)] {
            let frames = times(ROOM, EMPTY_FRAMES).chain(times(with(column, row), 100));
            let watch = watched(frames);
            assert_eq!(watch.step(), Step::Left, "{column} {row}");
            assert!(watch.is_unclear(), "{column} {row}");
        }
    }

    #[test]
    fn one_frame_less_than_needed_and_a_glitch_are_not_believed() {
        let frames = times(ROOM, EMPTY_FRAMES).chain(times(with(0, 4), STEADY_FRAMES - 1));
        assert_eq!(watched(frames).step(), Step::Left);
        let glitches = (0..100).map(|at| if at % 5 == 0 { with(0, 4) } else { ROOM });
        assert_eq!(
            watched(times(ROOM, EMPTY_FRAMES).chain(glitches)).step(),
            Step::Left
        );
    }

    #[test]
    fn who_passes_another_side_first_costs_confidence() {
        let frames = times(ROOM, EMPTY_FRAMES)
            .chain(times(with(4, 0), 5))
            .chain(times(with(0, 4), STEADY_FRAMES));
        let watch = watched(frames);
        assert_eq!(watch.step(), Step::Gone);
        assert!((watch.hands[0].confidence - 10.0 / 15.0).abs() < 1e-12);
    }
}
