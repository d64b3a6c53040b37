//! How a sensor is mounted, from frames of 22 °C with a hand of 27 °C on one pixel. A view is empty after 20 frames, a
//! hand counts after 10 in a row, and is gone after 5 without it.

use grideye_validator::orient::{Picture, Step, Watch, json};
use serde_json::{Value, json as value};
use std::iter::repeat_n;

const ROOM: Picture = [22.0; 64];

fn with(column: usize, row: usize) -> Picture {
    let mut picture = ROOM;
    picture[row * 8 + column] = 27.0;
    picture
}

/// After an empty view.
fn watched(pictures: impl IntoIterator<Item = Picture>) -> Watch {
    let mut watch = Watch::default();
    for picture in repeat_n(ROOM, 20).chain(pictures) {
        watch.push(&picture);
    }
    watch
}

/// After an empty view, one hand and then the other.
fn hands(left: impl IntoIterator<Item = Picture>, top: impl IntoIterator<Item = Picture>) -> Watch {
    watched(left.into_iter().chain(repeat_n(ROOM, 5)).chain(top))
}

fn told(watch: &Watch) -> Value {
    json("sensor", &watch.found())
}

/// The sides of the image, clockwise from the left, and a pixel at each.
const SIDES: [(&str, (usize, usize)); 4] = [
    ("left", (0, 4)),
    ("top", (4, 0)),
    ("right", (7, 3)),
    ("bottom", (3, 7)),
];

fn at_sides(left: usize, top: usize) -> Watch {
    let hand = |side: usize| {
        let (column, row) = SIDES[side].1;
        repeat_n(with(column, row), 10)
    };
    hands(hand(left), hand(top))
}

#[test]
fn two_hands_are_seen_one_after_the_other() {
    let watch = at_sides(0, 3);
    assert_eq!(watch.step(), Step::Done);
    let found = told(&watch);
    let hand = |side, column: f64, row: f64| value!({ "side": side, "column": column, "row": row, "contrast_k": 5.0, "confidence": 1.0 });
    assert_eq!(found["left"], hand("left", 1.0, 5.0));
    assert_eq!(found["top"], hand("bottom", 4.0, 8.0));
}

#[test]
fn a_moving_view_is_not_empty() {
    let mut watch = Watch::default();
    (0..40).for_each(|at| watch.push(&with(at % 8, 3)));
    assert_eq!(watch.step(), Step::Empty);
}

#[test]
fn a_hand_in_the_middle_or_in_a_corner_is_at_no_side() {
    for (column, row) in [(3, 4), (0, 0), (7, 6)] {
        let watch = watched(repeat_n(with(column, row), 100));
        assert_eq!(watch.step(), Step::Left, "{column} {row}");
        assert!(watch.is_unclear(), "{column} {row}");
    }
}

#[test]
fn too_few_frames_and_glitches_do_not_count() {
    let short = watched(repeat_n(with(0, 4), 9));
    assert_eq!(short.step(), Step::Left);
    let glitches = (0..100).map(|at| if at % 5 == 0 { with(0, 4) } else { ROOM });
    assert_eq!(watched(glitches).step(), Step::Left);
}

#[test]
fn a_hand_that_passes_another_side_costs_confidence() {
    let passing = repeat_n(with(4, 0), 5).chain(repeat_n(with(0, 4), 10));
    let found = told(&hands(passing, repeat_n(with(4, 0), 10)));
    let confidence = found["left"]["confidence"].as_f64().unwrap();
    assert!((confidence - 10.0 / 15.0).abs() < 1e-12, "{found}");
}

#[test]
fn each_pair_of_sides_has_one_mounting_and_a_line_has_none() {
    let mut mountings = Vec::new();
    for (left, top) in (0..4).flat_map(|left| (0..4).map(move |top| (left, top))) {
        let found = told(&at_sides(left, top));
        assert_eq!(found["told"], (left + top) % 2 == 1, "{left} {top}");
        if let Some(quarters) = found["page"]["quarters"].as_u64() {
            let quarters = usize::try_from(quarters).unwrap();
            let mirrored = found["page"]["mirrored"] == true;
            let shown = |side: usize| if mirrored { (6 - side) % 4 } else { side } + quarters;
            assert_eq!((shown(left) % 4, shown(top) % 4), (0, 1), "{left} {top}");
            assert_eq!(found["left"]["side"], SIDES[left].0);
            mountings.push((quarters, mirrored));
        }
    }
    assert_eq!(mountings.len(), 8);
    mountings.sort_unstable();
    mountings.dedup();
    assert_eq!(mountings.len(), 8);
}

/// A sensor whose top leans right has the room's top at its left, and the room's left at its bottom.
#[test]
fn a_sensor_that_leans_right_has_a_roll_of_90() {
    let found = told(&at_sides(3, 0));
    assert_eq!(found["roll_deg"], 90);
    let keys = |left, top| {
        let text = grideye_validator::orient::text("sensor", &at_sides(left, top).found());
        text.split_once("page      ").unwrap().1.to_owned()
    };
    assert_eq!(keys(3, 0), "keys t  (t turns, m mirrors)");
    assert_eq!(told(&at_sides(2, 1))["roll_deg"], Value::Null);
    assert_eq!(keys(2, 1), "keys m  (t turns, m mirrors)");
}
