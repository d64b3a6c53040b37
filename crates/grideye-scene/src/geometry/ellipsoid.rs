//! Ellipsoids: the round parts of a person, and how a pinhole sees one.

use crate::geometry::mesh::Mesh;
use crate::geometry::pose::Pose;
use glam::{DMat3, DVec3};
use std::f64::consts::PI;
use std::sync::LazyLock;

/// An ellipsoid, by its center and its semi-axes, meters.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Ellipsoid {
    pub(crate) center_m: DVec3,
    /// The semi-axes as columns, at right angles to one another.
    pub(crate) axes_m: DMat3,
}

/// The rays `(1, left, up)` that meet an ellipsoid: `ray · cone · ray >= 0` and `ray · inverse_depth > 0`.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Contour {
    cone: DMat3,
    /// Its product with a ray is one over the depth of the plane through the contour.
    pub(crate) inverse_depth: DVec3,
    /// The same of a plane as near as the surface is in the mean.
    pub(crate) of_surface: DVec3,
}

impl Ellipsoid {
    pub(crate) fn turned(&self, turn: DMat3, moved_m: DVec3) -> Self {
        Self {
            center_m: turn * self.center_m + moved_m,
            axes_m: turn * self.axes_m,
        }
    }

    /// How high its lowest point is, meters.
    pub(crate) fn bottom_m(&self) -> f64 {
        self.center_m.z - self.axes_m.row(2).length()
    }

    /// The same as flat faces, fewer than an object's: a person has many of these.
    pub(crate) fn mesh(&self) -> Mesh {
        static UNIT: LazyLock<Mesh> = LazyLock::new(|| Mesh::stack(DVec3::splat(2.0), 0.0, 8));
        let offset_m = self.center_m - self.axes_m.z_axis;
        UNIT.copied(self.axes_m, offset_m)
    }

    /// `None` if the sensor is inside.
    pub(crate) fn contour(&self, pose: &Pose) -> Option<Contour> {
        let sensor_from_world = pose.world_from_sensor().transpose();
        let axes_m = sensor_from_world * self.axes_m;
        let center_m = pose.point_in_sensor(self.center_m);
        // In these coordinates it is the unit sphere.
        let lengths2 = DVec3::new(
            axes_m.x_axis.length_squared(),
            axes_m.y_axis.length_squared(),
            axes_m.z_axis.length_squared(),
        );
        let to_unit = DMat3::from_diagonal(lengths2.recip()) * axes_m.transpose();
        let center = to_unit * center_m;
        let power = center.length_squared() - 1.0;
        if power <= 0.0 {
            return None;
        }
        let pole = to_unit.transpose() * center;
        let outer = DMat3::from_cols(pole * pole.x, pole * pole.y, pole * pole.z);
        // From the contour's plane to the top of the cap, a sphere's surface is two thirds of the way in the mean.
        let away = (power + 1.0).sqrt();
        let surface = away - 2.0 / 3.0 - 1.0 / (3.0 * away);
        Some(Contour {
            cone: outer - power * (to_unit.transpose() * to_unit),
            inverse_depth: pole / power,
            of_surface: pole / (away * surface),
        })
    }
}

impl Contour {
    /// Corners of a polygon as large as it is, as rays `(1, left, up)`; `None` if part of it is not in front of the sensor.
    pub(crate) fn outline(&self) -> Option<Vec<DVec3>> {
        const PAIRS: i32 = 6;
        let (low, high) = self.reach();
        let (middle, half) = (0.5 * (low + high), 0.5 * (high - low));
        if !half.is_finite() {
            return None;
        }
        // Its points at equal angles: those of a regular polygon, stretched.
        let angle = PI / f64::from(PAIRS);
        let ends: Vec<(f64, f64, f64)> = (0..PAIRS)
            .filter_map(|pair| {
                let up = middle - half * libm::cos(angle * (f64::from(pair) + 0.5));
                let (left, right) = self.across(up)?;
                Some((left, right, up))
            })
            .collect();
        let lefts = ends.iter().map(|(left, _, up)| DVec3::new(1.0, *left, *up));
        let rights = ends.iter().rev();
        let rights = rights.map(|(_, right, up)| DVec3::new(1.0, *right, *up));
        let corners: Vec<DVec3> = lefts.chain(rights).collect();
        let sum: DVec3 = corners.iter().sum();
        let center = sum / sum.x;
        let outside = (angle / libm::sin(angle)).sqrt();
        let outward = |corner: DVec3| center + outside * (corner - center);
        Some(corners.into_iter().map(outward).collect())
    }

    /// From where to where it reaches along the rays `(1, left, up)`.
    pub(crate) fn across(&self, up: f64) -> Option<(f64, f64)> {
        let cone = &self.cone;
        let ends = roots(
            cone.y_axis.y,
            cone.x_axis.y + cone.z_axis.y * up,
            cone.x_axis.x + up * (2.0 * cone.z_axis.x + up * cone.z_axis.z),
        )?;
        let ahead = |left: f64| {
            self.inverse_depth.x + self.inverse_depth.y * left + self.inverse_depth.z * up > 0.0
        };
        match ends {
            Ends::Between(low, high) => ahead(0.5 * (low + high)).then_some((low, high)),
            // The cone holds a ray to the side, so this line leaves it once before the sensor and once behind it.
            Ends::Beyond(_, high) if self.inverse_depth.y > 0.0 => Some((high, f64::INFINITY)),
            Ends::Beyond(low, _) => Some((f64::NEG_INFINITY, low)),
        }
    }

