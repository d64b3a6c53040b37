//! How a sensor is mounted, from a hand at the left and one at the top that its frames show one after the other.

use crate::numbers::count;
use grideye_frame::{COLUMNS, PIXELS, ROWS};
use serde::{Serialize, Serializer};
use serde_json::{Value, json};
use std::collections::VecDeque;
use std::fmt;

/// The temperatures of a frame, °C, pixel 1 first.
pub type Picture = [f64; PIXELS];

/// Frames of an empty view from which the background is taken.
const EMPTY_FRAMES: usize = 20;
/// In an empty view no pixel changes by more, K: 20 frames of 64 pixels show five times the noise of a unit.
const STILL_K: f64 = 2.5;
/// A pixel so much warmer than the background sees somebody, K: five times the noise; never measured with a real hand.
const WARM_K: f64 = 1.25;
/// Frames in a row in which a hand is at one side before that is believed.
const STEADY_FRAMES: usize = 10;
/// Frames in a row without a hand before it is believed to be gone.
const GONE_FRAMES: usize = 5;
/// How far off the middle of the picture a hand has to be, in pixels.
const OFF_THE_MIDDLE: f64 = 1.0;
/// How much further off it has to be along one axis than along the other.
const ONE_AXIS: f64 = 1.5;
/// A hand that was at other sides in half of the frames tells nothing.
const CONFIDENCE_MIN: f64 = 0.5;
/// What makes a hand clear.
const CLEARER: &str =
    "\nhint: nearer to the edge of the view, in the middle of that side, for two seconds";

/// A side of the sensor's own picture, pixel 1 at the top left: quarters clockwise from the left.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Side(usize);

impl fmt::Display for Side {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(["left", "top", "right", "bottom"][self.0])
    }
}

impl Serialize for Side {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

/// What brings the sensor's picture upright: the mirror first, then the turn, as the page does it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
struct Mounting {
    /// Quarters clockwise, 0 to 3.
    quarters: usize,
    mirrored: bool,
}

impl Mounting {
    /// The one that takes these two to the left and to the top; none, where they lie on one line.
    const fn from_seen(left: Side, top: Side) -> Option<Self> {
        let (quarters, mirrored) = match (top.0 + 4 - left.0) % 4 {
            1 => (4 - left.0, false),
            3 => (left.0 + 2, true),
            _ => return None,
        };
        let quarters = quarters % 4;
        Some(Self { quarters, mirrored })
    }

    /// `roll_deg` of the scene file, clockwise as seen from behind the sensor; none of a mirror image.
    fn roll_deg(self) -> Option<usize> {
        // What leans to the right sees the world lean to the left, and is brought upright by the same turn.
        (!self.mirrored).then_some(self.quarters * 90)
    }

    /// The keys that bring the page's picture upright.
    fn keys(self) -> String {
        let mirror = if self.mirrored { "m" } else { "" };
        format!("{mirror}{}", "t".repeat(self.quarters))
    }

    /// In words, after "the sensor is mounted".
    fn words(self) -> &'static str {
        match self.roll_deg() {
            Some(0) => "upright",
            Some(180) => "upside down",
            Some(90) => "turned a quarter clockwise, as seen from behind it",
            Some(_) => "turned a quarter counter-clockwise, as seen from behind it",
            None => "so that left and right are exchanged",
        }
    }
}

/// What is waited for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Step {
    /// An empty view.
    Empty,
    /// A hand at the left.
    Left,
    /// An empty view again.
    Gone,
    /// A hand at the top.
    Top,
    /// Nothing more.
    Done,
}

/// A hand that was seen at a side.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
struct Hand {
    side: Side,
    /// Its middle in the sensor's own picture, in pixels from 1 to 8.
    column: f64,
    row: f64,
    /// How much warmer than the background its warmest pixel was, K.
    contrast_k: f64,
    /// Of the frames in which anybody was seen, the share that had the hand at this side.
    confidence: f64,
}

