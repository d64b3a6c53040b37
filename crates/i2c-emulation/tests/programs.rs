//! Unmodified third-party programs with an emulated bus as their `/dev/i2c-N`.
//!
//! `GRIDEYE_WITHOUT_I2C_TOOLS=1` skips what needs i2c-tools. Without this variable, anything missing fails the test.
#![expect(clippy::unwrap_used, reason = "what fails in a helper fails the test")]

#[expect(dead_code, reason = "each test program uses some of it")]
mod common;

use std::os::unix::process::ExitStatusExt;
use std::path::PathBuf;
use std::process::Command;

use common::*;
use i2c_emulation::ioctl::AdapterMode;
use i2c_emulation::program;

#[test]
fn i2cdetect_sees_the_target_and_nobody_else() {
    let bench = Bench::new(AdapterMode::Pi);
    let Some(found) = bench.i2c_tool("i2cdetect", "-y BUS") else {
        return;
    };
    let expected = "     0  1  2  3  4  5  6  7  8  9  a  b  c  d  e  f\n\
        00:                         -- -- -- -- -- -- -- -- \n\
        10: -- -- -- -- -- -- -- -- -- -- -- -- -- -- -- -- \n\
        20: -- -- -- -- -- -- -- -- -- -- -- -- -- -- -- -- \n\
        30: -- -- -- -- -- -- -- -- -- -- -- -- -- -- -- -- \n\
        40: -- -- -- -- -- -- -- -- -- -- -- -- -- -- -- -- \n\
        50: -- -- -- -- -- -- -- -- -- -- -- -- -- -- -- -- \n\
        60: -- -- -- -- -- -- -- -- -- 69 -- -- -- -- -- -- \n\
        70: -- -- -- -- -- -- -- --                         \n";
    assert_eq!(found, expected);
    let Some(busy) = Bench::new(AdapterMode::Busy).i2c_tool("i2cdetect", "-y BUS") else {
        return;
    };
    assert_eq!(busy.matches("UU").count(), 0x78 - 0x08, "{busy}");
}

#[test]
fn i2cdetect_lists_what_a_raspberry_pi_offers() {
    let Some(offers) = Bench::new(AdapterMode::Pi).i2c_tool("i2cdetect", "-F BUS") else {
        return;
    };
    let line = |name: &str| {
        let line = offers.lines().find(|line| line.starts_with(name));
        line.unwrap_or_else(|| panic!("no {name} in\n{offers}"))
            .ends_with("yes")
    };
    assert!(line("I2C "));
    assert!(line("SMBus Quick Command"));
    assert!(line("I2C Block Read"));
    assert!(!line("SMBus Block Read"));
    assert!(!line("SMBus Block Process Call"));
}

#[test]
fn i2cget_and_i2cset_share_one_chip_over_several_runs() {
    let bench = Bench::new(AdapterMode::Pi);
    let Some(before) = bench.i2c_tool("i2cget", "-y BUS 0x69 0x10") else {
        return;
    };
    assert_eq!(before, "0x73\n", "16 x 7 + 3");
    bench.i2c_tool("i2cset", "-y BUS 0x69 0x10 0x5a");
    assert_eq!(
        bench.i2c_tool("i2cget", "-y BUS 0x69 0x10").unwrap(),
        "0x5a\n"
    );
    assert_eq!(
        bench.i2c_tool("i2cget", "-y BUS 0x69 0x10 w").unwrap(),
        "0x7a5a\n",
        "the low byte comes first"
    );
    bench.i2c_tool("i2cset", "-y BUS 0x69 0x20 1 2 3 4 i");
    assert_eq!(
        bench.i2c_tool("i2cget", "-y BUS 0x69 0x20 i 5").unwrap(),
        "0x01 0x02 0x03 0x04 0xff\n"
    );
    assert_eq!(bench.chip.values()[0x20..0x24], [1, 2, 3, 4]);
}

#[test]
fn i2cdump_shows_all_registers() {
    for way in ["b", "i"] {
        let Some(dump) =
            Bench::new(AdapterMode::Pi).i2c_tool("i2cdump", &format!("-y BUS 0x69 {way}"))
        else {
            return;
        };
        let rows: Vec<&str> = dump
            .lines()
            .filter(|line| line.get(2..4) == Some(": "))
            .collect();
        assert_eq!(rows.len(), 16, "{dump}");
        for (row, line) in rows.iter().enumerate() {
            let expected: Vec<String> = (0..16)
                .map(|column| format!("{:02x}", first_value(row * 16 + column)))
                .collect();
            assert_eq!(
                &line[..51],
                format!("{row:x}0: {}", expected.join(" ")),
                "{dump}"
            );
        }
    }
}

