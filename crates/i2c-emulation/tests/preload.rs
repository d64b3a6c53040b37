//! What only preloading can do or fail at, and how a way is chosen.
#![expect(
    clippy::unwrap_used,
    clippy::panic,
    reason = "what fails in a helper fails the test"
)]

#[expect(dead_code, reason = "each test program uses some of it")]
mod common;

use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};
use std::process::Command;

use common::{Bench, RegisterFile, fuse_works_for_a_part, python_works, skip};
use i2c_emulation::adapter::HalAdapter;
use i2c_emulation::ioctl::AdapterMode;
use i2c_emulation::preload::{self, OPEN_FILES_MAX};
use i2c_emulation::program::{self, Options, RunError, Via, Way};
use i2c_emulation::rack::{Rack, SharedAdapter};

const NO_FUSE: &str = "/dev/no-fuse-here";

fn bench() -> Bench {
    Bench::new(Via::Preload, AdapterMode::Pi)
}

/// Writes an executable file.
fn file(folder: &tempfile::TempDir, name: &str, bytes: &[u8]) -> PathBuf {
    let path = folder.path().join(name);
    fs::write(&path, bytes).unwrap();
    fs::set_permissions(&path, fs::Permissions::from_mode(0o755)).unwrap();
    path
}

/// The first bytes of an ELF program (System V ABI, chapters 4 and 5) with one program header of this kind.
fn elf(wide: bool, machine: u16, kind: u32) -> Vec<u8> {
    let mut bytes = vec![0x7f, b'E', b'L', b'F', if wide { 2 } else { 1 }, 1, 1];
    bytes.resize(16, 0);
    bytes.extend([2, 0]);
    bytes.extend(machine.to_le_bytes());
    bytes.extend([1, 0, 0, 0]);
    let (header_bytes, entry_bytes): (u16, u16) = if wide { (64, 56) } else { (52, 32) };
    if wide {
        bytes.extend([0; 8]);
        bytes.extend(u64::from(header_bytes).to_le_bytes());
        bytes.extend([0; 8]);
    } else {
        bytes.extend([0; 4]);
        bytes.extend(u32::from(header_bytes).to_le_bytes());
        bytes.extend([0; 4]);
    }
    bytes.extend([0; 4]);
    for field in [header_bytes, entry_bytes, 1, 0, 0, 0] {
        bytes.extend(field.to_le_bytes());
    }
    assert_eq!(bytes.len(), usize::from(header_bytes));
    bytes.extend(kind.to_le_bytes());
    bytes.resize(usize::from(header_bytes + entry_bytes), 0);
    bytes
}

const PT_LOAD: u32 = 1;
const PT_INTERP: u32 = 3;

/// `e_machine` of this machine's programs.
fn own_machine() -> u16 {
    let own = fs::read("/proc/self/exe").unwrap();
    u16::from_le_bytes([own[18], own[19]])
}

#[test]
fn each_program_that_cannot_be_reached_has_its_own_error() {
    let folder = tempfile::tempdir().unwrap();
    let wide = size_of::<usize>() == 8;
    let refused = |path: &Path| {
        let error = preload::check(&Command::new(path)).unwrap_err();
        let text = error.to_string();
        assert!(
            text.contains("\nhint: ") && !text.starts_with(char::is_uppercase),
            "{text}"
        );
        (error, text)
    };
    let fixed = file(&folder, "static", &elf(wide, own_machine(), PT_LOAD));
    let (error, text) = refused(&fixed);
    assert!(matches!(error, RunError::StaticProgram { .. }));
    assert!(text.contains("FUSE (--via fuse)"), "{text}");

    let foreign = file(&folder, "foreign", &elf(wide, 0xF00D, PT_INTERP));
    let narrow = file(&folder, "narrow", &elf(!wide, own_machine(), PT_INTERP));
    for path in [foreign, narrow] {
        let (error, text) = refused(&path);
        assert!(matches!(error, RunError::OtherMachine { .. }));
        assert!(text.contains("32-bit programs"), "{text}");
    }

    let script = format!("#! {} -x\nwhatever", fixed.display());
    let script = file(&folder, "script", script.as_bytes());
    let outer = format!("#!{}", script.display());
    let outer = file(&folder, "outer", outer.as_bytes());
    for path in [script, outer] {
        let (error, _) = refused(&path);
        assert!(
            matches!(error, RunError::StaticProgram(program) if program == fixed.display().to_string()),
            "a script counts as its interpreter"
        );
    }
    let (error, _) = refused(&folder.path().join("nothing"));
    assert!(matches!(error, RunError::ProgramNotFound { .. }));
    let (error, _) = refused(Path::new("no-such-program"));
    assert!(matches!(error, RunError::ProgramNotFound { .. }));
}

