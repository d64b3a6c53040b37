//! What a sensor profile promises: its numbers come out in what is measured, it repeats to the last bit, and every
//! mistake in a file is answered with its place.

#![expect(
    clippy::as_conversions,
    clippy::cast_precision_loss,
    clippy::unwrap_used,
    reason = "a test that panics has failed, and its counts are small"
)]

use grideye_frame::{Celsius, Frame, PIXELS};
use grideye_scene::profile::{
    CYCLE_TICKS, NAME_CHARACTERS_MAX, Profile, ProfileError, TEXT_BYTES_MAX,
};
use std::time::Duration;

fn parse(text: &str) -> Profile {
    Profile::parse(text, "sensor.toml").unwrap()
}

fn refusal(text: &str) -> String {
    Profile::parse(text, "sensor.toml")
        .map(|_| "accepted".to_owned())
        .unwrap_or_else(|error| error.to_string())
}

fn room() -> Frame {
    Frame::uniform(Celsius::new(20.0))
}

fn tick_time(index: u64) -> Duration {
    Duration::from_millis(100 * index)
}

/// The excess of every pixel over the room in so many ticks from the first.
fn excess(profile: &Profile, seed: u64, ticks: u64) -> Vec<[f64; PIXELS]> {
    (0..ticks)
        .map(|index| {
            let frame = profile.apply(seed, index, tick_time(index), room());
            frame.pixels.map(|pixel| f64::from(pixel.get()) - 20.0)
        })
        .collect()
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

fn sd(values: &[f64]) -> f64 {
    let mean = mean(values);
    let squares: Vec<f64> = values.iter().map(|value| (value - mean).powi(2)).collect();
    (squares.iter().sum::<f64>() / (values.len() - 1) as f64).sqrt()
}

fn pixel(frames: &[[f64; PIXELS]], pixel: usize) -> Vec<f64> {
    frames.iter().map(|frame| frame[pixel]).collect()
}

fn common(frames: &[[f64; PIXELS]]) -> Vec<f64> {
    frames.iter().map(|frame| mean(frame)).collect()
}

#[test]
fn an_empty_profile_is_the_perfect_sensor() {
    let ideal = parse("");
    assert_eq!(ideal, Profile::default());
    assert_eq!(ideal.apply(3, 17, tick_time(17), room()), room());
    assert_eq!(ideal.to_toml(), "");
}

/// The bits of one frame, so that no machine, compiler or version of a dependency draws another one unseen.
#[test]
fn a_frame_is_the_same_to_the_last_bit_everywhere() {
    let profile = parse(EVERYTHING);
    let frame = profile.apply(42, 1234, Duration::from_millis(123_456), room());
    let bits = frame
        .pixels
        .iter()
        .fold(0xcbf2_9ce4_8422_2325_u64, |hash, pixel| {
            pixel
                .get()
                .to_bits()
                .to_le_bytes()
                .iter()
                .fold(hash, |hash, byte| {
                    (hash ^ u64::from(*byte)).wrapping_mul(0x0000_0100_0000_01b3)
                })
        });
    assert_eq!(
        (bits, frame.thermistor.get().to_bits()),
        (0xf37e_4649_805b_36df, 0x41b7_4252),
        "the first pixels: {:?}",
        &frame.pixels[..4]
    );
}

#[test]
fn ticks_may_be_asked_for_in_any_order() {
    let profile = parse(EVERYTHING);
    let forwards: Vec<Frame> = (0..40)
        .map(|i| profile.apply(1, i, tick_time(i), room()))
        .collect();
    for index in (0..40).rev() {
        let again = profile.apply(1, index, tick_time(index), room());
        assert_eq!(again, forwards[usize::try_from(index).unwrap()]);
    }
    assert_ne!(
        forwards[3],
        profile.apply(2, 3, tick_time(3), room()),
        "another seed"
    );
}

#[test]
fn each_pixel_has_the_noise_that_the_map_gives_it() {
    let list: Vec<String> = (0..PIXELS)
        .map(|pixel| format!("{}", 0.1 + 0.01 * pixel as f64))
        .collect();
    let profile = parse(&format!("[noise]\nsigma_c = [{}]\n", list.join(", ")));
    let frames = excess(&profile, 5, 4000);
    for index in [0, 1, 31, 63] {
        let sigma = 0.1 + 0.01 * index as f64;
        // The standard deviation of 4000 draws is known to 1.1 %; the bound is four times that.
        let found = sd(&pixel(&frames, index));
        assert!(
            (found / sigma - 1.0).abs() < 0.045,
            "pixel {index}: {found} for {sigma}"
        );
    }
    let (left, right) = (pixel(&frames, 0), pixel(&frames, 1));
    let product: Vec<f64> = left
        .iter()
        .zip(&right)
        .map(|(left, right)| left * right)
        .collect();
    assert!(
        mean(&product).abs() < 4.0 * 0.1 * 0.11 / 4000_f64.sqrt(),
        "pixels are independent"
    );
    let next: Vec<f64> = left.windows(2).map(|pair| pair[0] * pair[1]).collect();
    assert!(
        mean(&next).abs() < 4.0 * 0.01 / 4000_f64.sqrt(),
        "ticks are independent"
    );
}

#[test]
fn one_tick_in_five_is_colder_and_the_seed_says_which() {
    let profile = parse("[common_mode]\ncycle_depth_c = 0.2\n");
    for seed in 0..CYCLE_TICKS {
        for (index, cold) in common(&excess(&profile, seed, 20)).into_iter().enumerate() {
            let expected = if index as u64 % 5 == seed { -0.2 } else { 0.0 };
            assert!(
                (cold - expected).abs() < 1e-5,
                "seed {seed}, tick {index}: {cold}"
            );
        }
    }
}

/// The definition of the two numbers: variance 1 at every moment, and autocorrelation pi/4 - 1/2 after one time.
#[test]
fn the_wander_has_its_size_and_its_memory() {
    let profile = parse("[common_mode]\nsd_c = 0.5\ncorrelation_s = 2\n");
    let ticks = 100_000;
    let wander = common(&excess(&profile, 9, ticks));
    // 10,000 s are about 5,000 independent values: 1 % for the size, 1.4 % for a correlation.
    assert!((sd(&wander) - 0.5).abs() < 0.02, "{}", sd(&wander));
    let correlation = |lag: usize| {
        let products: Vec<f64> = wander
            .iter()
            .zip(&wander[lag..])
            .map(|(a, b)| a * b)
            .collect();
        mean(&products) / 0.25
    };
    assert!(
        (correlation(20) - (std::f64::consts::FRAC_PI_4 - 0.5)).abs() < 0.06,
        "{}",
        correlation(20)
    );
    assert!(correlation(40).abs() < 0.06, "{}", correlation(40));
    assert!(correlation(1) > 0.95, "{}", correlation(1));
}

/// Octaves of equal shares: after one time of the slowest, it alone remembers, and holds a third of the variance.
#[test]
fn octaves_share_the_variance_and_forget_one_after_the_other() {
    let profile = parse("[common_mode]\nsd_c = 0.5\ncorrelation_s = 4\noctaves = 3\n");
    let wander = common(&excess(&profile, 2, 100_000));
    assert!((sd(&wander) - 0.5).abs() < 0.02, "{}", sd(&wander));
    let correlation = |lag: usize| {
        let products: Vec<f64> = wander
            .iter()
            .zip(&wander[lag..])
            .map(|(a, b)| a * b)
            .collect();
        mean(&products) / 0.25
    };
    let after_one = std::f64::consts::FRAC_PI_4 - 0.5;
    assert!(
        (correlation(40) - after_one / 3.0).abs() < 0.06,
        "{}",
        correlation(40)
    );
    // After half of it: the slowest has 0.736 (the same integral at one half), the second one has just done one time.
    assert!(
        (correlation(20) - (0.736 + after_one) / 3.0).abs() < 0.06,
        "{}",
        correlation(20)
    );
}

#[test]
fn the_pattern_stays_and_the_seed_is_the_specimen() {
    let profile = parse("[fixed_pattern]\noffset_c = 1.5\nspread_c = 0.2\n");
    let frames = excess(&profile, 11, 3);
    assert_eq!(frames[0], frames[2]);
    assert!((mean(&frames[0]) - 1.5).abs() < 4.0 * 0.2 / 8.0);
    assert!((sd(&frames[0]) - 0.2).abs() < 4.0 * 0.2 / 128_f64.sqrt());
    assert_ne!(frames[0], excess(&profile, 12, 1)[0]);
}

#[test]
fn warm_up_decays_and_drift_goes_on() {
    let profile = parse("[warm_up]\nstart_c = -2\ntime_constant_s = 600\ndrift_c_per_hour = 0.5\n");
    let at = |seconds: u64| {
        let frame = profile.apply(0, 0, Duration::from_secs(seconds), room());
        f64::from(frame.pixels[9].get()) - 20.0
    };
    assert!((at(0) + 2.0).abs() < 1e-5);
    // exp(-1) and exp(-6) from tables.
    assert!(
        (at(600) - (-2.0 * 0.367_879 + 0.5 / 6.0)).abs() < 1e-5,
        "{}",
        at(600)
    );
    assert!(
        (at(3600) - (-2.0 * 0.002_479 + 0.5)).abs() < 1e-5,
        "{}",
        at(3600)
    );
}

#[test]
fn the_thermistor_rises_to_its_offset_with_its_own_noise() {
    let profile = parse("[thermistor]\noffset_c = 5\nlag_s = 100\n");
    let at = |seconds: u64| {
        let frame = profile.apply(0, 0, Duration::from_secs(seconds), room());
        assert_eq!(frame.pixels, room().pixels);
        f64::from(frame.thermistor.get())
    };
    assert_eq!(at(0), 20.0);
    assert!(
        (at(100) - (20.0 + 5.0 * 0.632_121)).abs() < 1e-4,
        "{}",
        at(100)
    );
    assert!((at(2000) - 25.0).abs() < 1e-4);

    let noisy = parse("[thermistor]\nsigma_c = 0.1\n");
    let readings: Vec<f64> = (0..2000)
        .map(|index| {
            f64::from(
                noisy
                    .apply(1, index, tick_time(index), room())
                    .thermistor
                    .get(),
            )
        })
        .collect();
    assert!(
        (sd(&readings) / 0.1 - 1.0).abs() < 0.065,
        "{}",
        sd(&readings)
    );
}

#[test]
fn glitches_are_single_pixels_of_exactly_zero() {
    let profile = parse("[glitches]\nprobability = 0.1\n");
    let mut hit = [0_u32; PIXELS];
    let ticks = 20_000;
    for frame in excess(&profile, 4, ticks) {
        let zeros: Vec<usize> = (0..PIXELS).filter(|pixel| frame[*pixel] == -20.0).collect();
        assert!(zeros.len() <= 1);
        for pixel in zeros {
            hit[pixel] += 1;
        }
    }
    let share = f64::from(hit.iter().sum::<u32>()) / ticks as f64;
    assert!(
        (share - 0.1).abs() < 4.0 * (0.09 / ticks as f64).sqrt(),
        "{share}"
    );
    // 2,000 hits on 64 pixels: 31 each, and none left out.
    assert!(hit.iter().all(|hits| (5..80).contains(hits)), "{hit:?}");

    let always = parse("[glitches]\nprobability = 1\n");
    assert!(
        excess(&always, 4, 100)
            .iter()
            .all(|frame| frame.contains(&-20.0))
    );
}

#[test]
fn nothing_is_colder_than_absolute_zero() {
    let profile = parse("[fixed_pattern]\noffset_c = -100\n");
    let cold = Frame::uniform(Celsius::new(-250.0));
    assert_eq!(
        profile.apply(0, 0, Duration::ZERO, cold).pixels[0].get(),
        -273.15
    );
}

#[test]
fn the_largest_ticks_and_times_are_taken() {
    let profile = parse(EVERYTHING);
    let frame = profile.apply(u64::MAX, u64::MAX, Duration::MAX, room());
    assert!(frame.pixels.iter().all(|pixel| !pixel.get().is_nan()));
}

#[test]
fn the_datasheets_noise_is_least_in_the_centre_and_symmetric() {
    let sigma = parse("[noise]\nsigma_c = \"datasheet\"\n").noise_sigma_c;
    // AMG88 spec §4-4: the central four have 0.16 °C at 10 frames a second.
    for centre in [27, 28, 35, 36] {
        assert_eq!(sigma[centre], 0.16);
    }
    for pixel in 0..PIXELS {
        assert!(sigma[pixel] >= 0.16);
        assert_eq!(sigma[pixel], sigma[63 - pixel]);
        assert_eq!(sigma[pixel], sigma[8 * (pixel / 8) + 7 - pixel % 8]);
    }
    // The corner's 1.25 against the centre's 0.88.
    assert!((sigma[0] - 0.16 * 1.25 / 0.88).abs() < 1e-12);
    assert!(sigma[1] > sigma[2] && sigma[8] > sigma[16]);
}

const EVERYTHING: &str = r#"name = "a \"specimen\""

[noise]
sigma_c = 0.3

[common_mode]
sd_c = 0.1
correlation_s = 30
octaves = 2
cycle_depth_c = 0.15

[fixed_pattern]
offset_c = -0.5
spread_c = 0.2

[warm_up]
start_c = -1
time_constant_s = 600
drift_c_per_hour = 0.1

[thermistor]
offset_c = 4.5
sigma_c = 0.02
lag_s = 120

[glitches]
probability = 0.001

[clock]
error_ppm = -42000
drift_ppm_per_hour = 15
"#;

#[test]
fn a_profile_is_written_as_it_is_read() {
    let mut profile = parse(EVERYTHING);
    assert_eq!(profile.clock_error_ppm(), -42_000);
    assert_eq!(profile.clock_drift_ppm_per_hour(), 15);
    assert_eq!(parse(&profile.to_toml()), profile);
    for (pixel, sigma) in profile.noise_sigma_c.iter_mut().enumerate() {
        *sigma = 0.1 + pixel as f64 / 7.0;
    }
    profile.fixed_pattern.offset_c[63] = -1e-7;
    profile.name = "tab\tand \\ \u{e9} 'quote'".replace('\t', " ");
    assert_eq!(parse(&profile.to_toml()), profile, "{}", profile.to_toml());
}

#[test]
fn every_key_is_read_into_its_own_place() {
    for line in EVERYTHING.lines().filter(|line| line.contains(" = ")) {
        let changed = match line.split_once(" = ") {
            Some((key, value)) if value.starts_with('"') => format!("{key} = \"other\""),
            Some(("octaves", _)) => "octaves = 3".to_owned(),
            Some((key, value)) => format!("{key} = {value}1"),
            None => unreachable!(),
        };
        let replaced = EVERYTHING.replacen(line, &changed.replace("0.0011", "0.0021"), 1);
        if line.starts_with("drift_ppm") {
            assert_eq!(parse(&replaced).clock_drift_ppm_per_hour(), 151);
        }
        if !line.starts_with("error_ppm") {
            assert_ne!(parse(&replaced), parse(EVERYTHING), "{line}");
        }
    }
}

#[test]
fn lists_of_another_length_and_bad_numbers_in_them_are_named() {
    let sixty_three = format!("[noise]\nsigma_c = [{}]\n", vec!["0.3"; 63].join(", "));
    let sixty_five = format!(
        "[fixed_pattern]\noffset_c = [{}]\n",
        vec!["0.3"; 65].join(", ")
    );
    let one_negative = format!("[noise]\nsigma_c = [0.3, -0.1{}]\n", ", 0.3".repeat(62));
    let one_text = "[noise]\nsigma_c = [0.1, \"a\"]\n";
    for (text, place, message) in [
        (
            sixty_three.as_str(),
            "sensor.toml:2:11",
            "`noise.sigma_c` has 63 numbers, expected 64",
        ),
        (
            &sixty_five,
            "sensor.toml:2:12",
            "`fixed_pattern.offset_c` has 65 numbers, expected 64",
        ),
        (
            &one_negative,
            "sensor.toml:2:17",
            "`noise.sigma_c` is -0.1, expected 0 to 100 °C",
        ),
        (one_text, "sensor.toml:2:17", "expected a number"),
    ] {
        assert_refused(text, &[place, message]);
    }
}

#[test]
fn every_mistake_is_answered_with_its_place_and_what_to_do() {
    for (text, expected) in MISTAKES {
        assert_refused(text, expected);
    }
}

fn assert_refused(text: &str, expected: &[&str]) {
    let found = refusal(text);
    for part in expected {
        assert!(
            found.contains(part),
            "{text}\ngives: {found}\nwithout: {part}"
        );
    }
    let first = found.lines().next().unwrap();
    assert!(
        !first.ends_with('.') && found.contains("\nhint: "),
        "{found}"
    );
}

const MISTAKES: &[(&str, &[&str])] = &[
    (
        "[common_mode]\noctaves = 11\n",
        &["`common_mode.octaves` is 11, expected a whole number, 1 to 10"],
    ),
    (
        "[common_mode]\noctaves = 0\n",
        &["`common_mode.octaves` is 0"],
    ),
    (
        "[common_mode]\noctaves = 1.5\n",
        &["`common_mode.octaves` is 1.5"],
    ),
    (
        "[noise]\nsigma = 0.3\n",
        &[
            "sensor.toml:2:1",
            "unknown field `sigma`",
            "expected `sigma_c`",
        ],
    ),
    (
        "[nois]\nsigma_c = 0.3\n",
        &["sensor.toml:1:2", "unknown field `nois`"],
    ),
    (
        "[noise]\nsigma_c = nan\n",
        &["sensor.toml:2:11", "`noise.sigma_c` is nan"],
    ),
    (
        "[noise]\nsigma_c = -0.3\n",
        &["`noise.sigma_c` is -0.3, expected 0 to 100 °C"],
    ),
    ("[noise]\nsigma_c = inf\n", &["`noise.sigma_c` is inf"]),
    (
        "[noise]\nsigma_c = \"data sheet\"\n",
        &["`noise.sigma_c` is \"data sheet\"", "\"datasheet\""],
    ),
    (
        "[fixed_pattern]\noffset_c = \"datasheet\"\n",
        &["`fixed_pattern.offset_c` is \"datasheet\""],
    ),
    (
        "[noise]\nsigma_c = true\n",
        &[
            "sensor.toml:2:11",
            "`sigma_c`",
            "a number, or a list of 64 numbers",
        ],
    ),
    (
        "[common_mode]\nsd_c = 0.1\n",
        &[
            "sensor.toml:2:8",
            "`common_mode.sd_c` needs `common_mode.correlation_s`",
        ],
    ),
    (
        "[common_mode]\nsd_c = 0.1\ncorrelation_s = 0\n",
        &["sensor.toml:3:17", "`common_mode.correlation_s` is 0"],
    ),
    (
        "[common_mode]\ncycle_depth_c = -0.1\n",
        &["`common_mode.cycle_depth_c` is -0.1"],
    ),
    (
        "[warm_up]\nstart_c = 1\n",
        &["`warm_up.start_c` needs `warm_up.time_constant_s`"],
    ),
    ("[thermistor]\nlag_s = -1\n", &["`thermistor.lag_s` is -1"]),
    (
        "[glitches]\nprobability = 1.01\n",
        &["`glitches.probability` is 1.01, expected 0 to 1"],
    ),
    (
        "[clock]\nerror_ppm = 0.5\n",
        &["`clock.error_ppm` is 0.5, expected a whole number"],
    ),
    (
        "[clock]\nerror_ppm = 500001\n",
        &["`clock.error_ppm` is 500001"],
    ),
    (
        "[clock]\ndrift_ppm_per_hour = nan\n",
        &["`clock.drift_ppm_per_hour` is nan"],
    ),
    (
        "[clock]\nerror_ppm = \"fast\"\n",
        &["sensor.toml:2:13", "`error_ppm`", "expected a number"],
    ),
    ("name = \"a\\nb\"\n", &["`name` is", "visible characters"]),
    ("name = 7\n", &["sensor.toml:1:8", "`name`"]),
    (
        "[noise]\nsigma_c = 1\nsigma_c = 2\n",
        &["sensor.toml:3:1", "duplicate key"],
    ),
    (
        "[noise\n",
        &["sensor.toml:1:", "hint: the file must be TOML"],
    ),
];

#[test]
fn text_and_name_are_bounded() {
    let full = format!("#{}\n", "x".repeat(TEXT_BYTES_MAX - 2));
    assert_eq!(full.len(), TEXT_BYTES_MAX);
    assert_eq!(refusal(&full), "accepted");
    let error = Profile::parse(&format!("{full}#"), "big.toml").unwrap_err();
    assert!(matches!(error, ProfileError::TooLong { found, limit, .. } if found == limit + 1));
    let name = |length: usize| format!("name = \"{}\"\n", "é".repeat(length));
    assert_eq!(refusal(&name(NAME_CHARACTERS_MAX)), "accepted");
    assert!(refusal(&name(NAME_CHARACTERS_MAX + 1)).contains("up to 100 visible characters"));
}

/// The files that are shipped are read, and the specification's example is one.
#[test]
fn shipped_profiles_and_the_example_of_the_specification_are_profiles() {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes/profiles");
    let read = |name: &str| std::fs::read_to_string(folder.join(name)).unwrap();
    let mut shipped = 0;
    for entry in std::fs::read_dir(&folder).unwrap() {
        let path = entry.unwrap().path();
        if path
            .extension()
            .is_some_and(|extension| extension == "toml")
        {
            let name = path.file_name().unwrap().to_string_lossy().into_owned();
            assert!(
                !Profile::parse(&read(&name), &name).unwrap().name.is_empty(),
                "{name}"
            );
            assert!(
                read("README.md").contains(&format!("`{name}`")),
                "{name} is not in the list"
            );
            shipped += 1;
        }
    }
    assert!(shipped >= 2);
    let specification = read("README.md");
    let example = specification
        .split("```")
        .nth(1)
        .unwrap()
        .strip_prefix("toml\n")
        .unwrap();
    let mut profile = Profile::parse(example, "README.md").unwrap();
    assert_eq!(profile.name, "unit 7");
    profile.name = "a \"specimen\"".to_owned();
    assert_eq!(profile, parse(EVERYTHING), "the example has every key");
    let named = |name: &str| Profile {
        name: String::new(),
        ..Profile::parse(&read(name), name).unwrap()
    };
    assert_eq!(named("ideal.toml"), Profile::default());
    assert_eq!(
        named("datasheet.toml"),
        parse("[noise]\nsigma_c = \"datasheet\"\n")
    );
}
