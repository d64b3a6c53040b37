//! People who come, stay and go, as the simulator shows them with the noise of a real sensor.

use grideye_count::{Counter, Gate, Network};
use grideye_scene::{Scene, Simulator};
use std::io;
use std::path::Path;
use std::time::Duration;

/// A person's places under a ceiling sensor of 60 degrees, which sees about 1.4 m to each side of (2.5, 2) m.
fn simulator(trajectory: &'static str) -> Simulator {
    let scene = "
[room]
size_mm = [5000, 4000, 2500]
ambient_c = 21

[[agent]]
name = \"person\"
person = {}
trajectory = \"way.csv\"

[[sensor]]
name = \"ceiling\"
preset = \"grid-eye\"
position_mm = [2500, 2000, 2500]
elevation_deg = 90
azimuth_deg = -90
profile = \"profiles/linaige.toml\"
";
    let files = |name: &str| match name {
        "way.csv" => Ok(format!("t_s,x_mm,y_mm,z_mm\n{trajectory}")),
        other => {
            let scenes = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes");
            std::fs::read_to_string(scenes.join(other)).map_err(io::Error::other)
        }
    };
    let loaded = Scene::parse(scene, "scene.toml", &files).unwrap();
    Simulator::new(&loaded.scene, "ceiling").unwrap()
}

/// The frames from `from_s` on, `hz` a second, with their times.
fn frames(
    simulator: &Simulator,
    from_s: u32,
    to_s: u32,
    hz: u32,
) -> impl Iterator<Item = (f64, [f32; 64])> {
    (from_s * hz..to_s * hz).map(move |number| {
        let at = Duration::from_secs(number.into()) / hz;
        let image = simulator.noisy(at, 1);
        (
            at.as_secs_f64(),
            std::array::from_fn(|pixel| image.celsius[pixel] as f32),
        )
    })
}

/// The share of the frames from `from_s` to `to_s` with so many people.
fn share(counts: &[(f64, Option<u8>)], from_s: f64, to_s: f64, people: Option<u8>) -> f64 {
    let within: Vec<_> = counts
        .iter()
        .filter(|(at_s, _)| (from_s..to_s).contains(at_s))
        .collect();
    within
        .iter()
        .filter(|(_, counted)| *counted == people)
        .count() as f64
        / within.len() as f64
}

fn counted(simulator: &Simulator, to_s: u32, hz: u32) -> Vec<(f64, Option<u8>)> {
    let (network, mut counter) = (Network::default(), Counter::new());
    let frames = frames(simulator, 0, to_s, hz);
    frames
        .map(|(at_s, frame)| {
            (
                at_s,
                counter
                    .see(&network, at_s, &frame)
                    .map(|count| count.people),
            )
        })
        .collect()
}

#[test]
fn who_stays_for_an_hour_counts_all_the_time_and_not_after() {
    let simulator = simulator(
        "0,300,2000,0\n80,300,2000,0\n83,2500,2000,0\n3680,2500,2000,0\n3683,300,2000,0\n",
    );
    let counts = counted(&simulator, 3760, 1);
    for (from_s, to_s, people, least) in [
        (0.0, 59.0, None, 1.0),
        (60.0, 80.0, Some(0), 1.0),
        (85.0, 3680.0, Some(1), 0.99),
        (3620.0, 3680.0, Some(1), 0.95),
        (3690.0, 3760.0, Some(0), 0.99),
    ] {
        let share = share(&counts, from_s, to_s, people);
        assert!(
            share >= least,
            "{from_s} to {to_s} s: {share} of the frames have {people:?}"
        );
    }
}

#[test]
fn who_was_there_from_the_start_counts_after_going_out_and_in_again() {
    let simulator = simulator(
        "0,2500,2000,0\n60,2500,2000,0\n63,300,2000,0\n90,300,2000,0\n93,2500,2000,0\n120,2500,2000,0\n",
    );
    let counts = counted(&simulator, 120, 10);
    assert!(
        share(&counts, 75.0, 90.0, Some(0)) >= 0.98,
        "{}",
        share(&counts, 75.0, 90.0, Some(0))
    );
    assert!(
        share(&counts, 95.0, 120.0, Some(1)) >= 0.98,
        "{}",
        share(&counts, 95.0, 120.0, Some(1))
    );
}

#[test]
fn who_goes_over_a_line_and_back_has_entered_and_left() {
    let simulator =
        simulator("0,300,2000,0\n35,300,2000,0\n40,4700,2000,0\n45,4700,2000,0\n50,300,2000,0\n");
    let (network, mut counter) = (Network::default(), Counter::new());
    // Across the way, and beside it: one line that is crossed, one whose ends the way passes.
    let [mut across, mut beside] =
        ["3.5,-0.5,3.5,7.5", "3.5,6.5,3.5,7.5"].map(|line| Gate::new(line.parse().unwrap()));
    let mut after_s = [0.0; 2];
    for (at_s, frame) in frames(&simulator, 0, 55, 10) {
        let Some(count) = counter.see(&network, at_s, &frame) else {
            continue;
        };
        let crossed = across.see(at_s, &count.excess);
        for (since, crossed) in after_s.iter_mut().zip(crossed) {
            if crossed > 0 {
                *since = at_s;
            }
        }
        beside.see(at_s, &count.excess);
    }
    assert_eq!((across.entered, across.left), (1, 1));
    assert_eq!((beside.entered, beside.left), (0, 0));
    let mut times = after_s;
    times.sort_by(f64::total_cmp);
    assert!(
        (37.0..38.5).contains(&times[0]) && (47.0..48.5).contains(&times[1]),
        "{times:?}"
    );
}

#[test]
fn a_text_that_is_no_line_is_refused() {
    for text in [
        "",
        "1,2,3",
        "1,2,1,2",
        "1,2,3,x",
        "1,2,3,4,5",
        "nan,1,2,3",
        "1e9,0,0,0",
    ] {
        assert!(text.parse::<grideye_count::Line>().is_err(), "{text}");
    }
}

/// A warm spot of 3 x 3 pixels around this row.
fn spot(row: usize) -> [f32; 64] {
    std::array::from_fn(|pixel| {
        let is_near = (pixel / 8).abs_diff(row) <= 1 && (pixel % 8).abs_diff(4) <= 1;
        if is_near { 2.0 } else { 0.0 }
    })
}

#[test]
fn down_over_a_line_from_left_to_right_is_entering_and_up_is_leaving() {
    // Who looks along the line, to the right, has the lower rows at the right hand.
    let mut gate = Gate::new("-0.5,3.5,7.5,3.5".parse().unwrap());
    let rows = [1, 1, 1, 2, 3, 4, 5, 6, 6, 5, 4, 3, 2, 1];
    let crossed: Vec<[u64; 2]> = (0..)
        .zip(rows)
        .map(|(tenth, row)| gate.see(f64::from(tenth) / 10.0, &spot(row)))
        .collect();
    let at = |wanted| crossed.iter().position(|crossed| *crossed == wanted);
    assert_eq!((at([1, 0]), at([0, 1])), (Some(5), Some(11)));
    assert_eq!((gate.entered, gate.left), (1, 1));
}
