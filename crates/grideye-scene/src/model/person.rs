//! A person as rounded segments: proportions, posture, gait, and how warm each segment looks.
//!
//! Lengths are shares of stature from Drillis and Contini (1966), as in Winter, *Biomechanics and Motor Control of
//! Human Movement*, figure 4.1. Girths are those of the mean adult of ANSUR II (US Army, 2012) at 1.75 m. Surface
//! temperatures follow the heat balance of ISO 7730, with the insulations of ISO 9920.

use crate::geometry::{Ellipsoid, rotation_y_deg};
use crate::radiometry::Surface;
use glam::{DMat3, DVec3};
use std::f64::consts::{FRAC_PI_2, TAU};

grideye_frame::named! {
    /// What a person does with its body, with its name in a file.
    #[derive(Debug, Clone, Copy, PartialEq, Eq)]
    pub enum Posture {
        /// Upright, arms hanging.
        Stand = "stand";
        /// Upright; legs and arms swing with the way.
        Walk = "walk";
        /// Upright trunk, thighs level, shanks upright.
        Sit = "sit";
        /// On the back, the head towards +x.
        Lie = "lie";
    }
}

/// What a person wears, by its insulation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Clothing {
    /// Insulation of the outfit (ISO 9920), clo; 0 to [`CLO_MAX`](Self::CLO_MAX).
    pub clo: f64,
}

/// A person's body and clothes.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Person {
    /// Stature, meters.
    pub height_m: f64,
    /// Girths relative to the mean adult's of that stature.
    pub girth: f64,
    /// What the body does.
    pub posture: Posture,
    /// What it wears.
    pub clothing: Clothing,
    /// Length of one stride, two steps.
    pub(crate) stride_m: f64,
    /// Turns its front from +x to where it looks if it does not walk.
    pub(crate) facing: DMat3,
}

/// The moment of a walk: where in its stride and how wide its steps are.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Stride {
    /// Radians since the left heel touched the ground.
    pub(crate) phase_rad: f64,
    /// 1 at normal speed, 0 at rest.
    pub(crate) width: f64,
}

/// What a body does at a moment: a posture, or the change to another.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Moment {
    pub(crate) from: Posture,
    pub(crate) to: Posture,
    /// How much of the change is done, 0 to 1.
    pub(crate) share: f64,
    /// Where the head goes as the body lies down: level, of length 1, from a front at +x; `None` for a posture that does
    /// not change.
    pub(crate) head_to: Option<DVec3>,
    pub(crate) stride: Stride,
}

impl Moment {
    pub(crate) const fn of(posture: Posture, stride: Stride) -> Self {
        Self {
            from: posture,
            to: posture,
            share: 0.0,
            head_to: None,
            stride,
        }
    }
}

/// How the joints bend, degrees forward, the left side first; how much higher the hips are than a standing person's, of
/// stature; and how much of the way to lying the whole body is tilted.
#[derive(Debug, Clone, Copy)]
struct Stance {
    shoulders_deg: [f64; 2],
    elbows_deg: [f64; 2],
    hips_deg: [f64; 2],
    knees_deg: [f64; 2],
    raised: f64,
    tilted: f64,
}

impl Stance {
    const UPRIGHT: Self = Self {
        shoulders_deg: [0.0; 2],
        elbows_deg: [0.0; 2],
        hips_deg: [0.0; 2],
        knees_deg: [0.0; 2],
        raised: 0.0,
        tilted: 0.0,
    };

    fn toward(&self, to: &Self, share: f64) -> Self {
        let between = |from: f64, to: f64| from + share * (to - from);
        let both = |from: [f64; 2], to: [f64; 2]| [0, 1].map(|side| between(from[side], to[side]));
        // A thigh lowers the hips by the cosine of its angle.
        let bent = |share: f64| 1.0 - libm::cos(FRAC_PI_2 * share);
        Self {
            shoulders_deg: both(self.shoulders_deg, to.shoulders_deg),
            elbows_deg: both(self.elbows_deg, to.elbows_deg),
            hips_deg: both(self.hips_deg, to.hips_deg),
            knees_deg: both(self.knees_deg, to.knees_deg),
            raised: bent(1.0 - share) * self.raised + bent(share) * to.raised,
            tilted: between(self.tilted, to.tilted),
        }
    }
}

