//! The number of pixels in a header identifies files of other sensors.

use grideye_recording::{other_resolution, sensor_of};

fn header(pixels: usize) -> String {
    let names: String = (0..pixels).map(|index| format!(",pixel{index}")).collect();
    format!("timestamp,thermistor{names},people_number,confidence\n")
}

#[test]
fn the_resolution_of_another_sensor_is_named() {
    // Headers of a Grid-EYE and of others, a faulty and a cut Grid-EYE header, and another kind of file.
    for (header, pixels) in [
        (header(64).as_bytes(), None),
        (header(768).as_bytes(), Some(768)),
        (header(16).as_bytes(), Some(16)),
        (header(63).as_bytes(), None),
        (&header(64).as_bytes()[..60], None),
        (b"a,b\n1,2\n", None),
    ] {
        let shown = String::from_utf8_lossy(header);
        assert_eq!(other_resolution(header), pixels, "{shown}");
    }
    assert!(sensor_of(768).contains("32 x 24"));
}
