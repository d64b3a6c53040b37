//! A USB adapter in whole machines: QEMU guests with Debian's stock kernel and a real `/dev/i2c-N`, and the agent built for a
//! Raspberry Pi. `tests/guests/way-4` and `kernel-driver` run in the guest; the results are checked here.

#![expect(clippy::unwrap_used, reason = "what fails in a helper fails the test")]

use grideye_tests::programs::{Ended, folder, grideye, is_left_out, root, run};
use std::io::{BufRead as _, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::{Mutex, PoisonError};

const GUESTS: &str = "GRIDEYE_WITHOUT_GUESTS";
const CROSS: &str = "GRIDEYE_WITHOUT_CROSS";
const VIDEO_I2C: &str = "GRIDEYE_WITHOUT_VIDEO_I2C";
const SCENE: &str = "scenes/experiment-1.toml";
const PAGE: &str = include_str!("../../crates/grideye/EMULATE.md");

/// A program that prints its address on its first line; killed when dropped.
struct Serving {
    child: Child,
    address: String,
}

impl Serving {
    fn start(command: &mut Command) -> Self {
        let mut child = command
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        let mut line = String::new();
        let mut stdout = BufReader::new(child.stdout.take().unwrap());
        stdout.read_line(&mut line).unwrap();
        let address = line
            .trim()
            .trim_start_matches("http://")
            .trim_end_matches('/');
        assert!(address.contains(':'), "it said {line:?}");
        Self {
            child,
            address: address.to_owned(),
        }
    }

    /// This machine's address, as seen from the guest.
    fn seen_from_the_guest(&self) -> String {
        self.address.replace("127.0.0.1", "10.0.2.2")
    }
}

impl Drop for Serving {
    fn drop(&mut self) {
        // It may have ended.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

fn collector(store: &Path) -> Serving {
    let mut command = grideye();
    command.args([
        "collect",
        "--listen",
        "127.0.0.1:0",
        "--host-name",
        "10.0.2.2",
    ]);
    Serving::start(command.arg("--store").arg(store.join("store.sqlite")))
}

/// The only block of the page in this language with these words.
fn example(language: &str, words: &str) -> &'static str {
    let start = format!("```{language} ");
    let blocks = PAGE.split(start.as_str()).skip(1);
    let mut found = blocks
        .map(|block| {
            block
                .split_once('\n')
                .unwrap()
                .1
                .split_once("```")
                .unwrap()
                .0
        })
        .filter(|commands| commands.contains(words));
    let only = found.next().unwrap();
    assert_eq!(found.next(), None, "two examples with {words:?}");
    only
}

/// A file for the guest's `/bin`.
fn written(folder: &Path, name: &str, text: &str) -> PathBuf {
    let path = folder.join(name);
    std::fs::write(&path, text).unwrap();
    path
}

fn script(name: &str) -> Command {
    Command::new(root().join("tests/guests").join(name))
}

/// Runs a script that prepares a folder and prints it on its last line. One at a time, since they share what they
/// unpack.
fn folder_of(command: &mut Command) -> PathBuf {
    static PREPARING: Mutex<()> = Mutex::new(());
    let _only_one = PREPARING.lock().unwrap_or_else(PoisonError::into_inner);
    let ended = run(command);
    assert_eq!(ended.code, 0, "{}", ended.stderr);
    PathBuf::from(ended.stdout.lines().last().unwrap())
}

/// The guest's output: the lines that begin with `guest: `, without that prefix.
struct Said(Vec<String>);

impl Said {
    fn boot(architecture: &str, test: &str, files: &[PathBuf], collector: Option<String>) -> Self {
        folder_of(script("prepare").arg(architecture));
        let mut boot = script("boot");
        boot.arg(architecture)
            .arg(root().join("tests/guests").join(test));
        boot.args(files).arg(root().join(SCENE));
        boot.env("GUEST_COLLECTOR", collector.unwrap_or_default());
        let Ended {
            code,
            stdout,
            stderr,
        } = run(&mut boot);
        print!("{stdout}");
        assert_eq!(code, 0, "{stderr}");
        let lines = stdout
            .lines()
            .filter_map(|line| line.trim_end().strip_prefix("guest: "));
        Self(lines.map(str::to_owned).collect())
    }

    /// The rest of each line that starts with this word.
    fn all<'a>(&'a self, word: &'a str) -> impl Iterator<Item = &'a str> {
        self.0
            .iter()
            .filter_map(move |line| line.strip_prefix(word)?.strip_prefix(' '))
    }

    fn one<'a>(&'a self, word: &'a str) -> &'a str {
        self.all(word).next().unwrap_or_default()
    }
}

/// Checks `EMULATE.md`'s example, word for word, on a kernel without the modules loaded.
fn check_the_example(said: &Said) {
    assert_eq!(said.one("unloaded,"), "left: 0");
    let example: Vec<&str> = said.all("example").collect();
    assert!(example.contains(&"ended with 0"), "{example:#?}");
    let listed = example
        .iter()
        .filter(|line| line.starts_with("i2c-") && line.contains("i2c-tiny-usb at bus"));
    assert_eq!(listed.count(), 1, "{example:#?}");
    assert!(example.contains(&"left ports in use: 0"), "{example:#?}");
}

/// Checks the AMG8833 on a bus that every tool of i2c-tools sees (AMG88 spec §4-8: address 0x69; registers 0x80 to
/// 0xFF).
fn check_the_tools(said: &Said) {
    assert!(
        said.one("list").contains("i2c-tiny-usb at bus"),
        "{}",
        said.one("list")
    );
    let row = said
        .all("detect")
        .find(|row| row.starts_with("60:"))
        .unwrap_or_default();
    assert_eq!(row, "60: -- -- -- -- -- -- -- -- -- 69 -- -- -- -- -- --");
    let others: Vec<&str> = said
        .all("detect")
        .filter(|row| row.contains(':') && !row.starts_with("60:"))
        .collect();
    assert_eq!(others.len(), 7);
    for row in others {
        let cells = row.split_once(':').unwrap().1;
        assert!(cells.chars().all(|cell| "- ".contains(cell)), "{row}");
    }
    assert_eq!(
        said.one("missing"),
        "i2cget: read failed: No such device or address",
        "ENXIO"
    );
    assert_eq!(said.one("asleep"), "0x10", "what i2cset wrote is read back");
    // 28 °C are 448 steps of a sixteenth: the scene's room plus the chip's self-heating.
    assert_eq!(said.one("thermistor"), "0x01c0");
    let rows: Vec<Vec<&str>> = said
        .all("dump")
        .map(|row| row.split(' ').collect())
        .collect();
    let register = |address: usize| rows[1 + address / 16][1 + address % 16];
    assert_eq!(rows.len(), 17, "256 registers");
    assert_eq!(
        [register(0x0E), register(0x0F)],
        ["c0", "01"],
        "thermistor, low byte first"
    );
    assert_eq!(register(0x00), "00", "normal mode");
    assert!(
        (0x81..=0xFF).step_by(2).all(|high| register(high) == "00"),
        "12-bit pixels"
    );
    assert!((0x20..0x80).all(|reserved| register(reserved) == "00"));
}

/// The scene has one person directly below the sensor: the warm pixels must be in the middle only.
fn check_the_frame(text: &str) {
    let bytes: Vec<u16> = text
        .split_ascii_whitespace()
        .map(|byte| u16::from_str_radix(byte.trim_start_matches("0x"), 16).unwrap())
        .collect();
    assert_eq!(bytes.len(), 128, "{text}");
    let pixels: Vec<u16> = bytes.chunks(2).map(|pair| pair[0] | pair[1] << 8).collect();
    let in_the_middle =
        |index: usize| (2..6).contains(&(index / 8)) && (2..6).contains(&(index % 8));
    let mean = |inside: bool| {
        let chosen: Vec<f64> = (0..64)
            .filter(|index| in_the_middle(*index) == inside)
            .map(|index| f64::from(pixels[index]) / 4.0)
            .collect();
        chosen.iter().sum::<f64>() / f64::from(u32::try_from(chosen.len()).unwrap())
    };
    let (person, room) = (mean(true), mean(false));
    println!("middle {person:.2} °C, border {room:.2} °C");
    assert!(
        (23.0..24.0).contains(&room),
        "the room is at 23.5 °C: {room}"
    );
    assert!(
        person - room > 0.4,
        "a person of 28 °C: {person} against {room}"
    );
    let warmest = (0..64).max_by_key(|index| pixels[*index]).unwrap();
    assert!(
        in_the_middle(warmest) && pixels[warmest] >= 98,
        "pixel {warmest}: {}",
        pixels[warmest]
    );
}

/// The agent lost the adapter, reported that, found it again, and the collector accounts for every frame.
fn check_the_agent(said: &Said, collector: &Serving) {
    assert!(
        said.all("check").any(|line| line.ends_with(": ok")),
        "grideye-agent check"
    );
    assert_eq!(
        said.one("unplugged,"),
        "ports in use: 0",
        "nothing is left of a killed emulator"
    );
    assert!(said.one("replugged").starts_with("/dev/i2c-"));
    let log: Vec<&str> = said.all("agent").collect();
    let position = |text: &str| log.iter().position(|line| line.contains(text));
    let closed = position("closed after unplugged");
    assert!(closed.is_some(), "{log:#?}");
    let opened_again = log.iter().rposition(|line| line.ends_with(": opened"));
    assert!(opened_again > closed, "{log:#?}");
    assert!(
        log.iter()
            .skip(opened_again.unwrap())
            .any(|line| line.contains("reading again")),
        "{log:#?}"
    );
    assert_eq!(said.one("left"), "behind, ports in use: 0");

    let audit = run(grideye().args([
        "audit",
        "--json",
        "--collector",
        &format!("http://{}", collector.address),
    ]));
    let rows: serde_json::Value = serde_json::from_str(&audit.stdout).unwrap();
    let row = &rows[0];
    println!("audit {row}");
    assert_eq!(rows.as_array().unwrap().len(), 1, "{rows}");
    assert_eq!(row["balanced"], true, "{row}");
    assert_eq!(
        row["read"], row["stored"],
        "every frame that was read is stored: {row}"
    );
    // 14 seconds at 10 Hz with the adapter plugged in. A busy host misses frames, and each is counted.
    assert!(row["stored"].as_u64().unwrap() >= 20, "{row}");
    assert!(
        row["missing"].as_u64().unwrap() >= 5,
        "frames missing without an adapter: {row}"
    );
    assert_eq!(audit.code, 3, "missing frames are reported");
}

/// Prints the time per frame, from uptimes before ten reads, after them, and after ten times 21 reads.
fn print_the_cost(said: &Said) {
    let uptimes: Vec<f64> = said
        .one("uptimes")
        .split(' ')
        .map(|time| time.parse().unwrap())
        .collect();
    let difference = (uptimes[2] - uptimes[1]) - (uptimes[1] - uptimes[0]);
    println!(
        "up after {}; one frame (write 1, read 128) {:.1} ms",
        said.one("up"),
        difference * 1e3 / 200.0
    );
    assert!(difference > 0.0);
}

#[test]
fn a_stock_kernel_on_x86_64_has_the_emulated_chip_on_a_real_bus() {
    if is_left_out(GUESTS, "QEMU guest x86-64") {
        return;
    }
    let store = tempfile::tempdir().unwrap();
    let collector = collector(store.path());
    let text = example("sh", "--usbip");
    let files = [
        folder().join("grideye"),
        folder().join("grideye-agent"),
        written(store.path(), "example", text),
    ];
    let said = Said::boot(
        "amd64",
        "way-4",
        &files,
        Some(collector.seen_from_the_guest()),
    );
    assert!(said.one("up").contains("x86_64"));
    check_the_example(&said);
    assert_eq!(
        said.one("told"),
        said.one("device"),
        "the program prints the kernel's device"
    );
    let refused = |when, text: &str| {
        let line = said.all(when).next().unwrap_or_default();
        assert!(
            line.contains(text) && line.contains("hint: "),
            "{when} {line}"
        );
    };
    refused("not", "run as root");
    refused("without", "modprobe -a vhci-hcd i2c-tiny-usb i2c-dev");
    refused("without vhci_hcd:", "no virtual USB controller");
    check_the_tools(&said);
    check_the_frame(said.one("frame"));
    check_the_agent(&said, &collector);
    print_the_cost(&said);
}

/// A Raspberry Pi's processor with the agent built for it; the chip comes from this machine, over TCP.
#[test]
fn an_arm64_guest_fetches_the_chip_over_tcp_and_runs_the_agent_for_the_raspberry_pi() {
    if is_left_out(GUESTS, "QEMU guest arm64") || is_left_out(CROSS, "QEMU guest arm64") {
        return;
    }
    let store = tempfile::tempdir().unwrap();
    let collector = collector(store.path());
    let emulator =
        Serving::start(grideye().args(["emulate", "--scene", SCENE, "--usbip", "127.0.0.1:0"]));
    let agent = folder_of(script("cross").arg("aarch64")).join("grideye-agent");
    let (serve, attach) = example("bash", "usbip --tcp-port")
        .split_once('\n')
        .unwrap();
    assert!(
        serve.contains("--usbip 127.0.0.1:3240") && serve.contains(SCENE),
        "{serve}"
    );
    // Replaces the example's port by one that is free here; nothing else changes.
    let port = emulator.address.rsplit(':').next().unwrap();
    let files = [
        agent,
        written(store.path(), "attach", &attach.replace("3240", port)),
    ];
    let said = Said::boot(
        "arm64",
        "way-4",
        &files,
        Some(collector.seen_from_the_guest()),
    );
    assert!(said.one("up").contains("aarch64"));
    assert_eq!(said.one("unloaded,"), "left: 0");
    check_the_tools(&said);
    check_the_frame(said.one("frame"));
    check_the_agent(&said, &collector);
    print_the_cost(&said);
}

/// QEMU's user mode has no bus; the agent must still start and report what is missing.
#[test]
fn the_agent_for_the_raspberry_pi_runs_and_names_the_missing_bus() {
    if is_left_out(CROSS, "the agent for aarch64 under qemu-user") {
        return;
    }
    let libraries = folder_of(script("prepare").arg("arm64")).join("root");
    let agent = folder_of(script("cross").arg("aarch64")).join("grideye-agent");
    let mut command = Command::new("qemu-aarch64-static");
    command.arg("-L").arg(libraries).arg(agent);
    let ended = run(command.args(["check", "--bus", "/dev/i2c-99"]));
    assert_eq!(ended.code, 1, "{ended:?}");
    let said = ended.stdout + &ended.stderr;
    assert!(
        said.contains("/dev/i2c-99: no such bus") && said.contains("hint: "),
        "{said}"
    );
}

/// One row of the bus trace (`--trace`): bytes written, and bytes read after a repeated START.
struct Transaction<'a> {
    written: &'a str,
    read: Option<&'a str>,
}

/// The kernel driver's output for one chip, and its bus traffic.
struct Camera<'a> {
    said: &'a Said,
    name: &'a str,
}

