//! What would make a refused scene agree, and else what would bring it nearer.

use crate::align::Orientation;
use crate::decision::decide::{Decision, How, decide};
use crate::decision::film::{Film, Rendered};
use crate::decision::recording::Recording;
use crate::decision::search::{Changed, Search};
use crate::numbers::single;
use glam::DVec3;
use grideye_draw::text::fixed;
use grideye_frame::{COLUMNS, ROWS};
use grideye_scene::{Laws, Scene, SceneError};

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

enum Change {
    Of(Changed),
    Contrast(f64),
    Sensor(String),
}

/// Changes that are judged, those that explain most first.
const JUDGED: usize = 2;
/// How much more of the recording than the scene a change must explain to be judged, or to be part of one.
const CLEARLY: f64 = 1.15;
/// Changes that are named although none agrees, and the least share of the difference that each takes away.
const NAMED: usize = 3;
const GAIN_MIN: f64 = 0.1;

/// What would agree, as a sentence with its command; else what would take most of the difference away, each with its share.
/// What was rendered is left for the next.
pub(crate) fn remedy(
    compared: &Compared<'_>,
    film: Film,
    rendered: &mut Rendered,
    decision: &Decision,
) -> Result<Option<String>, SceneError> {
    let of = (compared.scene, compared.sensor);
    let mut search = Search::new(of, compared.recording, film)?;
    let own = search.explained(Changed::NONE);
    let tried = search.tried();
    let mut changes: Vec<(f64, Change)> = search
        .singles(&tried)
        .into_iter()
        .map(|(explained, changed)| (explained, Change::Of(changed)))
        .collect();
    for sensor in compared.scene.sensors() {
        let is_other =
            sensor.name != compared.sensor && (sensor.columns, sensor.rows) == (COLUMNS, ROWS);
        if is_other {
            let explained = search.explained_by(compared.scene, &sensor.name)?;
            changes.push((explained, Change::Sensor(sensor.name.clone())));
        }
    }
    changes.retain(|(explained, _)| *explained > CLEARLY * own);
    changes.sort_by(|a, b| b.0.total_cmp(&a.0));
    let together = search.together(&tried, CLEARLY);
    let left = search.left(own);
    let gain = |explained: f64| ((explained - own) / left).clamp(0.0, 1.0);
    // What explains clearly more than the scene at any contrast comes before another contrast.
    let off = decision.off_contrast().filter(|off| !off.is_absent());
    let off = off.map(|off| (own, Change::Contrast(off.found)));
    let all = together.map(|(explained, changed)| (gain(explained), changed));
    *rendered = search.into_rendered();
    for (_, change) in changes.iter().chain(&off).take(JUDGED) {
        if compared.agrees_with(change, rendered)? {
            return Ok(Some(compared.in_words(change)));
        }
    }
    if let Some((_, changed)) = all {
        if compared.agrees_with(&Change::Of(changed), rendered)? {
            let parts = changed
                .parts()
                .map(|part| compared.named(&Change::Of(part)));
            let parts: Vec<String> = parts.collect();
            return Ok(Some(format!(
                "Together would agree: {}.",
                parts.join(", and ")
            )));
        }
    }
    let gains = changes
        .iter()
        .map(|(explained, change)| (gain(*explained), change));
    Ok(compared.gains(gains, all))
}

