//! Counts the people in front of one sensor, frame by frame.

use crate::background::Background;
use crate::network::{CLASSES, Network, UNITS_PER_DEGREE};
use crate::numbers::{float, single, whole};
use crate::places::Places;
use grideye_frame::{Celsius, PIXELS, RecordedFrame, word};

/// How often a number of people changes, per second: who crosses the view is in it for two seconds.
const CHANGES_PER_S: f32 = 0.5;
/// What a frame says that one just before it did not: they share the background's errors and the posture. After a second
/// all of it is new.
const NEWS: f32 = 0.5;
/// Nobody is told only if that is so many times as likely as another count: a person who is overlooked is worse than one
/// who is not there.
const NOBODY_SURE: f32 = 10.0;
/// The longest time between frames that what was known before survives.
const GAP_S: f64 = 5.0;
/// Before the first frame: rooms are empty most of the time.
const FIRST: [f32; CLASSES] = [0.85, 0.05, 0.05, 0.05];
/// An input's highest value.
const INPUT_MAX: f32 = 32_767.0;

/// The people in front of one sensor. A frame takes 64 temperatures and a time; memory does not grow.
#[derive(Debug, Clone)]
pub struct Counter {
    background: Background,
    /// The chance of each count so far.
    chances: [f32; CLASSES],
    last_s: Option<f64>,
    /// The time of frames so far, which never goes back.
    seen_s: f64,
}

/// The count of one frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Count {
    /// People in view: 0, 1, 2, or 3 for three and more.
    pub people: u8,
    /// The chance of each count, from this frame and those before it.
    pub chances: [f32; CLASSES],
    /// What this frame alone says.
    pub alone: [f32; CLASSES],
    /// Where they are: as many places as people, more from three on.
    pub places: Places,
    /// Their pixels, pixel 1 as the lowest bit.
    pub pixels: u64,
    /// The frame less the empty room, °C.
    pub excess: [f32; PIXELS],
}

impl Default for Counter {
    fn default() -> Self {
        Self::new()
    }
}

impl Counter {
    /// A counter that learns the empty room from the first half minute of frames.
    #[must_use]
    pub const fn new() -> Self {
        Self::from(Background::starting())
    }

    /// A counter that knows the empty room, in °C: of a profile's `[background]`, or of a
    /// [`Room`](crate::Room).
    #[must_use]
    pub const fn with_background(celsius: [f32; PIXELS]) -> Self {
        Self::from(Background::known(celsius))
    }

    const fn from(background: Background) -> Self {
        Self {
            background,
            chances: FIRST,
            last_s: None,
            seen_s: 0.0,
        }
    }

    /// Takes the next frame, measured at `at_s` seconds of the device's clock, which a restart may set back.
    ///
    /// `None` while the empty room is not known yet.
    pub fn see(
        &mut self,
        network: &Network<'_>,
        at_s: f64,
        celsius: &[f32; PIXELS],
    ) -> Option<Count> {
        let passed_s = self.last_s.map_or(0.0, |last_s| (at_s - last_s).max(0.0));
        self.last_s = Some(at_s);
        self.seen_s += passed_s;
        let excess = self.background.excess(self.seen_s, celsius)?;
        let alone = chances(&network.scores(&excess.map(input)));
        if passed_s > GAP_S {
            self.chances = FIRST;
        }
        self.chances = updated(&self.chances, &alone, single(passed_s.min(GAP_S)));
        let people = told(&self.chances);
        let most = if usize::from(people) + 1 == CLASSES {
            usize::MAX
        } else {
            people.into()
        };
        let places = Places::of(&excess, most);
        let pixels = places.pixels(&excess);
        self.background.follow(single(passed_s), &excess, pixels);
        Some(Count {
            people,
            chances: self.chances,
            alone,
            places,
            pixels,
            excess,
        })
    }
}

impl Count {
    /// What this frame alone says.
    #[must_use]
    pub fn people_alone(&self) -> u8 {
        most_likely(&self.alone)
    }
}

/// A record's temperatures, °C.
#[must_use]
pub fn celsius(frame: &RecordedFrame) -> [f32; PIXELS] {
    word::pixels(&frame.pixels).map(Celsius::get)
}

fn input(excess_c: f32) -> i32 {
    whole((excess_c * UNITS_PER_DEGREE).clamp(-INPUT_MAX, INPUT_MAX))
}

/// Softmax.
fn chances(scores: &[i32; CLASSES]) -> [f32; CLASSES] {
    let most = scores.iter().copied().max().unwrap_or(0);
    normalized(scores.map(|score| libm::expf(float(score.saturating_sub(most)) / UNITS_PER_DEGREE)))
}

fn normalized(values: [f32; CLASSES]) -> [f32; CLASSES] {
    let sum: f32 = values.iter().sum();
    values.map(|value| value / sum)
}

/// The forward step of a hidden Markov chain whose counts change by one.
fn updated(before: &[f32; CLASSES], alone: &[f32; CLASSES], passed_s: f32) -> [f32; CLASSES] {
    let changed = 1.0 - libm::expf(-CHANGES_PER_S * passed_s);
    let moved: [f32; CLASSES] = core::array::from_fn(|count| {
        let neighbors = [count.checked_sub(1), Some(count + 1)];
        let gained = neighbors.into_iter().flatten().filter_map(|from| {
            let ways = if from == 0 || from + 1 == CLASSES {
                1.0
            } else {
                2.0
            };
            before.get(from).map(|chance| chance / ways)
        });
        (1.0 - changed) * before[count] + changed * gained.sum::<f32>()
    });
    let news = NEWS + (1.0 - NEWS) * passed_s.min(1.0);
    // So unlikely that others are nearly sure, yet never impossible.
    normalized(core::array::from_fn(|count| {
        moved[count] * libm::powf(alone[count].max(1e-4), news)
    }))
}

/// The number of people that is told.
fn told(chances: &[f32; CLASSES]) -> u8 {
    let [nobody, some @ ..] = *chances;
    let [one, two, more] = some;
    most_likely(&[nobody / NOBODY_SURE, one, two, more])
}

fn most_likely(chances: &[f32; CLASSES]) -> u8 {
    let counts = (0_u8..).zip(chances);
    let most =
        counts.max_by(|(one, first), (other, second)| first.total_cmp(second).then(other.cmp(one)));
    most.map_or(0, |(count, _)| count)
}