/// Both hands, and what they tell.
#[derive(Debug)]
pub struct Found {
    mounting: Mounting,
    left: Hand,
    top: Hand,
}

/// What was seen so far.
#[derive(Debug)]
pub struct Watch {
    step: Step,
    empty: VecDeque<Picture>,
    background: Picture,
    /// Frames with somebody since this step began.
    seen: usize,
    at_side: [usize; 4],
    /// At one side, frames in a row: column and row off the middle, contrast.
    steady: Vec<(Side, [f64; 3])>,
    without: usize,
    hands: Vec<Hand>,
}

impl Default for Watch {
    fn default() -> Self {
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
}

impl Watch {
    /// What is waited for now.
    #[must_use]
    pub const fn step(&self) -> Step {
        self.step
    }

    /// Whether somebody is seen, but at no side.
    #[must_use]
    pub fn is_unclear(&self) -> bool {
        self.seen >= 2 * STEADY_FRAMES && self.steady.is_empty()
    }

    /// Takes a frame.
    pub fn push(&mut self, picture: &Picture) {
        match self.step {
            Step::Empty => self.learn(picture),
            Step::Left | Step::Top => self.look(picture),
            Step::Gone => self.wait(picture),
            Step::Done => {}
        }
    }

    /// What both hands tell.
    ///
    /// # Errors
    /// Why they tell nothing, with a hint.
    pub fn found(&self) -> Result<Found, String> {
        let unclear = if self.is_unclear() { CLEARER } else { "" };
        let [left, top] = self.hands[..] else {
            return Err(match self.step {
                Step::Empty => "the view was never still for two seconds\nhint: begin with nobody in it".to_owned(),
                Step::Left => format!("no hand was seen at one side for a second{unclear}"),
                Step::Gone => "the first hand never left the view\nhint: take it out of the view before you show it at the top".to_owned(),
                Step::Top | Step::Done => format!("no second hand was seen at one side for a second{unclear}"),
            });
        };
        let mounting = Mounting::from_seen(left.side, top.side).ok_or_else(|| {
            format!(
                "the hand at the left was seen at the {}, the one at the top at the {}: that is one line\nhint: once more, the second a quarter clockwise of the first",
                left.side, top.side
            )
        })?;
        let confidence = left.confidence * top.confidence;
        if confidence < CONFIDENCE_MIN {
            return Err(format!(
                "the hands were at other sides too (confidence {confidence:.2}){CLEARER}"
            ));
        }
        Ok(Found {
            mounting,
            left,
            top,
        })
    }

    fn learn(&mut self, picture: &Picture) {
        self.empty.push_back(*picture);
        if self.empty.len() < EMPTY_FRAMES {
            return;
        }
        let sorted = |pixel: usize| {
            let mut values: Vec<f64> = self.empty.iter().map(|frame| frame[pixel]).collect();
            values.sort_by(f64::total_cmp);
            values
        };
        let pixels: [Vec<f64>; PIXELS] = std::array::from_fn(sorted);
        if pixels
            .iter()
            .all(|values| values[EMPTY_FRAMES - 1] - values[0] <= STILL_K)
        {
            self.background = pixels.map(|values| values[EMPTY_FRAMES / 2]);
            self.step = Step::Left;
        } else {
            self.empty.pop_front();
        }
    }

    fn look(&mut self, picture: &Picture) {
        let seen = self.seen_in(picture);
        self.seen += usize::from(seen.is_some());
        let Some((side, seen)) = seen.and_then(|seen| Some((side_of(&seen)?, seen))) else {
            self.steady.clear();
            return;
        };
        self.at_side[side.0] += 1;
        self.steady.retain(|(before, _)| *before == side);
        self.steady.push((side, seen));
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
        let mean = |of: usize| {
            let sum: f64 = self.steady.iter().map(|(_, seen)| seen[of]).sum();
            sum / count(self.steady.len())
        };
        Hand {
            side,
            column: mean(0) + middle(COLUMNS) + 1.0,
            row: mean(1) + middle(ROWS) + 1.0,
            contrast_k: mean(2),
            confidence: count(self.at_side[side.0]) / count(self.seen),
        }
    }

