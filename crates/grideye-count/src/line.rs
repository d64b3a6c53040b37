//! Who goes over a line across the image.

use crate::numbers::single;
use crate::places::{PLACES_MAX, Place, Places};
use core::fmt;
use core::str::FromStr;
use grideye_frame::PIXELS;

/// A track is someone after so many frames.
const FRAMES_MIN: u8 = 3;
/// A place belongs to a track that is at most so many pixels away, and so many more for each second since.
const NEAR: f32 = 1.5;
const PIXELS_PER_S: f32 = 5.0;
/// A track that was not seen for so long has ended.
const ENDED_S: f32 = 1.0;
/// A place that is so warm is someone.
const SOMEONE_C: f32 = 1.0;
/// Someone is on a side of the line from this distance on, in pixels.
const BESIDE: f32 = 0.5;

/// A line across the image, in pixels: (0, 0) is the middle of pixel 1, x grows along a row.
///
/// Who crosses it from its left to its right, seen from its first point towards its second, has entered.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Line {
    /// Its first point, x and y.
    pub from: (f32, f32),
    /// Its second point.
    pub to: (f32, f32),
}

/// A text is no line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct NoLine;

impl fmt::Display for NoLine {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(
            "a line has two different points, X1,Y1,X2,Y2 in pixels: -0.5,3.5,7.5,3.5 is across the middle, from left to right",
        )
    }
}

impl core::error::Error for NoLine {}

impl FromStr for Line {
    type Err = NoLine;

    /// From `X1,Y1,X2,Y2`.
    fn from_str(text: &str) -> Result<Self, NoLine> {
        let mut numbers = text.split(',').map(|number| number.trim().parse::<f32>());
        let mut next = || numbers.next()?.ok().filter(|number| number.abs() <= 100.0);
        let mut point = || Some((next()?, next()?));
        let ends = point().zip(point());
        let (from, to) = ends.filter(|(from, to)| from != to).ok_or(NoLine)?;
        numbers
            .next()
            .is_none()
            .then_some(Self { from, to })
            .ok_or(NoLine)
    }
}

impl Line {
    /// How far to its right a point is, and where along it: 0 at its first point, 1 at its second.
    fn of(&self, x: f32, y: f32) -> (f32, f32) {
        let (along_x, along_y) = (self.to.0 - self.from.0, self.to.1 - self.from.1);
        let (off_x, off_y) = (x - self.from.0, y - self.from.1);
        let length = libm::hypotf(along_x, along_y);
        // Rows grow downwards, so what turns right on the image is positive.
        let right = (along_x * off_y - along_y * off_x) / length;
        (
            right,
            (along_x * off_x + along_y * off_y) / (length * length),
        )
    }
}

/// Counts who crosses a line.
#[derive(Debug, Clone)]
pub struct Gate {
    line: Line,
    tracks: [Option<Track>; PLACES_MAX],
    last_s: f64,
    /// How many entered so far.
    pub entered: u64,
    /// How many left so far.
    pub left: u64,
}

#[derive(Debug, Clone, Copy)]
struct Track {
    place: Place,
    unseen_s: f32,
    frames: u8,
    /// The side it was on: to the right of the line, or to its left.
    was_right: Option<bool>,
}

impl Gate {
    /// Nobody has crossed `line` yet.
    #[must_use]
    pub const fn new(line: Line) -> Self {
        Self {
            line,
            tracks: [None; PLACES_MAX],
            last_s: f64::NEG_INFINITY,
            entered: 0,
            left: 0,
        }
    }

    /// Takes the excess of the next frame ([`crate::Count::excess`]); returns how many entered and left with it.
    pub fn see(&mut self, at_s: f64, excess: &[f32; PIXELS]) -> [u64; 2] {
        let passed_s = single((at_s - self.last_s).clamp(0.0, 60.0));
        self.last_s = at_s;
        for slot in &mut self.tracks {
            let ended = |track: &Track| track.unseen_s > ENDED_S.max(1.5 * passed_s);
            if let Some(track) = slot {
                track.unseen_s += passed_s;
            }
            if slot.as_ref().is_some_and(ended) {
                *slot = None;
            }
        }
        let before = (self.entered, self.left);
        let places = Places::of(excess, usize::MAX);
        let mut free = [true; PLACES_MAX];
        for place in places
            .as_slice()
            .iter()
            .filter(|place| place.excess_c >= SOMEONE_C)
        {
            self.follow(*place, &mut free);
        }
        [self.entered - before.0, self.left - before.1]
    }

    fn follow(&mut self, place: Place, free: &mut [bool; PLACES_MAX]) {
        let distance = |slot: usize| {
            let track = self.tracks[slot].filter(|_| free[slot])?;
            let far = place.distance(track.place.x, track.place.y);
            (far <= NEAR + PIXELS_PER_S * track.unseen_s).then_some(far)
        };
        let known = (0..PLACES_MAX).filter_map(|slot| Some((slot, distance(slot)?)));
        let nearest = known.min_by(|(_, one), (_, other)| one.total_cmp(other));
        let empty = || self.tracks.iter().position(Option::is_none);
        let Some(slot) = nearest.map(|(slot, _)| slot).or_else(empty) else {
            return;
        };
        free[slot] = false;
        let before = self.tracks[slot];
        let (right, along) = self.line.of(place.x, place.y);
        let was_right = before.and_then(|track| track.was_right);
        let is_right = if right.abs() >= BESIDE {
            Some(right > 0.0)
        } else {
            was_right
        };
        let frames = before.map_or(1, |track| track.frames.saturating_add(1));
        self.tracks[slot] = Some(Track {
            place,
            unseen_s: 0.0,
            frames,
            was_right: is_right,
        });
        let is_on = (0.0..=1.0).contains(&along) && frames >= FRAMES_MIN;
        match (was_right, is_right) {
            (Some(false), Some(true)) if is_on => self.entered += 1,
            (Some(true), Some(false)) if is_on => self.left += 1,
            _ => {}
        }
    }
}
