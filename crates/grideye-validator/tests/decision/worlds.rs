//! Recordings of rooms that differ from a scene as far as the scene leaves open, or otherwise; drawn by other code than the
//! validator's.
#![expect(
    clippy::unwrap_used,
    clippy::as_conversions,
    clippy::cast_possible_truncation,
    reason = "what fails in a helper fails the test; temperatures of a room fit any number"
)]

use grideye_frame::{Celsius, Reading, RecordedFrame};
use grideye_recording::{ClockState, Record, Stamp};
use grideye_scene::{Scene, Simulator};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use std::fmt::Write as _;
use std::io;
use std::time::Duration;

pub(crate) const SENSOR: &str = "ceiling";
pub(crate) const AMBIENT_C: f64 = 22.0;

/// One person in a room of 6 x 6 x 2.7 m, under a sensor.
#[derive(Clone, Copy)]
pub(crate) enum Way {
    /// On this spot, meters from the point under the sensor.
    Stands(f64, f64),
    /// Around the point under the sensor, on a curve that never repeats within a minute.
    Walks { ahead_s: f64 },
}

/// How a recording differs from the scene.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) enum Truth {
    Right,
    Nobody,
    /// The last person is not there.
    Missing,
    /// One more walks, 17 s behind.
    More,
    /// The first person is gone for the fifth of the time in which it is nearest to the middle of the view.
    Gone,
    /// The image is mirrored left to right, top to bottom, or turned by a quarter.
    MirroredX,
    MirroredY,
    Quarter,
    /// Everybody is this far aside, in a drawn direction, meters.
    Aside(f64),
    /// Everything is this much later, seconds.
    Late(f64),
    Backwards,
    /// The contrast is this many times the drawn one.
    Contrast(f64),
    /// All pixels drift by so much over the recording, °C.
    Drift(f64),
    /// Noise that is correlated by .8 from frame to frame, and from .15 to .4 °C over the pixels.
    Correlated,
}

#[derive(Clone, Copy)]
pub(crate) struct Unit {
    pub(crate) pattern_c: f64,
    pub(crate) noise_c: f64,
}

fn place(way: Way, time_s: f64) -> [f64; 2] {
    match way {
        Way::Stands(x, y) => [x, y],
        Way::Walks { ahead_s } => {
            let t = time_s + ahead_s;
            [
                0.9 * (0.61 * t).sin() + 0.3 * (0.233 * t).cos(),
                0.9 * (0.47 * t + 0.8).cos() + 0.3 * (0.31 * t).sin(),
            ]
        }
    }
}

/// The scene's text, and its trajectories by file name; each person is where `at` has it.
fn text(
    ways: &[Way],
    end_s: f64,
    at: impl Fn(usize, f64) -> [f64; 2],
) -> (String, Vec<(String, String)>) {
    let mut text = format!(
        "model = \"physical\"\ncollisions = \"ignore\"\n[room]\nsize_mm = [6000, 6000, 2700]\nambient_c = {AMBIENT_C}\n\
         [[sensor]]\nname = \"{SENSOR}\"\npreset = \"grid-eye\"\nposition_mm = [3000, 3000, 2700]\nelevation_deg = 90\nazimuth_deg = 0\n"
    );
    let mut files = Vec::new();
    for (person, way) in ways.iter().enumerate() {
        let mm = |time_s: f64| at(person, time_s).map(|m| 3000.0 + 1000.0 * m);
        let _ = writeln!(text, "[[agent]]\nname = \"p{person}\"\nperson = {{}}");
        if let Way::Stands(..) = way {
            let [x, y] = mm(0.0);
            let _ = writeln!(text, "position_mm = [{x:.1}, {y:.1}, 0]");
        } else {
            let mut rows = "t_s,x_mm,y_mm\n".to_owned();
            let mut time_s = 0.0;
            while time_s <= end_s {
                let [x, y] = mm(time_s);
                let _ = writeln!(rows, "{time_s:.2},{x:.1},{y:.1}");
                time_s += 0.1;
            }
            let _ = writeln!(text, "trajectory = \"p{person}.csv\"");
            files.push((format!("p{person}.csv"), rows));
        }
    }
    (text, files)
}

fn nearest_fifth(way: Option<Way>, frames: u32) -> u32 {
    let Some(way) = way else { return 0 };
    let far = |index: u32| {
        let [x, y] = place(way, f64::from(index) / 10.0);
        x.hypot(y)
    };
    let sum = |from: u32| (from..from + frames / 5).map(far).sum::<f64>();
    (0..frames * 4 / 5)
        .min_by(|a, b| sum(*a).total_cmp(&sum(*b)))
        .unwrap_or(0)
}

pub(crate) fn parse((text, files): &(String, Vec<(String, String)>)) -> Scene {
    let read = |name: &str| {
        let file = files.iter().find(|file| file.0 == name);
        file.map(|file| file.1.clone())
            .ok_or_else(|| io::Error::from(io::ErrorKind::NotFound))
    };
    Scene::parse(text, "scene.toml", &read).unwrap().scene
}

