//! Bad input: one clear error that names the place and the fix, exit code 2, and nothing started or left behind.

use crate::skip;
use crate::support::{TWO_SENSORS, emulate, file, recording, run};
use std::os::unix::fs::PermissionsExt as _;
use std::os::unix::process::CommandExt as _;
use std::path::Path;

/// It must end with 2 and one error that has all of these words and a hint.
fn refused(arguments: &[&str], words: &[&str]) {
    let ended = run(&mut emulate(arguments));
    assert_eq!(ended.code, 2, "{arguments:?}: {ended:?}");
    assert_eq!(
        ended.stderr.matches("error:").count(),
        1,
        "{arguments:?}: {ended:?}"
    );
    for word in words {
        assert!(
            ended.stderr.contains(word),
            "{arguments:?} does not say {word:?}: {}",
            ended.stderr
        );
    }
    assert!(!ended.stderr.contains("panicked"), "{ended:?}");
    assert_eq!(ended.stdout, "", "{arguments:?}");
}

const SCENE: &str = "scenes/experiment-1.toml";

/// Arguments behind `--constant 3`, before `-- true`, and what is said of them.
const VALUES: &[(&[&str], &[&str])] = &[
    (
        &["--device", "/dev/ttyS0"],
        &["/dev/ttyS0", "hint:", "/dev/i2c-1"],
    ),
    (&["--device", "/dev/i2c-1048576"], &["1048576", "hint:"]),
    (
        &["--sensor", "a=x:0x69"],
        &["invalid bus number: x", "hint:"],
    ),
    (&["--sensor", "a=1:0x70.9:0x69"], &["channels 0 to 7"]),
    (&["--address", "0x70"], &["0x68 or 0x69"]),
    (&["--clock-error", "-600000"], &["parts per million"]),
    (&["--scl", "0"], &["1000 to 1000000"]),
    (&["--speed", "-0.1"], &["0 or above"]),
    (&["--mcu", "atmega328p@9"], &["32000 to 32000000 Hz"]),
    (&["--int", "PD2"], &["--int is for firmware", "hint:"]),
    (&["--adapter", "pi9"], &["pi9", "virtio"]),
    (&["--via", "cuse"], &["cuse", "syscalls, socket, usbip"]),
    (
        &["--replay", "frames"],
        &["--replay", "--recording", "hint:"],
    ),
    (&["--at-end", "loop"], &["--at-end", "cannot be used"]),
    (&["--seconds", "1"], &["--seconds is for firmware", "hint:"]),
    (&["--usbip", "here"], &["here", "--usbip"]),
];

#[test]
fn every_value_of_the_command_line_is_checked() {
    for (arguments, words) in VALUES {
        refused(
            &[&["--constant", "3"], *arguments, &["--", "true"]].concat(),
            words,
        );
    }
    for constant in ["600", "-513", "NaN", "warm"] {
        refused(&["--constant", constant, "--", "true"], &["-512 to 511.75"]);
    }
}

#[test]
fn what_is_missing_or_excludes_each_other_is_named() {
    refused(&["--", "true"], &["--scene", "--recording", "--constant"]);
    refused(
        &["--scene", SCENE],
        &["hint:", "-- PROGRAM", "--socket", "--usbip"],
    );
    refused(
        &[
            "--constant",
            "3",
            "--via",
            "socket",
            "--usbip",
            "--",
            "true",
        ],
        &["--via", "cannot be used", "--usbip"],
    );
    refused(
        &["--constant", "3", "--until", "x", "--socket", "/tmp/x"],
        &["--until is for firmware", "there is no program", "hint:"],
    );
    refused(
        &["--scene", SCENE, "--constant", "3", "--", "true"],
        &["--constant", "cannot be used"],
    );
    refused(
        &["--constant", "3", "--via", "socket", "--socket", "/tmp/x"],
        &["PROGRAM"],
    );
}

#[test]
fn sensors_and_their_places_are_checked() {
    let folder = tempfile::tempdir().unwrap();
    let scene = file(folder.path(), "two.toml", TWO_SENSORS);
    for (sensors, words) in [
        (&[][..], &["3 sensors", "left, right, wide", "hint:"][..]),
        (&["window"], &["\"window\"", "left, right, wide", "hint:"]),
        (&["left=1:0x68", "window=1:0x69"], &["\"window\"", "hint:"]),
        (
            &["left=1:0x68", "right=1:0x68"],
            &["left and right are both at 1:0x68", "hint:"],
        ),
        (
            &["left", "right=1:0x68"],
            &["the sensor left has no place", "hint:"],
        ),
        (
            &["left=1:0x68", "right=1:0x70.1:0x68"],
            &["answer at once", "hint:"],
        ),
        (
            &["left=1:0x71.1:0x68", "right=1:0x70.1:0x68"],
            &["only one per bus", "hint:"],
        ),
        (&["wide"], &["wide", "80 x 60", "8 x 8", "hint:"]),
    ] {
        let mut arguments = vec!["--scene", &scene];
        for sensor in sensors {
            arguments.extend(["--sensor", sensor]);
        }
        arguments.extend(["--", "true"]);
        refused(&arguments, words);
    }
    refused(
        &[
            "--scene",
            &scene,
            "--sensor",
            "left=1:0x68",
            "--address",
            "0x69",
            "--",
            "true",
        ],
        &["--address", "hint:"],
    );
}

