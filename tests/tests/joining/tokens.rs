//! Step 3: tests the token by posting an empty batch of this device.

use crate::site::{Site, mode};
use grideye_tests::programs::{grideye, grideye_agent, run, wait_for};
use std::fs;
use std::process::Stdio;

const TAKEN: &str = "3/6 the token: its frames are taken\n";

/// One line's code with another's token.
fn with_token_of(code: &str, token: &str) -> String {
    let start = code.find("token=").unwrap() + 6;
    let end = code.find(",pin=").unwrap();
    format!("{}{token}{}", &code[..start], &code[end..])
}

fn token_in(code: &str) -> &str {
    let start = code.find("token=").unwrap() + 6;
    &code[start..code.find(",pin=").unwrap()]
}

#[test]
fn only_a_token_with_which_this_device_s_frames_are_taken_joins_it() {
    let site = Site::new();
    let (mine, others) = (site.code("pi-1"), site.code("pi-2"));
    let joined = site.join(&mine);
    assert_eq!(joined.code, 0, "{joined:?}");
    assert!(joined.stdout.contains(TAKEN), "{joined:?}");
    let written = fs::read_to_string(site.path("collector.toml")).unwrap();

    let read = site.grideye(&["token", "make", "ana", "--scope", "read"]);
    assert_eq!(read.code, 0, "{read:?}");
    let no_token = mine.replace(&format!("token={},", token_in(&mine)), "");
    let lines = [
        (
            with_token_of(&mine, token_in(&others)),
            "this token is for another device, and this one is called pi-1\nhint: print a line with `grideye enroll pi-1`, or set `device` in agent.toml",
        ),
        (
            with_token_of(&mine, read.stdout.trim()),
            "this token is not for frames\nhint: print a line with `grideye enroll pi-1`",
        ),
        (
            no_token,
            "the token is not, or no longer, known there\nhint: print a new line with `grideye enroll pi-1`",
        ),
    ];
    for (line, said) in &lines {
        refused(&site, line, said);
    }
    // The test batch leaves no stream, device or boot.
    let audit = site.client("audit", &[]);
    assert_eq!(audit.stdout.trim(), "no stream yet", "{audit:?}");

    assert_eq!(site.grideye(&["token", "revoke", "pi-1"]).code, 0);
    wait_for("the revocation", || {
        (site.join(&mine).code == 1).then_some(())
    });
    refused(&site, &mine, lines[2].1);
    assert_eq!(
        fs::read_to_string(site.path("collector.toml")).unwrap(),
        written
    );
}

fn refused(site: &Site, line: &str, said: &str) {
    let refused = site.join(line);
    assert_eq!(refused.code, 1, "{refused:?}");
    let begin = format!(
        "error: step 3 of 6, the token, failed (nothing was changed): {}: {said}",
        site.url
    );
    assert!(refused.stderr.starts_with(&begin), "{refused:?}");
}

#[test]
fn a_token_of_several_devices_joins_each_by_the_name_in_its_configuration() {
    let site = Site::new();
    let enrolled = site.grideye(&["enroll", "pi-1", "pi-2"]);
    assert_eq!(enrolled.code, 0, "{enrolled:?}");
    let line = enrolled.stdout.trim();
    let bus = "[[bus]]\npath = \"/dev/i2c-1\"\n[[bus.sensor]]\naddress = 0x69\n";
    let config = site.path("agent.toml");
    for (device, said) in [
        ("pi-2", None),
        (
            "pi-3",
            Some("this token is for another device, and this one is called pi-3\n"),
        ),
    ] {
        fs::write(&config, format!("device = \"{device}\"\n{bus}")).unwrap();
        match said {
            None => {
                let joined = site.join(line);
                assert_eq!(joined.code, 0, "{joined:?}");
                assert!(joined.stdout.contains(TAKEN), "{joined:?}");
            }
            Some(said) => refused(&site, line, said),
        }
        let checked = run(grideye_agent().args(["check", "--config"]).arg(&config));
        let told = said.unwrap_or("its frames are taken\n");
        assert!(checked.stdout.contains(told), "{checked:?}");
    }
}

#[test]
fn the_line_comes_by_standard_input_where_no_list_of_processes_shows_it() {
    let site = Site::new();
    let line = site.enroll("pi-1");
    for arguments in [&["-"][..], &[]] {
        let piped = site.path("line");
        fs::write(&piped, format!("{line}\n")).unwrap();
        let out = site.path("collector.toml");
        let joined = grideye_agent()
            .arg("join")
            .args(arguments)
            .arg("--out")
            .arg(&out)
            .stdin(fs::File::open(&piped).unwrap())
            .output()
            .unwrap();
        assert!(joined.status.success(), "{joined:?}");
        fs::remove_file(out).unwrap();
    }
}

