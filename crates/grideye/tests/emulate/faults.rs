//! Faults by script, and what is counted of them.

use crate::client::Failure;
use crate::support::{Server, TWO_SENSORS, file, pixels};
use embedded_hal::i2c::I2c as _;
use rustix::process::Signal;

#[test]
fn a_script_breaks_what_it_names_and_is_counted() {
    let folder = tempfile::tempdir().unwrap();
    let script = file(
        folder.path(),
        "faults.toml",
        "[[fault]]\nkind = \"nack-address\"\naddress = 0x68\n",
    );
    let server = Server::start(&[
        "--constant",
        "21",
        "--sensor",
        "a=1:0x68",
        "--sensor",
        "b=1:0x69",
        "--faults",
        &script,
    ]);
    let mut client = server.client(1);
    assert_eq!(
        pixels(&mut client, 0x69),
        [84; 64],
        "the other one is whole"
    );
    for _ in 0..3 {
        let error = client.write(0x68, &[0x80]).unwrap_err();
        let is_address = matches!(error, Failure::Fault { fault: 1, .. });
        assert!(is_address, "{error:?}");
    }
    server.signal(Signal::TERM);
    let ended = server.wait();
    assert!(ended.stderr.contains("3 not acknowledged"), "{ended:?}");
    assert!(ended.stderr.contains("faults: 3 nack-address"), "{ended:?}");
}

#[test]
fn a_script_reaches_behind_a_multiplexer() {
    let folder = tempfile::tempdir().unwrap();
    let scene = file(folder.path(), "two.toml", TWO_SENSORS);
    let script = file(
        folder.path(),
        "faults.toml",
        "[[fault]]\nkind = \"all-zero\"\naddress = 0x68\n",
    );
    let server = Server::start(&[
        "--scene",
        &scene,
        "--sensor",
        "left=1:0x70.3:0x68",
        "--sensor",
        "right=1:0x70.3:0x69",
        "--faults",
        &script,
    ]);
    let mut client = server.client(1);
    client.write(0x70, &[0x08]).unwrap();
    assert_eq!(pixels(&mut client, 0x68), [0; 64], "broken");
    assert_eq!(pixels(&mut client, 0x69), [80; 64], "whole");
}

#[test]
fn a_script_counts_its_time_from_the_first_transfer() {
    let folder = tempfile::tempdir().unwrap();
    let script = file(
        folder.path(),
        "faults.toml",
        "[[fault]]\nkind = \"all-zero\"\nfrom = \"0 s\"\nuntil = \"30 s\"\n",
    );
    // Before the client comes, more than those 30 seconds pass.
    let server = Server::start(&["--constant", "21", "--speed", "1000", "--faults", &script]);
    std::thread::sleep(std::time::Duration::from_millis(100));
    let mut client = server.client(1);
    assert_eq!(pixels(&mut client, 0x69), [0; 64]);
    std::thread::sleep(std::time::Duration::from_millis(50));
    assert_eq!(
        pixels(&mut client, 0x69),
        [84; 64],
        "after fifty seconds it is over"
    );
}

#[test]
fn a_script_begins_on_every_bus_at_once_and_on_the_one_that_it_names() {
    let folder = tempfile::tempdir().unwrap();
    for (bus, expected) in [("", [0, 0]), ("bus = 3\n", [84, 0]), ("bus = 1\n", [0, 84])] {
        let text = format!("[[fault]]\nkind = \"all-zero\"\n{bus}");
        let script = file(folder.path(), "faults.toml", &text);
        let server = Server::start(&[
            "--constant",
            "21",
            "--sensor",
            "a=1:0x69",
            "--sensor",
            "b=3:0x69",
            "--faults",
            &script,
        ]);
        let (mut one, mut three) = (server.client(1), server.client(3));
        let seen = [pixels(&mut one, 0x69)[0], pixels(&mut three, 0x69)[0]];
        assert_eq!(seen, expected, "{bus}");
    }
}

#[test]
fn what_the_sensor_refuses_is_counted() {
    let server = Server::start(&["--constant", "21"]);
    let mut client = server.client(1);
    // Pixel 1 is read-only (AMG88 spec §4-11), and 0x55 is no power mode.
    client.write(0x69, &[0x80, 0x00]).unwrap();
    client.write(0x69, &[0x00, 0x55]).unwrap();
    server.signal(Signal::TERM);
    let ended = server.wait();
    assert!(
        ended.stderr.contains("1 read-only") && ended.stderr.contains("1 unknown command"),
        "{ended:?}"
    );
}