#[test]
fn files_are_checked_and_named_with_their_place() {
    let folder = tempfile::tempdir().unwrap();
    let in_folder = |name: &str, text: &str| file(folder.path(), name, text);
    let no_recording = in_folder("notes.csv", "a,b\n1,2\n");
    let unknown_key = in_folder("profile.toml", "[noise]\nsigma = 0.3\n");
    let unknown_fault = in_folder("faults.toml", "\n[[fault]]\nkind = \"gremlin\"\n");
    let unknown_field = in_folder("fields.toml", "[[fault]]\nkind = \"hang\"\nwhenever = 3\n");
    let walk = recording(folder.path(), &[(0, 20.0), (100, 21.0)]);
    for (arguments, words) in [
        (
            &["--scene", "scenes/nowhere.toml"][..],
            &["scenes/nowhere.toml", "hint:"][..],
        ),
        (&["--recording", "nowhere.csv"], &["nowhere.csv", "hint:"]),
        (&["--recording", &no_recording], &["notes.csv", "hint:"]),
        (
            &["--recording", "recordings/golden/two-sensors.csv"],
            &["2 sensors", "i2c-1:0x68, i2c-1:0x69", "hint:"],
        ),
        (
            &["--scene", SCENE, "--profile", "perfect"],
            &["perfect", "ideal", "datasheet", "hint:"],
        ),
        (
            &["--scene", SCENE, "--profile", &unknown_key],
            &["profile.toml", "2", "sigma", "hint:"],
        ),
        (
            &["--recording", &walk, "--profile", "ideal"],
            &["--profile", "hint:"],
        ),
        (
            &["--scene", SCENE, "--at-end", "loop"],
            &["nothing moves", "hint:"],
        ),
        (
            &["--constant", "3", "--faults", "nowhere.toml"],
            &["nowhere.toml", "hint:"],
        ),
        (
            &["--constant", "3", "--faults", &unknown_fault],
            &["faults.toml", "3", "gremlin", "hint:"],
        ),
        (
            &["--constant", "3", "--faults", &unknown_field],
            &["fields.toml:3", "whenever", "duration"],
        ),
        (
            &["--constant", "3", "--trace", "bus.txt"],
            &["bus.txt", ".csv", "hint:"],
        ),
        (
            &["--constant", "3", "--trace", "/nowhere/bus.csv"],
            &["/nowhere/bus.csv", "hint:"],
        ),
        (
            &[
                "--constant",
                "3",
                "--trace",
                "bus.vcd",
                "--sensor",
                "a=1:0x69",
                "--sensor",
                "b=2:0x69",
            ],
            &["bus.vcd", "2 buses", "hint:"],
        ),
    ] {
        refused(&[arguments, &["--", "true"]].concat(), words);
    }
}

/// A fault that could never strike, and a log that would take the place of a recording.
#[test]
fn files_that_fit_nothing_here_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let in_folder = |name: &str, text: &str| file(folder.path(), name, text);
    let of_another_sensor = in_folder(
        "low.toml",
        "[[fault]]\nkind = \"hang\"\n[[fault]]\nkind = \"torn\"\naddress = 0x68\n",
    );
    let of_another_bus = in_folder("bus.toml", "[[fault]]\nkind = \"hang\"\nbus = 7\n");
    let walk = recording(folder.path(), &[(0, 20.0), (100, 21.0)]);
    let before = std::fs::read(&walk).unwrap();
    for (arguments, words) in [
        (
            &["--constant", "3", "--faults", &of_another_sensor][..],
            &["fault 2", "1:0x69", "hint:"][..],
        ),
        (
            &["--constant", "3", "--faults", &of_another_bus],
            &["fault 1", "1:0x69", "hint:"],
        ),
        (
            &["--recording", &walk, "--trace", &walk],
            &[&walk, "nothing was changed"],
        ),
    ] {
        refused(&[arguments, &["--", "true"]].concat(), words);
    }
    assert_eq!(std::fs::read(&walk).unwrap(), before);
}

