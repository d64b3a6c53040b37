//! The examples of the documents: every command that a person can copy is run, or is run by a test that is named here.
//!
//! A command in a document that this file does not know fails the test, and so does one here that no document has.

#![expect(
    clippy::unwrap_used,
    clippy::panic,
    reason = "what fails in a helper fails the test"
)]

use grideye_tests::broker::until;
use grideye_tests::programs::{Ended, folder, is_part_left_out, root, run};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::Command;

/// How a documented command is kept from rotting.
enum Kept {
    /// It is run as it stands, behind what makes its files, and must end with 0 and print these words.
    Run(&'static str, &'static [&'static str]),
    /// The same, as a program on the emulated sensor.
    Emulated(&'static [&'static str]),
    /// It serves until Ctrl-C, which comes once it has printed these words, and must end with 0.
    Serves(&'static str, &'static [&'static str]),
    /// A test of the repository runs it, or the same with another port, speed or length: file and function.
    By(&'static str, &'static str),
    /// It needs what no test has.
    Not(&'static str),
}

use Kept::{By, Emulated, Not, Run, Serves};

const PIPELINE: &str = "tests/tests/pipeline.rs";
const GUESTS: &str = "tests/tests/guests.rs";
const X86: &str = "a_stock_kernel_on_x86_64_has_the_emulated_chip_on_a_real_bus";
const ARM: &str =
    "an_arm64_guest_fetches_the_chip_over_tcp_and_runs_the_agent_for_the_raspberry_pi";
const JOINING: &str = "tests/tests/joining/pasted.rs";
const JOINING_CHECK: &str = "tests/tests/joining/check.rs";
const PASTED: &str = "a_line_pasted_into_a_shell_ends_with_the_first_frame_at_the_collector";
const DRIVER_CI: &str = "tests/tests/driver_ci.rs";
const DRIVER_CI_PYTHON: &str = "the_python_suite_passes_on_the_emulated_sensor";
const PACKAGES: &str = "tests/tests/packages.rs";
const INSTALLED: &str = "the_packages_are_installed_started_upgraded_removed_and_purged";
const WALK: &str = "grideye simulate scenes/experiment-3.toml --out walk.csv";

/// Every command of the documents.
const COMMANDS: &[(&str, Kept)] = &[
    // README.md
    (
        "cargo run --release -- demo",
        By(
            "tests/tests/demo_page.rs",
            "the_demonstration_shows_its_sensor_live_until_it_is_interrupted",
        ),
    ),
    (
        "cargo run --release -- demo --once --out out",
        By(
            PIPELINE,
            "the_demonstration_ends_with_delivery_scores_and_report",
        ),
    ),
    (
        "cargo run --release -p grideye-hardware -- device.toml",
        By(
            "tests/tests/hardware.rs",
            "every_check_passes_on_the_emulated_sensor",
        ),
    ),
    ("tests/run", Not("it is what runs this test")),
    (
        "cargo run --release -- demo --replay recordings/linaige/Session2_2021-07-01_RoomB_v2.csv --once --speed 20",
        By(
            PIPELINE,
            "a_real_recording_comes_out_as_it_went_in_through_registers_bus_http_and_store",
        ),
    ),
    (
        "grideye emulate --scene scenes/experiment-1.toml -- i2ctransfer -y 1 w1@0x69 0x80 r8",
        Run("", &["0x5d 0x00 0x5f 0x00 0x5e 0x00 0x5d 0x00"]),
    ),
    (
        "grideye emulate --scene scenes/experiment-1.toml -- grideye-agent check --bus /dev/i2c-1 --address 0x69",
        Run(
            "",
            &["i2c-1:0x69: ok", "thermistor 28.0000 °C", "20 frames read"],
        ),
    ),
    (
        "grideye-agent check --bus /dev/i2c-1 --address 0x69",
        Emulated(&["i2c-1:0x69: ok"]),
    ),
    (
        "grideye enroll pi-1 --url https://192.168.1.20:8833",
        Run(
            "",
            &[
                "echo 'grideye:https://192.168.1.20:8833,device=pi-1,token=grideye-",
                ",pin=sha256-",
                "' | sudo grideye-agent join -",
            ],
        ),
    ),
    (
        "grideye collect --listen 192.168.1.20:8833",
        Serves("grideye enroll pi-1", &["http://127.0.0.1:"]),
    ),
    (
        "grideye collect --scenes scenes",
        By(
            "tests/tests/page_beside.rs",
            "a_sensor_stands_beside_its_scene_with_difference_scores_and_verdict",
        ),
    ),
    (
        "echo 'grideye:https://192.168.1.20:8833,device=pi-1,token=…,pin=…' | sudo grideye-agent join -",
        By(JOINING, PASTED),
    ),
    (
        "grideye record evening --seconds 60 --out evening.csv",
        By(
            PIPELINE,
            "what_arrives_is_recorded_under_a_name_and_fetched",
        ),
    ),
    (
        "grideye compare --scene my-room.toml --recording evening.csv --report evening.html --json evening.json",
        Run(
            "cp scenes/experiment-1.toml my-room.toml; grideye simulate my-room.toml --seed 2 --out evening.csv",
            &["agrees"],
        ),
    ),
    (
        "grideye compare --scene my-room.toml --recording evening.csv --profile my-sensor.toml --thresholds my-thresholds.toml --junit evening.xml",
        Run(
            "cp scenes/experiment-1.toml my-room.toml; cp scenes/profiles/ideal.toml my-sensor.toml; printf '[frames_min]\\nvalue = 5\\nsource = \"half a second\"\\n' > my-thresholds.toml; grideye simulate my-room.toml --seed 2 --out evening.csv",
            &["agrees"],
        ),
    ),
    // firmware-config/README.md
    (
        "sudo cp 99-grideye-i2c.rules /etc/udev/rules.d/",
        Not("a Raspberry Pi"),
    ),
    (
        "sudo mkdir -p /etc/grideye && sudo cp agent.toml /etc/grideye/",
        Not("a Raspberry Pi"),
    ),
    (
        "sudo cp grideye-agent.service /etc/systemd/system/",
        Not("a Raspberry Pi"),
    ),
    (
        "sudo cp grideye-agent.sysusers /etc/sysusers.d/grideye-agent.conf && sudo systemd-sysusers",
        By(PACKAGES, INSTALLED),
    ),
    (
        "sudo apt install ./grideye-agent_0.1.0_arm64.deb",
        By(PACKAGES, INSTALLED),
    ),
    ("sudo usermod -aG i2c $USER", Not("a Raspberry Pi")),
    (
        "sudo -u grideye-collector grideye enroll pi-1 --access /var/lib/grideye-collector/access",
        Not("a machine with the service"),
    ),
    (
        "sudo systemctl enable --now grideye-collector",
        Not("a machine with the service"),
    ),
    (
        "grideye orient --sensor pi-1/i2c-1:0x69",
        By(
            "tests/tests/orient.rs",
            "live_frames_of_the_emulated_sensor_are_asked_for_and_told",
        ),
    ),
    ("sudo reboot", Not("a Raspberry Pi")),
    ("grideye-agent check", Emulated(&["i2c-1:0x69: ok"])),
    (
        "sudo systemctl enable --now grideye-agent",
        Not("a Raspberry Pi"),
    ),
    (
        "grideye collect --listen 0.0.0.0:8833",
        Serves("grideye enroll pi-1", &["https://0.0.0.0:"]),
    ),
    (
        "echo 'CODE' | sudo grideye-agent join -",
        By(JOINING, PASTED),
    ),
    // crates/grideye-agent/README.md
    (
        "grideye-agent check --config agent.toml",
        By(
            JOINING_CHECK,
            "check_says_whether_the_collector_takes_the_frames_and_what_to_do_if_not",
        ),
    ),
    (
        "grideye-agent run --config agent.toml",
        By(
            PIPELINE,
            "the_agent_delivers_from_a_device_file_to_a_collector",
        ),
    ),
    // crates/i2c-emulation/README.md
    (
        "cargo run -p i2c-emulation --example with_a_chip -- --via preload i2cget -y 1 0x50 0x10 i 4",
        Run("", &["0x10 0x11 0x12 0x13"]),
    ),
    ("modprobe -a vhci-hcd i2c-tiny-usb i2c-dev", By(GUESTS, X86)),
    (
        "grideye emulate --scene scenes/experiment-1.toml --usbip -- i2cdetect -l",
        By(GUESTS, X86),
    ),
    (
        "grideye emulate --scene scenes/experiment-1.toml --usbip 127.0.0.1:3240",
        By(GUESTS, ARM),
    ),
    (
        "usbip --tcp-port 3240 attach -r 10.0.2.2 -b 1-1",
        By(GUESTS, ARM),
    ),
    // scenes/README.md
    (
        "grideye simulate scenes/experiment-3.toml --view room.svg --out walk.gif",
        Run("", &[]),
    ),
    (
        "grideye simulate scenes/clothed-walk.toml --model paper",
        Run("", &[]),
    ),
    (
        "grideye fuse scenes/scenario-a-3x3.toml --out fused.png",
        Run("", &["26 x 26", "22 x 22", "least squares"]),
    ),
    (
        "grideye distinguish scenes/scenario-b-before.toml scenes/scenario-b-after.toml scenes/scenario-b-standing.toml",
        Run("", &["A + B + C"]),
    ),
    (
        "grideye coverage scenes/bedroom.toml",
        Run("", &["floor: ", "contrast of a person standing"]),
    ),
    (
        "grideye coverage scenes/l-shaped-flat.toml --candidates corners,ceiling --best 2",
        Run("", &["k=2: ", "1 - 1/e"]),
    ),
    // crates/grideye/DATASET.md
    (
        "grideye dataset scenes/experiment-1.toml --frames 200 --vary agent.person.position=floor --vary room.ambient_c=18..26 --out people",
        Run("", &["200 of 200 frames in people; 1 parts made"]),
    ),
    (
        "grideye dataset scenes/experiment-1.toml --frames 5000 --out frames --shard 2/4",
        Run("", &["shard 2 of 4: 1000 of 5000 frames in frames"]),
    ),
    // crates/grideye-homeassistant/README.md
    (
        "grideye collect --mqtt mqtt://homeassistant.local",
        By(
            "tests/tests/home_assistant/values.rs",
            "a_sensor_is_discovered_with_its_values_and_its_picture",
        ),
    ),
    (
        "grideye collect --mqtt mqtt://grideye@homeassistant.local --mqtt-password-file mqtt-password",
        By(
            "tests/tests/home_assistant/trust.rs",
            "a_refused_password_is_told_with_what_to_do_and_stands_nowhere",
        ),
    ),
    (
        "grideye mqtt forget pi-1 i2c-1:0x69 --mqtt mqtt://homeassistant.local",
        By(
            "tests/tests/home_assistant/removed.rs",
            "a_sensor_that_is_removed_leaves_nothing_behind",
        ),
    ),
    // tests/examples/driver-ci/README.md
    (
        "cp -r tests/examples/driver-ci /tmp/driver && ln -s \"$PWD\" /tmp/driver/grideye-hil",
        By(DRIVER_CI, DRIVER_CI_PYTHON),
    ),
    (
        "cd /tmp/driver && python3 -m venv venv && . venv/bin/activate && pip install -r python/requirements.txt",
        By(DRIVER_CI, DRIVER_CI_PYTHON),
    ),
    // the helps
    ("grideye completions bash", Run("", &["_grideye()"])),
    ("grideye man man1", Run("", &["man pages to man1"])),
    (
        "grideye coverage scenes/bedroom.toml --candidates all --best 2 --out coverage.svg --write best.toml",
        Run("", &["k=1: ", "k=2: ", "wrote the poses to best.toml"]),
    ),
    (
        "grideye simulate scenes/experiment-3.toml --out walk.gif --view room.svg",
        Run("", &[]),
    ),
    (
        "grideye distinguish scenes/scenario-b-before.toml scenes/scenario-b-after.toml",
        Run("", &["A + B + C"]),
    ),
    (
        "grideye demo --once --out out",
        By(
            PIPELINE,
            "the_demonstration_ends_with_delivery_scores_and_report",
        ),
    ),
    (
        "grideye emulate --scene scenes/experiment-1.toml -- i2cdetect -y 1",
        Run("", &["60: -- -- -- -- -- -- -- -- -- 69"]),
    ),
    (
        "grideye characterize empty-room.csv --profile my-sensor.toml",
        Run(
            "printf '[room]\\nsize_mm = [4000, 6000, 2700]\\nambient_c = 20\\n[[sensor]]\\nname = \"ceiling\"\\npreset = \"grid-eye\"\\nsampling_hz = 10\\nposition_mm = [2000, 3000, 2700]\\nelevation_deg = 90\\nazimuth_deg = 0\\n' > room.toml; grideye simulate room.toml --frames 600 --out empty-room.csv",
            &["the pattern is its whole background"],
        ),
    ),
    (
        "grideye calibrate --scene scenes/calibration.toml --recording walk.csv --out scenes/calibrated.toml",
        Run(
            "grideye simulate scenes/experiment-3.toml --out walk.csv",
            &["sensor.ceiling.elevation_deg", "agent.person.temperature_c"],
        ),
    ),
    (
        "grideye emulate --recording walk.csv --socket /tmp/amg.sock",
        Serves(WALK, &["/tmp/amg.sock"]),
    ),
    (
        "grideye enroll pi-1",
        Run("", &[",device=pi-1,token=grideye-"]),
    ),
    (
        "grideye token make ana --scope read",
        Run("", &["grideye-"]),
    ),
    ("grideye token list", Run("", &["no token yet"])),
    (
        "grideye token revoke pi-1",
        Run("grideye enroll pi-1", &["revoked "]),
    ),
    (
        "grideye collect --store frames.sqlite",
        Serves("", &["http://127.0.0.1:"]),
    ),
    (
        "grideye collect --store postgres://grideye@db.local/frames",
        By(
            "tests/tests/several_collectors.rs",
            "agents_that_move_between_three_collectors_lose_nothing_when_one_is_killed",
        ),
    ),
    (
        "grideye backup --store frames.sqlite monday.sqlite",
        By(
            "tests/tests/careless_store.rs",
            "a_backup_has_every_frame_that_was_acknowledged_before_it_and_is_restored_by_its_name",
        ),
    ),
    (
        "pg_dump --format=custom --schema=grideye --file=frames.dump postgres://grideye@db.local/frames",
        By(
            "tests/tests/several_collectors.rs",
            "a_database_that_is_dumped_and_restored_is_the_same_store",
        ),
    ),
    (
        "pg_restore --no-owner --dbname=postgres://grideye@db.local/restored frames.dump",
        By(
            "tests/tests/several_collectors.rs",
            "a_database_that_is_dumped_and_restored_is_the_same_store",
        ),
    ),
    (
        "grideye migrate frames.sqlite postgres://grideye@db.local/frames",
        By(
            "tests/tests/several_collectors.rs",
            "a_migration_that_is_killed_goes_on_where_it_was_and_ends_with_the_same_books_and_frames",
        ),
    ),
    (
        "grideye record empty-room --seconds 60 --out empty-room.csv",
        By(
            PIPELINE,
            "what_arrives_is_recorded_under_a_name_and_fetched",
        ),
    ),
    (
        "grideye compare --scene scenes/experiment-1.toml --recording out/recording.csv --report report.html",
        Run(
            "mkdir out; grideye simulate scenes/experiment-1.toml --seed 2 --out out/recording.csv",
            &["agrees"],
        ),
    ),
    (
        "grideye convert recordings/linaige/Session2_2021-07-01_RoomB_v2.csv session2.parquet",
        Run("", &[]),
    ),
    (
        "grideye convert frames.txt frames.csv --thermistor 25",
        Run("seq -s , 0 63 > frames.txt", &[]),
    ),
    (
        "grideye audit --json",
        By(
            PIPELINE,
            "the_agent_delivers_from_a_device_file_to_a_collector",
        ),
    ),
];

/// The documents with commands, from the repository's root.
fn documents() -> Vec<PathBuf> {
    let folders = [
        "",
        "firmware-config",
        "scenes",
        "scenes/profiles",
        "recordings",
        "tests/examples/driver-ci",
        "tests/hardware",
    ];
    let mut documents: Vec<PathBuf> = folders
        .iter()
        .map(|folder| root().join(folder).join("README.md"))
        .collect();
    for crate_folder in std::fs::read_dir(root().join("crates")).unwrap() {
        documents.push(crate_folder.unwrap().path().join("README.md"));
    }
    documents.push(root().join("crates/grideye/DATASET.md"));
    documents.retain(|document| document.exists());
    documents
}

/// The commands of a document: lines of a `sh` block, lines behind a `$`, and indented lines that call one of the
/// programs. What stands two blanks behind a command is said about it.
fn commands_of(text: &str) -> Vec<String> {
    let mut commands = Vec::new();
    let mut fence: Option<&str> = None;
    for line in text.lines() {
        if let Some(language) = line.trim_start().strip_prefix("```") {
            fence = if fence.is_some() {
                None
            } else {
                Some(language)
            };
            continue;
        }
        let command = match fence {
            Some("sh") => Some(line),
            Some(_) => line.strip_prefix("$ "),
            None => line.strip_prefix("    ").filter(|rest| is_call(rest)),
        };
        let command = command.and_then(|command| command.trim().split("  ").next());
        commands.extend(
            command
                .filter(|command| !command.is_empty())
                .map(str::to_owned),
        );
    }
    commands
}

fn is_call(line: &str) -> bool {
    let programs = [
        "grideye ",
        "grideye-agent ",
        "echo 'CODE'",
        "sudo ",
        "cargo ",
        "i2c",
        "python3 ",
    ];
    programs.iter().any(|program| line.starts_with(program))
}

/// The examples in the helps of `grideye`, from their source: what is printed is wrapped.
fn commands_of_the_helps() -> Vec<String> {
    let mut commands = Vec::new();
    let mut folders = vec![root().join("crates/grideye/src")];
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
                continue;
            }
            let text = std::fs::read_to_string(&path).unwrap();
            let prefix = match path.extension().and_then(|extension| extension.to_str()) {
                Some("txt") => "  grideye ",
                _ => "/// Example: grideye ",
            };
            let examples = text.lines().filter_map(|line| line.strip_prefix(prefix));
            commands.extend(examples.map(|rest| format!("grideye {rest}")));
        }
    }
    assert!(commands.len() >= 9, "{commands:?}");
    commands
}

fn words(ended: &Ended) -> String {
    format!("{}{}", ended.stdout, ended.stderr)
}

#[test]
fn every_documented_command_is_known_here_and_none_here_is_left_over() {
    let mut documented = BTreeSet::new();
    let mut unknown = Vec::new();
    for document in documents() {
        let text = std::fs::read_to_string(&document).unwrap();
        for command in commands_of(&text) {
            if !COMMANDS.iter().any(|(known, _)| *known == command) {
                unknown.push(format!("{}: {command}", document.display()));
            }
            documented.insert(command);
        }
    }
    for command in commands_of_the_helps() {
        if !COMMANDS.iter().any(|(known, _)| *known == command) {
            unknown.push(format!("help: {command}"));
        }
        documented.insert(command);
    }
    assert!(
        unknown.is_empty(),
        "nothing keeps these examples:\n{}",
        unknown.join("\n")
    );
    for (command, kept) in COMMANDS {
        assert!(
            documented.contains(*command),
            "no document has this example: {command}"
        );
        match kept {
            By(file, function) => {
                let text = std::fs::read_to_string(root().join(file)).unwrap();
                assert!(
                    text.contains(&format!("fn {function}()")),
                    "{file} has no test {function}"
                );
            }
            Not(why) => println!("not run: {command} ({why})"),
            Run(..) | Emulated(..) | Serves(..) => {}
        }
    }
}

/// Whether it needs what the machine has not; names it.
fn lacks_what_it_needs(command: &str) -> bool {
    let i2c_tools = ["i2ctransfer", "i2cdetect", "i2cget"];
    i2c_tools.iter().any(|tool| command.contains(tool))
        && is_part_left_out("GRIDEYE_WITHOUT_I2C_TOOLS", command)
}

/// A folder in which a command finds what it finds in the repository.
fn like_the_repository() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let root = root().canonicalize().unwrap();
    // A copy: one command writes a new scene beside the others.
    let copied = Command::new("cp")
        .arg("-r")
        .args([root.join("scenes").as_path(), folder.path()])
        .status()
        .unwrap();
    assert!(copied.success(), "{copied}");
    std::os::unix::fs::symlink(root.join("recordings"), folder.path().join("recordings")).unwrap();
    folder
}

