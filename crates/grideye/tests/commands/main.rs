//! What commands print, write and refuse, and what every command does with the files that it reads and writes: nothing that
//! is read is written over, nothing is written in part, and no text is read without end.
#![expect(clippy::unwrap_used, reason = "what fails in a helper fails the test")]

mod apart;
mod backgrounds;
mod calibrate;
mod characterize;
mod count;
mod coverage;
mod dataset;
mod in_view;
mod man;
mod palettes;
mod preset;
mod simulate;
mod streams;
mod texts;
mod whole;

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::OnceLock;

/// A room with somebody on a way that stands in a file of its own.
pub(crate) const ROOM: &str = "[room]\nsize_mm = [4000, 4000, 2700]\nambient_c = 20\n\
    [[agent]]\nname = \"ana\"\nsize_mm = [300, 500, 1700]\ntemperature_c = 30\n\
    trajectory = \"way.csv\"\nspeed_mm_per_s = 500\n\
    [[sensor]]\nname = \"ceiling\"\npreset = \"grid-eye\"\nposition_mm = [2000, 2000, 2700]\n\
    elevation_deg = 90\nazimuth_deg = 0\n";
pub(crate) const WAY: &str = "x_mm,y_mm,z_mm\n500,1000,0\n3500,1000,0\n";

/// A folder with one file of each kind that commands read.
pub(crate) struct Fixture {
    pub(crate) folder: tempfile::TempDir,
}

/// What a program printed, and how it ended.
#[derive(Debug)]
pub(crate) struct Ended {
    pub(crate) code: Option<i32>,
    pub(crate) stderr: String,
}

impl Fixture {
    pub(crate) fn new() -> Self {
        let fixture = Self {
            folder: tempfile::tempdir().unwrap(),
        };
        let shipped = |name: &str| {
            let scenes = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes");
            fs::read(scenes.join(name)).unwrap()
        };
        fixture.put("room.toml", ROOM);
        fixture.put("way.csv", WAY);
        fixture.put("profile.toml", shipped("profiles/ideal.toml"));
        let thresholds = "../grideye-validator/thresholds.toml";
        let thresholds = Path::new(env!("CARGO_MANIFEST_DIR")).join(thresholds);
        fixture.put("thresholds.toml", fs::read(thresholds).unwrap());
        fixture.put("faults.toml", "[[fault]]\nkind = \"hang\"\n");
        fixture.put("token", "grideye-12-34\n");
        fixture.put("authority.pem", "no certificate\n");
        // One for all desks.
        static RECORDING: OnceLock<Vec<u8>> = OnceLock::new();
        let recording = RECORDING.get_or_init(|| {
            let made = fixture.run(&["simulate", "room.toml", "--out", "recording.csv"]);
            assert_eq!(made.code, Some(0), "{made:?}");
            fs::read(fixture.path("recording.csv")).unwrap()
        });
        fixture.put("recording.csv", recording);
        fixture
    }

    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    pub(crate) fn put(&self, name: &str, text: impl AsRef<[u8]>) {
        fs::write(self.path(name), text).unwrap();
    }

    /// `grideye` with these arguments, in the folder.
    pub(crate) fn run(&self, arguments: &[impl AsRef<str>]) -> Ended {
        self.run_limited("", arguments)
    }

    /// The same in a shell that does this first.
    pub(crate) fn run_limited(&self, before: &str, arguments: &[impl AsRef<str>]) -> Ended {
        let output = Command::new("bash")
            .args(["-c", &format!("{before}\nexec \"$@\""), "bash"])
            .arg(env!("CARGO_BIN_EXE_grideye"))
            .args(arguments.iter().map(AsRef::as_ref))
            .current_dir(self.folder.path())
            .stdin(Stdio::null())
            .output()
            .unwrap();
        Ended {
            code: output.status.code(),
            stderr: String::from_utf8_lossy(&output.stderr).into_owned(),
        }
    }

    /// Everything in the folder, with what it holds.
    pub(crate) fn files(&self) -> BTreeMap<PathBuf, Vec<u8>> {
        let mut files = BTreeMap::new();
        let mut folders = vec![self.folder.path().to_owned()];
        while let Some(folder) = folders.pop() {
            for entry in fs::read_dir(folder).unwrap() {
                let path = entry.unwrap().path();
                if path.is_dir() {
                    folders.push(path);
                } else {
                    files.insert(path.clone(), fs::read(&path).unwrap());
                }
            }
        }
        files
    }
}
