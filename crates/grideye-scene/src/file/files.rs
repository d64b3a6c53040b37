//! The files that a scene names: handed over by whoever reads the scene.

use std::collections::{BTreeMap, HashMap};
use std::hash::BuildHasher;
use std::io;

/// Where a scene finds the files it names: a map from name to text, or a function that is called with a name.
pub trait Files {
    /// The text of the file at `relative`: with `/`, below the scene file's folder, never absolute, never with `..`.
    ///
    /// # Errors
    /// Whatever kept the file from being read; the parser adds the place that asked for it.
    fn read(&self, relative: &str) -> io::Result<String>;
}

impl<F: Fn(&str) -> io::Result<String>> Files for F {
    fn read(&self, relative: &str) -> io::Result<String> {
        self(relative)
    }
}

impl<S: BuildHasher> Files for HashMap<String, String, S> {
    fn read(&self, relative: &str) -> io::Result<String> {
        self.get(relative).cloned().ok_or_else(not_found)
    }
}

impl Files for BTreeMap<String, String> {
    fn read(&self, relative: &str) -> io::Result<String> {
        self.get(relative).cloned().ok_or_else(not_found)
    }
}

fn not_found() -> io::Error {
    io::Error::new(io::ErrorKind::NotFound, "no such file in the map")
}
