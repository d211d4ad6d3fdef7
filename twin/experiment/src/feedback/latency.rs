//! Latency of a measured load, split by stage.

use std::f64::consts::{PI, TAU};

/// Samples of a signal.
#[derive(Clone, Copy, Debug)]
pub struct SampledSignal<'a> {
    /// Times at which the values are known \[s\], ascending; for a value that is computed or
    /// transmitted, the time at which it is available.
    pub times_s: &'a [f64],
    /// Values, as many, in any unit.
    pub values: &'a [f64],
    /// Phase by which the signal leads the load if nothing delays it \[rad\]: 0 for a force, π/2
    /// for a rate, π more for a gain below zero.
    pub lead: f64,
}

/// Delays of the stages between a periodic load and its estimate \[s\].
///
/// The delay of a stage is the difference of the phases of the fundamental, over 2πf. The stages
/// share their ends, so the delays add up to the whole. A stage that undoes a lag of an earlier one
/// has a negative delay.
///
/// ```
/// use twinrig_experiment::{LoadDelay, SampledSignal};
///
/// let times_s: Vec<f64> = (0..=1000).map(|ms| f64::from(ms) * 1e-3).collect();
/// let late = |delay_s: f64| -> Vec<f64> {
///     let wave = |t: &f64| libm::sin(std::f64::consts::TAU * 2.0 * (t - delay_s));
///     times_s.iter().map(wave).collect()
/// };
/// let stages = [0.0, 5e-3, 6e-3, 4e-3].map(late);
/// let signal = |values| SampledSignal { times_s: &times_s, values, lead: 0.0 };
/// let [load, sensed, sampled, estimate] = [0, 1, 2, 3].map(|n: usize| signal(&stages[n]));
/// let delay = LoadDelay::of(&load, &sensed, &sampled, &estimate, 2.0).unwrap();
/// assert!((delay.acquisition_s - 1e-3).abs() < 1e-9);
/// assert!((delay.filter_s + 2e-3).abs() < 1e-9); // it undoes a part
/// assert!((delay.whole_s - 4e-3).abs() < 1e-9);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LoadDelay {
    /// From the load to the voltage at the sensor.
    pub sensor_s: f64,
    /// From there to the sample at the host: conversion, frame, line, reading.
    pub acquisition_s: f64,
    /// From there to the estimate: low-pass filter and estimator.
    pub filter_s: f64,
    /// From the load to the estimate.
    pub whole_s: f64,
}

impl LoadDelay {
    /// Returns the delays of a load with the fundamental `hz` \[Hz\], over the whole periods that
    /// all signals cover, counted from the end. Between samples a signal is a straight line.
    ///
    /// A delay is known up to a multiple of the period: each is the one nearest to zero.
    ///
    /// `None` if there is no such period, a signal is not finite or has no fundamental, or times
    /// and values differ in number.
    pub fn of(
        load: &SampledSignal<'_>,
        sensed: &SampledSignal<'_>,
        sampled: &SampledSignal<'_>,
        estimate: &SampledSignal<'_>,
        hz: f64,
    ) -> Option<Self> {
        let signals = [load, sensed, sampled, estimate];
        let window = window(&signals, hz)?;
        let mut phases = [0.0; 4];
        for (phase, signal) in phases.iter_mut().zip(signals) {
            *phase = fundamental(signal, window, hz)? - signal.lead;
        }
        let [load, sensed, sampled, estimate] = phases;
        let delay = |from: f64, to: f64| nearest_to_zero(from - to) / (TAU * hz);
        Some(Self {
            sensor_s: delay(load, sensed),
            acquisition_s: delay(sensed, sampled),
            filter_s: delay(sampled, estimate),
            whole_s: delay(load, estimate),
        })
    }
}

/// Fundamental over the mean magnitude below which it is rounding.
const ROUNDING: f64 = 1e-12;

