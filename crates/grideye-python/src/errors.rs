//! Errors as Python raises them.

use grideye_inputs::InputError;
use grideye_rig::RigError;
use pyo3::prelude::*;

/// `grideye_hil.InputError`, with file, line and hint.
pub(crate) fn raised(py: Python<'_>, error: &InputError) -> PyErr {
    let exception = || {
        py.import("grideye_hil._error")?
            .getattr("InputError")?
            .call1((error.problem(), error.hint(), &error.file, error.line))
    };
    exception().map_or_else(|error| error, PyErr::from_value)
}

/// What a machine cannot be built from.
pub(crate) fn of_rig(error: RigError) -> InputError {
    match error {
        RigError::Scene(error) => error.into(),
        other => InputError::new(other),
    }
}
