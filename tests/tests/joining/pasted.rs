//! The whole line on a whole machine: pasted into a shell, with a `systemctl` that starts the agent on the emulated
//! bus; and every later step that can fail.

use crate::site::{Site, mode};
use grideye_tests::programs::{Ended, folder, grideye_agent, root, run};
use std::fs;
use std::os::unix::fs::PermissionsExt as _;
use std::path::PathBuf;
use std::process::Command;

/// Longer than a busy machine takes to read a first frame.
const PATIENCE_S: &str = "240";

const CONFIG: &str = "[[bus]]\npath = \"/dev/i2c-1\"\n[[bus.sensor]]\naddress = 0x69\n";

/// A machine with a fake `systemctl`: its replies come from files, its calls are logged, and a restart runs the file
/// `start`.
struct Machine {
    site: Site,
}

impl Machine {
    fn new() -> Self {
        let machine = Self { site: Site::new() };
        fs::create_dir(machine.path("bin")).unwrap();
        machine.script("sudo", "exec \"$@\"\n");
        let at = machine.site.at.path().display().to_string();
        machine.script("systemctl", &SYSTEMCTL.replace("AT", &at));
        machine.says("is-system-running", "running");
        machine.says("show", "loaded");
        machine.configured(CONFIG);
        machine
    }

    fn path(&self, name: &str) -> PathBuf {
        self.site.path(name)
    }

    fn script(&self, name: &str, text: &str) {
        let path = self.path("bin").join(name);
        fs::write(&path, format!("#!/bin/sh\n{text}")).unwrap();
        fs::set_permissions(&path, fs::Permissions::from_mode(0o755)).unwrap();
    }

    /// Sets the reply of `systemctl` to this verb.
    fn says(&self, verb: &str, what: &str) {
        fs::write(self.path(&format!("{verb}.says")), format!("{what}\n")).unwrap();
    }

    fn configured(&self, config: &str) {
        fs::write(self.path("agent.toml"), config).unwrap();
    }

    /// Makes a restart start the agent on an emulated bus that shows `shown`.
    fn starts_the_agent(&self, shown: &str) {
        let programs = folder().canonicalize().unwrap();
        let programs = programs.display();
        let line = format!(
            "cd {} && exec {programs}/grideye emulate --quiet {shown} -- {programs}/grideye-agent run --config {}\n",
            root().canonicalize().unwrap().display(),
            self.path("agent.toml").display()
        );
        fs::write(self.path("start"), line).unwrap();
    }

    /// Pastes a line into a shell in which `grideye-agent` stores its file in the test's folder instead of `/etc`.
    fn pastes(&self, line: &str, options: &str) -> Ended {
        let agent = grideye_agent().get_program().to_owned();
        let agent = PathBuf::from(agent).canonicalize().unwrap();
        self.script(
            "grideye-agent",
            &format!(
                "exec {} \"$@\" --out {} {options}\n",
                agent.display(),
                self.path("collector.toml").display()
            ),
        );
        let path = std::env::var("PATH").unwrap();
        run(Command::new("sh")
            .args(["-c", line])
            .env("PATH", format!("{}:{path}", self.path("bin").display())))
    }

    /// The calls of `systemctl`, without queries.
    fn asked(&self) -> Vec<String> {
        let text = fs::read_to_string(self.path("asked")).unwrap_or_default();
        let changes = |line: &&str| line.starts_with("enable") || line.starts_with("restart");
        text.lines().filter(changes).map(str::to_owned).collect()
    }

    /// The collector's frames of `pi-1`, without missing ones.
    fn frames(&self) -> u64 {
        let audit = self.site.client("audit", &["--json"]);
        let audit: serde_json::Value = serde_json::from_str(&audit.stdout).unwrap();
        let streams = audit.as_array().unwrap().iter();
        streams
            .filter(|stream| stream["device"] == "pi-1" && stream["sensor"] == "i2c-1:0x69")
            .map(|stream| stream["stored"].as_u64().unwrap() - stream["missing"].as_u64().unwrap())
            .sum()
    }
}

impl Drop for Machine {
    fn drop(&mut self) {
        // The process group that `systemctl` created for the agent; it may have ended already.
        if let Ok(leader) = fs::read_to_string(self.path("pid")) {
            let group = format!("-{}", leader.trim());
            let _ = Command::new("kill").args(["-KILL", "--", &group]).output();
        }
    }
}