/// What the user claims.
pub(crate) fn scene(ways: &[Way], frames: u32, more: &str) -> Scene {
    let claimed = |person: usize, time_s| place(ways[person], time_s);
    let (mut text, files) = text(ways, f64::from(frames) / 10.0 + 30.0, claimed);
    text.push_str(more);
    parse(&(text, files))
}

/// A recording of so many frames at 10 Hz; draws by the laws that scenes have by default.
pub(crate) fn record(
    ways: &[Way],
    frames: u32,
    truth: Truth,
    unit: Unit,
    seed: u64,
) -> Vec<Record> {
    let mut draws = Draws(ChaCha8Rng::seed_from_u64(seed));
    let shown = shown(ways, frames, truth, &mut draws);
    let errors = errors(frames, truth, unit, &mut draws);
    let records = shown.iter().zip(&errors).zip(0..);
    records
        .map(|((image, errors), index)| row(index, turned(truth, image), errors))
        .collect()
}

pub(crate) struct Draws(pub(crate) ChaCha8Rng);

impl Draws {
    pub(crate) fn normal(&mut self, sd: f64) -> f64 {
        let draw: f64 = StandardNormal.sample(&mut self.0);
        sd * draw
    }

    /// Noise of ten in a second that is forgotten in 0.7 s.
    fn wander<const N: usize>(&mut self, sd: f64, number: u32) -> Vec<[f64; N]> {
        let kept = (-0.1_f64 / 0.7).exp();
        let mut now = [(); N].map(|()| self.normal(sd));
        let step = |_| {
            let before = now;
            now = now.map(|now| kept * now + self.normal(sd * (1.0 - kept * kept).sqrt()));
            before
        };
        (0..number).map(step).collect()
    }
}

/// What the sensor sees, °C.
fn shown(ways: &[Way], frames: u32, truth: Truth, draws: &mut Draws) -> Vec<[f64; 64]> {
    let late_s = if let Truth::Late(by_s) = truth {
        by_s
    } else {
        0.0
    };
    let lag_s = late_s + draws.normal(0.07);
    let angle = draws.normal(1.7);
    let aside_m = if let Truth::Aside(by_m) = truth {
        by_m
    } else {
        0.0
    };
    let gone_from = nearest_fifth(ways.first().copied(), frames);
    let gone = gone_from..gone_from + frames / 5;
    let mut ways = ways.to_vec();
    match truth {
        Truth::Nobody => ways.clear(),
        Truth::Missing => {
            let _ = ways.pop();
        }
        Truth::More => ways.push(Way::Walks { ahead_s: -17.0 }),
        _ => {}
    }
    let aside_m = [aside_m * angle.cos(), aside_m * angle.sin()];
    let people: Vec<Person> = ways
        .iter()
        .map(|way| {
            let mut contrast = draws.normal(0.35).exp();
            if let Truth::Contrast(times) = truth {
                contrast = times;
            }
            Person::new((*way, contrast), frames, aside_m, draws)
        })
        .collect();
    let room = Room::new(&people, frames);
    let image = |index: u32| {
        let is_gone = truth == Truth::Gone && gone.contains(&index);
        let index = match truth {
            Truth::Backwards => frames - index,
            _ => index,
        };
        let time_s = (f64::from(index) / 10.0 - lag_s).max(0.0);
        let time = Duration::from_secs_f64(time_s);
        room.image(index, time, usize::from(is_gone))
    };
    (0..frames).map(image).collect()
}

/// A room with its people, each warmer or colder than the scene has it.
struct Room {
    contrasts: Vec<f64>,
    looks: Vec<Vec<[f64; 64]>>,
    each: Vec<Simulator>,
    together: Simulator,
}

impl Room {
    fn new(people: &[Person], frames: u32) -> Self {
        let simulator = |people: &[Person]| {
            let ways: Vec<Way> = people.iter().map(|person| person.way).collect();
            let at = |person: usize, time_s| people[person].at(time_s);
            let scene = parse(&text(&ways, f64::from(frames) / 10.0 + 30.0, at));
            Simulator::new(&scene, SENSOR).unwrap()
        };
        Self {
            contrasts: people.iter().map(|person| person.contrast).collect(),
            looks: people.iter().map(|person| person.looks.clone()).collect(),
            each: people.chunks(1).map(simulator).collect(),
            together: simulator(people),
        }
    }

