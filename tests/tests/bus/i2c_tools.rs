//! Debian's unmodified i2c-tools on the emulated sensor: finding its address, reading a frame, dumping the address map.
//!
//! The tests of crates/i2c-emulation hold the bus to the kernel's rules. These test the whole, from a recording's words
//! to the terminal.

#![expect(clippy::unwrap_used, reason = "what fails in a helper fails the test")]

use grideye_tests::emulated::{Words, recording, run_emulated};
use grideye_tests::programs::{Ended, is_left_out};
use std::path::Path;
use std::process::Command;

const WHAT: &str = "i2c-tools on the emulated sensor";

/// Whether i2c-tools must be left out, because they are not installed.
fn left_out() -> bool {
    is_left_out("GRIDEYE_WITHOUT_I2C_TOOLS", WHAT)
}

/// Pixels 1 to 64 with words from -40 to +75.75 °C, the first half below zero.
fn words() -> Words {
    Words {
        pixels: std::array::from_fn(|pixel| {
            let quarters = i16::try_from(pixel).unwrap() * 7 - 160;
            u16::from_ne_bytes(quarters.to_ne_bytes()) & 0xFFF
        }),
        thermistor: 0x191,
    }
}

/// A recording of [`words`] alone, the source of most tests here.
fn known(folder: &Path) -> Vec<String> {
    let file = recording(folder, "known.csv", [words()]);
    vec!["--recording".to_owned(), file.to_str().unwrap().to_owned()]
}

/// Runs shell lines, stopping at the first that fails.
fn shell(source: &[String], lines: &str) -> Ended {
    let mut command = Command::new("sh");
    command.args(["-ec", lines]);
    run_emulated(source, &command)
}

/// The words printed by shell lines, which must all succeed.
fn printed(source: &[String], lines: &str) -> Vec<String> {
    let ended = shell(source, lines);
    assert_eq!(ended.code, 0, "{lines}: {ended:?}");
    ended.stdout.split_whitespace().map(str::to_owned).collect()
}

/// The 128 bytes of the pixels, low byte first.
fn pixel_bytes() -> Vec<u8> {
    words()
        .pixels
        .iter()
        .flat_map(|word| word.to_le_bytes())
        .collect()
}

/// The cells of a dump or a map: sixteen per line after `N0:`, without the text column after them.
fn cells(text: &str) -> Vec<&str> {
    let rows = text.lines().filter(|line| line.get(2..3) == Some(":"));
    rows.flat_map(|row| row[3..row.len().min(51)].split_whitespace())
        .collect()
}

fn hexadecimal(cell: &str) -> u8 {
    u8::from_str_radix(cell.trim_start_matches("0x"), 16).unwrap()
}

/// The address map of the reference (section 1), one byte per register: a sensor that was only powered on, before a
/// static scene.
fn address_map() -> Vec<u8> {
    let mut map = vec![0; 0x80];
    map[0x0E..0x10].copy_from_slice(&words().thermistor.to_le_bytes());
    map.extend(pixel_bytes());
    map
}

#[test]
fn i2cdetect_finds_the_sensor_at_its_address_and_nothing_else() {
    if left_out() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    for address in ["0x68", "0x69"] {
        let mut source = known(folder.path());
        source.extend(["--address".to_owned(), address.to_owned()]);
        // By quick write, by reading a byte, and by i2cdetect's own choice per address.
        for probe in ["-q", "-r", ""] {
            let ended = shell(&source, &format!("i2cdetect -y {probe} 1"));
            let map = cells(&ended.stdout);
            let found: Vec<&str> = map.iter().copied().filter(|cell| *cell != "--").collect();
            assert_eq!(found, [&address[2..]], "{probe}: {ended:?}");
            assert_eq!(map.len(), 0x78 - 0x08, "{ended:?}");
        }
    }
}

#[test]
fn i2cdump_shows_the_address_map_in_each_of_its_modes() {
    if left_out() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let expected = address_map();
    let source = known(folder.path());
    // Byte by byte, by single bytes after setting the pointer, and in blocks of 32.
    for mode in ["b", "c", "i"] {
        let ended = shell(&source, &format!("i2cdump -y 1 0x69 {mode}"));
        let dump: Vec<u8> = cells(&ended.stdout).into_iter().map(hexadecimal).collect();
        assert_eq!(dump, expected, "{mode}: {ended:?}");
    }
    let ended = shell(&source, "i2cdump -y 1 0x69 w");
    let words: Vec<u16> = word_cells(&ended.stdout);
    let expected: Vec<u16> = (0..0x100)
        .map(|register| {
            let next = (register + 1) % 0x100;
            u16::from_le_bytes([expected[register], expected[next]])
        })
        .collect();
    assert_eq!(words, expected, "{ended:?}");
}

/// The cells of a word dump, eight per line.
fn word_cells(text: &str) -> Vec<u16> {
    let rows = text.lines().filter(|line| line.get(2..3) == Some(":"));
    rows.flat_map(|row| row[3..].split_whitespace())
        .map(|cell| u16::from_str_radix(cell, 16).unwrap())
        .collect()
}

