//! Faults planted into simulated recordings.

use crate::faults::bench::*;
use grideye_frame::{PixelWord, RecordedFrame};
use grideye_recording::Record;
use grideye_scene::profile::Profile;
use grideye_validator::{Finding, KnownUnit, Options, State, Verdict, compare_scene};

type Fault = fn(Vec<Record>) -> Vec<Record>;

pub(crate) fn pixels(
    records: Vec<Record>,
    change: impl Fn(&[PixelWord; 64], usize) -> PixelWord,
) -> Vec<Record> {
    records
        .into_iter()
        .map(|record| Record {
            reading: record.reading.map(|raw| RecordedFrame {
                pixels: std::array::from_fn(|pixel| change(&raw.pixels, pixel)),
                ..raw
            }),
            ..record
        })
        .collect()
}

/// Takes each pixel from another row and column, both 0 to 7.
fn turned(records: Vec<Record>, from: fn(usize, usize) -> (usize, usize)) -> Vec<Record> {
    pixels(records, |pixels, pixel| {
        let (row, column) = from(pixel / 8, pixel % 8);
        pixels[8 * row + column]
    })
}

/// The seven ways to turn an image, in the words of the verdict.
const TURNS: [(&str, Fault); 7] = [
    ("mirrored left to right", |records| {
        turned(records, |row, column| (row, 7 - column))
    }),
    ("mirrored top to bottom", |records| {
        turned(records, |row, column| (7 - row, column))
    }),
    ("turned a quarter clockwise", |records| {
        turned(records, |row, column| (7 - column, row))
    }),
    ("turned by half", |records| {
        turned(records, |row, column| (7 - row, 7 - column))
    }),
    ("turned a quarter counter-clockwise", |records| {
        turned(records, |row, column| (column, 7 - row))
    }),
    ("transposed (rows and columns swapped)", |records| {
        turned(records, |row, column| (column, row))
    }),
    ("transposed about the other diagonal", |records| {
        turned(records, |row, column| (7 - column, 7 - row))
    }),
];

/// Prints how often a fault is found in a scene, and requires always.
#[track_caller]
fn always_seen(
    what: &str,
    (name, sensor): (&str, &str),
    criterion: &str,
    fault: impl Fn(Vec<Record>) -> Vec<Record>,
) {
    let scene = parse(&text(name));
    let mut missed = Vec::new();
    for seed in fault_seeds() {
        let records = fault(record(&scene, sensor, UNIT, seed));
        let comparison = compared(&records, &scene, sensor, seed);
        let failed = failed(&comparison);
        if comparison.judgment.verdict != Verdict::Disagrees || !failed.contains(&criterion) {
            missed.push((seed, comparison.judgment.verdict, failed));
        }
    }
    let number = fault_seeds().count();
    println!(
        "{what}, {name}, {sensor}: {} of {number} seen",
        number - missed.len()
    );
    assert!(missed.is_empty(), "{what}, {name}, {sensor}: {missed:?}");
}

/// Scenes in which most ways to turn them show, and a sensor of each.
const TURNED: [(&str, &str); 4] = [
    ("experiment-2", "ceiling"),
    ("experiment-3", "ceiling"),
    ("two-people", "wall"),
    ("l-shaped-room", "right-arm"),
];

