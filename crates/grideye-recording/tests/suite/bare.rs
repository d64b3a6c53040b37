//! Files of temperatures only. numpy 2.3 wrote the `.npy` bytes (`numpy.save`).

use amg8833::word;
use core::time::Duration;
use grideye_frame::ThermistorWord;
use grideye_recording::bare::{Assumed, NpyReader, RowReader};
use grideye_recording::{Layout, RecordingError, Row, StreamId, sniff};

fn assumed() -> Assumed {
    Assumed {
        stream: StreamId {
            device: "imported".to_owned(),
            sensor: "grid-eye".to_owned(),
            boot: "walk".to_owned(),
        },
        thermistor: Some(ThermistorWord(0x190)),
        period: Duration::from_millis(100),
    }
}

fn rows(text: &str) -> Result<Vec<Row>, RecordingError> {
    RowReader::new(text.as_bytes(), assumed()).collect()
}

fn fault(text: &str) -> String {
    rows(text).unwrap_err().to_string()
}

fn celsius(row: &Row) -> Vec<f32> {
    let frame = row.record.reading.frame().unwrap();
    assert_eq!(frame.thermistor, Some(ThermistorWord(0x190)));
    word::pixels(&frame.pixels)
        .iter()
        .map(|pixel| pixel.get())
        .collect()
}

/// 0, 0.25 … 15.75 °C.
fn ramp() -> Vec<String> {
    (0..64)
        .map(|index| format!("{}", f64::from(index) / 4.0))
        .collect()
}

#[test]
fn rows_are_read_with_any_separator() {
    let wanted: Vec<f32> = (0..64u8).map(|index| f32::from(index) / 4.0).collect();
    let exponents: Vec<String> = (0..64)
        .map(|i| format!("{:.18e}", f64::from(i) / 4.0))
        .collect();
    for text in [
        format!("{}\n", ramp().join(",")),
        format!("[{}]\r\n", ramp().join(", ")),
        format!("# frames\n\n{}\n", ramp().join("\t")),
        format!("\u{feff}{}\n", ramp().join(";")),
        // numpy.savetxt.
        format!("{}\n", exponents.join(" ")),
        format!("{}\n{}\n", vec!["p"; 64].join(","), ramp().join(",")),
    ] {
        assert_eq!(sniff(&text), Some(Layout::Rows), "{text:.60}");
        let rows = rows(&text).unwrap();
        assert_eq!(rows.len(), 1, "{text:.60}");
        assert_eq!(celsius(&rows[0]), wanted, "{text:.60}");
    }
}

#[test]
fn times_are_those_of_the_rows_or_of_the_rate() {
    let line = ramp().join(",");
    let untimed = rows(&format!("{line}\n{line}\n{line}\n")).unwrap();
    let boot = |rows: &[Row]| {
        rows.iter()
            .map(|row| row.record.stamp.t_boot_ns)
            .collect::<Vec<_>>()
    };
    assert_eq!(boot(&untimed), [0, 100_000_000, 200_000_000]);
    let seconds = rows(&format!("5.5,{line}\n6.75,{line}\n")).unwrap();
    assert_eq!(boot(&seconds), [0, 1_250_000_000]);
    assert_eq!(seconds[1].record.stamp.t_utc_ns, 0);
    for unix in ["1625163247.5", "1625163247500"] {
        let timed = rows(&format!("{unix},{line}\n")).unwrap();
        assert_eq!(
            timed[0].record.stamp.t_utc_ns, 1_625_163_247_500_000_000,
            "{unix}"
        );
        assert_eq!(timed[0].record.stamp.t_boot_ns, 0);
    }
    let back = fault(&format!("6,{line}\n5,{line}\n"));
    assert!(
        back.starts_with("line 2, column time: expected a time that is not before 6 s"),
        "{back}"
    );
}

#[test]
fn a_fault_is_named_with_its_place() {
    let line = ramp().join(",");
    let cut = &line[..line.len() - 1];
    for (text, said) in [
        (
            format!("{line}\n1,2,3\n"),
            "line 2: expected 64 fields, found 3",
        ),
        (
            format!("{line}\n{}\n", line.replace("15.75", "15.8")),
            "line 2, column pixel64: expected a multiple of 0.25 degrees",
        ),
        (
            format!("{line}\n{}\n", line.replace("15.75", "warm")),
            "line 2, column pixel64: expected a number, found \"warm\"",
        ),
        (
            format!("{}\n", line.replace("15.75", "600")),
            "line 1, column pixel64: expected a multiple of 0.25",
        ),
        (
            format!("{}\n", line.replace("15.75", "nan")),
            "line 1, column pixel64",
        ),
        (
            format!("{line}\n{cut}"),
            "line 2: expected a newline at its end",
        ),
    ] {
        let found = fault(&text);
        assert!(found.starts_with(said), "{found}");
    }
}