/// Runs a line with the release programs in reach; an example of a crate is built from the repository.
fn shell(line: &str, at: &Path) -> Ended {
    run(&mut sh(line, at))
}

fn sh(line: &str, at: &Path) -> Command {
    let path = std::env::var("PATH").unwrap();
    let manifest = root().canonicalize().unwrap().join("Cargo.toml");
    let cargo = format!(
        "{} run --quiet --locked --manifest-path {} -p",
        env!("CARGO"),
        manifest.display()
    );
    let line = line.replace("cargo run -p", &cargo);
    let mut command = Command::new("sh");
    command
        .args(["-c", &line])
        .current_dir(at)
        .env("PATH", format!("{}:{path}", folder().display()));
    command
}

#[test]
fn the_documented_commands_do_what_their_documents_say() {
    std::thread::scope(|scope| {
        for (command, kept) in COMMANDS {
            scope.spawn(move || holds(command, kept));
        }
    });
}

fn holds(command: &str, kept: &Kept) {
    let at = like_the_repository();
    let (before, line, expected) = match kept {
        Run(before, expected) => (*before, command.to_owned(), *expected),
        Emulated(expected) => (
            "",
            format!("grideye emulate --quiet --scene scenes/experiment-1.toml -- {command}"),
            *expected,
        ),
        Serves(before, expected) => (*before, with_free_ports(command, at.path()), *expected),
        By(..) | Not(_) => return,
    };
    if lacks_what_it_needs(command) {
        return;
    }
    let prepared = shell(before, at.path());
    assert_eq!(prepared.code, 0, "{before}: {prepared:?}");
    let at_its_socket = |word: &&str| {
        let socket = at.path().join("amg.sock");
        word.replace("/tmp/amg.sock", &socket.display().to_string())
    };
    let expected: Vec<String> = expected.iter().map(at_its_socket).collect();
    // What runs in real time on a host that stalls is asked again.
    let ended = match kept {
        Serves(..) => served(&line, &expected, at.path()),
        _ => (0..3)
            .map(|_| shell(&line, at.path()))
            .find(|ended| !words(ended).contains("too busy to read in time"))
            .unwrap_or_else(|| panic!("{line}: this computer is too busy")),
    };
    assert_eq!(ended.code, 0, "{line}: {ended:?}");
    for word in expected {
        assert!(
            words(&ended).contains(&word),
            "{line} does not print {word:?}: {ended:?}"
        );
    }
}

