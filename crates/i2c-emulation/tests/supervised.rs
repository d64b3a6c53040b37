//! What a program and its children see of the device, beyond transfers; which programs can be supervised; and limits.
#![expect(clippy::unwrap_used, reason = "what fails in a helper fails the test")]

#[expect(dead_code, reason = "each test program uses some of it")]
mod common;

use std::convert::Infallible;
use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};
use std::process::Command;

use common::{Bench, python_works, skip};
use embedded_hal::i2c::{ErrorType, I2c, Operation, SevenBitAddress};
use i2c_emulation::adapter::{BusFault, Fault, HalAdapter};
use i2c_emulation::ioctl::AdapterMode;
use i2c_emulation::program::{self, RunError};
use i2c_emulation::syscalls::OPEN_FILES_MAX;

const NOBODY: u32 = 65534;

fn bench() -> Bench {
    Bench::new(AdapterMode::Pi)
}

fn is_root(what: &str) -> bool {
    let is_root = rustix::process::geteuid().is_root();
    if !is_root {
        skip::test(what);
    }
    is_root
}

/// Writes an executable file.
fn file(folder: &tempfile::TempDir, name: &str, bytes: &[u8]) -> PathBuf {
    let path = folder.path().join(name);
    fs::write(&path, bytes).unwrap();
    fs::set_permissions(&path, fs::Permissions::from_mode(0o755)).unwrap();
    path
}