#[test]
fn programs_that_can_be_reached_are_let_through() {
    let folder = tempfile::tempdir().unwrap();
    let wide = size_of::<usize>() == 8;
    let good = file(&folder, "good", &elf(wide, own_machine(), PT_INTERP));
    let script = file(&folder, "script", b"#!/bin/sh\nexit 0");
    let endless = format!("#!{}/endless", folder.path().display());
    let endless = file(&folder, "endless", endless.as_bytes());
    let text = file(&folder, "text", b"exit 0");
    for path in [good.as_path(), &script, &endless, &text, Path::new("sh")] {
        preload::check(&Command::new(path)).unwrap();
    }
    // The program's own PATH and folder count, not this process's.
    let mut command = Command::new("good");
    command.env("PATH", folder.path());
    preload::check(&command).unwrap();
    let mut command = Command::new("./good");
    command.current_dir(folder.path());
    preload::check(&command).unwrap();
    let mut command = Command::new("sh");
    command.env("PATH", folder.path());
    assert!(preload::check(&command).is_err());
}

#[test]
fn a_program_that_gains_rights_is_refused() {
    const NOBODY: u32 = 65534;
    let folder = tempfile::tempdir().unwrap();
    let program = folder.path().join("true");
    fs::copy("/bin/true", &program).unwrap();
    if std::os::unix::fs::chown(&program, Some(NOBODY), Some(NOBODY)).is_err() {
        skip::test("a set-user-ID program: only root can make one for another user");
        return;
    }
    for (mode, refused) in [(0o4755, true), (0o2755, true), (0o755, false)] {
        fs::set_permissions(&program, fs::Permissions::from_mode(mode)).unwrap();
        let outcome = preload::check(&Command::new(&program));
        assert_eq!(
            matches!(outcome, Err(RunError::GainsRights { .. })),
            refused,
            "{mode:o}"
        );
    }
}

#[test]
fn the_way_is_chosen_by_what_works_and_says_why() {
    let rack = bench().rack;
    let choose = |via, program: &str| {
        let options = Options {
            via,
            fuse_device: NO_FUSE.into(),
            ..Options::default()
        };
        program::choose(&rack, &options, &Command::new(program))
    };
    let chosen = choose(Via::Auto, "true").unwrap();
    assert_eq!(chosen.way(), Way::Preload);
    let line = chosen.to_string();
    assert!(
        line.contains(" by preload (no FUSE: cannot open /dev/no-fuse-here: ")
            && line.starts_with("/dev/i2c-")
            && !line.contains('\n'),
        "{line}"
    );
    assert_eq!(choose(Via::Preload, "true").unwrap().way(), Way::Preload);
    let error = choose(Via::Fuse, "true").unwrap_err();
    assert!(matches!(&error, RunError::NoFuse(..)));
    let folder = tempfile::tempdir().unwrap();
    let wide = size_of::<usize>() == 8;
    let fixed = file(&folder, "static", &elf(wide, own_machine(), PT_LOAD));
    let error = choose(Via::Auto, fixed.to_str().unwrap()).unwrap_err();
    let text = error.to_string();
    assert!(matches!(&error, RunError::NoWay(..)));
    assert!(
        text.contains("/dev/no-fuse-here") && text.contains("statically linked"),
        "{text}"
    );
    for via in Via::ALL {
        let error = choose(via, "no-such-program").unwrap_err().to_string();
        assert!(
            error.starts_with("program not found: no-such-program"),
            "{via}: {error}"
        );
    }
    if fuse_works_for_a_part() {
        let options = Options::default();
        let chosen = program::choose(&rack, &options, &Command::new("true")).unwrap();
        assert_eq!(chosen.way(), Way::Fuse);
        assert!(chosen.to_string().ends_with(" by fuse"), "{chosen}");
    }
}