/// A server's command, with this machine's addresses and a socket of its own.
fn with_free_ports(command: &str, at: &Path) -> String {
    command
        .replace("192.168.1.20:8833", "127.0.0.1:0")
        .replace("0.0.0.0:8833", "0.0.0.0:0")
        .replace("collect --store", "collect --listen 127.0.0.1:0 --store")
        .replace("/tmp/amg.sock", &at.join("amg.sock").display().to_string())
}

/// Runs a server until it has printed these words, however long the machine takes, and ends it by Ctrl-C.
fn served(command: &str, expected: &[String], at: &Path) -> Ended {
    let files = ["served.out", "served.err"].map(|name| at.join(name));
    let [out, err] = files
        .each_ref()
        .map(|file| std::fs::File::create(file).unwrap());
    let mut server = sh(&format!("exec {command}"), at)
        .stdin(std::process::Stdio::null())
        .stdout(out)
        .stderr(err)
        .spawn()
        .unwrap();
    let said = || {
        files
            .each_ref()
            .map(|file| std::fs::read_to_string(file).unwrap())
    };
    let has_said = || expected.iter().all(|word| said().concat().contains(word));
    until(&format!("{expected:?} of {command}"), || {
        (has_said() || server.try_wait().unwrap().is_some()).then_some(())
    });
    // One that has ended by itself is judged by its code.
    let _ = Command::new("kill")
        .args(["-INT", &server.id().to_string()])
        .status();
    let status = until(&format!("the end of {command}"), || {
        server.try_wait().unwrap()
    });
    let [stdout, stderr] = said();
    Ended {
        code: status.code().unwrap_or(-1),
        stdout,
        stderr,
    }
}