/// Kills only processes that it started itself; treats a zombie as ended.
const SYSTEMCTL: &str = r#"
while case "$1" in --no-*) true ;; *) false ;; esac; do shift; done
echo "$*" >> AT/asked
runs() { [ -e AT/pid ] && grep -q '^State:.[^Z]' "/proc/$(cat AT/pid)/status" 2>/dev/null; }
case "$1" in
  restart)
    if runs; then kill -TERM "-$(cat AT/pid)"; while runs; do sleep 0.05; done; fi
    if [ -e AT/restart.says ]; then cat AT/restart.says >&2; exit 1; fi
    if [ -e AT/start ]; then
      setsid sh AT/start >> AT/agent.log 2>&1 < /dev/null &
      echo $! > AT/pid
    fi ;;
  is-active)
    if [ -e AT/is-active.says ]; then cat AT/is-active.says; elif runs; then echo active; else echo failed; exit 3; fi ;;
  *)
    [ ! -e "AT/$1.says" ] || cat "AT/$1.says" ;;
esac
"#;

#[test]
fn a_line_pasted_into_a_shell_ends_with_the_first_frame_at_the_collector() {
    let machine = Machine::new();
    machine.starts_the_agent("--constant 21.5");
    let line = machine.site.enroll("pi-1");
    let options = format!("--service grideye-agent --wait {PATIENCE_S}");
    let joined = machine.pastes(&line, &options);
    assert_eq!(joined.code, 0, "{joined:?}");
    let (url, file) = (&machine.site.url, machine.path("collector.toml"));
    let told = format!(
        "1/6 the line: read: pi-1 joins {url}\n\
         2/6 the collector: reached, and its authority is the one that the line pins\n\
         3/6 the token: its frames are taken\n\
         4/6 the file: {} written, for its owner alone\n\
         5/6 the service: grideye-agent enabled and started\n\
         6/6 the first frame: pi-1/i2c-1:0x69 gave one, and the collector has it\n\
         joined {url} as pi-1: its frames are taken\n",
        file.display()
    );
    assert_eq!(joined.stdout, told);
    assert_eq!(mode(&file), 0o600);
    let changes = ["enable grideye-agent", "restart grideye-agent"];
    assert_eq!(machine.asked(), changes);
    let frames = machine.frames();
    assert!(frames > 0, "the collector has what was told");

    // The same line again: the service restarts, and joining waits for a frame of the new boot.
    let before = fs::read_to_string(&file).unwrap();
    let again = machine.pastes(&line, &options);
    assert_eq!((again.code, again.stdout), (0, told), "{}", again.stderr);
    assert_eq!(fs::read_to_string(&file).unwrap(), before);
    assert!(machine.frames() > frames);
}

#[test]
fn without_a_service_joining_names_the_command_to_run() {
    let machine = Machine::new();
    let line = machine.site.enroll("pi-1");
    let by_hand = format!(
        "grideye-agent run --config {}\n6/6 the first frame: not waited for; ",
        machine.path("agent.toml").display()
    );
    let with_service = "--service grideye-agent";
    for (verb, says, options, why) in [
        ("show", "loaded", "--no-start", "--no-start says so; "),
        (
            "show",
            "loaded",
            "",
            "the service grideye-agent reads /etc/grideye/collector.toml, and this is another file; ",
        ),
        (
            "is-system-running",
            "offline",
            with_service,
            "no systemd runs here; ",
        ),
        (
            "show",
            "not-found",
            with_service,
            "there is no unit grideye-agent here; install the package, or firmware-config/grideye-agent.service",
        ),
    ] {
        machine.says("is-system-running", "running");
        machine.says(verb, says);
        let joined = machine.pastes(&line, options);
        assert_eq!(joined.code, 0, "{why}: {joined:?}");
        let told = format!("5/6 the service: not started: {why}");
        assert!(
            joined.stdout.contains(&told) && joined.stdout.contains(&by_hand),
            "{why}: {joined:?}"
        );
    }
    assert!(machine.asked().is_empty(), "{:?}", machine.asked());
}

#[test]
fn a_service_that_cannot_be_started_is_step_5_and_the_file_stays_good() {
    let machine = Machine::new();
    let line = machine.site.enroll("pi-1");
    let twice = format!("collector = \"http://pc:8833\"\n{CONFIG}");
    let renamed = format!("device = \"attic\"\n{CONFIG}");
    let broken = CONFIG.replace("address", "adress");
    let failed = "Job for grideye-agent.service failed";
    for (config, show, restart, code, said, hint) in [
        (
            CONFIG,
            "masked",
            None,
            1,
            "is masked",
            "hint: sudo systemctl unmask grideye-agent",
        ),
        (
            CONFIG,
            "bad-setting",
            None,
            1,
            "(bad-setting)",
            "hint: `systemctl status grideye-agent`",
        ),
        (
            CONFIG,
            "loaded",
            Some(failed),
            1,
            failed,
            "`journalctl -u grideye-agent -n 20`",
        ),
        (&twice, "loaded", None, 2, "collector", "hint: "),
        (
            &renamed,
            "loaded",
            None,
            2,
            "calls this device attic, and the line is for pi-1",
            "grideye enroll attic",
        ),
        (&broken, "loaded", None, 2, "adress", "hint: "),
    ] {
        machine.configured(config);
        machine.says("show", show);
        if let Some(restart) = restart {
            machine.says("restart", restart);
        }
        let stopped = machine.pastes(&line, "--service grideye-agent");
        let context = format!("{said}: {stopped:?}");
        assert_eq!(stopped.code, code, "{context}");
        let begin = "error: step 5 of 6, the service, failed (steps 1 to 4 are done and stay, and the line may be pasted again): ";
        assert!(stopped.stderr.starts_with(begin), "{context}");
        for words in [said, hint] {
            assert!(stopped.stderr.contains(words), "{words}: {context}");
        }
        assert!(stopped.stdout.contains("4/6 the file: "), "{context}");
    }
    // The file from the first failure works once the machine is repaired.
    machine.configured(CONFIG);
    let checked = run(grideye_agent()
        .args(["check", "--config"])
        .arg(machine.path("agent.toml")));
    let taken = format!("collector: {}: its frames are taken", machine.site.url);
    assert!(checked.stdout.contains(&taken), "{checked:?}");
}