impl Compared<'_> {
    fn film(
        &self,
        before: Rendered,
        scene: &Scene,
        sensor: &str,
        later_s: f64,
    ) -> Result<Film, SceneError> {
        let times_s = self.recording.times_s.iter();
        let times_s: Vec<f64> = times_s.map(|time_s| time_s - later_s).collect();
        Film::after(before, (scene, sensor), &times_s, self.recording.within_s)
    }

    /// With what was rendered of this scene and sensor.
    fn agrees_with(&self, change: &Change, rendered: &mut Rendered) -> Result<bool, SceneError> {
        let (scene, sensor) = (self.scene, self.sensor);
        let other =
            |scene: &Scene, sensor: &str| self.film(Rendered::default(), scene, sensor, 0.0);
        let mut is_own = false;
        let mut turned = Orientation::Upright;
        let mut film = match change {
            Change::Of(changed) => {
                turned = changed.turned;
                is_own = changed.moved_m == [0.0; 2];
                let before = match is_own {
                    true => std::mem::take(rendered),
                    false => Rendered::default(),
                };
                let moved = (!is_own).then(|| with_moved(scene, sensor, changed.moved_m));
                self.film(
                    before,
                    moved.as_ref().unwrap_or(scene),
                    sensor,
                    changed.late_s,
                )?
            }
            Change::Contrast(times) => other(scene, sensor)?.warmer(single(*times)),
            Change::Sensor(name) => other(scene, name)?,
        };
        let back = self.recording.turned(turned.inverse());
        let decision = decide(&mut film, &back, self.laws, self.how);
        if is_own {
            *rendered = film.into_rendered();
        }
        // Stopped, nobody asks.
        Ok(decision.is_some_and(|decision| decision.is_agreed(self.how.right_min)))
    }

    fn in_words(&self, change: &Change) -> String {
        match change {
            Change::Of(changed) if changed.turned != Orientation::Upright => {
                let orientation = changed.turned;
                format!(
                    "The image is {orientation}; turned back it would agree: --align orientation."
                )
            }
            Change::Contrast(times) => format!(
                "{} times the scene's contrast would agree: change temperature_c, or person.clothing.",
                fixed(*times, 1)
            ),
            Change::Sensor(name) => {
                format!("As seen by sensor `{name}` it would agree: --sensor {name}.")
            }
            Change::Of(_) => {
                let (what, how) = self.what_and_how(change);
                let (first, rest) = what.split_at(1);
                format!("{}{rest} would agree: {how}.", first.to_uppercase())
            }
        }
    }

    /// As part of a sentence, with its command.
    fn named(&self, change: &Change) -> String {
        let (what, how) = self.what_and_how(change);
        format!("{what} ({how})")
    }

    /// Of a single change.
    fn what_and_how(&self, change: &Change) -> (String, String) {
        match change {
            Change::Contrast(times) => {
                let what = format!("{} times the scene's contrast", fixed(*times, 1));
                (what, "temperature_c, or person.clothing".to_owned())
            }
            Change::Sensor(name) => (format!("sensor `{name}`"), format!("--sensor {name}")),
            Change::Of(Changed { turned, .. }) if *turned != Orientation::Upright => (
                format!("the image, which is {turned}, turned back"),
                "--align orientation".to_owned(),
            ),
            Change::Of(Changed { late_s, .. }) if *late_s != 0.0 => {
                // To a hundredth, and no negative zero.
                let start_s = (100.0 * (self.start_s - late_s)).round() / 100.0 + 0.0;
                let by = fixed(late_s.abs(), 2);
                let word = if *late_s < 0.0 { "earlier" } else { "later" };
                (
                    format!("the scene {by} s {word}"),
                    format!("--start {start_s:.2}"),
                )
            }
            Change::Of(Changed { moved_m, .. }) => {
                let [x, y] = moved_m.map(|by_m| fixed(by_m, 2));
                let moved = with_moved(self.scene, self.sensor, *moved_m);
                let sensor = moved.sensor(self.sensor).ok();
                let [x_mm, y_mm, z_mm] = sensor
                    .map(|sensor| sensor.pose.position_m.to_array())
                    .unwrap_or_default()
                    .map(|m| 1e3 * m);
                (
                    format!("the sensor {x} m further in x and {y} m in y"),
                    format!("position_mm = [{x_mm:.0}, {y_mm:.0}, {z_mm:.0}]"),
                )
            }
        }
    }

    /// What each change would gain although none agrees, and all together; `None` if that is little.
    fn gains<'c>(
        &self,
        changes: impl Iterator<Item = (f64, &'c Change)>,
        all: Option<(f64, Changed)>,
    ) -> Option<String> {
        let would_go = |share: f64, with: String| {
            let percent = fixed(100.0 * share, 0);
            format!("{percent} % would go with {with}")
        };
        let named = changes.filter(|(gain, _)| *gain >= GAIN_MIN).take(NAMED);
        let mut named: Vec<String> = named
            .map(|(gain, change)| would_go(gain, self.named(change)))
            .collect();
        if let Some((gain, changed)) = all.filter(|(gain, _)| *gain >= GAIN_MIN) {
            let parts = changed.parts().map(|part| self.named(&Change::Of(part)));
            let parts: Vec<String> = parts.collect();
            named.push(would_go(gain, parts.join(" and ")));
        }
        (!named.is_empty()).then(|| {
            format!(
                "No change of time, orientation or place alone would agree. Of what differs from the scene, {}.",
                named.join(", ")
            )
        })
    }
}

fn with_moved(scene: &Scene, name: &str, by_m: [f64; 2]) -> Scene {
    let sensors = scene.sensors().iter().cloned().map(|mut sensor| {
        if sensor.name == name {
            sensor.pose.position_m += DVec3::new(by_m[0], by_m[1], 0.0);
        }
        sensor
    });
    scene.with_sensors(sensors.collect())
}
