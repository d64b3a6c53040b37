//! Compares an emulated sensor with the real one: LINAIGE's session 3, and the emulated AMG8833 with the profile
//! measured on it, through the same statistics. `cargo test -p grideye-validator --test sensor lifelike -- --nocapture`
//! prints the table.
//!
//! The emulated sensor is read at the times of the real frames, in two ways:
//!
//! - **poll**: as the real one was probably read, pixel by pixel in 64 transactions, unsynchronized with the sensor's
//!   own rate. The real reader's timing within a frame is unknown. The real torn frames lie within 21 of 50 frames of
//!   the beat between the two clocks, so one sweep takes 42 ms here. Runs of 8 and more need a sweep that starts up to
//!   some milliseconds late: 4.8 ms, chosen to match the torn share. So the torn share is fitted; all other figures
//!   follow.
//! - **burst**: through the driver `amg8833`, all pixels in one transaction. No frame can be torn; instead, one in
//!   fifty is read twice.
#![expect(
    clippy::unwrap_used,
    clippy::as_conversions,
    clippy::cast_precision_loss,
    clippy::cast_possible_truncation,
    reason = "what fails in a helper fails the test, and its counts are small"
)]

use amg8833::Amg8833;
use amg8833_emulator::{Address, Bus, ManualClock, Options};
use embedded_hal::i2c::I2c;
use grideye_frame::{Celsius, Frame, PIXELS, PixelWord, RawFrame, Reading, ThermistorWord};
use grideye_recording::Record;
use grideye_scene::profile::Profile;
use grideye_validator::characterize::{Characterization, characterize};
use rand_chacha::ChaCha12Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use std::fs::{self, File};
use std::path::PathBuf;
use std::time::Duration;

const SESSION_3: &str = "Session3_2021-07-06_RoomA_v2.csv";
/// Emulated recordings; their scatter is the uncertainty of one recording of this length.
const SEEDS: u64 = 12;
/// Time from power-on to the first frame.
const LEAD: Duration = Duration::from_secs(1);
const SWEEP: Duration = Duration::from_millis(42);
const LATE_MAX: Duration = Duration::from_micros(4800);

fn repository() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../..")
}

fn real_records() -> Vec<Record> {
    let file = File::open(repository().join("recordings/linaige").join(SESSION_3)).unwrap();
    let rows = grideye_import::open(file, SESSION_3, &Default::default());
    rows.unwrap().map(|row| row.unwrap().record).collect()
}

fn profile() -> Profile {
    let text = fs::read_to_string(repository().join("scenes/profiles/linaige.toml")).unwrap();
    Profile::parse(&text, "linaige.toml").unwrap()
}

/// The room as the real sensor saw it: its level and smooth part, without people.
fn room(real: &Characterization) -> Frame {
    let pattern = real.pattern.unwrap();
    let level_c = real.thermistor.unwrap().scene_c;
    let mut room = Frame::uniform(Celsius::new(level_c as f32));
    for (pixel, surface_c) in room.pixels.iter_mut().zip(pattern.surface_c) {
        *pixel = Celsius::new((level_c + surface_c) as f32);
    }
    room
}

#[derive(Clone, Copy)]
enum Way {
    Poll,
    Burst,
}

/// The emulated sensor, read at the times of the real frames.
fn emulated(profile: &Profile, room: Frame, real: &[Record], way: Way, seed: u64) -> Vec<Record> {
    let clock = ManualClock::new();
    let (specimen, mut tick) = (profile.clone(), 0);
    let source = move |t: Duration| {
        let frame = specimen.apply(seed, tick, t, room);
        tick += 1;
        frame
    };
    let options = Options {
        clock_error_ppm: profile.clock_error_ppm(),
        ..Options::default()
    };
    let mut bus = Bus::new(&clock).with_instant_transactions();
    bus.plug(Address::High, source, options);
    let mut late = ChaCha12Rng::seed_from_u64(seed);
    let mut read = |record: &Record| {
        let begin = LEAD + Duration::from_nanos(record.stamp.t_boot_ns);
        match way {
            Way::Burst => {
                clock.set(begin);
                Amg8833::new(&mut bus, amg8833::Address::High)
                    .read_frame()
                    .unwrap()
            }
            Way::Poll => {
                let wait = LATE_MAX.mul_f64(f64::from(late.next_u32()) / f64::from(u32::MAX));
                sweep(&clock, &mut bus, begin + wait)
            }
        }
    };
    real.iter()
        .map(|record| Record {
            reading: Reading::Frame(read(record).into()),
            ..*record
        })
        .collect()
}

