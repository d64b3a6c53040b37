//! From simulated recordings, or worlds, to a decision.

use crate::align::Orientation;
use crate::constants::{ABSENT, CLEAR_POWER, FAINT};
use crate::decision::alternative::Alternative;
use crate::decision::model::{Model, Statistics};
use crate::decision::recording::{Recording, fill};
use crate::decision::spread::{Spread, Statistic, is_outside, one_in_a_hundred};
use crate::decision::view::{Image, View, add, each_less};
use crate::decision::world::{Drawn, Looks, World, looks};
use crate::names::named;
use crate::numbers::{count, index};
use grideye_scene::Laws;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use serde::Serialize;

/// What a recording says about its scene, beside simulated recordings.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Decision {
    /// Share of the scene's simulated recordings that are as far from it as the recording, or farther.
    pub right: f64,
    /// What is farthest off, in words.
    pub worst: String,
    #[serde(skip)]
    pub(crate) cause: Statistic,
    /// Of each person, or of all objects together.
    pub contrasts: Vec<Contrast>,
    /// How much later than the scene the recording is, seconds, and what all but .5 % of the simulated ones show.
    pub delay_s: f64,
    /// Lowest and highest.
    pub delay_range_s: [f64; 2],
    /// The smallest of [`OFFSETS_M`] by which the first person must be aside so that nine of ten recordings would not
    /// agree; `None` if none of them is, or if right ones mostly would not.
    pub refused_aside_m: Option<f64>,
    /// What else the recording could show.
    pub alternatives: Vec<Alternatively>,
    /// Whether it shows nothing but the room and noise, as far as can be told; of a refused one, also that nobody is elsewhere.
    pub is_empty: bool,
    /// How far the level of all pixels runs away from the scene's, beyond the slow drift that was removed, °C.
    pub drift_c: f64,
    /// Frames that it was judged by.
    pub frames: usize,
    /// Pictures that it was judged by, each the mean of neighboring frames if there are many.
    pub pictures: usize,
    /// Frames that resemble neither neighbor, left out.
    pub strays: usize,
}

/// How warm a person is over the room.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Contrast {
    /// The person; `None` if there are only objects.
    pub of: Option<String>,
    /// In the recording, over the scene's.
    pub found: f64,
    /// Of all but .5 % of the simulated recordings: lowest and highest.
    pub range: [f64; 2],
}

/// Whether something else than the scene explains the recording too.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Alternatively {
    /// In words.
    pub what: String,
    #[serde(skip)]
    pub(crate) of: Alternative,
    /// 1 for the scene, 0 for the alternative, less what noise may add.
    pub likeness: f64,
    /// What simulated recordings of the alternative stay below.
    pub limit: f64,
    /// Share of the scene's simulated recordings above that limit.
    pub power: f64,
    /// Whether the two differ by less than noise.
    pub is_alike: bool,
}

/// Right worlds that set the scale of each block, and the law of each other statistic: with fewer some scales would be too
/// small, and these blocks stand out.
const FOR_STATISTICS: usize = 260;
/// Those that set the law of each kind.
const FOR_KINDS: usize = 220;
/// Those that set the rank: the recording and three of them are the .015 that are refused.
const FOR_RANK: usize = 266;
const RIGHT: usize = FOR_STATISTICS + FOR_KINDS + FOR_RANK;
const OF_ALTERNATIVE: usize = 100;
/// Of one that right worlds come near to: of those, one in a hundred may agree.
const OF_NEAR: usize = 400;
/// Of those, as many are looked at: the most like the scene.
const LOOKED_AT: usize = 60;
/// Pictures of worlds that are kept for all alternatives: 51 megabytes.
const PICTURES_KEPT: usize = 200_000;
/// Worlds of each offset that is tried.
const OF_OFFSET: usize = 30;
/// Offsets that are tried for [`Decision::refused_aside_m`], meters.
pub const OFFSETS_M: [f64; 6] = [0.1, 0.15, 0.2, 0.3, 0.4, 0.5];

