//! Characterization of real recordings, against figures that other programs measured on the same files, and of
//! recordings with planted faults.
#![expect(
    clippy::unwrap_used,
    clippy::as_conversions,
    clippy::cast_precision_loss,
    reason = "what fails in a helper fails the test, and its counts are small"
)]

use grideye_frame::{NoData, PIXELS, PixelWord, Reading, RecordedFrame, ThermistorWord};
use grideye_recording::{ClockState, Record, Stamp};
use grideye_scene::profile::Profile;
use grideye_validator::characterize::{
    Characterization, CharacterizeError, Characterizer, FRAMES_MIN, characterize,
};
use std::fs::File;
use std::path::Path;

const SESSION_2: &str = "Session2_2021-07-01_RoomB_v2.csv";
const SESSION_3: &str = "Session3_2021-07-06_RoomA_v2.csv";

fn records(name: &str) -> Vec<Record> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../../recordings/linaige")
        .join(name);
    let rows = grideye_import::open(File::open(path).unwrap(), name, &Default::default());
    rows.unwrap().map(|row| row.unwrap().record).collect()
}

fn found(name: &str) -> Characterization {
    characterize(records(name)).unwrap()
}

fn pixels(record: &Record) -> [f64; PIXELS] {
    // Words decoded by hand from the datasheet; both sessions are above zero.
    record
        .reading
        .frame()
        .unwrap()
        .pixels
        .map(|word| f64::from(word.0 & 0xFFF) * 0.25)
}

/// Reference, "Values" and "Time": steps, sigma about 0.33 (0.2 to 0.55), 9.98 Hz, about 4.5 % torn, the five-frame
/// cycle.
#[test]
fn both_sessions_show_the_figures_of_the_reference() {
    for name in [SESSION_2, SESSION_3] {
        let found = found(name);
        assert_eq!(found.steps.pixel_c, Some(0.25), "{name}");
        assert_eq!(found.steps.thermistor_c, Some(0.0625), "{name}");
        let sigma_c = found.noise.median_c();
        assert!((0.32..0.34).contains(&sigma_c), "{name}: {sigma_c}");
        let (least, most) = found.noise.range_c();
        assert!(
            least > 0.2 && most < 0.55 && most > 1.5 * least,
            "{name}: {least} to {most}"
        );
        assert!(
            (found.timing.rate_hz - 9.98).abs() < 0.005,
            "{name}: {}",
            found.timing.rate_hz
        );
        let torn = found.faults.torn_share();
        assert!((0.043..0.048).contains(&torn), "{name}: {torn}");
        assert!(
            found.faults.torn_by_chance < 0.003,
            "{name}: {}",
            found.faults.torn_by_chance
        );
        assert_eq!(found.faults.duplicates, 0, "{name}");
        assert_eq!(found.faults.glitch_frames, 0, "{name}");
        let cycle = found.common_mode.unwrap().cycle.unwrap();
        // The sensor is 2 % slow: its five frames are 5.1 of the recording's.
        assert!((cycle.frames - 5.1).abs() < 0.03, "{name}: {cycle:?}");
        assert!((0.15..0.3).contains(&cycle.depth_c), "{name}: {cycle:?}");
        let pattern = found.pattern.unwrap();
        assert!(
            (0.15..=0.26).contains(&pattern.sd_c),
            "{name}: {}",
            pattern.sd_c
        );
        let above = found.thermistor.unwrap().offset_c;
        assert!((3.5..6.0).contains(&above), "{name}: {above}");
    }
}

/// Against plain differences over the rows that the reference names as an empty room.
#[test]
fn the_noise_of_each_pixel_is_that_of_the_empty_room() {
    for (name, empty) in [(SESSION_2, 1376..1476), (SESSION_3, 988..1160)] {
        let map = found(name).noise.sigma_c;
        let rows: Vec<[f64; PIXELS]> = records(name)[empty].iter().map(pixels).collect();
        let plain: Vec<f64> = (0..PIXELS)
            .map(|pixel| {
                let squares: Vec<f64> = rows
                    .windows(2)
                    .map(|pair| (pair[1][pixel] - pair[0][pixel]).powi(2))
                    .collect();
                (squares.iter().sum::<f64>() / squares.len() as f64 / 2.0).sqrt()
            })
            .collect();
        let mut ratios: Vec<f64> = map
            .iter()
            .zip(&plain)
            .map(|(map, plain)| map / plain)
            .collect();
        ratios.sort_by(f64::total_cmp);
        // A hundred rows determine a standard deviation to 9 %; the plain one includes the common mode.
        assert!((0.93..1.02).contains(&ratios[32]), "{name}: {}", ratios[32]);
        assert!(ratios[0] > 0.7 && ratios[63] < 1.3, "{name}: {ratios:?}");
    }
}

