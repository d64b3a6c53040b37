//! Layouts of text and JSON that are read without options.

use crate::support::{
    assert_frames, celsius, guessed, pixels, printed, refusal, rows, said, thermistor,
};
use grideye_import::Import;
use grideye_recording::{ClockState, Row, csv};

const FRAMES: usize = 12;
/// 2018-03-14 06:18:42.8 UTC, as one of the public recordings begins.
const BEGIN_NS: i64 = 1_521_008_322_800_000_000;

fn lines(line: impl Fn(usize) -> String) -> String {
    (0..FRAMES).map(|frame| line(frame) + "\n").collect()
}

fn unix(frame: usize) -> String {
    format!(
        "{}.{}46",
        1_521_008_322 + (8 + frame) / 10,
        (8 + frame) % 10
    )
}

fn block(frame: usize, separator: &str) -> String {
    let rows = celsius(frame);
    let rows = rows.chunks(8).map(|row| {
        row.iter()
            .map(f64::to_string)
            .collect::<Vec<_>>()
            .join(separator)
    });
    rows.collect::<Vec<_>>().join("\n")
}

#[test]
fn rows_of_64_are_read_with_any_separator_and_header() {
    let named = |name: fn(usize) -> String| (0..64).map(name).collect::<Vec<_>>().join(",") + "\n";
    for text in [
        lines(|frame| printed(frame, ",")),
        lines(|frame| printed(frame, ", ") + ","),
        lines(|frame| printed(frame, "\t")),
        lines(|frame| printed(frame, ";").replace('.', ",")),
        lines(|frame| printed(frame, " ").replace('.', ",")),
        lines(|frame| format!("[{}]", printed(frame, ", "))),
        lines(|frame| format!("[[{}]]", block(frame, "  ").replace('\n', "]\n ["))),
        lines(|frame| {
            celsius(frame)
                .map(|value| format!("{value:.18e}"))
                .join(" ")
        }),
        lines(|frame| format!("Thermal Camera Data:\n{}\n", block(frame, "\t"))),
        "# 64 pixels\n\n".to_owned() + &lines(|frame| printed(frame, ",")),
        "\u{feff}".to_owned() + &lines(|frame| printed(frame, ",")).replace('\n', "\r\n"),
        named(|pixel| format!("p{pixel}")) + &lines(|frame| printed(frame, ",")),
        named(|pixel| format!("\"Pixel {}\"", pixel + 1)) + &lines(|frame| printed(frame, ",")),
        named(|pixel| pixel.to_string()) + &lines(|frame| printed(frame, ",")),
        named(|pixel| format!("r{}c{}", pixel / 8, pixel % 8))
            + &lines(|frame| printed(frame, ",")),
    ] {
        let rows = rows(text.as_str());
        assert_frames(&rows, FRAMES, &text[..40]);
        assert_eq!(rows[3].record.stamp.t_boot_ns, 300_000_000, "{text:.40}");
        assert_eq!((rows[3].record.seq, rows[3].record.stamp.t_utc_ns), (3, 0));
        assert_eq!(thermistor(&rows[3]), None);
        assert!(rows[3].labels.is_empty(), "{text:.40}");
    }
}

#[test]
fn pixels_are_ordered_by_their_names() {
    let names: Vec<String> = (0..64).rev().map(|pixel| format!("p{pixel}")).collect();
    let backwards = |frame: usize| {
        let mut values = celsius(frame);
        values.reverse();
        values.map(|value| value.to_string()).join(",")
    };
    let text = names.join(",") + "\n" + &lines(backwards);
    assert_frames(&rows(text), FRAMES, "backwards");
}

#[test]
fn times_are_kept_to_the_nanosecond() {
    for (stamp, begin_ns) in [
        ("1795199399.998", 1_795_199_399_998_000_000),
        ("1795199399998", 1_795_199_399_998_000_000),
        ("1795199399998001", 1_795_199_399_998_001_000),
        ("1795199399998001002", 1_795_199_399_998_001_002),
        ("2021-07-01T18:14:07.123456789Z", 1_625_163_247_123_456_789),
        ("2021-07-01 20:14:07.25+02:00", 1_625_163_247_250_000_000),
        ("2021-07-01,18:14:07.25", 1_625_163_247_250_000_000),
        ("Tue Nov 21 04:09:25 2017", 1_511_237_365_000_000_000),
    ] {
        let rows = rows(format!("{stamp},{}\n", printed(0, ",")));
        assert_frames(&rows, 1, stamp);
        assert_eq!(rows[0].record.stamp.t_utc_ns, begin_ns, "{stamp}");
        assert_eq!(rows[0].record.stamp.clock, ClockState::Unsynced);
    }
    // A JSON number is one of floating point, and still means its shortest decimal.
    let text = format!("{{\"t\":1795199399.998,\"frame\":[{}]}}\n", printed(0, ","));
    assert_eq!(
        rows(text)[0].record.stamp.t_utc_ns,
        1_795_199_399_998_000_000
    );
    // Stamps that are all the same say nothing about when each frame was.
    let text = lines(|frame| format!("1795199399,{}", printed(frame, ",")));
    let mut import = guessed(text);
    assert!(
        import
            .account()
            .to_string()
            .contains("all times are the same")
    );
    let last = import.by_ref().map(Result::unwrap).last().unwrap();
    assert_eq!(
        (last.record.stamp.t_utc_ns, last.record.stamp.t_boot_ns),
        (0, 1_100_000_000)
    );
}

