//! Random transactions: a few here, any number with `cargo run --release -p amg8833-emulator --example fuzz`.

#[path = "../common/fuzz.rs"]
mod campaign;

#[test]
fn nothing_panics_and_a_power_cycle_leaves_nothing() {
    let outcome = campaign::run(1, 200_000);
    assert!(outcome.transactions >= 200_000 && outcome.lives >= 400);
    assert!(
        outcome.refused > 1_000 && outcome.faults > 1_000,
        "{outcome:?}"
    );
    assert!(outcome.frames > 100_000, "{outcome:?}");
    assert!(outcome.rules > 200, "{outcome:?}");
}

#[test]
fn the_same_seed_does_the_same() {
    assert_eq!(campaign::run(7, 5_000), campaign::run(7, 5_000));
    assert_ne!(campaign::run(7, 5_000), campaign::run(8, 5_000));
}
