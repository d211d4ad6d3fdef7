//! A complementarity problem over a product of lines, rays, intervals and friction discs, and its solver.

use crate::dense::solve_in_place;

/// What an unknown may be.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Bound {
    /// Anything: `w = 0`.
    Free,
    /// `0 ≤ z ⊥ w ≥ 0`.
    NonNegative,
    /// `low ≤ z ≤ high`; `w` is zero inside, ≥ 0 at `low`, ≤ 0 at `high`.
    Between {
        /// Least value.
        low: f64,
        /// Greatest value.
        high: f64,
    },
    /// This unknown and the next are a friction force: `|z| ≤ friction · z[normal]`, with `w` against `z` where it slips
    /// (Coulomb; the principle of greatest dissipation).
    Disc {
        /// Index of the normal force.
        normal: usize,
        /// Coulomb coefficient.
        friction: f64,
    },
    /// The second component of the [`Bound::Disc`] before it.
    DiscSecond,
}

/// Where an unknown stands in its bound.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Place {
    Inside,
    Low,
    High,
    /// On the border of the disc, in this direction; the share is its radius over the distance of what it was projected
    /// from.
    Slipping {
        /// Unit vector.
        direction: [f64; 2],
        /// At most one.
        share: f64,
    },
}

/// `w = G z + b` with a bound for every unknown; its memory is kept from one use to the next.
#[derive(Debug, Clone, Default)]
pub struct Problem {
    matrix: Vec<f64>,
    offset: Vec<f64>,
    bounds: Vec<Bound>,
    unknowns: Vec<f64>,
    swept: Vec<f64>,
    places: Vec<Place>,
    free: Vec<usize>,
    reduced: Vec<f64>,
    right: Vec<f64>,
}

/// How a problem was solved.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Solution {
    /// Projected Gauss–Seidel sweeps.
    pub sweeps: u32,
    /// Direct solves.
    pub factorisations: u32,
    /// Greatest violation of the complementarity conditions, in units of `w`.
    pub residual: f64,
}

/// The solver found no solution.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[error("{size} complementarity conditions stay violated by {residual:e} after {sweeps} sweeps")]
pub struct Unsolved {
    /// Number of conditions.
    pub size: usize,
    /// Sweeps made.
    pub sweeps: u32,
    /// What is left, in units of `w`.
    pub residual: f64,
}

/// Accepted residual, relative to the greatest offset: what a direct solve leaves at the condition numbers that occur.
const TOLERANCE: f64 = 1e-9;

impl Problem {
    /// Starts a problem with `n` unknowns: all free, everything zero.
    pub fn reset(&mut self, n: usize) {
        self.matrix.clear();
        self.matrix.resize(n * n, 0.0);
        self.offset.clear();
        self.offset.resize(n, 0.0);
        self.bounds.clear();
        self.bounds.resize(n, Bound::Free);
        self.unknowns.clear();
        self.unknowns.resize(n, 0.0);
    }

    /// Number of unknowns.
    pub fn len(&self) -> usize {
        self.offset.len()
    }

    /// Whether there is nothing to solve.
    pub fn is_empty(&self) -> bool {
        self.offset.is_empty()
    }

    /// Sets an entry of `G`.
    pub fn set(&mut self, row: usize, column: usize, value: f64) {
        let n = self.len();
        self.matrix[row * n + column] = value;
    }

    /// Adds to the diagonal of `G`, which makes constraints that say the same thing twice share their force equally.
    pub fn soften(&mut self, compliance: f64) {
        let n = self.len();
        for i in 0..n {
            self.matrix[i * n + i] += compliance;
        }
    }

    /// Sets an entry of `b`.
    pub fn offset(&mut self, row: usize, value: f64) {
        self.offset[row] = value;
    }

    /// Sets the bound of an unknown; a [`Bound::Disc`] takes the next one with it.
    pub fn bound(&mut self, row: usize, bound: Bound) {
        self.bounds[row] = bound;
        if let Bound::Disc { .. } = bound {
            self.bounds[row + 1] = Bound::DiscSecond;
        }
    }

    /// Sets a guess of an unknown, such as its value in a problem much like this one.
    pub fn guess(&mut self, row: usize, value: f64) {
        self.unknowns[row] = value;
    }

    /// The solution `z`.
    pub fn unknowns(&self) -> &[f64] {
        &self.unknowns
    }

