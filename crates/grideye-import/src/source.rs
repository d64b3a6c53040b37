//! What every container gives: rows of cells, and the names of their columns if it has any.

use crate::cell::RawRow;
use crate::columns::Unit;
use crate::error::ImportError;

pub(crate) trait Rows {
    /// One name for each field of a row.
    fn names(&self) -> Option<&[String]>;

    /// The next row; after an error there are none.
    fn next(&mut self) -> Result<Option<RawRow>, ImportError>;

    /// Lines that were neither frames nor facts about one.
    fn skipped(&self) -> u64 {
        0
    }

    /// Frames that the beginning of the file cuts.
    fn cut(&self) -> u64 {
        0
    }

    /// The unit that stands behind the numbers.
    fn unit(&self) -> Option<Unit> {
        None
    }

    /// What the container is, for people.
    fn container(&self) -> String;
}

/// The rows of a container that is not a text.
pub(crate) struct Made {
    pub(crate) container: String,
    pub(crate) names: Vec<String>,
    /// Ends with the first error.
    pub(crate) rows: Box<dyn Iterator<Item = Result<RawRow, ImportError>> + Send>,
    /// Lines that are no rows.
    pub(crate) skipped: u64,
}

impl Rows for Made {
    fn names(&self) -> Option<&[String]> {
        (!self.names.is_empty()).then_some(&self.names)
    }

    fn next(&mut self) -> Result<Option<RawRow>, ImportError> {
        self.rows.next().transpose()
    }

    fn skipped(&self) -> u64 {
        self.skipped
    }

    fn container(&self) -> String {
        self.container.clone()
    }
}