/// One frame in 64 transactions of two bytes, and the thermistor in one more.
fn sweep(clock: &ManualClock, bus: &mut impl I2c, begin: Duration) -> RawFrame {
    let mut word = |register: u8, at: Duration| {
        clock.set(at);
        let mut bytes = [0; 2];
        bus.write_read(0x69, &[register], &mut bytes).unwrap();
        u16::from_le_bytes(bytes)
    };
    let pixels = std::array::from_fn(|pixel| {
        let number = u8::try_from(pixel).unwrap();
        let at = begin + SWEEP * u32::from(number) / 64;
        PixelWord(word(0x80 + 2 * number, at))
    });
    RawFrame {
        thermistor: ThermistorWord(word(0x0E, begin + SWEEP)),
        pixels,
    }
}

/// Mean and standard deviation of a statistic over the seeds.
struct Scatter {
    mean: f64,
    sd: f64,
}

fn scatter(found: &[Characterization], statistic: fn(&Characterization) -> f64) -> Scatter {
    let values: Vec<f64> = found.iter().map(statistic).collect();
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    let squares: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
    Scatter {
        mean,
        sd: (squares / (values.len() - 1) as f64).sqrt(),
    }
}

/// One line of the table.
struct Statistic {
    label: &'static str,
    of: fn(&Characterization) -> f64,
    digits: usize,
    /// The reference page's value for this recording or for real sensors.
    reference: &'static str,
    /// Largest difference of the emulated mean from the real value, beyond three standard deviations of the scatter:
    /// what the profile's model or measurement leaves open.
    slack: f64,
}

fn allan_c(found: &Characterization, tau_s: f64) -> f64 {
    let nearest = found.allan.iter().min_by(|left, right| {
        let off = |point: f64| (point / tau_s).ln().abs();
        off(left.tau_s).total_cmp(&off(right.tau_s))
    });
    nearest.unwrap().common_c
}

const STATISTICS: &[Statistic] = &[
    Statistic {
        label: "step of the pixels, °C",
        of: |found| found.steps.pixel_c.unwrap(),
        digits: 4,
        reference: "0.25",
        slack: 0.0,
    },
    Statistic {
        label: "step of the thermistor, °C",
        of: |found| found.steps.thermistor_c.unwrap(),
        digits: 4,
        reference: "0.0625",
        slack: 0.0,
    },
    Statistic {
        label: "frame rate of the recording, Hz",
        of: |found| found.timing.rate_hz,
        digits: 3,
        reference: "9.98",
        slack: 1e-9,
    },
    Statistic {
        label: "frame rate of the sensor, Hz",
        of: |found| found.sensor_hz().unwrap(),
        digits: 3,
        reference: "2-4 % slow",
        slack: 0.03,
    },
    Statistic {
        label: "noise, middle pixel, °C",
        of: |found| found.noise.median_c(),
        digits: 3,
        reference: "0.33",
        slack: 0.01,
    },
    Statistic {
        label: "noise, least noisy pixel, °C",
        of: |found| found.noise.range_c().0,
        digits: 3,
        reference: "above 0.2",
        slack: 0.02,
    },
    Statistic {
        label: "noise, noisiest pixel, °C",
        of: |found| found.noise.range_c().1,
        digits: 3,
        reference: "below 0.55",
        slack: 0.02,
    },
    Statistic {
        label: "cycle, depth of the cold frame, °C",
        of: |found| found.common_mode.unwrap().cycle.unwrap().depth_c,
        digits: 3,
        reference: "0.02-0.2",
        slack: 0.02,
    },
    Statistic {
        label: "slow common mode, sd, °C",
        of: |found| found.common_mode.unwrap().sd_c,
        digits: 3,
        reference: "0.04-0.2",
        slack: 0.05,
    },
    Statistic {
        label: "common mode, Allan dev. at 0.8 s, °C",
        of: |found| allan_c(found, 0.8),
        digits: 3,
        reference: "-",
        slack: 0.02,
    },
    Statistic {
        label: "common mode, Allan dev. at 3.2 s, °C",
        of: |found| allan_c(found, 3.2),
        digits: 3,
        reference: "-",
        slack: 0.02,
    },
    Statistic {
        label: "fixed pattern, sd, °C",
        of: |found| found.pattern.unwrap().sd_c,
        digits: 3,
        reference: "0.15-0.25",
        slack: 0.02,
    },
    Statistic {
        label: "thermistor over the scene, °C",
        of: |found| found.thermistor.unwrap().offset_c,
        digits: 2,
        reference: "3.5-6",
        slack: 0.15,
    },
    Statistic {
        label: "noise of the thermistor, °C",
        of: |found| found.thermistor.unwrap().sigma_c,
        digits: 3,
        reference: "-",
        slack: 0.01,
    },
    Statistic {
        label: "torn frames, %",
        of: |found| 100.0 * found.faults.torn_share(),
        digits: 2,
        reference: "about 4.5",
        slack: 0.5,
    },
    Statistic {
        label: "duplicates, %",
        of: |found| 100.0 * found.faults.duplicate_share(),
        digits: 2,
        reference: "0",
        slack: 0.0,
    },
];

