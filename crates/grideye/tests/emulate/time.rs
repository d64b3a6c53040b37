//! What is shown when: sources, their ends, speed, the sensor's own clock. Bounds hold however slow this machine is.

use crate::client::Failure;
use crate::skip::is_left_out;
use crate::support::{Server, file, pixels, recording, root, run};
use embedded_hal::i2c::I2c as _;
use std::process::Command;
use std::time::{Duration, Instant};

/// Frames 100 ms apart, each a quarter of a degree warmer than the one before.
fn staircase(count: u32) -> Vec<(u64, f64)> {
    (0..count)
        .map(|step| (u64::from(step) * 100, f64::from(step) * 0.25))
        .collect()
}

#[test]
fn a_constant_is_what_every_pixel_reads() {
    for (celsius, quarters) in [("21.5", 86), ("-3.25", -13), ("0", 0)] {
        let server = Server::start(&["--constant", celsius]);
        assert_eq!(pixels(&mut server.client(1), 0x69), [quarters; 64]);
    }
}

#[test]
fn a_real_session_is_shown_as_it_was_recorded() {
    let session = "recordings/linaige/Session2_2021-07-01_RoomB_v2.csv";
    let text = std::fs::read_to_string(root().join(session)).unwrap();
    let first: Vec<f64> = text
        .lines()
        .nth(1)
        .unwrap()
        .split(',')
        .skip(2)
        .take(64)
        .map(|cell| cell.parse().unwrap())
        .collect();
    let server = Server::start(&[
        "--recording",
        session,
        "--speed",
        "0.001",
        "--scl",
        "instant",
    ]);
    let seen = pixels(&mut server.client(1), 0x69);
    let seen: Vec<f64> = seen
        .into_iter()
        .map(|quarters| f64::from(quarters) / 4.0)
        .collect();
    assert_eq!(seen, first);
}

