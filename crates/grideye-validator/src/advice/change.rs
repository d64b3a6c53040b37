//! The single changes that people make of a scene or a recording: what each changes, and how it is said.

use crate::align::Orientation;
use crate::constants::{ABSENT, WITHIN_M};
use crate::decision::contrast_in_words;
use crate::decision::decide::How;
use crate::decision::recording::Recording;
use crate::decision::view::{Rendered, View};
use crate::numbers::{single, whole};
use glam::{DMat3, DVec3};
use grideye_draw::text::fixed;
use grideye_frame::{COLUMNS, ROWS as PIXEL_ROWS};
use grideye_scene::{Laws, Pose, Scene, SceneError, Sensor, Why};
use std::f64::consts::FRAC_PI_2;

/// What was compared.
pub(crate) struct Compared<'a> {
    pub(crate) scene: &'a Scene,
    pub(crate) sensor: &'a str,
    pub(crate) recording: &'a Recording,
    pub(crate) laws: &'a Laws,
    pub(crate) how: How,
    /// The scene's time at the recording's first frame, seconds.
    pub(crate) start_s: f64,
    /// How much warmer than the scene a right recording may be, °C.
    pub(crate) level_max_c: f64,
    /// How much warmer than the scene the recording is, °C.
    pub(crate) level_c: f64,
    /// How many times the scene's contrast each subject has.
    pub(crate) contrasts: Vec<f64>,
    /// Orientations in which the scene looks the same.
    pub(crate) same: Vec<Orientation>,
}

/// What is changed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Kind {
    None,
    /// The unit of the recording's values.
    Unit,
    /// The time between its frames.
    Rate,
    /// When it begins.
    Late,
    /// Which of the scene's sensors it is of.
    Sensor,
    /// The sensor's place, height and direction.
    Place,
    Height,
    Azimuth,
    Tilt,
    /// The unit of the room's temperature, that temperature, and that of one object.
    Fahrenheit,
    Room,
    Object,
    /// One person's place and warmth, and whether they are there.
    Aside,
    Contrast,
    Without,
    More,
}

/// One change: which of its kind, and by how much.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Change {
    pub(crate) kind: Kind,
    pub(crate) of: usize,
    pub(crate) by: [f64; 2],
    /// How far aside the first people are within their laws, meters.
    pub(super) within_m: [[f64; 2]; WITHIN_PEOPLE],
}

