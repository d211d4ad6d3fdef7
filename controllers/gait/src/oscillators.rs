//! Coupled phase oscillators: the common phase and the legs' convergence to a gait.

use std::f64::consts::TAU;

use serde::{Deserialize, Serialize};

/// Phase oscillators, one per leg, all coupled to each other (eq. 3.2 of the thesis).
///
/// With a phase difference ψᵢ of each leg, the network is
///
/// ```text
/// θ̇ᵢ = ω + w·Σⱼ sin(θⱼ − θᵢ − (ψⱼ − ψᵢ))
/// ```
///
/// With θᵢ = 2π·cycle + ψᵢ + δᵢ this splits into a common part, which `cycle' = f` integrates
/// without error, and deviations from the gait, which do not depend on ω and ψ:
///
/// ```text
/// δ̇ᵢ = w·Σⱼ sin(δⱼ − δᵢ)
/// ```
///
/// In the locked state all δ are equal and their rates are exactly zero, so a locked network is
/// integrated exactly for any elapsed time, by one addition. Otherwise the deviations are
/// integrated by the classical Runge–Kutta method in steps of at most a tenth of the network's time
/// constant 1/(n·w): the error of a step is below 1e-7 rad. Deviations within 1e-12 rad of one
/// another count as locked and are replaced by their mean.
///
/// The sum of the deviations is conserved, so locking does not shift the common phase.
///
/// There is no noise: a network that starts *exactly* at an unstable fixed point (for example, two
/// legs of a common phase in antiphase) leaves it only by rounding errors.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Oscillators {
    /// Fraction of the common cycle, in [0, 1).
    cycle: f64,
    /// ψ \[rad\].
    differences: Vec<f64>,
    /// δ \[rad\].
    deviations: Vec<f64>,
    /// (ψ + δ)/2π, cached: it changes rarely and is read at every step.
    offsets: Vec<f64>,
    /// Workspace of the integrator: rates, and the stage at which they are evaluated.
    #[serde(skip)]
    scratch: Scratch,
}

#[derive(Debug, Clone, Default)]
struct Scratch {
    rate: Vec<f64>,
    sum: Vec<f64>,
    stage: Vec<f64>,
}

impl Scratch {
    fn of(count: usize) -> Self {
        Self {
            rate: vec![0.0; count],
            sum: vec![0.0; count],
            stage: vec![0.0; count],
        }
    }
}

impl PartialEq for Scratch {
    /// The content of the workspace is irrelevant.
    fn eq(&self, _: &Self) -> bool {
        true
    }
}

/// Spread of deviations below which the network is locked \[rad\].
const LOCKED_RAD: f64 = 1e-12;
/// Maximum integration step, in time constants of the network.
const STEP_IN_TIME_CONSTANTS: f64 = 0.1;

impl Oscillators {
    /// Creates a locked network whose legs lead the common phase by `differences` \[rad\].
    ///
    /// ```
    /// use std::f64::consts::PI;
    /// use twinrig_gait::Oscillators;
    ///
    /// let mut network = Oscillators::locked(&[0.0, PI]);
    /// network.advance(0.125, 2.0, 2.5); // an eighth of a second at 2 Hz
    /// assert_eq!([network.turn(0), network.turn(1)], [0.25, 0.75]);
    /// ```
    pub fn locked(differences: &[f64]) -> Self {
        let mut network = Self {
            cycle: 0.0,
            differences: differences.to_vec(),
            deviations: vec![0.0; differences.len()],
            offsets: Vec::new(),
            scratch: Scratch::of(differences.len()),
        };
        network.offsets = (0..differences.len())
            .map(|leg| network.offset_of(leg))
            .collect();
        network
    }

    /// Number of oscillators.
    pub fn len(&self) -> usize {
        self.deviations.len()
    }

    /// Whether all lists have `count` entries, which a snapshot does not guarantee.
    pub(crate) fn has_legs(&self, count: usize) -> bool {
        [&self.differences, &self.deviations, &self.offsets]
            .iter()
            .all(|list| list.len() == count)
    }

    /// Whether there are no oscillators.
    pub fn is_empty(&self) -> bool {
        self.deviations.is_empty()
    }

    fn offset_of(&self, leg: usize) -> f64 {
        (self.differences[leg] + self.deviations[leg]) * (1.0 / TAU)
    }