impl<'a> Camera<'a> {
    fn all(&self, word: &'a str) -> impl Iterator<Item = &'a str> {
        let lines = self.said.all(self.name);
        lines.filter_map(move |line| line.strip_prefix(word)?.strip_prefix(' '))
    }

    fn transactions(&self) -> Vec<Transaction<'a>> {
        let mut transactions: Vec<Transaction<'_>> = Vec::new();
        for row in self.all("trace").skip(1) {
            let cells: Vec<&str> = row.split(',').collect();
            assert_eq!(cells[4], "0x69", "{row}");
            assert_eq!(cells[7], "ack", "{row}");
            match cells[5] {
                "write" => transactions.push(Transaction {
                    written: cells[6],
                    read: None,
                }),
                _ => transactions.last_mut().unwrap().read = Some(cells[6]),
            }
        }
        transactions
    }

    /// Checks the driver's file names and formats, and the thermometer in thousandths of a degree.
    fn check_what_the_kernel_tells(&self, milli_degrees: &str) {
        let one = |word| self.all(word).next().unwrap_or_default();
        assert_eq!(one("driver"), "video-i2c");
        assert_eq!(one("detect").split_ascii_whitespace().last(), Some("UU"));
        assert_eq!(one("milli-degrees"), milli_degrees, "{}", self.name);
        for expected in ["8/8", "'Y12 ' (12-bit Greyscale)", "10.000 (10/1)"] {
            assert!(
                self.all("format").any(|line| line.ends_with(expected)),
                "{} has no {expected}",
                self.name
            );
        }
        assert_eq!(one("streaming"), "ended with 0");
        assert_eq!(one("left"), "ports in use: 0");
    }

