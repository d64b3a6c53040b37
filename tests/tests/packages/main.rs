//! The Debian packages: what is in them, and what happens to a small Debian in which they are installed, upgraded,
//! removed and purged; and the programs for other processors, run by QEMU on the processor that they are for.

#![expect(clippy::unwrap_used, reason = "what fails in a helper fails the test")]

mod release;

use grideye_tests::programs::{
    Ended, RunningCollector, folder, grideye, is_left_out, is_part_left_out, root, run,
};
use std::io::{BufRead as _, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::{Mutex, PoisonError};

/// Without debootstrap, or without root.
const PACKAGES: &str = "GRIDEYE_WITHOUT_PACKAGES";
/// Without the compilers for 32-bit ARM, or without QEMU.
const ARM: &str = "GRIDEYE_WITHOUT_PACKAGES_ARM";
const CROSS: &str = "GRIDEYE_WITHOUT_CROSS";
const SPOOL: &str = "/var/lib/grideye-agent";

/// Runs `firmware-config/package` and gives the names that it prints. One at a time: they share what they unpack.
fn packages(out: &Path, arguments: &[&str]) -> Vec<PathBuf> {
    static PACKING: Mutex<()> = Mutex::new(());
    let _only_one = PACKING.lock().unwrap_or_else(PoisonError::into_inner);
    let mut command = Command::new(root().join("firmware-config/package"));
    command.arg("--out").arg(out);
    // They are installed once.
    command.env("DPKG_DEB_COMPRESSOR_LEVEL", "1");
    command
        .arg("--programs")
        .arg(folder().canonicalize().unwrap());
    // These are built to be run a few times: what optimizing them costs would be for nothing.
    if arguments
        .iter()
        .any(|argument| ["armhf", "armv6"].contains(argument))
    {
        command.env("GRIDEYE_CROSS_OPT_LEVEL", "0");
    }
    let ended = run(command.args(arguments));
    assert_eq!(ended.code, 0, "{ended:?}");
    ended.stdout.lines().map(PathBuf::from).collect()
}

fn native() -> String {
    let ended = run(Command::new("dpkg").arg("--print-architecture"));
    ended.stdout.trim().to_owned()
}

fn text_of(command: &mut Command) -> String {
    let ended = run(command);
    assert_eq!(ended.code, 0, "{ended:?}");
    ended.stdout
}

fn listed(package: &Path) -> String {
    text_of(Command::new("dpkg-deb").arg("--contents").arg(package))
}

fn field(package: &Path, name: &str) -> String {
    let mut command = Command::new("dpkg-deb");
    text_of(command.arg("--field").arg(package).arg(name))
        .trim()
        .to_owned()
}

fn unpacked(package: &Path, into: &Path) -> PathBuf {
    let ended = run(Command::new("dpkg-deb").arg("-R").arg(package).arg(into));
    assert_eq!(ended.code, 0, "{ended:?}");
    into.to_owned()
}

/// A small Debian of its own.
struct Room(tempfile::TempDir);

impl Room {
    fn new() -> Self {
        let made = text_of(&mut Command::new(root().join("tests/packages/prepare")));
        let made = Path::new(made.trim());
        let room = Self(tempfile::tempdir_in(made.parent().unwrap()).unwrap());
        let mut copy = Command::new("cp");
        copy.arg("-a").arg(made.join("."));
        let ended = run(copy.arg(room.0.path()));
        assert_eq!(ended.code, 0, "{ended:?}");
        room
    }

    fn path(&self, path: &str) -> PathBuf {
        self.0.path().join(path.trim_start_matches('/'))
    }

    fn has(&self, path: &str) -> bool {
        self.path(path).symlink_metadata().is_ok()
    }

    fn put(&self, path: &str, text: &str) {
        std::fs::write(self.path(path), text).unwrap();
    }

    fn read(&self, path: &str) -> String {
        std::fs::read_to_string(self.path(path)).unwrap()
    }

    /// Runs a line in it.
    fn ended(&self, line: &str) -> Ended {
        let mut command = Command::new("chroot");
        command.arg(self.0.path()).args(["sh", "-c", line]);
        run(command.env_clear().envs(ROOMS_ENVIRONMENT))
    }

    /// The same, which must go well.
    fn does(&self, line: &str) -> Ended {
        let ended = self.ended(line);
        assert_eq!(ended.code, 0, "{line}: {ended:?}");
        ended
    }

    fn said(&self, line: &str) -> String {
        self.does(line).stdout.trim().to_owned()
    }

    fn install(&self, packages: &[PathBuf]) -> Ended {
        let mut names = String::new();
        for package in packages {
            let name = package.file_name().unwrap().to_str().unwrap();
            std::fs::copy(package, self.path("/tmp").join(name)).unwrap();
            names += &format!(" /tmp/{name}");
        }
        // As unattended upgrades are told, and as the question is answered by default: what was edited stays.
        self.does(&format!("dpkg --force-confold -i{names}"))
    }

    /// What the unit starts, with more arguments, on an emulated sensor.
    fn start_the_unit(&self, more: &str) -> Ended {
        let unit = self.read("/usr/lib/systemd/system/grideye-agent.service");
        let command = unit
            .lines()
            .find_map(|line| line.strip_prefix("ExecStart="));
        let room = self.0.path().display();
        let line = format!(
            "exec env -i PATH=/usr/sbin:/usr/bin STATE_DIRECTORY={SPOOL} chroot {room} {} {more}",
            command.unwrap()
        );
        run(grideye()
            .args(["emulate", "--quiet", "--constant", "24"])
            .args(["--", "sh", "-c", &line]))
    }

    /// What waits in the spool, each file with its sum.
    fn spool(&self) -> String {
        self.said(&format!(
            "find {SPOOL} -name 'segment-*' -exec sha256sum {{}} + | sort"
        ))
    }
}

const ROOMS_ENVIRONMENT: [(&str, &str); 3] = [
    ("PATH", "/usr/sbin:/usr/bin:/sbin:/bin"),
    ("LC_ALL", "C"),
    ("DEBIAN_FRONTEND", "noninteractive"),
];

/// What `dpkg -i` leaves of the agent: a program, a unit that starts it, and a user of its own that owns the spool.
fn check_what_is_installed(room: &Room) {
    assert_eq!(room.said("dpkg --audit"), "");
    assert!(
        room.said("grideye-agent --version")
            .starts_with("grideye-agent ")
    );
    assert!(room.said("grideye --version").starts_with("grideye "));
    let groups = room.said("id -nG grideye-agent");
    assert_eq!(groups, "grideye-agent i2c");
    let owner = "stat -c '%U %G %a' ";
    let kept = room.said(&format!("{owner} {SPOOL}"));
    assert_eq!(kept, "grideye-agent grideye-agent 700");
    let kept = room.said(&format!("{owner} /var/lib/grideye-collector"));
    assert_eq!(kept, "grideye-collector grideye-collector 700");
    if is_part_left_out(
        "GRIDEYE_WITHOUT_SYSTEMD",
        "systemd's reading of the installed units",
    ) {
        return;
    }
    let at = tempfile::tempdir().unwrap();
    for unit in ["grideye-agent.service", "grideye-collector.service"] {
        let text = room.read(&format!("/usr/lib/systemd/system/{unit}"));
        let program = format!("ExecStart={}/usr/bin/", room.0.path().display());
        assert!(text.contains("ExecStart=/usr/bin/"), "{text}");
        let path = at.path().join(unit);
        std::fs::write(&path, text.replace("ExecStart=/usr/bin/", &program)).unwrap();
        let read = run(Command::new("systemd-analyze")
            .args(["verify", "--man=no"])
            .arg(path));
        let about_it: Vec<&str> = read
            .stderr
            .lines()
            .filter(|line| line.contains(unit))
            .collect();
        assert_eq!((read.code, about_it), (0, vec![]), "{unit}: {read:?}");
    }
}

/// The same package of a version that ships another `agent.toml`.
fn with_another_default(package: &Path, out: &Path) -> PathBuf {
    let raw = out.join("raw");
    let mut extract = Command::new("dpkg-deb");
    text_of(extract.arg("--raw-extract").arg(package).arg(&raw));
    let shipped = raw.join("etc/grideye/agent.toml");
    let text = std::fs::read_to_string(&shipped).unwrap();
    std::fs::write(&shipped, text + "# Another default.\n").unwrap();
    let built = out.join("another-default.deb");
    text_of(
        Command::new("dpkg-deb")
            .arg("--build")
            .arg(&raw)
            .arg(&built),
    );
    built
}

/// The agent as the unit starts it: to a collector that answers, and then to none, so that the frames stay in the spool.
fn check_what_is_started(room: &Room) {
    let at = tempfile::tempdir().unwrap();
    let collector = RunningCollector::start(at.path());
    let edited = |collector: &str| {
        let shipped = room.read("/etc/grideye/agent.toml");
        let begin = shipped.find("# The name under").unwrap();
        format!(
            "device = \"edited\"\ncollector = \"{collector}\"\n{}",
            &shipped[begin..]
        )
    };
    let answers = edited(collector.url());
    let nobody = edited("http://127.0.0.1:9").replace("mode = \"outage\"", "mode = \"always\"");
    room.put("/etc/grideye/agent.toml", &answers);
    let ended = room.start_the_unit("--frames 20");
    // 3 where this machine was too busy to read one of them in time.
    assert!([0, 3].contains(&ended.code), "{ended:?}");
    let audit = collector.json("/v1/audit");
    let stream = &audit["streams"][0];
    assert_eq!(stream["device"], "edited", "{audit}");
    let stored = stream["stored"].as_u64().unwrap();
    assert!(stored >= 10, "{audit}: {ended:?}");
    assert_eq!(room.spool(), "", "all was delivered");
    room.put("/etc/grideye/agent.toml", &nobody);
    let ended = room.start_the_unit("--frames 20");
    assert!(!room.spool().is_empty(), "{ended:?}");
}

#[test]
fn the_packages_are_installed_started_upgraded_removed_and_purged() {
    if is_left_out(PACKAGES, "the Debian packages in a Debian of their own") {
        return;
    }
    let out = tempfile::tempdir().unwrap();
    let first = packages(out.path(), &[&native()]);
    let second = ["--version", "9.9", "--only", "grideye-agent"];
    let second = packages(
        out.path(),
        &[&[native().as_str()], second.as_slice()].concat(),
    );
    let room = Room::new();
    let installed = room.install(&first);
    assert!(
        installed.stdout.contains("next: grideye-agent check"),
        "{installed:?}"
    );
    check_what_is_installed(&room);
    check_what_is_started(&room);
    room.put("/etc/grideye/collector.toml", "token = \"secret\"\n");
    // As `systemctl enable` leaves it.
    let wanted = "/etc/systemd/system/multi-user.target.wants/grideye-agent.service";
    room.does(&format!(
        "ln -s /usr/lib/systemd/system/grideye-agent.service {wanted}"
    ));
    assert!(room.has(wanted));
    let (configuration, spool) = (room.read("/etc/grideye/agent.toml"), room.spool());
    assert!(configuration.contains("edited") && !spool.is_empty());
    let is_kept = || {
        assert_eq!(room.read("/etc/grideye/agent.toml"), configuration);
        assert_eq!(room.spool(), spool);
        assert!(room.has("/etc/grideye/collector.toml"));
    };

    assert_eq!(second.len(), 1, "{second:?}");
    room.install(&[with_another_default(&second[0], out.path())]);
    let offered = room.read("/etc/grideye/agent.toml.dpkg-dist");
    assert!(offered.ends_with("# Another default.\n"), "{offered}");
    assert_eq!(
        room.said("dpkg-query -W -f '${Version}' grideye-agent"),
        "9.9"
    );
    assert!(room.has(wanted), "what was enabled stays so");
    is_kept();

    room.does("dpkg --remove grideye grideye-agent");
    assert!(!room.has("/usr/bin/grideye-agent") && !room.has("/usr/bin/grideye"));
    assert!(!room.has("/usr/lib/systemd/system/grideye-agent.service"));
    is_kept();

    room.put("/var/lib/grideye-collector/frames.sqlite", "recordings");
    std::fs::create_dir(room.path("/var/lib/grideye-collector/access")).unwrap();
    room.put("/var/lib/grideye-collector/access/tokens", "secret");
    let purged = room.does("dpkg --purge grideye grideye-agent");
    for gone in ["/etc/grideye", "/var/lib/grideye-collector/access", wanted] {
        assert!(!room.has(gone), "{gone} is left: {purged:?}");
    }
    assert_eq!(room.spool(), spool, "frames that no collector has");
    assert!(room.has("/var/lib/grideye-collector/frames.sqlite"));
    for holds in [SPOOL, "/var/lib/grideye-collector"] {
        let said = format!("{holds} holds ");
        assert!(purged.stderr.contains(&said), "{purged:?}");
    }

    room.does(&format!("rm -r {SPOOL}/* /var/lib/grideye-collector/*"));
    room.install(&first);
    room.does("dpkg --purge grideye grideye-agent");
    let left = room
        .said("find / -xdev -path /proc -prune -o -path /tmp -prune -o -name '*grideye*' -print");
    assert_eq!(left, "", "nothing that waits, nothing left");
}

#[test]
fn the_packages_hold_what_a_debian_system_looks_for() {
    if is_left_out(PACKAGES, "what is in the Debian packages") {
        return;
    }
    let out = tempfile::tempdir().unwrap();
    let made = packages(out.path(), &[&native()]);
    let [agent, grideye] = made.as_slice() else {
        unreachable!("{made:?}")
    };
    let (of_agent, of_grideye) = (listed(agent), listed(grideye));
    for path in [
        "usr/bin/grideye-agent",
        "usr/lib/systemd/system/grideye-agent.service",
        "usr/lib/sysusers.d/grideye-agent.conf",
        "usr/lib/udev/rules.d/99-grideye-i2c.rules",
        "etc/grideye/agent.toml",
        "usr/share/man/man1/grideye-agent-join.1.gz",
        "usr/share/bash-completion/completions/grideye-agent",
        "usr/share/zsh/vendor-completions/_grideye-agent",
        "usr/share/fish/vendor_completions.d/grideye-agent.fish",
        "usr/share/doc/grideye-agent/copyright",
        "usr/share/doc/grideye-agent/changelog.gz",
    ] {
        assert!(
            of_agent.contains(&format!(" ./{path}\n")),
            "{path}: {of_agent}"
        );
    }
    for path in [
        "usr/bin/grideye",
        "usr/lib/systemd/system/grideye-collector.service",
        "usr/share/man/man1/grideye-token-make.1.gz",
        "usr/share/doc/grideye/examples/experiment-1.toml",
        "usr/share/doc/grideye/sql/days.sql",
    ] {
        assert!(
            of_grideye.contains(&format!(" ./{path}\n")),
            "{path}: {of_grideye}"
        );
    }
    assert!(!of_grideye.contains("man1/grideye-agent"), "{of_grideye}");
    for line in of_agent.lines().chain(of_grideye.lines()) {
        assert!(line.contains(" root/root "), "{line}");
        assert!(
            !line[..10].contains("w-") || line.as_bytes()[5] != b'w',
            "{line}"
        );
    }
    let again = packages(
        &out.path().join("again"),
        &[&native(), "--only", "grideye-agent"],
    );
    let bytes = |path: &Path| std::fs::read(path).unwrap();
    assert!(
        bytes(agent) == bytes(&again[0]),
        "the same sources, other bytes"
    );
    check_lint(&made);
    check_pages_and_completions(&unpacked(agent, &out.path().join("unpacked")));
}

/// Debian's own judge. What it warns of is printed.
fn check_lint(made: &[PathBuf]) {
    let lint = run(Command::new("lintian").arg("--no-cfg").args(made));
    println!("{}", lint.stdout);
    let errors: Vec<&str> = lint
        .stdout
        .lines()
        .filter(|line| line.starts_with("E:"))
        .collect();
    assert!(errors.is_empty(), "{errors:#?}");
}

fn check_pages_and_completions(unpacked: &Path) {
    let page = unpacked.join("usr/share/man/man1/grideye-agent-join.1.gz");
    let shown = run(Command::new("man")
        .args(["--warnings", "-l"])
        .arg(&page)
        .env("LC_ALL", "C.UTF-8")
        .env("MANROFFOPT", "-rHY=0"));
    assert_eq!((shown.code, shown.stderr.as_str()), (0, ""), "{shown:?}");
    for words in [
        "NAME",
        "--client-cert <FILE>",
        "EXAMPLE",
        "echo 'CODE' | sudo grideye-agent join -",
    ] {
        assert!(shown.stdout.contains(words), "{words}: {}", shown.stdout);
    }
    let script = unpacked.join("usr/share/bash-completion/completions/grideye-agent");
    let line = format!(
        "source {}; COMP_WORDS=(grideye-agent che); COMP_CWORD=1; \
         completes=$(complete -p grideye-agent | sed 's/.*-F \\([^ ]*\\).*/\\1/'); \
         $completes grideye-agent che grideye-agent; echo \"${{COMPREPLY[@]}}\"",
        script.display()
    );
    let completed = run(Command::new("bash").args(["-c", &line]));
    assert_eq!(completed.stdout.trim(), "check", "{completed:?}");
}

/// Where `tests/guests/cross` keeps its compilers and their libraries.
fn tools(target: &str) -> PathBuf {
    let guests = std::env::var_os("GRIDEYE_GUESTS").map(PathBuf::from);
    let guests = guests.unwrap_or_else(|| root().join("target/guests"));
    guests.join("cross").join(target)
}

/// A program of a package, on the processor that it is for: it runs, says what is wrong with a bus that is not there,
/// and joins a collector, whose name it has to look up, over TLS.
fn check_on_its_processor(program: &Path, qemu: &[&str]) {
    let emulated = |arguments: &[&str]| {
        run(Command::new(qemu[0])
            .args(&qemu[1..])
            .arg(program)
            .args(arguments))
    };
    let version = emulated(&["--version"]);
    assert!(version.stdout.starts_with("grideye-agent "), "{version:?}");
    let checked = emulated(&["check", "--bus", "/dev/i2c-77"]);
    assert_eq!(checked.code, 1, "{checked:?}");
    assert!(
        checked.stdout.contains("no such bus\nhint: "),
        "{checked:?}"
    );

    let site = Site::new();
    let line = site.grideye(&["enroll", "pi-zero", "--url", &site.url_by_name]);
    let joined_file = site.at.path().join("collector.toml");
    let joined = emulated(&["join", &line, "--out", joined_file.to_str().unwrap()]);
    assert_eq!(joined.code, 0, "{joined:?}");
    // A collector that runs already notices its first token within a second; until then it takes anybody's.
    assert!(
        joined.stdout.contains(" as pi-zero: ") && joined.stdout.contains("frames are taken"),
        "{joined:?}"
    );
}

/// A collector that asks for tokens, with a certificate for `localhost`.
struct Site {
    at: tempfile::TempDir,
    collector: Child,
    url_by_name: String,
}

impl Site {
    fn new() -> Self {
        let at = tempfile::tempdir().unwrap();
        let mut collector = grideye();
        collector
            .args(["collect", "--listen", "127.0.0.1:0", "--tls"])
            .args(["--host-name", "localhost", "--store"])
            .arg(at.path().join("frames.sqlite"))
            .arg("--access")
            .arg(at.path().join("access"))
            .stdout(Stdio::piped())
            .stderr(Stdio::null());
        let mut collector = collector.spawn().unwrap();
        let mut line = String::new();
        let stdout = collector.stdout.take().unwrap();
        BufReader::new(stdout).read_line(&mut line).unwrap();
        let url_by_name = line
            .trim()
            .trim_end_matches('/')
            .replace("127.0.0.1", "localhost");
        assert!(url_by_name.starts_with("https://localhost:"), "{line}");
        Self {
            at,
            collector,
            url_by_name,
        }
    }

    fn grideye(&self, arguments: &[&str]) -> String {
        let access = self.at.path().join("access");
        let ended = run(grideye().args(arguments).arg("--access").arg(access));
        assert_eq!(ended.code, 0, "{ended:?}");
        ended.stdout.trim().to_owned()
    }
}

impl Drop for Site {
    fn drop(&mut self) {
        // It may have ended already.
        let _ = self.collector.kill();
        let _ = self.collector.wait();
    }
}

#[test]
fn the_agent_for_armv6_is_static_and_runs_on_the_processor_of_a_pi_zero() {
    if is_left_out(ARM, "the agent for ARMv6") {
        return;
    }
    let out = tempfile::tempdir().unwrap();
    let made = packages(out.path(), &["armv6"]);
    let [package, program] = made.as_slice() else {
        unreachable!("{made:?}")
    };
    let linked = text_of(Command::new("readelf").arg("-ld").arg(program));
    assert!(
        !linked.contains("NEEDED") && !linked.contains("INTERP"),
        "{linked}"
    );
    assert_eq!(field(package, "Architecture"), "armhf");
    assert_eq!(field(package, "Conflicts"), "grideye-agent");
    assert!(!field(package, "Depends").contains("libc6"));
    // An ARM1176JZF-S; of an instruction that it does not have QEMU makes a SIGILL.
    check_on_its_processor(program, &["qemu-arm-static", "-cpu", "arm1176"]);
}

#[test]
fn the_agent_for_armhf_runs_on_armv7_and_its_package_refuses_an_armv6() {
    if is_left_out(ARM, "the agent for armhf") {
        return;
    }
    let out = tempfile::tempdir().unwrap();
    let made = packages(out.path(), &["armhf"]);
    let unpacked = unpacked(&made[0], &out.path().join("unpacked"));
    assert!(field(&made[0], "Depends").contains("libc6 (>= 2."));
    let libraries = tools("armv7-unknown-linux-gnueabihf").join("usr/arm-linux-gnueabihf");
    let libraries = libraries.to_str().unwrap();
    check_on_its_processor(
        &unpacked.join("usr/bin/grideye-agent"),
        &["qemu-arm-static", "-cpu", "cortex-a7", "-L", libraries],
    );
    for (machine, code) in [("armv6l", 1), ("armv7l", 0), ("aarch64", 0)] {
        let shim = out.path().join("uname");
        std::fs::write(&shim, format!("#!/bin/sh\necho {machine}\n")).unwrap();
        run(Command::new("chmod").arg("+x").arg(&shim));
        let path = format!("{}:/usr/bin:/bin", out.path().display());
        let mut preinst = Command::new(unpacked.join("DEBIAN/preinst"));
        let ended = run(preinst.arg("install").env("PATH", path));
        assert_eq!(ended.code, code, "{machine}: {ended:?}");
        let names_the_other = ended.stderr.contains("install grideye-agent-armv6 instead");
        assert_eq!(names_the_other, code == 1, "{machine}: {ended:?}");
    }
}

#[test]
fn the_agent_for_arm64_is_packed_and_runs() {
    if is_left_out(CROSS, "the agent for arm64") || is_left_out(PACKAGES, "its package") {
        return;
    }
    let out = tempfile::tempdir().unwrap();
    // As tests/run has built it for the guests: to optimize it as a whole takes minutes.
    let built = text_of(Command::new(root().join("tests/guests/cross")).arg("aarch64"));
    let programs = format!("arm64={}", built.lines().last().unwrap());
    let arguments = ["arm64", "--only", "grideye-agent", "--programs", &programs];
    let made = packages(out.path(), &arguments);
    assert_eq!(field(&made[0], "Architecture"), "arm64");
    let unpacked = unpacked(&made[0], &out.path().join("unpacked"));
    let libraries = tools("aarch64-unknown-linux-gnu").join("usr/aarch64-linux-gnu");
    let libraries = libraries.to_str().unwrap();
    check_on_its_processor(
        &unpacked.join("usr/bin/grideye-agent"),
        &["qemu-aarch64-static", "-L", libraries],
    );
}