/// A row of the table of changes. Of two that explain as much the first is named first.
pub(super) struct Row {
    kind: Kind,
    /// How many of what it changes there are.
    pub(super) number: fn(&Compared<'_>, &View) -> usize,
    /// What is tried first, beside no change; then steps about the best, which are halved.
    starts: fn(&Compared<'_>, usize, f64) -> Vec<[f64; 2]>,
    steps: [f64; 2],
    /// Smaller ones are usual, and no mistake.
    least: f64,
    /// What is so in the recording, and what a user does about it.
    says: fn(&Compared<'_>, &Change) -> (String, String),
}

/// Longest delay that is tried, seconds.
pub(super) const DELAY_MAX_S: f64 = 10.0;
/// People whose places are sought within their laws.
pub(super) const WITHIN_PEOPLE: usize = 2;
/// Units that values are mistaken in: a name, that of `--columns unit=`, and what makes them degrees Celsius.
const UNITS: [(&str, &str, (f32, f32)); 5] = [
    ("degrees Fahrenheit", "fahrenheit", (1.0 / 1.8, -32.0 / 1.8)),
    ("the sensor's words", "words", (0.25, 0.0)),
    ("tenths of a degree", "tenths", (0.1, 0.0)),
    ("hundredths of a degree", "hundredths", (0.01, 0.0)),
    ("kelvin", "kelvin", (1.0, -273.15)),
];
/// Objects whose temperature is asked about.
const OBJECTS_MOST: usize = 6;
/// Half a meter around, which is as far as half the way to the next person.
const AROUND: [[f64; 2]; 9] = {
    const FAR: f64 = 0.5;
    const HALF: f64 = 0.35;
    [
        [0.0, 0.0],
        [FAR, 0.0],
        [-FAR, 0.0],
        [0.0, FAR],
        [0.0, -FAR],
        [HALF, HALF],
        [-HALF, HALF],
        [HALF, -HALF],
        [-HALF, -HALF],
    ]
};

/// The table of changes.
#[rustfmt::skip]
pub(super) const ROWS: &[Row] = &[
    Row { kind: Kind::Unit, number: |_, _| UNITS.len(), starts: alone, steps: [0.0; 2], least: 0.0, says: |_, change| {
        let (name, key, _) = UNITS[change.of];
        (format!("the values are {name}"), format!("convert the original file again with `--columns unit={key}`"))
    } },
    Row { kind: Kind::Rate, number: of_walkers, starts: |_, _, _| [0.1, 0.5, 2.0, 10.0].map(|times| [times, 0.0]).into(), steps: [0.0; 2], least: 0.0, says: |compared, change| {
        let (times, hz) = (fixed(1.0 / change.by[0], 1), fixed(compared.recording.hz() / change.by[0], 1));
        (format!("the frames came {times} times as fast as their times say"), format!("convert the original file again with `--columns time=none --rate {hz}`"))
    } },
    Row { kind: Kind::Late, number: of_walkers, starts: delays, steps: [0.1, 0.0], least: 0.2, says: |compared, change| {
        // To a hundredth, and no negative zero.
        let start_s = (100.0 * (compared.start_s - change.by[0])).round() / 100.0 + 0.0;
        let (by, word) = signed(change.by[0], 2, ["later", "earlier"]);
        (format!("everything happens {by} s {word} than in the scene"), format!("compare with `--start {start_s:.2}`"))
    } },
    Row { kind: Kind::Sensor, number: |compared, _| others(compared.scene, compared.sensor).count(), starts: alone, steps: [0.0; 2], least: 0.0, says: |compared, change| {
        let name = others(compared.scene, compared.sensor).nth(change.of).map_or("", |sensor| &sensor.name);
        (format!("the recording is of sensor `{name}`"), format!("compare with `--sensor {name}`"))
    } },
    Row { kind: Kind::Aside, number: |_, view| view.people.len(), starts: |_, _, _| AROUND.into(), steps: [0.25; 2], least: 0.2, says: |compared, change| {
        (format!("`{}` {}", compared.person(change.of), change.along()), compared.place_of(change))
    } },
    Row { kind: Kind::Place, number: once, starts: |_, _, _| AROUND.into(), steps: [0.25; 2], least: 0.2, says: |compared, change| {
        (format!("the sensor {}", change.along()), compared.pose_of(change))
    } },
    Row { kind: Kind::Height, number: once, starts: |_, _, _| [-0.8, 0.0, 0.8].map(|up_m| [up_m, 0.0]).into(), steps: [0.3, 0.0], least: 0.1, says: |compared, change| {
        let (by, word) = signed(change.by[0], 2, ["higher", "lower"]);
        (format!("the sensor is {by} m {word}"), compared.pose_of(change))
    } },
    Row { kind: Kind::Azimuth, number: once, starts: alone, steps: [12.0, 0.0], least: 4.0, says: |compared, change| {
        (format!("the sensor is turned by {}°", fixed(change.by[0], 0)), compared.pose_of(change))
    } },
    Row { kind: Kind::Tilt, number: once, starts: alone, steps: [6.0; 2], least: 3.0, says: |compared, change| {
        (format!("the sensor is tilted by {}°", fixed(change.by[0].hypot(change.by[1]), 1)), compared.pose_of(change))
    } },
    Row { kind: Kind::Fahrenheit, number: |compared, _| usize::from((compared.fahrenheit_c() - compared.level_c).abs() <= compared.level_max_c), starts: |compared, _, _| vec![[compared.fahrenheit_c(), 0.0]], steps: [0.0; 2], least: 0.0, says: |compared, change| {
        let was = compared.scene.room().ambient_c;
        ("the scene's `ambient_c` is in degrees Fahrenheit".to_owned(), format!("set `ambient_c = {:.1}`, which is {was} °F", was + change.by[0]))
    } },
    Row { kind: Kind::Room, number: once, starts: |compared, _, _| vec![[0.0; 2], [compared.level_c, 0.0]], steps: [3.0, 0.0], least: 1.0, says: |compared, change| {
        let (by, word) = signed(change.by[0], 1, ["warmer", "colder"]);
        let ambient_c = compared.scene.room().ambient_c + change.by[0];
        (format!("the room is {by} °C {word}"), format!("set `ambient_c = {ambient_c:.1}`"))
    } },
    Row { kind: Kind::Object, number: |compared, _| compared.scene.objects().len().min(OBJECTS_MOST), starts: in_view, steps: [4.0, 0.0], least: 1.5, says: |compared, change| {
        let object = &compared.scene.objects()[change.of];
        let (by, word) = signed(change.by[0], 1, ["warmer", "colder"]);
        let celsius = object.surface.celsius + change.by[0];
        (format!("`{}` is {by} °C {word}", object.name), format!("set `temperature_c = {celsius:.1}` of `{}`", object.name))
    } },
    Row { kind: Kind::Contrast, number: |compared, _| compared.contrasts.len(), starts: |compared, of, _| contrast(compared, of), steps: [0.0; 2], least: 0.0, says: |compared, change| {
        let name = compared.scene.agents().get(change.of).map(|agent| agent.name.as_str());
        (contrast_in_words(name, change.by[0]), "change `temperature_c` or `person.clothing`".to_owned())
    } },
    Row { kind: Kind::Without, number: |_, view| view.people.len(), starts: alone, steps: [0.0; 2], least: 0.0, says: |compared, change| {
        let name = compared.person(change.of);
        (format!("`{name}` was not there"), format!("remove `{name}` from the scene, or say when they are there"))
    } },
    Row { kind: Kind::More, number: |compared, view| usize::from(!view.people.is_empty() && !(0..compared.contrasts.len()).any(|of| compared.is_absent(of))), starts: alone, steps: [0.0; 2], least: 0.0, says: |_, change| {
        let [x, y] = change.by.map(|m| fixed(1e3 * m, 0));
        (format!("one more person was there, longest near [{x}, {y}] mm"), "add an `[[agent]]` there".to_owned())
    } },
];

fn alone(_: &Compared<'_>, _: usize, _: f64) -> Vec<[f64; 2]> {
    vec![[0.0; 2]]
}

fn once(_: &Compared<'_>, _: &View) -> usize {
    1
}

fn of_walkers(_: &Compared<'_>, view: &View) -> usize {
    usize::from(view.has_movement())
}

fn delays(_: &Compared<'_>, _: usize, step_s: f64) -> Vec<[f64; 2]> {
    let most = whole(DELAY_MAX_S / step_s);
    (-most..=most)
        .map(|late| [f64::from(late) * step_s, 0.0])
        .collect()
}

/// What is not there is not dressed otherwise.
fn contrast(compared: &Compared<'_>, of: usize) -> Vec<[f64; 2]> {
    let found = compared
        .contrasts
        .get(of)
        .filter(|_| !compared.is_absent(of));
    found.map(|found| [*found, 0.0]).into_iter().collect()
}

/// No frame shows how warm an object out of view is.
fn in_view(compared: &Compared<'_>, of: usize, _: f64) -> Vec<[f64; 2]> {
    let name = &compared.scene.objects()[of].name;
    let unseen = compared
        .scene
        .unseen_while(Some(compared.sensor), &|| false);
    let mut unseen = unseen.iter().filter(|one| one.why == Why::HeatOutOfView);
    match unseen.any(|one| one.name == *name) {
        true => Vec::new(),
        false => vec![[0.0; 2]],
    }
}

/// A size, and the word for its sign.
fn signed(by: f64, digits: usize, words: [&'static str; 2]) -> (String, &'static str) {
    (fixed(by.abs(), digits), words[usize::from(by < 0.0)])
}

impl Row {
    pub(super) fn of(kind: Kind) -> Option<&'static Self> {
        ROWS.iter().find(|row| row.kind == kind)
    }

    /// What is searched of it, with steps.
    pub(super) fn axes(&self) -> Vec<(usize, f64)> {
        let all = self.steps.into_iter().enumerate();
        all.filter(|(_, step)| *step > 0.0).collect()
    }

    /// Whether it asks who is there.
    pub(super) fn counts_people(&self) -> bool {
        matches!(self.kind, Kind::Without | Kind::More)
    }

    pub(super) fn changes(&self, compared: &Compared<'_>, of: usize, step_s: f64) -> Vec<Change> {
        let starts = (self.starts)(compared, of, step_s).into_iter();
        starts
            .map(|by| Change {
                kind: self.kind,
                of,
                by,
                ..Change::NONE
            })
            .collect()
    }
}

impl Change {
    pub(crate) const NONE: Self = Self {
        kind: Kind::None,
        of: 0,
        by: [0.0; 2],
        within_m: [[0.0; 2]; WITHIN_PEOPLE],
    };

    pub(super) fn further(mut self, axis: usize, by: f64) -> Self {
        match axis {
            0 | 1 => self.by[axis] += by,
            more => {
                let within_m = &mut self.within_m[more / 2 - 1][more % 2];
                *within_m = (*within_m + by).clamp(-WITHIN_M, WITHIN_M);
            }
        }
        self
    }

    pub(super) fn is_usual(&self) -> bool {
        let least = Row::of(self.kind).map_or(0.0, |row| row.least);
        self.by[0].hypot(self.by[1]) < least
    }

    /// Its place in the table, no change last.
    pub(super) fn order(&self) -> usize {
        ROWS.iter()
            .position(|row| row.kind == self.kind)
            .unwrap_or(ROWS.len())
    }

    pub(super) fn says(&self, compared: &Compared<'_>) -> (String, String) {
        Row::of(self.kind).map_or_else(Default::default, |row| (row.says)(compared, self))
    }

    fn is(&self, kind: Kind) -> Option<[f64; 2]> {
        (self.kind == kind).then_some(self.by)
    }

    /// What makes values degrees Celsius: a factor, and what is added.
    pub(super) fn unit(&self) -> (f32, f32) {
        self.is(Kind::Unit).map_or((1.0, 0.0), |_| UNITS[self.of].2)
    }

    pub(super) fn rate(&self) -> f64 {
        self.is(Kind::Rate).map_or(1.0, |by| by[0])
    }

    pub(super) fn late_s(&self) -> f64 {
        self.is(Kind::Late).map_or(0.0, |by| by[0])
    }

    pub(super) fn aside_of(&self, person: usize) -> [f64; 2] {
        let aside_m = self.is(Kind::Aside).filter(|_| self.of == person);
        let within_m = self.within_m.get(person).copied().unwrap_or_default();
        let aside_m = aside_m.unwrap_or_default();
        [aside_m[0] + within_m[0], aside_m[1] + within_m[1]]
    }

    /// How many times a person's contrast.
    pub(super) fn contrast_of(&self, person: usize) -> f32 {
        match self.kind {
            Kind::Contrast if self.of == person => single(self.by[0]),
            Kind::Without if self.of == person => 0.0,
            _ => 1.0,
        }
    }

    /// Whether the scene is rendered as it is: only people, time and values change.
    pub(super) fn is_of_people(&self) -> bool {
        matches!(
            self.kind,
            Kind::None
                | Kind::Unit
                | Kind::Late
                | Kind::Aside
                | Kind::Contrast
                | Kind::Without
                | Kind::More
        )
    }

    fn along(&self) -> String {
        let [x, y] = self.by.map(|by_m| fixed(by_m, 2));
        format!("is off by {x} m in x and {y} m in y")
    }

    /// The sensor's pose.
    fn pose(&self, mut pose: Pose) -> Pose {
        let [x, y] = self.by;
        match self.kind {
            Kind::Place => pose.position_m += DVec3::new(x, y, 0.0),
            Kind::Height => pose.position_m.z += x,
            Kind::Azimuth => pose = pose.turned(x),
            Kind::Tilt => pose = pose.tilted(x, y),
            _ => {}
        }
        pose
    }

    /// The scene and the sensor that it makes; `None` if there is none such.
    pub(crate) fn applied(&self, scene: &Scene, sensor: &str) -> Option<(Scene, String)> {
        let changed = match self.kind {
            Kind::Sensor => {
                let name = others(scene, sensor).nth(self.of)?.name.clone();
                return Some((scene.clone(), name));
            }
            Kind::Place | Kind::Height | Kind::Azimuth | Kind::Tilt => {
                let mut sensors = scene.sensors().to_vec();
                let own = sensors.iter_mut().find(|one| one.name == sensor)?;
                own.pose = self.pose(own.pose);
                let room = scene.room();
                if !(0.0..=room.size_m.z).contains(&own.pose.position_m.z) {
                    return None;
                }
                scene.with_sensors(sensors)
            }
            Kind::Fahrenheit | Kind::Room => scene.in_warmer_room(self.by[0]),
            Kind::Object => {
                let mut objects = scene.objects().to_vec();
                objects.get_mut(self.of)?.surface.celsius += self.by[0];
                scene.with_bodies(objects, scene.agents().to_vec())
            }
            Kind::Without => {
                let mut agents = scene.agents().to_vec();
                let _ = agents.remove(self.of);
                scene.with_bodies(scene.objects().to_vec(), agents)
            }
            Kind::More => {
                let mut agents = scene.agents().to_vec();
                let (first, [x, y]) = (agents.first()?, self.by);
                let place_m = DVec3::new(x, y, first.start_m.z);
                let mut more = first.standing_at(place_m, DMat3::IDENTITY);
                "one more".clone_into(&mut more.name);
                agents.push(more);
                scene.with_bodies(scene.objects().to_vec(), agents)
            }
            _ => scene.clone(),
        };
        Some((changed, sensor.to_owned()))
    }

    /// The recording and the scene's view that it makes, to be judged; `None` if there are none such.
    pub(super) fn made(
        &self,
        compared: &Compared<'_>,
        turned: Orientation,
    ) -> Result<Option<(Recording, View, Scene)>, SceneError> {
        let Some((scene, sensor)) = self.applied(compared.scene, compared.sensor) else {
            return Ok(None);
        };
        let mut recording = compared
            .recording
            .turned(turned.inverse())
            .converted(self.unit());
        let first_s = recording.times_s.first().copied().unwrap_or_default();
        for time_s in &mut recording.times_s {
            *time_s = first_s + self.rate() * (*time_s - first_s) - self.late_s();
        }
        recording.within_s *= self.rate();
        let (of, within_s) = ((&scene, sensor.as_str()), recording.within_s);
        let mut view = View::after(Rendered::default(), of, &recording.times_s, within_s)?;
        if self.kind == Kind::Aside {
            view.moved(self.of, self.by);
        }
        if self.kind == Kind::Contrast {
            view = view.warmer(self.of, single(self.by[0]));
        }
        Ok(Some((recording, view, scene)))
    }
}

/// Other sensors of the scene that it could be of.
fn others<'s>(scene: &'s Scene, sensor: &str) -> impl Iterator<Item = &'s Sensor> {
    let all = scene.sensors().iter();
    all.filter(move |one| one.name != sensor && (one.columns, one.rows) == (COLUMNS, PIXEL_ROWS))
}

impl Compared<'_> {
    /// How much warmer the room is than the scene's if that is in degrees Fahrenheit, °C.
    fn fahrenheit_c(&self) -> f64 {
        let was = self.scene.room().ambient_c;
        (was - 32.0) / 1.8 - was
    }