#[test]
fn i2ctransfer_reads_128_bytes_after_one_write() {
    let bench = Bench::new(AdapterMode::Pi);
    let Some(read) = bench.i2c_tool("i2ctransfer", "-y BUS w1@0x69 0x80 r128") else {
        return;
    };
    let expected: Vec<String> = (0x80..0x100)
        .map(|register| format!("{:#04x}", first_value(register)))
        .collect();
    assert_eq!(read.trim_end(), expected.join(" "));
}

#[test]
fn a_missing_target_gives_the_errno_of_the_mode() {
    if !python_works() {
        return;
    }
    for (mode, expected) in [
        (AdapterMode::Pi, "EREMOTEIO"),
        (AdapterMode::Pi5, "EREMOTEIO"),
        (AdapterMode::Usb, "ENXIO"),
        (AdapterMode::SmbusOnly, "EOPNOTSUPP"),
        (AdapterMode::Gone, "ENODEV"),
        (AdapterMode::Virtio, "0 messages, buffer untouched"),
    ] {
        let bench = Bench::new(mode);
        let said = bench.python(
            "buffer = b'stale'\n\
             try:\n\
             \x20   count, (_, read) = rdwr(f, [(0x10, 0, b'\\x80'), (0x10, 1, buffer)])\n\
             \x20   print(count, 'messages, buffer', 'untouched' if read == buffer else 'changed')\n\
             except OSError as error:\n\
             \x20   print(errno.errorcode[error.errno].replace('ENOTSUP', 'EOPNOTSUPP') if 'OPNOT' not in errno.errorcode[error.errno] else 'EOPNOTSUPP')",
        );
        assert_eq!(said.trim(), expected, "{mode}");
    }
}

#[test]
fn python_reads_a_block_by_i2c_rdwr_and_by_plain_read_and_write() {
    if !python_works() {
        return;
    }
    let bench = Bench::new(AdapterMode::Pi);
    let said = bench.python(
        "count, (_, block) = rdwr(f, [(0x69, 0, b'\\x80'), (0x69, 1, bytes(128))])\n\
         assert count == 2 and block == bytes((n * 7 + 3) & 255 for n in range(0x80, 0x100)), block\n\
         fcntl.ioctl(f, 0x0703, 0x69)\n\
         assert os.write(f, b'\\x40\\xaa\\xbb') == 3\n\
         assert os.write(f, b'\\x40') == 1\n\
         assert os.read(f, 3) == bytes([0xaa, 0xbb, (0x42 * 7 + 3) & 255])\n\
         assert len(os.read(f, 20000)) == 8192, 'i2c-dev reads 8192 bytes at most'\n\
         assert os.write(f, bytes(20000)) == 8192, 'i2c-dev writes 8192 bytes at most'\n\
         print('done')",
    );
    assert_eq!(said, "done\n");
}

#[test]
fn hostile_calls_get_the_kernels_errno() {
    if !python_works() {
        return;
    }
    let said = Bench::new(AdapterMode::Pi).python(
        "def tried(request, argument):\n\
         \x20   try: return fcntl.ioctl(f, request, argument)\n\
         \x20   except OSError as error: return errno.errorcode[error.errno]\n\
         print(tried(0x0703, 0x80), tried(0x0799, 0), tried(0x0707, 0), tried(0x0705, 1), tried(0x0720, 12345))\n\
         try: rdwr(f, [(0x69, 0, b'\\x80'), (0x69, 1, bytes(9000))])\n\
         except OSError as error: print(errno.errorcode[error.errno])\n\
         assert fcntl.ioctl(f, 0x0703, 0x69) == 0\n\
         assert os.read(f, 1) == b'\\x03'",
    );
    assert_eq!(said, "EINVAL ENOTTY EFAULT EFAULT EFAULT\nEINVAL\n");
}

