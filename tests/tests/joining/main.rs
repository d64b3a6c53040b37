//! From `grideye enroll` to the first frame: the real programs with tokens and TLS.

#![expect(clippy::unwrap_used, reason = "what fails in a helper fails the test")]

mod certificates;
mod check;
mod one_machine;
mod pasted;
mod site;
mod tokens;

use grideye_tests::programs::{grideye, grideye_agent, run, terminate, wait, wait_for};
use site::{Site, mode};
use std::io::{BufRead as _, BufReader};
use std::process::{Command, Stdio};

#[test]
fn a_line_is_joined_and_the_agent_delivers_over_tls_with_its_token() {
    let site = Site::new();
    let line = site.enroll("pi-1");
    let begin = format!("echo 'grideye:{},device=pi-1,token=grideye-", site.url);
    let end = "' | sudo grideye-agent join -";
    assert!(line.starts_with(&begin) && line.ends_with(end), "{line}");
    let joined = site.join(&line);
    assert_eq!(joined.code, 0, "{joined:?}");
    assert!(
        joined.stdout.contains("as pi-1: its frames are taken"),
        "{joined:?}"
    );
    assert_eq!(mode(&site.path("collector.toml")), 0o600);

    let config = site.path("agent.toml");
    let bus = "[[bus]]\npath = \"/nonexistent/i2c-1\"\n[[bus.sensor]]\naddress = 0x69\n";
    std::fs::write(&config, bus).unwrap();
    let mut agent = grideye_agent()
        .args(["run", "--config"])
        .arg(&config)
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let audit = wait_for("the agent's account", || {
        let audit = site.client("audit", &["--json"]);
        (audit.code == 0 && audit.stdout.contains("\"pi-1\"")).then_some(audit)
    });
    assert!(audit.stdout.contains("\"i2c-1:0x69\""), "{audit:?}");
    terminate(&agent);
    assert_eq!(wait(&mut agent), 0);

    let secrets = ["boss.token", "collector.toml"].map(|name| {
        let text = std::fs::read_to_string(site.path(name)).unwrap();
        let start = text.find("grideye-").unwrap();
        text[start + 21..start + 85].to_owned()
    });
    let log = site.log();
    assert!(
        log.lines()
            .next()
            .unwrap()
            .contains("\"event\":\"listening\""),
        "{log}"
    );
    for secret in secrets {
        assert_eq!(secret.len(), 64);
        assert!(!log.contains(&secret), "{log}");
    }
}

#[test]
fn a_file_that_is_there_is_kept_unless_it_is_to_be_replaced() {
    let site = Site::new();
    let (first, second) = (site.code("pi-1"), site.code("pi-2"));
    let out = site.path("collector.toml");
    let kept = |line: &str| {
        let before = std::fs::read(&out).unwrap();
        let refused = site.join(line);
        let told = format!(
            "error: step 4 of 6, the file, failed (nothing was changed): {} exists and is kept\nhint: add --replace ",
            out.display()
        );
        assert_eq!(refused.code, 2, "{refused:?}");
        assert!(refused.stderr.starts_with(&told), "{refused:?}");
        assert_eq!(std::fs::read(&out).unwrap(), before);
    };
    std::fs::write(&out, "my notes").unwrap();
    kept(&first);
    std::fs::remove_file(&out).unwrap();
    std::os::unix::fs::symlink(site.path("notes"), &out).unwrap();
    std::fs::write(site.path("notes"), "my notes").unwrap();
    kept(&first);
    std::fs::remove_file(&out).unwrap();
    assert_eq!(site.join(&first).code, 0);
    // The same line may be pasted again, another one not by mistake.
    assert_eq!(site.join(&first).code, 0);
    kept(&second);
    let replaced = run(grideye_agent()
        .args(["join", &second, "--replace", "--out"])
        .arg(&out));
    assert_eq!(replaced.code, 0, "{replaced:?}");
    assert_eq!(mode(&out), 0o600);
    let text = std::fs::read_to_string(&out).unwrap();
    assert!(text.contains("pi-2"), "{replaced:?}");
}