    /// Whether nothing is as warm where the scene has this subject.
    pub(super) fn is_absent(&self, of: usize) -> bool {
        self.contrasts.get(of).is_some_and(|found| *found < ABSENT)
    }

    /// Whether it is no other image to this sensor. Of a scene that looks the same mirrored, any mirror image is a turned one,
    /// and those are how sensors are mounted.
    pub(super) fn looks_the_same(&self, turned: Orientation) -> bool {
        let has_mirror = self.same.iter().any(|same| same.is_mirrored());
        self.same.contains(&turned) || turned.is_mirrored() && has_mirror
    }

    /// The azimuth of a sensor that looks straight down with which the scene's image lies like this.
    pub(super) fn azimuth_of(&self, turned: Orientation) -> Option<f64> {
        const STRAIGHT_RAD: f64 = 0.02;
        let by_deg = match turned {
            Orientation::QuarterClockwise => 90.0,
            Orientation::Half => 180.0,
            Orientation::QuarterCounterclockwise => -90.0,
            _ => return None,
        };
        let pose = self.scene.sensor(self.sensor).ok()?.pose;
        let is_down = (pose.elevation_rad - FRAC_PI_2).abs() < STRAIGHT_RAD;
        let azimuth_deg = (pose.azimuth_rad.to_degrees() + by_deg).round();
        is_down.then_some(180.0 - (180.0 - azimuth_deg).rem_euclid(360.0))
    }