    /// Solves the problem: the guess says where each unknown stands in its bound, direct solves correct it until it
    /// confirms itself (a semismooth Newton iteration), and projected Gauss–Seidel sweeps make a better guess where it
    /// does not.
    ///
    /// # Errors
    /// [`Unsolved`] where no guess confirms itself; the best approximation stays in [`Self::unknowns`].
    pub fn solve(&mut self) -> Result<Solution, Unsolved> {
        const ROUNDS: u32 = 8;
        let scale = self
            .offset
            .iter()
            .fold(0.0_f64, |most, b| most.max(b.abs()));
        let mut solution = Solution {
            sweeps: 0,
            factorisations: 0,
            residual: 0.0,
        };
        if scale == 0.0 {
            return Ok(solution);
        }
        for round in 0..ROUNDS {
            let sweeps = if round == 0 {
                0
            } else {
                1 << (2 * round.min(5))
            };
            for _ in 0..sweeps {
                self.sweep();
            }
            solution.sweeps += sweeps;
            self.swept.clone_from(&self.unknowns);
            self.confirm(&mut solution.factorisations, TOLERANCE * scale);
            solution.residual = self.residual();
            if solution.residual <= TOLERANCE * scale {
                return Ok(solution);
            }
            self.unknowns.clone_from(&self.swept);
        }
        solution.residual = self.residual();
        if solution.residual <= 1e-6 * scale {
            return Ok(solution);
        }
        Err(Unsolved {
            size: self.len(),
            sweeps: solution.sweeps,
            residual: solution.residual,
        })
    }

    fn w(&self, row: usize) -> f64 {
        let n = self.len();
        let product: f64 = self.matrix[row * n..(row + 1) * n]
            .iter()
            .zip(&self.unknowns)
            .map(|(g, z)| g * z)
            .sum();
        self.offset[row] + product
    }

    /// Inverse of the diagonal: the step of a sweep, and what makes forces and velocities comparable.
    fn step(&self, row: usize) -> f64 {
        let n = self.len();
        let diagonal = match self.bounds[row] {
            Bound::Disc { .. } => {
                self.matrix[row * n + row].max(self.matrix[(row + 1) * n + row + 1])
            }
            Bound::DiscSecond => {
                self.matrix[row * n + row].max(self.matrix[(row - 1) * n + row - 1])
            }
            _ => self.matrix[row * n + row],
        };
        if diagonal > 0.0 { 1.0 / diagonal } else { 0.0 }
    }

    fn sweep(&mut self) {
        for row in 0..self.len() {
            let (z, step) = (self.unknowns[row], self.step(row));
            match self.bounds[row] {
                Bound::Free => self.unknowns[row] = z - step * self.w(row),
                Bound::NonNegative => self.unknowns[row] = (z - step * self.w(row)).max(0.0),
                Bound::Between { low, high } => {
                    self.unknowns[row] = (z - step * self.w(row)).clamp(low, high);
                }
                Bound::Disc { normal, friction } => {
                    let moved = [
                        z - step * self.w(row),
                        self.unknowns[row + 1] - step * self.w(row + 1),
                    ];
                    let radius = friction * self.unknowns[normal].max(0.0);
                    let length = norm(moved);
                    let shrink = if length > radius {
                        radius / length
                    } else {
                        1.0
                    };
                    self.unknowns[row] = moved[0] * shrink;
                    self.unknowns[row + 1] = moved[1] * shrink;
                }
                Bound::DiscSecond => {}
            }
        }
    }

    /// Newton's method from the present unknowns, until the conditions hold or the steps run out.
    fn confirm(&mut self, factorisations: &mut u32, tolerance: f64) {
        const STEPS: usize = 12;
        for _ in 0..STEPS {
            self.read_places();
            *factorisations += 1;
            if !self.solve_at_places() || self.residual() <= tolerance {
                return;
            }
        }
    }

    /// Where each unknown stands in its bound, as its projection says.
    fn read_places(&mut self) {
        self.places.clear();
        for row in 0..self.len() {
            let step = self.step(row);
            let target = |row: usize| self.unknowns[row] - step * self.w(row);
            let place = match self.bounds[row] {
                Bound::Free => Place::Inside,
                Bound::NonNegative if target(row) > 0.0 => Place::Inside,
                Bound::NonNegative => Place::Low,
                Bound::Between { low, high } => match target(row) {
                    t if t <= low => Place::Low,
                    t if t >= high => Place::High,
                    _ => Place::Inside,
                },
                Bound::Disc { normal, friction } => {
                    let t = [target(row), target(row + 1)];
                    let (radius, length) = (friction * self.unknowns[normal].max(0.0), norm(t));
                    if length > radius {
                        Place::Slipping {
                            direction: [t[0] / length, t[1] / length],
                            share: radius / length,
                        }
                    } else {
                        Place::Inside
                    }
                }
                Bound::DiscSecond => self.places[row - 1],
            };
            self.places.push(place);
        }
    }

