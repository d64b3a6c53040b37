//! What change of a refused scene explains its recording best: one that would agree, else those that gain most.
//!
//! Each kind of change is tried alone and with each orientation of the image, on some of the pictures, and then others on top
//! of the best. What counts is how much less of the recording is left unexplained (`W` of [`template`]), at a contrast within
//! what people's laws leave open.
//!
//! [`template`]: crate::decision::template

use crate::align::Orientation;
use crate::decision::change::Change;
use crate::decision::constants::{
    ANYWHERE, CLEARLY, CONTRASTS, DELAY_MAX_S, DELAY_STEP_S, GAIN_MIN, JUDGED, NAMED,
};
use crate::decision::decide::{Decision, How, decide};
use crate::decision::film::{Film, Rendered};
use crate::decision::image::{Image, add, all_less, image, less, moment, turned};
use crate::decision::recording::Recording;
use crate::decision::template::{Template, Weights, centered};
use crate::numbers::{count, evenly, index, single, whole};
use glam::DMat3;
use grideye_draw::text::fixed;
use grideye_frame::PIXELS;
use grideye_scene::{Laws, Scene, SceneError, Simulator};
use std::time::Duration;

/// What was compared.
pub(crate) struct Compared<'a> {
    pub(crate) scene: &'a Scene,
    pub(crate) sensor: &'a str,
    pub(crate) recording: &'a Recording,
    pub(crate) laws: &'a Laws,
    pub(crate) how: How,
    /// The scene's time at the recording's first frame, seconds.
    pub(crate) start_s: f64,
}

/// Pictures that are looked at.
const PICTURES_MOST: usize = 40;

/// What would agree, as a sentence with its command; else what would take most of the difference away, each with its share.
/// What was rendered is left for the next.
pub(crate) fn advice(
    compared: &Compared<'_>,
    film: Film,
    rendered: &mut Rendered,
    decision: &Decision,
) -> Result<Option<String>, SceneError> {
    let search = Search::new(compared, film.has_movement());
    *rendered = film.into_rendered();
    let own = search.tried(&[], &[])?;
    let Some(unchanged) = own.iter().find(|one| one.changes.is_empty()) else {
        return Ok(None);
    };
    let left = unchanged.left;
    let singles = search.singles(&own, CLEARLY * left)?;
    let together = search.together(own)?;
    let gain = |one: &Tried| ((left - one.left) / (left - search.noise).max(1.0)).clamp(0.0, 1.0);
    // What explains clearly more than the scene at any contrast comes before another contrast.
    let off = decision.off_contrast().filter(|off| !off.is_absent());
    let off = off.map(|off| Tried {
        changes: vec![Change::Contrast(off.found)],
        left,
    });
    for one in singles.iter().chain(&off).take(JUDGED) {
        if compared.agrees_with(&one.changes, rendered)? {
            return Ok(Some(compared.in_words(&one.changes[0])));
        }
    }
    let named = |changes: &[Change], joint: &str| {
        let parts = changes.iter().map(|change| compared.named(change));
        parts.collect::<Vec<String>>().join(joint)
    };
    if let Some(all) = &together {
        if compared.agrees_with(&all.changes, rendered)? {
            let parts = named(&all.changes, ", and ");
            return Ok(Some(format!("Together would agree: {parts}.")));
        }
    }
    let gains = singles.iter().chain(&together);
    let gains = gains.filter(|one| gain(one) >= GAIN_MIN).map(|one| {
        let percent = fixed(100.0 * gain(one), 0);
        format!("{percent} % would go with {}", named(&one.changes, " and "))
    });
    let gains: Vec<String> = gains.collect();
    Ok((!gains.is_empty()).then(|| {
        format!(
            "No change of time, orientation or place alone would agree. Of what differs from the scene, {}.",
            gains.join(", ")
        )
    }))
}

/// Changes, and what they leave unexplained.
#[derive(Debug, Clone)]
struct Tried {
    changes: Vec<Change>,
    left: f64,
}

/// A scene and its recording after some changes.
struct Changed {
    scene: Scene,
    sensor: String,
    lies: Orientation,
    late_s: f64,
    /// How many times the contrast.
    times: f64,
    missing: Option<usize>,
}

/// What a changed scene shows: its subjects, and the room.
struct Shown {
    subject: Vec<Image>,
    room: Vec<Image>,
}

/// How much of a recording changed scenes leave unexplained.
struct Search<'a> {
    compared: &'a Compared<'a>,
    weights: Weights,
    times_s: Vec<f64>,
    /// The pictures that are looked at, turned back from each orientation.
    pictures: [(Orientation, Vec<Image>); 8],
    /// What noise leaves.
    noise: f64,
    has_movement: bool,
}

