//! The physical model: a thermopile behind a lens receives radiance, averaged over each pixel's response.
//!
//! `L_pixel = ∫ r L / ∫ r`, `L = e L_b(T) + (1 - e) L_b(T reflected)`, `T_pixel = L_b⁻¹(L_pixel)`. The response `r` is
//! a Gaussian over the angles to the left and upwards, which include any blur: half-response widths justify nothing
//! finer.
//!
//! Horizontal lines cut the image more finely than a pixel. Along a line the integral is exact; across, each line
//! stands for a 24th of the narrowest pixel, cut where an edge runs along it.

mod line;
mod map;
mod normal;
mod optics;

pub use crate::model::Optics;
pub use crate::radiometry::{Band, apparent_celsius};

use crate::geometry::Contour;
use crate::model::{Scene, Sensor};
use crate::picture::projection::Sight;
use crate::radiometry::{Light, Surface};
use line::{Face, Level, Line, Span, Step};
use optics::Eye;
use std::ops::Range;

#[derive(Debug, Clone)]
pub(crate) struct Physical {
    light: Light,
    eye: Eye,
    /// Slope of the field's left border.
    left_max: f64,
    /// Height of a band before cutting, radians.
    band_rad: f64,
    /// Upward angles between the bands, increasing; one more than there are bands.
    borders: Vec<f64>,
    still: Vec<Face>,
    /// The still bodies seen along the middle of each band, and the faces that reach it.
    lines: Vec<Line>,
    reaching: Vec<Vec<usize>>,
    /// Per pixel, above the ambient's radiance.
    still_excess: Vec<f64>,
}

#[derive(Debug, Clone)]
pub(crate) struct Shown {
    faces: Vec<Face>,
    /// Upward slopes at which to cut bands.
    levels: Vec<f64>,
}

const LINES_PER_WIDTH: f64 = 24.0;
/// Limit on bands before cutting; very narrow pixels then have fewer lines each.
const BANDS_MAX: f64 = 4096.0;
/// Cuts closer to a border than this share of a band are ignored.
const CUT_MIN: f64 = 1.0 / 64.0;

impl Physical {
    /// `standing` supplies the still bodies, once the spacing of the lines is known.
    pub(crate) fn new(
        scene: &Scene,
        sensor: &Sensor,
        standing: impl FnOnce(&Self) -> Vec<Shown>,
    ) -> Self {
        let eye = Eye::new(sensor);
        let width = eye.narrowest_up_rad() / LINES_PER_WIDTH;
        let bands = (2.0 * eye.field.y / width).ceil().clamp(1.0, BANDS_MAX);
        let count = crate::geometry::count::floor(bands);
        let even = (0..=count)
            .map(|band| eye.field.y * (2.0 * crate::geometry::count::float(band) / bands - 1.0))
            .collect();
        let mut physical = Self {
            light: Light::new(scene.band, scene.room.ambient_c, scene.reflected_c),
            left_max: libm::tan(eye.field.x),
            band_rad: 2.0 * eye.field.y / bands,
            still_excess: vec![0.0; eye.responses.len()],
            eye,
            borders: even,
            still: Vec::new(),
            lines: Vec::new(),
            reaching: Vec::new(),
        };
        let standing = standing(&physical);
        physical.build(standing);
        physical
    }

    /// Prepares a body for drawing; `glow` gives the surface of each of its faces.
    pub(crate) fn shown(
        &self,
        sight: &Sight,
        owner: u32,
        glow: impl Fn(Option<usize>) -> Surface,
    ) -> Shown {
        let mut levels = Vec::new();
        let faces = match sight {
            Sight::Inside(touching) => {
                let excess = self.light.excess(glow(None));
                vec![Face::all_around(touching, excess, owner)]
            }
            Sight::Outside(faces) => {
                let width = self.band_rad;
                line::levels(faces, (2.0 * width, width), &mut levels);
                let mut last = (None, 0.0);
                let shown = faces.iter().map(|face| {
                    let surface = glow(Some(face.face));
                    // Planck's law is slow, and most bodies have one temperature.
                    if last.0 != Some(surface) {
                        last = (Some(surface), self.light.excess(surface));
                    }
                    Face::new(face, last.1, owner)
                });
                shown.collect()
            }
        };
        Shown { faces, levels }
    }

    /// Prepares a round body for drawing; without a contour the sensor is inside.
    pub(crate) fn shown_round(
        &self,
        contour: Option<Contour>,
        owner: u32,
        surface: Surface,
    ) -> Shown {
        let excess = self.light.excess(surface);
        let face = match contour {
            None => Face::all_around(&[], excess, owner),
            Some(contour) => Face::round(contour, excess, owner),
        };
        Shown {
            levels: Vec::new(),
            faces: vec![face],
        }
    }

    pub(crate) fn celsius(&self, moving: &[Shown]) -> Vec<f64> {
        let mut excess = self.still_excess.clone();
        self.add(moving, |span| span.excess, true, &mut excess);
        excess
            .into_iter()
            .map(|excess| self.light.celsius(excess))
            .collect()
    }

    /// The share of each pixel's response on bodies whose owner counts.
    pub(crate) fn share(&self, moving: &[Shown], counts: impl Fn(u32) -> bool) -> Vec<f64> {
        let mut share = vec![0.0; self.still_excess.len()];
        let value = |span: &Span| f64::from(u8::from(counts(span.owner)));
        self.add(moving, value, false, &mut share);
        share
    }

    pub(crate) fn bare(&self) -> Self {
        Self {
            light: self.light,
            eye: self.eye.clone(),
            left_max: self.left_max,
            band_rad: self.band_rad,
            borders: self.borders.clone(),
            still: Vec::new(),
            lines: vec![Line::default(); self.lines.len()],
            reaching: vec![Vec::new(); self.reaching.len()],
            still_excess: vec![0.0; self.still_excess.len()],
        }
    }

