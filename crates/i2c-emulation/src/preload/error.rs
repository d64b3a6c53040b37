//! Why a program cannot be run with a preloaded library, and what to do about it.

use std::io;

/// Why a program cannot be run with a preloaded library.
#[derive(Debug, thiserror::Error)]
pub enum RunError {
    /// This program was built without the library.
    #[error("this build carries no library to preload: {reason}\nhint: use FUSE (--via fuse)")]
    NoLibrary {
        /// Why it was built without.
        reason: &'static str,
    },
    /// There is no such program.
    #[error(
        "program not found: {program}\nhint: check the spelling and PATH; a file that is there names an interpreter or a loader that is not"
    )]
    ProgramNotFound {
        /// The program's name.
        program: String,
    },
    /// The program is there but does not start.
    #[error(
        "cannot start {program}: {source}\nhint: is the file executable, and made for this machine?"
    )]
    ProgramNotStarted {
        /// The program's name.
        program: String,
        /// What the kernel said.
        source: io::Error,
    },
    /// The program does not load libraries.
    #[error(
        "{program} is statically linked: no library can be preloaded into it\nhint: FUSE (--via fuse) reaches static programs"
    )]
    StaticProgram {
        /// The program's file, or that of the interpreter which its script names.
        program: String,
    },
    /// The program's loader ignores LD_PRELOAD.
    #[error(
        "{program} gains rights when it starts (set-user-ID, set-group-ID or file capabilities): its loader ignores libraries to preload\nhint: FUSE (--via fuse) as root reaches such programs"
    )]
    GainsRights {
        /// The program's file.
        program: String,
    },
    /// The program is made for another machine than this one, a 32-bit one for example.
    #[error(
        "{program} is made for another machine than the library to preload (another instruction set or width of pointers)\nhint: FUSE (--via fuse) reaches 32-bit programs as well; for another machine's programs build this one for that machine"
    )]
    OtherMachine {
        /// The program's file.
        program: String,
    },
    /// There are more buses than the library knows.
    #[error("{found} buses, but by preloading a program can be shown {max}\nhint: show it fewer")]
    TooManyBuses {
        /// How many there are.
        found: usize,
        /// The limit, [`BUSES_MAX`](super::BUSES_MAX).
        max: usize,
    },
    /// A step of the preparation failed.
    #[error("{step}: {source}\nhint: this needs Linux 3.17 or newer with a mounted /proc")]
    Setup {
        /// What was being done.
        step: &'static str,
        /// What the kernel said.
        source: io::Error,
    },
    /// The end of the program could not be waited for.
    #[error(
        "cannot wait for {program}: {source}\nhint: does something else in this process collect its children?"
    )]
    Wait {
        /// The program's name.
        program: String,
        /// What the kernel said.
        source: io::Error,
    },
}
