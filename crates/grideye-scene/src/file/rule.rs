//! The numbers allowed for each key, and the messages about others.

use crate::model::Clothing;
use crate::model::limits::TIME_MAX_S;
use crate::radiometry::ABSOLUTE_ZERO_C;
use crate::text::Rule;

pub(crate) const TEMPERATURE: Rule = Rule {
    key: "temperature_c",
    holds: |celsius| celsius > ABSOLUTE_ZERO_C && celsius <= 5000.0,
    expected: "°C above absolute zero (-273.15) and up to 5000",
    hint: "temperatures are degrees Celsius, not kelvin or raw counts",
};
pub(crate) const RANGE: Rule = Rule {
    key: "detectable_range_c",
    expected: "[lowest, highest] °C, rising, above absolute zero (-273.15) and up to 5000",
    hint: "the paper gives the Grid-EYE 0 to 80: [0, 80]",
    ..TEMPERATURE
};
pub(crate) const AMBIENT: Rule = TEMPERATURE.of("ambient_c");
pub(crate) const EMISSIVITY: Rule = Rule {
    key: "emissivity",
    holds: |share| share > 0.0 && share <= 1.0,
    expected: "a number above 0 and up to 1",
    hint: "skin has 0.98, cloth 0.9 to 0.95, the paper uses 0.8",
};
/// The physical model allows a perfect mirror; the paper's formula would divide by its emissivity.
pub(crate) const EMISSIVITY_PHYSICAL: Rule = Rule {
    holds: |share| (0.0..=1.0).contains(&share),
    expected: "a number from 0 to 1",
    hint: "skin has 0.98, cloth 0.9 to 0.95, a mirror for heat 0",
    ..EMISSIVITY
};
pub(crate) const REFLECTED: Rule = TEMPERATURE.of("reflected_c");
pub(crate) const SIZE: Rule = Rule {
    key: "size_mm",
    holds: |length_mm| length_mm > 0.0 && length_mm <= LENGTH_MAX_MM,
    expected: "three lengths above 0 and up to 1000000 mm",
    hint: "sizes are [x, y, z] in millimeters before rotation",
};
pub(crate) const POSITION: Rule = Rule {
    key: "position_mm",
    holds: |length_mm| length_mm.abs() <= LENGTH_MAX_MM,
    expected: "three coordinates of at most 1000000 mm",
    hint: "positions are [x, y, z] in millimeters from the room's bottom-left corner",
};
pub(crate) const PLAN: Rule = Rule {
    key: "plan_mm",
    holds: |length_mm| length_mm.abs() <= LENGTH_MAX_MM,
    expected: "two coordinates of at most 1000000 mm",
    hint: "a floor plan lists its corners [x, y] in the order of the walls, each once; walls meet only at their ends",
};
pub(crate) const HEIGHT: Rule = Rule {
    key: "height_mm",
    holds: |length_mm| length_mm > 0.0 && length_mm <= LENGTH_MAX_MM,
    expected: "a height above 0 and up to 1000000 mm",
    hint: "from the floor, at z = 0, to the ceiling",
};
/// From a small child to beyond the tallest man.
pub(crate) const STATURE: Rule = Rule {
    key: "height_mm",
    holds: |height_mm| (500.0..=2800.0).contains(&height_mm),
    expected: "500 to 2800 mm",
    hint: "a person's height when standing",
};
pub(crate) const BUILD: Rule = Rule {
    key: "build",
    holds: |girth| (0.5..=2.0).contains(&girth),
    expected: "\"slight\", \"average\", \"stout\" or 0.5 to 2",
    hint: "average is the default; girths are 0.9, 1 or 1.15 times the mean adult's, or the number",
};
pub(crate) const CLOTHING: Rule = Rule {
    key: "clothing",
    holds: |clo| (0.0..=Clothing::CLO_MAX).contains(&clo),
    expected: "\"light\", \"indoor\", \"coat\" or 0 to 4 clo",
    hint: "indoor is the default; light is 0.5 clo, indoor 1 and coat 2",
};
/// The standard deviation of a number.
pub(crate) const SD: Rule = Rule {
    key: "sd",
    holds: |sd| sd.is_finite() && sd > 0.0,
    expected: "a number above 0",
    hint: "how well you know the value: its standard deviation, in the key's unit",
};
/// The standard deviation of a difference from the scene, which may be none.
pub(crate) const SD_OF_DIFFERENCE: Rule = Rule {
    holds: |sd| sd.is_finite() && sd >= 0.0,
    expected: "a number from 0",
    ..SD
};
pub(crate) const SD_OF_PLACE: Rule = Rule {
    key: "sd",
    holds: |sd_m| (0.0..=0.15).contains(&sd_m),
    expected: "0 to 0.15 m",
    hint: "a comparison that allows for more agrees with any scene; measure the place",
};
pub(crate) const SD_OF_CONTRAST: Rule = Rule {
    key: "sd",
    holds: |sd| (0.0..=0.5).contains(&sd),
    expected: "0 to 0.5",
    hint: "a comparison that allows for more agrees with any scene; say what the agent wears, or set its temperature_c",
};
pub(crate) const OVER: Rule = Rule {
    key: "over_s",
    holds: |seconds| (0.01..=1000.0).contains(&seconds),
    expected: "0.01 to 1000 seconds",
    hint: "how long an error of the place lasts; 0.7 is the default",
};
const LENGTH_MAX_MM: f64 = 1_000_000.0;
pub(crate) const YAW: Rule = Rule {
    key: "yaw_deg",
    holds: |degrees| degrees.abs() <= 360.0,
    expected: "-360 to 360",
    hint: "angles are degrees, counter-clockwise as seen from above",
};
pub(crate) const PITCH: Rule = YAW.with(
    "pitch_deg",
    "angles are degrees; an object is rolled about x, pitched about y, then turned about the vertical",
);
pub(crate) const ROLL_OF_BODY: Rule = PITCH.of("roll_deg");
pub(crate) const VERTEX: Rule = POSITION.with(
    "vertices_mm",
    "vertices are [x, y, z] in millimeters from the object's own position, before rotation",
);
pub(crate) const UNIT: Rule = Rule {
    key: "unit_mm",
    holds: |length_mm| (1e-3..=1e6).contains(&length_mm),
    expected: "0.001 to 1000000 mm",
    hint: "an OBJ file in meters has 1000, one in millimeters 1",
};
pub(crate) const AZIMUTH: Rule = YAW.of("azimuth_deg");
pub(crate) const ROLL: Rule = YAW.with(
    "roll_deg",
    "angles are degrees, clockwise as seen from behind the sensor",
);
pub(crate) const ELEVATION: Rule = Rule {
    key: "elevation_deg",
    holds: |degrees| degrees.abs() <= 90.0,
    expected: "-90 to 90",
    hint: "90 looks straight down, 0 is level, -90 looks straight up",
};
pub(crate) const TILT: Rule = Rule {
    key: "tilt_deg",
    holds: |degrees| degrees.abs() <= 45.0,
    expected: "two angles of -45 to 45",
    hint: "[toward the image's right, toward its bottom]; larger turns are azimuth_deg and elevation_deg",
};
pub(crate) const FIELD_OF_VIEW: Rule = Rule {
    key: "fov_deg",
    holds: |degrees| degrees > 0.0 && degrees < 180.0,
    expected: "a full angle between 0 and 180, both excluded",
    hint: "the Grid-EYE has 60",
};
pub(crate) const PIXELS_PER_DEGREE: Rule = Rule {
    key: "pixels_per_degree",
    holds: |points| points > 0.0 && points <= 10_000.0,
    expected: "a number above 0 and up to 10000",
    hint: "the paper uses 5",
};
pub(crate) const NOISE: Rule = Rule {
    key: "noise_sigma_c",
    holds: |sigma| (0.0..=1000.0).contains(&sigma),
    expected: "0 to 1000 °C",
    hint: "the paper uses 0.2 for the Grid-EYE and 1.6 for the Lepton; 0 for no noise",
};
pub(crate) const SAMPLING: Rule = Rule {
    key: "sampling_hz",
    holds: |hertz| (0.001..=10_000.0).contains(&hertz),
    expected: "0.001 to 10000 frames per second",
    hint: "the Grid-EYE has 1 or 10",
};
pub(crate) const OPERATING_DISTANCE: Rule = Rule {
    key: "operating_distance_mm",
    holds: |length_mm| (10.0..=LENGTH_MAX_MM).contains(&length_mm),
    expected: "10 to 1000000 mm",
    hint: "the paper uses 5000",
};
pub(crate) const SPEED: Rule = Rule {
    key: "speed_mm_per_s",
    holds: |speed| speed > 0.0 && speed <= 100_000.0,
    expected: "a speed above 0 and up to 100000 mm/s",
    hint: "a person walks at 500 to 1500 mm/s; omit trajectory and speed if the agent stands still",
};
pub(crate) const ACCELERATION: Rule = Rule {
    key: "acceleration_mm_per_s2",
    holds: |acceleration| acceleration > 0.0 && acceleration <= 100_000.0,
    expected: "an acceleration above 0 and up to 100000 mm/s²",
    hint: "a person starting to walk accelerates at about 1000 mm/s²",
};
pub(crate) const GRADIENT: Rule = Rule {
    key: "gradient_c_per_m",
    holds: |celsius_per_m| celsius_per_m.abs() <= 1000.0,
    expected: "three numbers from -1000 to 1000 °C per meter",
    hint: "along the body's own x, y and z; temperature_c applies at its position",
};
pub(crate) const TIME_CONSTANT: Rule = Rule {
    key: "time_constant_s",
    holds: |seconds| (1e-3..=1e9).contains(&seconds),
    expected: "0.001 to 1000000000 seconds",
    hint: "the time in which an unheated object loses 63 % of its difference from ambient: a cup of tea 1800, a kettle 3600",
};
pub(crate) const POWER: Rule = Rule {
    key: "power_w",
    holds: |watts| watts.abs() <= 1e9,
    expected: "-1000000000 to 1000000000 W",
    hint: "heats the object while on; a negative power cools it",
};
pub(crate) const CAPACITY: Rule = Rule {
    key: "heat_capacity_j_per_k",
    holds: |capacity| (1e-3..=1e12).contains(&capacity),
    expected: "0.001 to 1000000000000 J/K",
    hint: "a liter of water has 4186 J/K, 10 kg of steel 4600 J/K",
};
pub(crate) const PAPER_EXPERIMENT: Rule = Rule {
    key: "paper_experiment",
    holds: |number| paper_experiment(number).is_some(),
    expected: "1, 2, 3 or 4",
    hint: "the paper's experiment that this scene reproduces; omit it in your own scenes",
};
pub(crate) fn paper_experiment(number: f64) -> Option<u8> {
    (1..=4).find(|&experiment| f64::from(experiment) == number)
}
pub(crate) const DURATION: Rule = Rule {
    key: "duration_s",
    holds: |seconds| (0.0..=TIME_MAX_S).contains(&seconds),
    expected: "0 to 31622400 seconds",
    hint: "the shortest duration of the scene; agents' paths extend it",
};
pub(crate) const SLOPE: Rule = Rule {
    key: "slope",
    holds: f64::is_finite,
    expected: "a number",
    hint: "`with` names another key, and slope is added for each unit that its value is off the middle of its law",
};
pub(crate) const EVERY: Rule = Rule {
    key: "every_s",
    holds: |seconds| (0.0..=TIME_MAX_S).contains(&seconds),
    expected: "0 to 31622400 seconds",
    hint: "`grideye calibrate` writes this table; fit again, or delete it together with the fitted values",
};
pub(crate) const PIXEL_WIDTH: Rule = Rule {
    key: "pixel_width_deg",
    holds: |degrees| (0.01..=90.0).contains(&degrees),
    expected: "0.01 to 90",
    hint: "the full angle within which a pixel has more than half its response: about 8 for a Grid-EYE",
};
pub(crate) const BLUR: Rule = Rule {
    key: "blur_deg",
    holds: |degrees| (0.0..=90.0).contains(&degrees),
    expected: "0 to 90",
    hint: "the full width at half height of the point spread; 0 for none",
};
pub(crate) const BLUR_PIXELS: Rule = Rule {
    key: "blur_px",
    holds: |pixels| (0.0..=10.0).contains(&pixels),
    expected: "0 to 10",
    hint: "the full width at half height of the point spread, in pixels; 0 for none",
};
pub(crate) const STEP: Rule = Rule {
    key: "step_c",
    holds: |celsius| (0.0..=100.0).contains(&celsius),
    expected: "0 to 100 °C",
    hint: "the Grid-EYE has steps of 0.25; 0 for none",
};
pub(crate) const WAVELENGTH: Rule = Rule {
    key: "band_um",
    holds: |um| (0.1..=1000.0).contains(&um),
    expected: "[from, to], rising, each 0.1 to 1000 µm",
    hint: "thermal sensors detect about [8, 14]; omit it for all wavelengths",
};

/// The rule for a number of the file, by its key.
pub(crate) fn of_number(key: &str) -> Option<&'static Rule> {
    const RULES: [&Rule; 24] = [
        &ACCELERATION,
        &AMBIENT,
        &AZIMUTH,
        &BLUR,
        &BLUR_PIXELS,
        &BUILD,
        &CAPACITY,
        &CLOTHING,
        &ELEVATION,
        &EMISSIVITY,
        &FIELD_OF_VIEW,
        &NOISE,
        &OPERATING_DISTANCE,
        &PITCH,
        &PIXEL_WIDTH,
        &POSITION,
        &POWER,
        &REFLECTED,
        &ROLL,
        &SIZE,
        &SPEED,
        &STATURE,
        &TEMPERATURE,
        &TILT,
    ];
    if key == "room.height_mm" {
        return Some(&HEIGHT);
    }
    let (front, last) = key.rsplit_once('.')?;
    let is_axis = ["x", "y", "z", "across", "down"].contains(&last);
    let name = if is_axis {
        front.rsplit('.').next()?
    } else {
        last
    };
    RULES.into_iter().find(|rule| rule.key == name)
}
