//! Faults planted into real recordings.

use crate::faults::bench::*;
use crate::faults::planted::pixels;
use grideye_frame::PixelWord;
use grideye_recording::Record;
use grideye_validator::{Options, Verdict, compare_scene};

const EMPTY: &str = "[room]\nsize_mm = [5000, 5000, 2700]\nambient_c = 25\n[[sensor]]\nname = \"ceiling\"\npreset = \"grid-eye\"\nsampling_hz = 10\nposition_mm = [2500, 2500, 2700]\nelevation_deg = 90\nazimuth_deg = 0\n";

/// Sound real frames raise no alarm, and each planted fault is found. Those rooms have no scene, so only criteria of
/// the sensor itself count.
#[test]
fn real_sessions_are_sound_and_faults_planted_into_them_are_seen() {
    let scene = parse(EMPTY);
    for name in [
        "Session2_2021-07-01_RoomB_v2.csv",
        "Session3_2021-07-06_RoomA_v2.csv",
    ] {
        let sound = session(name);
        let mut faults = [
            ("sound", 0),
            ("stuck", 0),
            ("scale", 0),
            ("whole degrees", 0),
            ("half rate", 0),
        ];
        let mut runs = 0;
        for run in sound.chunks_exact(400) {
            runs += 1;
            let asked = |records: &[Record]| {
                let options = Options {
                    protocol: Some(grideye_validator::Protocol::Static),
                    ..options(1)
                };
                let comparison = compare_scene(records, &scene, "ceiling", &options).unwrap();
                failed(&comparison)
            };
            let own = ["moving_pixels", "steps", "thermistor", "frame_rate"];
            let run = run.to_vec();
            let found = asked(&run);
            let alarms: Vec<_> = found.iter().filter(|name| own.contains(name)).collect();
            assert!(alarms.is_empty(), "{name}, {:?}: {alarms:?}", run[0].seq);
            faults[0].1 += 1;
            let first = run[0].reading.frame().unwrap().pixels[20];
            let stuck = pixels(
                run.clone(),
                |pixels, index| if index == 20 { first } else { pixels[index] },
            );
            faults[1].1 += u32::from(asked(&stuck).contains(&"moving_pixels"));
            let scale = pixels(run.clone(), |pixels, index| {
                PixelWord((pixels[index].0 + 2) / 4)
            });
            faults[2].1 += u32::from(asked(&scale).contains(&"thermistor"));
            let degrees = pixels(run.clone(), |pixels, index| {
                PixelWord((pixels[index].0 + 2) / 4 * 4)
            });
            faults[3].1 += u32::from(asked(&degrees).contains(&"steps"));
            let half: Vec<Record> = run
                .iter()
                .step_by(2)
                .enumerate()
                .map(|(seq, record)| Record {
                    seq: seq as u64,
                    ..*record
                })
                .collect();
            faults[4].1 += u32::from(asked(&half).contains(&"frame_rate"));
        }
        println!("{name}: {runs} runs of 400 frames: {faults:?}");
        for (fault, number) in faults {
            assert_eq!(number, runs, "{name}: {fault}");
        }
    }
}

/// Stretches counted as empty: no pattern, slope or noise of a real room counts as warm.
#[test]
fn a_real_empty_room_does_not_agree() {
    let scene = parse(EMPTY);
    for (name, from, to) in [
        ("Session2_2021-07-01_RoomB_v2.csv", 1376, 1476),
        ("Session3_2021-07-06_RoomA_v2.csv", 823, 938),
        ("Session3_2021-07-06_RoomA_v2.csv", 988, 1160),
    ] {
        let comparison =
            compare_scene(&session(name)[from..to], &scene, "ceiling", &options(1)).unwrap();
        let verdict = comparison.judgment.verdict;
        assert_ne!(verdict, Verdict::Agrees, "{name} {from}");
    }
}

fn session(name: &str) -> Vec<Record> {
    let path = format!(
        "{}/../../recordings/linaige/{name}",
        env!("CARGO_MANIFEST_DIR")
    );
    let file = std::fs::File::open(path).unwrap();
    let rows = grideye_import::open(file, name, &Default::default()).unwrap();
    rows.map(|row| row.unwrap().record).collect()
}
