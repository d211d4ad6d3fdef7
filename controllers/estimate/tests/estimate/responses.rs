//! Gradients against differences, and extremes.

use crate::support::CELL;
use proptest::prelude::*;
use twinrig_estimate::{Decay, ForceResponse, Hysteresis, Sigmoid};

fn sigmoids() -> impl Strategy<Value = Sigmoid> {
    let steep = prop_oneof![-3.0..-0.05, 0.05..3.0];
    (0.1..5.0, steep, -20.0..20.0, -1.0..1.0).prop_map(|(a, b, c, d)| Sigmoid { a, b, c, d })
}

proptest! {
    /// Central differences of 1e-5: their error is 1e-10/6 of third derivatives, which are at most
    /// 5·3³/8 here, and 1e-11 of rounding; times 10.
    #[test]
    fn gradients_are_differences(
        loading in sigmoids(),
        unloading in sigmoids(),
        switch in 0.01..1.0,
        force in -30.0..30.0,
        rate in -100.0..100.0,
    ) {
        let cell = Hysteresis { loading, unloading, switch };
        let point = cell.at(force, rate);
        let h = 1e-5;
        let by_force = (cell.at(force + h, rate).voltage - cell.at(force - h, rate).voltage) / (2.0 * h);
        let by_rate = (cell.at(force, rate + h).voltage - cell.at(force, rate - h).voltage) / (2.0 * h);
        prop_assert!((point.by_force - by_force).abs() < 5e-9, "{} {by_force}", point.by_force);
        prop_assert!((point.by_rate - by_rate).abs() < 5e-9, "{} {by_rate}", point.by_rate);
        // A mean of both branches.
        let ends = [loading.at(force).0, unloading.at(force).0];
        let [low, high] = [ends[0].min(ends[1]), ends[0].max(ends[1])];
        prop_assert!((low - 1e-12..=high + 1e-12).contains(&point.voltage));
    }

    #[test]
    fn inverse_returns_the_force(sigmoid in sigmoids(), share in 0.021..0.979) {
        let voltage = sigmoid.d + share * sigmoid.a;
        let force = sigmoid.inverse(voltage).unwrap();
        // Rounding of a voltage of at most 6 V over the least slope, 0.02·0.1·0.05 V/N.
        prop_assert!((sigmoid.at(force).0 - voltage).abs() < 1e-14 + 1e-13 * voltage.abs());
        prop_assert!(sigmoid.inverse(sigmoid.d + 1.01 * sigmoid.a).is_none());
        prop_assert!(sigmoid.inverse(sigmoid.d).is_none());
    }

    #[test]
    fn no_force_overflows(sigmoid in sigmoids(), exponent in 0.0..308.0, rate in -1e300..1e300) {
        for force in [libm::pow(10.0, exponent), -libm::pow(10.0, exponent)] {
            let cell = Hysteresis { loading: sigmoid, unloading: CELL.unloading, switch: 0.05 };
            let point = ForceResponse::Hysteresis(cell).at(force, rate);
            prop_assert!(point.voltage.is_finite());
            prop_assert!(point.by_force.is_finite() && point.by_rate.is_finite());
        }
    }

    #[test]
    fn decay_derivative_is_a_difference(hz in 0.1..5.0, scale_hz in 0.5..3.0) {
        let decay = Decay { value: -0.05, scale_hz };
        let difference = (decay.at(hz + 1e-5).0 - decay.at(hz - 1e-5).0) / 2e-5;
        // 1e-10/6 of the third derivative, at most 0.05·8.
        prop_assert!((decay.at(hz).1 - difference).abs() < 1e-10);
        prop_assert_eq!(decay.at(-hz), (-0.05, 0.0));
    }
}

#[test]
fn rising_forces_use_the_loading_branch() {
    let rising = CELL.at(5.0, 1e3);
    let falling = CELL.at(5.0, -1e3);
    assert_eq!(rising.voltage, CELL.loading.at(5.0).0);
    assert_eq!(falling.voltage, CELL.unloading.at(5.0).0);
    assert!(rising.voltage < falling.voltage);
}

#[test]
fn tails_keep_their_digits() {
    // 1 − s underflows to zero if it is computed as a difference: at z = 40 the derivative is
    // e⁻⁴⁰, and at z = −40 it is the same.
    let unit = Sigmoid {
        a: 1.0,
        b: -1.0,
        c: 0.0,
        d: 0.0,
    };
    let expected = libm::exp(-40.0);
    for force in [40.0, -40.0] {
        let derivative = unit.at(force).1;
        assert!((derivative / expected - 1.0).abs() < 1e-15, "{derivative}");
    }
}