#[test]
fn i2ctransfer_reads_a_frame_in_one_transfer() {
    if left_out() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let source = known(folder.path());
    let read = |line: &str| -> Vec<u8> {
        let cells = printed(&source, line);
        cells.iter().map(|cell| hexadecimal(cell)).collect()
    };
    assert_eq!(read("i2ctransfer -y 1 w1@0x69 0x80 r128"), pixel_bytes());
    assert_eq!(
        read("i2ctransfer -y 1 w1@0x69 0x80; i2ctransfer -y 1 r64@0x69; i2ctransfer -y 1 r64@0x69"),
        pixel_bytes(),
        "the pointer stays across a STOP and continues"
    );
    assert_eq!(
        read("i2ctransfer -y 1 w1@0x69 0x00 r256"),
        address_map(),
        "every register in one burst"
    );
    assert_eq!(
        read("i2ctransfer -y 1 w1@0x69 0xff r3"),
        [address_map()[0xFF], 0, 0],
        "after the last register comes the first"
    );
}

#[test]
fn i2cget_reads_bytes_words_and_blocks() {
    if left_out() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let bytes = pixel_bytes();
    let source = known(folder.path());
    let got = |line: &str| printed(&source, line);
    // Pixel 1 is -40 °C = 0xF60; the thermistor 25.0625 °C = 0x191.
    assert_eq!(got("i2cget -y 1 0x69 0x80"), ["0x60"]);
    assert_eq!(got("i2cget -y 1 0x69 0x81"), ["0x0f"]);
    assert_eq!(got("i2cget -y 1 0x69 0x80 w"), ["0x0f60"]);
    assert_eq!(got("i2cget -y 1 0x69 0x0e w"), ["0x0191"]);
    assert_eq!(got("i2cget -y 1 0x69 0x80 c"), ["0x60"]);
    let block = got("i2cget -y 1 0x69 0x90 i 16");
    let block: Vec<u8> = block.iter().map(|cell| hexadecimal(cell)).collect();
    assert_eq!(block, bytes[0x10..0x20]);
}

/// Writable registers, their readback, and registers that ignore writes (reference, sections 1 and 2.5).
#[test]
fn i2cset_writes_the_writable_registers() {
    if left_out() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let source = known(folder.path());
    let lines = "
        put() { i2cset -y 1 0x69 $1 $2; i2cget -y 1 0x69 $1; }
        put 0x02 0x01                                       # 1 frame a second
        put 0x03 0x03                                       # interrupt on, absolute
        put 0x08 0xd8; put 0x09 0x0f                        # upper level -10 °C
        put 0x01 0x3f                                       # reset: a command, not a memory
        put 0x05 0x0e                                       # clears and returns to 0
        put 0x04 0xff                                       # status is read only
        put 0x0e 0xff; put 0x80 0xff                        # so are thermistor and pixels
        put 0x06 0xff; put 0x20 0xff; put 0x7f 0xff         # reserved and undocumented
        put 0x07 0x20                                       # moving average without its key";
    let got = printed(&source, lines);
    assert_eq!(got[..4], ["0x01", "0x03", "0xd8", "0x0f"], "{got:?}");
    assert_eq!(got[4..6], ["0x00", "0x00"], "{got:?}");
    assert!(["0x00", "0x02"].contains(&got[6].as_str()), "{got:?}");
    assert_ne!(got[7], "0xff");
    assert_ne!(got[8], "0xff");
    assert_eq!(got[9..], ["0x00", "0x00", "0x00", "0x00"], "{got:?}");
}

/// Panasonic draws the moving average's key, and the two bytes of a level, as one transfer with repeated STARTs.
#[test]
fn i2ctransfer_writes_as_panasonic_draws_it() {
    if left_out() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let source = known(folder.path());
    let lines = "
        i2ctransfer -y 1 w2@0x69 0x1f 0x50 w2 0x1f 0x45 w2 0x1f 0x57 w2 0x07 0x20 w2 0x1f 0x00
        i2cget -y 1 0x69 0x07
        i2ctransfer -y 1 w2@0x69 0x08 0x78 w2 0x09 0x00
        i2cget -y 1 0x69 0x08 w
        i2ctransfer -y 1 w7@0x69 0x08 0x78 0x00 0xec 0x0f 0x04 0x00
        i2ctransfer -y 1 w1@0x69 0x08 r6";
    assert_eq!(
        printed(&source, lines),
        [
            "0x20", "0x0078", "0x78", "0x00", "0xec", "0x0f", "0x04", "0x00"
        ]
    );
}

