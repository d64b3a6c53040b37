//! The rows of a recording as they are read, and the file that they are written to.

use crate::error::ExportError;
use grideye_recording::Row;
use std::io::{Seek, Write};

/// The rows of a recording, as they are read.
pub type Rows<'a> = &'a mut dyn Iterator<Item = Result<Row, ExportError>>;

/// A file that is being written.
pub trait Out: Write + Seek + Send {}

impl<T: Write + Seek + Send> Out for T {}