impl Decision {
    /// Whether it is no recording of the scene.
    pub(crate) fn is_refused(&self, right_min: f64) -> bool {
        is_refused(self.right, right_min, self.off_contrast().is_some())
    }

    pub(crate) fn is_agreed(&self, right_min: f64) -> bool {
        !self.is_refused(right_min) && self.found(Finding::Open).next().is_none()
    }

    /// The contrast farthest out of its range, if any is out.
    pub(crate) fn off_contrast(&self) -> Option<&Contrast> {
        let off = |one: &&Contrast| is_outside(one.found, one.range);
        let by =
            |one: &Contrast| (one.range[0] / one.found.max(0.01)).max(one.found / one.range[1]);
        let contrasts = self.contrasts.iter();
        contrasts.filter(off).max_by(|a, b| by(a).total_cmp(&by(b)))
    }

    /// Alternatives of which the recording says this.
    pub(crate) fn found(&self, finding: Finding) -> impl Iterator<Item = &Alternatively> {
        let all = self.alternatives.iter();
        all.filter(move |one| one.finding() == finding)
    }

    /// Orientations in which the scene looks the same.
    pub(crate) fn alike(&self) -> Vec<Orientation> {
        let turned = self.found(Finding::Same).filter_map(|one| match one.of {
            Alternative::Turned(orientation) => Some(orientation),
            _ => None,
        });
        turned.collect()
    }
}

impl Contrast {
    /// Whether nothing is as warm where the scene has this, when it has it there: no clothes make it so.
    pub(crate) fn is_absent(&self) -> bool {
        self.found < ABSENT
    }
}

named! {
    /// What a recording says of an alternative.
    #[derive(Debug, Clone, Copy, PartialEq, Eq)]
    pub enum Finding {
        /// It does not come from it.
        Excluded = "excluded", "excluded";
        /// It is the scene, as far as this sensor tells: agreeing does not take excluding it.
        Same = "same", "looks the same";
        /// The recording could come from it too.
        Open = "open", "not excluded";
    }
}

impl Alternatively {
    /// What the recording says of it.
    #[must_use]
    pub fn finding(&self) -> Finding {
        self.finding_of(self.likeness)
    }

    /// What a recording of this likeness says of it.
    fn finding_of(&self, likeness: f64) -> Finding {
        let is_clear = self.of.keeps_people() && self.power > CLEAR_POWER;
        let is_exempt = self.is_alike && !is_clear;
        match (&self.of, likeness > self.limit) {
            (_, true) if !is_exempt => Finding::Excluded,
            (_, false) if !is_exempt => Finding::Open,
            // A scene that shows nothing is no other than nobody.
            (Alternative::Nobody, _) => Finding::Open,
            // Who is one more may be excluded although any unit could hide them.
            (Alternative::More(_), true) => Finding::Excluded,
            // A symmetric scene is the scene.
            _ => Finding::Same,
        }
    }
}

/// What a recording, simulated or not, is refused by: how few right worlds are as far off, or a contrast.
fn is_refused(share: f64, right_min: f64, has_off_contrast: bool) -> bool {
    share <= right_min || has_off_contrast
}

/// What right worlds say of any recording.
struct Right {
    worlds: Vec<Statistics>,
    spread: Spread,
    /// How far off others of them are, sorted.
    held: Vec<f64>,
    right_min: f64,
}

impl Right {
    fn new(worlds: Vec<Statistics>, right_min: f64) -> Self {
        let (known, held) = worlds.split_at(FOR_STATISTICS + FOR_KINDS);
        let (of_statistics, of_kinds) = known.split_at(FOR_STATISTICS);
        let spread = Spread::new(of_statistics, of_kinds);
        let held = held.iter().map(|one| spread.farthest(one).1);
        Self {
            held: sorted(held.collect()),
            worlds,
            spread,
            right_min,
        }
    }

    fn share(&self, one: &Statistics) -> f64 {
        share_as_far(&self.held, self.spread.farthest(one).1)
    }

