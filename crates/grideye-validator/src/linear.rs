//! Small dense linear algebra: symmetric matrices as rows.

pub(crate) type Matrix = Vec<Vec<f64>>;

pub(crate) fn zeros(size: usize) -> Matrix {
    vec![vec![0.0; size]; size]
}

/// Cholesky factor (lower triangle); `None` if the matrix is not positive definite.
pub(crate) fn cholesky(matrix: &Matrix) -> Option<Matrix> {
    let size = matrix.len();
    let mut lower = zeros(size);
    for row in 0..size {
        for column in 0..=row {
            let (above, this) = lower.split_at(row);
            let left = if column == row {
                &this[0]
            } else {
                &above[column]
            };
            let product: f64 = dot(&this[0][..column], &left[..column]);
            let rest = matrix[row][column] - product;
            lower[row][column] = if row == column {
                if rest.is_nan() || rest <= 0.0 {
                    return None;
                }
                rest.sqrt()
            } else {
                rest / lower[column][column]
            };
        }
    }
    Some(lower)
}

pub(crate) fn forward(lower: &Matrix, values: &mut [f64]) {
    for row in 0..lower.len() {
        let product = dot(&lower[row][..row], &values[..row]);
        values[row] = (values[row] - product) / lower[row][row];
    }
}

/// Solves `matrix · x = values` from the Cholesky factor.
pub(crate) fn solve(lower: &Matrix, values: &[f64]) -> Vec<f64> {
    let mut x = values.to_vec();
    forward(lower, &mut x);
    for row in (0..lower.len()).rev() {
        let product: f64 = (row + 1..lower.len())
            .map(|below| lower[below][row] * x[below])
            .sum();
        x[row] = (x[row] - product) / lower[row][row];
    }
    x
}

pub(crate) fn inverse(matrix: &Matrix) -> Option<Matrix> {
    let lower = cholesky(matrix)?;
    let size = matrix.len();
    let columns = (0..size).map(|place| {
        let mut unit = vec![0.0; size];
        unit[place] = 1.0;
        solve(&lower, &unit)
    });
    Some(columns.collect())
}

pub(crate) fn product(left: &Matrix, right: &Matrix) -> Matrix {
    let size = left.len();
    let mut product = zeros(size);
    for row in 0..size {
        for column in 0..size {
            product[row][column] = (0..size).map(|k| left[row][k] * right[k][column]).sum();
        }
    }
    product
}

/// Eigenvalues with unit eigenvectors, by Jacobi rotations.
pub(crate) fn eigen(matrix: &Matrix) -> Vec<(f64, Vec<f64>)> {
    let size = matrix.len();
    let mut a = matrix.clone();
    let mut vectors = zeros(size);
    for (place, row) in vectors.iter_mut().enumerate() {
        row[place] = 1.0;
    }
    for _ in 0..SWEEPS_MAX {
        let off: f64 = (0..size)
            .flat_map(|row| (0..row).map(move |column| (row, column)))
            .map(|(row, column)| a[row][column].powi(2))
            .sum();
        if off < 1e-30 {
            break;
        }
        for p in 0..size {
            for q in p + 1..size {
                rotate(&mut a, &mut vectors, p, q);
            }
        }
    }
    (0..size)
        .map(|place| {
            (
                a[place][place],
                vectors.iter().map(|row| row[place]).collect(),
            )
        })
        .collect()
}

/// Sixteen unknowns need about six sweeps; convergence is quadratic.
const SWEEPS_MAX: usize = 50;

fn rotate(a: &mut Matrix, vectors: &mut Matrix, p: usize, q: usize) {
    if a[p][q] == 0.0 {
        return;
    }
    let theta = (a[q][q] - a[p][p]) / (2.0 * a[p][q]);
    let sign = if theta < 0.0 { -1.0 } else { 1.0 };
    let t = sign / (theta.abs() + (theta * theta + 1.0).sqrt());
    let c = 1.0 / (t * t + 1.0).sqrt();
    let s = t * c;
    for row in a.iter_mut() {
        (row[p], row[q]) = (c * row[p] - s * row[q], s * row[p] + c * row[q]);
    }
    let (above, below) = a.split_at_mut(q);
    for (of_p, of_q) in above[p].iter_mut().zip(&mut below[0]) {
        (*of_p, *of_q) = (c * *of_p - s * *of_q, s * *of_p + c * *of_q);
    }
    for row in vectors.iter_mut() {
        (row[p], row[q]) = (c * row[p] - s * row[q], s * row[p] + c * row[q]);
    }
}

pub(crate) fn dot(left: &[f64], right: &[f64]) -> f64 {
    left.iter()
        .zip(right)
        .map(|(left, right)| left * right)
        .sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn matrix() -> Matrix {
        vec![
            vec![4.0, 1.0, -2.0],
            vec![1.0, 3.0, 0.5],
            vec![-2.0, 0.5, 5.0],
        ]
    }

    #[test]
    fn the_inverse_undoes_the_matrix() {
        let unit = product(&matrix(), &inverse(&matrix()).unwrap());
        for (row, values) in unit.iter().enumerate() {
            for (column, value) in values.iter().enumerate() {
                let expected = f64::from(u8::from(row == column));
                assert!((value - expected).abs() < 1e-14, "{unit:?}");
            }
        }
        let indefinite = vec![vec![1.0, 2.0], vec![2.0, 1.0]];
        assert!(inverse(&indefinite).is_none());
    }

    #[test]
    fn the_matrix_only_scales_its_eigenvectors() {
        let pairs = eigen(&matrix());
        assert!((pairs.iter().map(|(value, _)| value).sum::<f64>() - 12.0).abs() < 1e-12);
        for (value, vector) in pairs {
            for (row, entry) in matrix().iter().zip(&vector) {
                assert!((dot(row, &vector) - value * entry).abs() < 1e-12);
            }
        }
    }
}
