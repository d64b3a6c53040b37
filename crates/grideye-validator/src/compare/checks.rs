//! What is refused before anything is compared.

use crate::compare::settings::{FRAMES_MAX, SHUFFLES_MAX, Settings, THREADS_MAX};
use crate::error::{Side, ValidatorError};
use crate::frames::{Protocol, RealFrame, Shape, SimulatedFrame};
use crate::metrics::Binning;
use crate::numbers::count;

pub(crate) fn check_settings(settings: &Settings) -> Result<(), ValidatorError> {
    let above_zero = |value: f64| value.is_finite() && value > 0.0;
    let refuse = |name, expected, found| {
        Err(ValidatorError::Setting {
            name,
            expected,
            found,
        })
    };
    if !settings.ambient_c.is_finite() {
        return refuse("ambient_c", "a temperature in degrees", settings.ambient_c);
    }
    if !above_zero(settings.step_c) {
        return refuse("step_c", "a width above zero", settings.step_c);
    }
    if !above_zero(settings.noise_sigma_c) {
        return refuse(
            "noise_sigma_c",
            "a deviation above zero",
            settings.noise_sigma_c,
        );
    }
    let angle = |&angle: &f64| angle > 0.0 && angle < std::f64::consts::PI;
    if let Some(wrong) = settings
        .field_of_view_rad
        .and_then(|angles| angles.into_iter().find(|value| !angle(value)))
    {
        return refuse(
            "field_of_view_rad",
            "an angle above 0 and below a half turn",
            wrong,
        );
    }
    if let Binning::Step { width_c } = settings.binning {
        if !above_zero(width_c) {
            return refuse("binning", "a width above zero", width_c);
        }
    }
    if settings.threads == 0 || settings.threads > THREADS_MAX {
        return refuse("threads", "a number from 1 to 64", count(settings.threads));
    }
    if settings.shuffles == 0 || settings.shuffles > SHUFFLES_MAX {
        return refuse(
            "shuffles",
            "a number from 1 to 10000",
            count(settings.shuffles),
        );
    }
    Ok(())
}

pub(crate) fn check_frames(
    shape: Shape,
    real: &[RealFrame],
    simulated: &[SimulatedFrame],
    protocol: Protocol,
) -> Result<(), ValidatorError> {
    check_number(Side::Real, real.len())?;
    check_number(Side::Simulated, simulated.len())?;
    if protocol == Protocol::Dynamic && real.len() != simulated.len() {
        return Err(ValidatorError::Unpaired {
            real: real.len(),
            simulated: simulated.len(),
        });
    }
    for (index, frame) in real.iter().enumerate() {
        check_frame(shape, Side::Real, index, &frame.celsius)?;
        if let Some(later) = &frame.later {
            check_frame(shape, Side::Real, index, later)?;
        }
    }
    for (index, frame) in simulated.iter().enumerate() {
        check_frame(shape, Side::Simulated, index, &frame.celsius)?;
        check_frame(shape, Side::Simulated, index, &frame.noise_free)?;
        let truth = frame.truth.as_ref().map_or(shape.pixels(), Vec::len);
        check_size(shape, Side::Simulated, index, truth)?;
    }
    Ok(())
}

fn check_number(side: Side, found: usize) -> Result<(), ValidatorError> {
    match found {
        0 => Err(ValidatorError::NoFrames { side }),
        1..=FRAMES_MAX => Ok(()),
        _ => Err(ValidatorError::TooManyFrames {
            side,
            limit: FRAMES_MAX,
            found,
        }),
    }
}

fn check_frame(
    shape: Shape,
    side: Side,
    index: usize,
    celsius: &[f64],
) -> Result<(), ValidatorError> {
    check_size(shape, side, index, celsius.len())?;
    match celsius.iter().position(|value| !value.is_finite()) {
        Some(pixel) => Err(ValidatorError::NotFinite { side, index, pixel }),
        None => Ok(()),
    }
}

fn check_size(shape: Shape, side: Side, index: usize, found: usize) -> Result<(), ValidatorError> {
    let expected = shape.pixels();
    if found == 0 || found != expected {
        return Err(ValidatorError::FrameSize {
            side,
            index,
            expected,
            found,
        });
    }
    Ok(())
}