    /// Checks start, rate and sleep against `video-i2c.c` (6.1): normal mode, initial reset, flag reset; FPSC after
    /// reading it; sleep two seconds after the last use (AMG88 spec §4-11-1 to §4-11-3).
    fn check_what_the_driver_wrote(&self) {
        let transactions = self.transactions();
        let written: Vec<&str> = transactions.iter().map(|one| one.written).collect();
        assert_eq!(written[..3], ["0x00 0x00", "0x01 0x3f", "0x01 0x30"]);
        let rates = transactions.iter().filter(|one| one.written == "0x02");
        assert_eq!(
            rates.map(|one| one.read).collect::<Vec<_>>(),
            [Some("0x00"), Some("0x00")],
            "ten frames a second, before each of two streams"
        );
        let changed = written.iter().filter(|bytes| **bytes == "0x02 0x01");
        assert_eq!(
            changed.count(),
            1,
            "one frame a second for the second stream"
        );
        let last_frame = written.iter().rposition(|bytes| *bytes == "0x80").unwrap();
        assert_eq!(written[last_frame + 1], "0x00 0x10", "asleep");
        assert_eq!(written.last(), Some(&"0x00 0x10"), "{written:?}");
    }

    /// Five frames from mapped buffers and two from `read`: each must equal, byte for byte, one on the bus.
    fn frames(&self) -> Vec<&'a str> {
        let frames: Vec<&str> = self.all("frame").map(str::trim_end).collect();
        assert_eq!(frames.len(), 7, "{}", self.name);
        let transactions = self.transactions();
        let mut bursts = transactions
            .iter()
            .filter(|one| one.written == "0x80")
            .map(|one| one.read.unwrap());
        for (number, frame) in frames.iter().enumerate() {
            assert!(
                bursts.any(|burst| burst == *frame),
                "frame {number} of {} was not on the bus, or not in this order",
                self.name
            );
        }
        frames
    }
}

