//! The scene file's tables as TOML: keys and their places, with only types and spelling checked.

use crate::text::Bounded;
use serde::Deserialize;
use std::collections::BTreeMap;
use toml::Spanned;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct SceneTable {
    pub(crate) model: Option<Spanned<String>>,
    pub(crate) law: Option<Spanned<String>>,
    pub(crate) band_um: Option<Spanned<Pair>>,
    pub(crate) collisions: Option<Spanned<String>>,
    pub(crate) duration_s: Option<Spanned<f64>>,
    pub(crate) paper_experiment: Option<Spanned<f64>>,
    pub(crate) room: Spanned<RoomTable>,
    #[serde(default)]
    pub(crate) object: Vec<Spanned<ObjectTable>>,
    #[serde(default)]
    pub(crate) mosaic: Vec<Spanned<MosaicTable>>,
    #[serde(default)]
    pub(crate) agent: Vec<Spanned<AgentTable>>,
    #[serde(default)]
    pub(crate) sensor: Vec<Spanned<SensorTable>>,
    #[serde(default)]
    pub(crate) uncertain: Vec<Spanned<UncertainTable>>,
    #[serde(default)]
    pub(crate) calibrated: Vec<Spanned<CalibratedTable>>,
    #[serde(default)]
    pub(crate) vary: Vec<Spanned<VaryTable>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct VaryTable {
    pub(crate) key: Spanned<String>,
    pub(crate) values: Option<Spanned<String>>,
    pub(crate) weights: Option<Spanned<Vec<f64>>>,
    pub(crate) with: Option<Spanned<String>>,
    pub(crate) slope: Option<Spanned<f64>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct CalibratedTable {
    pub(crate) keys: Spanned<Vec<String>>,
    #[serde(default)]
    pub(crate) sd: BTreeMap<String, Spanned<f64>>,
    pub(crate) every_s: Spanned<f64>,
    pub(crate) frames: Spanned<String>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct UncertainTable {
    pub(crate) key: Spanned<String>,
    pub(crate) bounds: Option<Spanned<Pair>>,
    pub(crate) sd: Option<Spanned<f64>>,
    pub(crate) mean: Option<Spanned<f64>>,
    pub(crate) over_s: Option<Spanned<f64>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct RoomTable {
    pub(crate) size_mm: Option<Spanned<Triple>>,
    pub(crate) plan_mm: Option<Spanned<Vec<Spanned<Pair>>>>,
    pub(crate) height_mm: Option<Spanned<f64>>,
    pub(crate) vertices_mm: Option<Triples>,
    pub(crate) faces: Option<Faces>,
    pub(crate) file: Option<Spanned<String>>,
    pub(crate) unit_mm: Option<Spanned<f64>>,
    pub(crate) ambient_c: Spanned<f64>,
    pub(crate) reflected_c: Option<Spanned<f64>>,
}

impl SceneTable {
    pub(crate) fn leave_out_absent(&mut self) {
        self.object.retain(|table| table.get_ref().present);
        self.mosaic.retain(|table| table.get_ref().present);
        self.agent.retain(|table| table.get_ref().present);
        for agent in &mut self.agent {
            let parts = &mut agent.get_mut().part;
            parts.retain(|part| part.get_ref().present);
        }
    }
}

const fn here() -> bool {
    true
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct ObjectTable {
    pub(crate) name: Spanned<String>,
    pub(crate) position_mm: Spanned<Triple>,
    pub(crate) size_mm: Option<Spanned<Triple>>,
    pub(crate) shape: Option<Spanned<String>>,
    pub(crate) yaw_deg: Option<Spanned<f64>>,
    pub(crate) pitch_deg: Option<Spanned<f64>>,
    pub(crate) roll_deg: Option<Spanned<f64>>,
    pub(crate) vertices_mm: Option<Triples>,
    pub(crate) faces: Option<Faces>,
    pub(crate) file: Option<Spanned<String>>,
    pub(crate) unit_mm: Option<Spanned<f64>>,
    pub(crate) temperature_c: Option<Spanned<f64>>,
    pub(crate) emissivity: Option<Spanned<f64>>,
    pub(crate) surface: Option<Spanned<String>>,
    pub(crate) color: Option<Spanned<String>>,
    pub(crate) faces_c: Option<Spanned<BTreeMap<String, Spanned<f64>>>>,
    pub(crate) gradient_c_per_m: Option<Spanned<Triple>>,
    pub(crate) texture_c: Option<Spanned<Rows>>,
    pub(crate) texture_on: Option<Spanned<String>>,
    pub(crate) texture_filter: Option<Spanned<String>>,
    pub(crate) time_constant_s: Option<Spanned<f64>>,
    pub(crate) power_w: Option<Spanned<f64>>,
    pub(crate) heat_capacity_j_per_k: Option<Spanned<f64>>,
    pub(crate) on_s: Option<Spanned<Vec<Pair>>>,
    pub(crate) material: Option<Spanned<String>>,
    #[serde(default = "here")]
    pub(crate) present: bool,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct MosaicTable {
    pub(crate) name: Spanned<String>,
    pub(crate) position_mm: Spanned<Triple>,
    pub(crate) size_mm: Spanned<Triple>,
    pub(crate) temperatures_c: Spanned<Rows>,
    pub(crate) emissivity: Option<Spanned<f64>>,
    pub(crate) color: Option<Spanned<String>>,
    #[serde(default = "here")]
    pub(crate) present: bool,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct AgentTable {
    pub(crate) name: Spanned<String>,
    pub(crate) person: Option<Spanned<PersonTable>>,
    pub(crate) size_mm: Option<Spanned<Triple>>,
    pub(crate) shape: Option<Spanned<String>>,
    pub(crate) yaw_deg: Option<Spanned<f64>>,
    pub(crate) temperature_c: Option<Spanned<f64>>,
    pub(crate) emissivity: Option<Spanned<f64>>,
    pub(crate) surface: Option<Spanned<String>>,
    pub(crate) color: Option<Spanned<String>>,
    #[serde(default)]
    pub(crate) part: Vec<Spanned<ObjectTable>>,
    pub(crate) position_mm: Option<Spanned<Triple>>,
    pub(crate) trajectory: Option<Spanned<String>>,
    pub(crate) speed_mm_per_s: Option<Spanned<f64>>,
    pub(crate) motion: Option<Spanned<String>>,
    pub(crate) acceleration_mm_per_s2: Option<Spanned<f64>>,
    pub(crate) faces: Option<Spanned<String>>,
    pub(crate) touches: Option<Spanned<Vec<Spanned<String>>>>,
    #[serde(default = "here")]
    pub(crate) present: bool,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct PersonTable {
    pub(crate) height_mm: Option<Spanned<f64>>,
    pub(crate) build: Option<Spanned<NameOrNumber>>,
    pub(crate) posture: Option<Spanned<String>>,
    pub(crate) clothing: Option<Spanned<NameOrNumber>>,
}

#[derive(Deserialize)]
#[serde(untagged, expecting = "expected a name or a number")]
pub(crate) enum NameOrNumber {
    Name(String),
    Number(f64),
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct SensorTable {
    pub(crate) name: Spanned<String>,
    pub(crate) preset: Option<Spanned<String>>,
    pub(crate) position_mm: Spanned<Triple>,
    pub(crate) elevation_deg: Spanned<f64>,
    pub(crate) azimuth_deg: Spanned<f64>,
    pub(crate) roll_deg: Option<Spanned<f64>>,
    pub(crate) tilt_deg: Option<Spanned<Pair>>,
    pub(crate) resolution: Option<Spanned<Bounded<i64, 2>>>,
    pub(crate) fov_deg: Option<Spanned<Axes>>,
    pub(crate) pixels_per_degree: Option<Spanned<f64>>,
    pub(crate) noise_sigma_c: Option<Spanned<f64>>,
    pub(crate) sampling_hz: Option<Spanned<f64>>,
    pub(crate) operating_distance_mm: Option<Spanned<f64>>,
    pub(crate) detectable_range_c: Option<Spanned<Pair>>,
    pub(crate) optics: Option<Spanned<String>>,
    pub(crate) pixel_width_deg: Option<Spanned<Axes>>,
    pub(crate) blur_deg: Option<Spanned<Axes>>,
    pub(crate) blur_px: Option<Spanned<Axes>>,
    pub(crate) profile: Option<Spanned<String>>,
    pub(crate) step_c: Option<Spanned<f64>>,
    pub(crate) pixel_1: Option<Spanned<String>>,
}

pub(crate) type Rows = Vec<Spanned<Vec<Spanned<f64>>>>;
pub(crate) type Triple = Bounded<f64, 3>;
pub(crate) type Triples = Spanned<Vec<Spanned<Triple>>>;
pub(crate) type Pair = Bounded<f64, 2>;
pub(crate) type Faces = Spanned<Vec<Vec<i64>>>;
/// One number for both axes, or one for each: across, then down.
pub(crate) type Axes = Bounded<f64, 2, true>;