/// Four processes on one bus: if transfers were not atomic, one would read from another's register.
#[test]
fn transfers_of_several_processes_never_mingle() {
    if !python_works() {
        return;
    }
    let said = Bench::new(AdapterMode::Pi).python(
        "children = []\n\
         for k in range(4):\n\
         \x20   pid = os.fork()\n\
         \x20   if pid == 0:\n\
         \x20       own = os.open(DEVICE, os.O_RDWR)\n\
         \x20       for n in range(200):\n\
         \x20           r = (n * 31 + k * 64) & 255\n\
         \x20           _, (_, block) = rdwr(own, [(0x69, 0, bytes([r])), (0x69, 1, bytes(16))])\n\
         \x20           if block != bytes((((r + i) & 255) * 7 + 3) & 255 for i in range(16)): os._exit(1)\n\
         \x20       os._exit(0)\n\
         \x20   children.append(pid)\n\
         print([os.waitpid(pid, 0)[1] for pid in children])",
    );
    assert_eq!(said, "[0, 0, 0, 0]\n");
}

#[test]
fn exit_codes_and_signals_are_handed_on_and_nothing_is_left() {
    let bench = Bench::new(AdapterMode::Pi);
    let device = bench.device();
    let device = device.display();
    let run = |script: String| {
        bench
            .run(Command::new("sh").args(["-c", &script]))
            .unwrap()
            .status
    };
    assert_eq!(run("exit 37".to_owned()).code(), Some(37));
    assert_eq!(
        run(format!("exec 3<>{device}; kill -KILL $$")).signal(),
        Some(9)
    );
    assert_eq!(
        run(format!("exec 3<>{device}; kill -INT $$")).signal(),
        Some(2)
    );
    assert_eq!(
        run("true".to_owned()).code(),
        Some(0),
        "the same bench serves again"
    );
}

/// Runs one command twice: the second run must not repeat the arrangements for the first.
#[test]
fn a_command_can_be_run_again() {
    let bench = Bench::new(AdapterMode::Pi);
    let mut command = Command::new("test");
    command.arg("-e").arg(bench.device());
    assert!(bench.run(&mut command).unwrap().status.success());
    assert!(bench.run(&mut command).unwrap().status.success());
    assert!(
        !command.status().unwrap().success(),
        "outside there is no device"
    );
}

/// Processes that the program leaves running lose their bus when it ends, and nothing else; they do not keep `run` from
/// returning.
#[test]
fn a_program_that_leaves_processes_running_still_ends() {
    if !python_works() {
        return;
    }
    let bench = Bench::new(AdapterMode::Pi);
    let device = bench.device();
    let device = device.display();
    let folder = tempfile::tempdir().unwrap();
    let end = folder.path().join("end").display().to_string();
    let script = format!(
        "import os, fcntl\nf = os.open('{device}', os.O_RDWR)\nfcntl.ioctl(f, 0x0703, 0x69)\nos.read(f, 1)\n\
         if os.fork() > 0: os._exit(7)\n\
         try:\n\
         \x20   while True: os.read(f, 1)\n\
         except OSError as error: open('{end}', 'w').write(str(error.errno))"
    );
    let mut command = Command::new("python3");
    command.args(["-c", &script]);
    let ended = program::run(&bench.rack, &bench.options, &mut command).unwrap();
    assert_eq!(ended.status.code(), Some(7));
    // Its bus is dead, and everything else works: opening a file too.
    wait_until(|| std::fs::read_to_string(&end).is_ok_and(|errno| errno == "107"));
    assert_nothing_left(&bench.device());
}

/// A C program, optimized and hardened like Debian's: it calls `__read_chk` and `__open64_2` instead of `read` and
/// `open`.
const CLIENT: &str = r#"
#define _FILE_OFFSET_BITS 64
#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/ioctl.h>
#include <sys/uio.h>
#include <unistd.h>
int main(int count, char **arguments) {
    volatile int flags = O_RDWR;
    int file = open(arguments[1], flags);
    if (file < 0) { perror("open"); return 1; }
    if (ioctl(file, 0x0703, 0x69)) { perror("I2C_SLAVE"); return 2; }
    unsigned char bytes[4] = {0x10};
    volatile size_t length = atoi(arguments[2]);
    if (write(file, bytes, 1) != 1) { perror("write"); return 3; }
    if (read(file, bytes, length) != length) { perror("read"); return 4; }
    struct iovec pieces[2] = {{bytes + 2, 1}, {bytes + 3, 1}};
    if (readv(file, pieces, 2) != 2) { perror("readv"); return 5; }
    printf("%02x %02x %02x %02x\n", bytes[0], bytes[1], bytes[2], bytes[3]);
    int there = ioctl(file, 0x0705, (void *)3);
    printf("%d %d\n", there, errno == EFAULT);
    return close(file) || read(file, bytes, 1) != -1 || errno != EBADF;
}
"#;

const HARDENED: &str = "-D_FORTIFY_SOURCE=2";

