//! Sensors on buses and behind a multiplexer; who sees them.

use crate::skip::is_left_out;
use crate::support::{Server, TWO_SENSORS, emulate, file, pixels, root, run, wait_for};
use embedded_hal::i2c::I2c as _;
use std::process::Command;

/// 20 °C in quarters of a degree.
const ROOM: i32 = 80;

#[test]
fn each_sensor_is_where_it_was_put_and_nowhere_else() {
    let folder = tempfile::tempdir().unwrap();
    let scene = file(folder.path(), "two.toml", TWO_SENSORS);
    let places = ["left=1:0x68", "right=1:0x69", "left=3:0x69"];
    let mut arguments = vec!["--scene", &scene];
    for place in places {
        arguments.extend(["--sensor", place]);
    }
    let server = Server::start(&arguments);
    let (mut one, mut three) = (server.client(1), server.client(3));
    let (left, right) = (pixels(&mut one, 0x68), pixels(&mut one, 0x69));
    assert!(left.iter().any(|pixel| *pixel > ROOM + 8), "{left:?}");
    assert_eq!(right, [ROOM; 64], "nobody stands below the other sensor");
    assert_eq!(
        pixels(&mut three, 0x69),
        left,
        "the same sensor on another bus"
    );
    assert!(three.write(0x68, &[0x80]).is_err(), "nobody is there");
    let elsewhere = crate::client::Client::connect(server.socket(), 2);
    assert!(elsewhere.is_err(), "there is no bus 2");
}

#[test]
fn a_scene_is_shown_by_points_or_by_areas() {
    let folder = tempfile::tempdir().unwrap();
    // So few points that the two ways differ by whole degrees.
    let coarse = TWO_SENSORS.replace("[[sensor]]", "[[sensor]]\npixels_per_degree = 0.2");
    let scene = file(folder.path(), "coarse.toml", &coarse);
    let shown = |scene: &str| {
        let place = ["--scene", scene, "--sensor", "left", "--profile", "ideal"];
        let server = Server::start(&place);
        pixels(&mut server.client(1), 0x69)
    };
    let on_grid = format!("model = \"paper-grid\"\n{coarse}");
    let (area, grid) = (
        shown(&scene),
        shown(&file(folder.path(), "grid.toml", &on_grid)),
    );
    let apart = grid
        .iter()
        .zip(&area)
        .map(|(one, other)| (one - other).abs());
    assert!(apart.max() > Some(2), "{grid:?} {area:?}");
}

#[test]
fn a_recording_of_two_sensors_is_shown_by_two() {
    let both = "recordings/golden/two-sensors.csv";
    let text = std::fs::read_to_string(root().join(both)).unwrap();
    let first = |sensor: &str| -> Vec<f64> {
        let row = text.lines().find(|line| line.contains(sensor)).unwrap();
        row.split(',')
            .skip(10)
            .map(|cell| cell.parse().unwrap())
            .collect()
    };
    let server = Server::start(&[
        "--recording",
        both,
        "--sensor",
        "i2c-1:0x68=1:0x68",
        "--sensor",
        "i2c-1:0x69=1:0x69",
        "--speed",
        "0.001",
        "--scl",
        "instant",
    ]);
    let mut client = server.client(1);
    for (address, name) in [(0x68, ",i2c-1:0x68,"), (0x69, ",i2c-1:0x69,")] {
        let seen = pixels(&mut client, address);
        let seen: Vec<f64> = seen
            .into_iter()
            .map(|quarters| f64::from(quarters) / 4.0)
            .collect();
        assert_eq!(seen, first(name), "{name}");
    }
}

