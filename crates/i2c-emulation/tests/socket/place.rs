//! The socket's file: who owns it, and that it is removed at the end.

use std::fs;
use std::io::{BufRead, BufReader};
use std::os::unix::fs::{FileTypeExt, MetadataExt, PermissionsExt};
use std::os::unix::net::{UnixListener, UnixStream};
use std::os::unix::process::{CommandExt, ExitStatusExt};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::Barrier;
use std::time::Duration;

use i2c_emulation::rack::{Rack, SharedAdapter};
use i2c_emulation::socket::{Options, PATH_BYTES_MAX, Server, SocketError};

use crate::bench::{Bench, Log, RegisterFile};
use crate::client::Client;

/// Tells [`role`] which socket to serve.
const ROLE: &str = "I2C_EMULATION_SOCKET_TEST_ROLE";

fn bind(path: &Path) -> Result<Server, SocketError> {
    let mut rack = Rack::new();
    rack.insert(1, SharedAdapter::new(RegisterFile::new(Log::default())));
    Server::bind(path, rack, Options::default())
}

fn entries(folder: &Path) -> Vec<PathBuf> {
    let mut names: Vec<PathBuf> = fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .collect();
    names.sort();
    names
}

/// A socket file without a server, as a killed server leaves it.
fn stale(path: &Path) {
    drop(UnixListener::bind(path).unwrap());
    assert!(path.exists());
}

#[test]
fn only_the_owner_may_connect_and_the_file_goes_with_the_server() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("bus.sock");
    let server = bind(&path).unwrap();
    let found = fs::symlink_metadata(&path).unwrap();
    assert!(found.file_type().is_socket());
    assert_eq!(found.permissions().mode() & 0o7777, 0o600);
    assert_eq!(entries(folder.path()), std::slice::from_ref(&path));
    drop(server);
    assert!(entries(folder.path()).is_empty(), "dropped without serving");

    let server = bind(&path).unwrap();
    let stop = server.stop_handle();
    stop.stop();
    stop.stop();
    server.serve();
    assert!(
        entries(folder.path()).is_empty(),
        "stopped before it served"
    );

    let mut bench = Bench::new(Options::default());
    let _client = Client::connect(&bench.path, 1).unwrap();
    bench.end();
    assert!(entries(bench.path.parent().unwrap()).is_empty(), "stopped");
}

#[test]
fn the_ready_line_names_path_buses_and_mode() {
    let bench = Bench::new(Options::default());
    let other = bench.path.with_file_name("other.sock");
    let server = bind(&other).unwrap();
    let expected = format!("listening on {} (bus 1, adapter mode pi)", other.display());
    assert_eq!(server.ready_line(), expected);
    assert_eq!(server.path(), other);
}

#[test]
fn a_live_server_keeps_its_socket() {
    let bench = Bench::new(Options::default());
    let error = bind(&bench.path).unwrap_err();
    let expected = format!(
        "{} is in use: another server answers or starts there\nhint: stop that server, or choose another path",
        bench.path.display()
    );
    assert_eq!(error.to_string(), expected);
    Client::connect(&bench.path, 1).unwrap();
    assert_eq!(entries(bench.path.parent().unwrap()).len(), 1);
}

#[test]
fn a_stale_file_is_taken_over() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("bus.sock");
    stale(&path);
    let _server = bind(&path).unwrap();
    UnixStream::connect(&path).unwrap();
    assert_eq!(entries(folder.path()), [path]);
}

/// Of many servers that start at once, one gets the path, and that one answers there.
#[test]
fn of_servers_that_start_at_once_one_wins() {
    const SERVERS: usize = 6;
    for round in 0..100 {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("bus.sock");
        if round % 2 == 0 {
            stale(&path);
        }
        let start = Barrier::new(SERVERS);
        let outcomes: Vec<Result<Server, SocketError>> = std::thread::scope(|scope| {
            let threads: Vec<_> = (0..SERVERS)
                .map(|_| {
                    scope.spawn(|| {
                        start.wait();
                        bind(&path)
                    })
                })
                .collect();
            threads
                .into_iter()
                .map(|thread| thread.join().unwrap())
                .collect()
        });
        let (winners, losers): (Vec<_>, Vec<_>) = outcomes.into_iter().partition(Result::is_ok);
        assert_eq!(winners.len(), 1, "{losers:?}");
        for loser in losers {
            let error = loser.unwrap_err();
            assert!(matches!(error, SocketError::InUse { .. }), "{error}");
        }
        UnixStream::connect(&path).unwrap();
        assert_eq!(entries(folder.path()), [path]);
    }
}

#[test]
fn another_kind_of_file_is_left_alone() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("notes.txt");
    fs::write(&file, "mine").unwrap();
    let link = folder.path().join("link");
    std::os::unix::fs::symlink(&file, &link).unwrap();
    for path in [
        file.as_path(),
        folder.path(),
        link.as_path(),
        Path::new("/"),
    ] {
        let error = bind(path).unwrap_err();
        assert!(
            matches!(error, SocketError::NotASocket { .. }),
            "{}: {error}",
            path.display()
        );
    }
    assert_eq!(fs::read_to_string(&file).unwrap(), "mine");
}

