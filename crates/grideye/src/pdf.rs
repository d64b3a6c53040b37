//! A page as a PDF file, printed by a browser that is installed.

use crate::exit::bad_input;
use crate::{files, progress};
use anyhow::{Context as _, Result, anyhow, bail};
use std::ffi::OsString;
use std::fs;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// Names that Chromium and its relatives are installed under, in the order they are looked for.
const BROWSERS: [&str; 5] = [
    "chromium",
    "chromium-browser",
    "google-chrome",
    "google-chrome-stable",
    "chrome",
];
/// Longer than that, no page takes.
const PRINTING_MAX: Duration = Duration::from_secs(120);
const LOOK_EVERY: Duration = Duration::from_millis(50);

/// Prints the page into a file.
pub(crate) fn write(path: &Path, html: &str) -> Result<()> {
    let browser = browser(std::env::var_os("PATH")).ok_or_else(|| {
        bad_input(anyhow!(
            "--pdf needs a browser, and none of {} is installed\nhint: apt-get install chromium, or write --report FILE.html and print it from any browser",
            BROWSERS.join(", ")
        ))
    })?;
    let folder = scratch(path)?;
    let printed = print(&browser, &folder, html);
    let written = printed.and_then(|pdf| {
        files::write_whole(path, |out| Ok(out.write_all(&pdf)?))?;
        progress::say(&format!("wrote {}", path.display()));
        Ok(())
    });
    // What is left of a scratch folder is no reason to fail.
    drop(fs::remove_dir_all(&folder));
    written
}

/// A folder of its own beside the result, where a browser may write.
fn scratch(path: &Path) -> Result<PathBuf> {
    let mut name = OsString::from(".");
    name.push(path.file_name().unwrap_or_default());
    name.push(format!(".{}.printing", std::process::id()));
    let folder = path.with_file_name(name);
    fs::create_dir(&folder).with_context(|| format!("cannot create {}", folder.display()))?;
    fs::canonicalize(&folder).with_context(|| format!("cannot find {}", folder.display()))
}

fn print(browser: &Path, folder: &Path, html: &str) -> Result<Vec<u8>> {
    let (page, pdf) = (folder.join("page.html"), folder.join("page.pdf"));
    fs::write(&page, html)?;
    let mut command = Command::new(browser);
    command
        .args(["--headless", "--disable-gpu", "--no-pdf-header-footer"])
        .arg(with_path("--user-data-dir=", &folder.join("user")))
        .arg(with_path("--print-to-pdf=", &pdf))
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::null());
    if rustix::process::geteuid().is_root() {
        // Chromium does not start as root with its sandbox; the page is our own and holds no script.
        command.arg("--no-sandbox");
    }
    let mut child = command
        .arg(&page)
        .spawn()
        .with_context(|| format!("cannot start {}", browser.display()))?;
    waited(&mut child, browser)?;
    let bytes = fs::read(&pdf).unwrap_or_default();
    if !bytes.starts_with(b"%PDF-") {
        bail!(
            "{} has printed nothing\nhint: write --report FILE.html and print it from a browser",
            browser.display()
        );
    }
    Ok(bytes)
}

fn with_path(option: &str, path: &Path) -> OsString {
    let mut argument = OsString::from(option);
    argument.push(path);
    argument
}

fn waited(child: &mut Child, browser: &Path) -> Result<()> {
    let begun = Instant::now();
    while child.try_wait()?.is_none() {
        if begun.elapsed() > PRINTING_MAX {
            child.kill()?;
            child.wait()?;
            bail!(
                "{} took longer than {} s to print\nhint: write --report FILE.html and print it from a browser",
                browser.display(),
                PRINTING_MAX.as_secs()
            );
        }
        std::thread::sleep(LOOK_EVERY);
    }
    Ok(())
}

/// The first browser that a search path holds.
fn browser(path: Option<OsString>) -> Option<PathBuf> {
    let folders: Vec<PathBuf> = std::env::split_paths(&path?).collect();
    BROWSERS.iter().find_map(|name| {
        folders
            .iter()
            .map(|folder| folder.join(name))
            .find(|candidate| candidate.is_file())
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_browser_on_the_path_is_taken() {
        let (one, two) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
        let path = std::env::join_paths([one.path(), two.path()]).unwrap();
        assert_eq!(browser(Some(path.clone())), None);
        assert_eq!(browser(None), None);
        fs::write(two.path().join("google-chrome"), "").unwrap();
        assert_eq!(
            browser(Some(path.clone())),
            Some(two.path().join("google-chrome"))
        );
        fs::write(two.path().join("chromium"), "").unwrap();
        assert_eq!(browser(Some(path)), Some(two.path().join("chromium")));
    }
}