#[test]
fn a_multiplexer_opens_the_channel_that_is_asked_for() {
    let folder = tempfile::tempdir().unwrap();
    let scene = file(folder.path(), "two.toml", TWO_SENSORS);
    let server = Server::start(&[
        "--scene",
        &scene,
        "--sensor",
        "left=1:0x70.0:0x69",
        "--sensor",
        "right=1:0x70.7:0x69",
    ]);
    let mut bus = server.client(1);
    assert!(bus.write(0x69, &[0x80]).is_err(), "no channel is open yet");
    bus.write(0x70, &[0x80]).unwrap();
    assert_eq!(pixels(&mut bus, 0x69), [ROOM; 64]);
    bus.write(0x70, &[0x01]).unwrap();
    let left = pixels(&mut bus, 0x69);
    assert!(left.iter().any(|pixel| *pixel > ROOM + 8), "{left:?}");
    let mut control = [0];
    bus.read(0x70, &mut control).unwrap();
    assert_eq!(control, [0x01]);
}

#[test]
fn two_clients_have_one_machine() {
    let server = Server::start(&["--constant", "21"]);
    let (mut one, mut other) = (server.client(1), server.client(1));
    // The interrupt's upper level, low byte (AMG88 spec §4-11-8).
    one.write(0x69, &[0x08, 0x5A]).unwrap();
    let mut level = [0];
    other.write_read(0x69, &[0x08], &mut level).unwrap();
    assert_eq!(level, [0x5A]);
}

#[test]
fn a_program_and_the_socket_have_one_machine() {
    if is_left_out(
        "GRIDEYE_WITHOUT_I2C_TOOLS",
        "i2cset beside a client of the socket",
    ) {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let socket = folder.path().join("amg.sock");
    let (ready, done) = (folder.path().join("ready"), folder.path().join("done"));
    let script = format!(
        r#"i2cset -y 1 0x69 0x08 0x5A && touch {ready}; while [ ! -e {done} ]; do sleep 0.05; done; i2cget -y 1 0x69 0x0A; echo "$GRIDEYE_I2C_SOCKET""#,
        ready = ready.display(),
        done = done.display()
    );
    let mut command = emulate(&["--constant", "21", "--socket"]);
    command.arg(&socket).args(["--", "sh", "-c", &script]);
    let program = std::thread::spawn(move || run(&mut command));
    wait_for("the program's write", || ready.exists().then_some(()));
    let mut client = crate::client::Client::connect(&socket, 1).unwrap();
    let mut level = [0];
    client.write_read(0x69, &[0x08], &mut level).unwrap();
    assert_eq!(level, [0x5A], "what the program wrote");
    client.write(0x69, &[0x0A, 0x77]).unwrap();
    std::fs::write(&done, "").unwrap();
    let ended = program.join().unwrap();
    let lines: Vec<&str> = ended.stdout.lines().collect();
    assert_eq!(lines, ["0x77", socket.to_str().unwrap()], "{ended:?}");
    assert!(!socket.exists());
}

#[test]
fn a_program_sees_every_bus_under_its_number() {
    if is_left_out("GRIDEYE_WITHOUT_I2C_TOOLS", "i2cget on several buses") {
        return;
    }
    let ended = run(&mut emulate(&[
        "--constant",
        "21",
        "--sensor",
        "a=1:0x68",
        "--sensor",
        "b=3:0x69",
        "--",
        "sh",
        "-c",
        "i2cget -y 1 0x68 0x80; i2cget -y 3 0x69 0x80; i2cget -y 1 0x69 0x80; exit 6",
    ]));
    assert_eq!(
        (ended.code, ended.stdout.as_str()),
        (6, "0x54\n0x54\n"),
        "{ended:?}"
    );
    let said = "/dev/i2c-1, /dev/i2c-3: a at 1:0x68, b at 3:0x69, showing 21 °C";
    assert!(ended.stderr.contains(said), "{ended:?}");
}

/// What a usual machine has, where the programs of the other tests run, is left as it is.
#[test]
fn nobody_else_on_the_machine_sees_the_device() {
    let listing = || run(Command::new("sh").args(["-c", "ls -l /dev | grep i2c; true"])).stdout;
    let before = listing();
    let ended = run(&mut emulate(&[
        "--constant",
        "21",
        "--device",
        "/dev/i2c-77",
        "--",
        "ls",
        "/dev/i2c-77",
    ]));
    assert_eq!(
        (ended.code, ended.stdout.as_str()),
        (0, "/dev/i2c-77\n"),
        "{ended:?}"
    );
    assert_eq!(listing(), before);
}