#[test]
fn times_may_be_beside_or_before_a_frame_in_any_form() {
    for text in [
        lines(|frame| format!("{} \"[{}]\"", unix(frame), printed(frame, ", "))),
        lines(|frame| format!("{},\"[{}]\"", unix(frame), printed(frame, ", "))),
        "time,frame\n".to_owned()
            + &lines(|frame| format!("{},\"[{}]\"", unix(frame), printed(frame, " "))),
        lines(|frame| format!("{}\n{}", unix(frame), printed(frame, ","))),
        lines(|frame| format!("{}\n{}", unix(frame), block(frame, " "))),
        lines(|frame| format!("Time: {} s\n{}", unix(frame), block(frame, ","))),
        lines(|frame| format!("{},{}", printed(frame, ","), unix(frame))),
        lines(|frame| format!("{frame},{},{}", unix(frame), printed(frame, ","))),
        lines(|frame| {
            format!(
                "{{\"pixels\":[{}],\"ts\":{}}}",
                printed(frame, ","),
                unix(frame)
            )
        }),
    ] {
        let rows = rows(text.as_str());
        assert_frames(&rows, FRAMES, &text[..60]);
        let at = |row: &Row| (row.record.stamp.t_utc_ns, row.record.stamp.t_boot_ns);
        assert_eq!(at(&rows[0]), (BEGIN_NS + 46_000_000, 0), "{text:.60}");
        assert_eq!(at(&rows[11]), (BEGIN_NS + 1_146_000_000, 1_100_000_000));
    }
}

#[test]
fn a_time_of_day_takes_its_day_from_the_name_and_passes_midnight() {
    let text = lines(|frame| match frame {
        0..6 => format!("23:59:59.{frame},{}", printed(frame, ",")),
        _ => format!("00:00:00.{},{}", frame - 6, printed(frame, ",")),
    });
    let read = |name: &str| {
        said(text.as_str(), name, "")
            .unwrap()
            .map(Result::unwrap)
            .collect::<Vec<_>>()
    };
    let dated = read("walk 2021-07-01.csv");
    // `date -d 2021-07-02 +%s`
    assert_eq!(dated[6].record.stamp.t_utc_ns, 1_625_184_000_000_000_000);
    assert_eq!(dated[6].record.stamp.t_boot_ns, 1_000_000_000);
    let undated = read("walk.csv");
    assert_eq!(undated[6].record.stamp.t_utc_ns, 0);
    assert_eq!(undated[6].record.stamp.t_boot_ns, 1_000_000_000);
}

#[test]
fn a_clock_that_is_set_back_is_a_step() {
    let text = lines(|frame| {
        format!(
            "{},{}",
            unix(if frame < 6 { frame } else { frame - 6 }),
            printed(frame, ",")
        )
    });
    let rows = said(text, "walk.csv", "time=1")
        .unwrap()
        .map(Result::unwrap)
        .collect::<Vec<_>>();
    let stamp = rows[6].record.stamp;
    assert_eq!(stamp.clock, ClockState::Stepped);
    assert_eq!(
        (stamp.t_utc_ns, stamp.t_boot_ns),
        (BEGIN_NS + 46_000_000, 600_000_000)
    );
}

#[test]
fn a_thermistor_a_number_and_labels_are_told_from_names() {
    let names: Vec<String> = (1..=64).map(|pixel| format!("pixel{pixel}")).collect();
    let header = format!("frame,{},Thermistor (C),people,x\n", names.join(","));
    let text = header
        + &lines(|frame| {
            format!(
                "{},{},25.0625,{},-0.{frame}",
                7 + 2 * frame,
                printed(frame, ","),
                frame % 3
            )
        });
    let mut import = guessed(text);
    assert_eq!(import.labels(), ["people", "x"]);
    let told = import.account().to_string();
    assert!(
        told.contains("thermistor  column 66 (Thermistor (C))"),
        "{told}"
    );
    let rows: Vec<Row> = import.by_ref().map(Result::unwrap).collect();
    assert_frames(&rows, FRAMES, "named");
    assert_eq!(thermistor(&rows[4]), Some(25.0625));
    assert_eq!(rows[4].labels, ["1", "-0.4"]);
    assert_eq!(rows[4].record.seq, 8, "every other number");
    assert_eq!(import.tally().unwrap().frames, 12);
}

