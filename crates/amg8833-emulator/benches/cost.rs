//! Measures the emulated sensor: `cargo bench -p amg8833-emulator`. Prints figures and ratios; never fails on a value.
#![expect(clippy::unwrap_used, reason = "what fails here has to end the program")]

use amg8833_emulator::{Address, Bus, Device, ManualClock, Options};
use embedded_hal::i2c::I2c;
use grideye_frame::{Celsius, Frame};
use grideye_scene::{Scene, Simulator};
use std::hint::black_box;
use std::sync::LazyLock;
use std::time::{Duration, Instant};

const TICK: Duration = Duration::from_millis(100);

fn main() {
    // Outside cargo bench, run each once and print no figures.
    let short = !std::env::args().any(|argument| argument == "--bench");
    let long = if short { 1 } else { 1_000 };
    transfers(long);
    fleet(if short { 10 } else { 10_000 }, if short { 1 } else { 20 });
}

/// Mean CPU nanoseconds of `count` calls.
fn each(count: u32, mut act: impl FnMut()) -> f64 {
    let started = cpu_ns();
    for _ in 0..count {
        act();
    }
    (cpu_ns() - started) / f64::from(count)
}

/// This thread's CPU time, independent of the machine's other load; wall-clock time if the kernel does not report it.
fn cpu_ns() -> f64 {
    static STARTED: LazyLock<Instant> = LazyLock::new(Instant::now);
    let told = std::fs::read_to_string("/proc/thread-self/schedstat").ok();
    let told = told.and_then(|text| text.split(' ').next()?.parse().ok());
    told.unwrap_or_else(|| STARTED.elapsed().as_secs_f64() * 1e9)
}

fn transfers(thousands: u32) {
    let bus = Bus::with_sensor(ManualClock::new(), Address::High, constant());
    let mut bus = bus.with_instant_transactions();
    bus.clock().advance(TICK);
    let file = [0xA5; 256];
    let mut frame = [0; 128];
    let mut byte = [0];

    let register = each(thousands * 3_000, || {
        bus.write_read(0x69, &[black_box(0x04)], &mut byte).unwrap();
        black_box(&byte);
    });
    let bare_register = each(thousands * 30_000, || {
        byte.copy_from_slice(&file[black_box(0x04)..][..1]);
        black_box(&byte);
    });
    let read = each(thousands * 200, || {
        bus.write_read(0x69, &[black_box(0x80)], &mut frame)
            .unwrap();
        black_box(&frame);
    });
    let new = each(thousands * 200, || {
        bus.clock().advance(TICK);
        bus.write_read(0x69, &[black_box(0x80)], &mut frame)
            .unwrap();
        black_box(&frame);
    });
    let bare_frame = each(thousands * 20_000, || {
        frame.copy_from_slice(&file[black_box(0x80)..][..128]);
        black_box(&frame);
    });
    let row = |name: &str, ns: f64, bare: f64| {
        println!(
            "{name:<44} {ns:>9.1} {:>14.0} {:>12.0}",
            1e9 / ns,
            ns / bare
        );
    };
    println!(
        "{:<44} {:>9} {:>14} {:>12}",
        "in process, one core", "CPU ns", "a CPU second", "x a memcpy"
    );
    row("register read (write 1, read 1)", register, bare_register);
    row("frame read (write 1, read 128)", read, bare_frame);
    row("frame read, with a new frame each time", new, bare_frame);
    row("bare register file, 1 byte", bare_register, bare_register);
    row("bare register file, 128 bytes", bare_frame, bare_frame);
    println!();
}

fn constant() -> Frame {
    Frame::uniform(Celsius::new(20.0))
}

/// This many sensors, each on its own bus, read once per tick for this many emulated seconds.
fn fleet(sensors: u32, seconds: u32) {
    println!(
        "{sensors} sensors, 10 frames a second, each read in a burst of 128 bytes, {seconds} emulated seconds"
    );
    println!(
        "{:<44} {:>22} {:>14}",
        "source", "CPU s / emulated s", "bytes a sensor"
    );
    run_fleet("a constant", sensors, 1, seconds, |_| constant());
    run_fleet(
        "a closure: one pixel warms up",
        sensors,
        1,
        seconds,
        |sensor| {
            move |t: Duration| {
                let mut frame = constant();
                frame.pixels[usize::try_from(sensor % 64).unwrap()] =
                    Celsius::new(20.0 + t.as_secs_f32() / 10.0);
                frame
            }
        },
    );
    let simulator = person();
    run_fleet("a scene each, with noise", sensors, 1, seconds, |sensor| {
        scene_source(&simulator, sensor)
    });
}

fn scene_source(simulator: &Simulator, sensor: u32) -> impl FnMut(Duration) -> Frame + '_ {
    move |t| {
        let image = simulator.noisy(t, u64::from(sensor));
        image.to_frame(Celsius::new(28.0)).unwrap()
    }
}

/// Prints the time for `times` as many sensors.
fn run_fleet<S: amg8833_emulator::FrameSource>(
    name: &str,
    sensors: u32,
    times: u32,
    seconds: u32,
    source: impl Fn(u32) -> S,
) {
    let clock = ManualClock::new();
    let mut buses: Vec<Bus<&ManualClock, S>> = (0..sensors)
        .map(|sensor| {
            let mut bus = Bus::new(&clock).with_instant_transactions();
            let options = Options {
                clock_error_ppm: i32::try_from(sensor % 80_000).unwrap() - 40_000,
                ..Options::default()
            };
            bus.plug(Address::High, source(sensor), options);
            bus
        })
        .collect();
    let mut frame = [0; 128];
    let ticks = 10 * seconds;
    let whole = each(1, || {
        for _ in 0..ticks {
            clock.advance(TICK);
            for bus in &mut buses {
                bus.write_read(0x69, &[0x80], &mut frame).unwrap();
            }
            black_box(&frame);
        }
    });
    let frames: u64 = buses
        .iter()
        .map(|bus| bus.device(Address::High).unwrap().frames())
        .sum();
    assert!(frames >= u64::from(sensors) * u64::from(ticks) * 95 / 100);
    println!(
        "{name:<44} {:>22.3} {:>14}",
        whole * f64::from(times) / 1e9 / f64::from(seconds),
        size_of::<Bus<&ManualClock, S>>(),
    );
    black_box(size_of::<Device<S>>());
}

fn person() -> Simulator {
    let scenes = concat!(env!("CARGO_MANIFEST_DIR"), "/../../scenes/");
    let text = std::fs::read_to_string(format!("{scenes}experiment-3.toml")).unwrap();
    let files = |name: &str| std::fs::read_to_string(format!("{scenes}{name}"));
    let loaded = Scene::parse(&text, "experiment-3.toml", &files).unwrap();
    Simulator::new(&loaded.scene, "ceiling").unwrap()
}