#[test]
fn a_service_without_its_configuration_is_step_5_and_is_not_started() {
    let machine = Machine::new();
    let line = machine.site.enroll("pi-1");
    fs::remove_file(machine.path("agent.toml")).unwrap();
    let missing = machine.pastes(&line, "--service grideye-agent");
    assert_eq!(missing.code, 2, "{missing:?}");
    assert!(
        missing.stderr.contains("agent.toml: No such file")
            && missing
                .stderr
                .contains("hint: copy firmware-config/agent.toml there"),
        "{missing:?}"
    );
    assert!(machine.asked().is_empty(), "{:?}", machine.asked());
}

#[test]
fn a_file_that_cannot_be_written_is_step_4_and_the_one_before_stays() {
    let site = Site::new();
    let joined = site.join(&site.enroll("pi-1"));
    assert_eq!(joined.code, 0, "{joined:?}");
    let out = site.path("collector.toml").join("collector.toml");
    let refused = run(grideye_agent()
        .args(["join", &site.enroll("pi-1"), "--out"])
        .arg(out));
    assert_eq!(refused.code, 1, "{refused:?}");
    assert!(
        refused
            .stderr
            .starts_with("error: step 4 of 6, the file, failed (nothing was changed): ")
            && refused
                .stderr
                .contains("\nhint: run this as root (sudo), or name a file of your own with --out"),
        "{refused:?}"
    );
    assert!(site.path("collector.toml").is_file());
}

const STEP_6: &str = "error: step 6 of 6, the first frame, failed (steps 1 to 5 are done and stay, and the line may be pasted again): ";

#[test]
fn a_service_that_ends_at_once_is_step_6_and_the_journal_is_named() {
    let machine = Machine::new();
    fs::write(machine.path("start"), "exit 2\n").unwrap();
    let line = machine.site.enroll("pi-1");
    let options = format!("--service grideye-agent --wait {PATIENCE_S}");
    let ended = machine.pastes(&line, &options);
    assert_eq!(ended.code, 1, "{ended:?}");
    let said = format!(
        "{STEP_6}the service grideye-agent has ended\nhint: `journalctl -u grideye-agent -n 20` says why\n"
    );
    assert!(ended.stderr.ends_with(&said), "{ended:?}");
}

#[test]
fn a_silent_service_gives_no_answer_at_the_time_limit() {
    let machine = Machine::new();
    machine.says("is-active", "active");
    let line = machine.site.enroll("pi-1");
    let silent = machine.pastes(&line, "--service grideye-agent --wait 1");
    assert_eq!(silent.code, 3, "{silent:?}");
    assert!(
        silent.stderr.contains(&format!(
            "{STEP_6}nothing of pi-1 came within 1 s\nhint: `journalctl -u grideye-agent -n 20`"
        )),
        "{silent:?}"
    );
}

#[test]
fn a_sensor_that_does_not_answer_is_step_6_with_the_reason_and_what_to_do() {
    let machine = Machine::new();
    let faults = machine.path("faults.toml");
    fs::write(&faults, "[[fault]]\nkind = \"nack-address\"\n").unwrap();
    machine.starts_the_agent(&format!("--constant 21.5 --faults {}", faults.display()));
    let line = machine.site.enroll("pi-1");
    let options = format!("--service grideye-agent --wait {PATIENCE_S}");
    let silent = machine.pastes(&line, &options);
    assert_eq!(silent.code, 1, "{silent:?}");
    let said = format!(
        "{STEP_6}the agent delivers, but pi-1/i2c-1:0x69 gives no frame: nack\nhint: nobody answers at this address"
    );
    assert!(
        silent.stderr.contains(&said)
            && silent
                .stderr
                .contains("`sudo systemctl stop grideye-agent; grideye-agent check`"),
        "{silent:?}"
    );
    assert_eq!(machine.frames(), 0);
}