    /// From where to where it reaches upwards, as slopes; without end if part of it is not in front of the sensor.
    pub(crate) fn reach(&self) -> (f64, f64) {
        let cone = &self.cone;
        let (yy, xy, zy) = (cone.y_axis.y, cone.x_axis.y, cone.z_axis.y);
        let ends = roots(
            zy * zy - yy * cone.z_axis.z,
            xy * zy - yy * cone.z_axis.x,
            xy * xy - yy * cone.x_axis.x,
        );
        match ends {
            Some(Ends::Between(low, high)) if yy < 0.0 && self.inverse_depth.x > 0.0 => (low, high),
            _ => (f64::NEG_INFINITY, f64::INFINITY),
        }
    }
}

/// Where a quadratic is not below zero.
enum Ends {
    Between(f64, f64),
    /// Up to the first and from the second on.
    Beyond(f64, f64),
}

/// Of `square x² + 2 half x + constant`; `None` if it is below zero everywhere.
fn roots(square: f64, half: f64, constant: f64) -> Option<Ends> {
    let under = half * half - square * constant;
    if under <= 0.0 || square == 0.0 {
        return None;
    }
    // Without a difference of nearly equal numbers (Press et al., Numerical Recipes, 5.6).
    let sum = -(half + under.sqrt().copysign(half));
    let (one, other) = (sum / square, constant / sum);
    let (low, high) = (one.min(other), one.max(other));
    Some(if square < 0.0 {
        Ends::Between(low, high)
    } else {
        Ends::Beyond(low, high)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::angle::rotation_y_deg;

    fn inside(ellipsoid: &Ellipsoid, point_m: DVec3) -> f64 {
        (ellipsoid.axes_m.inverse() * (point_m - ellipsoid.center_m)).length_squared()
    }

    /// The least of the quadratic form along a ray ahead: below 1 if the ray meets the ellipsoid.
    fn nearest(ellipsoid: &Ellipsoid, pose: &Pose, left: f64, up: f64) -> f64 {
        let ray = pose.world_from_sensor() * DVec3::new(1.0, left, up);
        let steps = (1..20_000).map(|step| 2e-4 * f64::from(step));
        let at = steps.map(|depth| inside(ellipsoid, pose.position_m + depth * ray));
        at.fold(f64::INFINITY, f64::min)
    }

    #[test]
    fn the_contour_is_where_marched_rays_begin_to_miss() {
        let ellipsoid = Ellipsoid {
            center_m: DVec3::new(1.1, 2.1, 0.9),
            axes_m: rotation_y_deg(25.0) * DMat3::from_diagonal(DVec3::new(0.12, 0.24, 0.31)),
        };
        for (elevation, azimuth) in [(90.0, -90.0), (35.0, 20.0), (0.0, 80.0)] {
            let pose = Pose::from_degrees(DVec3::new(0.9, 1.7, 2.2), elevation, azimuth, 10.0);
            let contour = ellipsoid.contour(&pose).unwrap();
            let (low, high) = contour.reach();
            if !low.is_finite() {
                continue;
            }
            for share in [0.02, 0.3, 0.5, 0.9] {
                let up = low + share * (high - low);
                let (from, to) = contour.across(up).unwrap();
                for (edge, outward) in [(from, -1.0), (to, 1.0)] {
                    let seen = nearest(&ellipsoid, &pose, edge - 1e-3 * outward, up);
                    let missed = nearest(&ellipsoid, &pose, edge + 1e-3 * outward, up);
                    assert!(
                        seen < 1.0 && missed > 1.0,
                        "{elevation} {share}: {seen} {missed}"
                    );
                }
            }
            assert!(contour.across(low - 1e-6).is_none() && contour.across(high + 1e-6).is_none());
        }
    }

    #[test]
    fn what_surrounds_the_sensor_has_no_contour_and_what_is_behind_it_no_span() {
        let ball = Ellipsoid {
            center_m: DVec3::ZERO,
            axes_m: DMat3::from_diagonal(DVec3::splat(0.3)),
        };
        let at = |x: f64| Pose::from_degrees(DVec3::new(x, 0.0, 0.0), 0.0, 0.0, 0.0);
        assert!(ball.contour(&at(0.1)).is_none());
        let behind = ball.contour(&at(1.0)).unwrap();
        assert!(behind.across(0.0).is_none());
        let ahead = ball.contour(&at(-1.0)).unwrap();
        let (from, to) = ahead.across(0.0).unwrap();
        // The tangent of a ball of 0.3 m a meter away: tan(asin 0.3).
        let expected = 0.3 / (1.0_f64 - 0.09).sqrt();
        assert!((to - expected).abs() < 1e-12 && (from + expected).abs() < 1e-12);
    }
}
