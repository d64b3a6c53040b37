//! Pages that a reader follows step by step: their files and commands are run in turn, in one shell, and what is printed is
//! compared with what the page prints.
//!
//! A block with `console run` behind its fence has commands behind `$`, each with what it prints; `…` stands for any text. A
//! block whose fence has a language and a file's name is that file. With `GRIDEYE_PICTURES=1` the page is written with what
//! is printed now, and its pictures with it.

use crate::programs::{folder, root, run};
use std::ffi::OsStr;
use std::fmt::Write as _;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Behind what a command prints.
const END: char = '\u{1E}';
const END_OF_FILE: &str = "END-OF-THE-FILE";

/// What a reader does next.
enum Step<'p> {
    Write(&'p str, &'p str),
    /// The command, and where the page shows what it prints.
    Run(&'p str, Range<usize>),
}

/// A page, and the folder in which it is followed.
pub struct Walkthrough {
    page: PathBuf,
    text: String,
    here: tempfile::TempDir,
}

/// Whether this run writes the documents' pictures and outputs.
#[must_use]
pub fn are_written() -> bool {
    std::env::var_os("GRIDEYE_PICTURES").is_some()
}

/// Whether a text is what the page shows, in which `…` stands for any text.
#[must_use]
pub fn is_shown(printed: &str, shown: &str) -> bool {
    let mut pieces = shown.split('…');
    let first = pieces.next().unwrap_or_default();
    let Some(mut rest) = printed.strip_prefix(first) else {
        return false;
    };
    let Some(last) = pieces.next_back() else {
        return rest.is_empty();
    };
    for piece in pieces {
        match rest.split_once(piece) {
            Some((_, behind)) => rest = behind,
            None => return false,
        }
    }
    rest.ends_with(last)
}

impl Walkthrough {
    /// A page of the repository.
    ///
    /// # Panics
    /// When it cannot be read.
    #[must_use]
    pub fn of(page: &str) -> Self {
        let page = root().join(page);
        let text = std::fs::read_to_string(&page).unwrap();
        let here = tempfile::tempdir().unwrap();
        Self { page, text, here }
    }

    /// Whether a document is such a page.
    #[must_use]
    pub fn is_one(text: &str) -> bool {
        text.contains("\n```console run\n")
    }

    /// The folder in which the reader begins.
    #[must_use]
    pub fn here(&self) -> &Path {
        self.here.path()
    }

    /// The names of the pictures that stand beside the page.
    #[must_use]
    pub fn pictures(&self) -> Vec<&str> {
        let links = self.text.split("](").skip(1);
        let links = links.filter_map(|rest| Some(rest.split_once(')')?.0));
        let is_picture = |link: &&str| [".png", ".svg"].iter().any(|end| link.ends_with(end));
        links.filter(is_picture).collect()
    }

    /// Where a picture of the page is kept.
    #[must_use]
    pub fn kept(&self, picture: &str) -> PathBuf {
        self.page.with_file_name(picture)
    }

    /// The text of the last file of this name.
    #[must_use]
    pub fn file(&self, wanted: &str) -> Option<&str> {
        let steps = self.steps().into_iter().rev();
        steps
            .filter_map(|step| match step {
                Step::Write(name, text) if name == wanted => Some(text),
                _ => None,
            })
            .next()
    }

    /// Whether this is one of its commands.
    #[must_use]
    pub fn runs(&self, wanted: &str) -> bool {
        let steps = self.steps();
        steps
            .iter()
            .any(|step| matches!(step, Step::Run(command, _) if *command == wanted))
    }