#[test]
fn session_3_jumps_back_by_804_seconds_and_session_2_does_not() {
    let timing = found(SESSION_3).timing;
    assert_eq!(timing.jumps, 1);
    assert_eq!(timing.listed_jumps[0].seq, 1056);
    assert!((timing.listed_jumps[0].by_s + 804.48).abs() < 0.01);
    assert_eq!(found(SESSION_2).timing.jumps, 0);
    assert_eq!(found(SESSION_2).timing.stalls, 1, "one interval of 448 ms");
}

/// Temperatures without a pattern, from a multiplicative generator.
struct Noise(u64);

impl Noise {
    fn next(&mut self, below: u64) -> u64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) % below
    }

    fn frame(&mut self) -> RecordedFrame {
        RecordedFrame {
            thermistor: Some(ThermistorWord(400)),
            pixels: std::array::from_fn(|_| PixelWord(80 + u16::try_from(self.next(7)).unwrap())),
        }
    }
}

fn record(seq: u64, frame: RecordedFrame) -> Record {
    Record {
        seq,
        stamp: Stamp {
            t_boot_ns: seq * 100_000_000,
            t_utc_ns: i64::try_from(seq).unwrap() * 100_000_000,
            clock: ClockState::Synced,
        },
        reading: Reading::Frame(frame),
    }
}

fn planted(change: impl FnOnce(&mut Vec<Record>)) -> Characterization {
    let mut noise = Noise(1);
    let mut records: Vec<Record> = (0..400).map(|seq| record(seq, noise.frame())).collect();
    change(&mut records);
    characterize(records).unwrap()
}

fn frame(record: &mut Record) -> &mut RecordedFrame {
    match &mut record.reading {
        Reading::Frame(frame) => frame,
        Reading::NoData(_) => unreachable!("the helper makes frames alone"),
    }
}

#[test]
fn a_sound_recording_has_no_faults() {
    let found = planted(|_| {});
    let faults = &found.faults;
    assert_eq!(
        (faults.torn, faults.duplicates, faults.glitch_frames),
        (0, 0, 0)
    );
    assert_eq!((found.skipped, found.gaps, found.timing.stalls), (0, 0, 0));
    // Seven equal steps of 0.25 have a standard deviation of 0.5; the cut at 3 sigma costs three of them.
    assert!(
        (found.noise.median_c() - 0.5).abs() < 0.03,
        "{}",
        found.noise.median_c()
    );
    assert_eq!(found.common_mode.unwrap().cycle, None);
    assert_eq!(found.sensor_hz(), Some(found.timing.rate_hz));
}

#[test]
fn each_planted_fault_is_counted_as_what_it_is() {
    let torn = planted(|records| {
        let before = *frame(&mut records[99]);
        frame(&mut records[100]).pixels[16..32].copy_from_slice(&before.pixels[16..32]);
    });
    assert_eq!((torn.faults.torn, torn.faults.duplicates), (1, 0));

    let twice = planted(|records| records[100].reading = records[99].reading);
    assert_eq!((twice.faults.torn, twice.faults.duplicates), (0, 1));
    assert_eq!(
        twice.sensor_hz(),
        None,
        "a duplicate shows that the reading is out of step"
    );

    let glitch = planted(|records| frame(&mut records[7]).pixels[13] = PixelWord(0));
    assert_eq!(
        (glitch.faults.glitch_frames, glitch.faults.glitch_pixels),
        (1, 1)
    );
    let [with, without] = [&glitch, &planted(|_| {})].map(|found| found.noise.sigma_c[13]);
    assert!(
        (with - without).abs() < 0.01,
        "a glitch must not count as noise: {with}, {without}"
    );

    let missing = planted(|records| {
        for record in &mut records[20..23] {
            record.reading = Reading::NoData(NoData::Nack);
        }
    });
    assert_eq!(missing.missing.get(&NoData::Nack), Some(&3));
    assert_eq!(missing.frames, 397);

    let skipped = planted(|records| drop(records.drain(50..60)));
    assert_eq!(
        (skipped.skipped, skipped.gaps, skipped.timing.stalls),
        (10, 1, 0)
    );

    let stalled = planted(|records| {
        for record in &mut records[200..] {
            record.stamp.t_boot_ns += 1_500_000_000;
            record.stamp.t_utc_ns += 1_500_000_000;
        }
    });
    assert_eq!(
        (stalled.timing.stalls, stalled.skipped, stalled.timing.jumps),
        (1, 0, 0)
    );
    assert!((stalled.timing.rate_hz - 10.0).abs() < 1e-6);
}