/// An image turned in a way that shows never agrees; where a turned image is the same image, the verdict says so.
#[test]
fn an_image_turned_any_way_does_not_agree() {
    let mut wrong = Vec::new();
    let scenes = if all_seeds() {
        &TURNED[..]
    } else {
        &TURNED[2..]
    };
    for (name, sensor) in scenes {
        let scene = parse(&text(name));
        let records = record(&scene, sensor, UNIT, FIRST_SEED);
        let comparison = compared(&records, &scene, sensor, FIRST_SEED);
        let alternatives = comparison.decision.unwrap().alternatives;
        for (what, fault) in TURNS {
            let other = alternatives.iter().find(|other| other.what.contains(what));
            if other.unwrap().finding() == Finding::Same {
                println!("{name}, {what}: the same");
                continue;
            }
            for seed in fault_seeds().take(2) {
                let records = fault(record(&scene, sensor, UNIT, seed));
                let judgment = compared(&records, &scene, sensor, seed).judgment;
                println!("{name}, {what}: {}", judgment.headline);
                if judgment.verdict == Verdict::Agrees {
                    wrong.push((name, what, seed));
                }
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong:?}");
}

/// A walk along the middle of the view is its own mirror image, and an L is not.
#[test]
fn a_symmetric_scene_is_reported_as_symmetric() {
    for (name, sensor, is_symmetric) in [
        ("clothed-walk", "ceiling", true),
        ("l-shaped-room", "right-arm", false),
    ] {
        let scene = parse(&text(name));
        let records = record(&scene, sensor, UNIT, FIRST_SEED);
        let comparison = compared(&records, &scene, sensor, FIRST_SEED);
        let mut criteria = comparison.judgment.criteria.iter();
        let told = criteria.find(|criterion| criterion.name == "told_apart");
        let told = told.unwrap();
        let says = "looks the same as an image that is mirrored top to bottom";
        assert_eq!(
            told.sentence.contains(says),
            is_symmetric,
            "{name}: {told:?}"
        );
        assert_eq!(told.state, State::Met, "{name}: {told:?}");
    }
}

/// The pixels are not chosen to help: neither at the person nor at the coldest place.
#[test]
fn one_stuck_pixel_is_found_whatever_its_value() {
    for name in ["experiment-1", "experiment-3"] {
        for (what, pixel, word) in [
            ("stuck at what it showed", 45, None),
            ("stuck at 0", 3, Some(0)),
            ("stuck at 80 °C", 60, Some(320)),
        ] {
            always_seen(what, (name, "ceiling"), "moving_pixels", |records| {
                let first = records[0].reading.frame().unwrap().pixels[pixel];
                let stuck = word.map_or(first, PixelWord);
                pixels(
                    records,
                    |pixels, index| if index == pixel { stuck } else { pixels[index] },
                )
            });
        }
    }
}

#[test]
fn three_degrees_too_many_or_too_few_disagree() {
    for name in ["experiment-1", "experiment-4"] {
        always_seen("3 °C too warm", (name, "ceiling"), "level", |records| {
            pixels(records, |pixels, index| PixelWord(pixels[index].0 + 12))
        });
        always_seen("3 °C too cold", (name, "ceiling"), "level", |records| {
            pixels(records, |pixels, index| PixelWord(pixels[index].0 - 12))
        });
    }
}

/// A program takes a pixel's word for 0.0625 °C and records the temperature, which becomes a word of 0.25 °C again.
#[test]
fn the_thermistors_scale_on_pixels_disagrees_and_is_named() {
    for name in ["experiment-1", "experiment-3"] {
        always_seen(
            "0.0625 °C for 0.25 °C",
            (name, "ceiling"),
            "thermistor",
            |records| {
                pixels(records, |pixels, index| {
                    PixelWord((f64::from(pixels[index].0) / 4.0).round() as u16)
                })
            },
        );
    }
}

/// Pixels rounded to whole degrees.
#[test]
fn other_steps_than_the_sensors_disagree() {
    always_seen(
        "whole degrees",
        ("experiment-1", "ceiling"),
        "steps",
        |records| {
            pixels(records, |pixels, index| {
                PixelWord((pixels[index].0 + 2) / 4 * 4)
            })
        },
    );
}

/// Halved in three ways: every other frame was not read, every frame was read twice, the walk takes twice as long.
#[test]
fn a_halved_frame_rate_disagrees() {
    for name in ["experiment-1", "experiment-3"] {
        always_seen(
            "5 frames a second",
            (name, "ceiling"),
            "frame_rate",
            |records| {
                let kept = records.into_iter().step_by(2).enumerate();
                kept.map(|(seq, record)| Record {
                    seq: seq as u64,
                    ..record
                })
                .collect()
            },
        );
        always_seen(
            "every frame twice",
            (name, "ceiling"),
            "frame_rate",
            |records| {
                let mut last = records[0].reading;
                let twice = |record: Record| {
                    if record.seq % 2 == 0 {
                        last = record.reading;
                    }
                    Record {
                        reading: last,
                        ..record
                    }
                };
                records.into_iter().map(twice).collect()
            },
        );
    }
    let scene = parse(&text("experiment-3"));
    for seed in fault_seeds() {
        let records = record_at(&scene, "ceiling", UNIT, seed, 0.5);
        let verdict = compared(&records, &scene, "ceiling", seed).judgment.verdict;
        assert_eq!(verdict, Verdict::Disagrees, "{seed}");
    }
}

/// A profile knows the unit's level, so that the scene's ambient temperature decides: ±0.3 °C (one standard deviation).
#[test]
fn a_degree_too_many_is_found_with_the_units_profile() {
    let profile = |text: &str| Profile::parse(text, "profile.toml").unwrap();
    let exact = KnownUnit::of(&profile("[noise]\nsigma_c = 0.24\n"));
    let wanders = KnownUnit::of(&profile(
        "[noise]\nsigma_c = 0.24\n[common_mode]\nsd_c = 0.4\ncorrelation_s = 30\n",
    ));
    let mut found = Vec::new();
    for (name, scene, sensor) in right().into_iter().take(1) {
        for seed in fault_seeds().take(2) {
            let records = record(&scene, sensor, PERFECT, seed);
            let warmer = |steps: u16| {
                pixels(records.clone(), |pixels, index| {
                    PixelWord(pixels[index].0 + steps)
                })
            };
            let is_off = |steps: u16, unit| {
                let options = Options {
                    unit,
                    ..options(seed)
                };
                let comparison = compare_scene(&warmer(steps), &scene, sensor, &options).unwrap();
                failed(&comparison).contains(&"level")
            };
            // 2.576 √(0.3² + 0.4²) = 1.288 °C.
            let cases = [
                is_off(2, Some(exact)),
                is_off(4, Some(exact)),
                is_off(4, Some(wanders)),
                is_off(6, Some(wanders)),
                is_off(4, None),
            ];
            if cases != [false, true, false, true, false] {
                found.push((name, seed, cases));
            }
        }
    }
    assert!(found.is_empty(), "{found:?}");
}

/// One sensor's recording compared with another's claim. Sensor A sees almost nothing, and B the person at the edge of its
/// view, so some comparisons are open.
#[test]
fn sensors_swapped_do_not_agree() {
    let scene = parse(&text("scenario-b-standing"));
    for seen in ["A", "B", "C"] {
        for claimed in ["A", "B", "C"] {
            let (mut disagreed, mut open) = (0, 0);
            for seed in fault_seeds() {
                let records = record(&scene, seen, UNIT, seed);
                match compared(&records, &scene, claimed, seed).judgment.verdict {
                    Verdict::Disagrees => disagreed += 1,
                    Verdict::CannotTell => open += 1,
                    Verdict::Agrees => {}
                }
            }
            let number = fault_seeds().count();
            println!(
                "sensor {seen} taken for {claimed}: {disagreed} of {number} disagree, {open} cannot tell"
            );
            if seen == claimed {
                assert_eq!(disagreed, 0, "{seen}");
            } else {
                assert_eq!(disagreed + open, number, "{seen} taken for {claimed}");
            }
        }
    }
}

/// Both have a person under the sensor, half a pixel apart.
const NEARLY_ALIKE: (&str, &str) = ("experiment-1", "scenario-b-standing");

/// Each scene against recordings of other scenes: of all, or of the next.
#[test]
fn a_wrong_scene_does_not_agree() {
    let scenes = right();
    let others = if all_seeds() { scenes.len() - 1 } else { 1 };
    let (mut missed, mut number) = (Vec::new(), 0);
    for (place, (name, claimed, claimed_sensor)) in scenes.iter().enumerate() {
        for (seen_name, seen, sensor) in scenes.iter().cycle().skip(place + 1).take(others) {
            let records = record(seen, sensor, UNIT, FIRST_SEED);
            let judgment = compared(&records, claimed, claimed_sensor, FIRST_SEED).judgment;
            number += 1;
            if judgment.verdict == Verdict::Agrees && (*seen_name, *name) != NEARLY_ALIKE {
                missed.push(format!("{seen_name} taken for {name}"));
            }
        }
    }
    println!("wrong scenes: {number}, agreed to: {}", missed.len());
    assert!(missed.is_empty(), "{missed:#?}");
}
