//! Properties of the Tegotae rule. ω and σF are in rad/s.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use proptest::prelude::*;

use crate::FixedPoint::{self, Compensated, Plain};
use crate::tegotae_rule::{advance, low_pass, rate, wrap};

/// Distance of two phases on the circle.
fn distance(a: f64, b: f64) -> f64 {
    let d = (a - b).rem_euclid(TAU);
    d.min(TAU - d)
}

fn rules() -> impl Strategy<Value = FixedPoint> {
    prop::sample::select(FixedPoint::ALL.to_vec())
}

/// A rate of either sign, not tiny.
fn rates() -> impl Strategy<Value = f64> {
    (0.5..40.0_f64, any::<bool>()).prop_map(|(size, negative)| if negative { -size } else { size })
}

/// The classical Runge–Kutta method, as an independent solution.
fn runge_kutta(rule: FixedPoint, phase: f64, omega: f64, force: f64, seconds: f64) -> f64 {
    let steps = 4000;
    let h = seconds / f64::from(steps);
    let f = |phase| rate(rule, phase, omega, force);
    (0..steps).fold(phase, |phase, _| {
        let a = f(phase);
        let b = f(phase + 0.5 * h * a);
        let c = f(phase + 0.5 * h * b);
        let d = f(phase + h * c);
        phase + h / 6.0 * (a + 2.0 * b + 2.0 * c + d)
    })
}

