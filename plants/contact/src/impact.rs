//! Impacts: impulses that change the rates of the gaps in no time.

use crate::problem::{Bound, Problem, TOLERANCE};
use crate::solution::{Method, Solution, Unsolved};

/// The law by which an impact gives back what it takes. Each row has a coefficient e of its own, for what is hit in one
/// instant need not be of one stuff: a stop 0, the ground more.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Restitution {
    /// Rates: `0 ≤ P ⊥ ġ⁺ + e ġ⁻ ≥ 0`. The energy changes by ½ Σ Pᵢ (1 − eᵢ) ġᵢ⁻ where there is no friction: it does not
    /// grow if no gap opens before, nor (by another sum) if one coefficient holds for all. Otherwise it may, and with
    /// friction it may in any case, as Kane found of a rod that slides into the ground.
    Newton,
    /// Impulses: one that stops the approach, `0 ≤ P₁ ⊥ ġ₁ ≥ 0`, then one of at least e times that,
    /// `0 ≤ P₂ − e P₁ ⊥ ġ⁺ ≥ 0`, each with friction of its own. Kinetic energy never grows; see [`Problem::impact`].
    Poisson,
}

/// What an impact keeps aside.
#[derive(Debug, Clone, Default)]
pub(crate) struct Phases {
    bounds: Vec<Bound>,
    /// Impulses of the first phase, and the rates after it.
    first: Vec<f64>,
    rates: Vec<f64>,
}

impl Problem {
    /// Impulses P of an impact, for the present G and bounds: `before` are the rates ġ⁻ of all rows, `coefficients` their
    /// restitution, which counts for [`Bound::NonNegative`] only. Afterwards [`Self::unknowns`] are P, and [`Self::w`] is
    /// the rate ġ⁺ = ġ⁻ + G P of a row.
    ///
    /// No gap is left closing. Newton's law lets a gap that opens be driven in, down to ġ⁺ = −e ġ⁻; what still closes
    /// afterwards is stopped without restitution, which takes energy only.
    ///
    /// By Poisson's law the kinetic energy changes by at most ½(|EP₁|² − |P₁|²), in the norm of G and with the
    /// coefficients E: of the impulses that its bounds allow, E P₁ among them, the second phase takes those that leave the
    /// least energy. For one coefficient that is not positive. Several that differ, with friction, would now and then give
    /// more than was taken, even many times as much; then they are lowered together, by |P₁|/|EP₁|.
    ///
    /// # Errors
    /// [`Unsolved`], as the method says; [`Unsolved::Parameter`] for a coefficient outside [0, 1].
    ///
    /// # Panics
    /// Where rates or coefficients are not as many as the rows.
    pub fn impact(
        &mut self,
        law: Restitution,
        before: &[f64],
        coefficients: &[f64],
        method: Method,
    ) -> Result<Solution, Unsolved> {
        assert_eq!(before.len(), self.len(), "one rate for each row");
        assert_eq!(coefficients.len(), self.len(), "a coefficient for each row");
        if let Some(&value) = coefficients.iter().find(|e| !(0.0..=1.0).contains(*e)) {
            return Err(Unsolved::Parameter {
                what: "restitution",
                value,
            });
        }
        let mut phases = self.phases.take().unwrap_or_default();
        phases.bounds.clone_from(&self.bounds);
        let shifted = self.shifted;
        let result = match law {
            Restitution::Newton => phases.newton(self, before, coefficients, method),
            Restitution::Poisson => phases.poisson(self, before, coefficients, method),
        };
        if self.bounds != phases.bounds {
            self.factored = false;
            self.bounds.clone_from(&phases.bounds);
        }
        self.shifted = shifted;
        self.offset.copy_from_slice(before);
        self.phases = Some(phases);
        result
    }

    /// Impulses P of an impact without collision (a tangential impact): contacts slide that are closed and do not approach,
    /// and no forces keep them from it, for friction presses them down by more than their normal force lifts them
    /// (Painlevé's paradox). `before` are the rates ġ⁻ of all rows; `jammed` says which normals those are.
    ///
    /// It is the impact of contacts that approach ever more slowly, ġ⁻ = −ε with ε → 0, without restitution. P = 0 meets its
    /// conditions, too, and is not it: at every ε > 0 it leaves the gap closing. So the impulses are found at a small ε, and
    /// from there those at none; where these vanish, they are none only if they shrink with ε. Kinetic energy is lost only.
    ///
    /// Afterwards [`Self::unknowns`] and [`Self::w`] are as after [`Self::impact`].
    ///
    /// # Errors
    /// [`Unsolved`], as the method says: then no impulse keeps the contacts from closing, either.
    ///
    /// # Panics
    /// Where rates or marks are not as many as the rows.
    pub fn impact_without_collision(
        &mut self,
        before: &[f64],
        jammed: &[bool],
        method: Method,
    ) -> Result<Solution, Unsolved> {
        assert_eq!(before.len(), self.len(), "one rate for each row");
        assert_eq!(jammed.len(), self.len(), "a mark for each row");
        let result = self.jam(before, jammed, method);
        self.offset.copy_from_slice(before);
        result
    }