/// The kernel's own driver of the chip, written independently from the datasheet, is a second opinion on every byte.
#[test]
fn the_kernels_own_driver_makes_a_camera_and_a_thermometer_of_the_emulated_chip() {
    let what = "the kernel's driver video-i2c in the QEMU guest x86-64";
    if is_left_out(GUESTS, what) || is_left_out(VIDEO_I2C, what) {
        return;
    }
    let driver = folder_of(&mut script("video-i2c")).join("files");
    let entries = std::fs::read_dir(driver).unwrap();
    let mut files: Vec<PathBuf> = entries.map(|entry| entry.unwrap().path()).collect();
    files.push(folder().join("grideye"));
    let said = Said::boot("amd64", "kernel-driver", &files, None);
    // The thermistor is 4.5 °C above the scene (scenes/profiles/README.md). Words have twelve bits in sixteen, low byte
    // first, and the driver does not extend the sign: 21.5 °C are 86 quarters, -10.25 °C are 41 below 4096.
    for (name, milli_degrees, word) in [
        ("constant", "26000", Some("0x56 0x00")),
        ("cold", "-5750", Some("0xd7 0x0f")),
        ("scene", "28000", None),
    ] {
        let camera = Camera { said: &said, name };
        camera.check_what_the_kernel_tells(milli_degrees);
        camera.check_what_the_driver_wrote();
        for frame in camera.frames() {
            match word {
                Some(word) => assert_eq!(frame, vec![word; 64].join(" "), "{name}"),
                None => check_the_frame(frame),
            }
        }
    }
}
