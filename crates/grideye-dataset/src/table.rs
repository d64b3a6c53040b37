//! The kinds of files that hold a part.

/// A kind of file that holds a part of a dataset.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Table {
    /// Apache Parquet: a row for each frame.
    Parquet,
    /// Arrays for numpy.
    Npz,
}

impl Table {
    /// The end of the names of such files, and the word for the kind.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Parquet => "parquet",
            Self::Npz => "npz",
        }
    }
}