/// The frames of an outage of 401s are all delivered with the new token, and no process was restarted.
#[test]
fn a_running_agent_whose_token_is_replaced_goes_on_with_the_new_one_and_loses_nothing() {
    let site = Site::new();
    let first = site.code("pi-1");
    assert_eq!(site.join(&first).code, 0);
    let config = site.path("agent.toml");
    let bus = "[[bus]]\npath = \"/dev/i2c-1\"\n[[bus.sensor]]\naddress = 0x69\n";
    fs::write(&config, bus).unwrap();
    let agent = grideye()
        .args([
            "emulate",
            "--quiet",
            "--scene",
            "scenes/experiment-1.toml",
            "--",
        ])
        .arg(grideye_agent().get_program())
        .args(["run", "--frames", "120", "--config"])
        .arg(&config)
        .stdout(Stdio::piped())
        .stderr(fs::File::create(site.path("agent.log")).unwrap())
        .spawn()
        .unwrap();
    let count = |key: &str| {
        let audit = site.client("audit", &["--json"]);
        let audit: serde_json::Value = serde_json::from_str(&audit.stdout).unwrap_or_default();
        audit[0][key].as_u64().unwrap_or(0)
    };
    wait_for("the first frames", || (count("stored") > 0).then_some(()));
    assert_eq!(site.grideye(&["token", "revoke", "pi-1"]).code, 0);
    let log = wait_for("the refusal", || {
        let log = fs::read_to_string(site.path("agent.log")).unwrap();
        log.contains("status 401").then_some(log)
    });
    let said = "records wait: the collector forbids it, status 401: this token was revoked\nhint: print a line with `grideye enroll pi-1` on the collector's machine, and paste it here to `sudo grideye-agent join --replace -`\n";
    assert!(log.contains(said), "{log}");
    let (id, _secret) = token_in(&first)[8..].split_once('-').unwrap();
    let (id, name) = (format!("\"token\":\"{id}\""), "\"name\":\"pi-1\"");
    let named = |line: &str| line.contains(&id) && line.contains(name);
    assert!(site.log().lines().any(named), "{}", site.log());

    let second = site.code("pi-1");
    let replaced = run(grideye_agent()
        .args(["join", &second, "--no-start", "--replace", "--out"])
        .arg(site.path("collector.toml")));
    assert_eq!(replaced.code, 0, "{replaced:?}");
    let told =
        "; one that runs takes the new token once its collector refuses the old one; restart it";
    assert!(replaced.stdout.contains(told), "{replaced:?}");
    let ended = agent.wait_with_output().unwrap();
    let summary = String::from_utf8_lossy(&ended.stdout);
    let whole = "120 read = 120 stored + 0 dropped + 0 lost; ";
    assert!(summary.contains(whole), "{summary}");
    assert_eq!((count("read"), count("stored")), (120, 120));
}

#[test]
fn two_tokens_of_a_device_are_told_apart_by_their_dates_and_states() {
    let site = Site::new();
    let first = site.code("pi-1");
    assert_eq!(site.grideye(&["token", "revoke", "pi-1"]).code, 0);
    let second = site.code("pi-1");
    let listed = site.grideye(&["token", "list"]).stdout;
    let lines: Vec<&str> = listed.lines().collect();
    assert!(lines[0].starts_with("token         made (UTC)        state    scope   name  devices"));
    let of = |code: &str| token_in(code)[8..20].to_owned();
    for (line, id, state) in [
        (lines[2], of(&first), "revoked"),
        (lines[3], of(&second), "good   "),
    ] {
        // The date itself is the clock's.
        let date = &line[14..30];
        let is_date = |(at, c): (usize, char)| match at {
            4 | 7 => c == '-',
            10 => c == ' ',
            13 => c == ':',
            _ => c.is_ascii_digit(),
        };
        assert!(date.chars().enumerate().all(is_date), "{listed}");
        assert!(line.starts_with(&id), "{listed}");
        assert!(
            line.ends_with(&format!("  {state}  ingest  pi-1  pi-1")),
            "{listed}"
        );
    }
}

#[test]
fn a_line_goes_to_a_file_for_its_owner_alone_and_the_last_address_is_kept() {
    let site = Site::new();
    let out = site.path("line.txt");
    let to_file = ["--out", out.to_str().unwrap()];
    let url = "https://pc.local:8835";
    let enrolled = site.grideye(&[&["enroll", "pi-1", "--url", url], &to_file[..]].concat());
    assert_eq!(enrolled.code, 0, "{enrolled:?}");
    assert!(!enrolled.stdout.contains("grideye-"), "{enrolled:?}");
    assert_eq!(mode(&out), 0o600);
    let line = fs::read_to_string(&out).unwrap();
    assert!(
        line.starts_with(&format!("echo 'grideye:{url},device=pi-1,token=")),
        "{line}"
    );
    // A file that is there may hold a token in use: it stays, and no token is made.
    let again = site.grideye(&[&["enroll", "pi-3"], &to_file[..]].concat());
    assert_eq!(again.code, 2, "{again:?}");
    assert!(!site.grideye(&["token", "list"]).stdout.contains("pi-3"));
    // Another device joins the same collector.
    let begin = format!("echo 'grideye:{url},device=pi-2,token=");
    assert!(site.enroll("pi-2").starts_with(&begin));
}
