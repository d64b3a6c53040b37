//! A real PostgreSQL of the tests' own: started once in each test program, stopped when that ends, however it ends.
//!
//! The collector's own tests compile this file as well.

use std::io::{BufRead as _, BufReader, Read as _};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::OnceLock;
use std::sync::atomic::{AtomicU32, Ordering};

/// Leaves out what needs PostgreSQL where it is not to be had.
pub const WITHOUT_POSTGRES: &str = "GRIDEYE_WITHOUT_POSTGRES";

/// A cluster; it stops when this is dropped, or with the program.
#[derive(Debug)]
pub struct Cluster {
    url: String,
    /// Its standard input is held open: the cluster lives as long.
    _child: Child,
}

/// The cluster that the tests of one program share, without syncs to disk; `None` if it is left out.
///
/// # Panics
/// When it does not start.
#[must_use]
pub fn shared(what: &str) -> Option<&'static Cluster> {
    static CLUSTER: OnceLock<Cluster> = OnceLock::new();
    if crate::skip::is_left_out(WITHOUT_POSTGRES, what) {
        return None;
    }
    Some(CLUSTER.get_or_init(|| Cluster::start(&["fsync=off"])))
}

impl Cluster {
    /// Starts a cluster with these settings, for example `fsync=off`.
    ///
    /// # Panics
    /// When it does not start.
    #[must_use]
    pub fn start(settings: &[&str]) -> Self {
        // From `tests/` and from `crates/grideye-collector/` alike.
        let package = Path::new(env!("CARGO_MANIFEST_DIR"));
        let scripts = ["postgres", "../../tests/postgres"].map(|script| package.join(script));
        let script = scripts.iter().find(|script| script.is_file()).unwrap();
        let mut child = Command::new(script)
            .args(settings)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let mut line = String::new();
        BufReader::new(child.stdout.take().unwrap())
            .read_line(&mut line)
            .unwrap();
        let mut said = String::new();
        if line.is_empty() {
            child
                .stderr
                .take()
                .unwrap()
                .read_to_string(&mut said)
                .unwrap();
        }
        assert!(
            line.starts_with("postgres://"),
            "{said}\nhint: apt-get install postgresql, or set {WITHOUT_POSTGRES}=1 to leave its tests out"
        );
        Self {
            url: line.trim().to_owned(),
            _child: child,
        }
    }

    /// The URL of a new, empty database, with the password.
    ///
    /// # Panics
    /// When it cannot be made.
    #[must_use]
    pub fn database(&self) -> String {
        static DATABASES: AtomicU32 = AtomicU32::new(0);
        let number = DATABASES.fetch_add(1, Ordering::Relaxed);
        let said = sql(&self.url, &format!("CREATE DATABASE d{number}"));
        assert!(
            said.is_empty() || said.contains("CREATE DATABASE"),
            "{said}"
        );
        let (server, _) = self.url.rsplit_once('/').unwrap();
        format!("{server}/d{number}")
    }
}

/// What `psql` answers: rows as lines, columns with `|` between them.
///
/// # Panics
/// When the database refuses.
#[must_use]
pub fn sql(url: &str, statement: &str) -> String {
    let ended = Command::new("psql")
        .args(["--no-psqlrc", "-qAtX", "-v", "ON_ERROR_STOP=1", "-c"])
        .arg(statement)
        .arg(url)
        .output()
        .unwrap();
    assert!(
        ended.status.success(),
        "{statement}: {}",
        String::from_utf8_lossy(&ended.stderr)
    );
    String::from_utf8_lossy(&ended.stdout).trim().to_owned()
}