/// With `--speed 0` a client moves time; a wait for INT ends at the frame that raises it. Otherwise it takes as long as it takes.
#[test]
fn a_client_moves_time_and_waits_for_the_interrupt() {
    if is_left_out(
        "GRIDEYE_WITHOUT_I2C_TOOLS",
        "the Python client's wait for INT",
    ) {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let path = recording(folder.path(), &staircase(30));
    let script = "if True:
        import grideye_i2c as i2c
        bus = i2c.SMBus(1)
        began, before = i2c.pass_time(0)
        # Above 2.5 or below -16 degrees Celsius, absolute, INT on (AMG88 spec 4-11-6, 4-11-3).
        for register, value in ((0x08, 10), (0x0A, 0xC0), (0x0B, 0x0F), (0x03, 0x03)):
            bus.write_byte_data(0x69, register, value)
        early, came = i2c.wait_for_interrupt(0.5), i2c.wait_for_interrupt(5)
        now, after = i2c.pass_time(0)
        print(before, early, came, after, now - began)";
    for (speed, most) in [("0", 1.3), ("20", f64::INFINITY)] {
        let server = Server::start(&["--recording", &path, "--speed", speed]);
        let mut python = Command::new("python3");
        python.env("PYTHONPATH", root().join("crates/i2c-emulation/python"));
        python
            .env("PYTHONDONTWRITEBYTECODE", "1")
            .env("GRIDEYE_I2C_SOCKET", server.socket());
        let ended = run(python.args(["-c", script]));
        assert_eq!(ended.code, 0, "{ended:?}");
        let (levels, seconds) = ended.stdout.trim().rsplit_once(' ').unwrap();
        let seconds: f64 = seconds.parse().unwrap();
        assert!((0.9..most).contains(&seconds), "{ended:?}");
        if speed == "0" {
            assert_eq!(levels, "[True] False True [False]");
        }
    }
}

#[test]
fn the_show_waits_for_the_first_transfer() {
    let folder = tempfile::tempdir().unwrap();
    let recording = recording(folder.path(), &staircase(20));
    for replay in ["times", "frames"] {
        // In the time that the connection takes, the recording would be over a hundred times.
        let server = Server::start(&[
            "--recording",
            &recording,
            "--replay",
            replay,
            "--speed",
            "1000",
        ]);
        std::thread::sleep(Duration::from_millis(50));
        let mut client = server.client(1);
        assert_eq!(
            pixels(&mut client, 0x69),
            [0; 64],
            "{replay}: the first frame"
        );
        std::thread::sleep(Duration::from_millis(10));
        assert_eq!(
            pixels(&mut client, 0x69),
            [19; 64],
            "{replay}: the last one stays"
        );
    }
}

/// Which step of the staircase is on show, and between which moments that was asked.
fn step(client: &mut crate::client::Client, started: Instant) -> (f64, f64, f64) {
    let before = started.elapsed().as_secs_f64();
    let step = f64::from(pixels(client, 0x69)[0]);
    (step, before, started.elapsed().as_secs_f64())
}

/// Ticks a second of real time, between bounds that allow for every delay of this machine.
fn rate_bounds(arguments: &[&str], folder: &std::path::Path) -> (f64, f64) {
    let recording = recording(folder, &staircase(1000));
    let mut all = vec!["--recording", recording.as_str(), "--replay", "frames"];
    all.extend(arguments);
    let server = Server::start(&all);
    let mut client = server.client(1);
    let started = Instant::now();
    pixels(&mut client, 0x69);
    std::thread::sleep(Duration::from_millis(20));
    let (first, first_before, first_after) = step(&mut client, started);
    std::thread::sleep(Duration::from_millis(400));
    let (last, last_before, last_after) = step(&mut client, started);
    assert!(last < 999.0, "the staircase is long enough: {last}");
    let steps = last - first;
    (
        (steps - 1.0) / (last_after - first_before),
        (steps + 1.0) / (last_before - first_after),
    )
}

#[test]
fn speed_and_clock_error_set_the_rate_of_frames() {
    let folder = tempfile::tempdir().unwrap();
    for (arguments, expected) in [
        (&["--speed", "10"][..], 100.0),
        (&["--speed", "20", "--clock-error", "-500000"], 100.0),
        (&["--speed", "10", "--clock-error", "500000"], 150.0),
    ] {
        let (least, most) = rate_bounds(arguments, folder.path());
        assert!(
            least <= expected && expected <= most,
            "{arguments:?}: {expected} a second, measured {least} to {most}"
        );
        // The bounds are of use: a rate that is off by a quarter would be seen, unless this machine stalls.
        println!("{arguments:?}: {least:.0} to {most:.0} frames a second");
    }
}

#[test]
fn a_recording_without_frames_for_a_while_keeps_its_own_times() {
    let folder = tempfile::tempdir().unwrap();
    // An hour between two frames: frame by frame that is one tick, at its own times it is 36,000.
    let recording = recording(folder.path(), &[(0, 20.0), (3_600_000, 30.0)]);
    for (replay, expected) in [("times", 80), ("frames", 120)] {
        let server = Server::start(&[
            "--recording",
            &recording,
            "--replay",
            replay,
            "--speed",
            "50",
        ]);
        let mut client = server.client(1);
        pixels(&mut client, 0x69);
        std::thread::sleep(Duration::from_millis(20));
        assert_eq!(pixels(&mut client, 0x69), [expected; 64], "{replay}");
    }
}

#[test]
fn after_the_end_the_bus_is_gone_and_the_server_ends() {
    let folder = tempfile::tempdir().unwrap();
    let recording = recording(folder.path(), &staircase(3));
    let server = Server::start(&[
        "--recording",
        &recording,
        "--at-end",
        "end",
        "--speed",
        "10",
    ]);
    let mut client = server.client(1);
    assert_eq!(pixels(&mut client, 0x69), [0; 64]);
    let gone = crate::support::wait_for("the end of the show", || {
        client.write_read(0x69, &[0x80], &mut [0; 2]).err()
    });
    let is_gone = matches!(gone, Failure::Fault { fault: 6, .. } | Failure::Bye(..));
    assert!(is_gone || matches!(gone, Failure::Lost(_)), "{gone:?}");
    let ended = server.wait();
    assert_eq!(ended.code, 0, "{ended:?}");
}

#[test]
fn a_recording_that_is_looped_begins_anew() {
    let folder = tempfile::tempdir().unwrap();
    let recording = recording(folder.path(), &staircase(40));
    let server = Server::start(&[
        "--recording",
        &recording,
        "--at-end",
        "loop",
        "--speed",
        "10",
    ]);
    let mut client = server.client(1);
    let mut seen = Vec::new();
    crate::support::wait_for("the second round", || {
        seen.push(pixels(&mut client, 0x69)[0]);
        seen.windows(2).any(|pair| pair[1] < pair[0]).then_some(())
    });
}

#[test]
fn a_person_walks_while_the_driver_reads() {
    let server = Server::start(&[
        "--scene",
        "scenes/experiment-3.toml",
        "--speed",
        "5",
        "--profile",
        "ideal",
    ]);
    let mut client = server.client(1);
    let warmest = |frame: &[i32]| {
        frame
            .iter()
            .enumerate()
            .max_by_key(|(_, pixel)| **pixel)
            .unwrap()
            .0
    };
    let mut places = std::collections::BTreeSet::new();
    crate::support::wait_for("a walk over the image", || {
        places.insert(warmest(&pixels(&mut client, 0x69)) % 8);
        (places.len() >= 4).then_some(())
    });
}

#[test]
fn the_program_meets_frames_unless_it_is_to_see_the_sensor_switched_on() {
    // In a thousandth of the speed, the first tick after power-on is a hundred seconds away.
    let on = Server::start(&["--constant", "21", "--speed", "0.001", "--scl", "instant"]);
    assert_eq!(pixels(&mut on.client(1), 0x69), [84; 64]);
    let switched_on = Server::start(&[
        "--constant",
        "21",
        "--speed",
        "0.001",
        "--scl",
        "instant",
        "--power-on",
    ]);
    assert_eq!(pixels(&mut switched_on.client(1), 0x69), [0; 64]);
}

#[test]
fn bits_take_the_time_of_the_bus_clock() {
    let server = Server::start(&["--constant", "21"]);
    let mut client = server.client(1);
    let started = Instant::now();
    pixels(&mut client, 0x69);
    // 131 bytes of nine bits, and three conditions: 1,182 bits of 10 µs (tests/tests/bus/cost.rs derives 12.30 ms
    // for the whole of a frame with its thermistor).
    assert!(
        started.elapsed() >= Duration::from_micros(11_820),
        "{:?}",
        started.elapsed()
    );
}

/// Frames of which each is of one temperature, read as most drivers do: four times 32 bytes. Time stands but for the bits.
#[test]
fn a_frame_read_in_parts_is_mixed_of_two_unless_transfers_take_no_time() {
    let folder = tempfile::tempdir().unwrap();
    let recording = recording(folder.path(), &staircase(400));
    let mixed = |bus: &[&str]| {
        let shown = ["--recording", recording.as_str(), "--speed", "0"];
        let server = Server::start(&[&shown, bus].concat());
        let mut client = server.client(1);
        let mixed = (0..200).filter(|_| {
            let mut words = [0; 128];
            for (register, part) in [0x80, 0xA0, 0xC0, 0xE0]
                .into_iter()
                .zip(words.chunks_mut(32))
            {
                client.write_read(0x69, &[register], part).unwrap();
            }
            words.chunks(2).any(|word| *word != words[..2])
        });
        mixed.count()
    };
    // A part is 318 bits: 200 reads take 2.54 s with 25 new frames, three quarters of them between the first START and the last.
    let torn = mixed(&[]);
    assert!((15..=21).contains(&torn), "{torn}");
    assert_eq!(mixed(&["--scl", "100000"]), torn, "the default");
    assert!((2..=7).contains(&mixed(&["--scl", "400000"])));
    assert_eq!(mixed(&["--scl", "instant"]), 0);
}

#[test]
fn a_profile_takes_the_place_of_the_scenes_noise() {
    let ideal = Server::start(&[
        "--scene",
        "scenes/experiment-1.toml",
        "--profile",
        "ideal",
        "--speed",
        "20",
    ]);
    let mut client = ideal.client(1);
    let first = pixels(&mut client, 0x69);
    std::thread::sleep(Duration::from_millis(30));
    assert_eq!(pixels(&mut client, 0x69), first, "no noise at all");

    let folder = tempfile::tempdir().unwrap();
    let hot = file(folder.path(), "hot.toml", "[thermistor]\noffset_c = 10.0\n");
    let server = Server::start(&["--constant", "20", "--profile", &hot]);
    let mut word = [0; 2];
    server
        .client(1)
        .write_read(0x69, &[0x0E], &mut word)
        .unwrap();
    // 30 °C in sixteenths (AMG88 spec §4-11-10).
    assert_eq!(u16::from_le_bytes(word), 30 * 16);
}

#[test]
fn the_seed_decides_the_noise() {
    let frame = |seed: &str| {
        // Time that all but stands shows the same tick to each.
        let server = Server::start(&[
            "--scene",
            "scenes/experiment-1.toml",
            "--seed",
            seed,
            "--speed",
            "0.001",
            "--scl",
            "instant",
        ]);
        pixels(&mut server.client(1), 0x69)
    };
    let first = frame("1");
    assert_eq!(frame("1"), first);
    assert_ne!(frame("2"), first);
}