    fn refuses(&self, one: &Statistics) -> bool {
        let has_off_contrast = self.spread.has_off_contrast(one);
        is_refused(self.share(one), self.right_min, has_off_contrast)
    }
}

/// Share of right worlds that are as far off or farther, among them the recording itself; of sorted distances.
fn share_as_far(held: &[f64], off: f64) -> f64 {
    let nearer = held.partition_point(|other| *other < off);
    count(held.len() - nearer + 1) / count(held.len() + 1)
}

/// How a decision is made.
#[derive(Clone, Copy)]
pub(crate) struct How {
    /// Recordings of which no more right worlds than this share are as far off are refused.
    pub(crate) right_min: f64,
    /// Whether all that is asked is whether it agrees.
    pub(crate) is_brief: bool,
    pub(crate) is_stopped: fn() -> bool,
}

/// `None` once it is stopped, and of a recording that is refused if it is brief.
pub(crate) fn decide(
    view: &mut View,
    recording: &Recording,
    laws: &Laws,
    how: How,
) -> Option<Decision> {
    let mut worlds = Worlds::new(view, recording, laws, how.is_stopped);
    let right = Right::new(worlds.right()?, how.right_min);
    let found = worlds.model.of(&worlds.seen);
    if how.is_brief && right.refuses(&found) {
        return None;
    }
    worlds.draw_others();
    let alternatives: Vec<Alternatively> = (0..worlds.model.hypotheses.len())
        .map(|hypothesis| worlds.alternatively(hypothesis, &found, &right))
        .collect::<Option<_>>()?;
    let is_agreed = |one: &Statistics| {
        let mut all = alternatives.iter().zip(&one.likeness);
        let is_open = all.any(|(one, likeness)| one.finding_of(*likeness) == Finding::Open);
        !is_open && !right.refuses(one)
    };
    let are_asked = !worlds.view.people.is_empty() && !how.is_brief;
    let mut offsets = OFFSETS_M.into_iter().filter(|_| are_asked);
    let refused_aside_m = offsets.find(|aside_m| worlds.agree_aside(*aside_m, &is_agreed, 0.1));
    // A recording too short to agree where the scene is right notices nothing.
    let refused_aside_m = refused_aside_m.filter(|_| !worlds.agree_aside(0.0, &is_agreed, 0.5));
    let nobody = alternatives
        .iter()
        .find(|one| one.of == Alternative::Nobody);
    let is_empty = nobody.is_some_and(|one| one.finding() != Finding::Excluded)
        && worlds.shows_only_the_room(right.refuses(&found));
    let (model, view) = (&worlds.model, &worlds.view);
    let spread = &right.spread;
    let worst = match is_empty {
        true => {
            let who = match view.people.is_empty() {
                true => "nothing warm",
                false => "nobody",
            };
            format!("the recording shows {who}, only the room and noise")
        }
        false => spread.worst(&found, model, view),
    };
    let contrasts = found.contrasts.iter().zip(spread.contrasts(&found));
    let contrasts = contrasts
        .zip(0..)
        .map(|((found, range), subject)| Contrast {
            of: view.people.get(subject).map(|walker| walker.name.clone()),
            found: *found,
            range,
        });
    Some(Decision {
        right: right.share(&found),
        worst,
        cause: spread.farthest(&found).0,
        contrasts: contrasts.collect(),
        delay_s: found.lag_s,
        delay_range_s: spread.delays(),
        refused_aside_m,
        is_empty,
        alternatives,
        drift_c: view.drift_c(&recording.pictures),
        frames: recording.frames - recording.strays,
        pictures: recording.pictures.len() - recording.missing.len(),
        strays: recording.strays,
    })
}

/// Draws recordings that could be.
struct Worlds<'a> {
    view: &'a mut View,
    laws: &'a Laws,
    recording: &'a Recording,
    /// Of the recording, beyond the room.
    seen: Vec<Image>,
    model: Model,
    random: ChaCha8Rng,
    /// What units added to the first right worlds, for others to use again.
    errors: Vec<Vec<Image>>,
    /// The same of how its people looked.
    looks: Vec<Looks>,
    /// The first of those that alternatives change.
    others: Vec<World>,
    is_stopped: fn() -> bool,
}