    /// Fraction of the cycle of oscillator `leg`, θ/2π in `[0, 1)`.
    #[inline]
    pub fn turn(&self, leg: usize) -> f64 {
        wrap(self.cycle + self.offsets[leg])
    }

    /// Deviation δ of `leg` from the gait \[rad\].
    pub fn deviation(&self, leg: usize) -> f64 {
        self.deviations[leg]
    }

    /// Sets the phase difference of `leg` to `ahead` \[rad\]. Its phase does not jump: the change
    /// becomes a deviation, which decays.
    pub fn set_difference(&mut self, leg: usize, ahead: f64) {
        self.deviations[leg] += self.differences[leg] - ahead;
        self.differences[leg] = ahead;
        self.offsets[leg] = self.offset_of(leg);
    }

    /// Adds `by` \[rad\] to the deviation of `leg`.
    pub fn push(&mut self, leg: usize, by: f64) {
        self.deviations[leg] += by;
        self.offsets[leg] = self.offset_of(leg);
    }

    /// Advances by `elapsed` \[s\] at `frequency` \[Hz\] with coupling `weight` w \[rad/s\].
    pub fn advance(&mut self, elapsed: f64, frequency: f64, weight: f64) {
        self.cycle = wrap(self.cycle + elapsed * frequency);
        let spread = self.spread();
        if spread != 0.0 && weight != 0.0 && elapsed > 0.0 {
            self.relax(elapsed, weight);
        }
    }

    fn spread(&self) -> f64 {
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        for &deviation in &self.deviations {
            low = low.min(deviation);
            high = high.max(deviation);
        }
        if high > low { high - low } else { 0.0 }
    }

    /// Integrates the deviations over `elapsed` \[s\].
    fn relax(&mut self, elapsed: f64, weight: f64) {
        let count = self.deviations.len();
        let rate = count as f64 * weight.abs();
        let steps = (elapsed * rate / STEP_IN_TIME_CONSTANTS).ceil().max(1.0);
        let step = elapsed / steps;
        let mut done = 0.0;
        while done < steps {
            let changed = self.runge_kutta(step, weight);
            let spread = self.spread();
            if spread < LOCKED_RAD {
                let mean = self.deviations.iter().sum::<f64>() / count as f64;
                self.deviations.fill(mean);
                break;
            }
            if !changed {
                break; // a fixed point to the last bit
            }
            done += 1.0;
        }
        for leg in 0..count {
            self.offsets[leg] = self.offset_of(leg);
        }
    }

    /// Performs one classical Runge–Kutta step; returns whether any deviation changed.
    fn runge_kutta(&mut self, step: f64, weight: f64) -> bool {
        let count = self.deviations.len();
        let Scratch { rate, sum, stage } = &mut self.scratch;
        stage.clear();
        stage.extend_from_slice(&self.deviations);
        sum.clear();
        sum.resize(count, 0.0);
        rate.resize(count, 0.0);
        for (reach, share) in [(0.5, 1.0), (0.5, 2.0), (1.0, 2.0), (0.0, 1.0)] {
            coupling(stage, weight, rate);
            for leg in 0..count {
                sum[leg] += share * rate[leg];
                stage[leg] = self.deviations[leg] + reach * step * rate[leg];
            }
        }
        let mut changed = false;
        for (deviation, sum) in self.deviations.iter_mut().zip(sum) {
            let next = *deviation + step * (1.0 / 6.0) * *sum;
            changed |= next != *deviation;
            *deviation = next;
        }
        changed
    }
}

/// `rate[i] = w·Σⱼ sin(δⱼ − δᵢ)`; each pair is evaluated once, with opposite signs for its ends.
fn coupling(deviations: &[f64], weight: f64, rate: &mut [f64]) {
    rate.fill(0.0);
    for i in 0..deviations.len() {
        for j in i + 1..deviations.len() {
            let term = weight * libm::sin(deviations[j] - deviations[i]);
            rate[i] += term;
            rate[j] -= term;
        }
    }
}

