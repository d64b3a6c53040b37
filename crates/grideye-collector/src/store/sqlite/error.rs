//! SQLite's errors as a store's.

use crate::store::error::StoreError;
use rusqlite::ErrorCode;

impl From<rusqlite::Error> for StoreError {
    fn from(error: rusqlite::Error) -> Self {
        match error.sqlite_error_code() {
            Some(ErrorCode::DiskFull) => Self::Full,
            Some(ErrorCode::DatabaseBusy | ErrorCode::DatabaseLocked) => Self::Locked,
            Some(ErrorCode::NotADatabase) => Self::NotADatabase,
            Some(ErrorCode::CannotOpen | ErrorCode::ReadOnly | ErrorCode::PermissionDenied) => {
                Self::Unusable {
                    message: error.to_string(),
                }
            }
            _ => Self::Failed(error.to_string()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_full_disk_is_told_from_other_faults() {
        let fault = |code| {
            StoreError::from(rusqlite::Error::SqliteFailure(
                rusqlite::ffi::Error::new(code),
                None,
            ))
        };
        assert!(matches!(
            fault(rusqlite::ffi::SQLITE_FULL),
            StoreError::Full
        ));
        assert!(matches!(
            fault(rusqlite::ffi::SQLITE_IOERR),
            StoreError::Failed(_)
        ));
        assert!(matches!(
            fault(rusqlite::ffi::SQLITE_READONLY),
            StoreError::Unusable { .. }
        ));
    }
}
