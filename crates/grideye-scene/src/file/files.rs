//! The interface through which the caller supplies the files that a scene names.

use std::collections::{BTreeMap, HashMap};
use std::hash::BuildHasher;
use std::io;

/// Supplies the files that a scene names: a map from name to text, or a function called with a name.
pub trait Files {
    /// The text of the file at `relative`: a path with `/` below the scene file's folder, never absolute, never with
    /// `..`.
    ///
    /// # Errors
    /// The reason why the file cannot be read; the parser adds the place that names it.
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