#[test]
fn more_buses_than_the_library_knows_are_refused() {
    let mut rack = Rack::new();
    let bus = SharedAdapter::new(HalAdapter::new(RegisterFile::new()));
    for number in 0..65 {
        rack.insert(number, bus.clone());
    }
    let options = bench().options;
    let refused = program::run(&rack, &options, &mut Command::new("true")).unwrap_err();
    assert!(matches!(
        refused,
        RunError::TooManyBuses { found: 65, max: 64 }
    ));
}

/// The attributes must be those of a real /dev/i2c-N: a character device with major number 89 (devices.txt of Linux).
#[test]
fn the_path_is_there_for_every_way_of_looking() {
    if !python_works() {
        return;
    }
    let bench = bench();
    let said = bench.python(
        "import stat, pathlib, subprocess\n\
         for found in (os.stat(DEVICE), os.lstat(DEVICE), os.fstat(f), pathlib.Path(DEVICE).stat()):\n\
         \x20   assert stat.S_ISCHR(found.st_mode), found\n\
         \x20   assert os.major(found.st_rdev) == 89, found\n\
         number = int(DEVICE.split('-')[1])\n\
         assert os.minor(os.stat(DEVICE).st_rdev) == number\n\
         assert os.path.exists(DEVICE) and pathlib.Path(DEVICE).exists() and os.path.realpath(DEVICE) == DEVICE\n\
         assert os.path.exists('//dev/./' + DEVICE[5:])\n\
         assert os.access(DEVICE, os.R_OK | os.W_OK) and not os.access(DEVICE, os.X_OK)\n\
         assert not os.path.exists(DEVICE + '0') and not os.access(DEVICE + '0', os.R_OK)\n\
         assert not os.path.exists('/tmp' + DEVICE)\n\
         dev = os.open('/dev', os.O_RDONLY)\n\
         os.close(os.open(DEVICE[5:], os.O_RDWR, dir_fd=dev))\n\
         assert stat.S_ISCHR(os.stat(DEVICE[5:], dir_fd=dev).st_mode)\n\
         os.chdir('/dev')\n\
         os.close(os.open(DEVICE[5:], os.O_RDWR))\n\
         os.chdir('/')\n\
         assert not os.path.exists(DEVICE[5:])\n\
         print(subprocess.run(['stat', '-c', '%F', DEVICE], capture_output=True, text=True).stdout, end='')\n\
         print(subprocess.run(f'test -c {DEVICE} && test -r {DEVICE} && echo seen', shell=True, capture_output=True, text=True).stdout, end='')",
    );
    assert_eq!(said, "character special file\nseen\n");
}

#[test]
fn opening_obeys_its_flags() {
    if !python_works() {
        return;
    }
    let said = bench().python(
        "def tried(what, *arguments):\n\
         \x20   try: return what(*arguments)\n\
         \x20   except OSError as error: return errno.errorcode[error.errno]\n\
         print(tried(os.open, DEVICE, os.O_RDWR | os.O_CREAT | os.O_EXCL), tried(os.open, DEVICE, os.O_RDONLY | os.O_DIRECTORY))\n\
         r, w = os.open(DEVICE, os.O_RDONLY), os.open(DEVICE, os.O_WRONLY)\n\
         for g in (r, w): fcntl.ioctl(g, 0x0703, 0x69)\n\
         print(tried(os.write, r, b'\\x10'), tried(os.read, w, 1), tried(os.write, w, b'\\x10'), tried(os.read, r, 1))\n\
         print(tried(os.lseek, f, 0, 0), tried(os.pread, r, 1, 9), tried(fcntl.ioctl, f, 0x5401, bytes(64)))\n\
         libc = ctypes.CDLL(None, use_errno=True)\n\
         libc.fopen.restype = ctypes.c_void_p\n\
         print(libc.fopen(DEVICE.encode(), b'r+'), errno.errorcode[ctypes.get_errno()] in ('EOPNOTSUPP', 'ENOTSUP'))\n\
         unbuffered = open(DEVICE, 'r+b', buffering=0)\n\
         fcntl.ioctl(unbuffered, 0x0703, 0x69)\n\
         unbuffered.write(b'\\x20')\n\
         print(unbuffered.read(2))\n\
         os.set_inheritable(f, True)\n\
         print(os.get_inheritable(f), os.get_inheritable(r))",
    );
    assert_eq!(
        said,
        "EEXIST ENOTDIR\nEBADF EBADF 1 b's'\nESPIPE b'z' ENOTTY\nNone True\nb'\\xe3\\xea'\nTrue False\n"
    );
}