#[test]
fn the_emulated_sensor_is_like_the_real_one() {
    let records = real_records();
    let real = characterize(records.iter().copied()).unwrap();
    let (profile, room) = (profile(), room(&real));
    let all = |way: Way| -> Vec<Characterization> {
        (0..SEEDS)
            .map(|seed| characterize(emulated(&profile, room, &records, way, seed)).unwrap())
            .collect()
    };
    let (poll, burst) = (all(Way::Poll), all(Way::Burst));
    println!(
        "\nLINAIGE session 3, {} frames; emulated {SEEDS} times with as many",
        records.len()
    );
    println!(
        "{:<38}{:>9}{:>18}{:>18}  reference",
        "", "real", "emulated, polled", "emulated, burst"
    );
    let mut apart = Vec::new();
    for statistic in STATISTICS {
        let of_real = (statistic.of)(&real);
        let (polled, bursted) = (scatter(&poll, statistic.of), scatter(&burst, statistic.of));
        let digits = statistic.digits;
        let show =
            |scatter: &Scatter| format!("{:.digits$} ± {:.digits$}", scatter.mean, scatter.sd);
        println!(
            "{:<38}{of_real:>9.digits$}{:>18}{:>18}  {}",
            statistic.label,
            show(&polled),
            show(&bursted),
            statistic.reference
        );
        if (polled.mean - of_real).abs() > 3.0 * polled.sd + statistic.slack {
            apart.push(statistic.label);
        }
    }
    assert!(
        apart.is_empty(),
        "the emulated sensor, polled, is not like the real one in {apart:?}"
    );
    // One transaction reads one frame; the sensor is 2 % slower than the reading.
    let bursted = scatter(&burst, |found| 100.0 * found.faults.torn_share());
    assert!(bursted.mean < 0.1, "torn by chance alone: {}", bursted.mean);
    let twice = scatter(&burst, |found| 100.0 * found.faults.duplicate_share());
    assert!((1.5..3.0).contains(&twice.mean), "{}", twice.mean);
    pixel_by_pixel(&real, &poll);
}

/// The maps must agree pixel by pixel, not only in their median.
fn pixel_by_pixel(real: &Characterization, emulated: &[Characterization]) {
    let mean = |of: fn(&Characterization) -> [f64; PIXELS]| -> Vec<f64> {
        (0..PIXELS)
            .map(|pixel| {
                emulated.iter().map(|found| of(found)[pixel]).sum::<f64>() / emulated.len() as f64
            })
            .collect()
    };
    let noise = correlation(&real.noise.sigma_c, &mean(|found| found.noise.sigma_c));
    let pattern = correlation(
        &real.pattern.unwrap().offset_c,
        &mean(|found| found.pattern.unwrap().offset_c),
    );
    println!(
        "correlation of the maps, real and polled: noise {noise:.3}, fixed pattern {pattern:.3}"
    );
    assert!(noise > 0.97 && pattern > 0.97, "{noise} {pattern}");
}

fn correlation(left: &[f64], right: &[f64]) -> f64 {
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
    let (left_mean, right_mean) = (mean(left), mean(right));
    let product = |of: &dyn Fn(usize) -> f64| (0..left.len()).map(of).sum::<f64>();
    let together = product(&|place| (left[place] - left_mean) * (right[place] - right_mean));
    let of_left = product(&|place| (left[place] - left_mean).powi(2));
    let of_right = product(&|place| (right[place] - right_mean).powi(2));
    together / (of_left * of_right).sqrt()
}

/// The statistics discriminate: the datasheet's sensor and an ideal one do not pass for the real one.
#[test]
fn a_sensor_with_another_profile_is_not_taken_for_the_real_one() {
    let records = real_records();
    let real = characterize(records.iter().copied()).unwrap();
    let room = room(&real);
    for name in ["datasheet.toml", "ideal.toml"] {
        let text = fs::read_to_string(repository().join("scenes/profiles").join(name)).unwrap();
        let other = Profile::parse(&text, name).unwrap();
        let found = characterize(emulated(&other, room, &records, Way::Burst, 1)).unwrap();
        assert!(
            found.noise.median_c() < 0.25,
            "{name}: {}",
            found.noise.median_c()
        );
        // An ideal sensor in a still room gives only duplicates after the first frame, so there is nothing to measure.
        let cycle = found.common_mode.and_then(|common| common.cycle);
        assert_eq!(cycle, None, "{name}");
        let pattern_c = found.pattern.map_or(0.0, |pattern| pattern.sd_c);
        assert!(pattern_c < 0.1, "{name}: {pattern_c}");
        assert!(
            found.thermistor.unwrap().offset_c < 1.0,
            "{name}: {}",
            found.thermistor.unwrap().offset_c
        );
    }
}