impl<'a> Search<'a> {
    fn new(compared: &'a Compared<'a>, has_movement: bool) -> Self {
        let recording = compared.recording;
        let chosen = evenly(recording.pictures.len(), PICTURES_MOST).into_iter();
        let chosen: Vec<(f64, Image)> = chosen
            .map(|at| (recording.times_s[at], recording.pictures[at]))
            .collect();
        let (times_s, pictures): (Vec<f64>, Vec<Image>) = chosen.into_iter().unzip();
        Self {
            compared,
            weights: Weights::new(&recording.unit),
            noise: count(times_s.len()) * count(PIXELS - 1),
            times_s,
            pictures: Orientation::ALL.map(|from| (from, turned(&pictures, from.inverse()))),
            has_movement,
        }
    }

    /// What the scene shows after these changes at some times.
    fn shown(&self, changes: &[Change], times_s: &[f64]) -> Result<Shown, SceneError> {
        let changed = self.compared.changed(changes);
        let empty = changed.scene.without_agents();
        let mut simulator = Simulator::of_outlines(&empty, &changed.sensor)?;
        let film = |simulator: &Simulator| -> Vec<Image> {
            let times = times_s.iter();
            let times = times.map(|time_s| moment(time_s - changed.late_s));
            times
                .map(|time| image(&simulator.image(time).celsius))
                .collect()
        };
        let room = match empty.is_static() {
            true => vec![image(&simulator.image(Duration::ZERO).celsius); times_s.len()],
            false => film(&simulator),
        };
        if changed.scene.agents().is_empty() {
            let nothing = vec![[0.0; PIXELS]; room.len()];
            return Ok(Shown {
                subject: room,
                room: nothing,
            });
        }
        let agents = changed.scene.agents().iter().enumerate();
        let agents = agents.filter(|(number, _)| changed.missing != Some(*number));
        let _ = simulator.replace_agents(agents.map(|(_, agent)| agent.clone()).collect());
        Ok(Shown {
            subject: all_less(&film(&simulator), &room),
            room,
        })
    }

    /// What is left of the recording that lies so; at a contrast within these.
    fn left(
        &self,
        shown: &Shown,
        template: &Template,
        lies: usize,
        within: [f64; 2],
    ) -> (f64, f64) {
        let beyond = all_less(&self.pictures[lies].1, &shown.room);
        let product = template.product(&beyond);
        let best = product / template.square.max(1e-9);
        let contrast = best.clamp(within[0], within[1]);
        let left = self.weights.square(&beyond);
        (
            left - contrast * (2.0 * product - contrast * template.square),
            contrast,
        )
    }

    /// These changes as shown, in each orientation and with any contrast unless these say how.
    fn try_all(&self, changes: &[Change], shown: &Shown, all: &mut Vec<Tried>) {
        let template = self.weights.template(&shown.subject);
        let lies = changes.iter().find_map(|change| match change {
            Change::Turned(lies) => Some(*lies),
            _ => None,
        });
        let has_contrast = changes.iter().any(|one| matches!(one, Change::Contrast(_)));
        for (place, (from, _)) in self.pictures.iter().enumerate() {
            if lies.is_some_and(|lies| lies != *from) {
                continue;
            }
            let mut changes = changes.to_vec();
            if lies.is_none() && *from != Orientation::Upright {
                changes.push(Change::Turned(*from));
            }
            let within = match has_contrast {
                true => [0.0, f64::INFINITY],
                false => CONTRASTS,
            };
            let (left, _) = self.left(shown, &template, place, within);
            if !has_contrast {
                let (left, contrast) = self.left(shown, &template, place, [0.05, f64::INFINITY]);
                let mut changes = changes.clone();
                changes.push(Change::Contrast(contrast));
                all.push(Tried { changes, left });
            }
            all.push(Tried { changes, left });
        }
    }

    /// Every change on top of these, but of the kinds that are done.
    fn tried(&self, base: &[Change], done: &[Change]) -> Result<Vec<Tried>, SceneError> {
        let Compared { scene, sensor, .. } = self.compared;
        let mut all = Vec::new();
        let is_done = |one: &Change| base.iter().chain(done).any(|done| done.is_like(one));
        self.try_all(base, &self.shown(base, &self.times_s)?, &mut all);
        if self.has_movement && !is_done(&Change::Late(0.0)) {
            self.try_delays(base, &mut all)?;
        }
        let ladder = Change::ladder(scene, sensor).into_iter();
        for change in ladder.filter(|change| !is_done(change)) {
            let mut changes = base.to_vec();
            changes.push(change);
            let shown = self.shown(&changes, &self.times_s)?;
            self.try_all(&changes, &shown, &mut all);
        }
        if base.is_empty() {
            all.extend(self.with_one_more()?);
        }
        Ok(all)
    }

