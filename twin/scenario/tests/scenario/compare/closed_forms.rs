//! Comparisons of sines against closed forms.

use std::f64::consts::TAU;

use proptest::prelude::*;

use super::run::{BESIDE, ESTIMATE, NOTHING, Run, STEP, measured};

/// Lags on either side of zero at a range of 100 ms and a step of 1 ms, with a neighbour.
const LAGS: u64 = 101;

proptest! {
    #![proptest_config(ProptestConfig::with_cases(32))]
    /// The truth is a + sin ωt with amplitude 10, the estimate gain · truth(t − delay) + offset,
    /// over whole periods.
    #[test]
    fn sines_give_the_closed_forms(
        // From 0.5 to 5 Hz: a range of ±100 ms contains one maximum.
        period_ms in 200_u64..2_000,
        periods in 3_u64..8,
        delay in -0.095..0.095_f64,
        gain in 0.2..3.0_f64,
        offset in -20.0..20.0_f64,
    ) {
        let omega = TAU / (STEP * period_ms as f64);
        let truth = |t: f64| 10.0 * libm::sin(omega * t) + 14.0;
        let estimate = |t: f64| gain * (truth(t - delay) - 14.0) + 14.0 + offset;
        let run = Run { truth: &truth, estimate: &estimate, lasts_ms: periods * period_ms, ..NOTHING };
        let cos = libm::cos(omega * delay);
        let amplitude = (gain * gain + 1.0 - 2.0 * gain * cos).sqrt() * 10.0;

        // Sums over whole periods are exact to rounding.
        let rms = (0.5 * amplitude * amplitude + offset * offset).sqrt();
        let found = measured(BESIDE, "error = { max = '1 N' }", &run);
        prop_assert!((found - rms).abs() < 1e-9 * rms, "error {found} {rms}");
        let found = measured(BESIDE, "correlation = { min = 0.5 }", &run);
        prop_assert!((found - cos).abs() < 1e-9, "correlation {found} {cos}");
        let found = measured(BESIDE, "gain = { min = 0.5 }", &run);
        prop_assert!((found - gain * cos).abs() < 1e-9, "gain {found} {}", gain * cos);

        // Samples miss a maximum by up to half a step: 1 − cos(ω h / 2) of the amplitude.
        let missed = |amplitude: f64| amplitude * 0.5 * (0.5 * omega * STEP) * (0.5 * omega * STEP);
        let peak = amplitude + offset.abs();
        let found = measured(BESIDE, "error_peak = { max = '1 N' }", &run);
        prop_assert!((-1e-9..missed(amplitude) + 1e-9).contains(&(peak - found)), "{found} {peak}");

        // Centres over whole periods.
        let run = Run { lasts_ms: run.lasts_ms + 2 * LAGS, ..run };
        let found = measured(BESIDE, "delay = { max = '10 ms' }", &run);
        // The parabola through three points of a cosine, in closed form.
        let lag = (delay / STEP).round();
        let (b, part) = (omega * STEP, delay / STEP - lag);
        let refined = STEP * (lag + libm::tan(b * part) / (2.0 * libm::tan(0.5 * b)));
        prop_assert!((found - refined).abs() < 1e-9, "delay {found} {refined} {delay}");
        prop_assert!((found - delay).abs() <= 0.0161 * b * b * STEP + 1e-9);
    }

    /// Any number of periods: the bias of an incomplete period remains.
    #[test]
    fn delay_over_incomplete_periods_is_right_to_a_millisecond(
        period_ms in 250_u64..1_000,
        lasts_ms in 4_000_u64..8_000,
        delay in -0.09..0.09_f64,
    ) {
        let omega = TAU / (STEP * period_ms as f64);
        let truth = |t: f64| 14.0 * (1.0 - libm::cos(omega * t));
        let run = Run { truth: &truth, estimate: &|t| truth(t - delay), lasts_ms, ..NOTHING };
        let found = measured(BESIDE, "delay = { max = '10 ms' }", &run);
        prop_assert!((found - delay).abs() < 1e-3, "{found} {delay}");
    }

    /// The estimate of a controller is compared at its own instants, with interpolated truth.
    #[test]
    fn signals_of_other_instants_are_compared_without_bias(
        control in prop_oneof![Just(1_u64), Just(2), Just(10)],
        offset_us in 0..10_000_u64,
        delay in -0.05..0.05_f64,
        late in 0.0..5.0_f64,
    ) {
        let truth = |t: f64| 14.0 * (1.0 - libm::cos(TAU * 2.0 * t));
        let run = Run {
            truth: &truth,
            estimate: &|t| truth(t - delay) + late,
            lasts_ms: 20_000,
            control: (control, offset_us),
            ..NOTHING
        };
        let found = measured(ESTIMATE, "delay = { max = '10 ms' }", &run);
        // The bias of the incomplete period of 0.5 s.
        prop_assert!((found - delay).abs() < 2e-4, "{found} {delay}");
        let exact = Run { estimate: &truth, ..run };
        // Linear interpolation errs by ω² a h² / 8.
        let error = measured(ESTIMATE, "error_peak = { max = '1 N' }", &exact);
        prop_assert!(error < 14.0 * (TAU * 2.0 * STEP) * (TAU * 2.0 * STEP) / 8.0 + 1e-9, "{error}");
    }
}