/// A person walks back and forth in front of every pixel: the noise stays the same.
#[test]
fn people_walking_through_do_not_raise_the_noise() {
    let walked = planted(|records| {
        for (step, record) in (0_usize..).zip(records) {
            let place = step / 4 % 8;
            for row in 0..8 {
                frame(record).pixels[row * 8 + place].0 += 14;
            }
        }
    });
    let still = planted(|_| {});
    let ratio = walked.noise.median_c() / still.noise.median_c();
    assert!((0.95..1.1).contains(&ratio), "{ratio}");
}

/// A sensor read at twice its rate still has its own cycle of five frames.
#[test]
fn a_sensor_read_twice_per_frame_shows_its_own_rate() {
    let mut noise = Noise(5);
    let mut frames = Vec::new();
    for number in 0..600 {
        let mut frame = noise.frame();
        if number % 5 == 0 {
            frame.pixels.iter_mut().for_each(|pixel| pixel.0 -= 2);
        }
        frames.extend([frame, frame]);
    }
    let records = (0..).zip(frames).map(|(seq, frame)| {
        let mut record = record(seq, frame);
        record.stamp.t_boot_ns /= 2;
        record.stamp.t_utc_ns /= 2;
        record
    });
    let found = characterize(records).unwrap();
    assert!((found.timing.rate_hz - 20.0).abs() < 1e-6);
    assert!((found.faults.duplicate_share() - 0.5).abs() < 0.001);
    let cycle = found.common_mode.unwrap().cycle.unwrap();
    assert!(
        (cycle.frames - 5.0).abs() < 0.02 && (cycle.depth_c - 0.5).abs() < 0.03,
        "{cycle:?}"
    );
    assert!(
        (found.sensor_hz().unwrap() - 10.0).abs() < 0.05,
        "{:?}",
        found.sensor_hz()
    );
}

#[test]
fn too_little_or_out_of_order_is_an_error() {
    let mut noise = Noise(2);
    let few: Vec<Record> = (0..FRAMES_MIN - 1)
        .map(|seq| record(seq, noise.frame()))
        .collect();
    let error = characterize(few.clone()).unwrap_err();
    assert_eq!(
        error,
        CharacterizeError::TooFewFrames {
            found: FRAMES_MIN - 1,
            needed: FRAMES_MIN
        }
    );
    assert!(error.to_string().contains("\nhint: "));
    let missing = (0..1000).map(|seq| Record {
        reading: Reading::NoData(NoData::Unplugged),
        ..record(seq, noise.frame())
    });
    let none = CharacterizeError::TooFewFrames {
        found: 0,
        needed: FRAMES_MIN,
    };
    assert_eq!(characterize(missing).unwrap_err(), none);
    let error = characterize(few.iter().chain(&few).copied()).unwrap_err();
    assert_eq!(
        error,
        CharacterizeError::NotAscending {
            previous: FRAMES_MIN - 2,
            found: 0
        }
    );
}

#[test]
fn just_enough_frames_give_noise_but_no_common_mode() {
    let mut noise = Noise(3);
    let found = characterize((0..FRAMES_MIN).map(|seq| record(seq, noise.frame()))).unwrap();
    assert!(found.noise.median_c() > 0.3);
    assert_eq!((found.common_mode, found.pattern), (None, None));
    assert!(found.text().contains("no hundred frames in a row"));
    assert!(found.to_json().contains("\"common_mode\": null"));
}

/// Memory grows with the number of intervals that differ by more than 0.1 %, not with the frames.
#[test]
fn memory_does_not_grow_with_the_recording() {
    let mut noise = Noise(4);
    let mut characterizer = Characterizer::new();
    let mut lengths = Vec::new();
    for seq in 0..20_000 {
        characterizer.push(&record(seq, noise.frame())).unwrap();
        if seq == 1999 || seq == 19_999 {
            // The text of every number stored; counts grow by a digit each.
            lengths.push(format!("{characterizer:?}").len());
        }
    }
    assert!(lengths[1] < lengths[0] * 11 / 10, "{lengths:?}");
}

