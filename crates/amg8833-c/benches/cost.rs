//! The time of a frame read by the C library's functions beside the same call of the emulator, in turns.
//!
//! `cargo bench -p amg8833-c` prints nanoseconds, the best of 200 turns, and their ratio.

#![expect(
    unsafe_code,
    clippy::unwrap_used,
    reason = "it calls the C library's functions, and a bench that fails should say so"
)]

use amg8833_c as c;
use amg8833_emulator::{Address, Bus, ManualClock};
use embedded_hal::i2c::I2c;
use grideye_frame::{Celsius, Frame};
use std::hint::black_box;
use std::time::{Duration, Instant};

const READS: u32 = 2_000;

/// The best of all rounds, in nanoseconds a read.
fn ns(read: &mut impl FnMut(), best: &mut f64) {
    let started = Instant::now();
    for _ in 0..READS {
        read();
    }
    *best = best.min(started.elapsed().as_secs_f64() * 1e9 / f64::from(READS));
}

fn main() {
    // Outside cargo bench, run once and print no figures.
    let short = !std::env::args().any(|argument| argument == "--bench");
    let mut frame = [0_u8; 128];
    let mut in_rust = Bus::with_sensor(
        ManualClock::new(),
        Address::High,
        Frame::uniform(Celsius::new(-5.0)),
    );
    in_rust.clock().advance(Duration::from_millis(100));
    let mut rust = || {
        in_rust
            .write_read(0x69, &[0x80], black_box(&mut frame))
            .unwrap();
    };

    let mut memory = Box::<c::Memory>::new_uninit();
    let bus = memory.as_mut_ptr();
    let mut bytes = [0_u8; 128];
    let into = bytes.as_mut_ptr();
    let register = [0x80_u8];
    // SAFETY: bus and bytes live until the end.
    let in_c =
        || unsafe { c::amg8833_write_read(bus, 0x69, register.as_ptr(), 1, black_box(into), 128) };
    // SAFETY: as above.
    unsafe {
        assert_eq!(
            c::amg8833_init(bus, size_of::<c::Memory>(), 100_000),
            c::Error::Ok
        );
        assert_eq!(c::amg8833_plug_celsius(bus, 0x69, -5.0, 0.0), c::Error::Ok);
        assert_eq!(c::amg8833_advance_ns(bus, 100_000_000), c::Error::Ok);
    }
    assert_eq!(in_c(), c::Error::Ok);
    assert_eq!(bytes[..2], [0xEC, 0x0F], "-5 degrees, AMG88 spec §4-11-11");
    let mut in_c = || assert_eq!(in_c(), c::Error::Ok);

    let (mut rust_ns, mut c_ns) = (f64::MAX, f64::MAX);
    for _ in 0..if short { 1 } else { 200 } {
        ns(&mut rust, &mut rust_ns);
        ns(&mut in_c, &mut c_ns);
    }
    if short {
        return;
    }
    println!(
        "a frame read in Rust {rust_ns:.0} ns, by the C library {c_ns:.0} ns, ratio {:.2}",
        c_ns / rust_ns
    );
}
