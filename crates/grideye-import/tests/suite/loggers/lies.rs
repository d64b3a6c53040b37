//! The judge is judged: a file that is read right is not right beside another truth.

use super::judge::{Outcome, outcome};
use super::print::{column, timed, unix};
use super::scene::{Scene, Shot};
use super::truth::{Event, Times, Truth};
use super::variant::Written;

/// A change of the truth.
type Lie = fn(&mut Truth);

/// The frame that is lost.
const LOST: usize = 4;

const LIES: [(&str, Lie); 13] = [
    ("turned", |truth| {
        each_shot(truth, |shot| {
            shot.steps = std::array::from_fn(|at| shot.steps[at % 8 * 8 + at / 8]);
        });
    }),
    ("one pixel by one step", |truth| {
        each_shot(truth, |shot| shot.steps[9] += i16::from(shot.index == 3));
    }),
    ("shifted by a frame", |truth| {
        truth.streams[0].rotate_left(1);
    }),
    ("a frame fewer", |truth| drop(truth.streams[0].pop())),
    ("a torn frame", |truth| {
        truth.streams[0].insert(7, Event::Torn);
    }),
    ("no frame is lost", |truth| {
        truth.streams[0].remove(LOST);
    }),
    ("two streams", |truth| {
        truth.streams.push(truth.streams[0].clone());
    }),
    ("slower", |truth| {
        each_shot(truth, |shot| shot.t_ns += shot.t_ns / 10);
    }),
    ("another day", |truth| {
        each_shot(truth, |shot| shot.utc_ns += 86_400_000_000_000);
    }),
    ("no times", |truth| truth.times = Times::Rate),
    ("a label of another frame", |truth| {
        truth.labels[0].values.rotate_right(1);
    }),
    ("another label", |truth| {
        truth.labels[0].name = Some("door".to_owned());
    }),
    ("another thermistor", |truth| {
        each_shot(truth, |shot| shot.thermistor += 1);
    }),
];

fn each_shot(truth: &mut Truth, change: impl Fn(&mut Shot)) {
    for event in &mut truth.streams[0] {
        if let Event::Whole(shot) = event {
            change(shot);
        }
    }
}

#[test]
fn the_judge_sees_each_fault() {
    let scene = Scene::new(0, "judge");
    let truth = Truth::of(&scene).absolute(0).people(&scene, "people");
    let truth = truth.thermistor(0.01).numbered().gone(LOST);
    let mut shots = scene.shots.clone();
    shots.remove(LOST);
    let columns = vec![
        column("frame", &shots, |shot| shot.index.to_string()),
        column("people", &shots, |shot| shot.people.to_string()),
        column("thermistor", &shots, |shot| shot.thermistor_c().to_string()),
    ];
    let mut written = Written {
        name: "walk.csv",
        bytes: timed("time", &shots, |shot| unix(shot.utc_ns), columns).into(),
        truth: truth.clone(),
    };
    assert_eq!(outcome(&written, ""), Outcome::Right);
    for (name, lie) in LIES {
        written.truth = truth.clone();
        lie(&mut written.truth);
        let found = outcome(&written, "");
        let is_seen = matches!(found, Outcome::Wrong(_) | Outcome::Lossy(_));
        assert!(is_seen, "{name}: {found:?}");
    }
}