/// What a segment is covered with.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Cover {
    Skin,
    Hair,
    Top,
    /// Bare below 0.5 clo, as the top from 1 clo on.
    Sleeve,
    /// Where shirt or coat hangs over the trousers.
    Middle,
    Legs,
    Shoe,
}

/// Segments, from the head down; [`Person::segments`] gives them in this order.
const COVERS: [(&str, Cover, f64); SEGMENTS] = [
    ("hair", Cover::Hair, 0.5),
    ("face", Cover::Skin, 0.5),
    ("neck", Cover::Skin, 0.5),
    ("shoulders", Cover::Top, 0.5),
    ("chest", Cover::Top, 0.5),
    ("pelvis", Cover::Middle, 0.0),
    ("left upper arm", Cover::Top, -0.5),
    ("right upper arm", Cover::Top, -0.5),
    ("left forearm", Cover::Sleeve, -1.5),
    ("right forearm", Cover::Sleeve, -1.5),
    ("left hand", Cover::Skin, -5.5),
    ("right hand", Cover::Skin, -5.5),
    ("left thigh", Cover::Legs, -1.0),
    ("right thigh", Cover::Legs, -1.0),
    ("left shank", Cover::Legs, -2.0),
    ("right shank", Cover::Legs, -2.0),
    ("left foot", Cover::Shoe, -4.0),
    ("right foot", Cover::Shoe, -4.0),
];
pub(crate) const SEGMENTS: usize = 18;

const SIDES: [f64; 2] = [1.0, -1.0];
/// The stature of which the girths below are, meters.
const GIRTHS_OF_M: f64 = 1.75;
/// Of stature: where joints are above the floor, and how far from the middle.
const HIP: f64 = 0.53;
const HIP_ASIDE: f64 = 0.052;
const KNEE: f64 = 0.285;
const ANKLE: f64 = 0.039;
const SHOULDER: f64 = 0.818;
const SHOULDER_ASIDE: f64 = 0.115;
const ELBOW: f64 = 0.632;
/// Of stature: the underside of the thighs of somebody who sits.
const SEAT: f64 = 0.25;
/// Angles of a walk at normal speed, degrees (Winter, chapter 3; Murray 1967).
const HIP_SWINGS_DEG: f64 = 22.0;
const KNEE_BENDS_DEG: f64 = 50.0;
const ARM_SWINGS_DEG: f64 = 18.0;
const ELBOW_BENDS_DEG: f64 = 15.0;
/// Of stature: one stride, two steps.
const STRIDE: f64 = 0.8;
/// The speed from which on steps have their full width.
const WIDE_FROM_M_PER_S: f64 = 1.0;

impl Person {
    /// Names of builds, with girths relative to the mean adult's.
    pub const BUILDS: [(&str, f64); 3] = [("slight", 0.9), ("average", 1.0), ("stout", 1.15)];

    /// The mean stature of adults of both sexes, meters.
    pub const HEIGHT_M: f64 = 1.7;

    /// A person who faces +x.
    #[must_use]
    pub const fn new(height_m: f64, girth: f64, posture: Posture, clothing: Clothing) -> Self {
        Self {
            height_m,
            girth,
            posture,
            clothing,
            stride_m: Self::stride_m(height_m),
            facing: DMat3::IDENTITY,
        }
    }

    /// How high the seat is on which the person sits, meters above where it stands.
    #[must_use]
    pub const fn seat_m(&self) -> f64 {
        SEAT * self.height_m
    }

    /// The length of two steps of a person of this stature.
    pub(crate) const fn stride_m(height_m: f64) -> f64 {
        STRIDE * height_m
    }

