//! A collector with TLS and tokens, and commands against it.

use grideye_tests::programs::{Ended, grideye, grideye_agent, run};
use std::io::{BufRead as _, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Stdio};

/// A collector with TLS and tokens, and the folder of all files.
pub(crate) struct Site {
    pub(crate) at: tempfile::TempDir,
    collector: Child,
    pub(crate) url: String,
}

impl Site {
    pub(crate) fn new() -> Self {
        Self::with(&[])
    }

    /// With more options for the collector.
    pub(crate) fn with(options: &[&str]) -> Self {
        let at = tempfile::tempdir().unwrap();
        let made = run(grideye()
            .args(["token", "make", "boss", "--scope", "admin", "--access"])
            .arg(at.path().join("access"))
            .arg("--out")
            .arg(at.path().join("boss.token")));
        assert_eq!(made.code, 0, "{made:?}");
        let mut collector = grideye()
            .args([
                "collect",
                "--listen",
                "127.0.0.1:0",
                "--tls",
                "--log",
                "json",
            ])
            .arg("--store")
            .arg(at.path().join("frames.sqlite"))
            .arg("--access")
            .arg(at.path().join("access"))
            .args(options)
            .stdout(Stdio::piped())
            .stderr(std::fs::File::create(at.path().join("collector.log")).unwrap())
            .spawn()
            .unwrap();
        let mut line = String::new();
        let stdout = collector.stdout.take().unwrap();
        BufReader::new(stdout).read_line(&mut line).unwrap();
        assert!(line.starts_with("https://127.0.0.1:"), "{line}");
        let url = line.trim().trim_end_matches('/').to_owned();
        Self { at, collector, url }
    }

    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.at.path().join(name)
    }

    pub(crate) fn grideye(&self, arguments: &[&str]) -> Ended {
        run(grideye()
            .args(arguments)
            .arg("--access")
            .arg(self.path("access")))
    }

    /// The line to paste.
    pub(crate) fn enroll(&self, device: &str) -> String {
        let enrolled = self.grideye(&["enroll", device]);
        assert_eq!(enrolled.code, 0, "{enrolled:?}");
        assert_eq!(enrolled.stdout.lines().count(), 1, "one line: {enrolled:?}");
        enrolled.stdout.trim().to_owned()
    }

    /// The code in such a line, as `--json` gives it.
    pub(crate) fn code(&self, device: &str) -> String {
        let enrolled = self.grideye(&["enroll", device, "--json"]);
        assert_eq!(enrolled.code, 0, "{enrolled:?}");
        let enrolled: serde_json::Value = serde_json::from_str(&enrolled.stdout).unwrap();
        let code = enrolled["code"].as_str().unwrap().to_owned();
        assert_eq!(
            enrolled["command"],
            format!("echo '{code}' | sudo grideye-agent join -")
        );
        assert_eq!(enrolled["devices"], serde_json::json!([device]));
        code
    }

    pub(crate) fn join(&self, line: &str) -> Ended {
        run(grideye_agent()
            .args(["join", line, "--out"])
            .arg(self.path("collector.toml")))
    }

    /// Runs a client command with the admin's token.
    pub(crate) fn client(&self, command: &str, more: &[&str]) -> Ended {
        run(grideye()
            .arg(command)
            .args(more)
            .args(["--collector", &self.url, "--token-file"])
            .arg(self.path("boss.token"))
            .arg("--authority")
            .arg(self.path("access/authority.pem")))
    }

    pub(crate) fn log(&self) -> String {
        std::fs::read_to_string(self.path("collector.log")).unwrap()
    }
}

impl Drop for Site {
    fn drop(&mut self) {
        // It may have ended already.
        let _ = self.collector.kill();
        let _ = self.collector.wait();
    }
}

pub(crate) fn mode(path: &Path) -> u32 {
    use std::os::unix::fs::PermissionsExt as _;
    std::fs::metadata(path).unwrap().permissions().mode() & 0o777
}
