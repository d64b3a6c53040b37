//! Two sessions of a real sensor, which the network has not seen.

use grideye_count::evaluation::{Evaluation, Labeled};
use grideye_count::{Counter, Network, Room, celsius};
use std::fs::File;
use std::path::Path;

struct Session {
    at_s: Vec<f64>,
    frames: Vec<[f32; 64]>,
    people: Vec<u8>,
}

fn session(name: &str) -> Session {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../recordings/linaige");
    let file = File::open(folder.join(name)).unwrap();
    let rows = grideye_import::open(file, name, &grideye_import::Options::default()).unwrap();
    let mut session = Session {
        at_s: Vec::new(),
        frames: Vec::new(),
        people: Vec::new(),
    };
    for row in rows {
        let row = row.unwrap();
        let raw = row.record.reading.frame().copied().unwrap();
        session.at_s.push(row.record.stamp.t_boot_ns as f64 / 1e9);
        session.frames.push(celsius(&raw));
        session.people.push(row.labels[0].parse().unwrap());
    }
    session
}

/// Each frame alone, and as counted.
fn judged(session: &Session, mut counter: Counter) -> [Evaluation; 2] {
    let network = Network::default();
    let mut counts = [Vec::new(), Vec::new()];
    for ((at_s, frame), truth) in session
        .at_s
        .iter()
        .zip(&session.frames)
        .zip(&session.people)
    {
        let count = counter.see(&network, *at_s, frame);
        let both = [
            count.map(|count| count.people_alone()),
            count.map(|count| count.people),
        ];
        for (counts, counted) in counts.iter_mut().zip(both) {
            counts.push(Labeled {
                at_s: *at_s,
                truth: *truth,
                counted,
            });
        }
    }
    counts.map(|counts| Evaluation::of(&counts))
}

fn percent(share: Option<f64>) -> f64 {
    (share.unwrap_or(f64::NAN) * 1000.0).round() / 10.0
}

/// Balanced accuracy at least, in per cent: of each frame alone, as counted, that more than 0.5 s from a change of the label,
/// and as counted live; then presence errors there at most. A point less than what the README says.
const SESSIONS: [(&str, [f64; 4], [f64; 2]); 2] = [
    (
        "Session2_2021-07-01_RoomB_v2.csv",
        [85.0, 89.0, 93.0, 90.0],
        [4.0, 2.0],
    ),
    (
        "Session3_2021-07-06_RoomA_v2.csv",
        [79.0, 80.0, 93.0, 79.0],
        [1.5, 6.5],
    ),
];

#[test]
fn balanced_accuracy_of_two_real_sessions_is_what_the_readme_says() {
    for (name, least, most) in SESSIONS {
        let session = session(name);
        let mut room = Room::default();
        session.frames.iter().for_each(|frame| room.see(frame));
        let known = Counter::with_background(room.celsius());
        let [alone, counted] = judged(&session, known);
        let live = judged(&session, Counter::new())[1];
        let found = [alone.all, counted.all, counted.steady, live.all];
        let found = found.map(|of| percent(of.balanced_accuracy()));
        let errors = counted.steady.presence_errors().map(percent);
        println!("{name}: {found:?}, presence errors {errors:?}");
        assert!(
            found
                .iter()
                .zip(least)
                .all(|(found, least)| *found >= least),
            "{name}: {found:?}"
        );
        assert!(
            errors.iter().zip(most).all(|(error, most)| *error <= most),
            "{name}: {errors:?}"
        );
    }
}