    fn wait(&mut self, picture: &Picture) {
        self.without = self.seen_in(picture).map_or(self.without + 1, |_| 0);
        if self.without >= GONE_FRAMES {
            (self.seen, self.at_side) = (0, [0; 4]);
            self.steady.clear();
            self.step = Step::Top;
        }
    }

    /// The middle of what is warmer, weighted by how much: columns and rows off the picture's middle; and the largest contrast.
    fn seen_in(&self, picture: &Picture) -> Option<[f64; 3]> {
        let (mut sum, mut x, mut y, mut contrast_k) = (0.0, 0.0, 0.0, 0.0_f64);
        for (index, (now, before)) in picture.iter().zip(&self.background).enumerate() {
            let excess = now - before;
            if excess < WARM_K {
                continue;
            }
            sum += excess;
            x += excess * (count(index % COLUMNS) - middle(COLUMNS));
            y += excess * (count(index / COLUMNS) - middle(ROWS));
            contrast_k = contrast_k.max(excess);
        }
        (sum > 0.0).then(|| [x / sum, y / sum, contrast_k])
    }
}

fn side_of([x, y, _]: &[f64; 3]) -> Option<Side> {
    let is_off = |far: f64, other: f64| far >= OFF_THE_MIDDLE && far >= ONE_AXIS * other;
    if is_off(x.abs(), y.abs()) {
        Some(Side(if *x < 0.0 { 0 } else { 2 }))
    } else if is_off(y.abs(), x.abs()) {
        Some(Side(if *y < 0.0 { 1 } else { 3 }))
    } else {
        None
    }
}

/// The middle of so many cells, counted from 0.
const fn middle(cells: usize) -> f64 {
    (count(cells) - 1.0) / 2.0
}

/// What was found of this sensor, or why nothing was, for people.
#[must_use]
pub fn text(sensor: &str, found: &Result<Found, String>) -> String {
    let Found {
        mounting,
        left,
        top,
    } = match found {
        Ok(found) => found,
        Err(why) => return format!("{sensor}: cannot tell: {why}"),
    };
    let hand = |name: &str, hand: &Hand| {
        let (side, column, row) = (format!("{},", hand.side), hand.column, hand.row);
        format!(
            "hand at the {name:<5} seen at the {side:<7} column {column:.1}, row {row:.1}, {:+.1} K\n",
            hand.contrast_k
        )
    };
    let scene = mounting.roll_deg().map_or_else(
        || {
            "none: a lens does not mirror. Was left shown as one sees it who looks at the sensor?"
                .to_owned()
        },
        |roll_deg| format!("roll_deg = {roll_deg}"),
    );
    let keys = match mounting.keys().as_str() {
        "" => "as it is".to_owned(),
        keys => format!("keys {keys}  (t turns, m mirrors)"),
    };
    format!(
        "{sensor}: mounted {} (confidence {:.2})\n{}{}scene     {scene}\npage      {keys}",
        mounting.words(),
        left.confidence * top.confidence,
        hand("left", left),
        hand("top", top),
    )
}

/// The same for programs.
#[must_use]
pub fn json(sensor: &str, found: &Result<Found, String>) -> Value {
    match found {
        Ok(Found {
            mounting,
            left,
            top,
        }) => json!({
            "sensor": sensor,
            "told": true,
            "roll_deg": mounting.roll_deg(),
            "mirrored": mounting.mirrored,
            "page": mounting,
            "confidence": left.confidence * top.confidence,
            "left": left,
            "top": top,
        }),
        Err(why) => json!({ "sensor": sensor, "told": false, "why": why }),
    }
}
