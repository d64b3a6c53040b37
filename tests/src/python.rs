//! Python programs from PyPI, drivers and peers, each kind in an environment of its own.

use crate::programs::{folder, is_left_out, root, run, target};
use std::fs::Permissions;
use std::os::unix::fs::PermissionsExt as _;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;

/// Leaves out the Python drivers where neither they nor PyPI can be reached.
pub const WITHOUT_PYTHON_DRIVERS: &str = "GRIDEYE_WITHOUT_PYTHON_DRIVERS";

/// Leaves out what is measured and checked beside us where neither it nor PyPI can be reached.
pub const WITHOUT_PEERS: &str = "GRIDEYE_WITHOUT_PEERS";

/// Leaves out the real Home Assistant where neither it nor PyPI can be reached.
pub const WITHOUT_HOME_ASSISTANT: &str = "GRIDEYE_WITHOUT_HOME_ASSISTANT";

/// A command that runs the real Home Assistant, `tests/home_assistant/home.py`, or `None` if it is left out.
///
/// # Panics
/// When it cannot be installed.
#[must_use]
pub fn home_assistant(arguments: &[&str], what: &str) -> Option<Command> {
    if is_left_out(WITHOUT_HOME_ASSISTANT, what) {
        return None;
    }
    let folder = environment(
        "home-assistant",
        "tests/home_assistant/requirements.txt",
        WITHOUT_HOME_ASSISTANT,
    );
    let mut command = Command::new(folder.join("bin/python"));
    command
        .arg(root().join("tests/home_assistant/home.py"))
        .args(arguments);
    Some(command)
}

/// A command that runs a script of `tests/peers`, or any by its whole path, with the packages of its `requirements.txt`, or `None` if they are left out.
///
/// # Panics
/// When they cannot be installed.
#[must_use]
pub fn peer(name: &str, arguments: &[&str], what: &str) -> Option<Command> {
    static ENVIRONMENT: OnceLock<PathBuf> = OnceLock::new();
    if is_left_out(WITHOUT_PEERS, what) {
        return None;
    }
    let folder = ENVIRONMENT
        .get_or_init(|| environment("peers", "tests/peers/requirements.txt", WITHOUT_PEERS));
    let mut command = Command::new(folder.join("bin/python"));
    command
        .arg(root().join("tests/peers").join(name))
        .args(arguments);
    Some(command)
}

/// A command that runs a script of `tests/python` with the drivers of its `requirements.txt`, or `None` if they are left out.
///
/// # Panics
/// When they cannot be installed.
#[must_use]
pub fn script(name: &str, arguments: &[&str], what: &str) -> Option<Command> {
    static ENVIRONMENT: OnceLock<PathBuf> = OnceLock::new();
    if is_left_out(WITHOUT_PYTHON_DRIVERS, what) {
        return None;
    }
    let folder = ENVIRONMENT.get_or_init(|| {
        environment(
            "python",
            "tests/python/requirements.txt",
            WITHOUT_PYTHON_DRIVERS,
        )
    });
    let mut command = Command::new(folder.join("bin/python"));
    command
        .arg(root().join("tests/python").join(name))
        .args(arguments);
    Some(command)
}

/// The folder of the programs of an environment with these requirements, or `None` if they are left out.
///
/// # Panics
/// When they cannot be installed.
#[must_use]
pub fn programs(name: &str, requirements: &str, what: &str) -> Option<PathBuf> {
    if is_left_out(WITHOUT_PYTHON_DRIVERS, what) {
        return None;
    }
    Some(environment(name, requirements, WITHOUT_PYTHON_DRIVERS).join("bin"))
}

/// The packages of PyPI beside which the wheel is installed.
pub const BESIDE_THE_WHEEL: &str = "crates/grideye-python/tests/requirements.txt";

/// Packs this build's wheel and installs it into a new environment below `at`, in which nothing else is but a path to the
/// packages that it meets in tests. Returns the wheel and the folder of the environment's programs, or `None` if Python's
/// packages are left out.
///
/// # Panics
/// When it cannot be packed or installed.
#[must_use]
pub fn wheel(at: &Path, what: &str) -> Option<(PathBuf, PathBuf)> {
    let packages = programs("wheel-python", BESIDE_THE_WHEEL, what)?.join("python");
    let script = root().join("crates/grideye-python/wheel");
    let out = at.join("wheels");
    let packed = succeeded(Command::new(script).arg("--from").args([folder(), &out]));
    let wheel = PathBuf::from(packed.trim());
    let new = at.join("environment");
    let venv = ["-m", "venv", "--without-pip"];
    succeeded(Command::new(&packages).args(venv).arg(&new));
    let bin = new.join("bin");
    let mut install = Command::new(&packages);
    install
        .args(["-m", "pip", "--python"])
        .arg(bin.join("python"));
    install.args(["install", "--quiet", "--no-deps", "--no-index"]);
    succeeded(install.arg(&wheel));
    let site = |python: &Path| {
        let code = "import sysconfig; print(sysconfig.get_path('purelib'))";
        succeeded(Command::new(python).args(["-c", code]))
    };
    let own = PathBuf::from(site(&bin.join("python")).trim());
    std::fs::write(own.join("beside.pth"), site(&packages)).unwrap();
    // Its programs would start in the environment of the packages.
    let pytest = bin.join("pytest");
    let shebang = format!("#!{}", bin.join("python").display());
    let code = format!("{shebang}\nimport pytest, sys\nsys.exit(pytest.main())\n");
    std::fs::write(&pytest, code).unwrap();
    std::fs::set_permissions(&pytest, Permissions::from_mode(0o755)).unwrap();
    Some((wheel, bin))
}

fn succeeded(command: &mut Command) -> String {
    let ended = run(command);
    assert_eq!(ended.code, 0, "{command:?}: {ended:?}");
    ended.stdout
}

fn environment(folder: &str, requirements: &str, switch: &str) -> PathBuf {
    let path = target().join(folder);
    let mut set_up = Command::new(root().join("tests/python/set-up"));
    let ended = run(set_up.arg(&path).arg(root().join(requirements)));
    assert!(
        ended.code == 0,
        "the packages of {requirements} could not be installed: {ended:?}\n\
         hint: apt-get install python3-venv, or set {switch}=1 to leave them out"
    );
    path
}