    fn person(&self, number: usize) -> &str {
        self.scene
            .agents()
            .get(number)
            .map_or("", |agent| &agent.name)
    }

    /// The changed place of a person.
    fn place_of(&self, change: &Change) -> String {
        let Some(agent) = self.scene.agents().get(change.of) else {
            return String::new();
        };
        if agent.trajectory.is_some() {
            return format!("move the trajectory of `{}` by that much", agent.name);
        }
        let place_m = agent.start_m + DVec3::new(change.by[0], change.by[1], 0.0);
        let [x, y, z] = (1e3 * place_m).to_array();
        format!(
            "set `position_mm = [{x:.0}, {y:.0}, {z:.0}]` of `{}`",
            agent.name
        )
    }

    /// The changed keys of the sensor's pose.
    fn pose_of(&self, change: &Change) -> String {
        let Ok(sensor) = self.scene.sensor(self.sensor) else {
            return String::new();
        };
        let pose = change.pose(sensor.pose);
        let [x, y, z] = (1e3 * pose.position_m).to_array();
        let degrees = [pose.elevation_rad, pose.azimuth_rad, pose.roll_rad].map(f64::to_degrees);
        let keys = match change.kind {
            Kind::Azimuth => format!("azimuth_deg = {:.0}", degrees[1]),
            Kind::Tilt => {
                let [elevation, azimuth, roll] = degrees;
                format!(
                    "elevation_deg = {elevation:.1}, azimuth_deg = {azimuth:.1}, roll_deg = {roll:.1}"
                )
            }
            _ => format!("position_mm = [{x:.0}, {y:.0}, {z:.0}]"),
        };
        format!("set `{keys}` of the sensor")
    }
}