impl<'a> Worlds<'a> {
    fn new(
        view: &'a mut View,
        recording: &'a Recording,
        laws: &'a Laws,
        is_stopped: fn() -> bool,
    ) -> Self {
        // Any seed will do, but the same recording always gets the same verdict.
        let mut random = ChaCha8Rng::seed_from_u64(0x0064_6563_6964_6500);
        let mut seen = each_less(&recording.pictures, &view.room);
        fill(&mut seen, &recording.missing);
        Self {
            seen,
            model: Model::new(view, laws, &recording.unit, &mut random),
            view,
            laws,
            recording,
            random,
            errors: Vec::with_capacity(OF_ALTERNATIVE),
            looks: Vec::with_capacity(OF_ALTERNATIVE),
            others: Vec::new(),
            is_stopped,
        }
    }

    fn right(&mut self) -> Option<Vec<Statistics>> {
        let one = |_| {
            if (self.is_stopped)() {
                return None;
            }
            let drawn = Drawn::of(self.view, self.laws, &mut self.random);
            let looks = looks(self.view, self.laws, &mut self.random);
            let shown = drawn.looking(&looks).shown(self.view);
            let unit = &self.recording.unit;
            let error = unit.errors(self.view.len(), &mut self.random);
            let statistics = self.model.of(&self.recorded(shown, &error));
            if self.errors.len() < OF_ALTERNATIVE {
                self.errors.push(error);
                self.looks.push(looks);
            }
            Some(statistics)
        };
        (0..RIGHT).map(one).collect()
    }

    fn alternatively(
        &mut self,
        number: usize,
        found: &Statistics,
        right: &Right,
    ) -> Option<Alternatively> {
        if (self.is_stopped)() {
            return None;
        }
        let of = self.model.hypotheses[number].what.clone();
        let scenes = right.worlds.iter().map(|one| one.likeness[number]);
        let scenes = sorted(scenes.collect());
        let above = |limit| scenes.len() - scenes.partition_point(|likeness| *likeness <= limit);
        let first = (0..OF_ALTERNATIVE).map(|index| {
            let world = self.world_of(&of, index);
            self.model.likeness(number, &world)
        });
        let first: Vec<f64> = first.collect();
        let mut limit = one_in_a_hundred(&sorted(first.clone()), f64::NEG_INFINITY, OF_ALTERNATIVE);
        if above(limit) < scenes.len() {
            let mut near = Vec::new();
            for index in 0..OF_NEAR {
                if first.get(index).is_some_and(|first| *first <= scenes[0]) {
                    continue;
                }
                let world = self.world_of(&of, index);
                let likeness = self.model.likeness(number, &world);
                if likeness > scenes[0] {
                    near.push((likeness, world));
                }
                if near.len() == 2 * LOOKED_AT {
                    nearest(&mut near);
                }
            }
            nearest(&mut near);
            // Below the last that is looked at nothing is known.
            let lowest = near.get(LOOKED_AT - 1).map_or(scenes[0], |last| last.0);
            near.retain(|(_, world)| !right.refuses(&self.model.of(world)));
            let agreed = near.iter().map(|near| near.0).collect();
            limit = one_in_a_hundred(&sorted(agreed), lowest, OF_NEAR);
        }
        let power = count(above(limit)) / count(RIGHT);
        Some(Alternatively {
            what: of.in_words(self.view),
            likeness: found.likeness[number],
            limit,
            power,
            is_alike: self.model.hypotheses[number].is_alike,
            of,
        })
    }

    fn draw_others(&mut self) {
        let kept = PICTURES_KEPT / self.view.len().max(1);
        for index in 0..kept.min(OF_NEAR) {
            let other = self.other(index);
            self.others.push(other);
        }
    }