#[test]
fn a_line_that_is_wrong_in_any_part_joins_nothing_and_says_which() {
    let site = Site::new();
    let line = site.code("pi-1");
    let pin = line.find("sha256-").unwrap() + 7;
    let digit = if &line[pin..=pin] == "0" { "1" } else { "0" };
    let other_pin = format!("{}{digit}{}", &line[..pin], &line[pin + 1..]);
    let secret = pin - 20;
    let digit = if &line[secret..=secret] == "0" {
        "1"
    } else {
        "0"
    };
    let other_token = format!("{}{digit}{}", &line[..secret], &line[secret + 1..]);
    let nobody = line.replace(&site.url, "https://127.0.0.1:9");
    for (line, code, step, said) in [
        (
            &line[..line.len() - 1],
            2,
            "1 of 6, the line",
            "its pin is cut",
        ),
        (
            &other_pin,
            1,
            "2 of 6, the collector",
            "shows another authority than the line's pin says",
        ),
        (&nobody, 1, "2 of 6, the collector", "no connection"),
        (
            &other_token,
            1,
            "3 of 6, the token",
            "the token is not, or no longer, known there",
        ),
    ] {
        let refused = site.join(line);
        assert_eq!(refused.code, code, "{refused:?}");
        let step = format!("error: step {step}, failed (nothing was changed): ");
        assert!(refused.stderr.starts_with(&step), "{refused:?}");
        assert!(
            refused.stderr.contains(said) && refused.stderr.contains("\nhint: "),
            "{refused:?}"
        );
        assert!(!site.path("collector.toml").exists());
    }
    let boss = std::fs::read_to_string(site.path("boss.token")).unwrap();
    let start = line.find("token=").unwrap() + 6;
    let end = line.find(",pin=").unwrap();
    let as_boss = format!("{}{}{}", &line[..start], boss.trim(), &line[end..]);
    let refused = site.join(&as_boss);
    assert!(
        refused.stderr.contains("this token is not for frames"),
        "{refused:?}"
    );
}

#[test]
fn a_revoked_token_is_out_within_seconds_and_is_listed_as_such() {
    let site = Site::new();
    let line = site.enroll("pi-1");
    let listed = site.grideye(&["token", "list"]);
    assert!(
        listed.stdout.contains("  good     ingest  pi-1  pi-1"),
        "{listed:?}"
    );
    assert_eq!(site.grideye(&["token", "revoke", "pi-1"]).code, 0);
    wait_for("the revocation", || {
        (site.join(&line).code == 1).then_some(())
    });
    let listed = site.grideye(&["token", "list", "--json"]);
    let tokens: serde_json::Value = serde_json::from_str(&listed.stdout).unwrap();
    assert!(
        tokens[0]["t_revoked_s"].is_null() && tokens[1]["t_revoked_s"].is_i64(),
        "{tokens}"
    );
    let again = site.grideye(&["token", "revoke", "pi-1"]);
    assert_eq!(again.code, 2, "{again:?}");
}

#[test]
fn the_other_commands_need_the_token_and_the_authority_and_say_so() {
    let site = Site::new();
    let audit = site.client("audit", &[]);
    assert_eq!(
        (audit.code, audit.stdout.trim()),
        (0, "no stream yet"),
        "{audit:?}"
    );
    let bare = run(grideye().args(["audit", "--collector", &site.url]));
    assert_eq!(bare.code, 2);
    assert!(bare.stderr.contains("hint: --authority FILE"), "{bare:?}");
    let authority = site.path("access/authority.pem");
    let no_token = run(grideye()
        .args(["audit", "--collector", &site.url, "--authority"])
        .arg(authority));
    assert_eq!(no_token.code, 1);
    assert!(
        no_token.stderr.contains("this collector requires a token"),
        "{no_token:?}"
    );
    let recorded = site.client("record", &["evening", "--seconds", "0"]);
    assert!(
        recorded.stdout.contains("recorded 0 frames"),
        "{recorded:?}"
    );
    let deleted = site.client("record", &["evening", "--delete"]);
    assert_eq!(deleted.code, 0, "{deleted:?}");
    let again = site.client("record", &["evening", "--delete"]);
    assert_eq!(again.code, 2, "{again:?}");
    assert!(again.stderr.contains("no recording named"), "{again:?}");
}

#[test]
fn a_lan_address_without_tokens_is_refused_with_the_fix_and_the_fix_works() {
    let at = tempfile::tempdir().unwrap();
    let collect = |command: &mut Command| {
        command
            .current_dir(at.path())
            .args(["collect", "--listen", "0.0.0.0:0"])
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap()
    };
    let refused = collect(&mut grideye()).wait_with_output().unwrap();
    let said = String::from_utf8_lossy(&refused.stderr).into_owned();
    assert_eq!(refused.status.code(), Some(2), "{said}");
    assert!(
        said.contains("`grideye enroll DEVICE`") && said.contains("--trust-network"),
        "{said}"
    );
    assert!(!at.path().join("grideye.sqlite").exists());
    let enrolled = run(grideye().current_dir(at.path()).args(["enroll", "pi-1"]));
    assert_eq!(enrolled.code, 0, "{enrolled:?}");
    let mut collector = collect(&mut grideye());
    let mut line = String::new();
    let stdout = collector.stdout.take().unwrap();
    BufReader::new(stdout).read_line(&mut line).unwrap();
    terminate(&collector);
    assert_eq!(wait(&mut collector), 0);
    assert!(line.starts_with("https://0.0.0.0:"), "{line}");
}