/// fork, dup and exec share the open file, as in the kernel: an address set by one holds for the other.
#[test]
fn forked_duplicated_and_started_programs_share_one_chip_and_one_open_file() {
    if !python_works() {
        return;
    }
    let said = bench().python(
        "import subprocess, sys\n\
         fcntl.ioctl(f, 0x0703, 0x69)\n\
         copy, high = os.dup(f), fcntl.fcntl(f, fcntl.F_DUPFD_CLOEXEC, 100)\n\
         os.dup2(f, 77)\n\
         fresh = os.open(DEVICE, os.O_RDWR)\n\
         os.close(f)\n\
         os.write(copy, b'\\x10\\xaa\\xbb')\n\
         os.write(77, b'\\x10')\n\
         print(os.read(high, 2).hex())\n\
         try: os.read(fresh, 1)\n\
         except OSError as error: print(errno.errorcode[error.errno])\n\
         pid = os.fork()\n\
         if pid == 0:\n\
         \x20   fcntl.ioctl(fresh, 0x0703, 0x69)\n\
         \x20   os.write(copy, b'\\x10\\xcc')\n\
         \x20   os._exit(0)\n\
         os.waitpid(pid, 0)\n\
         os.write(fresh, b'\\x10')\n\
         print(os.read(fresh, 2).hex())\n\
         child = f'import os\\nos.write({copy}, bytes([0x10]))\\nprint(os.read({copy}, 2).hex())'\n\
         print(subprocess.run([sys.executable, '-c', child], pass_fds=[copy], capture_output=True, text=True).stdout, end='')\n\
         child = f'import os, fcntl\\nf = os.open({DEVICE!r}, 2)\\nfcntl.ioctl(f, 0x0703, 0x69)\\nos.write(f, bytes([0x11]))\\nprint(os.read(f, 1).hex())'\n\
         print(subprocess.run([sys.executable, '-c', child], capture_output=True, text=True).stdout, end='')",
    );
    assert_eq!(said, "aabb\nEREMOTEIO\nccbb\nccbb\nbb\n");
}

#[test]
fn sixteen_threads_and_forks_among_them_never_mingle() {
    if !python_works() {
        return;
    }
    let bench = bench();
    let said = bench.python(
        "import threading\n\
         wrong = []\n\
         def work(k):\n\
         \x20   own = os.open(DEVICE, os.O_RDWR)\n\
         \x20   for n in range(100):\n\
         \x20       r = (n * 31 + k * 16) & 255\n\
         \x20       _, (_, block) = rdwr(own, [(0x69, 0, bytes([r])), (0x69, 1, bytes(16))])\n\
         \x20       if block != bytes((((r + i) & 255) * 7 + 3) & 255 for i in range(16)): wrong.append(r)\n\
         \x20       if n % 25 == k:\n\
         \x20           pid = os.fork()\n\
         \x20           if pid == 0:\n\
         \x20               fcntl.ioctl(own, 0x0703, 0x69)\n\
         \x20               rdwr(own, [(0x69, 0, b'\\0'), (0x69, 1, bytes(1))])\n\
         \x20               os._exit(0)\n\
         \x20           if os.waitpid(pid, 0)[1] != 0: wrong.append('child')\n\
         threads = [threading.Thread(target=work, args=(k,)) for k in range(16)]\n\
         for t in threads: t.start()\n\
         for t in threads: t.join()\n\
         print(wrong)",
    );
    assert_eq!(said, "[]\n");
}