    /// Each has numbers of its own: how many an alternative needs changes nothing for the next.
    fn other(&mut self, index: usize) -> World {
        let mut random = self.random.clone();
        random.set_stream(1 + u64::try_from(index).unwrap_or(0));
        let drawn = Drawn::of(self.view, self.laws, &mut random);
        World::new(
            drawn.looking(&self.looks[index % self.looks.len()]),
            self.view,
        )
    }

    fn world_of(&mut self, alternative: &Alternative, index: usize) -> Vec<Image> {
        let fresh;
        let other = if index < self.others.len() {
            &self.others[index]
        } else {
            fresh = self.other(index);
            &fresh
        };
        let shown = alternative.shown(self.view, other);
        self.recorded(shown, &self.errors[index % self.errors.len()])
    }

    /// Whether all that is warm in it, anywhere and at any time, is hardly more than noise; if it is no recording of the scene,
    /// only where somebody elsewhere would be more.
    fn shows_only_the_room(&mut self, is_refused: bool) -> bool {
        let empty = (0..OF_ALTERNATIVE).map(|index| {
            let world = self.world_of(&Alternative::Nobody, index);
            self.model.noise.squares(&world)
        });
        let empty: Vec<[f64; 2]> = empty.collect();
        let seen = self.model.noise.squares(&self.seen);
        // What changes is much more than the mean picture, and would hide who stands.
        let parts = [0, 1].map(|part| {
            let of_noise = sorted(empty.iter().map(|squares| squares[part]).collect());
            let subjects = self.model.squares[part];
            let most = one_in_a_hundred(&of_noise, f64::NEG_INFINITY, OF_ALTERNATIVE);
            let faint = most + FAINT * subjects;
            (
                seen[part] <= faint,
                of_noise[OF_ALTERNATIVE / 2] + subjects > faint,
            )
        });
        parts.iter().all(|part| part.0) && (!is_refused || parts.iter().any(|part| part.1))
    }

    /// What is recorded of what is shown.
    fn recorded(&self, mut shown: Vec<Image>, error: &[Image]) -> Vec<Image> {
        for (shown, error) in shown.iter_mut().zip(error) {
            add(shown, error, 1.0);
        }
        fill(&mut shown, &self.recording.missing);
        shown
    }

    /// Whether at most this share of recordings of the first person this far aside, in all directions, would agree.
    fn agree_aside(
        &mut self,
        aside_m: f64,
        is_agreed: &impl Fn(&Statistics) -> bool,
        most: f64,
    ) -> bool {
        let number = self.errors.len().min(OF_OFFSET);
        let agreed = (0..number).filter(|index| {
            let angle = std::f64::consts::TAU * count(*index) / count(number);
            let by_m = [aside_m * angle.cos(), aside_m * angle.sin()];
            let drawn = self.others[*index].drawn.clone();
            let shown = drawn.moved(0, by_m).shown(self.view);
            let recorded = self.recorded(shown, &self.errors[*index]);
            is_agreed(&self.model.of(&recorded))
        });
        // Most offsets are not refused: one too many that agree is enough to know.
        let most = index(most * count(number));
        agreed.take(most + 1).count() <= most
    }
}

/// Keeps the worlds that are most like the scene, those first.
fn nearest(worlds: &mut Vec<(f64, Vec<Image>)>) {
    worlds.sort_by(|a, b| b.0.total_cmp(&a.0));
    worlds.truncate(LOOKED_AT);
}

fn sorted(mut values: Vec<f64>) -> Vec<f64> {
    values.sort_by(f64::total_cmp);
    values
}

#[cfg(test)]
mod tests {
    use super::*;

    /// With the recording itself these are 4 of 267, the most that .015 allows.
    #[test]
    fn a_recording_is_refused_where_three_of_266_are_as_far() {
        let held: Vec<f64> = (1_u16..=266).map(f64::from).collect();
        let is_refused = |off| is_refused(share_as_far(&held, off), 0.015, false);
        assert!(is_refused(264.0) && is_refused(263.5) && is_refused(300.0));
        assert!(!is_refused(263.0) && !is_refused(262.5) && !is_refused(0.0));
    }
}