proptest! {
    #[test]
    fn phase_is_the_solution_of_the_differential_equation(
        rule in rules(), phase in 0.0..TAU, omega in rates(), force in rates(), seconds in 1e-4..0.2_f64,
    ) {
        let expected = runge_kutta(rule, phase, omega, force, seconds);
        let found = advance(rule, phase, omega, force, seconds);
        prop_assert!(distance(found, expected) < 1e-9, "{found} {}", wrap(expected));
    }

    #[test]
    fn mid_stance_is_a_fixed_point_that_attracts_for_positive_feedback_only(
        omega in rates(), excess in 1.05..20.0_f64, negative in any::<bool>(), away in 0.001..0.3_f64,
    ) {
        let force = if negative { -omega.abs() * excess } else { omega.abs() * excess };
        // Short enough for an unstable fixed point, at which rounding errors grow.
        let stay = advance(Compensated, 1.5 * PI, omega, force, 5.0 / force.abs());
        prop_assert!(distance(stay, -FRAC_PI_2) < 1e-10);
        let shift = Compensated.compensation(omega, force);
        // A deviation of either sign, short of the other fixed point.
        let away = away * libm::cos(shift);
        for start in [-FRAC_PI_2 - away, -FRAC_PI_2 + away] {
            let end = advance(Compensated, wrap(start), omega, force, 100.0);
            let expected = if negative { FRAC_PI_2 - 2.0 * shift } else { -FRAC_PI_2 };
            prop_assert!(distance(end, expected) < 1e-6, "{end}");
        }
    }

    #[test]
    fn plain_fixed_point_is_that_of_eq_3_5(omega in rates(), excess in 1.05..20.0_f64, start in 0.0..TAU) {
        let force = omega.abs() * excess;
        let expected = -libm::acos(omega / force);
        prop_assume!(distance(start, -expected) > 1e-3);
        let end = advance(Plain, start, omega, force, 100.0);
        prop_assert!(distance(end, expected) < 1e-6, "{end} {expected}");
    }

    #[test]
    fn fixed_point_is_reached_at_the_rate_of_the_linearised_equation(
        rule in rules(), omega in rates(), excess in 1.5..5.0_f64, seconds in 0.001..0.1_f64,
    ) {
        let force = omega.abs() * excess;
        let at = match rule { Compensated => -FRAC_PI_2, Plain => -libm::acos(omega / force) };
        let end = advance(rule, wrap(at + 1e-6), omega, force, seconds);
        let decay = libm::exp(-(force * force - omega * omega).sqrt() * seconds);
        prop_assert!((distance(end, at) / 1e-6 - decay).abs() < 1e-4);
    }

    #[test]
    fn cycle_takes_the_period_of_the_beat(rule in rules(), phase in 0.0..TAU, omega in rates(), share in -0.95..0.95_f64) {
        // Of Adler's equation: 2π/√(ω² − (σF)²), in the compensated rule as well.
        let force = share * omega;
        let period = TAU / (omega * omega - force * force).sqrt();
        prop_assert!(distance(advance(rule, phase, omega, force, period), phase) < 1e-9);
        let quarter = advance(rule, phase, omega, force, 0.25 * period);
        prop_assert!(distance(quarter, phase) > 1e-2);
    }

    #[test]
    fn rate_is_negative_exactly_between_mid_stance_and_its_mirror_image(
        omega in 0.5..40.0_f64, ratio in 0.01..20.0_f64, phase in -PI..PI,
    ) {
        let force = omega * ratio;
        let moved = advance(Compensated, wrap(phase), omega, force, 1e-6) - wrap(phase);
        let moved = moved - TAU * (moved / TAU).round();
        let mirror = FRAC_PI_2 - 2.0 * Compensated.compensation(omega, force);
        prop_assume!(distance(phase, -FRAC_PI_2) > 1e-3 && distance(phase, mirror) > 1e-3);
        let back = force > omega && phase > -FRAC_PI_2 && phase < mirror;
        prop_assert_eq!(moved < 0.0, back, "{}", moved);
        prop_assert!(force > omega || rate(Compensated, phase, omega, force) >= 0.0);
    }

    #[test]
    fn sign_of_a_compensated_feedback_below_the_excitation_has_no_effect(
        phase in 0.0..TAU, omega in rates(), share in 0.0..1.0_f64, seconds in 0.0..0.2_f64,
    ) {
        let at = |force: f64| advance(Compensated, phase, omega, force, seconds);
        prop_assert!(distance(at(share * omega), at(-share * omega)) < 1e-12);
    }

    #[test]
    fn rule_is_continuous_where_excitation_equals_feedback(
        omega in rates(), negative in any::<bool>(), phase in 0.0..TAU, seconds in 0.0..0.05_f64,
    ) {
        let force = if negative { -omega } else { omega };
        let at = |ratio: f64| advance(Compensated, phase, omega, force * ratio, seconds);
        // The compensation has a vertical tangent there: a square root of the difference.
        for near in [at(1.0 - 1e-13), at(1.0 + 1e-13)] {
            prop_assert!(distance(near, at(1.0)) < 1e-5);
        }
    }

    #[test]
    fn without_load_the_phase_rate_is_the_excitation(rule in rules(), phase in 0.0..TAU, omega in rates(), seconds in 0.0..2.0_f64) {
        let expected = phase + omega * seconds;
        prop_assert!(distance(advance(rule, phase, omega, 0.0, seconds), expected) < 1e-12);
        // Nor does a tiny load matter.
        prop_assert!(distance(advance(Plain, phase, omega, 1e-12, seconds), expected) < 1e-11);
    }

    #[test]
    fn one_step_equals_two(rule in rules(), phase in 0.0..TAU, omega in rates(), force in rates(), a in 0.0..0.1_f64, b in 0.0..0.1_f64) {
        let one = advance(rule, phase, omega, force, a + b);
        let two = advance(rule, advance(rule, phase, omega, force, a), omega, force, b);
        prop_assert!(distance(one, two) < 1e-9);
    }

    #[test]
    fn phase_is_within_one_turn_for_any_elapsed_time(
        rule in rules(), phase in 0.0..TAU, omega in -1e3..1e3_f64, force in -1e9..1e9_f64,
        power in -12.0..10.0_f64,
    ) {
        for (omega, force) in [(omega, force), (omega, omega), (0.0, force), (omega, 1e-300)] {
            let end = advance(rule, phase, omega, force, libm::pow(10.0, power));
            prop_assert!((0.0..TAU).contains(&end), "{end}");
        }
    }

    #[test]
    fn low_pass_has_the_step_response_of_its_time_constant(time in 1e-3..1.0_f64, a in 0.0..1.0_f64, b in 0.0..1.0_f64) {
        let two = low_pass(low_pass(0.0, 5.0, time, a), 5.0, time, b);
        prop_assert!((two - 5.0 * (1.0 - libm::exp(-(a + b) / time))).abs() < 1e-12);
        prop_assert_eq!(low_pass(3.0, 5.0, 0.0, a), 5.0);
    }
}

#[test]
fn leg_at_rest_without_excitation_stays() {
    for force in [0.0, 1.0, 1e9] {
        let end = advance(Compensated, 1.5 * PI, 0.0, force, 1.0);
        assert!(distance(end, -FRAC_PI_2) < 1e-12, "{force}: {end}");
    }
}

#[test]
fn phases_wrap_into_one_turn() {
    for phase in [-1e-20, TAU, TAU.next_down(), -TAU, 1e13, -1e13] {
        assert!((0.0..TAU).contains(&wrap(phase)), "{phase}");
    }
    assert_eq!(wrap(-FRAC_PI_2), 1.5 * PI);
}