    /// Without the first `gone`.
    fn image(&self, index: u32, time: Duration, gone: usize) -> [f64; 64] {
        let mut image = [AMBIENT_C; 64];
        let mut show = |simulator: &Simulator, times: [f64; 64]| {
            for ((pixel, celsius), times) in image
                .iter_mut()
                .zip(simulator.image(time).celsius)
                .zip(times)
            {
                *pixel += times * (celsius - AMBIENT_C);
            }
        };
        let mut hidden = 0.0;
        if self.each.len() > 1 && gone == 0 {
            // Less what they hide of each other, with their mean contrast.
            hidden = self.contrasts.iter().sum::<f64>();
            hidden /= f64::from(u32::try_from(self.each.len()).unwrap());
            show(&self.together, [hidden; 64]);
        }
        let each = self.each.iter().zip(&self.contrasts).zip(&self.looks);
        for ((simulator, contrast), looks) in each.skip(gone) {
            let looks = looks[usize::try_from(index).unwrap()];
            show(
                simulator,
                looks.map(|more| contrast * (1.0 + more) - hidden),
            );
        }
        image
    }
}

/// One person in the room, somewhat aside of its way.
struct Person {
    way: Way,
    /// How many times the scene's.
    contrast: f64,
    offset_m: [f64; 2],
    /// Ten in a second, as of the looks.
    wander_m: Vec<[f64; 2]>,
    /// By how much each pixel of what it shows differs from its model, as a share.
    looks: Vec<[f64; 64]>,
}

impl Person {
    fn new((way, contrast): (Way, f64), frames: u32, aside_m: [f64; 2], draws: &mut Draws) -> Self {
        let offset_m = aside_m.map(|aside_m| aside_m + draws.normal(0.07));
        let sd = if let Way::Stands(..) = way { 0.0 } else { 0.07 };
        let wander_m = draws.wander(sd, frames + 400);
        let mut of_looks = Draws(draws.0.clone());
        // Without a change of what else is drawn; of nobody else's.
        let stream = 1 + draws.0.get_word_pos();
        of_looks.0.set_stream(stream.try_into().unwrap());
        Self {
            way,
            contrast,
            offset_m,
            wander_m,
            looks: of_looks.wander(0.15, frames + 400),
        }
    }

    fn at(&self, time_s: f64) -> [f64; 2] {
        let [x, y] = place(self.way, time_s);
        let steps = self.wander_m.iter().zip(0_u32..);
        let step = steps
            .take_while(|(_, index)| f64::from(*index) < 10.0 * time_s + 0.5)
            .last();
        let step = step.map_or([0.0; 2], |(step, _)| *step);
        [
            x + self.offset_m[0] + step[0],
            y + self.offset_m[1] + step[1],
        ]
    }
}

/// What unit and room add, °C.
pub(crate) fn errors(frames: u32, truth: Truth, unit: Unit, draws: &mut Draws) -> Vec<[f64; 64]> {
    let level_c = draws.normal(0.5);
    let pattern_c: [f64; 64] = std::array::from_fn(|_| level_c + draws.normal(unit.pattern_c));
    let is_correlated = truth == Truth::Correlated;
    let kept: f64 = if is_correlated { 0.8 } else { 0.0 };
    let noises_c: [f64; 64] = std::array::from_fn(|pixel| {
        let column = [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0][pixel % 8];
        if is_correlated {
            0.15 + 0.25 * column / 7.0
        } else {
            unit.noise_c
        }
    });
    let mut noise_c = noises_c.map(|sd_c| draws.normal(sd_c));
    let frame = |index: u32| {
        let mut drift_c = 0.0;
        if let Truth::Drift(by_c) = truth {
            drift_c = by_c * f64::from(index) / f64::from(frames);
        }
        for (noise_c, sd_c) in noise_c.iter_mut().zip(&noises_c) {
            *noise_c = kept * *noise_c + draws.normal(sd_c * (1.0 - kept * kept).sqrt());
        }
        std::array::from_fn(|pixel| pattern_c[pixel] + noise_c[pixel] + drift_c)
    };
    (0..frames).map(frame).collect()
}

fn turned(truth: Truth, image: &[f64; 64]) -> [f64; 64] {
    std::array::from_fn(|pixel| {
        let (row, column) = (pixel / 8, pixel % 8);
        image[match truth {
            Truth::MirroredX => row * 8 + 7 - column,
            Truth::MirroredY => (7 - row) * 8 + column,
            Truth::Quarter => column * 8 + 7 - row,
            _ => pixel,
        }]
    })
}

pub(crate) fn row(index: u32, image: [f64; 64], errors: &[f64; 64]) -> Record {
    let pixels = std::array::from_fn(|pixel| {
        let celsius = Celsius::new((image[pixel] + errors[pixel]) as f32);
        grideye_frame::word::pixel_word(celsius).unwrap()
    });
    let thermistor =
        grideye_frame::word::thermistor_word(Celsius::new(AMBIENT_C as f32 + 4.5)).unwrap();
    Record {
        seq: index.into(),
        stamp: Stamp {
            t_boot_ns: 3_000_000_000 + u64::from(index) * 100_000_000,
            t_utc_ns: 0,
            clock: ClockState::Unsynced,
        },
        reading: Reading::Frame(RecordedFrame {
            thermistor: Some(thermistor),
            pixels,
        }),
    }
}