#[test]
fn a_missing_folder_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("file");
    fs::write(&file, "").unwrap();
    for missing in [folder.path().join("a/b"), file] {
        let error = bind(&missing.join("bus.sock")).unwrap_err();
        let expected = format!(
            "there is no folder {}\nhint: make it with `mkdir -p`, or choose another path",
            missing.display()
        );
        assert_eq!(error.to_string(), expected);
    }
}

#[test]
fn the_longest_path_works_and_one_byte_more_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let room = PATH_BYTES_MAX - folder.path().as_os_str().len() - 1;
    let longest = folder.path().join("x".repeat(room));
    let _server = bind(&longest).unwrap();
    UnixStream::connect(&longest).unwrap();
    let error = bind(&folder.path().join("x".repeat(room + 1))).unwrap_err();
    assert!(
        error
            .to_string()
            .starts_with("socket path is 108 bytes long, at most 107 are possible: /"),
        "{error}"
    );
}

#[test]
fn another_file_at_the_place_is_not_removed() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("bus.sock");
    let server = bind(&path).unwrap();
    fs::remove_file(&path).unwrap();
    fs::write(&path, "another's").unwrap();
    drop(server);
    assert_eq!(fs::read_to_string(&path).unwrap(), "another's");
}

/// Serves the socket named in the environment, in its own process; does nothing in an ordinary run.
#[test]
fn role() {
    let Some(path) = std::env::var_os(ROLE) else {
        return;
    };
    match bind(Path::new(&path)) {
        Ok(server) => {
            eprintln!("{}", server.ready_line());
            server.serve();
        }
        Err(error) => eprintln!("{error}"),
    }
}

/// This test program again, as [`role`].
fn server_process(path: &Path) -> Command {
    let mut command = Command::new(std::env::current_exe().unwrap());
    command
        .args(["--exact", "place::role", "--nocapture", "--test-threads=1"])
        .env(ROLE, path)
        .stdout(Stdio::null())
        .stderr(Stdio::piped());
    command
}

/// A server process that does not outlive a failed test.
struct Process(Child);

impl Process {
    /// Starts it and waits until clients can connect.
    fn start(command: &mut Command) -> Self {
        let mut process = Self(command.spawn().unwrap());
        let mut line = String::new();
        BufReader::new(process.0.stderr.take().unwrap())
            .read_line(&mut line)
            .unwrap();
        assert!(line.starts_with("listening on "), "{line}");
        process
    }

    fn kill(&mut self) {
        self.0.kill().unwrap();
        assert_eq!(self.0.wait().unwrap().signal(), Some(9));
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        // It may already have ended and been waited for.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

#[test]
fn after_sigkill_the_next_server_takes_over() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("bus.sock");
    let mut process = Process::start(&mut server_process(&path));
    let mut client = Client::connect(&path, 1).unwrap();
    assert!(matches!(bind(&path), Err(SocketError::InUse { .. })));

    process.kill();
    assert_eq!(
        entries(folder.path()),
        std::slice::from_ref(&path),
        "left behind"
    );
    assert!(embedded_hal::i2c::I2c::write(&mut client, 0x69, &[1]).is_err());
    drop(bind(&path).unwrap());
    assert!(entries(folder.path()).is_empty());
}

/// A server without free descriptors turns clients away, and accepts new ones once others leave.
#[test]
fn a_server_without_descriptors_recovers() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("bus.sock");
    let server = server_process(&path);
    let mut with_few = Command::new("sh");
    with_few
        .args(["-c", "ulimit -n 20 && exec \"$0\" \"$@\""])
        .arg(server.get_program())
        .args(server.get_args())
        .env(ROLE, &path)
        .stdout(Stdio::null())
        .stderr(Stdio::piped());
    let _process = Process::start(&mut with_few);
    let mut clients = vec![Client::connect(&path, 1).unwrap()];
    while let Ok(client) = Client::connect_within(&path, 1, Duration::from_secs(1)) {
        clients.push(client);
        assert!(clients.len() < 20, "more clients than descriptors");
    }
    drop(clients);
    Client::connect(&path, 1).unwrap();
}

/// Runs as another user if this one may do everything.
#[test]
fn a_folder_that_is_not_for_this_user_is_named() {
    let folder = tempfile::tempdir().unwrap();
    fs::set_permissions(folder.path(), fs::Permissions::from_mode(0o555)).unwrap();
    let path = folder.path().join("bus.sock");
    let mut command = server_process(&path);
    if fs::metadata("/proc/self").unwrap().uid() == 0 {
        // Other users may be unable to read the test program where it is.
        let copy = folder.path().join("program");
        fs::copy(std::env::current_exe().unwrap(), &copy).unwrap();
        let mut as_nobody = Command::new(copy);
        as_nobody
            .args(command.get_args())
            .env(ROLE, &path)
            .current_dir("/")
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .uid(65534);
        command = as_nobody;
    }
    let output = command.output().unwrap();
    let text = String::from_utf8(output.stderr).unwrap();
    let expected = format!(
        "not permitted to make {}: Permission denied",
        path.display()
    );
    assert!(text.contains(&expected), "{text}");
    assert!(
        text.contains("hint: choose a folder in which you may make files"),
        "{text}"
    );
    fs::set_permissions(folder.path(), fs::Permissions::from_mode(0o755)).unwrap();
}
