//! Files as loggers of this sensor write them: a generator that knows what is in them judges the reader.

mod archive;
mod judge;
mod kinds;
mod lies;
mod measure;
mod print;
mod scene;
mod truth;
mod variant;
