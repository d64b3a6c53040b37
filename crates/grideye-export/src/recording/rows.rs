//! The rows of a recording, and the file they are written to.

use crate::error::ExportError;
use grideye_recording::Row;
use std::io::{Seek, Write};

/// The rows of a recording, read one by one.
pub type Rows<'a> = &'a mut dyn Iterator<Item = Result<Row, ExportError>>;

/// A file being written.
pub trait Out: Write + Seek + Send {}

impl<T: Write + Seek + Send> Out for T {}
