//! The Python package `grideye-hil`, whose README is `README.md`: what of it is in Rust.
//!
//! ```text
//!  python/grideye_hil/  classes with types and docstrings, arrays, pytest plugin
//!  _native              scene · recording · comparison · machine      on work (signals, the GIL) and errors
//! ```
//!
//! Arrays cross as bytes in the machine's order, and structures as JSON: numpy alone knows arrays.

#![expect(
    clippy::needless_pass_by_value,
    reason = "what comes from Python is made for the call"
)]

mod comparison;
mod errors;
mod machine;
mod recording;
mod scene;
mod work;

use pyo3::pymodule;

#[pymodule]
mod _native {
    #[pymodule_export]
    const SCL_HZ: u32 = amg8833_emulator::SCL_HZ.get();
    #[pymodule_export]
    use crate::comparison::Comparison;
    #[pymodule_export]
    use crate::machine::Machine;
    #[pymodule_export]
    use crate::recording::Recording;
    #[pymodule_export]
    use crate::scene::Scene;
}
