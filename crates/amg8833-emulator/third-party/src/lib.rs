//! Empty: a package must have a library. The third-party drivers run against the emulated sensor in `tests/`.
