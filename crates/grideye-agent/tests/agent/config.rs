//! A configuration is read with its defaults, or rejected with line, column and the fix.

use amg8833::Address;
use grideye_agent::config::{
    Body, BusConfig, CONFIG_BYTES_MAX, Config, RING_FRAMES_DEFAULT, SPOOL_AFTER_DEFAULT, SpoolMode,
};
use grideye_agent::join::{Credentials, Joined};
use std::path::Path;
use std::time::Duration;

const SMALLEST: &str = "collector = \"http://collector:8833/\"\n[[bus]]\npath = \"/dev/i2c-1\"\n[[bus.sensor]]\naddress = 0x69\n";

fn refusal(text: &str) -> String {
    Config::parse(text, "agent.toml").unwrap_err().to_string()
}

#[test]
fn the_smallest_configuration_has_the_documented_defaults() {
    let config = Config::parse(SMALLEST, "agent.toml").unwrap();
    assert_eq!(config.device, None);
    assert_eq!(config.collector.as_deref(), Some("http://collector:8833"));
    assert_eq!(config.body, Body::Json);
    assert_eq!(config.post_every, Duration::from_millis(500));
    assert_eq!(config.ring_frames, RING_FRAMES_DEFAULT);
    assert_eq!(config.request_timeout, Duration::from_secs(10));
    assert_eq!(
        config.buses,
        [BusConfig::with_one_sensor("/dev/i2c-1", Address::High)]
    );
}

