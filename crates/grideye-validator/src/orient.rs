//! Finds how a sensor is mounted: someone holds a hand at the left of its view, then at the top.

use crate::numbers::count;
use grideye_frame::{COLUMNS, PIXELS, ROWS};
use serde::{Serialize, Serializer};
use serde_json::{Value, json};
use std::collections::VecDeque;
use std::fmt;

/// The temperatures of a frame, °C, pixel 1 first.
pub type Picture = [f64; PIXELS];

const EMPTY_FRAMES: usize = 20;
/// A view is empty while no pixel spans more than this over those frames, K: five times a unit's noise.
const STILL_K: f64 = 2.5;
/// A pixel this much above the background sees the hand, K: five times the noise, not measured with a real hand.
const WARM_K: f64 = 1.25;
/// Frames in a row with the hand at one side before it counts.
const STEADY_FRAMES: usize = 10;
/// Frames in a row without a hand before it counts as gone.
const GONE_FRAMES: usize = 5;
/// Least distance of the hand from the middle of the image, pixels.
const OFF_THE_MIDDLE: f64 = 1.0;
/// The distance along one axis must be this many times that along the other.
const ONE_AXIS: f64 = 1.5;
/// Below this the hand was elsewhere too often to trust the result.
const CONFIDENCE_MIN: f64 = 0.5;
const CLEARER: &str =
    "\nhint: hold it closer to the edge of the view, at the middle of that side, for two seconds";

/// A side of the sensor's own image (pixel 1 at the top left), in quarter turns clockwise from the left.
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

/// What makes the sensor's image upright: mirror first, then turn, as the live page does.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
struct Mounting {
    /// Quarter turns clockwise, 0 to 3.
    quarters: usize,
    mirrored: bool,
}

impl Mounting {
    /// The mounting that moves these sides to the left and the top; `None` if they lie on one axis.
    const fn from_seen(left: Side, top: Side) -> Option<Self> {
        let (quarters, mirrored) = match (top.0 + 4 - left.0) % 4 {
            1 => (4 - left.0, false),
            3 => (left.0 + 2, true),
            _ => return None,
        };
        let quarters = quarters % 4;
        Some(Self { quarters, mirrored })
    }

    /// `roll_deg` of the scene file, clockwise seen from behind the sensor; `None` for a mirror image.
    fn roll_deg(self) -> Option<usize> {
        // A sensor leaning right sees the world lean left, so the same turn makes it upright.
        (!self.mirrored).then_some(self.quarters * 90)
    }

    /// The live page's keys that make the image upright.
    fn keys(self) -> String {
        let mirror = if self.mirrored { "m" } else { "" };
        format!("{mirror}{}", "t".repeat(self.quarters))
    }

    /// Completes "the sensor is mounted".
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

/// What [`Watch`] waits for.
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
    /// Nothing; both hands were seen.
    Done,
}

/// A hand seen at one side.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
struct Hand {
    side: Side,
    /// Centroid in the sensor's own image, pixels from 1 to 8.
    column: f64,
    row: f64,
    /// Excess of its warmest pixel over the background, K.
    contrast_k: f64,
    /// Share of the frames with a hand in which it was at this side.
    confidence: f64,
}

/// Both hands and the mounting they show.
#[derive(Debug)]
pub struct Found {
    mounting: Mounting,
    left: Hand,
    top: Hand,
}

/// The search, fed frame by frame.
#[derive(Debug)]
pub struct Watch {
    step: Step,
    empty: VecDeque<Picture>,
    background: Picture,
    /// Frames with a hand since this step began.
    seen: usize,
    at_side: [usize; 4],
    /// Frames in a row at one side: columns and rows from the middle, contrast.
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
    /// What it waits for now.
    #[must_use]
    pub const fn step(&self) -> Step {
        self.step
    }

    /// Whether a hand is in view, but at no side.
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

    /// The mounting, once both hands were seen.
    ///
    /// # Errors
    /// Why the hands show no mounting, with a hint.
    pub fn found(&self) -> Result<Found, String> {
        let unclear = if self.is_unclear() { CLEARER } else { "" };
        let [left, top] = self.hands[..] else {
            return Err(match self.step {
                Step::Empty => "the view was never still for two seconds\nhint: start with an empty view".to_owned(),
                Step::Left => format!("no hand was seen at one side for a second{unclear}"),
                Step::Gone => "the first hand never left the view\nhint: take it away before you show the second at the top".to_owned(),
                Step::Top | Step::Done => format!("no second hand was seen at one side for a second{unclear}"),
            });
        };
        let mounting = Mounting::from_seen(left.side, top.side).ok_or_else(|| {
            format!(
                "the left hand was seen at the {} and the top hand at the {}, on one line\nhint: try again, with the second hand a quarter turn clockwise from the first",
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

    /// Centroid of the warm pixels, weighted by excess, in columns and rows from the middle; then the largest excess,
    /// K.
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

/// Middle index of a row of cells counted from 0.
const fn middle(cells: usize) -> f64 {
    (count(cells) - 1.0) / 2.0
}

/// The result for one sensor as text, or why there is none.
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
            "none: a lens does not mirror. Did you show left as seen when facing the sensor?"
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

/// The same as JSON.
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
