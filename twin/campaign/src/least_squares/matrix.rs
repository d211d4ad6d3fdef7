//! Symmetric matrices of a few parameters.

/// Solves A x = b for a symmetric, positive definite A, row by row; none if it is not.
pub(super) fn solve(matrix: &[Vec<f64>], right: &[f64]) -> Option<Vec<f64>> {
    let factor = cholesky(matrix)?;
    let size = right.len();
    let mut solution = right.to_vec();
    for row in 0..size {
        for column in 0..row {
            solution[row] -= factor[row][column] * solution[column];
        }
        solution[row] /= factor[row][row];
    }
    for row in (0..size).rev() {
        for below in row + 1..size {
            solution[row] -= factor[below][row] * solution[below];
        }
        solution[row] /= factor[row][row];
    }
    Some(solution)
}

/// Returns the lower triangle L with A = L Lᵀ; none if A is not positive definite.
fn cholesky(matrix: &[Vec<f64>]) -> Option<Vec<Vec<f64>>> {
    let size = matrix.len();
    let mut factor = vec![vec![0.0; size]; size];
    for row in 0..size {
        for column in 0..=row {
            let before = factor[row].iter().zip(&factor[column]).take(column);
            let known: f64 = before.map(|(one, other)| one * other).sum();
            let sum = matrix[row][column] - known;
            if row == column {
                if !(sum.is_finite() && sum > 0.0) {
                    return None;
                }
                factor[row][row] = sum.sqrt();
            } else {
                factor[row][column] = sum / factor[column][column];
            }
        }
    }
    Some(factor)
}
