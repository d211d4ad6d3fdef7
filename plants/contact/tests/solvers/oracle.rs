//! Frictionless problems, solved by enumeration of all active sets: slow, but simple enough to
//! serve as a reference.

use twinrig_contact::{Bound, Problem};

/// `w = G z + b` with bounds.
#[derive(Debug, Clone)]
pub struct Case {
    pub g: Vec<Vec<f64>>,
    pub b: Vec<f64>,
    pub bounds: Vec<Bound>,
}

impl Case {
    /// Creates a case with `G = J Jᵀ + softness · I`.
    pub fn new(j: &[Vec<f64>], b: Vec<f64>, bounds: Vec<Bound>, softness: f64) -> Self {
        let product = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let mut g: Vec<Vec<f64>> = j
            .iter()
            .map(|a| j.iter().map(|b| product(a, b)).collect())
            .collect();
        for (i, row) in g.iter_mut().enumerate() {
            row[i] += softness;
        }
        Self { g, b, bounds }
    }

    pub fn len(&self) -> usize {
        self.b.len()
    }

    pub fn problem(&self) -> Problem {
        let mut problem = Problem::default();
        self.fill(&mut problem);
        problem
    }

    /// Overwrites a problem, which may have held another case before.
    pub fn fill(&self, problem: &mut Problem) {
        problem.reset(self.len());
        for (i, row) in self.g.iter().enumerate() {
            for (j, &entry) in row.iter().enumerate() {
                problem.set(i, j, entry);
            }
            problem.offset(i, self.b[i]);
            if self.bounds[i] != Bound::DiscSecond {
                problem.bound(i, self.bounds[i]);
            }
        }
    }

    pub fn times_g(&self, z: &[f64]) -> Vec<f64> {
        self.g
            .iter()
            .map(|row| row.iter().zip(z).map(|(g, z)| g * z).sum())
            .collect()
    }

    pub fn w(&self, z: &[f64]) -> Vec<f64> {
        let moved = self.times_g(z);
        moved.iter().zip(&self.b).map(|(m, b)| m + b).collect()
    }

    /// Returns a solution, if one exists. The solutions of a positive semidefinite problem that
    /// contain no line include one with linearly independent active rows, so singular systems may
    /// be skipped.
    pub fn solution(&self) -> Option<Vec<f64>> {
        let n = self.len();
        let mut states = vec![0; n];
        loop {
            if let Some(z) = self.with_active_set(&states)
                && self.satisfies_conditions(&z)
            {
                return Some(z);
            }
            // Count up: 0 inside the bound, 1 at the lower bound (or zero), 2 at the upper bound.
            let mut row = 0;
            loop {
                if row == n {
                    return None;
                }
                states[row] += 1;
                if states[row] <= usize::from(matches!(self.bounds[row], Bound::Between { .. })) + 1
                {
                    break;
                }
                states[row] = 0;
                row += 1;
            }
        }
    }

    fn with_active_set(&self, states: &[usize]) -> Option<Vec<f64>> {
        let mut z: Vec<f64> = self
            .bounds
            .iter()
            .zip(states)
            .map(|(bound, state)| match (bound, state) {
                (Bound::Between { low, .. }, 1) => *low,
                (Bound::Between { high, .. }, 2) => *high,
                _ => 0.0,
            })
            .collect();
        let moving: Vec<usize> = (0..self.len()).filter(|&i| states[i] == 0).collect();
        let known = self.w(&z);
        let mut rows: Vec<Vec<f64>> = moving
            .iter()
            .map(|&i| {
                let mut row: Vec<f64> = moving.iter().map(|&j| self.g[i][j]).collect();
                row.push(-known[i]);
                row
            })
            .collect();
        for (&i, value) in moving.iter().zip(eliminate(&mut rows)?) {
            z[i] = value;
        }
        Some(z)
    }

    /// Returns whether the conditions hold, each checked by its definition.
    pub fn satisfies_conditions(&self, z: &[f64]) -> bool {
        const NEAR: f64 = 1e-8;
        let w = self.w(z);
        self.bounds
            .iter()
            .zip(z)
            .zip(&w)
            .all(|((bound, &z), &w)| match *bound {
                Bound::Free => w.abs() < NEAR,
                Bound::NonNegative => z > -NEAR && w > -NEAR && (z < NEAR || w < NEAR),
                Bound::Between { low, high } => {
                    z > low - NEAR
                        && z < high + NEAR
                        && (w < NEAR || z < low + NEAR)
                        && (w > -NEAR || z > high - NEAR)
                }
                Bound::Disc { .. } | Bound::DiscSecond => unreachable!("no friction here"),
            })
    }
}

/// Solves by Gauss–Jordan elimination with row exchange; returns `None` for a singular system.
fn eliminate(rows: &mut [Vec<f64>]) -> Option<Vec<f64>> {
    let n = rows.len();
    for column in 0..n {
        let pivot =
            (column..n).max_by(|&a, &b| rows[a][column].abs().total_cmp(&rows[b][column].abs()))?;
        rows.swap(column, pivot);
        if rows[column][column].abs() < 1e-7 {
            return None;
        }
        let pivot_row = rows[column].clone();
        for (i, row) in rows.iter_mut().enumerate() {
            if i != column {
                let factor = row[column] / pivot_row[column];
                for (x, p) in row.iter_mut().zip(&pivot_row) {
                    *x -= factor * p;
                }
            }
        }
    }
    Some((0..n).map(|i| rows[i][n] / rows[i][i]).collect())
}