    fn build(&mut self, standing: Vec<Shown>) {
        let cuts = self.cuts(&standing);
        self.borders = merged(&self.borders, &cuts, CUT_MIN * self.band_rad);
        self.still = standing.into_iter().flat_map(|shown| shown.faces).collect();
        let bands = self.borders.len().saturating_sub(1);
        self.reaching = vec![Vec::new(); bands];
        for (index, face) in self.still.iter().enumerate() {
            for band in self.bands(face) {
                self.reaching[band].push(index);
            }
        }
        let (mut scratch, mut steps) = (Vec::new(), Vec::new());
        for band in 0..bands {
            let ends = (self.borders[band], self.borders[band + 1]);
            let mut line = Line::default();
            self.draw_still(band, ends, &mut line, &mut scratch);
            line::steps(line.spans(), |span| span.excess, &[], &mut steps);
            to_angles(&mut steps);
            self.eye.add(&steps, ends, &mut self.still_excess);
            self.lines.push(line);
        }
    }

    fn cuts(&self, shown: &[Shown]) -> Vec<f64> {
        let levels = shown.iter().flat_map(|shown| &shown.levels);
        let mut cuts: Vec<f64> = levels
            .filter(|level| level.is_finite())
            .map(|level| libm::atan(*level))
            .collect();
        cuts.sort_by(f64::total_cmp);
        cuts
    }

    fn bands(&self, face: &Face) -> Range<usize> {
        let (low, high) = (libm::atan(face.up.0), libm::atan(face.up.1));
        let last = self.borders.len().saturating_sub(1);
        let first = self.borders.partition_point(|border| *border <= low);
        let end = self.borders.partition_point(|border| *border < high);
        first.saturating_sub(1)..end.min(last)
    }

    fn draw_still(&self, band: usize, ends: (f64, f64), line: &mut Line, scratch: &mut Vec<Span>) {
        line.clear();
        let level = Level::of(ends);
        for index in &self.reaching[band] {
            if let Some(span) = self.still[*index].span(&level, self.left_max) {
                line.insert(span, scratch);
            }
        }
    }

    /// Adds to each pixel a value of everything visible, including moving bodies; `less_still` subtracts the still
    /// bodies.
    fn add(
        &self,
        moving: &[Shown],
        value: impl Fn(&Span) -> f64,
        less_still: bool,
        pixels: &mut [f64],
    ) {
        let cuts = self.cuts(moving);
        let mut faces: Vec<(Range<usize>, &Face)> = moving
            .iter()
            .flat_map(|shown| &shown.faces)
            .map(|face| (self.bands(face), face))
            .filter(|(bands, _)| !bands.is_empty())
            .collect();
        faces.sort_by_key(|(bands, _)| bands.start);
        let first = faces.first().map_or(0, |(bands, _)| bands.start);
        let end = faces.iter().map(|(bands, _)| bands.end).max().unwrap_or(0);
        let mut buffers = LineBuffers::default();
        let (mut waiting, mut active) = (faces.into_iter().peekable(), Vec::new());
        for band in first..end {
            active.retain(|(bands, _): &(Range<usize>, &Face)| bands.end > band);
            while let Some(face) = waiting.next_if(|(bands, _)| bands.start <= band) {
                active.push(face);
            }
            if active.is_empty() {
                continue;
            }
            let parts = self.parts(band, &cuts);
            let is_whole = parts.len() == 2;
            for ends in parts.windows(2) {
                let ends = (ends[0], ends[1]);
                let level = Level::of(ends);
                if is_whole {
                    buffers.behind.copy_from(&self.lines[band]);
                } else {
                    self.draw_still(band, ends, &mut buffers.behind, &mut buffers.scratch);
                }
                buffers.seen.copy_from(&buffers.behind);
                for (_, face) in &active {
                    if let Some(span) = face.span(&level, self.left_max) {
                        buffers.seen.insert(span, &mut buffers.scratch);
                    }
                }
                let behind = if less_still {
                    buffers.behind.spans()
                } else {
                    &[]
                };
                line::steps(buffers.seen.spans(), &value, behind, &mut buffers.steps);
                to_angles(&mut buffers.steps);
                self.eye.add(&buffers.steps, ends, pixels);
            }
        }
    }

    fn parts(&self, band: usize, cuts: &[f64]) -> Vec<f64> {
        let ends = [self.borders[band], self.borders[band + 1]];
        let start = cuts.partition_point(|cut| *cut <= ends[0]);
        let count = cuts[start..].partition_point(|cut| *cut < ends[1]);
        merged(
            &ends,
            &cuts[start..start + count],
            CUT_MIN * (ends[1] - ends[0]),
        )
    }
}

#[derive(Default)]
struct LineBuffers {
    behind: Line,
    seen: Line,
    steps: Vec<Step>,
    scratch: Vec<Span>,
}

fn to_angles(steps: &mut [Step]) {
    for (at, _) in steps {
        *at = libm::atan(*at);
    }
}

/// The borders and those cuts between them that are farther than `apart` from their neighbors.
fn merged(borders: &[f64], cuts: &[f64], apart: f64) -> Vec<f64> {
    let mut all = Vec::with_capacity(borders.len() + cuts.len());
    let mut cuts = cuts.iter().peekable();
    for border in borders {
        while let Some(cut) = cuts.next_if(|cut| *cut < border) {
            let is_free = all.last().is_some_and(|last| cut - last > apart) && border - cut > apart;
            if is_free {
                all.push(*cut);
            }
        }
        all.push(*border);
    }
    all
}