/// `numpy.save` of `numpy.arange(128, dtype="<f4").reshape(2, 8, 8) / 4`, and the like.
fn npy(kind: &str, shape: &str, numbers: &[u8]) -> Vec<u8> {
    let dictionary = format!("{{'descr': '{kind}', 'fortran_order': False, 'shape': {shape}, }}");
    let padded = format!("{dictionary:117}\n");
    [b"\x93NUMPY\x01\x00\x76\x00", padded.as_bytes(), numbers].concat()
}

fn quarter_steps(count: u16) -> Vec<u8> {
    (0..count)
        .flat_map(|index| (f32::from(index) / 4.0).to_le_bytes())
        .collect()
}

fn array(bytes: &[u8]) -> Result<Vec<Row>, RecordingError> {
    NpyReader::new(bytes, assumed())?.collect()
}

#[test]
fn numpys_arrays_are_read_and_frames_of_nothing_are_gaps() {
    let mut numbers = quarter_steps(128);
    let file = npy("<f4", "(2, 8, 8)", &numbers);
    assert_eq!(sniff(&file), Some(Layout::Npy));
    let rows = array(&file).unwrap();
    assert_eq!(rows.len(), 2);
    assert_eq!(celsius(&rows[1])[63], 31.75);
    assert_eq!(array(&npy("<f4", "(2, 64)", &numbers)).unwrap(), rows);
    let doubles: Vec<u8> = (0..64u8)
        .flat_map(|index| (f64::from(index) / 4.0).to_le_bytes())
        .collect();
    assert_eq!(
        array(&npy("<f8", "(1, 8, 8)", &doubles)).unwrap(),
        rows[..1]
    );
    numbers[..256].copy_from_slice(&f32::NAN.to_le_bytes().repeat(64));
    let gap = array(&npy("<f4", "(2, 8, 8)", &numbers)).unwrap();
    assert_eq!(
        gap.iter().map(|row| row.record.seq).collect::<Vec<_>>(),
        [1]
    );
}

#[test]
fn an_array_of_something_else_is_refused_with_what_was_expected() {
    let numbers = quarter_steps(128);
    let fault = |bytes: &[u8]| array(bytes).unwrap_err().to_string();
    for (file, said) in [
        (
            npy("<i2", "(2, 8, 8)", &numbers),
            "expected numbers of kind '<f4' or '<f8', in °C, found '<i2'",
        ),
        (
            npy("<f4", "(2, 24, 32)", &numbers),
            "expected the shape (N, 8, 8) or (N, 64), found (2, 24, 32)",
        ),
        (
            npy("<f4", "(3, 8, 8)", &numbers),
            "expected 3 frames, as the heading says, found 2 whole ones, then",
        ),
    ] {
        let found = fault(&file);
        assert!(found.starts_with(said), "{found}");
    }
    let mut turned = npy("<f4", "(2, 8, 8)", &numbers);
    let order = turned.windows(5).position(|five| five == b"False").unwrap();
    turned[order..order + 5].copy_from_slice(b"True ");
    assert!(
        fault(&turned).starts_with("expected the order of C"),
        "{}",
        fault(&turned)
    );
    // Cut at any byte: complete frames, then an error; never an invented frame.
    let file = npy("<f4", "(2, 8, 8)", &numbers);
    for length in 0..file.len() {
        let Ok(reader) = NpyReader::new(&file[..length], assumed()) else {
            assert!(length < 128, "{length}");
            continue;
        };
        let read: Vec<_> = reader.collect();
        assert!(read.last().unwrap().is_err(), "{length}");
        assert_eq!(read.len() - 1, (length - 128) / 256, "{length}");
    }
}

#[test]
fn rows_cut_at_any_byte_give_the_rows_before_the_cut() {
    let text = format!("{0}\n{0}\n", ramp().join(","));
    let line = text.len() / 2;
    for length in 0..text.len() {
        let read: Vec<_> = RowReader::new(&text.as_bytes()[..length], assumed()).collect();
        let whole = read.iter().filter(|row| row.is_ok()).count();
        assert_eq!(whole, length / line, "{length}");
        assert_eq!(read.len() > whole, length % line != 0, "{length}");
    }
}