#[test]
fn a_socket_that_cannot_be_is_refused_and_left_as_it_is() {
    let folder = tempfile::tempdir().unwrap();
    let taken = folder.path().join("taken.sock");
    let _listener = std::os::unix::net::UnixListener::bind(&taken).unwrap();
    let notes = file(folder.path(), "notes.txt", "mine");
    let too_long = folder.path().join("x".repeat(120));
    for (path, words) in [
        (taken.as_path(), &["in use", "hint:"][..]),
        (Path::new(&notes), &["is not a socket", "hint:"]),
        (Path::new("/nowhere/amg.sock"), &["/nowhere", "hint:"]),
        (too_long.as_path(), &["bytes", "hint:"]),
    ] {
        refused(
            &["--constant", "3", "--socket", path.to_str().unwrap()],
            words,
        );
    }
    assert_eq!(std::fs::read_to_string(&notes).unwrap(), "mine");
    let mut left: Vec<_> = std::fs::read_dir(folder.path())
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    left.sort();
    assert_eq!(left, ["notes.txt", "taken.sock"]);
}

#[test]
fn an_address_that_is_taken_is_refused() {
    let listener = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
    let taken = listener.local_addr().unwrap().to_string();
    refused(
        &["--constant", "3", "--usbip", &taken],
        &[&taken, "in use", "hint:"],
    );
}

/// Without the kernel's virtual controller, or without root, `--usbip` says what is missing.
#[test]
fn a_kernel_that_takes_no_adapter_is_named_with_its_modules() {
    if Path::new("/sys/devices/platform/vhci_hcd.0").exists() {
        skip::test("this kernel has vhci-hcd");
        return;
    }
    let words = &["vhci", "hint:", "modprobe", "i2c-tiny-usb", "i2c-dev"];
    refused(&["--constant", "3", "--usbip"], words);
}

#[test]
fn a_program_that_cannot_be_run_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let not_executable = file(folder.path(), "notes.txt", "mine");
    let socket = folder.path().join("amg.sock");
    let socket = socket.to_str().unwrap();
    let trace = folder.path().join("bus.csv");
    for (program, named) in [
        ("no-such-program", "no-such-program"),
        (&not_executable, "notes.txt"),
    ] {
        let ended = run(&mut emulate(&[
            "--constant",
            "3",
            "--quiet",
            "--socket",
            socket,
            "--trace",
            trace.to_str().unwrap(),
            "--",
            program,
        ]));
        assert_eq!(ended.code, 2, "{ended:?}");
        for word in [named, "hint:"] {
            assert!(ended.stderr.contains(word), "{ended:?}");
        }
        assert!(!Path::new(socket).exists());
        assert!(!trace.exists());
        let said = ended.stderr.matches("os error").count();
        assert!(said <= 1, "{ended:?}");
    }
}

/// Without root nothing gains rights under the emulator: what could not work is named before it starts.
#[test]
fn a_program_that_would_gain_rights_is_named() {
    const NOBODY: u32 = 65534;
    let folder = tempfile::tempdir().unwrap();
    let program = folder.path().join("id");
    std::fs::copy("/usr/bin/id", &program).unwrap();
    let open_to_all = |path: &Path, mode| {
        std::fs::set_permissions(path, std::fs::Permissions::from_mode(mode)).unwrap();
    };
    open_to_all(folder.path(), 0o755);
    open_to_all(&program, 0o4755);
    if !rustix::process::geteuid().is_root() {
        skip::test("an emulator of another user: only root can start one");
        return;
    }
    let shown = program.to_str().unwrap();
    let mut command = emulate(&["--constant", "3", "--quiet", "--", shown, "-u"]);
    let ended = run(command.uid(NOBODY).gid(NOBODY));
    assert_eq!(ended.code, 2, "{ended:?}");
    for word in [shown, "gains rights", "hint:", "--via socket"] {
        assert!(ended.stderr.contains(word), "{ended:?}");
    }
}

/// What is left where system calls cannot be answered: a program that uses the socket's clients.
#[test]
fn via_the_socket_a_program_has_no_device() {
    let script =
        "test ! -e /dev/i2c-1 && test -S \"$GRIDEYE_I2C_SOCKET\" && echo \"$GRIDEYE_I2C_SOCKET\"";
    let via = [
        "--constant",
        "3",
        "--via",
        "socket",
        "--",
        "sh",
        "-c",
        script,
    ];
    let ended = run(&mut emulate(&via));
    assert_eq!(ended.code, 0, "{ended:?}");
    let socket = ended.stdout.trim_end();
    assert!(!Path::new(socket).exists(), "{ended:?}");
    assert!(
        ended.stderr.contains(&format!("socket {socket}")),
        "{ended:?}"
    );
}
