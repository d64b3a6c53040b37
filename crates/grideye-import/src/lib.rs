//! Reads anybody's Grid-EYE recording (text, JSON, numpy, Parquet, Excel) as records, and says which column it took for
//! what. `recordings/README.md` lists what is read.
//!
//! ```
//! use grideye_import::{Options, open};
//!
//! let names: Vec<String> = (0..64).map(|pixel| format!("p{pixel}")).collect();
//! let text = format!("when,{},person\n1521008322.810246,{}1\n", names.join(","), "24.5,".repeat(64));
//! let mut import = open(std::io::Cursor::new(text), "walk.csv", &Options::default())?;
//! println!("{}", import.account());
//! let row = import.next().expect("a row")?;
//! assert_eq!(row.record.stamp.t_utc_ns, 1_521_008_322_810_246_000);
//! assert_eq!((import.labels(), row.labels.as_slice()), (&["person".to_owned()][..], &["1".to_owned()][..]));
//! # Ok::<(), grideye_import::ImportError>(())
//! ```
//!
//! ```text
//!  file ── container ──┬─ text    layout · lead · blocks · beside ──┐
//!   gzip, zip, UTF-16  ├─ json                                      ├─ rows of cells ── plan ── frames ── records
//!                      └─ arrays · tables · sheets ─────────────────┘   names · pixels · unit · time
//! ```
//!
//! A container only gives rows of cells. One grammar, `plan`, tells from the names of the columns and from the first 256
//! rows which are the pixels, their unit, the time, the thermistor, the number, the sensor, and labels;
//! [`Options::columns`] overrides it. What is not certain it asks for. Text is read line by line; JSON and a sheet become
//! rows that are held in memory; of arrays and Parquet the bytes are held, and each row is made when it is asked for.
//!
//! What a file unpacks to, and the values in it, are counted as they come, whatever its headings say (`allowance`). A value
//! counts 4 bytes, one that is held 16. A plain text has no bound but its own length.
//!
//! | what is said | where |
//! |---|---|
//! | what was taken for what, line by line | [`Account`], printed once |
//! | frames read, damaged, left out, without a time, between two steps of the sensor | [`Tally`], after the last row |
//! | what cannot be told, such as the unit of 64 numbers near 300, with the option that answers | [`ImportError`], before the first row |
//! | where a file breaks off: the rows before it were handed over | [`ImportError`] with `is_break` |
//!
//! The crate must not know buses, HTTP or scenes. `tests/suite/loggers` writes what loggers write, by seeds, and judges
//! what is read; it shares no code with the reader.

mod account;
mod allowance;
mod arrays;
mod cell;
mod columns;
mod container;
mod error;
mod frames;
mod import;
mod json;
mod moment;
mod plan;
#[cfg(feature = "xlsx")]
mod sheets;
mod source;
mod tables;
mod text;

pub use account::{Account, Tally};
pub use columns::{Columns, Unit};
pub use error::ImportError;
pub use import::{Import, Options, open};
