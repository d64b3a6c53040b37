//! Step 3: tests the token by posting an empty batch of this device.

use crate::site::Site;
use grideye_tests::programs::{grideye_agent, run, wait_for};
use std::fs;

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