/// Text to find, its replacement, and the start of the message.
const REFUSALS: [(&str, &str, &str); 31] = [
    (
        "[[bus]]",
        "health.listen = \"0.0.0.0:8834\"\n[[bus]]",
        "agent.toml:2:17: listen: expected an address and port of this machine, found \"0.0.0.0:8834\"\nhint: listen = \"127.0.0.1:8834\"",
    ),
    (
        "[[bus]]",
        "health.listen = \"localhost\"\n[[bus]]",
        "agent.toml:2:17: listen: expected an address and port of this machine, found \"localhost\"\nhint: ",
    ),
    (
        "[[bus]]",
        "body = \"bytes\"\n[[bus]]",
        "agent.toml:2:8: body: expected \"json\" or \"binary\", found \"bytes\"\nhint: ",
    ),
    (
        "address = 0x69",
        "address = 0xd2",
        "agent.toml:5:11: address: expected 0x68 or 0x69, found 0xd2\nhint: give the 7-bit",
    ),
    (
        "address = 0x69",
        "address = 0x69\nrate_hz = 5",
        "agent.toml:6:11: rate_hz: expected 10 or 1, found 5\nhint: ",
    ),
    (
        "address = 0x69",
        "adress = 0x69",
        "agent.toml:5:1: unknown field `adress`",
    ),
    (
        "address = 0x69",
        "address = \"0x69\"",
        "agent.toml:5:11: invalid type: string \"0x69\", expected a whole number\nhint: ",
    ),
    (
        "address = 0x69",
        "address = 0x69\n[[bus.sensor]]\naddress = 0x69",
        "agent.toml:7:11: address: 0x69 is named twice on this bus\nhint: ",
    ),
    (
        "[[bus.sensor]]",
        "[bus.sensor]",
        "agent.toml:4:1: invalid type: map, expected a sequence\nhint: ",
    ),
    (
        "http://collector:8833/",
        "https://collector:8833",
        "agent.toml:1:13: collector: expected http://HOST:PORT, found \"https://collector:8833\"\nhint: https goes with a token",
    ),
    (
        "http://collector:8833/",
        "collector:8833",
        "agent.toml:1:13: collector: expected http://HOST:PORT",
    ),
    (
        "http://collector:8833/",
        "http://collector/v1/frames",
        "agent.toml:1:13: collector: expected http://HOST:PORT",
    ),
    (
        "[[bus]]",
        "post_every_ms = 5\n[[bus]]",
        "agent.toml:2:17: post_every_ms: expected 50 to 60000, found 5\nhint: leave post_every_ms out",
    ),
    (
        "[[bus]]",
        "ring_frames = 1\n[[bus]]",
        "agent.toml:2:15: ring_frames: expected 100 to 200000, found 1\nhint: ",
    ),
    (
        "[[bus]]",
        "device = \"a b\"\n[[bus]]",
        "agent.toml:2:10: device: expected 1 to 64 letters",
    ),
    (
        "/dev/i2c-1",
        "i2c-1",
        "agent.toml:3:8: path: expected a device file, found \"i2c-1\"\nhint: on a Raspberry Pi it is /dev/i2c-1",
    ),
    // A camera is not a bus, and a rate belongs to a sensor.
    (
        "/dev/i2c-1",
        "v4l2:/dev/video0",
        "agent.toml:3:8: path: expected a device file, found \"v4l2:/dev/video0\"\nhint: on a Raspberry Pi it is /dev/i2c-1",
    ),
    (
        "[[bus.sensor]]",
        "rate_hz = 10\n[[bus.sensor]]",
        "agent.toml:4:1: unknown field `rate_hz`",
    ),
    (
        "address = 0x69",
        "address = 69",
        "agent.toml:5:11: address: expected 0x68 or 0x69, found 0x45\nhint: write 0x69: without 0x",
    ),
    (
        "http://collector:8833/",
        "http://collector",
        "agent.toml:1:13: collector: expected http://HOST:PORT",
    ),
    (
        "http://collector:8833/",
        "http://:8833",
        "agent.toml:1:13: collector: expected http://HOST:PORT",
    ),
    (
        "http://collector:8833/",
        "http://collector:99999",
        "agent.toml:1:13: collector: expected http://HOST:PORT",
    ),
    (
        "http://collector:8833/",
        "http://collector:0",
        "agent.toml:1:13: collector: expected http://HOST:PORT",
    ),
    (
        "http://collector:8833/",
        "http://[::1",
        "agent.toml:1:13: collector: expected http://HOST:PORT",
    ),
    ("[[bus]]", "[[bus]", "agent.toml:2:"),
    (
        "[[bus]]",
        "[spool]\nmode = \"disk\"\n[[bus]]",
        "agent.toml:3:8: mode: expected \"ram\", \"outage\" or \"always\", found \"disk\"\nhint: ",
    ),
    (
        "[[bus]]",
        "[spool]\nfolder = \"spool\"\n[[bus]]",
        "agent.toml:3:10: folder: expected an absolute path, found \"spool\"\nhint: leave folder out under systemd",
    ),
    (
        "[[bus]]",
        "[spool]\nmib_max = 0\n[[bus]]",
        "agent.toml:3:11: mib_max: expected 1 to 1048576, found 0\nhint: ",
    ),
    (
        "[[bus]]",
        "[spool]\nsync_every_ms = 5\n[[bus]]",
        "agent.toml:3:17: sync_every_ms: expected 50 to 60000, found 5\nhint: ",
    ),
    (
        "[[bus]]",
        "[spool]\nmib = 5\n[[bus]]",
        "agent.toml:3:1: unknown field `mib`",
    ),
    (
        "[[bus]]",
        "ring_frames = 150\n[spool]\n[[bus]]",
        "agent.toml:3:1: ring_frames: expected at least 200 (20 s of these sensors), found 150\nhint: write ring_frames = 200",
    ),
];

