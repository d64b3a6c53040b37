//! Nothing: a package has to have a library. The drivers of other authors meet the emulated sensor in `tests/`.
