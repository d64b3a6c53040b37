//! Uncertainties of the unknowns.

use crate::calibrate::noise::{Freedom, Noise, Parts};
use crate::calibrate::solver::{Solution, normal_equations};
use crate::constants::{LJUNG_BOX, PART_MIN};
use crate::linear::{self, Matrix, dot, eigen, inverse, product, zeros};
use crate::numbers::count;
use grideye_frame::PIXELS;

/// Covariance of the estimates, in coordinates from 0 to 1.
#[derive(Debug, Clone)]
pub(crate) struct Uncertainty {
    /// Coordinates with an uncertainty; the others are at a bound, without effect or tangled.
    pub(crate) told: Vec<usize>,
    pub(crate) covariance: Matrix,
    pub(crate) freedom: Vec<f64>,
    pub(crate) at_bound: Vec<usize>,
    pub(crate) idle: Vec<usize>,
    /// Coordinates that only show as a sum or product with others.
    pub(crate) tangled: Vec<usize>,
    /// Factor on each variance because frames repeat each other or the scene misses most where it counts; 1 is none.
    pub(crate) widened: Vec<f64>,
    /// How much of each comes from its prior, 0 to 1 (one less the diagonal of the averaging kernel, Rodgers 2000).
    pub(crate) from_prior: Vec<f64>,
    pub(crate) used: Freedom,
    pub(crate) determined: Determined,
}

/// What the recording tells beyond priors and bounds, from the eigenvalues λ of the normal matrix in units of each law's
/// standard deviation: λ / (1 + λ) of a combination comes from the recording (Rodgers 2000, *Inverse Methods for
/// Atmospheric Sounding*, 2.4).
#[derive(Debug, Clone)]
pub(crate) struct Determined {
    /// Coordinates that have an effect and lie at no bound.
    pub(crate) places: Vec<usize>,
    /// The sum over all combinations.
    pub(crate) number: f64,
    /// How much of the least determined combination comes from the recording.
    pub(crate) least: f64,
    /// Its coefficients, by place, in units of `scales`.
    pub(crate) coefficients: Vec<f64>,
    /// Standard deviation of each coordinate before the recording.
    pub(crate) scales: Vec<f64>,
}

/// Standard deviation of a coordinate of which only the bounds are known.
pub(crate) const UNIFORM_SD: f64 = 0.288_675;

/// Eigenvalues of the scaled normal matrix below this share of the largest are rounding.
const EIGENVALUE_MIN: f64 = 1e-10;
/// Most frames between two scores that are tested for repetition.
const LAGS: usize = 10;

impl Uncertainty {
    pub(crate) fn of(
        solution: &Solution,
        noise: &Noise,
        used: &Freedom,
        is_common_mode_known: bool,
    ) -> Self {
        let [told, at_bound, idle, tangled] = sorted(solution);
        let columns = told
            .iter()
            .map(|&place| solution.jacobian[place].as_slice());
        let columns: Vec<&[f64]> = columns.collect();
        let parts = part_normals(&columns);
        let mut prior = zeros(columns.len());
        for (number, &place) in told.iter().enumerate() {
            prior[number][number] = solution.precisions[place];
        }
        let bread = inverse(&sum(&[&parts[0], &parts[1], &parts[2], &prior]));
        let bread = bread.unwrap_or_else(|| zeros(columns.len()));
        let share = |part| product(&product(&bread, part), &bread);
        let mut shares = parts.each_ref().map(share);
        let of_prior = share(&prior);
        let widened = widening(&columns, (&bread, &shares[1]), &solution.residuals);
        for (row, values) in shares[1].iter_mut().enumerate() {
            for (column, value) in values.iter_mut().enumerate() {
                *value *= (widened[row] * widened[column]).sqrt();
            }
        }
        let frames = solution.residuals.len() / (PIXELS + 1);
        let free = Freedom::of(frames, used);
        let together = if is_common_mode_known {
            1e6
        } else {
            let levels = noise.independent_levels() - 1.0;
            levels.max(1.0).min(free.together)
        };
        let of_parts = [free.pattern, free.white, together];
        let freedom = (0..columns.len()).map(|place| {
            let variances = shares.each_ref().map(|share| share[place][place]);
            let sum: f64 = variances.iter().sum::<f64>() + of_prior[place][place];
            let parts = variances.iter().zip(of_parts);
            let squares: f64 = parts
                .map(|(variance, freedom)| variance * variance / freedom)
                .sum();
            if squares > 0.0 {
                sum * sum / squares
            } else {
                f64::INFINITY
            }
        });
        Self {
            freedom: freedom.collect(),
            from_prior: (0..columns.len())
                .map(|place| (bread[place][place] * prior[place][place]).min(1.0))
                .collect(),
            determined: Determined::of(solution, &at_bound, &idle),
            told,
            covariance: sum(&[&shares[0], &shares[1], &shares[2], &of_prior]),
            at_bound,
            idle,
            tangled,
            widened,
            used: parts_used(&parts, &bread),
        }
    }
}

