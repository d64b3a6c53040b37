//! The single change that would make a refused scene agree.

use crate::align::Orientation;
use crate::decision::decide::{Decision, How, decide};
use crate::decision::film::{Film, Image, Rendered, add, turned};
use crate::decision::recording::Recording;
use crate::decision::template::Hiding;
use crate::numbers::{count, index, median, single, whole};
use glam::DVec3;
use grideye_draw::text::fixed;
use grideye_frame::{COLUMNS, PIXELS, ROWS};
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
    Later(f64),
    Turned(Orientation),
    Contrast(f64),
    /// The sensor, in x and y, meters.
    Moved([f64; 2]),
    Sensor(String),
}

/// Longest delay that is tried, seconds.
const DELAY_MAX_S: f64 = 10.0;
/// Farthest that the sensor is moved each way, and the steps, meters.
const MOVE_MAX_M: f64 = 1.5;
const MOVE_STEP_M: f64 = 0.25;
/// Changes that are judged, those that explain most first.
const JUDGED: usize = 2;
/// How much more of the recording than the scene a change must explain to be judged.
const CLEARLY: f64 = 1.15;

/// The change that would agree, as a sentence with its command; `None` if none does. What was rendered is left for the next.
pub(crate) fn remedy(
    compared: &Compared<'_>,
    mut film: Film,
    rendered: &mut Rendered,
    decision: &Decision,
) -> Result<Option<String>, SceneError> {
    let hiding = Hiding::new(&compared.recording.unit);
    let pictures = &compared.recording.pictures;
    let explained =
        |film: &Film, pictures: &[Image]| explained(&hiding, film, &film.claimed(), pictures);
    let own = explained(&film, pictures);
    let mut changes = Vec::new();
    for orientation in Orientation::ALL.into_iter().skip(1) {
        let back = turned(pictures, orientation.inverse());
        changes.push((explained(&film, &back), Change::Turned(orientation)));
    }
    if film.has_movement() {
        changes.push(delay(compared, &hiding)?);
    }
    if !film.people.is_empty() {
        changes.push(moved(&mut film, &hiding, pictures));
    }
    for sensor in compared.scene.sensors() {
        let is_other =
            sensor.name != compared.sensor && (sensor.columns, sensor.rows) == (COLUMNS, ROWS);
        if is_other {
            let film = compared.film(Rendered::default(), compared.scene, &sensor.name, 0.0)?;
            changes.push((
                explained(&film, pictures),
                Change::Sensor(sensor.name.clone()),
            ));
        }
    }
    changes.retain(|(explained, _)| *explained > CLEARLY * own);
    changes.sort_by(|a, b| b.0.total_cmp(&a.0));
    // What explains clearly more than the scene at any contrast comes before another contrast.
    let off = decision.off_contrast().filter(|off| off.found > 0.0);
    changes.extend(off.map(|off| (own, Change::Contrast(off.found))));
    *rendered = film.into_rendered();
    for (_, change) in changes.iter().take(JUDGED) {
        if compared.agrees_with(change, rendered)? {
            return Ok(Some(compared.in_words(change)));
        }
    }
    Ok(None)
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
        let own = |rendered: &mut Rendered, later_s| {
            self.film(std::mem::take(rendered), scene, sensor, later_s)
        };
        let other =
            |scene: &Scene, sensor: &str| self.film(Rendered::default(), scene, sensor, 0.0);
        let mut film = match change {
            Change::Later(by_s) => own(rendered, *by_s)?,
            Change::Turned(_) => own(rendered, 0.0)?,
            Change::Contrast(times) => other(scene, sensor)?.warmer(single(*times)),
            Change::Moved(by_m) => other(&with_moved(scene, sensor, *by_m), sensor)?,
            Change::Sensor(name) => other(scene, name)?,
        };
        let back;
        let recording = match change {
            Change::Turned(orientation) => {
                back = self.recording.turned(orientation.inverse());
                &back
            }
            _ => self.recording,
        };
        let decision = decide(&mut film, recording, self.laws, self.how);
        if matches!(change, Change::Later(_) | Change::Turned(_)) {
            *rendered = film.into_rendered();
        }
        // Stopped, nobody asks.
        Ok(decision.is_some_and(|decision| decision.is_agreed(self.how.right_min)))
    }

    fn in_words(&self, change: &Change) -> String {
        match change {
            Change::Later(by_s) => {
                let start_s = self.start_s - by_s;
                let by = fixed(by_s.abs(), 2);
                let word = if *by_s < 0.0 { "earlier" } else { "later" };
                format!("The scene {by} s {word} would agree: --start {start_s:.2}.")
            }
            Change::Turned(orientation) => {
                format!(
                    "The image is {orientation}; turned back it would agree: --align orientation."
                )
            }
            Change::Contrast(times) => format!(
                "{} times the scene's contrast would agree: change temperature_c, or person.clothing.",
                fixed(*times, 1)
            ),
            Change::Moved(by_m) => {
                let [x, y] = by_m.map(|by_m| fixed(by_m, 2));
                let moved = with_moved(self.scene, self.sensor, *by_m);
                let sensor = moved.sensor(self.sensor).ok();
                let [x_mm, y_mm, z_mm] = sensor
                    .map(|sensor| sensor.pose.position_m.to_array())
                    .unwrap_or_default()
                    .map(|m| 1e3 * m);
                format!(
                    "The sensor {x} m further in x and {y} m in y would agree: position_mm = [{x_mm:.0}, {y_mm:.0}, {z_mm:.0}]."
                )
            }
            Change::Sensor(name) => {
                format!("As seen by sensor `{name}` it would agree: --sensor {name}.")
            }
        }
    }
}