    fn jam(
        &mut self,
        before: &[f64],
        jammed: &[bool],
        method: Method,
    ) -> Result<Solution, Unsolved> {
        /// ε, as a share of the greatest rate: far above what a solution leaves, far below what slides.
        const APPROACH: f64 = 1e-3;
        /// By how much smaller it is made where there is doubt.
        const SMALLER: f64 = 1e-2;
        let fastest = before
            .iter()
            .fold(0.0_f64, |most, rate| most.max(rate.abs()));
        let approach = |problem: &mut Self, by: f64| {
            for (row, (&rate, &jammed)) in before.iter().zip(jammed).enumerate() {
                problem.offset[row] = if jammed { rate.min(0.0) - by } else { rate };
                problem.unknowns[row] = 0.0;
            }
            problem.solve_by(method)
        };
        let most = |impulses: &[f64]| {
            let marked = impulses.iter().zip(jammed).filter(|(_, jammed)| **jammed);
            marked.fold(0.0_f64, |most, (impulse, _)| most.max(*impulse))
        };
        let slow = approach(self, APPROACH * fastest)?;
        let found = most(&self.unknowns);
        self.offset.copy_from_slice(before);
        let exact = self.solve_by(Method::Newton);
        if let Ok(exact) = exact
            && most(&self.unknowns) > 0.5 * found
        {
            return Ok(slow.and(exact));
        }
        let slower = approach(self, SMALLER * APPROACH * fastest)?;
        if most(&self.unknowns) < 0.5 * found {
            // Forces do: these impulses are the approach's own.
            self.unknowns.fill(0.0);
        }
        Ok(slow.and(slower))
    }
}

impl Phases {
    fn newton(
        &mut self,
        problem: &mut Problem,
        before: &[f64],
        coefficients: &[f64],
        method: Method,
    ) -> Result<Solution, Unsolved> {
        for (row, (rate, e)) in before.iter().zip(coefficients).enumerate() {
            let returned = match self.bounds[row] {
                Bound::NonNegative => e * rate,
                _ => 0.0,
            };
            problem.offset[row] = rate + returned;
        }
        let solution = problem.solve_by(method)?;
        problem.offset.copy_from_slice(before);
        let closing = -TOLERANCE * problem.scale();
        let normal = |row: usize| self.bounds[row] == Bound::NonNegative;
        if (0..before.len()).all(|row| !normal(row) || problem.w(row) >= closing) {
            return Ok(solution);
        }
        Ok(solution.and(self.again(problem, |_| 0.0, method)?))
    }

    fn poisson(
        &mut self,
        problem: &mut Problem,
        before: &[f64],
        coefficients: &[f64],
        method: Method,
    ) -> Result<Solution, Unsolved> {
        problem.offset.copy_from_slice(before);
        let compression = problem.solve_by(method)?;
        let gives_back = |row: usize| {
            self.bounds[row] == Bound::NonNegative
                && coefficients[row] * problem.unknowns[row] > 0.0
        };
        if !(0..before.len()).any(gives_back) {
            return Ok(compression);
        }
        let expansion = self.again(problem, |row| coefficients[row], method)?;
        problem.offset.copy_from_slice(before);
        let solution = compression.and(expansion);
        let (mut gain, mut moved) = (0.0, 0.0);
        for (row, rate) in before.iter().enumerate() {
            let (z, after) = (problem.unknowns[row], problem.w(row));
            gain += 0.5 * z * (rate + after);
            moved += 0.5 * z.abs() * (rate.abs() + after.abs());
        }
        let share = self.affordable(problem, coefficients);
        if gain <= 1e-12 * moved || share >= 1.0 {
            return Ok(solution);
        }
        problem.unknowns[..before.len()].copy_from_slice(&self.first);
        Ok(solution.and(self.again(problem, |row| share * coefficients[row], method)?))
    }

    /// A further impact after one whose impulses are the unknowns: what each row may push is at least a share of what it
    /// pushed, and an interval what is left of it. The impulses add up.
    fn again(
        &mut self,
        problem: &mut Problem,
        share: impl Fn(usize) -> f64,
        method: Method,
    ) -> Result<Solution, Unsolved> {
        let n = problem.len();
        self.first.clear();
        self.first.extend_from_slice(problem.unknowns());
        self.rates.clear();
        self.rates.extend((0..n).map(|row| problem.w(row)));
        problem.offset.copy_from_slice(&self.rates);
        for (row, &first) in self.first.iter().enumerate() {
            problem.guess(row, 0.0);
            match self.bounds[row] {
                Bound::NonNegative => {
                    let low = share(row) * first.max(0.0);
                    if low > 0.0 {
                        let high = f64::INFINITY;
                        problem.bound(row, Bound::Between { low, high });
                        problem.guess(row, low);
                    }
                }
                Bound::Between { low, high } => {
                    let (low, high) = (low - first, high - first);
                    problem.bound(row, Bound::Between { low, high });
                }
                Bound::Free | Bound::Disc { .. } | Bound::DiscSecond => {}
            }
        }
        let solution = problem.solve_by(method)?;
        for (unknown, first) in problem.unknowns.iter_mut().zip(&self.first) {
            *unknown += first;
        }
        Ok(solution)
    }

    /// By what all coefficients are to be lowered so that what is given back is no more than what the first phase took.
    fn affordable(&self, problem: &Problem, coefficients: &[f64]) -> f64 {
        let n = problem.len();
        let most = (0..n).filter(|&row| self.bounds[row] == Bound::NonNegative);
        let most = most.fold(0.0_f64, |most, row| most.max(coefficients[row]));
        let share = |row: usize| match self.bounds[row] {
            Bound::Free => most,
            Bound::NonNegative => coefficients[row],
            Bound::Between { .. } => 0.0,
            Bound::Disc { normal, .. } => coefficients[normal],
            Bound::DiscSecond => match self.bounds[row - 1] {
                Bound::Disc { normal, .. } => coefficients[normal],
                _ => 0.0,
            },
        };
        let (mut taken, mut given) = (0.0, 0.0);
        for i in 0..n {
            for j in 0..n {
                let energy = self.first[i] * problem.entry(i, j) * self.first[j];
                taken += energy;
                given += share(i) * energy * share(j);
            }
        }
        libm::sqrt((taken / given).max(0.0))
    }
}
