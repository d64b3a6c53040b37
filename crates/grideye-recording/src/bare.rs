//! Frames without a word about who measured them: rows of 64 numbers, as many a script prints them, and numpy's `.npy`.
//!
//! Such files say neither the sensor nor the thermistor, and most say no time. What they leave open is stated by who
//! reads them: [`Assumed`].

mod assumed;
mod npy;
mod rows;

pub use assumed::Assumed;
pub(crate) use npy::MAGIC as NPY_MAGIC;
pub use npy::NpyReader;
pub use rows::RowReader;
pub(crate) use rows::looks_like_rows;
