//! Work of servos that follow their commands, by the midpoint rule.

use std::f64::consts::TAU;

use twinrig_lcp::Method;
use twinrig_legged::{Base, Setup};
use twinrig_testing::robots::robot;

use crate::harness::{Integration, lcp, standing_setup};

/// Returns the residual of the energy balance while hips and knees of a held robot swing \[J\].
fn residual(step_us: u64) -> f64 {
    let setup = Setup {
        base: Base::Fixed,
        ground: None,
        ..standing_setup()
    };
    let mut harness = lcp(&robot(), &setup, Integration::new(Method::Moreau, step_us));
    let rest = harness.commands.clone();
    for tick in 1..=100 {
        let angle = TAU * 3.0 * 2e-3 * tick as f64;
        for (pair, rest) in harness.commands.chunks_mut(2).zip(rest.chunks(2)) {
            pair[0] = rest[0] + 0.2 * libm::sin(angle);
            pair[1] = rest[1] + 0.2 * (1.0 - libm::cos(angle));
        }
        harness.advance_to_ms(2 * tick);
    }
    harness.energy().residual.abs()
}

/// A hip at a constant rate changes its momentum as its leg bends: without the work of this change
/// in both half steps, the residual is 5e-5 J at every step.
#[test]
fn energy_balance_of_swinging_hips_closes_with_the_step() {
    // A quarter of the step has a sixteenth of the residual at second order, a quarter at first.
    let (long, short) = (residual(1000), residual(250));
    assert!(long < 2e-5 && short < long / 8.0, "{long:e} {short:e}");
}
