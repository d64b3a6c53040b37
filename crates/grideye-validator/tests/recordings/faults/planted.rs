//! Faults planted into simulated recordings.

use crate::faults::bench::*;
use grideye_frame::{PixelWord, RawFrame};
use grideye_recording::Record;
use grideye_scene::profile::Profile;
use grideye_validator::{KnownUnit, Options, Verdict, compare_scene};

type Fault = fn(Vec<Record>) -> Vec<Record>;

pub(crate) fn pixels(
    records: Vec<Record>,
    change: impl Fn(&[PixelWord; 64], usize) -> PixelWord,
) -> Vec<Record> {
    records
        .into_iter()
        .map(|record| Record {
            reading: record.reading.map(|raw| RawFrame {
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

/// The seven ways to turn an image.
const TURNS: [(&str, Fault); 7] = [
    ("mirrored left to right", |records| {
        turned(records, |row, column| (row, 7 - column))
    }),
    ("mirrored top to bottom", |records| {
        turned(records, |row, column| (7 - row, column))
    }),
    ("rotated by 90°", |records| {
        turned(records, |row, column| (7 - column, row))
    }),
    ("rotated by 180°", |records| {
        turned(records, |row, column| (7 - row, 7 - column))
    }),
    ("rotated by 270°", |records| {
        turned(records, |row, column| (column, 7 - row))
    }),
    ("transposed", |records| {
        turned(records, |row, column| (column, row))
    }),
    ("transposed the other way", |records| {
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
const TURNED: [(&str, &str); 6] = [
    ("experiment-2", "ceiling"),
    ("experiment-3", "ceiling"),
    ("clothed-walk", "ceiling"),
    ("two-people", "wall"),
    ("attic", "ridge"),
    ("l-shaped-room", "right-arm"),
];
/// A person on the middle row with nothing else in view is its own mirror image top to bottom.
const SYMMETRIC: [&str; 1] = ["clothed-walk"];

#[test]
fn an_image_turned_any_way_disagrees() {
    for (name, sensor) in TURNED {
        for (what, fault) in TURNS {
            if what != "mirrored top to bottom" || !SYMMETRIC.contains(&name) {
                always_seen(what, (name, sensor), "orientation", fault);
            }
        }
    }
}

/// Where a mirror image is the same image, and only there, the verdict says so.
#[test]
fn a_symmetric_scene_is_reported_as_symmetric() {
    for (name, sensor) in TURNED {
        let scene = parse(&text(name));
        let records = record(&scene, sensor, UNIT, FIRST_SEED);
        let comparison = compared(&records, &scene, sensor, FIRST_SEED);
        let criteria = &comparison.judgment.criteria;
        let orientation = criteria
            .iter()
            .find(|criterion| criterion.name == "orientation")
            .unwrap();
        let says = "an image mirrored top to bottom would look the same";
        assert_eq!(
            orientation.sentence.contains(says),
            SYMMETRIC.contains(&name),
            "{name}: {}",
            orientation.sentence
        );
    }
}

/// The pixels are not chosen to help: neither at the person nor at the coldest place.
#[test]
fn one_stuck_pixel_is_found_whatever_its_value() {
    for name in ["experiment-1", "experiment-3", "clothed-walk"] {
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
    for name in ["experiment-1", "experiment-4", "clothed-walk"] {
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
    for name in ["experiment-1", "experiment-3", "clothed-walk"] {
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
    for name in ["experiment-1", "experiment-3", "clothed-walk"] {
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

/// One step of the sensor is a fault only if the unit's own level is known.
#[test]
fn an_offset_of_one_step_is_found_with_the_units_profile() {
    let profile = |text: &str| Profile::parse(text, "profile.toml").unwrap();
    let exact = KnownUnit::of(&profile("[noise]\nsigma_c = 0.24\n"));
    let wanders = KnownUnit::of(&profile(
        "[noise]\nsigma_c = 0.24\n[common_mode]\nsd_c = 0.1\ncorrelation_s = 30\n",
    ));
    for (name, scene, sensor) in right() {
        let (mut seen, mut alarms) = (0, 0);
        for seed in fault_seeds() {
            let judged = |records: &[Record], unit| {
                let options = Options {
                    unit,
                    ..options(seed)
                };
                compare_scene(records, &scene, sensor, &options).unwrap()
            };
            let sound = record(&scene, sensor, PERFECT, seed);
            let faulty = pixels(sound.clone(), |pixels, index| {
                PixelWord(pixels[index].0 + 1)
            });
            seen += usize::from(failed(&judged(&faulty, Some(exact))).contains(&"level"));
            alarms += usize::from(failed(&judged(&sound, Some(exact))).contains(&"level"));
            assert!(
                !failed(&judged(&faulty, None)).contains(&"level"),
                "within the datasheet's accuracy"
            );
            let wandering = judged(&faulty, Some(wanders));
            assert!(
                (wandering.level_max_c - 0.425).abs() < 1e-9,
                "half a step and three times 0.1 °C"
            );
            assert!(
                !failed(&wandering).contains(&"level"),
                "within what the unit wanders by"
            );
        }
        let number = fault_seeds().count();
        println!("one step too many, {name}: {seen} of {number} seen, {alarms} false alarms");
        assert_eq!((seen, alarms), (number, 0), "{name}");
    }
}

/// One sensor's recording compared with another's claim. Sensor A sees almost nothing: its recordings show nothing
/// warm, which proves nothing, and where its scene claims nobody, a person of 0.8 °C could hide in the unknown pattern.
/// So comparisons with A may be open, but never agree.
#[test]
fn sensors_swapped_disagree() {
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
                assert_eq!(disagreed, 0);
            } else if [seen, claimed].contains(&"A") {
                assert_eq!(disagreed + open, number);
            } else {
                assert_eq!(disagreed, number);
            }
        }
    }
}

/// Each scene against a recording of each other scene.
#[test]
fn a_wrong_scene_disagrees() {
    let scenes = right();
    let mut missed = Vec::new();
    let mut number = 0;
    for (seen_name, seen, sensor) in &scenes {
        for (name, claimed, claimed_sensor) in &scenes {
            if seen_name == name {
                continue;
            }
            for seed in fault_seeds().take(2) {
                let records = record(seen, sensor, UNIT, seed);
                number += 1;
                let verdict = compared(&records, claimed, claimed_sensor, seed)
                    .judgment
                    .verdict;
                if verdict == Verdict::Agrees {
                    missed.push(format!("{seen_name} taken for {name}, seed {seed}"));
                }
            }
        }
    }
    println!(
        "wrong scenes: {} of {number} not agreed to",
        number - missed.len()
    );
    assert!(missed.is_empty(), "{missed:#?}");
}
