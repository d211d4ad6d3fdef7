//! Impact laws: impulses that change the rates of the gaps instantaneously.

use crate::bound::Bound;
use crate::problem::{Problem, TOLERANCE};
use crate::solution::{Method, Solution, SolveError};
use crate::workspace::Phases;

/// Law of restitution. Each row has its own coefficient e, since rows hit at one instant may be of
/// different materials: 0 for a stop, more for the ground.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Restitution {
    /// Rates: `0 ≤ P ⊥ ġ⁺ + e ġ⁻ ≥ 0`. Without friction the energy changes by ½ Σ Pᵢ (1 − eᵢ) ġᵢ⁻:
    /// it does not grow if no gap opens before, nor (by another sum) if one coefficient applies to
    /// all rows. Otherwise it may grow, and with friction it may in any case, as Kane found for a
    /// rod that slides into the ground.
    Newton,
    /// Impulses: a compression phase that stops the approach, `0 ≤ P₁ ⊥ ġ₁ ≥ 0`, then an expansion
    /// phase with an impulse of at least e P₁, `0 ≤ P₂ − e P₁ ⊥ ġ⁺ ≥ 0`, each with its own friction
    /// impulse. Kinetic energy never grows; see [`Problem::impact`].
    Poisson,
}

impl Problem {
    /// Computes the impulses P of an impact for the present G and bounds: `before` are the rates ġ⁻
    /// of all rows, `coefficients` their restitution, which applies to [`Bound::NonNegative`] only.
    /// Afterwards [`Self::unknowns`] are P, and [`Self::w`] is the rate ġ⁺ = ġ⁻ + G P of a row.
    ///
    /// No gap is closing afterwards. Newton's law allows an opening gap to end with a closing rate,
    /// down to ġ⁺ = −e ġ⁻; rows that still close are stopped by a second impact without
    /// restitution, which only dissipates.
    ///
    /// By Poisson's law the kinetic energy changes by at most ½(|EP₁|² − |P₁|²), in the norm of G
    /// and with the diagonal matrix E of coefficients: of the admissible impulses, E P₁ among them,
    /// the second phase selects those of least energy. For one common coefficient the bound is not
    /// positive. Different coefficients with friction may exceed the energy taken, even many times;
    /// then all are reduced by the factor |P₁|/|EP₁|.
    ///
    /// # Errors
    /// [`SolveError`], as described for the method; [`SolveError::Parameter`] for a coefficient outside
    /// [0, 1].
    ///
    /// # Panics
    /// If the number of rates or coefficients differs from the number of rows.
    pub fn impact(
        &mut self,
        law: Restitution,
        before: &[f64],
        coefficients: &[f64],
        method: Method,
    ) -> Result<Solution, SolveError> {
        assert_eq!(before.len(), self.len(), "one rate per row");
        assert_eq!(coefficients.len(), self.len(), "one coefficient per row");
        if let Some(&value) = coefficients.iter().find(|e| !(0.0..=1.0).contains(*e)) {
            return Err(SolveError::Parameter {
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

    /// Returns the kinetic energy that the impulses [`Self::unknowns`] add at the rates `before`,
    /// ΔT = Pᵀ ġ⁻ + ½ Pᵀ G P, and the magnitude of the energy they exchange: ½ Σ |Pᵢ| (|ġᵢ⁻| +
    /// |ġᵢ⁺|) \[J\]. A law of impacts keeps the first below round-off of the second.
    ///
    /// Where `G` has a compliance on its diagonal, the work against it is part of the energy added,
    /// which is then greater than that of the motion.
    ///
    /// # Panics
    /// If the number of rates differs from the number of rows.
    pub fn impact_energy(&self, before: &[f64]) -> [f64; 2] {
        assert_eq!(before.len(), self.len(), "one rate per row");
        let (mut added, mut exchanged) = (0.0, 0.0);
        for (row, (&rate, &impulse)) in before.iter().zip(self.unknowns()).enumerate() {
            let change = self.w(row) - self.offset[row];
            added += impulse * (rate + 0.5 * change);
            exchanged += 0.5 * impulse.abs() * (rate.abs() + (rate + change).abs());
        }
        [added, exchanged]
    }

    /// Computes the impulses P of an impact without collision (a tangential impact), for sliding
    /// contacts that are closed and do not approach but have no consistent contact force, because
    /// friction presses them down by more than their normal force lifts them (Painlevé's paradox).
    /// `before` are the rates ġ⁻ of all rows; `jammed` marks the normal rows of these contacts.
    ///
    /// The solution is the limit ε → 0 of an impact without restitution at the approach rate ġ⁻ =
    /// −ε. P = 0 satisfies the conditions of the limit too but is not the solution: at every ε > 0
    /// it leaves the gap closing. The impulses are therefore computed at a small ε, and used as the
    /// start for ε = 0; where these vanish, zero is accepted only if the impulses shrink with ε.
    /// Kinetic energy never grows.
    ///
    /// Afterwards [`Self::unknowns`] and [`Self::w`] are as after [`Self::impact`].
    ///
    /// # Errors
    /// [`SolveError`], as described for the method: then no impulse keeps the contacts from closing,
    /// either.
    ///
    /// # Panics
    /// If the number of rates or marks differs from the number of rows.
    pub fn impact_without_collision(
        &mut self,
        before: &[f64],
        jammed: &[bool],
        method: Method,
    ) -> Result<Solution, SolveError> {
        assert_eq!(before.len(), self.len(), "one rate per row");
        assert_eq!(jammed.len(), self.len(), "one mark per row");
        let result = self.solve_tangential(before, jammed, method);
        self.offset.copy_from_slice(before);
        result
    }

    fn solve_tangential(
        &mut self,
        before: &[f64],
        jammed: &[bool],
        method: Method,
    ) -> Result<Solution, SolveError> {
        /// ε relative to the greatest rate: far above the residual of a solution, far below the
        /// sliding rate.
        const APPROACH: f64 = 1e-3;
        /// Factor by which ε is reduced for the check of convergence to zero.
        const SMALLER: f64 = 1e-2;
        let fastest = before
            .iter()
            .fold(0.0_f64, |largest, rate| largest.max(rate.abs()));
        let approach = |problem: &mut Self, by: f64| {
            for (row, (&rate, &jammed)) in before.iter().zip(jammed).enumerate() {
                problem.offset[row] = if jammed { rate.min(0.0) - by } else { rate };
                problem.unknowns[row] = 0.0;
            }
            problem.solve_by(method)
        };
        let largest = |impulses: &[f64]| {
            let marked = impulses.iter().zip(jammed).filter(|(_, jammed)| **jammed);
            marked.fold(0.0_f64, |largest, (impulse, _)| largest.max(*impulse))
        };
        let slow = approach(self, APPROACH * fastest)?;
        let found = largest(&self.unknowns);
        self.offset.copy_from_slice(before);
        let exact = self.solve_by(Method::Newton);
        if let Ok(exact) = exact
            && largest(&self.unknowns) > 0.5 * found
        {
            return Ok(slow.and(exact));
        }
        let slower = approach(self, SMALLER * APPROACH * fastest)?;
        if largest(&self.unknowns) < 0.5 * found {
            // A consistent contact force exists: the impulses are proportional to ε.
            self.unknowns.fill(0.0);
        }
        Ok(slow.and(slower))
    }
}

/// Whether the impulses add energy beyond round-off.
fn gains(problem: &Problem, before: &[f64]) -> bool {
    let [added, exchanged] = problem.impact_energy(before);
    added > 1e-12 * exchanged
}

impl Phases {
    fn newton(
        &mut self,
        problem: &mut Problem,
        before: &[f64],
        coefficients: &[f64],
        method: Method,
    ) -> Result<Solution, SolveError> {
        for (row, (rate, e)) in before.iter().zip(coefficients).enumerate() {
            let restitution = match self.bounds[row] {
                Bound::NonNegative => e * rate,
                _ => 0.0,
            };
            problem.offset[row] = rate + restitution;
        }
        let solution = problem.solve_by(method)?;
        problem.offset.copy_from_slice(before);
        let closing = -TOLERANCE * problem.scale();
        let normal = |row: usize| self.bounds[row] == Bound::NonNegative;
        if (0..before.len()).all(|row| !normal(row) || problem.w(row) >= closing) {
            return Ok(solution);
        }
        Ok(solution.and(self.second_phase(problem, |_| 0.0, method)?))
    }

    fn poisson(
        &mut self,
        problem: &mut Problem,
        before: &[f64],
        coefficients: &[f64],
        method: Method,
    ) -> Result<Solution, SolveError> {
        problem.offset.copy_from_slice(before);
        let compression = problem.solve_by(method)?;
        let restitutes = |row: usize| {
            self.bounds[row] == Bound::NonNegative
                && coefficients[row] * problem.unknowns[row] > 0.0
        };
        if !(0..before.len()).any(restitutes) {
            return Ok(compression);
        }
        let expansion = self.second_phase(problem, |row| coefficients[row], method)?;
        problem.offset.copy_from_slice(before);
        let mut solution = compression.and(expansion);
        let share = self.restitution_scale(problem, coefficients);
        if gains(problem, before) && share < 1.0 {
            problem.unknowns[..before.len()].copy_from_slice(&self.first);
            let reduced = self.second_phase(problem, |row| share * coefficients[row], method)?;
            problem.offset.copy_from_slice(before);
            solution = solution.and(reduced);
        }
        Ok(solution)
    }

    /// Solves a further impact after one whose impulses are the unknowns: the lower bound of a
    /// normal impulse is a share of its first impulse, and an interval is reduced by its first
    /// impulse. The impulses are added.
    fn second_phase(
        &mut self,
        problem: &mut Problem,
        share: impl Fn(usize) -> f64,
        method: Method,
    ) -> Result<Solution, SolveError> {
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
        let solution = problem.solve_by(method);
        // An approximation is the sum of both phases, too.
        for (unknown, first) in problem.unknowns.iter_mut().zip(&self.first) {
            *unknown += first;
        }
        solution
    }

    /// Returns the factor for all coefficients at which the expansion returns no more energy than
    /// the compression took.
    fn restitution_scale(&self, problem: &Problem, coefficients: &[f64]) -> f64 {
        let n = problem.len();
        let largest = (0..n).filter(|&row| self.bounds[row] == Bound::NonNegative);
        let largest = largest.fold(0.0_f64, |largest, row| largest.max(coefficients[row]));
        let share = |row: usize| match self.bounds[row] {
            Bound::Free => largest,
            Bound::NonNegative => coefficients[row],
            Bound::Between { .. } => 0.0,
            Bound::Disc { normal, .. } => coefficients[normal],
            Bound::DiscSecond => match self.bounds[row - 1] {
                Bound::Disc { normal, .. } => coefficients[normal],
                _ => 0.0,
            },
        };
        let (mut compression_energy, mut expansion_energy) = (0.0, 0.0);
        for i in 0..n {
            for j in 0..n {
                let energy = self.first[i] * problem.entry(i, j) * self.first[j];
                compression_energy += energy;
                expansion_energy += share(i) * energy * share(j);
            }
        }
        libm::sqrt((compression_energy / expansion_energy).max(0.0))
    }
}