    fn steps(&self) -> Vec<Step<'_>> {
        let mut steps = Vec::new();
        let mut at = 0;
        while let Some(begin) = self.text[at..].find("\n```").map(|found| at + found + 4) {
            let opened = self.text[begin..].split('\n').next().unwrap_or_default();
            let inside = begin + opened.len() + 1;
            let end = self.text[inside - 1..].find("\n```");
            let end = end.map_or(self.text.len(), |found| inside + found);
            match opened.split_once(' ') {
                Some(("console", "run")) => steps.extend(self.commands(inside..end)),
                Some((_, name)) if name.contains('.') => {
                    steps.push(Step::Write(name, &self.text[inside..end]));
                }
                _ => {}
            }
            at = end + 3;
        }
        steps
    }

    fn commands(&self, block: Range<usize>) -> Vec<Step<'_>> {
        let mut steps: Vec<Step<'_>> = Vec::new();
        let mut at = block.start;
        for line in self.text[block].split_inclusive('\n') {
            let end = at + line.len();
            match (line.strip_prefix("$ "), steps.last_mut()) {
                (Some(command), _) => steps.push(Step::Run(command.trim_end(), end..end)),
                (None, Some(Step::Run(_, shown))) => shown.end = end,
                (None, _) => panic!("{}: no command prints {line}", self.page.display()),
            }
            at = end;
        }
        steps
    }

    fn script(&self) -> String {
        let mut script = "exec 2>&1\n".to_owned();
        for step in self.steps() {
            let written = match step {
                Step::Write(name, text) => writeln!(
                    script,
                    "mkdir -p \"$(dirname '{name}')\"; cat > '{name}' <<'{END_OF_FILE}'\n{text}{END_OF_FILE}"
                ),
                Step::Run(command, _) => writeln!(script, "{command}\nprintf '{END}'"),
            };
            written.unwrap();
        }
        script
    }

    /// Follows the page with these folders in front of `PATH` and this as `$GRIDEYE`, and compares what is printed, and the
    /// pictures that are made.
    ///
    /// # Panics
    /// When something else is printed or drawn.
    pub fn follow(&self, programs: &[&Path], checkout: &Path) {
        let printed = self.run(programs, checkout);
        let mut outputs = printed.split(END);
        let is_command = |step: &Step<'_>| matches!(step, Step::Run(..));
        let commands = self.steps().into_iter().filter(is_command).count();
        // Whatever ended the shell is printed last.
        assert_eq!(printed.matches(END).count(), commands, "{printed}");
        let mut written = self.text.clone();
        // From the end, so that the places before keep.
        let mut differ = Vec::new();
        for step in self.steps() {
            let Step::Run(command, place) = step else {
                continue;
            };
            let printed = outputs.next().unwrap_or_default();
            let shown = &self.text[place.clone()];
            if !is_shown(printed.trim_end(), shown.trim_end()) {
                differ.push((command, printed.trim_end().to_owned() + "\n", place));
            }
        }
        if are_written() {
            for (_, printed, place) in differ.iter().rev() {
                written.replace_range(place.clone(), printed.trim_start_matches('\n'));
            }
            std::fs::write(&self.page, written).unwrap();
        } else if let Some((command, printed, place)) = differ.first() {
            panic!(
                "{}: {command}\nprints:\n{printed}\nThe page shows:\n{}\nhint: GRIDEYE_PICTURES=1 writes what is printed now: read the difference",
                self.page.display(),
                &self.text[place.clone()]
            );
        }
        self.keep_or_compare_pictures();
    }

    /// Runs the page's commands; what they print, with U+001E behind each.
    ///
    /// # Panics
    /// When there is no shell.
    #[must_use]
    pub fn run(&self, programs: &[&Path], checkout: &Path) -> String {
        let path = std::env::var_os("PATH").unwrap_or_default();
        let programs = programs.iter().copied().chain([folder()]);
        let first = programs.flat_map(|folder| [folder.as_os_str(), OsStr::new(":")]);
        let mut all: std::ffi::OsString = first.collect();
        all.push(path);
        let ended = run(Command::new("bash")
            .args(["-c", &self.script()])
            .current_dir(self.here())
            .env("PATH", all)
            .env("GRIDEYE", checkout));
        ended.stdout
    }

    /// Those that the commands have made; browsers' tests make the others.
    fn keep_or_compare_pictures(&self) {
        for picture in self.pictures() {
            let Ok(now) = std::fs::read(self.here().join(picture)) else {
                continue;
            };
            if are_written() {
                std::fs::write(self.kept(picture), now).unwrap();
                continue;
            }
            let kept = std::fs::read(self.kept(picture)).unwrap();
            assert!(
                kept == now,
                "{picture} is drawn otherwise now; look at it and run this test with GRIDEYE_PICTURES=1"
            );
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_ellipsis_stands_for_any_text_and_nothing_else_differs() {
        assert!(is_shown("2 passed in 0.05s", "2 passed in …s"));
        assert!(is_shown("a\nb\nc\nd", "a\n…\nd"));
        assert!(is_shown("", ""));
        for (printed, shown) in [
            ("3 passed in 0.05s", "2 passed in …s"),
            ("a\nd", "a"),
            ("a", "a\nd"),
            ("a\nb\nc", "…\nd"),
            ("a b", "…b …"),
        ] {
            assert!(!is_shown(printed, shown), "{printed} is not {shown}");
        }
    }
}
