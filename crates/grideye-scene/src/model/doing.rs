//! What a person does, and when a person in motion changes its posture.

use crate::model::person::Posture;
use glam::DVec3;

grideye_frame::named! {
    /// What a person does at a moment, with its name in a file.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
    pub enum Doing {
        /// Comes into the room.
        Enter = "enter";
        /// Leaves the room.
        Leave = "leave";
        /// Walks.
        Walk = "walk";
        /// Stands.
        Stand = "stand";
        /// Changes from upright to sitting.
        SitDown = "sit-down";
        /// Sits.
        Sit = "sit";
        /// Changes from sitting to upright.
        StandUp = "stand-up";
        /// Changes from sitting to lying.
        LieDown = "lie-down";
        /// Lies.
        Lie = "lie";
        /// Changes from lying to sitting.
        SitUp = "sit-up";
        /// Changes from upright straight to lying.
        Fall = "fall";
        /// Changes from lying straight to upright.
        GetUp = "get-up";
    }
}

impl Doing {
    /// What a person does who changes between these postures, or keeps one; `None` stands for being away.
    pub(crate) const fn between(from: Option<Posture>, to: Option<Posture>, moves: bool) -> Self {
        use Posture::{Lie, Sit, Stand, Walk};
        match (from, to) {
            (None, _) => Self::Enter,
            (_, None) => Self::Leave,
            (Some(Stand | Walk), Some(Stand | Walk)) if moves => Self::Walk,
            (Some(Stand | Walk), Some(Stand | Walk)) => Self::Stand,
            (Some(Stand | Walk), Some(Sit)) => Self::SitDown,
            (Some(Stand | Walk), Some(Lie)) => Self::Fall,
            (Some(Sit), Some(Sit)) => Self::Sit,
            (Some(Sit), Some(Stand | Walk)) => Self::StandUp,
            (Some(Sit), Some(Lie)) => Self::LieDown,
            (Some(Lie), Some(Lie)) => Self::Lie,
            (Some(Lie), Some(Sit)) => Self::SitUp,
            (Some(Lie), Some(Stand | Walk)) => Self::GetUp,
        }
    }
}

/// A place on a person's way, and what the person does there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stop {
    /// The place, millimeters.
    pub at_mm: DVec3,
    /// When the person arrives, seconds.
    pub from_s: f64,
    /// For how long it stays, seconds.
    pub stays_s: f64,
    /// Its posture there; `None` while it is away.
    pub posture: Option<Posture>,
}

/// The posture at a waypoint.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Keep {
    pub(crate) from_s: f64,
    pub(crate) until_s: f64,
    /// `None` while the person is away.
    pub(crate) posture: Option<Posture>,
    /// Where the leg to this waypoint leads: level, of length 1; zero if nowhere.
    pub(crate) along: DVec3,
}

impl Keep {
    pub(crate) fn all(stops: &[Stop]) -> Vec<Self> {
        let mut from_mm = stops.first().map_or(DVec3::ZERO, |stop| stop.at_mm);
        let keeps = stops.iter().map(|stop| {
            let came_mm = stop.at_mm - std::mem::replace(&mut from_mm, stop.at_mm);
            let along = came_mm.with_z(0.0).try_normalize();
            Self {
                from_s: stop.from_s,
                until_s: stop.from_s + stop.stays_s,
                posture: stop.posture,
                along: along.unwrap_or(DVec3::ZERO),
            }
        });
        keeps.collect()
    }
}

/// Two postures that follow one another, and how much of the time between has passed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Change {
    pub(crate) from: Keep,
    pub(crate) to: Keep,
    pub(crate) passed: f64,
}

impl Change {
    /// The last posture that began, and the next one once the first ends.
    pub(crate) fn at(keeps: &[Keep], time_s: f64) -> Option<Self> {
        let begun = keeps.partition_point(|keep| keep.from_s <= time_s);
        let from = *keeps.get(begun.saturating_sub(1))?;
        let still = Self {
            from,
            to: from,
            passed: 0.0,
        };
        let Some(to) = keeps.get(begun.max(1)).filter(|_| time_s > from.until_s) else {
            return Some(still);
        };
        Some(Self {
            to: *to,
            passed: (time_s - from.until_s) / (to.from_s - from.until_s),
            ..still
        })
    }

    pub(crate) fn is_away(&self) -> bool {
        self.from.posture.is_none() && self.to.posture.is_none()
    }

    /// Whether the person turns to where this leg leads: who sits down or falls does not.
    pub(crate) fn is_upright(&self) -> bool {
        let mut postures = [self.from, self.to].into_iter();
        postures.all(|keep| keep.is_upright())
    }

    /// The postures on both sides; who comes or goes walks.
    pub(crate) fn postures(&self) -> [Posture; 2] {
        let [from, to] = [self.from.posture, self.to.posture];
        let from = from.or(to).unwrap_or(Posture::Walk);
        [from, to.unwrap_or(from)]
    }

    /// How much of the change is done: falls go evenly, which gives hips and head the speeds that Choi et al. (2015,
    /// doi 10.1016/j.jbiomech.2015.02.025) measured; everything else has the least jerk.
    pub(crate) fn share(&self) -> f64 {
        let share = self.passed;
        match Doing::between(self.from.posture, self.to.posture, false) {
            Doing::Fall => share,
            _ => share * share * share * (10.0 + share * (-15.0 + 6.0 * share)),
        }
    }

    /// Where the head is of who lies down, gets up or falls: where the way to lying leads, else backward.
    pub(crate) fn head_to(&self, front: DVec3) -> DVec3 {
        let lies = [self.to, self.from];
        let lies = lies.iter().find(|keep| keep.posture == Some(Posture::Lie));
        let along = lies.map_or(DVec3::ZERO, |keep| keep.along);
        if along == DVec3::ZERO { -front } else { along }
    }
}

impl Keep {
    pub(crate) fn is_upright(&self) -> bool {
        !matches!(self.posture, Some(Posture::Sit | Posture::Lie))
    }
}
