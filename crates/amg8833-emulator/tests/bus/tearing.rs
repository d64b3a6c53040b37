//! Reference sections 1.4 and 5: a burst is never torn, and every other way as often as its readout time predicts. For
//! the table with more reads: `cargo run --release -p amg8833-emulator --example tearing`.

#[path = "../common/tearing.rs"]
mod reads;

use reads::Way;

#[test]
fn each_way_of_reading_tears_as_often_as_its_time_says() {
    let (text, shares) = reads::table(4_000);
    println!("{text}");
    for (way, share) in shares {
        let whole = matches!(
            way,
            Way::Burst | Way::BurstAfterStop | Way::OneTransaction(_)
        );
        if whole {
            assert_eq!(share.torn, 0, "{way:?}");
        } else {
            // Five standard deviations: one in two million by chance.
            let off = (share.percent() - 100.0 * share.expected).abs();
            assert!(off < 5.0 * share.deviation_percent(), "{way:?}: {share:?}");
            assert!(share.expected > 0.01, "{way:?}");
        }
    }
}

/// The reference's estimates are moderately above the measured shares: they also count the thermistor and the last
/// transaction, and assume a period of 100 ms instead of 104 ms.
#[test]
fn the_estimates_of_the_reference_are_of_the_right_size() {
    for (name, way, estimates) in reads::WAYS {
        for (hz, estimate) in [100_000, 400_000].into_iter().zip(estimates) {
            let expected = 100.0 * reads::share(way, hz, 1).expected;
            if estimate > 0.0 {
                let ratio = expected / estimate;
                assert!((0.6..1.0).contains(&ratio), "{name}: {expected} {estimate}");
            }
        }
    }
}
