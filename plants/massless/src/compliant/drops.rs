//! Drops onto the ground.

use proptest::prelude::*;
use twinrig_compliant::lanes::Quad;
use twinrig_legged::{Base, Ledger, Setup};
use twinrig_testing::robots::{SERVOS, pose, robot, standing};

use super::equations::initial;
use crate::model::Options;

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]
    #[test]
    fn dissipation_never_decreases(
        height in 0.12..0.25_f64,
        velocity in proptest::array::uniform3(-1.0..1.0_f64),
        turning in proptest::array::uniform3(-3.0..3.0_f64),
    ) {
        let setup = Setup {
            base: Base::Free,
            start: pose([20.0, -40.0, 62.0], [0.0; 3]),
            ..standing(SERVOS, 2000)
        };
        let mut flow = initial(&robot(), &Options::compliant(setup, 1e-6), [], []).unwrap();
        flow.state.position.0[2] = height;
        flow.state.velocity = Quad::of_three(velocity);
        flow.state.turning = Quad::of_three(turning);
        flow.state.foot = [velocity[0], velocity[2]].map(Quad::splat);
        flow.ledger = Ledger::opened(flow.stored());
        for _ in 0..100 {
            let before = flow.sums.dissipated.0;
            flow.step(2e-3).unwrap();
            let after = flow.sums.dissipated.0;
            // Exact: sums of powers, none negative, with positive weights.
            prop_assert!(before.iter().zip(after).all(|(a, b)| b >= *a), "{before:?} {after:?}");
        }
    }
}
