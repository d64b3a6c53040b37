//! The scene file as TOML has it: keys and their places, nothing checked but types and spelling.

use serde::Deserialize;
use serde::de::{Deserializer, Error, SeqAccess, Visitor};
use std::fmt;
use toml::Spanned;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct SceneTable {
    pub(crate) model: Option<Spanned<String>>,
    pub(crate) law: Option<Spanned<String>>,
    pub(crate) room: RoomTable,
    #[serde(default)]
    pub(crate) object: Vec<Spanned<ObjectTable>>,
    #[serde(default)]
    pub(crate) agent: Vec<Spanned<AgentTable>>,
    #[serde(default)]
    pub(crate) sensor: Vec<Spanned<SensorTable>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct RoomTable {
    pub(crate) size_mm: Spanned<[f64; 3]>,
    pub(crate) ambient_c: Spanned<f64>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct ObjectTable {
    pub(crate) name: Spanned<String>,
    pub(crate) position_mm: Spanned<[f64; 3]>,
    pub(crate) size_mm: Spanned<[f64; 3]>,
    pub(crate) yaw_deg: Option<Spanned<f64>>,
    pub(crate) temperature_c: Option<Spanned<f64>>,
    pub(crate) emissivity: Option<Spanned<f64>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct AgentTable {
    pub(crate) name: Spanned<String>,
    pub(crate) size_mm: Spanned<[f64; 3]>,
    pub(crate) yaw_deg: Option<Spanned<f64>>,
    pub(crate) temperature_c: Spanned<f64>,
    pub(crate) emissivity: Option<Spanned<f64>>,
    pub(crate) position_mm: Option<Spanned<[f64; 3]>>,
    pub(crate) trajectory: Option<Spanned<String>>,
    pub(crate) speed_mm_per_s: Option<Spanned<f64>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct SensorTable {
    pub(crate) name: Spanned<String>,
    pub(crate) preset: Option<Spanned<String>>,
    pub(crate) position_mm: Spanned<[f64; 3]>,
    pub(crate) elevation_deg: Spanned<f64>,
    pub(crate) azimuth_deg: Spanned<f64>,
    pub(crate) roll_deg: Option<Spanned<f64>>,
    pub(crate) resolution: Option<Spanned<[i64; 2]>>,
    pub(crate) fov_deg: Option<Spanned<PerAxis>>,
    pub(crate) pixels_per_degree: Option<Spanned<f64>>,
    pub(crate) noise_sigma_c: Option<Spanned<f64>>,
    pub(crate) sampling_hz: Option<Spanned<f64>>,
    pub(crate) operating_distance_mm: Option<Spanned<f64>>,
}

/// One number for both axes, or one for each: across, then down.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct PerAxis(pub(crate) [f64; 2]);

impl<'de> Deserialize<'de> for PerAxis {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(PerAxisVisitor)
    }
}

struct PerAxisVisitor;

impl<'de> Visitor<'de> for PerAxisVisitor {
    type Value = PerAxis;

    fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str("a number, or two: across and down")
    }

    fn visit_f64<E: Error>(self, number: f64) -> Result<PerAxis, E> {
        Ok(PerAxis([number; 2]))
    }

    fn visit_i64<E: Error>(self, number: i64) -> Result<PerAxis, E> {
        let number = i32::try_from(number).map_err(E::custom)?;
        self.visit_f64(f64::from(number))
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut numbers: A) -> Result<PerAxis, A::Error> {
        let mut axes = [0.0; 2];
        for (index, axis) in axes.iter_mut().enumerate() {
            *axis = numbers
                .next_element()?
                .ok_or_else(|| A::Error::invalid_length(index, &self))?;
        }
        match numbers.next_element::<f64>()? {
            None => Ok(PerAxis(axes)),
            Some(_) => Err(A::Error::invalid_length(axes.len() + 1, &self)),
        }
    }
}