#[test]
fn columns_without_names_are_told_from_values() {
    let beside = |before: &str, after: &str| {
        let text = lines(|frame| {
            let fill = |text: &str| {
                text.replace(
                    "TH",
                    &format!("25.{}", if frame % 2 == 0 { "0625" } else { "125" }),
                )
                .replace('N', &frame.to_string())
            };
            format!("{}{}{}", fill(before), printed(frame, ","), fill(after))
        });
        guessed(text)
    };
    let read = |import: Import| import.map(Result::unwrap).collect::<Vec<Row>>();
    let warm = read(beside("N,", ",TH"));
    assert_frames(&warm, FRAMES, "number and thermistor");
    assert_eq!(
        (warm[3].record.seq, thermistor(&warm[3])),
        (3, Some(25.125))
    );
    let labeled = beside("", ",1,two people");
    assert_eq!(
        labeled.labels(),
        ["column65"],
        "a text that is always the same is a caption"
    );
    assert_frames(&read(labeled), FRAMES, "a label");
    let whole = beside("", ",19");
    assert_eq!(whole.labels(), ["column65"]);
}

/// Frames of a room with the noise of a real unit, about one step of 0.25 °C, and its pattern.
fn noisy(frame: usize, room_c: f64) -> [f64; 64] {
    let mut state = u32::try_from(frame).unwrap().wrapping_mul(747_796_405) + 1;
    let mut random = || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        f64::from(state >> 16) / 65_536.0 - 0.5
    };
    std::array::from_fn(|pixel| {
        let pattern = f64::from(u8::try_from(pixel * 29 % 13).unwrap()) / 13.0;
        let noise = (0..4).map(|_| random()).sum::<f64>() * 0.42;
        ((room_c + pattern + noise) * 4.0).round() / 4.0
    })
}

#[test]
fn raw_words_are_told_from_degrees_by_their_noise() {
    let written = |room_c: f64, number: fn(f64) -> f64| {
        lines(|frame| {
            noisy(frame, room_c)
                .map(|value| number(value).to_string())
                .join(",")
        })
    };
    let read = |text: String| pixels(&rows(text)[0]);
    for room_c in [21.0, 16.0, 7.0] {
        assert_eq!(
            read(written(room_c, |value| value * 4.0)),
            noisy(0, room_c),
            "words"
        );
        assert_eq!(
            read(written(room_c, f64::round)),
            noisy(0, room_c).map(f64::round),
            "whole °C"
        );
        // 70 °F and the word of 17.5 °C are both rooms.
        let found = refusal(written(room_c, |value| (value * 1.8 + 32.0).round()), "");
        assert!(
            found.starts_with("the unit of the pixels is not clear"),
            "{found}"
        );
    }
    // A sensor that is read twice as often as it measures gives each frame twice.
    let twice = lines(|frame| {
        noisy(frame / 2, 16.0)
            .map(|value| (value * 4.0).to_string())
            .join(",")
    });
    assert_eq!(read(twice), noisy(0, 16.0));
    let below = read(written(0.0, |value| (value * 4.0).rem_euclid(4_096.0)));
    assert_eq!(below, noisy(0, 0.0), "twelve bits, AMG88 spec 4-11-11");
    let found = refusal(
        written(0.0, |value| {
            if value < 0.0 {
                2_048.0 - value * 4.0
            } else {
                value * 4.0
            }
        }),
        "",
    );
    assert!(
        found.contains("--columns unit=words-sign-magnitude"),
        "{found}"
    );
}

