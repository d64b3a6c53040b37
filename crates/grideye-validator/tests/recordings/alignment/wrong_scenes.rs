//! Alignment must not make a wrong scene agree.

use crate::alignment::bench::{
    RADIATOR, WALK, Walk, closing_note, compared, fewer_seeds, quantile, record, seeds, with,
};
use grideye_scene::Scene;
use grideye_validator::Verdict;
use grideye_validator::align::TimeAlignment;

const ALIGNMENTS: [(&str, TimeAlignment, f64, bool); 6] = [
    ("none", TimeAlignment::None, 0.5, true),
    ("shift", TimeAlignment::Shift, 0.5, false),
    ("rate", TimeAlignment::Rate, 0.5, true),
    ("warp", TimeAlignment::Warp, 0.5, false),
    ("law", TimeAlignment::Law, 0.5, false),
    ("rate, 3 s", TimeAlignment::Rate, 3.0, false),
];

/// How often a claimed scene agreed under each of [`ALIGNMENTS`], and the number of seeds.
type Cells = Vec<(u64, u64)>;

/// A wrong scene stays wrong under every alignment.
#[test]
fn a_wrong_scene_is_not_aligned_into_agreement() {
    println!("\nverdict agrees, of so many seeds");
    let names: String = ALIGNMENTS
        .iter()
        .map(|(name, ..)| format!("{name:>10}"))
        .collect();
    println!("{:<32}{names}{:>10}", "claimed scene", "likeness");
    let mut wrong = Vec::new();
    for (name, walk) in wrong_walks() {
        let cells = agreements(name, &walk.scene());
        if !is_bearable(&cells) {
            wrong.push((name, cells));
        }
    }
    let right = agreements("the right scene", &WALK.scene());
    closing_note();
    assert!(
        right.iter().all(|(agrees, seeds)| agrees == seeds),
        "{right:?}"
    );
    assert!(wrong.is_empty(), "{wrong:?}");
}

/// Never with the defaults; once over all seeds with more freedom.
fn is_bearable(cells: &[(u64, u64)]) -> bool {
    cells[..3].iter().all(|(agrees, _)| *agrees == 0)
        && cells[3..].iter().all(|(agrees, _)| *agrees <= 1)
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

fn agreements(name: &str, claimed: &Scene) -> Cells {
    let seen = WALK.scene();
    let (mut cells, mut likeness) = (Vec::new(), Vec::new());
    for (_, time, shift_max_s, is_default) in ALIGNMENTS {
        let seeds = if is_default { seeds() } else { fewer_seeds() };
        let mut agrees = 0;
        for seed in 0..seeds {
            let records = record(&seen, seed, |time_s| time_s);
            let found = compared(&records, claimed, with(time, shift_max_s), seed);
            agrees += u64::from(found.judgment.verdict == Verdict::Agrees);
            likeness.extend(found.alignment.unwrap().time.map(|time| time.likeness));
        }
        cells.push((agrees, seeds));
    }
    let shown: String = cells
        .iter()
        .map(|(agrees, seeds)| format!("{:>10}", format!("{agrees}/{seeds}")))
        .collect();
    println!("{name:<32}{shown}{:>10.2}", quantile(&mut likeness, 0.5));
    cells
}
