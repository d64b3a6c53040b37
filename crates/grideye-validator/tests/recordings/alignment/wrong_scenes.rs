//! Wrong walks and rooms do not agree, whatever alignment the scores may have.

use crate::alignment::bench::{RADIATOR, WALK, Walk, closing_note, compared, record, seeds, with};
use grideye_scene::Scene;
use grideye_validator::Verdict;
use grideye_validator::align::TimeAlignment;

#[test]
fn a_wrong_scene_does_not_agree() {
    println!("\nverdict agrees, disagrees, cannot tell");
    let mut wrong = Vec::new();
    for (first, (name, walk)) in (0..).zip(wrong_walks()) {
        if verdicts(name, &walk.scene(), first)[0] > 0 {
            wrong.push(name);
        }
    }
    let right = verdicts("the right scene", &WALK.scene(), 0);
    closing_note();
    assert_eq!(right, [seeds(), 0, 0]);
    assert!(wrong.is_empty(), "{wrong:?}");
}

fn wrong_walks() -> [(&'static str, Walk); 10] {
    let way = |way| Walk { way, ..WALK };
    let at = |elevation_deg, azimuth_deg| Walk {
        elevation_deg,
        azimuth_deg,
        ..WALK
    };
    let speed = |speed| Walk { speed, ..WALK };
    let radiator = Walk {
        radiator: RADIATOR,
        ..WALK
    };
    [
        (
            "walks elsewhere",
            way("3800,3500,0\n1200,3300,0\n1700,1400,0\n3400,1700,0\n"),
        ),
        (
            "walks 0.8 m beside",
            way("1200,2300,0\n3800,2500,0\n3300,4400,0\n1600,4100,0\n"),
        ),
        (
            "walks backwards",
            way("1600,3300,0\n3300,3600,0\n3800,1700,0\n1200,1500,0\n"),
        ),
        ("a radiator too many", radiator),
        ("sensor tilted by 10 degrees", at(80.0, -90.0)),
        ("sensor tilted the other way", at(80.0, 0.0)),
        ("sensor turned by 90 degrees", at(90.0, 0.0)),
        ("twice as fast", speed(1200.0)),
        ("half as fast", speed(300.0)),
        ("stops for 2 s on the way", Walk { stop_s: 2, ..WALK }),
    ]
}

/// Half a second and three seconds of delay are allowed in turn, beginning with one of them.
fn verdicts(name: &str, claimed: &Scene, first: u64) -> [u64; 3] {
    let seen = WALK.scene();
    let mut number = [0; 3];
    for seed in 0..seeds() {
        let shift_max_s = if (first + seed) % 2 == 0 { 0.5 } else { 3.0 };
        let records = record(&seen, seed, |time_s| time_s);
        let align = with(TimeAlignment::Rate, shift_max_s);
        number[match compared(&records, claimed, align, seed).judgment.verdict {
            Verdict::Agrees => 0,
            Verdict::Disagrees => 1,
            Verdict::CannotTell => 2,
        }] += 1;
    }
    println!("{name:<32}{number:?}");
    number
}
