//! The keys of a scene file that the physical model, or a real unit of a sensor, has and the paper has not.

use crate::file::document::{PerAxis, SceneTable, SensorTable};
use crate::file::files::Files;
use crate::file::rule::{BLUR, BLUR_PIXELS, PIXEL_WIDTH, STEP, WAVELENGTH};
use crate::file::source::{Source, read_below};
use crate::model::error::SceneError;
use crate::model::scene::Model;
use crate::model::sensor::Optics;
use crate::profile::{Profile, ProfileError};
use crate::radiometry::radiance::Band;
use crate::text::refusal::Rule;
use glam::{DVec2, USizeVec2};
use grideye_frame::{COLUMNS, ROWS};
use toml::Spanned;

/// The model that the file asks for.
pub(crate) fn model(
    source: &Source<'_>,
    model: Option<&Spanned<String>>,
) -> Result<Model, SceneError> {
    match model.map(|model| (model, model.get_ref().as_str())) {
        None | Some((_, "paper")) => Ok(Model::Paper),
        Some((_, "physical")) => Ok(Model::Physical),
        Some((model, _)) => Err(source.refused(
            "model",
            model.span(),
            "\"paper\" or \"physical\"",
            "paper is the default; scenes/README.md says when to use which",
        )),
    }
}

pub(crate) fn band(source: &Source<'_>, tables: &SceneTable) -> Result<Band, SceneError> {
    let Some(band_um) = &tables.band_um else {
        return Ok(Band::All);
    };
    let [from_um, to_um] = band_um.get_ref().0;
    if (WAVELENGTH.holds)(from_um) && (WAVELENGTH.holds)(to_um) && from_um < to_um {
        return Ok(Band::Window { from_um, to_um });
    }
    Err(source.refused(
        WAVELENGTH.key,
        band_um.span(),
        WAVELENGTH.expected,
        WAVELENGTH.hint,
    ))
}

/// What a sensor's keys say beyond its pose and the paper's model.
pub(crate) struct PhysicalKeys {
    pub(crate) optics: Optics,
    pub(crate) pixel_width_rad: Option<DVec2>,
    pub(crate) blur_rad: DVec2,
    pub(crate) profile: Option<Profile>,
    pub(crate) step_c: f64,
}

/// What the keys are read for: the sensor's pixels, and whether it is a Grid-EYE as it is sold.
pub(crate) struct Given<'a> {
    pub(crate) name: &'a str,
    pub(crate) resolution: USizeVec2,
    pub(crate) fov_deg: DVec2,
    pub(crate) is_grid_eye: bool,
}

impl Given<'_> {
    fn has_amg88_optics(&self) -> bool {
        self.resolution == USizeVec2::new(COLUMNS, ROWS) && self.fov_deg == DVec2::splat(60.0)
    }
}

pub(crate) fn keys(
    source: &Source<'_>,
    table: &Spanned<SensorTable>,
    given: &Given<'_>,
    files: &dyn Files,
) -> Result<PhysicalKeys, SceneError> {
    let keys = table.get_ref();
    let width_deg = per_axis(source, keys.pixel_width_deg.as_ref(), &PIXEL_WIDTH)?;
    if let (Some(_), Some(blur)) = (&keys.blur_deg, &keys.blur_px) {
        return Err(SceneError::KeysConflict {
            place: source.place(blur.span().start),
            table: format!("sensor `{}`", given.name),
            key: "blur_px",
            other: "blur_deg",
            hint: "give the width of the point spread in pixels or in degrees",
        });
    }
    let step_deg = given.fov_deg / given.resolution.as_dvec2();
    let blur_px =
        per_axis(source, keys.blur_px.as_ref(), &BLUR_PIXELS)?.map(|blur| blur * step_deg);
    let blur_deg = per_axis(source, keys.blur_deg.as_ref(), &BLUR)?.or(blur_px);
    Ok(PhysicalKeys {
        optics: optics(source, keys.optics.as_ref(), given)?,
        pixel_width_rad: width_deg.map(|width| width.map(f64::to_radians)),
        blur_rad: blur_deg.unwrap_or(DVec2::ZERO).map(f64::to_radians),
        profile: profile(source, table, given, files)?,
        step_c: source.number_or(keys.step_c.as_ref(), &STEP, 0.0)?,
    })
}