/// Coordinates with an uncertainty, at a bound, without effect, and tangled.
fn sorted(solution: &Solution) -> [Vec<usize>; 4] {
    let (mut normal, _) = normal_equations(&solution.jacobian, &solution.residuals);
    let sizes = (0..normal.len()).map(|place| normal[place][place]);
    let least = EIGENVALUE_MIN * sizes.fold(f64::MIN_POSITIVE, f64::max);
    let is_at_bound = |&place: &usize| solution.point[place] <= 0.0 || solution.point[place] >= 1.0;
    let (at_bound, inside): (Vec<usize>, Vec<usize>) = (0..normal.len()).partition(is_at_bound);
    let is_idle = |&place: &usize| normal[place][place] <= least;
    let (idle, active): (Vec<usize>, Vec<usize>) = inside.into_iter().partition(is_idle);
    for (place, precision) in solution.precisions.iter().enumerate() {
        normal[place][place] += precision;
    }
    let tangled = tangled(&normal, &active);
    let told = active.into_iter().filter(|place| !tangled.contains(place));
    [told.collect(), at_bound, idle, tangled]
}

/// JᵀJ of each of the three parts.
fn part_normals(columns: &[&[f64]]) -> [Matrix; 3] {
    let split: Vec<[&[f64]; 3]> = columns.iter().map(|column| Parts::split(column)).collect();
    std::array::from_fn(|part| {
        let entries = |row: &[&[f64]; 3]| {
            let columns = split.iter();
            columns.map(|column| dot(row[part], column[part])).collect()
        };
        split.iter().map(entries).collect()
    })
}

impl Determined {
    fn of(solution: &Solution, at_bound: &[usize], idle: &[usize]) -> Self {
        let (normal, _) = normal_equations(&solution.jacobian, &solution.residuals);
        let is_active = |place: &usize| !at_bound.contains(place) && !idle.contains(place);
        let places: Vec<usize> = (0..normal.len()).filter(is_active).collect();
        let scale = |place: &usize| match solution.precisions[*place] {
            0.0 => UNIFORM_SD,
            precision => 1.0 / precision.sqrt(),
        };
        let scales: Vec<f64> = places.iter().map(scale).collect();
        let rows = places.iter().zip(&scales).map(|(&row, of_row)| {
            let entries = places.iter().zip(&scales);
            entries
                .map(|(&column, of_column)| of_row * normal[row][column] * of_column)
                .collect()
        });
        let pairs = eigen(&rows.collect());
        let share = |value: f64| value.max(0.0) / (1.0 + value.max(0.0));
        let number = pairs.iter().map(|(value, _)| share(*value)).sum();
        let least = pairs
            .into_iter()
            .min_by(|(one, _), (other, _)| one.total_cmp(other));
        let (value, coefficients) = least.unwrap_or_default();
        Self {
            places,
            number,
            least: share(value),
            coefficients,
            scales,
        }
    }
}

fn sum(parts: &[&Matrix]) -> Matrix {
    let mut sum = zeros(parts[0].len());
    for (row, values) in sum.iter_mut().enumerate() {
        for (column, value) in values.iter_mut().enumerate() {
            *value = parts.iter().map(|part| part[row][column]).sum();
        }
    }
    sum
}

/// Degrees of freedom that the unknowns use up in each part: the trace of its share in the projection.
fn parts_used(parts: &[Matrix; 3], bread: &Matrix) -> Freedom {
    let trace = |part: &Matrix| {
        part.iter()
            .zip(bread)
            .map(|(part, bread)| dot(part, bread))
            .sum()
    };
    let [pattern, white, together] = parts.each_ref().map(trace);
    Freedom {
        pattern,
        white,
        together,
    }
}

/// Coordinates along a direction in which nothing changes.
fn tangled(normal: &Matrix, active: &[usize]) -> Vec<usize> {
    let scale = |place: usize| normal[place][place].sqrt();
    let entry = |row: usize, column: usize| normal[row][column] / scale(row) / scale(column);
    let row = |&row: &usize| active.iter().map(|&column| entry(row, column)).collect();
    let mut tangled = Vec::new();
    for (value, vector) in eigen(&active.iter().map(row).collect()) {
        if value <= EIGENVALUE_MIN * count(active.len()) {
            let parts = active.iter().zip(&vector);
            let part = parts.filter(|(_, share)| share.abs() > PART_MIN);
            tangled.extend(part.map(|(&place, _)| place));
        }
    }
    tangled.sort_unstable();
    tangled.dedup();
    tangled
}