    /// Where in its stride the person is after `length_m` of its way, at `speed_m_per_s`.
    pub(crate) fn stride(&self, length_m: f64, speed_m_per_s: f64) -> Stride {
        if self.posture != Posture::Walk {
            return Stride::default();
        }
        let strides = length_m / self.stride_m;
        Stride {
            phase_rad: TAU * (strides - strides.floor()),
            width: (speed_m_per_s / WIDE_FROM_M_PER_S).min(1.0),
        }
    }

    fn stance(&self, posture: Posture, stride: Stride) -> Stance {
        let upright = Stance::UPRIGHT;
        let (sin, cos) = libm::sincos(stride.phase_rad);
        match posture {
            Posture::Stand => upright,
            Posture::Lie => Stance {
                tilted: 1.0,
                ..upright
            },
            Posture::Sit => Stance {
                shoulders_deg: [25.0; 2],
                elbows_deg: [65.0; 2],
                hips_deg: [90.0; 2],
                knees_deg: [-90.0; 2],
                raised: SEAT + self.girth_m(0.085) / self.height_m - HIP,
                tilted: 0.0,
            },
            Posture::Walk => {
                let spread = (HIP_SWINGS_DEG * stride.width).to_radians() * sin;
                Stance {
                    shoulders_deg: SIDES.map(|side| -side * ARM_SWINGS_DEG * stride.width * sin),
                    elbows_deg: [ELBOW_BENDS_DEG; 2],
                    hips_deg: SIDES.map(|side| side * HIP_SWINGS_DEG * stride.width * sin),
                    // A knee bends while its leg swings forward.
                    knees_deg: SIDES
                        .map(|side| -KNEE_BENDS_DEG * stride.width * (side * cos).max(0.0)),
                    raised: (HIP - ANKLE) * (libm::cos(spread) - 1.0),
                    tilted: 0.0,
                }
            }
        }
    }

    /// The segments, in the order of [`Self::names`]: standing on the origin, the front towards +x.
    pub(crate) fn segments(&self, moment: &Moment) -> [Ellipsoid; SEGMENTS] {
        let from = self.stance(moment.from, moment.stride);
        let stance = match moment.from == moment.to {
            true => from,
            false => from.toward(&self.stance(moment.to, moment.stride), moment.share),
        };
        let legs = [0, 1].map(|side| self.leg(side, &stance));
        let arms = [0, 1].map(|side| self.arm(side, &stance));
        let trunk = self.trunk();
        let up_m = DVec3::new(0.0, 0.0, stance.raised * self.height_m);
        let mut all = [trunk[0]; SEGMENTS];
        for (segment, found) in all.iter_mut().zip(
            trunk
                .into_iter()
                .chain((0..3).flat_map(|part| [arms[0][part], arms[1][part]]))
                .chain((0..3).flat_map(|part| [legs[0][part], legs[1][part]])),
        ) {
            *segment = found.turned(DMat3::IDENTITY, up_m);
        }
        match moment.head_to {
            None if moment.from == Posture::Lie => {
                let on_the_back = DMat3::from_cols(DVec3::Z, DVec3::NEG_Y, DVec3::X);
                let below_m = self.girth_m(0.14)
                    + 0.01 * self.height_m
                    + 1.1 * self.clothing.layer().thickness_m;
                let moved_m = DVec3::new(-0.5 * self.height_m, 0.0, below_m);
                all.map(|segment| segment.turned(on_the_back, moved_m))
            }
            Some(head_to) if stance.tilted > 0.0 => {
                // About the feet, over the middle of the body, its lowest point on the floor.
                let along = DMat3::from_cols(head_to, DVec3::Z.cross(head_to), DVec3::Z);
                let tilt = along * rotation_y_deg(90.0 * stance.tilted) * along.transpose();
                let tilted = all.map(|segment| segment.turned(tilt, DVec3::ZERO));
                let bottoms_m = tilted.iter().map(Ellipsoid::bottom_m);
                let lowest_m = bottoms_m.fold(f64::INFINITY, f64::min);
                let level = tilt.z_axis.with_z(0.0);
                let moved_m = -lowest_m * DVec3::Z - 0.5 * self.height_m * level;
                tilted.map(|segment| segment.turned(DMat3::IDENTITY, moved_m))
            }
            _ => all,
        }
    }

