//! How often a sketch tears a frame by each way of reading, beside what the bus time predicts.

use crate::kit::{Checkout, EXAMPLE, MACHINE, WITHOUT_CXX, on_the_bus, path, read, transactions};
use grideye_tests::programs::{is_left_out, root, run};
use std::fmt::Write as _;
use std::path::Path;

/// What a way of reading gave, beside what the bus time says of it.
#[derive(Default, Debug)]
struct Count {
    reads: usize,
    torn: usize,
    predicted: usize,
    differ: usize,
    expected: f64,
}

/// The sensor has a frame each 0.1 s of the trace's clock, and a transaction holds the one of its START (reference, 1.4).
/// So a frame is torn exactly if the START of its last transaction is not in the same tenth of a second as the first's.
fn count(printed: &str, trace: &Path, way: &str) -> Count {
    let mut transactions = transactions(trace).into_iter();
    let mut count = Count::default();
    for (number, line) in printed.lines().enumerate() {
        let each = match line.split_once(':').unwrap().0 {
            "one burst" | "32-byte parts, held" => 1,
            "32-byte parts" => 4,
            _ => 64,
        };
        let starts: Vec<f64> = transactions
            .by_ref()
            .take(each)
            .map(|t| t.start_s)
            .collect();
        // The first frame is not there yet.
        if number < 4 || line.split(':').next() != Some(way) || starts.len() < each {
            continue;
        }
        let (first, last) = (starts[0] / 0.1, starts[each - 1] / 0.1);
        let is_torn = line.contains("torn");
        let is_predicted = first.floor() < last.floor();
        count.reads += 1;
        count.torn += usize::from(is_torn);
        count.predicted += usize::from(is_predicted);
        count.differ += usize::from(is_torn != is_predicted);
        count.expected += last - first;
    }
    count
}

/// What the example's sketch prints, where only the bus and delay() take time; and the folder with the trace.
fn reads(flags: &str) -> Option<(String, tempfile::TempDir)> {
    if is_left_out(WITHOUT_CXX, "how Arduino sketches tear frames") {
        return None;
    }
    let checkout = Checkout::new();
    let machine = root().join(MACHINE).canonicalize().unwrap();
    let line = format!(
        "make build/reads SENSORS={} CXXFLAGS={flags}",
        path(&machine)
    );
    let made = checkout.run(&line, &checkout.folder());
    assert_eq!(made.code, 0, "{made:?}");
    let sketch = checkout.folder().join("build/reads");
    let folder = tempfile::tempdir().unwrap();
    let trace = folder.path().join("bus");
    let ended = run(&mut on_the_bus("ticking", &trace, &sketch));
    assert_eq!(ended.code, 0, "{ended:?}");
    Some((ended.stdout, folder))
}

/// One burst is cut to 32 bytes, and what the sketch takes for the rest is -1: -0.25 °C. The other ways tear, each of the
/// frames that the bus time says, as the page has it: nothing here depends on the computer.
#[test]
fn each_way_of_reading_tears_the_frames_that_the_bus_time_says() {
    let Some((printed, folder)) = reads("") else {
        return;
    };
    let trace = folder.path().join("bus");
    let mut table = String::new();
    for way in ["32-byte parts", "32-byte parts, held", "by pixel"] {
        let Count {
            reads,
            torn,
            predicted,
            differ,
            expected,
        } = count(&printed, &trace, way);
        writeln!(
            table,
            "{way}: {torn} of {reads} torn, {predicted} predicted, by time {expected:.1}"
        )
        .unwrap();
        assert!(reads == 199 && differ == 0, "{differ} {table}");
        let page = read(&format!("{EXAMPLE}/README.md"));
        let on_the_page = format!("| {torn} of {reads}, {predicted} |");
        assert!(page.contains(&on_the_page), "{table}");
    }
    print!("{table}");
    assert!(count(&printed, &trace, "by pixel").torn > 40, "{table}");
    // As Adafruit_BusIO reads on an AVR: no update comes in between.
    assert_eq!(count(&printed, &trace, "32-byte parts, held").torn, 0);
    let bursts = printed.lines().filter(|line| line.starts_with("one burst"));
    for burst in bursts {
        assert_eq!(burst, "one burst: 32 bytes, torn at pixel 17: -0.25");
    }
}

/// With the buffer of an ESP32 the burst is whole, and never torn.
#[test]
fn one_burst_in_a_larger_buffer_is_never_torn() {
    let Some((printed, folder)) = reads("-DBUFFER_LENGTH=128") else {
        return;
    };
    let count = count(&printed, &folder.path().join("bus"), "one burst");
    assert!(count.reads == 199 && count.torn == 0, "{count:?}");
    for burst in printed.lines().filter(|line| line.starts_with("one burst")) {
        assert_eq!(burst, "one burst: 128 bytes, whole");
    }
}