#[test]
fn the_unit_of_fractions_is_told_by_their_steps() {
    let written =
        |number: fn(f64) -> String| lines(|frame| noisy(frame, 21.0).map(number).join(","));
    for text in [
        written(|value| format!("{:.2}", value * 1.8 + 32.0)),
        written(|value| format!("{:.1}", value * 1.8 + 32.0)),
        written(|value| format!("{:.2}", value + 273.15)),
        written(|value| format!("{value:.1}")),
        written(|value| format!("{:.2}", value + 0.13)),
    ] {
        let found = pixels(&rows(text.as_str())[0]);
        let near = |(found, expected): (&f64, &f64)| (found - expected).abs() < 0.26;
        assert!(found.iter().zip(&noisy(0, 21.0)).all(near), "{text:.40}");
    }
    for (text, unit) in [
        (
            written(|value| format!("{:.1}", value * 10.0)),
            "unit=tenths",
        ),
        (
            written(|value| format!("{:.0}", value * 100.0)),
            "unit=hundredths",
        ),
        (
            written(|value| format!("{:.4}", (value - 21.5) / 1.7)),
            "unit=celsius",
        ),
        (
            written(|value| format!("{value:.3}").replace('5', "6")),
            "unit=celsius",
        ),
    ] {
        let found = refusal(text, "");
        assert!(found.contains(&format!("--columns {unit}")), "{found}");
    }
}

#[test]
fn one_decimal_is_enough_and_is_told() {
    let text = lines(|frame| celsius(frame).map(|value| format!("{value:.1}")).join(","));
    let mut import = guessed(text);
    let rows: Vec<Row> = import.by_ref().map(Result::unwrap).collect();
    assert_frames(&rows, FRAMES, "one decimal");
    let tally = import.tally().unwrap();
    assert!(tally.between > 0 && tally.farthest_c < 0.051, "{tally}");
    assert!(!tally.has_loss());
}

#[test]
fn json_is_read_in_lines_arrays_and_columns() {
    let object = |frame: usize| {
        format!(
            "{{\"time\":\"2021-07-01T18:14:07.{frame:02}Z\",\"who\":null,\"data\":[{}]}}",
            printed(frame, ",")
        )
    };
    let all =
        |each: &dyn Fn(usize) -> String| (0..FRAMES).map(each).collect::<Vec<_>>().join(",\n");
    let nested = |frame: usize| format!("[[{}]]", block(frame, ",").replace('\n', "],["));
    for text in [
        lines(object),
        format!("[{}]", all(&object)),
        format!("{{\"frames\":[{}],\"site\":\"x\"}}", all(&object)),
        format!("[{}]", all(&nested)),
        format!("{{\"frames\":[{}]}}", all(&nested)),
        lines(|frame| {
            format!(
                "{{\"p\":{{{}}}}}",
                celsius(frame)
                    .iter()
                    .enumerate()
                    .map(|(pixel, value)| format!("\"{pixel}\":{value}"))
                    .collect::<Vec<_>>()
                    .join(",")
            )
        }),
    ] {
        assert_frames(&rows(text.as_str()), FRAMES, &text[..40]);
    }
}

#[test]
fn rows_of_several_sensors_are_streams_of_their_own() {
    let names: Vec<String> = (0..64).map(|pixel| format!("p{pixel}")).collect();
    let text = format!("sensor,{}\n", names.join(","))
        + &lines(|frame| format!("{},{}", ["left", "right"][frame % 2], printed(frame, ",")));
    let rows = rows(text);
    let ids: Vec<(&str, u64)> = rows
        .iter()
        .map(|row| (row.stream.sensor.as_str(), row.record.seq))
        .collect();
    assert_eq!(
        ids[..4],
        [("left", 0), ("right", 0), ("left", 1), ("right", 1)]
    );
}

#[test]
fn what_is_said_overrides_what_is_guessed() {
    let text = lines(|frame| format!("{},{},{}", 18 + frame % 2, printed(frame, ","), 30 + frame));
    let read = |columns: &str| {
        said(text.as_str(), "walk.csv", columns)
            .unwrap()
            .map(Result::unwrap)
            .collect::<Vec<Row>>()
    };
    let warm = read("thermistor=1,pixels=2-65,time=none,number=none");
    assert_frames(&warm, FRAMES, "said");
    assert_eq!(thermistor(&warm[1]), Some(19.0));
    assert_eq!(warm[1].labels, ["31"]);
}

#[test]
fn a_recording_is_read_with_its_labels() {
    let text = lines(|frame| format!("{},{frame}", printed(frame, ",")));
    let row = said(text, "walk.csv", "pixels=1-64,label=65")
        .unwrap()
        .next()
        .unwrap()
        .unwrap();
    let mut writer = csv::Writer::with_labels(Vec::new(), &["people, number".to_owned()]).unwrap();
    writer.write(&row).unwrap();
    let back = guessed(writer.finish().unwrap());
    assert_eq!(back.labels(), ["people; number"]);
    let back: Vec<Row> = back.map(Result::unwrap).collect();
    assert_eq!(
        (back[0].record, back[0].labels.as_slice()),
        (row.record, &["0".to_owned()][..])
    );
}