#[test]
fn a_program_is_found_as_exec_finds_it() {
    let folder = tempfile::tempdir().unwrap();
    let rack = bench().rack;
    let check = |command: &Command| program::check(&rack, command);
    let good = file(&folder, "good", b"\x7fELF");
    let script = file(&folder, "script", b"#!/bin/sh\nexit 0");
    let text = file(&folder, "text", b"exit 0");
    for path in [good.as_path(), &script, &text, Path::new("sh")] {
        check(&Command::new(path)).unwrap();
    }
    // The program's own PATH and folder count, not this process's.
    let mut command = Command::new("good");
    command.env("PATH", folder.path());
    check(&command).unwrap();
    let mut command = Command::new("./good");
    command.current_dir(folder.path());
    check(&command).unwrap();
    let mut command = Command::new("sh");
    command.env("PATH", folder.path());
    assert!(check(&command).is_err());
    for missing in [folder.path().join("nothing"), "no-such-program".into()] {
        let error = check(&Command::new(&missing)).unwrap_err();
        assert!(matches!(&error, RunError::ProgramNotFound(named) if Path::new(named) == missing));
        let text = error.to_string();
        assert!(
            text.starts_with("program not found: ") && text.contains("\nhint: "),
            "{text}"
        );
    }
    let error = bench().run(&mut Command::new("/dev/null")).unwrap_err();
    assert!(matches!(error, RunError::ProgramNotStarted(..)), "{error}");
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
         stream = libc.fopen(DEVICE.encode(), b'r+')\n\
         fcntl.ioctl(libc.fileno(ctypes.c_void_p(stream)), 0x0703, 0x69)\n\
         print(libc.fgetc(ctypes.c_void_p(stream)))\n\
         unbuffered = open(DEVICE, 'r+b', buffering=0)\n\
         fcntl.ioctl(unbuffered, 0x0703, 0x69)\n\
         unbuffered.write(b'\\x20')\n\
         print(unbuffered.read(2))\n\
         os.set_inheritable(f, True)\n\
         print(os.get_inheritable(f), os.get_inheritable(r))",
    );
    assert_eq!(
        said,
        "EEXIST ENOTDIR\nEBADF EBADF 1 b's'\nESPIPE b'z' ENOTTY\n129\nb'\\xe3\\xea'\nTrue False\n"
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

/// The kernel keeps account of descriptors: a file under the number that a device had is not mistaken for it.
#[test]
fn a_file_in_the_place_of_a_device_is_not_mistaken() {
    if !python_works() {
        return;
    }
    let said = bench().python(
        "fcntl.ioctl(f, 0x0703, 0x69)\n\
         assert os.read(f, 1) == b'\\x03' and f >= 64\n\
         plain = os.open('/etc/passwd', os.O_RDONLY)\n\
         os.dup2(plain, f)\n\
         print(os.read(f, 4), os.fstat(f).st_ino == os.fstat(plain).st_ino, os.lseek(f, 0, 0))\n\
         try: fcntl.ioctl(f, 0x0705, bytes(8))\n\
         except OSError as error: print(errno.errorcode[error.errno])",
    );
    assert_eq!(said, "b'root' True 0\nENOTTY\n");
}

/// dup2() to a number below those that the filter asks for: ioctls work, and read() and write() fail loudly.
#[test]
fn a_copy_under_a_low_number_serves_ioctls_only() {
    if !python_works() {
        return;
    }
    let said = bench().python(
        "os.dup2(f, 20)\n\
         fcntl.ioctl(20, 0x0703, 0x69)\n\
         f = 20\n\
         count, (_, read) = rdwr(f, [(0x69, 0, b'\\x10'), (0x69, 1, bytes(2))])\n\
         print(count, read)\n\
         for what in (lambda: os.read(20, 1), lambda: os.write(20, b'1'), lambda: os.pread(20, 1, 0)):\n\
         \x20   try: print(what())\n\
         \x20   except OSError as error: print(errno.errorcode[error.errno])",
    );
    assert_eq!(said, "2 b'sz'\nEBADF\nEBADF\nEBADF\n");
}

/// As i2c-dev, which has no poll(): always ready for select() and poll(), and not for epoll.
#[test]
fn select_and_poll_say_ready_and_epoll_refuses() {
    if !python_works() {
        return;
    }
    let said = bench().python(
        "import select\n\
         print(f < 1024, select.select([f], [f], [], 5) == ([f], [f], []))\n\
         poll = select.poll()\n\
         poll.register(f, select.POLLIN | select.POLLOUT)\n\
         print(poll.poll(5000) == [(f, select.POLLIN | select.POLLOUT)])\n\
         try: select.epoll().register(f)\n\
         except OSError as error: print(errno.errorcode[error.errno])\n\
         print(fcntl.fcntl(f, fcntl.F_GETFL) & 3 == os.O_RDWR)",
    );
    assert_eq!(said, "True True\nTrue\nEPERM\nTrue\n");
}

/// A program of its own filter, like a sandboxed daemon: this one forbids socket() (41) and is else as before. A second
/// supervisor is what Linux refuses.
#[test]
#[cfg(target_arch = "x86_64")]
fn a_program_may_install_a_filter_of_its_own() {
    if !python_works() {
        return;
    }
    let said = bench().python(
        "import struct, socket\n\
         libc = ctypes.CDLL(None, use_errno=True)\n\
         steps = [(0x20, 0, 0, 0), (0x15, 0, 1, 41), (0x06, 0, 0, 0x00050001), (0x06, 0, 0, 0x7fff0000)]\n\
         code = ctypes.create_string_buffer(b''.join(struct.pack('HBBI', *step) for step in steps))\n\
         program = ctypes.create_string_buffer(struct.pack('HxxxxxxQ', len(steps), ctypes.addressof(code)))\n\
         assert libc.prctl(38, 1, 0, 0, 0) == 0\n\
         listener = libc.syscall(317, 1, 8, program)\n\
         print(listener, errno.errorcode[ctypes.get_errno()])\n\
         assert libc.syscall(317, 1, 0, program) == 0\n\
         try: socket.socket()\n\
         except OSError as error: print(errno.errorcode[error.errno])\n\
         g = os.open(DEVICE, os.O_RDWR)\n\
         fcntl.ioctl(g, 0x0703, 0x69)\n\
         print(os.read(g, 1))",
    );
    assert_eq!(said, "-1 EBUSY\nEPERM\nb'\\x03'\n");
}

/// One program has one supervisor: an emulator inside another says so before it starts anything.
#[test]
fn an_emulator_under_an_emulator_says_why_it_cannot_be() {
    let mut command = Command::new(std::env::current_exe().unwrap());
    command.args(["--exact", "helper_process", "--nocapture"]);
    command.env(ROLE, "nested");
    let (status, said) = bench().outcome(&mut command);
    assert!(status.success(), "{said}");
    assert!(
        said.contains("system calls are already answered by a supervisor"),
        "{said}"
    );
    assert!(said.contains("--via socket"), "{said}");
}

const ROLE: &str = "I2C_EMULATION_TEST_ROLE";

/// Not a test itself: others start it.
#[test]
fn helper_process() {
    let Ok(role) = std::env::var(ROLE) else {
        return;
    };
    let bench = bench();
    let script = bench.script(
        "fcntl.ioctl(f, 0x0703, 0x69)\nos.write(f, b'\\x10')\n\
         print('\\nprogram: user', os.getuid(), 'read', os.read(f, 1).hex(), flush=True)\nos._exit(5)",
    );
    let mut command = Command::new("python3");
    command.args(["-c", &script]);
    match role.as_str() {
        "no program" => command = Command::new("/no/such/program"),
        "no folder" => {
            command.current_dir("/no-such-folder");
        }
        program if program.starts_with('/') => command = Command::new(program),
        _ => {}
    }
    match bench.run(&mut command) {
        Ok(ended) => println!("exit {}", ended.status.code().unwrap()),
        Err(error) => println!("{error}"),
    }
}

/// As in a container: root without any of its rights but those on files.
#[test]
fn without_root_and_without_its_rights_everything_works() {
    if !python_works() || !is_root("an emulator of another user: only root can start one") {
        return;
    }
    let test = std::env::current_exe().unwrap();
    let helper = |role: &str, setpriv: &[&str]| {
        let output = Command::new("setpriv")
            .args(setpriv)
            .arg(&test)
            .args([
                "--exact",
                "helper_process",
                "--nocapture",
                "--test-threads=1",
            ])
            .env(ROLE, role)
            .output()
            .unwrap();
        let (said, erred) = (output.stdout, output.stderr);
        format!(
            "{}{}",
            String::from_utf8_lossy(&said),
            String::from_utf8_lossy(&erred)
        )
    };
    let nobody: &[&str] = &["--reuid=65534", "--regid=65534", "--clear-groups"];
    let bare: &[&str] = &["--bounding-set=-all", "--inh-caps=-all"];
    for (user, setpriv) in [("65534", nobody), ("0", bare)] {
        let said = helper("read once", setpriv);
        assert!(
            said.contains(&format!("program: user {user} read 73")),
            "{said}"
        );
        assert!(said.contains("exit 5"), "{said}");
        for (wrong, error) in [
            ("no program", "program not found: /no/such/program"),
            ("no folder", "program not found: python3"),
        ] {
            let said = helper(wrong, setpriv);
            assert!(said.contains(error), "{wrong}: {said}");
        }
    }
}

#[test]
fn transfers_of_every_size_arrive() {
    if !python_works() {
        return;
    }
    let said = bench().python(
            "count, (_, big) = rdwr(f, [(0x69, 0, b'\\x00'), (0x69, 1, bytes(8192))])\n\
             assert big == bytes((n * 7 + 3) & 255 for n in range(8192))\n\
             messages = [(0x69, 0, bytes([n]) + bytes(range(200))) for n in range(40)] + [(0x69, 0, b'\\x00'), (0x69, 1, bytes(256))]\n\
             count, buffers = rdwr(f, messages)\n\
             assert count == 42 and buffers[-1][39:239] == bytes(range(200)), buffers[-1]\n\
             fcntl.ioctl(f, 0x0703, 0x69)\n\
             assert os.write(f, b'\\x10' + bytes(255) + bytes(5000)) == 5256\n\
             print('done')",
    );
    assert_eq!(said, "done\n");
}

#[test]
fn two_buses_are_there_at_once() {
    if !python_works() {
        return;
    }
    let (mut bench, second) = (bench(), bench());
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
    assert_eq!(said, "b'\\x01' b'\\x02'\n");
    assert_eq!(
        (bench.chip.values()[0x10], second.chip.values()[0x10]),
        (1, 2)
    );
}

#[test]
fn the_devices_that_were_opened_are_counted() {
    let bench = bench();
    let opens = |script: String| {
        let ended = bench.run(Command::new("sh").args(["-c", &script])).unwrap();
        assert!(ended.status.success());
        ended.opens
    };
    let device = bench.device();
    let device = device.display();
    assert_eq!(opens("true".to_owned()), 0);
    assert_eq!(opens(format!("exec 3<>{device}; exec 4<>{device}")), 2);
}

/// Without CAP_SYS_ADMIN, programs under a filter gain no rights; with it they do.
#[test]
fn a_program_that_gains_rights_is_named_where_it_would_not() {
    if !is_root("a set-user-ID program: only root can make one") {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    fs::set_permissions(folder.path(), fs::Permissions::from_mode(0o755)).unwrap();
    let program = folder.path().join("id");
    fs::copy("/usr/bin/id", &program).unwrap();
    fs::set_permissions(&program, fs::Permissions::from_mode(0o4755)).unwrap();
    let bench = bench();
    let (status, said) = bench.outcome(Command::new(&program).arg("-u").uid(NOBODY).gid(NOBODY));
    assert!(status.success());
    assert_eq!(
        said, "65534\n",
        "its own process asked for the filter, without rights"
    );

    let test = std::env::current_exe().unwrap();
    let output = Command::new(test)
        .args([
            "--exact",
            "helper_process",
            "--nocapture",
            "--test-threads=1",
        ])
        .env(ROLE, program.to_str().unwrap())
        .uid(NOBODY)
        .gid(NOBODY)
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&output.stdout);
    assert!(said.contains("gains rights when it starts"), "{said}");
}

/// The emulator may be root while the program is not.
#[test]
fn a_program_that_runs_as_another_user_may_use_the_device() {
    if !python_works() || !is_root("a program of another user: only root can start one") {
        return;
    }
    let bench = bench();
    let script =
        bench.script("fcntl.ioctl(f, 0x0703, 0x69)\nprint(os.getuid(), os.read(f, 1).hex())");
    let mut command = Command::new("python3");
    command.args(["-c", &script]).uid(NOBODY).gid(NOBODY);
    let (status, said) = bench.outcome(&mut command);
    assert!(status.success(), "{said}");
    assert_eq!(said, "65534 03\n");
}

/// A process-number namespace and a network of its own, and an empty environment.
#[test]
fn children_in_namespaces_of_their_own_reach_the_device() {
    if !python_works() || !is_root("namespaces: only root can make them everywhere") {
        return;
    }
    let bench = bench();
    let script =
        bench.script("fcntl.ioctl(f, 0x0703, 0x69)\nprint(os.getpid(), os.read(f, 1).hex())");
    let arguments = [
        "--pid",
        "--fork",
        "--net",
        "env",
        "-i",
        "/usr/bin/env",
        "python3",
        "-c",
    ];
    let said = bench.output(Path::new("unshare"), &[&arguments[..], &[&script]].concat());
    assert_eq!(said, "1 03\n");
}

#[test]
fn only_the_program_sees_the_device() {
    let bench = bench();
    let device = bench.device().display().to_string();
    let script = format!(
        "test -c {device} && test -c /dev/null && test -d /dev/pts && echo text > /dev/null && ls /dev"
    );
    let seen = bench.output(Path::new("sh"), &["-c", &script]);
    let mut outside: Vec<String> = fs::read_dir("/dev")
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    outside.sort_unstable();
    let mut seen: Vec<&str> = seen.lines().collect();
    seen.sort_unstable();
    assert_eq!(seen, outside);
    assert!(!bench.device().exists());
}

#[test]
fn a_file_that_exists_is_covered_and_comes_back() {
    if !python_works() || !is_root("a file in /dev: only root can make one") {
        return;
    }
    let bench = bench();
    let device = bench.device();
    fs::write(&device, "as before").unwrap();
    let script = bench.script("fcntl.ioctl(f, 0x0703, 0x69)\nassert os.read(f, 1) == b'\\x03'");
    let mut command = Command::new("python3");
    let ended = program::run(&bench.rack, &bench.options, command.args(["-c", &script]));
    let after = fs::read_to_string(&device).unwrap();
    fs::remove_file(&device).unwrap();
    assert!(ended.unwrap().status.success());
    assert_eq!(after, "as before");
}

/// What the user set for the program stays as it is, and so does the command.
#[test]
fn the_programs_environment_is_its_own() {
    let bench = bench();
    let mut command = Command::new("env");
    command.env_clear().env("LD_PRELOAD", "libm.so.6");
    let (status, said) = bench.outcome(&mut command);
    assert!(status.success());
    assert_eq!(said, "LD_PRELOAD=libm.so.6\n");
}

#[test]
fn a_bus_that_cannot_fail_needs_no_error_type_of_its_own() {
    struct Silent;
    impl ErrorType for Silent {
        type Error = Infallible;
    }
    impl I2c for Silent {
        fn transaction(
            &mut self,
            _: SevenBitAddress,
            _: &mut [Operation<'_>],
        ) -> Result<(), Infallible> {
            Ok(())
        }
    }
    let _ = HalAdapter::with_faults(Silent, |never| match *never {});
    assert_eq!(Fault::Timeout.fault(), Fault::Timeout);
}
