//! The profile as TOML has it: keys and their places, nothing checked but types and spelling.

use serde::Deserialize;
use serde::de::value::SeqAccessDeserializer;
use serde::de::{Deserializer, Error, SeqAccess, Visitor};
use std::fmt;
use toml::Spanned;

#[derive(Deserialize, Default)]
#[serde(deny_unknown_fields)]
pub(crate) struct ProfileTable {
    pub(crate) name: Option<Spanned<String>>,
    #[serde(default)]
    pub(crate) noise: NoiseTable,
    #[serde(default)]
    pub(crate) common_mode: CommonModeTable,
    #[serde(default)]
    pub(crate) fixed_pattern: FixedPatternTable,
    #[serde(default)]
    pub(crate) warm_up: WarmUpTable,
    #[serde(default)]
    pub(crate) thermistor: ThermistorTable,
    #[serde(default)]
    pub(crate) glitches: GlitchesTable,
    #[serde(default)]
    pub(crate) clock: ClockTable,
}

#[derive(Deserialize, Default)]
#[serde(deny_unknown_fields)]
pub(crate) struct NoiseTable {
    pub(crate) sigma_c: Option<Spanned<Map>>,
}

#[derive(Deserialize, Default)]
#[serde(deny_unknown_fields)]
pub(crate) struct CommonModeTable {
    pub(crate) sd_c: Option<Spanned<f64>>,
    pub(crate) correlation_s: Option<Spanned<f64>>,
    pub(crate) octaves: Option<Spanned<f64>>,
    pub(crate) cycle_depth_c: Option<Spanned<f64>>,
}

#[derive(Deserialize, Default)]
#[serde(deny_unknown_fields)]
pub(crate) struct FixedPatternTable {
    pub(crate) offset_c: Option<Spanned<Map>>,
    pub(crate) spread_c: Option<Spanned<f64>>,
}

#[derive(Deserialize, Default)]
#[serde(deny_unknown_fields)]
pub(crate) struct WarmUpTable {
    pub(crate) start_c: Option<Spanned<f64>>,
    pub(crate) time_constant_s: Option<Spanned<f64>>,
    pub(crate) drift_c_per_hour: Option<Spanned<f64>>,
}

#[derive(Deserialize, Default)]
#[serde(deny_unknown_fields)]
pub(crate) struct ThermistorTable {
    pub(crate) offset_c: Option<Spanned<f64>>,
    pub(crate) sigma_c: Option<Spanned<f64>>,
    pub(crate) lag_s: Option<Spanned<f64>>,
}

#[derive(Deserialize, Default)]
#[serde(deny_unknown_fields)]
pub(crate) struct GlitchesTable {
    pub(crate) probability: Option<Spanned<f64>>,
}

#[derive(Deserialize, Default)]
#[serde(deny_unknown_fields)]
pub(crate) struct ClockTable {
    pub(crate) error_ppm: Option<Spanned<f64>>,
    pub(crate) drift_ppm_per_hour: Option<Spanned<f64>>,
}

/// One number for every pixel, one for each, or a name for numbers that are known.
pub(crate) enum Map {
    Named(String),
    One(f64),
    Each(Vec<Spanned<f64>>),
}

impl<'de> Deserialize<'de> for Map {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(MapVisitor)
    }
}

struct MapVisitor;

impl<'de> Visitor<'de> for MapVisitor {
    type Value = Map;

    fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str("a number, or a list of 64 numbers")
    }

    fn visit_str<E: Error>(self, name: &str) -> Result<Map, E> {
        Ok(Map::Named(name.to_owned()))
    }

    fn visit_f64<E: Error>(self, number: f64) -> Result<Map, E> {
        Ok(Map::One(number))
    }

    fn visit_i64<E: Error>(self, number: i64) -> Result<Map, E> {
        let number = i32::try_from(number).map_err(E::custom)?;
        self.visit_f64(f64::from(number))
    }

    fn visit_seq<A: SeqAccess<'de>>(self, list: A) -> Result<Map, A::Error> {
        Vec::deserialize(SeqAccessDeserializer::new(list)).map(Map::Each)
    }
}