/// A daemon that closes all descriptors also closes the library's. Files it opens under those numbers must stay
/// untouched.
#[test]
fn descriptors_that_are_closed_behind_the_library_are_not_mistaken() {
    if !python_works() {
        return;
    }
    let said = bench().python(
        "libc = ctypes.CDLL(None)\n\
         fcntl.ioctl(f, 0x0703, 0x69)\n\
         assert os.read(f, 1) == b'\\x03'\n\
         channels = [int(n) for n in os.listdir('/proc/self/fd') if int(n) >= 900]\n\
         assert channels, 'the library keeps its connection at a high number'\n\
         twin, other = __import__('socket').socketpair()\n\
         for n in channels: libc.syscall(33, twin.fileno(), n) if os.uname().machine == 'x86_64' else os.dup2(twin.fileno(), n)\n\
         assert os.read(f, 1) == b'\\x0a'\n\
         other.setblocking(False)\n\
         try: print(other.recv(100))\n\
         except BlockingIOError: print('nothing was sent to it')\n\
         libc.syscall(3, f) if os.uname().machine == 'x86_64' else os.close(f)\n\
         plain = os.open('/etc/passwd', os.O_RDONLY)\n\
         assert plain == f\n\
         print(os.read(plain, 4))",
    );
    assert_eq!(said, "nothing was sent to it\nb'root'\n");
}

#[test]
fn one_open_file_too_many_is_enfile_until_one_is_closed() {
    if !python_works() {
        return;
    }
    let said = bench().python(&format!(
        "import resource\n\
         resource.setrlimit(resource.RLIMIT_NOFILE, (2000, resource.getrlimit(resource.RLIMIT_NOFILE)[1]))\n\
         files = [f] + [os.open(DEVICE, os.O_RDWR) for _ in range({OPEN_FILES_MAX} - 1)]\n\
         def more():\n\
         \x20   try: files.append(os.open(DEVICE, os.O_RDWR)); return 'opened'\n\
         \x20   except OSError as error: return errno.errorcode[error.errno]\n\
         print(more())\n\
         os.close(files.pop())\n\
         import time\n\
         outcome = [more() for _ in range(1)]\n\
         while outcome[-1] == 'ENFILE' and len(outcome) < 500: time.sleep(0.01); outcome.append(more())\n\
         print(outcome[-1], more())"
    ));
    assert_eq!(said, "ENFILE\nopened ENFILE\n");
}

/// The emulator asks for memory that does not fit a request; with nothing sent along, for everything.
#[test]
fn memory_that_was_not_sent_along_is_fetched() {
    if !python_works() {
        return;
    }
    for prefetch in ["1", "0"] {
        let bench = bench();
        let script = bench.script(
            "count, (_, big) = rdwr(f, [(0x69, 0, b'\\x00'), (0x69, 1, bytes(8192))])\n\
             assert big == bytes((n * 7 + 3) & 255 for n in range(8192))\n\
             messages = [(0x69, 0, bytes([n]) + bytes(range(200))) for n in range(40)] + [(0x69, 0, b'\\x00'), (0x69, 1, bytes(256))]\n\
             count, buffers = rdwr(f, messages)\n\
             assert count == 42 and buffers[-1][39:239] == bytes(range(200)), buffers[-1]\n\
             fcntl.ioctl(f, 0x0703, 0x69)\n\
             assert os.write(f, b'\\x10' + bytes(255) + bytes(5000)) == 5256\n\
             print('done')",
        );
        let mut command = Command::new("python3");
        command
            .args(["-c", &script])
            .env("I2C_EMULATION_PREFETCH", prefetch);
        let (status, said) = bench.outcome(&mut command);
        assert!(status.success() && said == "done\n", "{prefetch}: {said}");
    }
}