    /// One Newton step: the linear system that holds if all places are right. False where it is singular.
    fn solve_at_places(&mut self) -> bool {
        self.free.clear();
        for row in 0..self.len() {
            match (self.bounds[row], self.places[row]) {
                (Bound::Between { low, .. }, Place::Low) => self.unknowns[row] = low,
                (Bound::Between { high, .. }, Place::High) => self.unknowns[row] = high,
                (_, Place::Low | Place::High) => self.unknowns[row] = 0.0,
                _ => self.free.push(row),
            }
        }
        self.assemble();
        if solve_in_place(&mut self.reduced, &mut self.right).is_err() {
            return false;
        }
        for (&row, &value) in self.free.iter().zip(&self.right) {
            self.unknowns[row] = value;
        }
        true
    }

    /// The linear system of the unknowns that are not at a bound.
    fn assemble(&mut self) {
        let (n, m) = (self.len(), self.free.len());
        self.reduced.clear();
        self.reduced.resize(m * m, 0.0);
        self.right.clear();
        self.right.resize(m, 0.0);
        for i in 0..m {
            let row = self.free[i];
            let fixed: f64 = (0..n)
                .filter(|&j| {
                    matches!(self.bounds[j], Bound::Between { .. })
                        && self.places[j] != Place::Inside
                })
                .map(|j| self.matrix[row * n + j] * self.unknowns[j])
                .sum();
            self.right[i] = -self.offset[row] - fixed;
            for (entry, &column) in self.reduced[i * m..(i + 1) * m].iter_mut().zip(&self.free) {
                *entry = self.matrix[row * n + column];
            }
        }
        for i in 0..m {
            if let (Bound::Disc { normal, friction }, Place::Slipping { direction, share }) =
                (self.bounds[self.free[i]], self.places[self.free[i]])
            {
                self.slip(i, normal, friction, direction, share);
            }
        }
    }

    /// Turns the two rows of a friction force inside its disc into those of one on the border: with t = z − ρw, s = t/|t|
    /// and P = I − s sᵀ, the derivative of z = µ zₙ t/|t| gives (I − βP) z + βρ P (G z + b) − µ s zₙ = 0, β = µ zₙ/|t|.
    fn slip(&mut self, i: usize, normal: usize, friction: f64, s: [f64; 2], share: f64) {
        let m = self.free.len();
        let weight = share * self.step(self.free[i]);
        let across = [[s[1] * s[1], -s[0] * s[1]], [-s[0] * s[1], s[0] * s[0]]];
        let mixed = |a: f64, b: f64| {
            [
                across[0][0] * a + across[0][1] * b,
                across[1][0] * a + across[1][1] * b,
            ]
        };
        for column in 0..m {
            let [a, b] = mixed(
                self.reduced[i * m + column],
                self.reduced[(i + 1) * m + column],
            );
            self.reduced[i * m + column] = weight * a;
            self.reduced[(i + 1) * m + column] = weight * b;
        }
        let [a, b] = mixed(self.right[i], self.right[i + 1]);
        self.right[i] = weight * a;
        self.right[i + 1] = weight * b;
        for (k, row) in across.iter().enumerate() {
            for (l, entry) in row.iter().enumerate() {
                let identity = if k == l { 1.0 } else { 0.0 };
                self.reduced[(i + k) * m + i + l] += identity - share * entry;
            }
        }
        if let Some(column) = self.free.iter().position(|&row| row == normal) {
            self.reduced[i * m + column] -= friction * s[0];
            self.reduced[(i + 1) * m + column] -= friction * s[1];
        }
    }

    /// Greatest distance of an unknown from its projection, in units of `w`.
    fn residual(&self) -> f64 {
        let mut most = 0.0_f64;
        for row in 0..self.len() {
            let (z, step) = (self.unknowns[row], self.step(row));
            if step == 0.0 {
                continue;
            }
            let target = z - step * self.w(row);
            let error = match self.bounds[row] {
                Bound::Free => target - z,
                Bound::NonNegative => target.max(0.0) - z,
                Bound::Between { low, high } => target.clamp(low, high) - z,
                Bound::Disc { normal, friction } => {
                    let t = [target, self.unknowns[row + 1] - step * self.w(row + 1)];
                    let (radius, length) = (friction * self.unknowns[normal].max(0.0), norm(t));
                    let shrink = if length > radius {
                        radius / length
                    } else {
                        1.0
                    };
                    norm([t[0] * shrink - z, t[1] * shrink - self.unknowns[row + 1]])
                }
                Bound::DiscSecond => 0.0,
            };
            most = most.max(error.abs() / step);
            if error.is_nan() {
                return f64::INFINITY;
            }
        }
        most
    }
}