/// How much of a recording the subject explains, at its best contrast, in squared standard deviations.
fn explained(hiding: &Hiding, film: &Film, subject: &[Image], pictures: &[Image]) -> f64 {
    let template = hiding.template(subject);
    let product = template.product(pictures) - template.product(&film.room);
    product.max(0.0).powi(2) / template.square.max(1.0)
}

/// The delay that explains most.
fn delay(compared: &Compared<'_>, hiding: &Hiding) -> Result<(f64, Change), SceneError> {
    let Recording {
        times_s,
        pictures,
        within_s,
        ..
    } = compared.recording;
    let steps: Vec<f64> = times_s.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let step_s = median(&steps).unwrap_or(0.1).max(0.05);
    let (Some(first_s), Some(last_s)) = (times_s.first(), times_s.last()) else {
        return Ok((0.0, Change::Later(0.0)));
    };
    let most = whole(DELAY_MAX_S / step_s);
    let from_s = first_s - f64::from(most) * step_s;
    let number = whole(((last_s - first_s) / step_s).round()) + 2 * most + 1;
    let all_s: Vec<f64> = (0..number)
        .map(|index| from_s + f64::from(index) * step_s)
        .collect();
    let long = Film::new(compared.scene, compared.sensor, &all_s, *within_s)?;
    let claimed = long.claimed();
    let explained_at = |late: i32| {
        let sources = times_s.iter().map(|time_s| {
            let place = whole(((time_s - from_s) / step_s).round()) - late;
            index(f64::from(place.clamp(0, number - 1)))
        });
        let (subject, room): (Vec<Image>, Vec<Image>) = sources
            .map(|source| (claimed[source], long.room[source]))
            .unzip();
        let template = hiding.template(&subject);
        let product = template.product(pictures) - template.product(&room);
        product.max(0.0).powi(2) / template.square.max(1.0)
    };
    let all: Vec<f64> = (-most..=most).map(explained_at).collect();
    let best = (1..all.len().saturating_sub(1)).max_by(|a, b| all[*a].total_cmp(&all[*b]));
    let Some(best) = best else {
        return Ok((0.0, Change::Later(0.0)));
    };
    let (before, here, after) = (all[best - 1], all[best], all[best + 1]);
    let curve = before - 2.0 * here + after;
    let aside = if curve < 0.0 {
        (0.5 * (before - after) / curve).clamp(-0.5, 0.5)
    } else {
        0.0
    };
    let late_s = step_s * (count(best) - f64::from(most) + aside);
    Ok((here, Change::Later(late_s)))
}

/// The place of the sensor that explains most, as if all people were moved the other way.
fn moved(film: &mut Film, hiding: &Hiding, pictures: &[Image]) -> (f64, Change) {
    let at = |film: &mut Film, by_m: [f64; 2]| {
        let mut subject = vec![[0.0; PIXELS]; film.len()];
        for walker in &mut film.people {
            for (index, subject) in subject.iter_mut().enumerate() {
                add(subject, &walker.aside(index, by_m.map(|by_m| -by_m)), 1.0);
            }
        }
        explained(hiding, film, &subject, pictures)
    };
    let mut best = (0.0, [0.0; 2]);
    let mut around = |film: &mut Film, middle_m: [f64; 2], most_m: f64, step_m: f64| {
        let steps = whole((most_m / step_m).round());
        for x in -steps..=steps {
            for y in -steps..=steps {
                let by_m = [
                    middle_m[0] + step_m * f64::from(x),
                    middle_m[1] + step_m * f64::from(y),
                ];
                let explained = at(film, by_m);
                if explained > best.0 {
                    best = (explained, by_m);
                }
            }
        }
        best.1
    };
    let coarse_m = around(film, [0.0; 2], MOVE_MAX_M, MOVE_STEP_M);
    let _ = around(film, coarse_m, 0.2, 0.05);
    (best.0, Change::Moved(best.1))
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