    fn try_delays(&self, base: &[Change], all: &mut Vec<Tried>) -> Result<(), SceneError> {
        let (Some(first_s), Some(last_s)) = (self.times_s.first(), self.times_s.last()) else {
            return Ok(());
        };
        let from_s = first_s - DELAY_MAX_S;
        let number = whole((last_s + DELAY_MAX_S - from_s) / DELAY_STEP_S) + 1;
        let times_s = (0..=number).map(|step| from_s + DELAY_STEP_S * f64::from(step));
        let film = self.shown(base, &times_s.collect::<Vec<f64>>())?;
        let most = whole(DELAY_MAX_S / DELAY_STEP_S);
        for late in (-most..=most).filter(|late| *late != 0) {
            let late_s = DELAY_STEP_S * f64::from(late);
            let at = |time_s: &f64| index(((time_s - late_s - from_s) / DELAY_STEP_S).round());
            let of = |film: &[Image]| self.times_s.iter().map(|time_s| film[at(time_s)]).collect();
            let shown = Shown {
                subject: of(&film.subject),
                room: of(&film.room),
            };
            let mut changes = base.to_vec();
            changes.push(Change::Late(late_s));
            self.try_all(&changes, &shown, all);
        }
        Ok(())
    }

    /// Somebody more, wherever each picture shows most of them.
    fn with_one_more(&self) -> Result<Option<Tried>, SceneError> {
        const APART_M: f64 = 0.4;
        const STEPS: i32 = 7;
        let Compared { scene, sensor, .. } = self.compared;
        let (Some(agent), Ok(own)) = (scene.agents().first(), scene.sensor(sensor)) else {
            return Ok(None);
        };
        let shown = self.shown(&[], &self.times_s)?;
        let (left, contrast) = {
            let template = self.weights.template(&shown.subject);
            self.left(&shown, &template, 0, CONTRASTS)
        };
        let mut rest = all_less(&self.pictures[0].1, &shown.room);
        for (rest, subject) in rest.iter_mut().zip(&shown.subject) {
            add(rest, subject, -single(contrast));
        }
        let mut simulator = Simulator::of_outlines(&scene.without_agents(), sensor)?;
        let room = image(&simulator.image(Duration::ZERO).celsius);
        let mut places = Vec::new();
        for (x, y) in (-STEPS..=STEPS).flat_map(|x| (-STEPS..=STEPS).map(move |y| (x, y))) {
            let mut place_m = own.pose.position_m;
            place_m.x += APART_M * f64::from(x);
            place_m.y += APART_M * f64::from(y);
            place_m.z = agent.start_m.z;
            let _ = simulator.replace_agents(vec![agent.standing_at(place_m, DMat3::IDENTITY)]);
            let adds = less(&image(&simulator.image(Duration::ZERO).celsius), &room);
            places.push(([place_m.x, place_m.y], self.weights.template(&[adds])));
        }
        let (mut most, mut gain) = (0.0, 0.0);
        let mut change = Change::More {
            at_s: 0.0,
            near_m: [0.0; 2],
        };
        for (at_s, rest) in self.times_s.iter().copied().zip(centered(&rest)) {
            let explained = places.iter().map(|(near_m, template)| {
                let product = template.product(&[rest]).max(0.0);
                (product * product / template.square.max(1.0), *near_m)
            });
            let best = explained.max_by(|a, b| a.0.total_cmp(&b.0));
            let (explained, near_m) = best.unwrap_or_default();
            gain += (explained - ANYWHERE).max(0.0);
            if explained > most {
                most = explained;
                change = Change::More { at_s, near_m };
            }
        }
        Ok(Some(Tried {
            changes: vec![change],
            left: left - gain,
        }))
    }

    /// The best changes of a kind alone that leave less than this, the best first.
    fn singles(&self, tried: &[Tried], most: f64) -> Result<Vec<Tried>, SceneError> {
        let mut best: Vec<Tried> = Vec::new();
        for one in tried.iter().filter(|one| one.changes.len() == 1) {
            let known = best.iter_mut();
            let known = known
                .into_iter()
                .find(|best| best.changes[0].is_like(&one.changes[0]));
            match known {
                Some(best) if one.left < best.left => best.clone_from(one),
                Some(_) => {}
                None => best.push(one.clone()),
            }
        }
        best.retain(|one| one.left < most);
        best.sort_by(|a, b| a.left.total_cmp(&b.left));
        best.truncate(NAMED);
        let nearer: Result<Vec<Tried>, _> = best.into_iter().map(|one| self.nearer(one)).collect();
        let mut nearer = nearer?;
        nearer.sort_by(|a, b| a.left.total_cmp(&b.left));
        Ok(nearer)
    }

