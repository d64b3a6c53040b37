//! What the readers of rows have in common.

/// Makes a reader an iterator over its rows: to the end, or to the first error and not beyond it. The reader has a method
/// `row(&mut self) -> Result<Option<Row>, RecordingError>` and a field `ended: bool`.
macro_rules! rows_until_error {
    ($reader:ident, $row:ty) => {
        impl<R: ::std::io::Read> Iterator for $reader<R> {
            type Item = Result<$row, $crate::error::RecordingError>;

            fn next(&mut self) -> Option<Self::Item> {
                if self.ended {
                    return None;
                }
                let item = self.row().transpose();
                self.ended = !matches!(item, Some(Ok(_)));
                item
            }
        }

        impl<R: ::std::io::Read> ::std::iter::FusedIterator for $reader<R> {}
    };
}

pub(crate) use rows_until_error;
