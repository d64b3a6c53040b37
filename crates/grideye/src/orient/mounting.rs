//! How a sensor is mounted, from the sides of its picture at which left and top are seen.

use serde::Serialize;
use std::fmt;

/// A side of the sensor's own picture, pixel 1 at the top left.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum Side {
    Left,
    Top,
    Right,
    Bottom,
}

impl Side {
    /// Clockwise, as a turn takes each to the next.
    const ROUND: [Self; 4] = [Self::Left, Self::Top, Self::Right, Self::Bottom];

    /// Where it is after so many quarters clockwise.
    fn turned(self, quarters: u8) -> Self {
        let place = Self::ROUND.iter().position(|side| *side == self);
        let place = place.unwrap_or_default() + usize::from(quarters);
        Self::ROUND[place % Self::ROUND.len()]
    }

    /// Where it is after left and right changed places.
    const fn mirrored(self) -> Self {
        match self {
            Self::Left => Self::Right,
            Self::Right => Self::Left,
            other => other,
        }
    }
}

impl fmt::Display for Side {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(match self {
            Self::Left => "left",
            Self::Top => "top",
            Self::Right => "right",
            Self::Bottom => "bottom",
        })
    }
}

/// What brings the sensor's picture upright: the mirror first, then the turn, as the page does it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub(super) struct Mounting {
    /// Quarters clockwise, 0 to 3.
    pub(super) quarters: u8,
    pub(super) mirrored: bool,
}

impl Mounting {
    /// The one that takes these two to the left and to the top; none, where they lie on one line.
    pub(super) fn from_seen(left: Side, top: Side) -> Option<Self> {
        let all = [false, true]
            .into_iter()
            .flat_map(|mirrored| (0..4).map(move |quarters| Self { quarters, mirrored }));
        let mut fitting = all.filter(|mounting| {
            mounting.shown_at(left) == Side::Left && mounting.shown_at(top) == Side::Top
        });
        fitting.next()
    }

    /// Where what the sensor has at this side is shown.
    fn shown_at(self, side: Side) -> Side {
        let side = if self.mirrored { side.mirrored() } else { side };
        side.turned(self.quarters)
    }

    /// `roll_deg` of the scene file: clockwise, as seen from behind the sensor. None of a mirror image, which no way of
    /// mounting makes.
    pub(super) fn roll_deg(self) -> Option<u16> {
        // What leans to the right sees the world lean to the left, and is brought upright by the same turn.
        (!self.mirrored).then(|| u16::from(self.quarters) * 90)
    }

    /// The keys that bring the page's picture upright.
    pub(super) fn keys(self) -> String {
        let mirror = if self.mirrored { "m" } else { "" };
        format!("{mirror}{}", "t".repeat(usize::from(self.quarters)))
    }
}

impl fmt::Display for Mounting {
    /// In words, to stand behind "the sensor is mounted".
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.roll_deg() {
            Some(0) => formatter.write_str("upright"),
            Some(180) => formatter.write_str("upside down"),
            Some(90) => formatter.write_str("turned a quarter clockwise, as seen from behind it"),
            Some(_) => {
                formatter.write_str("turned a quarter counter-clockwise, as seen from behind it")
            }
            None => formatter.write_str("so that left and right are exchanged"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_pair_of_sides_has_one_mounting_and_a_line_has_none() {
        let mut found = Vec::new();
        for left in Side::ROUND {
            for top in Side::ROUND {
                let mounting = Mounting::from_seen(left, top);
                let is_line = left == top || left.turned(2) == top;
                assert_eq!(mounting.is_none(), is_line, "{left} {top}");
                found.extend(mounting);
            }
        }
        for (place, mounting) in found.iter().enumerate() {
            assert!(!found[..place].contains(mounting), "{mounting:?}");
        }
        assert_eq!(found.len(), 8);
    }

    /// A sensor whose top leans to the right has the room's top at its left, and the room's left at its bottom.
    #[test]
    fn a_sensor_that_leans_right_has_a_roll_of_90() {
        let leaning = Mounting::from_seen(Side::Bottom, Side::Left).unwrap();
        assert_eq!(leaning.roll_deg(), Some(90));
        assert_eq!(leaning.keys(), "t");
        let facing = Mounting::from_seen(Side::Right, Side::Top).unwrap();
        assert_eq!((facing.roll_deg(), facing.keys().as_str()), (None, "m"));
    }
}