/// Returns the longest window of whole periods that all signals cover, up to the common end.
fn window(signals: &[&SampledSignal<'_>], hz: f64) -> Option<[f64; 2]> {
    let (mut from, mut to) = (f64::NEG_INFINITY, f64::INFINITY);
    for signal in signals {
        if signal.times_s.len() != signal.values.len() {
            return None;
        }
        from = from.max(*signal.times_s.first()?);
        to = to.min(*signal.times_s.last()?);
    }
    // Rounding of the ends must not cost a period.
    let periods = ((to - from) * hz + 1e-9).floor();
    (periods >= 1.0 && periods.is_finite()).then(|| [to - periods / hz, to])
}

/// Returns the phase of the fundamental \[rad\] over a window of whole periods: that of
/// ∫ (v − v̄) e^(−iωt) dt by the trapezoid rule. Uniform samples give that of band-limited signals
/// exactly; at irregular steps h the errors are some (ωh)²/12 of a radian, of both signs.
fn fundamental(signal: &SampledSignal<'_>, window: [f64; 2], hz: f64) -> Option<f64> {
    let [from, to] = window;
    let mean = integral(signal, window, |value, _| value) / (to - from);
    let angle = |t: f64| TAU * hz * (t - from);
    let real = integral(signal, window, |v, t| (v - mean) * libm::cos(angle(t)));
    let imaginary = -integral(signal, window, |v, t| (v - mean) * libm::sin(angle(t)));
    let size = libm::hypot(real, imaginary);
    let significant = size > ROUNDING * integral(signal, window, |v, _| v.abs());
    (size.is_finite() && significant).then(|| libm::atan2(imaginary, real))
}

/// Integrates a function of value and time over a window that the signal covers.
fn integral(
    signal: &SampledSignal<'_>,
    [from, to]: [f64; 2],
    function: impl Fn(f64, f64) -> f64,
) -> f64 {
    let mut sum = 0.0;
    for (times, values) in signal.times_s.windows(2).zip(signal.values.windows(2)) {
        let (start, end) = (times[0].max(from), times[1].min(to));
        if start >= end {
            continue;
        }
        let slope = (values[1] - values[0]) / (times[1] - times[0]);
        let at = |t: f64| function(values[0] + slope * (t - times[0]), t);
        sum += 0.5 * (end - start) * (at(start) + at(end));
    }
    sum
}

/// Returns the angle in [−π, π] that differs by whole turns.
fn nearest_to_zero(angle: f64) -> f64 {
    let turns = libm::floor(angle / TAU + 0.5);
    (angle - turns * TAU).clamp(-PI, PI)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// Load with harmonics and an offset, late by `delay` \[s\].
    fn wave(hz: f64, t: f64, delay: f64) -> f64 {
        let angle = TAU * hz * (t - delay);
        3.0 + 2.0 * libm::cos(angle) + 0.7 * libm::cos(3.0 * angle + 1.0)
    }

    /// Times every millisecond, each late by up to `jitter` of it.
    fn times(jitter: f64, shift: u32) -> Vec<f64> {
        let late = |i: u32| f64::from((i * 37 + shift) % 101) / 101.0;
        let at = |i: u32| (f64::from(i) + jitter * late(i)) * 1e-3;
        (0..=3000).map(at).collect()
    }

    proptest! {
        /// Delays are those of the construction. The error of the trapezoid rule for irregular
        /// steps h is of the order of (3ωh)²/12 of a radian, of both signs: 1e-4 over ω at most.
        #[test]
        fn delays_are_those_of_shifted_waves(
            hz in 0.5..5.0_f64,
            sensor in -0.02..0.02_f64,
            acquisition in 0.0..0.02_f64,
            filter in -0.02..0.04_f64,
            lead in -3.0..3.0_f64,
            jitter in 0.0..0.9_f64,
        ) {
            let shifts = [0.0, sensor, sensor + acquisition, sensor + acquisition + filter];
            let grids = [0, 11, 29, 53].map(|shift| times(jitter, shift));
            let leads = [0.0, lead, lead, 0.0];
            let values: Vec<Vec<f64>> = (0..4)
                .map(|n| {
                    let at = |&t: &f64| wave(hz, t, shifts[n] - leads[n] / (TAU * hz));
                    grids[n].iter().map(at).collect()
                })
                .collect();
            let signal = |n: usize| SampledSignal {
                times_s: &grids[n],
                values: &values[n],
                lead: leads[n],
            };
            let found = LoadDelay::of(&signal(0), &signal(1), &signal(2), &signal(3), hz).unwrap();
            let tolerance = 1e-4 / (TAU * hz);
            for (found, truth) in [
                (found.sensor_s, sensor),
                (found.acquisition_s, acquisition),
                (found.filter_s, filter),
                (found.whole_s, sensor + acquisition + filter),
            ] {
                prop_assert!((found - truth).abs() < tolerance, "{found} {truth}");
            }
            let sum = found.sensor_s + found.acquisition_s + found.filter_s;
            prop_assert!((sum - found.whole_s).abs() < 1e-12);
        }
    }

    #[test]
    fn signals_without_a_period_have_no_delay() {
        let times_s = times(0.0, 0);
        let values: Vec<_> = times_s.iter().map(|&t| wave(1.0, t, 0.0)).collect();
        let good = SampledSignal {
            times_s: &times_s,
            values: &values,
            lead: 0.0,
        };
        let of = |signal: &SampledSignal<'_>, hz| LoadDelay::of(&good, signal, &good, &good, hz);
        assert!(of(&good, 1.0).is_some());
        assert_eq!(of(&good, 0.3), None);
        assert_eq!(of(&good, f64::NAN), None);
        let short = SampledSignal {
            values: &values[1..],
            ..good
        };
        assert_eq!(of(&short, 1.0), None);
        let constant = vec![3.7; values.len()];
        let flat = SampledSignal {
            values: &constant,
            ..good
        };
        assert_eq!(of(&flat, 1.0), None);
    }
}