/// The interrupt table of a scene with a person, read by hand with common terminal tools.
#[test]
fn i2cset_and_i2cdump_see_the_pixels_that_are_above_the_level() {
    if left_out() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let source = known(folder.path());
    // Absolute mode, upper level 0 °C, lower level -128 °C (0xE00): the pixels above zero trip.
    let lines = "
        for pair in '0x08 0x00' '0x09 0x00' '0x0a 0x00' '0x0b 0x0e' '0x03 0x03'; do i2cset -y 1 0x69 $pair; done
        sleep 0.25
        i2cget -y 1 0x69 0x04
        i2ctransfer -y 1 w1@0x69 0x10 r8";
    let got = printed(&source, lines);
    assert_eq!(got[0], "0x02", "INTF");
    let above = |pixel: usize| words().pixels[pixel] & 0x800 == 0 && words().pixels[pixel] != 0;
    let table: Vec<u8> = (0..8)
        .map(|row| (0..8).fold(0, |bits, bit| bits | u8::from(above(8 * row + bit)) << bit))
        .collect();
    let read: Vec<u8> = got[1..].iter().map(|cell| hexadecimal(cell)).collect();
    assert_eq!(read, table);
}

/// In sleep only the wake command works, and reads return the documented values (reference, 2.1).
#[test]
fn i2cset_sends_the_sensor_to_sleep_and_wakes_it() {
    if left_out() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let source = known(folder.path());
    let lines = "
        i2cset -y 1 0x69 0x00 0x10
        sleep 0.15
        i2cset -y 1 0x69 0x02 0x01
        i2ctransfer -y 1 w1@0x69 0x00 r16
        i2cget -y 1 0x69 0x80 w
        i2cset -y 1 0x69 0x00 0x00; sleep 0.05; i2cset -y 1 0x69 0x01 0x3f; sleep 0.01; i2cset -y 1 0x69 0x01 0x30
        i2cget -y 1 0x69 0x02
        sleep 0.25
        i2cget -y 1 0x69 0x80 w";
    let got = printed(&source, lines);
    let mut asleep = vec!["0x00"; 16];
    asleep[0x00] = "0x10";
    asleep[0x0F] = "0x80";
    assert_eq!(got[..16], asleep);
    assert_eq!(
        got[16..],
        ["0x0000", "0x00", "0x0f60"],
        "no image, no rate written, then the image again"
    );
}

/// What each kind of adapter allows i2c-tools, and its error messages.
#[test]
fn each_kind_of_adapter_refuses_what_it_refuses() {
    if left_out() {
        return;
    }
    const BURST: &str = "i2ctransfer -y 1 w1@0x69 0x80 r2";
    const TWO_READS: &str = "i2ctransfer -y 1 r1@0x69 r1@0x69";
    const WORD: &str = "i2cget -y 1 0x69 0x80 w";
    const NOBODY: &str = "i2ctransfer -y 1 w1@0x68 0x80 r2";
    const READ: &str = "0x60 0x0f";
    let folder = tempfile::tempdir().unwrap();
    let table = [
        ("pi", BURST, 0, READ),
        ("pi", TWO_READS, 1, "Operation not supported"),
        ("pi", NOBODY, 1, "Remote I/O error"),
        ("pi", WORD, 0, "0x0f60"),
        ("pi5", BURST, 0, READ),
        ("pi5", TWO_READS, 0, "0x"),
        ("pi5", NOBODY, 1, "Remote I/O error"),
        ("usb", BURST, 0, READ),
        ("usb", TWO_READS, 0, "0x"),
        ("usb", NOBODY, 1, "No such device or address"),
        (
            "smbus-only",
            BURST,
            1,
            "Adapter does not have I2C transfers capability",
        ),
        ("smbus-only", WORD, 0, "0x0f60"),
        ("busy", WORD, 1, "Device or resource busy"),
        ("busy", BURST, 1, "Device or resource busy"),
        ("gone", BURST, 1, "No such device"),
        ("gone", WORD, 2, "Read failed"),
        ("virtio", BURST, 0, READ),
        ("virtio", WORD, 0, "0x0f60"),
        // Fewer messages than requested, and no errno: i2ctransfer notices.
        ("virtio", NOBODY, 0, "only 0/2 messages were sent"),
    ];
    for (adapter, line, code, said) in table {
        let mut source = known(folder.path());
        source.extend(["--adapter".to_owned(), adapter.to_owned()]);
        let ended = shell(&source, line);
        let context = format!("{adapter}: {line}: {ended:?}");
        assert_eq!(ended.code, code, "{context}");
        let all = format!("{}{}", ended.stdout, ended.stderr);
        assert!(all.contains(said), "{context}");
    }
}

#[test]
fn i2cdetect_names_what_each_kind_of_adapter_can_do() {
    if left_out() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    for (adapter, plain_i2c, block_read) in [
        ("pi", "yes", "no"),
        ("pi5", "yes", "yes"),
        ("smbus-only", "no", "yes"),
    ] {
        let mut source = known(folder.path());
        source.extend(["--adapter".to_owned(), adapter.to_owned()]);
        let ended = shell(&source, "i2cdetect -F 1");
        let says = |what: &str| {
            let line = ended.stdout.lines().find(|line| line.starts_with(what));
            line.unwrap().split_whitespace().next_back().unwrap()
        };
        assert_eq!(
            (says("I2C  "), says("SMBus Block Read ")),
            (plain_i2c, block_read),
            "{adapter}: {ended:?}"
        );
    }
}
