//! What a unit measures: noise, pattern, drift, glitches.

use super::file::EVERYTHING;
use super::*;

#[test]
fn an_empty_profile_is_the_perfect_sensor() {
    let ideal = parse("");
    assert_eq!(ideal, Profile::default());
    assert_eq!(ideal.apply(3, 17, tick_time(17), room()), room());
    assert_eq!(ideal.to_toml(), "");
}

/// Pins the bits of one frame, so that no machine, compiler or dependency changes them unnoticed.
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
fn each_pixel_has_the_noise_of_its_map_entry() {
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
fn one_tick_in_five_is_colder_and_the_seed_decides_which() {
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

/// By definition: variance 1 at every time, and autocorrelation pi/4 - 1/2 after one correlation time.
#[test]
fn the_wander_has_its_deviation_and_correlation() {
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

/// Octaves have equal shares: after one correlation time of the slowest, only that one still correlates, and it holds a
/// third of the variance.
#[test]
fn octaves_share_the_variance_and_decorrelate_in_turn() {
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
fn the_pattern_is_fixed_and_the_seed_selects_the_unit() {
    let profile = parse("[fixed_pattern]\noffset_c = 1.5\nspread_c = 0.2\n");
    let frames = excess(&profile, 11, 3);
    assert_eq!(frames[0], frames[2]);
    assert!((mean(&frames[0]) - 1.5).abs() < 4.0 * 0.2 / 8.0);
    assert!((sd(&frames[0]) - 0.2).abs() < 4.0 * 0.2 / 128_f64.sqrt());
    assert_ne!(frames[0], excess(&profile, 12, 1)[0]);
}

#[test]
fn a_rooms_background_is_not_added_to_another_scene() {
    let pattern = "[fixed_pattern]\noffset_c = 1.5\n";
    let profile = parse(&format!("{pattern}[background]\noffset_c = 2\n"));
    assert_eq!(excess(&profile, 1, 1), excess(&parse(pattern), 1, 1));
    assert_eq!(profile.in_its_room_c(), [3.5; PIXELS]);
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
    // 2,000 hits on 64 pixels: 31 each, and none missing.
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
fn the_largest_ticks_and_times_are_accepted() {
    let profile = parse(EVERYTHING);
    let frame = profile.apply(u64::MAX, u64::MAX, Duration::MAX, room());
    assert!(frame.pixels.iter().all(|pixel| !pixel.get().is_nan()));
}

#[test]
fn the_datasheets_noise_is_least_in_the_center_and_symmetric() {
    let sigma = parse("[noise]\nsigma_c = \"datasheet\"\n").noise_sigma_c;
    // AMG88 spec §4-4: the central four have 0.16 °C at 10 frames per second.
    for center in [27, 28, 35, 36] {
        assert_eq!(sigma[center], 0.16);
    }
    for pixel in 0..PIXELS {
        assert!(sigma[pixel] >= 0.16);
        assert_eq!(sigma[pixel], sigma[63 - pixel]);
        assert_eq!(sigma[pixel], sigma[8 * (pixel / 8) + 7 - pixel % 8]);
    }
    // The corner's 1.25 against the center's 0.88.
    assert!((sigma[0] - 0.16 * 1.25 / 0.88).abs() < 1e-12);
    assert!(sigma[1] > sigma[2] && sigma[8] > sigma[16]);
}
