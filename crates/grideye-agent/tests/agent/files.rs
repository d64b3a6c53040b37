//! The agent and the system accept the files for the Raspberry Pi.

use grideye_agent::config::{BusConfig, Config};
use std::path::{Path, PathBuf};

fn file(name: &str) -> String {
    let path: PathBuf = [
        env!("CARGO_MANIFEST_DIR"),
        "..",
        "..",
        "firmware-config",
        name,
    ]
    .iter()
    .collect();
    std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

#[test]
fn the_annotated_configuration_is_valid_and_its_comments_show_the_defaults() {
    let text = file("agent.toml");
    let config = Config::parse(&text, "agent.toml").unwrap();
    assert_eq!(
        config.buses,
        [BusConfig::with_one_sensor(
            "/dev/i2c-1",
            amg8833::Address::High
        )]
    );
    // The default port of `grideye collect`; the page shows how to open it.
    assert_eq!(config.collector, None, "joining sets it");
    let command = "grideye collect --listen 0.0.0.0:8833\n";
    assert!(file("README.md").contains(command));
    // Every commented-out setting is the default, so uncommenting it changes nothing.
    let uncommented: String = text
        .lines()
        .map(|line| {
            line.strip_prefix("# ")
                .filter(|rest| is_setting(rest))
                .unwrap_or(line)
        })
        .flat_map(|line| [line, "\n"])
        .collect();
    let spelt_out = Config::parse(&uncommented, "agent.toml").unwrap();
    assert_eq!(spelt_out.device.as_deref(), Some("pi-1"));
    assert_eq!(
        config.health, None,
        "who does not ask for it has no port open"
    );
    assert!(spelt_out.health.unwrap().ip().is_loopback());
    let collector = spelt_out.collector.unwrap();
    assert!(collector.ends_with(":8833"), "{collector}");
    assert_eq!(spelt_out.buses[0].sensors.len(), 2);
    assert_eq!(spelt_out.buses[0].sensors[0], config.buses[0].sensors[0]);
    assert_eq!(
        (
            spelt_out.post_every,
            spelt_out.ring_frames,
            spelt_out.request_timeout
        ),
        (
            config.post_every,
            config.ring_frames,
            config.request_timeout
        )
    );
}

fn is_setting(line: &str) -> bool {
    let is_key = |key: &str| key.chars().all(|c| c.is_ascii_lowercase() || c == '_');
    line.starts_with('[') || line.split_once(" = ").is_some_and(|(key, _)| is_key(key))
}

#[test]
fn the_unit_starts_the_agent_with_the_configuration_that_the_page_names() {
    let unit = file("grideye-agent.service");
    assert!(
        unit.contains(
            "ExecStart=/usr/local/bin/grideye-agent run --config /etc/grideye/agent.toml\n"
        )
    );
    for needed in [
        "User=grideye-agent",
        "SupplementaryGroups=i2c",
        "DeviceAllow=char-i2c rw",
        "ProtectSystem=strict",
        "RestartPreventExitStatus=2",
    ] {
        assert!(unit.lines().any(|line| line == needed), "{needed}");
    }
    let user = file("grideye-agent.sysusers");
    assert!(
        user.lines()
            .any(|line| line.starts_with("u grideye-agent ")),
        "{user}"
    );
    let page = file("README.md");
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../firmware-config");
    for entry in std::fs::read_dir(folder).unwrap() {
        let name = entry.unwrap().file_name().into_string().unwrap();
        let named = [format!("`{name}`"), format!("sudo cp {name} ")];
        assert!(
            name == "README.md" || named.iter().any(|named| page.contains(named)),
            "{name} is not on the page"
        );
    }
}

#[test]
fn the_boot_configuration_switches_the_bus_on() {
    let settings = file("config.txt");
    let settings: Vec<&str> = settings
        .lines()
        .filter(|line| !line.starts_with('#'))
        .collect();
    assert_eq!(
        settings,
        ["dtparam=i2c_arm=on", "dtparam=i2c_arm_baudrate=400000"]
    );
}
