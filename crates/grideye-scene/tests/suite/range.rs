//! A sensor's detectable range: temperatures beyond it are reported as its nearest end, including noise.

use crate::{CEILING, ROOM, object, parse, scene};
use grideye_scene::Simulator;
use std::time::Duration;

fn oven(range: &str) -> [Simulator; 2] {
    let hot = object(
        "oven",
        [1000.0, 3000.0, 0.0],
        [2000.0, 6000.0, 2500.0],
        0.0,
        90.0,
    );
    let scene = scene(&format!("{ROOM}{hot}{CEILING}{range}"));
    [
        Simulator::new(&scene.on_grid(), "ceiling").unwrap(),
        Simulator::new(&scene, "ceiling").unwrap(),
    ]
}

#[test]
fn temperatures_beyond_the_range_are_reported_as_its_end() {
    for (limited, free) in oven("detectable_range_c = [0, 85.5]\n")
        .iter()
        .zip(oven(""))
    {
        let free = free.image(Duration::ZERO).celsius;
        assert!(free.iter().any(|celsius| *celsius > 86.0));
        assert!(free.iter().any(|celsius| *celsius < 85.0));
        let limited = limited.image(Duration::ZERO).celsius;
        for (limited, free) in limited.iter().zip(free) {
            assert_eq!(*limited, if free > 85.5 { 85.5 } else { free });
        }
    }
    for simulator in oven("detectable_range_c = [95, 100]\n") {
        let image = simulator.image(Duration::ZERO);
        assert!(image.celsius.iter().all(|celsius| *celsius == 95.0));
    }
}

/// Noise on a pixel far beyond the end leaves it at the end, because noise comes before the converter's limit.
#[test]
fn noise_comes_before_the_range() {
    let [limited, _] = oven("detectable_range_c = [0, 80]\n");
    let [free, _] = oven("");
    for frame in 0..20 {
        let time = Duration::from_millis(frame * 100);
        let (limited, free) = (limited.noisy(time, 7).celsius, free.noisy(time, 7).celsius);
        for (limited, free) in limited.iter().zip(free) {
            assert_eq!(*limited, free.clamp(0.0, 80.0));
        }
    }
}

#[test]
fn invalid_ranges_are_refused() {
    for range in ["[80, 0]", "[10, 10]", "[-300, 80]", "[0, nan]", "[0, 6000]"] {
        let text = format!("{ROOM}{CEILING}detectable_range_c = {range}\n");
        let refused = parse(&text).unwrap_err().to_string();
        let expected = format!(
            "room.toml:10:22: `detectable_range_c` is {range}, expected [lowest, highest] °C"
        );
        assert!(refused.starts_with(&expected), "{refused}");
    }
}
