//! Small dense linear systems over any [`Real`] type.

use crate::model::real::Real;

/// Solves A x = b by Gaussian elimination with partial pivoting; A by rows. Overwrites A, and b
/// with x.
pub(crate) fn solve<T: Real>(a: &mut [T], b: &mut [T]) {
    let n = b.len();
    for k in 0..n {
        let mut pivot = k;
        for i in k + 1..n {
            if a[i * n + k].plain().abs() > a[pivot * n + k].plain().abs() {
                pivot = i;
            }
        }
        if pivot != k {
            for j in k..n {
                a.swap(k * n + j, pivot * n + j);
            }
            b.swap(k, pivot);
        }
        let inverse = T::splat(1.0) / a[k * n + k];
        for i in k + 1..n {
            let factor = a[i * n + k] * inverse;
            for j in k + 1..n {
                let upper = a[k * n + j];
                a[i * n + j] -= factor * upper;
            }
            let known = b[k];
            b[i] -= factor * known;
        }
        a[k * n + k] = inverse;
    }
    for k in (0..n).rev() {
        let mut sum = b[k];
        for j in k + 1..n {
            sum -= a[k * n + j] * b[j];
        }
        b[k] = sum * a[k * n + k];
    }
}