    /// What the segments are called.
    pub(crate) fn names() -> impl Iterator<Item = &'static str> {
        COVERS.iter().map(|(name, _, _)| *name)
    }

    fn girth_m(&self, at_mean_m: f64) -> f64 {
        at_mean_m * self.girth * self.height_m / GIRTHS_OF_M
    }

    /// An upright segment: its center and semi-axes, lengths as shares of stature, girths in meters of the mean adult.
    fn upright(
        &self,
        center: [f64; 3],
        [deep_m, wide_m]: [f64; 2],
        tall: f64,
        layer_m: f64,
    ) -> Ellipsoid {
        let half_m = DVec3::new(
            self.girth_m(deep_m) + layer_m,
            self.girth_m(wide_m) + layer_m,
            tall * self.height_m,
        );
        Ellipsoid {
            center_m: DVec3::from_array(center) * self.height_m,
            axes_m: DMat3::from_diagonal(half_m),
        }
    }

    fn trunk(&self) -> [Ellipsoid; 6] {
        // A head is hardly thicker in a stout person.
        let head = Self {
            girth: 1.0,
            ..*self
        };
        let layer_m = self.clothing.layer().thickness_m;
        let hat_m = layer_m * (self.clothing.clo - HAT_FROM_CLO).clamp(0.0, 1.0);
        [
            head.upright([-0.01, 0.0, 0.945], [0.092, 0.077], 0.055, hat_m),
            head.upright([0.010, 0.0, 0.906], [0.050, 0.060], 0.032, 0.0),
            head.upright([0.0, 0.0, 0.855], [0.058, 0.058], 0.02, 0.0),
            self.upright([-0.01, 0.0, 0.80], [0.135, 0.26], 0.05, layer_m),
            self.upright([0.0, 0.0, 0.715], [0.120, 0.165], 0.12, layer_m),
            self.upright([0.0, 0.0, 0.545], [0.115, 0.170], 0.095, layer_m),
        ]
    }

    /// Upper arm, forearm and hand of a side.
    fn arm(&self, side: usize, stance: &Stance) -> [Ellipsoid; 3] {
        let y = SIDES[side] * SHOULDER_ASIDE;
        let (shoulder_deg, elbow_deg) = (stance.shoulders_deg[side], stance.elbows_deg[side]);
        let Layer {
            sleeve_clo,
            thickness_m: layer_m,
            ..
        } = self.clothing.layer();
        let sleeve_m = if sleeve_clo > 0.0 { layer_m } else { 0.0 };
        self.limb(
            [[0.0, y, SHOULDER], [0.0, y, ELBOW]],
            [shoulder_deg, shoulder_deg + elbow_deg],
            [
                self.upright([0.0, y, 0.73], [0.055, 0.055], 0.105, layer_m),
                self.upright([0.0, y, 0.555], [0.042, 0.042], 0.083, sleeve_m),
                self.upright([0.0, y, 0.445], [0.042, 0.022], 0.042, 0.0),
            ],
        )
    }

    /// Thigh, shank and foot of a side.
    fn leg(&self, side: usize, stance: &Stance) -> [Ellipsoid; 3] {
        let y = SIDES[side] * HIP_ASIDE;
        let layer_m = self.clothing.layer().thickness_m;
        let (hip_deg, knee_deg) = (stance.hips_deg[side], stance.knees_deg[side]);
        self.limb(
            [[0.0, y, HIP], [0.0, y, KNEE]],
            [hip_deg, hip_deg + knee_deg],
            [
                self.upright([0.0, y, 0.4], [0.085, 0.080], 0.125, layer_m),
                self.upright([0.0, y, 0.165], [0.058, 0.055], 0.135, layer_m),
                self.upright([0.03, y, 0.022], [0.135, 0.048], 0.022, 0.0),
            ],
        )
    }

    /// Swings a limb's three segments forward about its first joint, the last two about the second as well.
    fn limb(
        &self,
        joints: [[f64; 3]; 2],
        forward_deg: [f64; 2],
        [first, second, third]: [Ellipsoid; 3],
    ) -> [Ellipsoid; 3] {
        let [upper_m, middle_m] = joints.map(|joint| DVec3::from_array(joint) * self.height_m);
        let [upper, lower] = forward_deg.map(|degrees| rotation_y_deg(-degrees));
        let swung = upper * (middle_m - upper_m) + upper_m;
        let about = |segment: Ellipsoid, turn: DMat3, from_m: DVec3, to_m: DVec3| {
            segment.turned(turn, to_m - turn * from_m)
        };
        [
            about(first, upper, upper_m, upper_m),
            about(second, lower, middle_m, swung),
            about(third, lower, middle_m, swung),
        ]
    }

    /// How each segment looks in a room of this temperature, by the physical model.
    pub(crate) fn surfaces(&self, ambient_c: f64) -> [Surface; SEGMENTS] {
        let layer = self.clothing.layer();
        let mut last = (None, 0.0);
        COVERS.map(|(_, cover, warmer_c)| {
            let clo = match cover {
                Cover::Skin => 0.0,
                Cover::Hair => layer.hair_clo,
                Cover::Top => layer.top_clo,
                Cover::Sleeve => layer.sleeve_clo,
                Cover::Middle => layer.middle_clo,
                Cover::Legs => layer.legs_clo,
                Cover::Shoe => SHOE_CLO,
            };
            let emissivity = if clo > 0.0 { TEXTILE } else { SKIN };
            // A search takes long, and neighbors and both sides are covered alike.
            if last.0 != Some((clo, warmer_c)) {
                let celsius = self.outside_c(clo, warmer_c, ambient_c);
                last = (Some((clo, warmer_c)), celsius);
            }
            Surface {
                celsius: last.1,
                emissivity,
            }
        })
    }

    /// The temperature of the outside of clothes, °C: the heat that passes them leaves them (ISO 7730:2005, eq. 2).
    fn outside_c(&self, clo: f64, warmer_c: f64, ambient_c: f64) -> f64 {
        let metabolic = match self.posture {
            Posture::Walk => 1.7 * MET,
            Posture::Stand => 1.2 * MET,
            Posture::Sit => MET,
            Posture::Lie => 0.8 * MET,
        };
        let skin_c = 35.7 - 0.028 * metabolic + warmer_c;
        let insulation = 0.155 * clo;
        let area = if insulation < 0.078 {
            1.0 + 1.29 * insulation
        } else {
            1.05 + 0.645 * insulation
        };
        // Air past the body by its own movement (ISO 7730, annex C).
        let air_m_per_s = AIR_M_PER_S + 0.0052 * (metabolic - 58.0).max(0.0);
        let forced = 12.1 * air_m_per_s.sqrt();
        let calm_k = 0.99 * (forced / 2.38).powi(4);
        let kelvin4 = |celsius: f64| {
            let squared = (celsius + 273.0) * (celsius + 273.0);
            squared * squared
        };
        let (mut low, mut high) = (ambient_c.min(skin_c), ambient_c.max(skin_c));
        for _ in 0..HALVINGS {
            let middle = 0.5 * (low + high);
            let apart = (middle - ambient_c).abs();
            // Roots take most of the time, and rising air matters only around warm skin.
            let moved = if apart < calm_k {
                forced
            } else {
                forced.max(2.38 * apart.sqrt().sqrt())
            };
            let lost = 3.96e-8 * area * (kelvin4(middle) - kelvin4(ambient_c))
                + area * moved * (middle - ambient_c);
            if skin_c - insulation * lost > middle {
                low = middle;
            } else {
                high = middle;
            }
        }
        0.5 * (low + high)
    }
}

