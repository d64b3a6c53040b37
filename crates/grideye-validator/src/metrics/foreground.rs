//! C with the empty room subtracted from both sides, which leaves the people.

use crate::frames::{RealFrame, SimulatedFrame};
use crate::names::named;
use crate::numbers::{finite, mean};

/// C of what stands out of the empty room, over all pixels of all frames.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ForegroundCorrelation {
    /// -1 to 1; `None` if the claim shows nobody.
    pub value: Option<f64>,
    /// The recording's repeat in place of the claim, its noise counted once (square root, after Spearman).
    pub ceiling: Option<f64>,
    /// Source of the real side's empty room.
    pub from: RoomSource,
}

named! {
    /// Source of the empty room.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
    #[expect(missing_docs, reason = "the words below say it")]
    pub enum RoomSource {
        #[default]
        Scene = "scene";
        Profile = "profile";
        Recording = "recording";
    }
}

impl RoomSource {
    /// Completes "the empty room is".
    #[must_use]
    pub const fn in_words(self) -> &'static str {
        match self {
            Self::Scene => "the scene without its people",
            Self::Profile => "the scene without its people, with the pattern of the profile",
            Self::Recording => "what the recording shows while nobody is there",
        }
    }
}

#[derive(Debug, Clone, Default)]
pub(crate) struct EmptyRoom {
    pub(crate) from: RoomSource,
    /// Row by row, °C; the simulated empty room if `None`.
    pub(crate) celsius: Option<Vec<f64>>,
}

/// Sums of squares below this are rounding, °C².
const NOTHING: f64 = 1e-9;

/// Sums over pixels centered frame by frame.
#[derive(Default)]
pub(crate) struct CenteredProducts {
    xx: f64,
    yy: f64,
    xy: f64,
}

/// `nobody` has the scene without its people for each simulated frame.
pub(crate) fn foreground_correlation(
    real: &[RealFrame],
    simulated: &[SimulatedFrame],
    nobody: &[Vec<f64>],
    room: &EmptyRoom,
) -> ForegroundCorrelation {
    let (mut claimed, mut repeated) = (CenteredProducts::default(), CenteredProducts::default());
    for ((frame, claim), empty) in real.iter().zip(simulated).zip(nobody) {
        let seen_room = room.celsius.as_ref().unwrap_or(empty);
        claimed.add(&frame.celsius, seen_room, &claim.noise_free, empty);
        if let Some(later) = &frame.later {
            repeated.add(&frame.celsius, seen_room, later, seen_room);
        }
    }
    ForegroundCorrelation {
        value: claimed.correlation(),
        ceiling: repeated.correlation().map(|repeat| repeat.max(0.0).sqrt()),
        from: room.from,
    }
}

fn foreground(frame: &[f64], room: &[f64]) -> Vec<f64> {
    let mut left: Vec<f64> = frame.iter().zip(room).map(|(a, b)| a - b).collect();
    let middle = mean(&left).unwrap_or_default();
    left.iter_mut().for_each(|value| *value -= middle);
    left
}

impl CenteredProducts {
    /// Adds two frames, each less its room and its mean.
    pub(crate) fn add(&mut self, x: &[f64], x_room: &[f64], y: &[f64], y_room: &[f64]) {
        for (x, y) in foreground(x, x_room).iter().zip(foreground(y, y_room)) {
            self.xx += x * x;
            self.yy += y * y;
            self.xy += x * y;
        }
    }

    pub(crate) fn correlation(&self) -> Option<f64> {
        // Rounding of a frame without contrast is no contrast.
        (self.xx > NOTHING && self.yy > NOTHING)
            .then(|| self.xy / (self.xx * self.yy).sqrt())
            .and_then(finite)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Duration;

    fn frames(real: [f64; 4], claim: [f64; 4]) -> (RealFrame, SimulatedFrame) {
        let real = RealFrame {
            time: Duration::ZERO,
            celsius: real.to_vec(),
            later: Some(real.to_vec()),
        };
        let claim = SimulatedFrame {
            time: Duration::ZERO,
            celsius: vec![0.0; 4],
            noise_free: claim.to_vec(),
            truth: None,
        };
        (real, claim)
    }

    const ROOM: [f64; 4] = [20.0; 4];

    /// By hand: above the room (2, 0, 0, 0) and (0, 2, 0, 0), centered: product -1 of 3. With the room it would be
    /// 0.76.
    #[test]
    fn a_radiator_does_not_stand_in_for_a_person() {
        let room = vec![20.0, 20.0, 20.0, 25.0];
        let (real, claim) = frames([22.0, 20.0, 20.0, 25.0], [20.0, 22.0, 20.0, 25.0]);
        let found = foreground_correlation(&[real], &[claim], &[room], &EmptyRoom::default());
        assert!((found.value.unwrap() + 1.0 / 3.0).abs() < 1e-12);
        assert!((found.ceiling.unwrap() - 1.0).abs() < 1e-12);
    }

    #[test]
    fn a_known_room_takes_the_place_of_the_simulated_one_on_the_real_side() {
        let known = EmptyRoom {
            from: RoomSource::Profile,
            celsius: Some(vec![21.0, 20.0, 19.0, 20.0]),
        };
        let (real, claim) = frames([21.0, 22.0, 19.0, 20.0], [20.0, 22.0, 20.0, 20.0]);
        let found = foreground_correlation(&[real], &[claim], &[ROOM.to_vec()], &known);
        assert!((found.value.unwrap() - 1.0).abs() < 1e-12);
        assert_eq!(found.from, RoomSource::Profile);
    }

    #[test]
    fn a_claim_without_people_has_no_c_above_the_room() {
        let ((real, claim), room) = (frames([22.0, 20.0, 20.0, 20.0], ROOM), EmptyRoom::default());
        let found = foreground_correlation(&[real], &[claim], &[ROOM.to_vec()], &room);
        assert_eq!(found.value, None);
    }
}
