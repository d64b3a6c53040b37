//! Two sessions of a real sensor, which the network has not seen.

use grideye_count::judge::{Judged, Judgment};
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
fn judged(session: &Session, mut counter: Counter) -> [Judgment; 2] {
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
            counts.push(Judged {
                at_s: *at_s,
                truth: *truth,
                counted,
            });
        }
    }
    counts.map(|counts| Judgment::of(&counts))
}

fn percent(share: Option<f64>) -> f64 {
    (share.unwrap_or(f64::NAN) * 1000.0).round() / 10.0
}

#[test]
fn balanced_accuracy_of_two_real_sessions_is_what_the_readme_says() {
    for (name, least) in [
        ("Session2_2021-07-01_RoomB_v2.csv", [0.0; 4]),
        ("Session3_2021-07-06_RoomA_v2.csv", [0.0; 4]),
    ] {
        let session = session(name);
        let mut room = Room::default();
        session.frames.iter().for_each(|frame| room.see(frame));
        let [alone, counted] = judged(&session, Counter::with_background(room.celsius()));
        let live = judged(&session, Counter::new())[1];
        let found = [alone.all, counted.all, counted.steady, live.all]
            .map(|of| percent(of.balanced_accuracy()));
        println!(
            "{name}: alone {} counted {} steady {} live {}",
            found[0], found[1], found[2], found[3]
        );
        println!(
            "   presence {:?}, longest wrong {:.1} s, not yet {}",
            counted.steady.presence_errors().map(percent),
            counted.longest_wrong_s,
            live.not_yet
        );
        println!(
            "   alone: steady {} majority {}",
            percent(alone.steady.balanced_accuracy()),
            percent(alone.majority.balanced_accuracy())
        );
        println!("   {:?}", counted.all.0);
        for (found, least) in found.iter().zip(least) {
            assert!(*found >= least, "{name}: {found:?}");
        }
    }
}