fn per_axis(
    source: &Source<'_>,
    given: Option<&Spanned<PerAxis>>,
    rule: &Rule,
) -> Result<Option<DVec2>, SceneError> {
    let Some(given) = given else { return Ok(None) };
    for number in given.get_ref().0 {
        source.number(&Spanned::new(given.span(), number), rule)?;
    }
    Ok(Some(DVec2::from_array(given.get_ref().0)))
}

fn optics(
    source: &Source<'_>,
    given: Option<&Spanned<String>>,
    sensor: &Given<'_>,
) -> Result<Optics, SceneError> {
    match given.map(|given| (given, given.get_ref().as_str())) {
        None if sensor.is_grid_eye && sensor.has_amg88_optics() => Ok(Optics::Amg88),
        None | Some((_, "pinhole")) => Ok(Optics::Pinhole),
        Some((_, "datasheet")) if sensor.has_amg88_optics() => Ok(Optics::Amg88),
        Some((given, "datasheet")) => Err(source.refused(
            "optics",
            given.span(),
            "\"pinhole\" for a sensor that has not 8 x 8 pixels and 60°",
            "the datasheet's map is of the AMG88 with the 60° lens; leave optics out, or resolution and fov_deg",
        )),
        Some((given, _)) => Err(source.refused(
            "optics",
            given.span(),
            "\"datasheet\" or \"pinhole\"",
            "datasheet is where the pixels of an AMG88 look, pinhole is even steps on the picture plane",
        )),
    }
}

fn profile(
    source: &Source<'_>,
    table: &Spanned<SensorTable>,
    given: &Given<'_>,
    files: &dyn Files,
) -> Result<Option<Profile>, SceneError> {
    let keys = table.get_ref();
    let Some(path) = &keys.profile else {
        return Ok(None);
    };
    if let Some(noise) = &keys.noise_sigma_c {
        return Err(SceneError::KeysConflict {
            place: source.place(noise.span().start),
            table: format!("sensor `{}`", given.name),
            key: "noise_sigma_c",
            other: "profile",
            hint: "a profile brings the whole of the sensor's noise",
        });
    }
    if given.resolution != USizeVec2::new(COLUMNS, ROWS) {
        return Err(source.refused(
            "profile",
            path.span(),
            "no profile for a sensor that has not 8 x 8 pixels",
            "profiles are of the Grid-EYE; give noise_sigma_c instead",
        ));
    }
    let text = read_below(source, ("profile", "profile"), path, files)?;
    let refused = |error: ProfileError| SceneError::Profile {
        place: source.place(path.span().start),
        source: Box::new(error),
    };
    Profile::parse(&text, path.get_ref())
        .map(Some)
        .map_err(refused)
}

/// By how much the sensor's picture is turned for its first pixel to be where the file says, degrees.
///
/// Seen along the viewing direction with the case's lens end up, the specification's drawing has pixel 1 either at the
/// top left or at the bottom right, as it is meant to show the chip or what the chip sees: which, it does not say.
pub(crate) fn turned_deg(
    source: &Source<'_>,
    pixel_1: Option<&Spanned<String>>,
) -> Result<f64, SceneError> {
    match pixel_1.map(|place| (place, place.get_ref().as_str())) {
        None | Some((_, "top-left")) => Ok(0.0),
        Some((_, "bottom-right")) => Ok(180.0),
        Some((place, _)) => Err(source.refused(
            "pixel_1",
            place.span(),
            "\"top-left\" or \"bottom-right\"",
            "where pixel 1 is in the picture; a lens turns a picture and never mirrors it",
        )),
    }
}

/// Noise of one pixel in one frame, °C, at so many frames a second.
///
/// The specification gives 0.05 °C at 1 and 0.16 °C at 10. A frame of the slow mode is the mean of ten quick ones, so
/// noise that is independent from one to the next falls with the root of their number: `0.05 √hz`, 0.158 at 10. That is
/// taken for all rates.
pub(crate) fn netd_c(at_1_hz_c: f64, sampling_hz: f64) -> f64 {
    at_1_hz_c * sampling_hz.sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noise_is_what_the_specification_prints_at_both_rates() {
        assert_eq!(netd_c(0.05, 1.0), 0.05);
        assert_eq!((netd_c(0.05, 10.0) * 100.0).round(), 16.0);
        assert_eq!(netd_c(0.05, 4.0), 0.1);
    }
}