/// Compiles the program with these flags; `None` if this machine lacks a C compiler or the library for it.
fn compiled(folder: &tempfile::TempDir, text: &str, flags: &[&str]) -> Option<PathBuf> {
    let source = folder.path().join("client.c");
    std::fs::write(&source, text).unwrap();
    let program = folder.path().join("client");
    let made = Command::new("cc")
        .args(["-O2", "-w", "-U_FORTIFY_SOURCE"])
        .args(flags)
        .arg(&source)
        .arg("-o")
        .arg(&program)
        .output();
    match made {
        Ok(made) if made.status.success() => Some(program),
        _ => {
            skip::test(&format!("a program in C: `cc {flags:?}` does not work"));
            None
        }
    }
}

#[test]
fn a_hardened_program_in_c_works() {
    let folder = tempfile::tempdir().unwrap();
    let Some(program) = compiled(&folder, CLIENT, &[HARDENED]) else {
        return;
    };
    let bench = Bench::new(AdapterMode::Pi);
    let device = bench.device();
    let said = bench.output(&program, &[device.to_str().unwrap(), "2"]);
    // 16 x 7 + 3 and the next three values.
    assert_eq!(said, "73 7a 81 88\n-1 1\n");
}

/// i2c-dev accepts pread() and similar calls, and ignores the position.
#[test]
fn a_position_is_taken_and_ignored() {
    let folder = tempfile::tempdir().unwrap();
    for flags in [&[][..], &[HARDENED]] {
        let Some(program) = compiled(&folder, include_str!("positional.c"), flags) else {
            return;
        };
        let bench = Bench::new(AdapterMode::Pi);
        let device = bench.device();
        let said = bench.output(&program, &[device.to_str().unwrap()]);
        // 16 x 7 + 3 and the next value; then values from 32 x 7 + 3.
        let expected = "pread 2: 73 7a\n\
             pread64 2: e3 ea\n\
             preadv 2: f1 f8\n\
             preadv64 2: ff 06\n\
             preadv2 2: 0d 14\n\
             preadv64v2 2: 1b 22\n\
             preadv2 without a position 2: 29 30\n\
             pwritev 4: 00 00\n\
             pwritev64 4: 00 00\n\
             pwritev2 4: 00 00\n\
             pwritev64v2 4: 00 00\n\
             pread before the start errno 22\n\
             pwrite before the start errno 22\n\
             preadv before the start errno 22\n\
             preadv2 before the start errno 22\n\
             preadv2 that must not wait errno 95\n\
             readv of -1 pieces errno 22\n\
             readv of 1025 pieces errno 22\n\
             readv of pieces that are nowhere errno 14\n\
             lseek errno 29\n";
        assert_eq!(said, expected, "{flags:?}");
        let values = bench.chip.values();
        for (call, register) in (0..4).zip((0x40..).step_by(8)) {
            let between = [register + 1, register + 2, register + 3].map(first_value);
            assert_eq!(values[register], 0xA0 + call);
            assert_eq!(values[register + 1..register + 4], between);
            assert_eq!(values[register + 4], 0xB0 + call, "each piece is a message");
        }
    }
}

#[test]
fn a_static_program_works() {
    let folder = tempfile::tempdir().unwrap();
    let Some(program) = compiled(&folder, CLIENT, &[HARDENED, "-static"]) else {
        return;
    };
    let bench = Bench::new(AdapterMode::Pi);
    let device = bench.device();
    let said = bench.output(&program, &[device.to_str().unwrap(), "2"]);
    assert_eq!(said, "73 7a 81 88\n-1 1\n");
}

/// 32-bit programs have other numbers of calls and other layouts: this one needs no C library of that kind.
#[test]
#[cfg(target_arch = "x86_64")]
fn a_program_of_32_bits_works() {
    let folder = tempfile::tempdir().unwrap();
    let flags = [
        "-m32",
        "-static",
        "-nostdlib",
        "-ffreestanding",
        "-fno-pie",
        "-no-pie",
    ];
    let Some(program) = compiled(&folder, include_str!("narrow.c"), &flags) else {
        return;
    };
    if Command::new(&program).arg("").output().is_err() {
        skip::test("this kernel has no 32-bit programs");
        return;
    }
    let bench = Bench::new(AdapterMode::Pi);
    let device = bench.device();
    let said = bench.output(&program, &[device.to_str().unwrap()]);
    assert_eq!(said, "zyrs done\n");
    assert_eq!(bench.chip.values()[0x10..0x14], *b"zyrs");
}
