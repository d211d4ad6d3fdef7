//! Problems without friction, and their solution by trying every set of places: slow, and too simple to be wrong.

use twinrig_contact::{Bound, Problem};

/// `w = G z + b` with bounds.
#[derive(Debug, Clone)]
pub struct Case {
    pub g: Vec<Vec<f64>>,
    pub b: Vec<f64>,
    pub bounds: Vec<Bound>,
}

impl Case {
    /// `G = J Jᵀ + softness`.
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

    /// Sets a problem that may have been another one before.
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

    /// A solution, if there is one. Solutions of a positive semidefinite problem without lines in them have one among them
    /// that a set of independent rows holds; so a singular system may be passed over.
    pub fn solution(&self) -> Option<Vec<f64>> {
        let n = self.len();
        let mut places = vec![0; n];
        loop {
            if let Some(z) = self.at_places(&places)
                && self.holds(&z)
            {
                return Some(z);
            }
            // Count up: 0 free to move, 1 at the low end (or not at all), 2 at the high end.
            let mut row = 0;
            loop {
                if row == n {
                    return None;
                }
                places[row] += 1;
                if places[row] <= usize::from(matches!(self.bounds[row], Bound::Between { .. })) + 1
                {
                    break;
                }
                places[row] = 0;
                row += 1;
            }
        }
    }

    fn at_places(&self, places: &[usize]) -> Option<Vec<f64>> {
        let mut z: Vec<f64> = self
            .bounds
            .iter()
            .zip(places)
            .map(|(bound, place)| match (bound, place) {
                (Bound::Between { low, .. }, 1) => *low,
                (Bound::Between { high, .. }, 2) => *high,
                _ => 0.0,
            })
            .collect();
        let moving: Vec<usize> = (0..self.len()).filter(|&i| places[i] == 0).collect();
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

    /// Whether the conditions hold, each checked as it is written.
    pub fn holds(&self, z: &[f64]) -> bool {
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

/// Gauss–Jordan with complete exchange of rows; none for a singular system.
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