/// Fractional part of `turn`, in [0, 1).
#[inline]
fn wrap(turn: f64) -> f64 {
    let part = turn - turn.floor();
    // A tiny negative number rounds up to 1.
    if part < 1.0 { part } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use proptest::prelude::*;

    use super::*;
    use crate::{Corner, Gait};

    fn differences(gait: Gait) -> [f64; 4] {
        [(true, true), (true, false), (false, true), (false, false)]
            .map(|(fore, left)| gait.phase_difference(Corner { fore, left }))
    }

    fn gaits() -> impl Strategy<Value = Gait> {
        prop::sample::select(Gait::ALL.to_vec())
    }

    /// Distance of two fractions of a cycle, on the circle.
    fn circular_distance(a: f64, b: f64) -> f64 {
        let d = (a - b).abs();
        d.min(1.0 - d)
    }

    proptest! {
        #[test]
        fn random_phases_converge_to_the_gait_table(
            gait in gaits(), pushes in prop::array::uniform4(-PI..PI), frequency in -5.0..5.0_f64,
        ) {
            let table = differences(gait);
            let mut network = Oscillators::locked(&table);
            for (leg, push) in pushes.into_iter().enumerate() {
                network.push(leg, push);
            }
            for _ in 0..5000 {
                network.advance(0.002, frequency, 2.5);
            }
            for leg in 1..4 {
                let ahead = (table[leg] - table[0]) / TAU;
                let measured = network.turn(leg) - network.turn(0);
                prop_assert!(circular_distance(wrap(measured), wrap(ahead)) < 1e-9, "{measured} for {ahead}");
            }
        }

        #[test]
        fn one_step_equals_two_halves(
            pushes in prop::array::uniform4(-PI..PI), elapsed in 1e-4..0.05_f64, frequency in 0.1..5.0_f64,
        ) {
            let mut one = Oscillators::locked(&differences(Gait::Trot));
            for (leg, push) in pushes.into_iter().enumerate() {
                one.push(leg, push);
            }
            let mut two = one.clone();
            one.advance(elapsed, frequency, 2.5);
            two.advance(elapsed / 2.0, frequency, 2.5);
            two.advance(elapsed / 2.0, frequency, 2.5);
            for leg in 0..4 {
                prop_assert!(circular_distance(one.turn(leg), two.turn(leg)) < 1e-6);
            }
        }

        #[test]
        fn locked_network_is_exact_for_any_split(
            splits in prop::collection::vec(1_u32..1000, 1..50), frequency in 0.1..5.0_f64,
        ) {
            let mut network = Oscillators::locked(&differences(Gait::Walk));
            let mut total = 0.0;
            for split in splits {
                let elapsed = f64::from(split) * 1e-4;
                total += elapsed;
                network.advance(elapsed, frequency, 2.5);
            }
            prop_assert!(circular_distance(network.turn(0), wrap(total * frequency)) < 1e-13 * (1.0 + total * frequency));
            prop_assert_eq!(network.deviation(2), 0.0);
        }

        #[test]
        fn locking_does_not_shift_the_common_phase(pushes in prop::array::uniform4(-1.0..1.0_f64)) {
            let mut network = Oscillators::locked(&differences(Gait::Trot));
            for (leg, push) in pushes.into_iter().enumerate() {
                network.push(leg, push);
            }
            network.advance(5.0, 0.0, 2.5);
            let mean = pushes.iter().sum::<f64>() / 4.0;
            for leg in 0..4 {
                prop_assert!((network.deviation(leg) - mean).abs() < 1e-9);
            }
        }
    }

    #[test]
    fn small_deviation_decays_with_the_networks_time_constant() {
        let mut network = Oscillators::locked(&[0.0; 4]);
        network.push(0, 1e-3);
        network.advance(0.1, 0.0, 2.5); // one time constant, 1/(4 · 2.5 s)
        let remaining = network.deviation(0) - network.deviation(1);
        assert!(
            (remaining / 1e-3 - libm::exp(-1.0)).abs() < 1e-6,
            "{remaining}"
        );
    }

    #[test]
    fn new_phase_difference_does_not_make_the_phase_jump() {
        let mut network = Oscillators::locked(&differences(Gait::Trot));
        network.advance(0.1, 3.0, 2.5);
        let before = network.turn(1);
        network.set_difference(1, 0.3);
        assert!(circular_distance(network.turn(1), before) < 1e-15);
        network.advance(5.0, 3.0, 2.5);
        assert!(circular_distance(wrap(network.turn(1) - network.turn(0)), 0.3 / TAU) < 1e-9);
    }

    #[test]
    fn phases_wrap_to_the_unit_interval() {
        assert_eq!(wrap(-1e-20), 0.0);
        assert_eq!(wrap(-0.25), 0.75);
        assert_eq!(wrap(3.0), 0.0);
    }
}