/// What a document prints of a command's output is what the command prints.
#[test]
fn the_documented_outputs_are_those_of_the_table() {
    let readme = std::fs::read_to_string(root().join("README.md")).unwrap();
    for (command, kept) in COMMANDS {
        let shown = readme.contains(&format!("$ {command}\n"));
        if let (true, Run(_, expected)) = (shown, kept) {
            for word in *expected {
                assert!(
                    readme.contains(word),
                    "README.md does not show {word:?} of {command}"
                );
            }
        }
    }
}

/// Behind each promise of the README stands what is there.
#[test]
fn every_test_that_the_readme_promises_is_there() {
    let readme = std::fs::read_to_string(root().join("README.md")).unwrap();
    let (_, behind) = readme.split_once("| promise | test |\n").unwrap();
    let rows: Vec<&str> = behind
        .lines()
        .skip(1)
        .take_while(|line| line.starts_with('|'))
        .collect();
    assert!(rows.len() > 20, "{rows:?}");
    for row in rows {
        let test = row.trim_end_matches('|').rsplit('|').next().unwrap();
        let paths: Vec<&str> = test.split('`').skip(1).step_by(2).collect();
        assert!(!paths.is_empty(), "no test behind {row}");
        for path in paths {
            assert!(root().join(path).exists(), "{path} is not there: {row}");
        }
    }
}