#[test]
fn the_spool_is_for_outages_unless_told_otherwise_and_its_guarantee_is_in_frames_and_seconds() {
    let with = |spool: &str| {
        let text = SMALLEST.replacen("[[bus]]", &format!("{spool}[[bus]]"), 1);
        Config::parse(&text, "agent.toml").unwrap()
    };
    let config = with("");
    assert_eq!(config.spool.mode, SpoolMode::Ram);
    // 10 frames per second, plus 6 percent for the fastest sensor.
    assert_eq!(config.guarantee().frames, 10_000);
    assert!((config.guarantee().seconds - 943.4).abs() < 0.1);
    let config = with("[spool]\n");
    let after = SPOOL_AFTER_DEFAULT;
    assert_eq!(config.spool.mode, SpoolMode::Outage { after });
    assert_eq!(config.spool.bytes_max, 1 << 30);
    assert_eq!(
        config.guarantee().to_string(),
        "a power cut or a killed agent costs at most 109 frames: those read in the last 10.25 s and not acknowledged, if the disk syncs within 0.125 s"
    );
    let config = with("[spool]\nmode = \"always\"\nsync_every_ms = 500\n");
    let guarantee = config.guarantee();
    assert_eq!((guarantee.frames, guarantee.seconds), (8, 0.75));
}

#[test]
fn every_refusal_names_line_column_and_the_fix() {
    for (found, with, expected) in REFUSALS {
        let message = refusal(&SMALLEST.replacen(found, with, 1));
        assert!(message.starts_with(expected), "{with}: {message}");
        assert!(message.contains("\nhint: "), "{message}");
    }
}

#[test]
fn a_collector_is_named_by_host_name_or_by_address_of_either_kind() {
    for collector in [
        "http://pc.local:8833",
        "http://192.168.1.20:80",
        "http://[fe80::1]:8833",
    ] {
        let text = SMALLEST.replace("http://collector:8833/", collector);
        assert_eq!(
            Config::parse(&text, "x").unwrap().collector.as_deref(),
            Some(collector)
        );
    }
}

#[test]
fn what_joining_left_is_added_and_two_collectors_are_refused() {
    let joined = Joined {
        collector: "http://pc:8833".to_owned(),
        device: Some("pi-1".to_owned()),
        credentials: Credentials::default(),
    };
    let without = SMALLEST.replacen("collector = \"http://collector:8833/\"\n", "", 1);
    let mut config = Config::parse(&without, "x").unwrap();
    assert_eq!(config.collector, None);
    config.join(joined.clone()).unwrap();
    assert_eq!(config.collector.as_deref(), Some("http://pc:8833"));
    assert_eq!(config.device.as_deref(), Some("pi-1"));
    let named = format!("device = \"cellar\"\njoined = \"/x/collector.toml\"\n{without}");
    let mut config = Config::parse(&named, "x").unwrap();
    assert_eq!(
        config.joined.as_deref(),
        Some(Path::new("/x/collector.toml"))
    );
    config.join(joined.clone()).unwrap();
    assert_eq!(config.device.as_deref(), Some("cellar"));
    let mut config = Config::parse(SMALLEST, "x").unwrap();
    let error = config.join(joined).unwrap_err().to_string();
    assert!(error.contains("http://pc:8833") && error.contains("\nhint: remove the line"));
}

#[test]
fn a_configuration_without_a_bus_or_with_the_same_twice_is_refused() {
    assert!(refusal("collector = \"http://c:1\"").contains("missing field `bus`"));
    assert!(
        refusal("collector = \"http://c:1\"\nbus = []")
            .contains("expected 1 to 16 [[bus]], found 0")
    );
    let twice =
        format!("{SMALLEST}[[bus]]\npath = \"/dev/i2c-1\"\n[[bus.sensor]]\naddress = 0x68\n");
    assert!(
        refusal(&twice).starts_with("agent.toml:6:1: the bus /dev/i2c-1 is named twice"),
        "{}",
        refusal(&twice)
    );
    let bare = SMALLEST.replace("[[bus.sensor]]\naddress = 0x69", "sensor = []");
    assert!(refusal(&bare).contains("expected at least one [[bus.sensor]]"));
}

#[test]
fn a_file_that_is_far_too_long_is_refused_unread() {
    let long = "#".repeat(CONFIG_BYTES_MAX + 1);
    let refused = Config::parse(&long, "x").unwrap_err().to_string();
    let expected =
        "x:1:1: 65537 bytes of text, expected at most 65536\nhint: is this really agent.toml?";
    assert_eq!(refused, expected);
}