/// What covers each part, by the outfit's insulation. ISO 9920 counts the bare head and hands in an outfit's; what is
/// covered is insulated better, the legs by the air in their trousers.
#[derive(Debug, Clone, Copy)]
struct Layer {
    clo: f64,
    hair_clo: f64,
    top_clo: f64,
    sleeve_clo: f64,
    middle_clo: f64,
    legs_clo: f64,
    thickness_m: f64,
}

const fn layer(clo: f64, by_part: [f64; 5], thickness_m: f64) -> Layer {
    let [hair_clo, top_clo, sleeve_clo, middle_clo, legs_clo] = by_part;
    Layer {
        clo,
        hair_clo,
        top_clo,
        sleeve_clo,
        middle_clo,
        legs_clo,
        thickness_m,
    }
}

/// **Assumption**: chosen with two recorded walkers in view (`scenes/PEOPLE.md`).
const LAYERS: [Layer; 4] = [
    layer(0.0, [1.0, 0.0, 0.0, 0.0, 0.0], 0.0),
    layer(0.5, [1.0, 0.7, 0.0, 1.2, 1.6], 0.003),
    layer(1.0, [1.0, 1.5, 1.6, 1.7, 1.9], 0.01),
    layer(2.0, [1.8, 2.7, 2.7, 2.7, 2.4], 0.03),
];

