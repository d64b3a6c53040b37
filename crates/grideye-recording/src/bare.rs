//! Files with frames only, as rows of 64 numbers or numpy's `.npy`; the caller supplies the rest as [`Assumed`].

mod assumed;
mod npy;
mod rows;

pub use assumed::Assumed;
pub(crate) use npy::MAGIC as NPY_MAGIC;
pub use npy::NpyReader;
pub use rows::RowReader;
pub(crate) use rows::looks_like_rows;