#[test]
fn two_buses_are_there_at_once_by_both_ways() {
    if !python_works() {
        return;
    }
    for via in [Via::Fuse, Via::Preload] {
        if via == Via::Fuse && !fuse_works_for_a_part() {
            continue;
        }
        let mut bench = Bench::new(via, AdapterMode::Pi);
        let second = Bench::new(via, AdapterMode::Pi);
        bench
            .rack
            .insert(second.number, second.rack.get(second.number).unwrap());
        let said = bench.python(&format!(
            "g = os.open('/dev/i2c-{}', os.O_RDWR)\n\
             for h in (f, g): fcntl.ioctl(h, 0x0703, 0x69)\n\
             os.write(f, b'\\x10\\x01')\n\
             os.write(g, b'\\x10\\x02')\n\
             os.write(f, b'\\x10')\n\
             os.write(g, b'\\x10')\n\
             print(os.read(f, 1), os.read(g, 1))",
            second.number
        ));
        assert_eq!(said, "b'\\x01' b'\\x02'\n", "{via}");
        assert_eq!(
            (bench.chip.values()[0x10], second.chip.values()[0x10]),
            (1, 2)
        );
    }
}

#[test]
fn the_devices_that_were_opened_are_counted() {
    for via in [Via::Fuse, Via::Preload] {
        if via == Via::Fuse && !fuse_works_for_a_part() {
            continue;
        }
        let bench = Bench::new(via, AdapterMode::Pi);
        let opens = |script: String| {
            let ended = bench.run(Command::new("sh").args(["-c", &script])).unwrap();
            assert!(ended.status.success());
            ended.opens
        };
        let device = bench.device();
        let device = device.display();
        assert_eq!(opens("true".to_owned()), 0, "{via}");
        assert_eq!(
            opens(format!("exec 3<>{device}; exec 4<>{device}")),
            2,
            "{via}"
        );
    }
}

/// Libraries that the user preloads stay preloaded, and the command is restored afterward.
#[test]
fn another_library_to_preload_stays_in_the_list() {
    let bench = bench();
    let file = tempfile::NamedTempFile::new().unwrap();
    let mut command = Command::new("sh");
    command
        .args(["-c", "echo $LD_PRELOAD; echo $I2C_EMULATION_PRELOAD"])
        .env("LD_PRELOAD", "libm.so.6")
        .stdout(file.reopen().unwrap());
    bench.run(&mut command).unwrap();
    let said = fs::read_to_string(file.path()).unwrap();
    let mut lines = said.lines();
    let list = lines.next().unwrap();
    let own = format!("/proc/{}/fd/", std::process::id());
    assert!(
        list.starts_with(&own) && list.ends_with(":libm.so.6"),
        "{list}"
    );
    assert!(lines.next().unwrap().starts_with("i2c-emulation-"));
    let environment: Vec<_> = command.get_envs().collect();
    assert!(
        environment.contains(&("LD_PRELOAD".as_ref(), Some("libm.so.6".as_ref())))
            && environment.contains(&("I2C_EMULATION_PRELOAD".as_ref(), None)),
        "{environment:?}"
    );
}

/// A program started as another user cannot open the library, and reports that itself.
#[test]
fn a_program_of_another_user_runs_without_the_device() {
    const NOBODY: u32 = 65534;
    let bench = bench();
    let script = format!("test -e {}", bench.device().display());
    let mut command = Command::new("sh");
    command.args(["-c", &script]).uid(NOBODY).gid(NOBODY);
    let file = tempfile::NamedTempFile::new().unwrap();
    match bench.run(command.stderr(file.reopen().unwrap())) {
        Ok(ended) => {
            let said = fs::read_to_string(file.path()).unwrap();
            assert!(!ended.status.success());
            assert!(said.contains("LD_PRELOAD cannot be preloaded"), "{said}");
        }
        Err(RunError::ProgramNotStarted(_, source)) if source.raw_os_error() == Some(1) => {
            skip::test("a program of another user: only root can start one");
        }
        Err(error) => panic!("{error}"),
    }
}