impl Clothing {
    /// The most that [`Self::clo`] may be: arctic clothes.
    pub const CLO_MAX: f64 = 4.0;
    /// Trousers and a T-shirt; forearms are bare.
    pub const LIGHT: Self = Self { clo: 0.5 };
    /// Trousers, shirt and sweater.
    pub const INDOOR: Self = Self { clo: 1.0 };
    /// The same under a coat, and a hat or hood.
    pub const COAT: Self = Self { clo: 2.0 };
    /// What a file calls them.
    pub const NAMES: [(&str, Self); 3] = [
        ("light", Self::LIGHT),
        ("indoor", Self::INDOOR),
        ("coat", Self::COAT),
    ];

    /// Between the two outfits on either side, or on their line beyond the last.
    fn layer(self) -> Layer {
        let after = LAYERS.iter().position(|layer| layer.clo > self.clo);
        let after = after.unwrap_or(LAYERS.len() - 1);
        let [less, more] = [LAYERS[after - 1], LAYERS[after]];
        let share = (self.clo - less.clo) / (more.clo - less.clo);
        let between = |of: fn(&Layer) -> f64| of(&less) + share * (of(&more) - of(&less));
        Layer {
            clo: self.clo,
            hair_clo: between(|layer| layer.hair_clo),
            top_clo: between(|layer| layer.top_clo),
            sleeve_clo: between(|layer| layer.sleeve_clo),
            middle_clo: between(|layer| layer.middle_clo),
            legs_clo: between(|layer| layer.legs_clo),
            thickness_m: between(|layer| layer.thickness_m),
        }
    }
}

/// Every segment in the paper's model: with law B, that came closest to real frames with bodies of 28 to 30 °C; the
/// emissivity is that of fabrics (PeerJ CS 11:e3124, "Perceived temperature calculation").
pub(crate) const PAPER: Surface = Surface {
    celsius: 29.0,
    emissivity: 0.8,
};

/// Emissivities from 8 to 14 µm, textbook values.
const SKIN: f64 = 0.98;
const TEXTILE: f64 = 0.95;
/// One met, W/m² (ISO 7730).
const MET: f64 = 58.15;
const AIR_M_PER_S: f64 = 0.1;
/// **Assumption**.
const SHOE_CLO: f64 = 2.0;
/// What is more is on the head too.
const HAT_FROM_CLO: f64 = 1.0;
/// Halves what is open to less than a millionth of a degree.
const HALVINGS: u32 = 32;
