//! Why a join line, or the file that joining leaves, is not understood.

/// Why a line or a file is not understood. What it held is not repeated: there is a token in it.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct NotJoined(pub(super) String);