#[test]
fn a_recordings_profile_survives_writing_and_reading() {
    for name in [SESSION_2, SESSION_3] {
        let profile = found(name).profile("linaige");
        assert_eq!(
            Profile::parse(&profile.to_toml(), "out.toml").unwrap(),
            profile
        );
        // Sheppard: the sensor's rounding adds 0.072 °C in squares, which the profile excludes.
        let (read, own) = (found(name).noise.sigma_c[0], profile.noise_sigma_c[0]);
        assert!(
            (read * read - own * own - 0.0625 / 12.0).abs() < 1e-4,
            "{read} {own}"
        );
        assert!(
            (-25_000..-19_000).contains(&profile.clock_error_ppm()),
            "{}",
            profile.clock_error_ppm()
        );
    }
}

/// `scenes/profiles/linaige.toml` was made from session 3 by the command in its header.
#[test]
fn the_shipped_profile_is_what_session_3_gives() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes/profiles/linaige.toml");
    let text = std::fs::read_to_string(path).unwrap();
    let shipped = Profile::parse(&text, "linaige.toml").unwrap();
    let made = found(SESSION_3).profile(&shipped.name);
    let near = |left: f64, right: f64| (left - right).abs() <= 2e-4;
    let all_near = |left: &[f64], right: &[f64]| {
        left.iter()
            .zip(right)
            .all(|(left, right)| near(*left, *right))
    };
    assert!(all_near(&shipped.noise_sigma_c, &made.noise_sigma_c));
    assert!(all_near(
        &shipped.fixed_pattern.offset_c,
        &made.fixed_pattern.offset_c
    ));
    assert!(near(
        shipped.common_mode.cycle_depth_c,
        made.common_mode.cycle_depth_c
    ));
    assert!(near(shipped.common_mode.sd_c, made.common_mode.sd_c));
    assert!(near(shipped.thermistor.offset_c, made.thermistor.offset_c));
    assert_eq!(shipped.clock, made.clock);
    assert!(
        text.starts_with("# ") && text.contains("grideye characterize recordings/linaige/Session3")
    );
}

#[test]
fn the_json_parses_and_has_the_numbers() {
    let found = found(SESSION_3);
    let json: serde_json::Value = serde_json::from_str(&found.to_json()).unwrap();
    assert_eq!(json["format"], "grideye-characterization");
    assert_eq!(json["frames"], 1672);
    assert_eq!(json["noise_sigma_c"].as_array().unwrap().len(), 64);
    assert_eq!(json["timing"]["listed_jumps"][0]["seq"], 1056);
    assert_eq!(json["faults"]["torn"], found.faults.torn);
    assert_eq!(json["pixel_step_c"], 0.25);
}

#[test]
fn the_text_shows_every_line_and_the_map() {
    let text = found(SESSION_3).text();
    for part in [
        "frame rate of the recording, Hz     9.980",
        "jumps of the clock",
        "−804.5 s at frame 1056",
        "partly repeated (torn) frames, %     4.73",
        "noise of each pixel, °C",
    ] {
        let squeezed = |text: &str| text.split_whitespace().collect::<Vec<_>>().join(" ");
        assert!(
            squeezed(&text).contains(&squeezed(part)),
            "{part} is not in\n{text}"
        );
    }
    assert!(
        text.lines().all(|line| line.chars().count() <= 100),
        "{text}"
    );
}

#[test]
fn the_page_is_self_contained_and_shows_every_number() {
    let found = found(SESSION_3);
    let page = found.to_html(
        "session <3>",
        "grideye characterize a&b.csv --report page.html",
    );
    assert!(page.contains("The sensor of session &lt;3&gt;") && page.contains("a&amp;b.csv"));
    for outside in ["http", "<script", "url(", "<link", "<img", "@import"] {
        assert!(!page.contains(outside), "{outside}");
    }
    for line in found.lines() {
        assert!(
            page.contains(&format!("<th>{}</th>", line.label)),
            "{}",
            line.label
        );
    }
    // Three maps of 64 cells, each with its number.
    assert_eq!(page.matches("data:image/png;base64,").count(), 3);
    assert_eq!(page.matches("</text>").count(), 3 * PIXELS);
    assert!(page.contains(&format!(">{:.2}</text>", found.noise.sigma_c[0])));
    assert!(page.contains("@media print"));
    assert_eq!(
        page,
        found.to_html(
            "session <3>",
            "grideye characterize a&b.csv --report page.html"
        )
    );
}
