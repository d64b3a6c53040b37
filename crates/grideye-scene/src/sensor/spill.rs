//! What pixels get of their neighbors' warmth.

use crate::geometry::count::float;
use crate::model::Sensor;

/// Gives a share of each pixel to all, by a Gaussian of their distance. What would go beyond the image's border stays in it,
/// as an even image must stay even.
pub(crate) fn spilled(celsius: Vec<f64>, sensor: &Sensor) -> Vec<f64> {
    if sensor.spill <= 0.0 {
        return celsius;
    }
    let rows: Vec<Vec<f64>> = celsius
        .chunks(sensor.columns.max(1))
        .map(|row| blurred(row, sensor.spill_px))
        .collect();
    let columns = (0..sensor.columns).map(|column| {
        let column: Vec<f64> = rows.iter().map(|row| row[column]).collect();
        blurred(&column, sensor.spill_px)
    });
    let columns: Vec<Vec<f64>> = columns.collect();
    let mixed = celsius.into_iter().enumerate().map(|(pixel, own)| {
        let (row, column) = (pixel / sensor.columns, pixel % sensor.columns);
        own + sensor.spill * (columns[column][row] - own)
    });
    mixed.collect()
}

fn blurred(line: &[f64], sd_px: f64) -> Vec<f64> {
    let weight = |apart: usize| libm::exp(-0.5 * (float(apart) / sd_px).powi(2));
    let weights: Vec<f64> = (0..line.len()).map(weight).collect();
    let at = |pixel: usize| {
        let (mut sum, mut whole) = (0.0, 0.0);
        for (other, value) in line.iter().enumerate() {
            let weight = weights[pixel.abs_diff(other)];
            sum += weight * value;
            whole += weight;
        }
        sum / whole
    };
    (0..line.len()).map(at).collect()
}
