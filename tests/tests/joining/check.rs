//! What `grideye-agent check` reports about the collector.

use crate::site::Site;
use grideye_tests::programs::{grideye_agent, run, wait_for};

#[test]
fn check_says_whether_the_collector_takes_the_frames_and_what_to_do_if_not() {
    let site = Site::new();
    let joined = site.join(&site.enroll("pi-1"));
    assert_eq!(joined.code, 0, "{joined:?}");
    let config = site.path("agent.toml");
    let bus = "[[bus]]\npath = \"/nonexistent/i2c-1\"\n[[bus.sensor]]\naddress = 0x69\n";
    std::fs::write(&config, bus).unwrap();
    let check = |more: &[&str]| {
        run(grideye_agent()
            .args(["check", "--config"])
            .arg(&config)
            .args(more))
    };
    let well = check(&[]);
    let said = format!("collector: {}: its frames are taken\n", site.url);
    assert!(well.stdout.contains(&said), "{well:?}");
    assert!(well.stdout.contains("\nclock: "), "{well:?}");
    let json = check(&["--json"]);
    let said = format!("{{\"collector\":{{\"ok\":true,\"url\":\"{}\"}}}}", site.url);
    assert!(json.stdout.lines().any(|line| line == said), "{json:?}");

    // A collector with a new authority, at the same address.
    let other = Site::new();
    let text = std::fs::read_to_string(site.path("collector.toml")).unwrap();
    let moved = text.replace(&site.url, &other.url);
    std::fs::write(site.path("collector.toml"), moved).unwrap();
    let unknown = check(&[]);
    assert!(
        unknown.stdout.contains("collector: failed\nerror: ")
            && unknown.stdout.contains("hint: the collector must show a certificate of the authority that this agent joined"),
        "{unknown:?}"
    );
    std::fs::write(site.path("collector.toml"), text).unwrap();
    assert_eq!(site.grideye(&["token", "revoke", "pi-1"]).code, 0);
    let revoked = wait_for("the revocation", || {
        let checked = check(&[]);
        (!checked.stdout.contains("its frames are taken")).then_some(checked)
    });
    assert!(
        revoked
            .stdout
            .contains("the token is not, or no longer, known there\nhint: print a new line"),
        "{revoked:?}"
    );
}
