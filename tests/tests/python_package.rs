//! The Python package as people get it: the wheel, installed into an environment in which nothing else is and that knows
//! no Rust, and its own suite run there.

#![expect(clippy::unwrap_used, reason = "what fails in a helper fails the test")]

use grideye_tests::programs::{Ended, folder, root, run, target};
use grideye_tests::python;
use std::path::{Path, PathBuf};
use std::process::Command;

/// The most that a wheel may have.
const WHEEL_BYTES_MAX: u64 = 15 << 20;
/// What was asked for; the socket gives about 31,000 transactions a second.
const READS_PER_SECOND_MIN: f64 = 20_000.0;

fn crate_folder() -> PathBuf {
    root().join("crates/grideye-python").canonicalize().unwrap()
}

fn succeeded(command: &mut Command) -> Ended {
    let ended = run(command);
    assert_eq!(ended.code, 0, "{command:?}: {ended:?}");
    ended
}

/// A new environment with the wheel in it, beside the packages that it meets in the tests; the wheel's path.
fn installed(at: &Path, packages: &Path) -> PathBuf {
    let script = root().join("firmware-config/wheel");
    let out = at.join("wheels");
    let packed = succeeded(Command::new(script).arg("--from").args([folder(), &out]));
    let python = packages.join("python");
    let new = at.join("environment");
    succeeded(
        Command::new(&python)
            .args(["-m", "venv", "--without-pip"])
            .arg(&new),
    );
    let wheel = PathBuf::from(packed.stdout.trim());
    let mut install = Command::new(&python);
    install.args(["-m", "pip", "--python"]);
    install.arg(new.join("bin/python"));
    install.args(["install", "--quiet", "--no-deps", "--no-index"]);
    succeeded(install.arg(&wheel));
    let site = |python: &Path| {
        let code = "import sysconfig; print(sysconfig.get_path('purelib'))";
        let ended = succeeded(Command::new(python).args(["-c", code]));
        PathBuf::from(ended.stdout.trim())
    };
    let beside = site(&python).display().to_string();
    let own = site(&new.join("bin/python"));
    std::fs::write(own.join("beside.pth"), beside).unwrap();
    wheel
}

/// A command in that environment, with no Rust in its path.
fn python(at: &Path) -> Command {
    let mut command = Command::new(at.join("environment/bin/python"));
    command.env("PATH", "/usr/bin:/bin").current_dir(at);
    command.env_remove("PYTHONPATH");
    command.env("GRIDEYE_MYPY_CACHE", target().join("mypy"));
    command
}

#[test]
fn the_wheel_installs_without_rust_and_its_suite_passes() {
    let requirements = "crates/grideye-python/tests/requirements.txt";
    let Some(packages) = python::programs("wheel-python", requirements, "the Python package")
    else {
        return;
    };
    let at = tempfile::tempdir().unwrap();
    let wheel = installed(at.path(), &packages);
    let bytes = std::fs::metadata(&wheel).unwrap().len();
    assert!(bytes <= WHEEL_BYTES_MAX, "{bytes} bytes");
    let program = at.path().join("environment/bin/grideye");
    assert!(
        succeeded(Command::new(program).arg("--version"))
            .stdout
            .starts_with("grideye ")
    );
    let suite = crate_folder().join("tests");
    let pytest = [
        "-m",
        "pytest",
        "-q",
        "-p",
        "no:cacheprovider",
        "--durations=5",
    ];
    let ended = run(python(at.path()).args(pytest).arg(suite));
    assert_eq!(ended.code, 0, "{}{}", ended.stdout, ended.stderr);
    assert!(ended.stdout.contains(" passed"), "{ended:?}");
    println!("{bytes} bytes\n{}", ended.stdout);
    let bench = crate_folder().join("benches/frames.py");
    let told = succeeded(python(at.path()).arg(bench)).stdout;
    println!("{told}");
    let reads: f64 = told.split(' ').next().unwrap().parse().unwrap();
    assert!(reads >= READS_PER_SECOND_MIN, "{told}");
}
