//! How far a copy of a store is.

/// What is being done.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stage {
    /// Frames are copied.
    Copying,
    /// The copy is compared with the original.
    Comparing,
}

impl Stage {
    /// For the progress bar.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Copying => "copying",
            Self::Comparing => "comparing",
        }
    }
}