    /// The best of several changes, each of which leaves clearly less; `None` if it is one.
    fn together(&self, tried: Vec<Tried>) -> Result<Option<Tried>, SceneError> {
        let least = |tried: Vec<Tried>| {
            let sound = tried.into_iter();
            let sound = sound.filter(|one| !matches!(one.changes[..], [Change::More { .. }]));
            sound.min_by(|a, b| a.left.total_cmp(&b.left))
        };
        let Some(mut best) = least(tried) else {
            return Ok(None);
        };
        best = self.nearer(best)?;
        if best.left > 2.0 * self.noise {
            let more = least(self.tried(&best.changes, &[])?);
            if let Some(more) = more.filter(|more| more.left < CLEARLY * best.left) {
                best = self.nearer(more)?;
            }
        }
        for change in best.changes.clone() {
            let mut without = best.changes.clone();
            without.retain(|one| *one != change);
            let left = self.left_of(&without)?;
            if best.left > CLEARLY * left {
                best = Tried {
                    changes: without,
                    left,
                };
            }
        }
        Ok((best.changes.len() > 1).then_some(best))
    }

    fn left_of(&self, changes: &[Change]) -> Result<f64, SceneError> {
        let mut all = Vec::new();
        self.try_all(changes, &self.shown(changes, &self.times_s)?, &mut all);
        let same = all.iter().find(|one| one.changes == changes);
        Ok(same.map_or(f64::INFINITY, |same| same.left))
    }

    /// The same between the steps of the coarse search.
    fn nearer(&self, mut best: Tried) -> Result<Tried, SceneError> {
        for share in [0.5, 0.25, 0.1] {
            for place in 0..best.changes.len() {
                for near in best.changes[place].near(share) {
                    let mut changes = best.changes.clone();
                    changes[place] = near;
                    let left = self.left_of(&changes)?;
                    if left < best.left {
                        best = Tried { changes, left };
                    }
                }
            }
        }
        Ok(best)
    }
}

impl Compared<'_> {
    fn changed(&self, changes: &[Change]) -> Changed {
        let mut changed = Changed {
            scene: self.scene.clone(),
            sensor: self.sensor.to_owned(),
            lies: Orientation::Upright,
            late_s: 0.0,
            times: 1.0,
            missing: None,
        };
        for change in changes {
            match change {
                Change::Turned(lies) => changed.lies = *lies,
                Change::Late(by_s) => changed.late_s = *by_s,
                Change::Contrast(times) => changed.times = *times,
                Change::Sensor(name) => changed.sensor.clone_from(name),
                Change::Missing(person) => changed.missing = Some(*person),
                Change::More { .. } => {}
                pose => changed.scene = pose.of_scene(&changed.scene, &changed.sensor),
            }
        }
        changed
    }

    /// With what was rendered of this scene and sensor.
    fn agrees_with(&self, changes: &[Change], rendered: &mut Rendered) -> Result<bool, SceneError> {
        let is_of_people = |one: &Change| matches!(one, Change::Missing(_) | Change::More { .. });
        if changes.iter().any(is_of_people) {
            // Who is there is a scene to write, not to guess.
            return Ok(false);
        }
        let changed = self.changed(changes);
        let is_own = !changes.iter().any(Change::is_of_sensor) && changed.times == 1.0;
        let before = match is_own {
            true => std::mem::take(rendered),
            false => Rendered::default(),
        };
        let recording = self.recording;
        let times_s = recording.times_s.iter();
        let times_s: Vec<f64> = times_s.map(|time_s| time_s - changed.late_s).collect();
        let of = (&changed.scene, changed.sensor.as_str());
        let mut film = Film::new(before, of, &times_s, recording.within_s)?;
        if changed.times != 1.0 {
            film = film.warmer(single(changed.times));
        }
        let back = recording.turned(changed.lies.inverse());
        let decision = decide(&mut film, &back, self.laws, self.how);
        if is_own {
            *rendered = film.into_rendered();
        }
        // Stopped, nobody asks.
        Ok(decision.is_some_and(|decision| decision.is_agreed(self.how.right_min)))
    }

    /// As a sentence.
    fn in_words(&self, change: &Change) -> String {
        let [what, how] = change.in_words(self.scene, self.sensor, self.start_s);
        match change {
            Change::Turned(turned) => {
                format!("The image is {turned}; turned back it would agree: {how}.")
            }
            Change::Contrast(_) => format!("{what} would agree: change {how}."),
            Change::Sensor(name) => format!("As seen by sensor `{name}` it would agree: {how}."),
            _ => {
                let (first, rest) = what.split_at(1);
                format!("{}{rest} would agree: {how}.", first.to_uppercase())
            }
        }
    }

    /// As part of a sentence, with its command.
    fn named(&self, change: &Change) -> String {
        let [what, how] = change.in_words(self.scene, self.sensor, self.start_s);
        format!("{what} ({how})")
    }
}
