//! Random initial states: joints stay closed, stops hold, and energy does not grow.

use proptest::prelude::*;
use twinrig_legged::StartPose;
use twinrig_rapier::{Joints, Options, Rapier};
use twinrig_runtime::Plant;
use twinrig_testing::robots::{robot, suspended};

use crate::fixture::with_options;

proptest! {
    #![proptest_config(ProptestConfig { cases: 64, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn joints_stay_closed(
        q1 in -0.6..0.6_f64,
        q2 in -1.4..-0.05_f64,
        opening in 0.0..0.3_f64,
        rates in prop::array::uniform3(-10.0..10.0_f64),
        multibody in any::<bool>(),
    ) {
        let joints = if multibody { Joints::Multibody } else { Joints::Impulse };
        let start = StartPose { q: [q1, q2, opening - q2], rates };
        let options = Options::new(suspended(&["LF"], start, 1000), joints);
        // Some initial states are beyond a stop, which every plant refuses.
        prop_assume!(Rapier::new(&robot(), &options, &|_| true).is_ok());
        let mut fixture = with_options(&robot(), &options);
        let energy = fixture.plant.energy().stored();
        for k in 1..=100 {
            fixture.advance_to_us(2000 * k);
            let drift = fixture.plant.constraint_violation().unwrap();
            // A link at 30 rad/s leaves its circle by ½ (ωh)² l = 0.03 mm in a step of 1 ms, and
            // reaches a stop with as much.
            prop_assert!(drift < 1e-3, "{:?}: {} m open after {} ms", joints, drift, 2 * k);
        }
        // Without drives the energy does not grow, but for the error of velocities half a step old.
        let now = fixture.plant.energy().stored();
        prop_assert!(now < energy + 0.05 * energy.abs().max(0.02), "{energy} J, then {now} J");
    }
}