fn norm(v: [f64; 2]) -> f64 {
    libm::sqrt(v[0] * v[0] + v[1] * v[1])
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// `G = J Jᵀ + 0.01 I` of random rows: symmetric, positive definite, coupled.
    fn problem(n: usize, rows: &[f64], offset: &[f64]) -> Problem {
        let mut problem = Problem::default();
        problem.reset(n);
        for i in 0..n {
            for j in 0..n {
                let product: f64 = (0..6).map(|k| rows[i * 6 + k] * rows[j * 6 + k]).sum();
                problem.set(i, j, product);
            }
            problem.offset(i, offset[i]);
        }
        problem.soften(0.01);
        problem
    }

    proptest! {
        #[test]
        fn rays_and_intervals_satisfy_their_conditions(
            n in 1..10_usize,
            rows in proptest::collection::vec(-1.0..1.0_f64, 60),
            offset in proptest::collection::vec(-1.0..1.0_f64, 10),
        ) {
            let mut problem = problem(n, &rows, &offset);
            for i in 0..n {
                problem.bound(i, if i % 3 == 2 { Bound::Between { low: -0.5, high: 0.3 } } else { Bound::NonNegative });
            }
            problem.solve().unwrap();
            for i in 0..n {
                let (z, w) = (problem.unknowns()[i], problem.w(i));
                if i % 3 == 2 {
                    prop_assert!((-0.5..=0.3).contains(&z));
                    prop_assert!(w.abs() < 1e-8 || (z == -0.5 && w > 0.0) || (z == 0.3 && w < 0.0));
                } else {
                    prop_assert!(z >= -1e-9 && w >= -1e-8 && (z * w).abs() < 1e-8, "{z} {w}");
                }
            }
        }

        #[test]
        fn friction_stays_in_its_disc_and_opposes_slip(
            contacts in 1..4_usize,
            friction in 0.0..1.5_f64,
            rows in proptest::collection::vec(-1.0..1.0_f64, 60),
            offset in proptest::collection::vec(-1.0..1.0_f64, 10),
        ) {
            let n = 3 * contacts;
            let mut problem = problem(n, &rows, &offset);
            for c in 0..contacts {
                problem.bound(3 * c, Bound::NonNegative);
                problem.bound(3 * c + 1, Bound::Disc { normal: 3 * c, friction });
            }
            // With friction the problem may have no solution that Coulomb's law and rigid bodies allow; then it must say
            // so, and not answer.
            if problem.solve().is_ok() {
                for c in 0..contacts {
                    let z = &problem.unknowns()[3 * c..3 * c + 3];
                    let w = [problem.w(3 * c + 1), problem.w(3 * c + 2)];
                    prop_assert!(z[0] >= -1e-6 && problem.w(3 * c) >= -1e-5);
                    let (pull, slip) = (norm([z[1], z[2]]), norm(w));
                    prop_assert!(pull <= friction * z[0] + 1e-6);
                    if slip > 1e-4 {
                        prop_assert!((pull - friction * z[0]).abs() < 1e-5, "slips below the limit");
                        prop_assert!(z[1] * w[0] + z[2] * w[1] <= -0.99 * pull * slip + 1e-5, "does not oppose slip");
                    }
                }
            }
        }
    }

    #[test]
    fn a_block_on_a_slope_sticks_below_the_friction_angle_and_slides_above() {
        // Unit mass, frame of the slope: gravity (−g sin a) along, (−g cos a) across.
        for (slope, slides) in [(0.3_f64, false), (0.7, true)] {
            let mut problem = Problem::default();
            problem.reset(3);
            for i in 0..3 {
                problem.set(i, i, 1.0);
            }
            problem.bound(0, Bound::NonNegative);
            problem.bound(
                1,
                Bound::Disc {
                    normal: 0,
                    friction: 0.5,
                },
            );
            problem.offset(0, -9.81 * libm::cos(slope));
            problem.offset(1, -9.81 * libm::sin(slope));
            problem.solve().unwrap();
            let acceleration = problem.w(1);
            let expected = if slides {
                -9.81 * (libm::sin(slope) - 0.5 * libm::cos(slope))
            } else {
                0.0
            };
            assert!(
                (acceleration - expected).abs() < 1e-12,
                "{acceleration} {expected}"
            );
        }
    }

    #[test]
    fn four_legs_of_a_table_share_its_weight() {
        // Four supports of one rigid plate: three unknowns too many for rank three.
        let mut problem = Problem::default();
        problem.reset(4);
        let corner = [
            [1.0, 1.0, 1.0],
            [1.0, 1.0, -1.0],
            [1.0, -1.0, 1.0],
            [1.0, -1.0, -1.0],
        ];
        for i in 0..4 {
            for j in 0..4 {
                problem.set(
                    i,
                    j,
                    (0..3).map(|k: usize| corner[i][k] * corner[j][k]).sum(),
                );
            }
            problem.bound(i, Bound::NonNegative);
            problem.offset(i, -9.81);
        }
        problem.soften(1e-9);
        problem.solve().unwrap();
        for z in problem.unknowns() {
            assert!((z - 9.81 / 4.0).abs() < 1e-6, "{z}");
        }
    }
}
