//! The rows of a recording, and the file they are written to.

use crate::error::ExportError;
use grideye_recording::Row;
use std::io::{Seek, Write};

/// The rows of a recording, read one by one.
pub struct Rows<'a> {
    /// The names of the rows' labels.
    pub labels: &'a [String],
    /// The rows.
    pub rows: &'a mut dyn Iterator<Item = Result<Row, ExportError>>,
}

impl Iterator for Rows<'_> {
    type Item = Result<Row, ExportError>;

    fn next(&mut self) -> Option<Self::Item> {
        self.rows.next()
    }
}

/// A file being written.
pub trait Out: Write + Seek + Send {}

impl<T: Write + Seek + Send> Out for T {}