/// Factor on each variance: from scores that repeat between neighboring frames, unless by chance, and from scores larger
/// than noise makes them, as where a body moves that the scene has not quite right (White 1980, Econometrica 48:817).
fn widening(
    columns: &[&[f64]],
    (bread, variances): (&Matrix, &Matrix),
    residuals: &[f64],
) -> Vec<f64> {
    let [_, left_over, _] = Parts::split(residuals);
    let scores = |column: &&[f64]| -> Vec<f64> {
        let [_, white, _] = Parts::split(column);
        let frames = white
            .chunks_exact(PIXELS)
            .zip(left_over.chunks_exact(PIXELS));
        frames.map(|(column, left)| dot(column, left)).collect()
    };
    let scores: Vec<Vec<f64>> = columns.iter().map(scores).collect();
    let frames = scores.first().map_or(0, Vec::len);
    let pulls = |row: &Vec<f64>| -> Vec<f64> {
        let pull = |frame: usize| {
            let shares = row.iter().zip(&scores);
            shares.map(|(share, scores)| share * scores[frame]).sum()
        };
        (0..frames).map(pull).collect()
    };
    let factor = |(number, row): (usize, &Vec<f64>)| {
        let pulls = pulls(row);
        let larger = dot(&pulls, &pulls) / variances[number][number];
        repetition(&pulls) * if larger > 1.0 { larger } else { 1.0 }
    };
    bread.iter().enumerate().map(factor).collect()
}

/// Variance of a sum of these numbers over that of independent ones; 1 if no repetition is beyond chance.
fn repetition(pulls: &[f64]) -> f64 {
    let frames = count(pulls.len());
    let square = linear::dot(pulls, pulls);
    if square <= 0.0 || pulls.len() <= 2 * LAGS {
        return 1.0;
    }
    let (mut test, mut factor) = (0.0, 1.0);
    for lag in 1..=LAGS {
        let correlation = dot(&pulls[lag..], &pulls[..pulls.len() - lag]) / square;
        test += frames * (frames + 2.0) * correlation * correlation / (frames - count(lag));
        factor += 2.0 * (1.0 - count(lag) / count(LAGS + 1)) * correlation;
    }
    if test > LJUNG_BOX {
        f64::max(factor, 1.0)
    } else {
        1.0
    }
}

/// The 97.5 % quantile of Student's t (Abramowitz and Stegun, 26.7.5), within 2 % from three degrees of freedom.
pub(crate) fn student_97_5(freedom: f64) -> f64 {
    const Z: f64 = 1.959_963_985;
    let v = freedom.max(2.0);
    let z2 = Z * Z;
    Z + Z * (z2 + 1.0) / (4.0 * v)
        + Z * ((5.0 * z2 + 16.0) * z2 + 3.0) / (96.0 * v * v)
        + Z * (((3.0 * z2 + 19.0) * z2 + 17.0) * z2 - 15.0) / (384.0 * v * v * v)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_those_of_the_tables() {
        let table = [(3.0, 3.182), (5.0, 2.571), (10.0, 2.228), (30.0, 2.042)];
        for (freedom, quantile) in table.into_iter().chain([(1e9, 1.960)]) {
            let found = student_97_5(freedom);
            assert!((found / quantile - 1.0).abs() < 0.02, "{freedom}: {found}");
        }
    }

    #[test]
    fn repetition_counts_less_and_chance_does_not() {
        let slow: Vec<f64> = (0..200).map(|frame| (count(frame) / 15.0).sin()).collect();
        assert!(repetition(&slow) > 5.0);
        let turns: Vec<f64> = (0..200_u32)
            .map(|frame| f64::from(frame * 7919 % 1009) - 504.0)
            .collect();
        assert_eq!(repetition(&turns), 1.0);
    }

    #[test]
    fn directions_without_effect_are_found() {
        // The first two only show as a sum.
        let normal = vec![
            vec![2.0, 4.0, 0.0],
            vec![4.0, 8.0, 0.0],
            vec![0.0, 0.0, 1.0],
        ];
        assert_eq!(tangled(&normal, &[0, 1, 2]), [0, 1]);
        assert_eq!(tangled(&normal, &[0, 2]), Vec::<usize>::new());
    }
}