/// Options in running text: `grideye emulate --socket …` must exist.
#[test]
fn every_option_that_a_document_names_exists() {
    for document in documents() {
        let text = std::fs::read_to_string(&document).unwrap();
        for piece in text.split('`').filter(|piece| !piece.contains('\n')) {
            let mut parts = piece.split_whitespace().peekable();
            let (Some("grideye"), Some(subcommand)) = (parts.next(), parts.next()) else {
                continue;
            };
            if !subcommand.chars().all(|letter| letter.is_ascii_lowercase()) {
                continue;
            }
            // A command of a command, as in `grideye token make`; what is an argument instead changes nothing.
            let deeper = parts.next_if(|part| part.bytes().all(|byte| byte.is_ascii_lowercase()));
            // `--help` is one screen: what it leaves out stands in `help COMMAND`.
            let help_of = |words: &[&str]| {
                let mut command = Command::new(folder().join("grideye"));
                run(command.arg("help").args(words))
            };
            let mut help = help_of(&[&[subcommand], deeper.as_slice()].concat());
            if help.code != 0 {
                help = help_of(&[subcommand]);
            }
            assert_eq!(help.code, 0, "{}: {piece}: {help:?}", document.display());
            for option in parts
                .take_while(|part| *part != "--")
                .filter(|part| part.starts_with("--"))
            {
                let option = option.trim_end_matches([',', '.']);
                assert!(
                    help.stdout.contains(option),
                    "{}: {piece}: there is no {option}",
                    document.display()
                );
            }
        }
    }
}

/// A crate's example in Rust is compiled where it stands in the crate's own documentation: as the README itself, or
/// line by line the same.
#[test]
fn every_example_in_rust_is_one_that_the_compiler_sees() {
    for crate_folder in std::fs::read_dir(root().join("crates")).unwrap() {
        let folder = crate_folder.unwrap().path();
        let (Ok(readme), Ok(library)) = (
            std::fs::read_to_string(folder.join("README.md")),
            std::fs::read_to_string(folder.join("src/lib.rs")),
        ) else {
            continue;
        };
        if library.contains("include_str!(\"../README.md\")") {
            continue;
        }
        let mut is_rust = false;
        for line in readme.lines() {
            if let Some(language) = line.strip_prefix("```") {
                is_rust = !is_rust && language.starts_with("rust");
                continue;
            }
            let compiled = format!("//! {line}");
            let is_compiled = library.lines().any(|found| found == compiled.trim_end());
            assert!(
                !is_rust || is_compiled,
                "{}: no compiler sees this line: {line}",
                folder.display()
            );
        }
    }
}
