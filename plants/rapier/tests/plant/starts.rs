//! Whatever the start: joints stay closed, stops hold, and nothing is made up.

use proptest::prelude::*;
use twinrig_legged::StartPose;
use twinrig_rapier::{Joints, Options, Rapier};
use twinrig_runtime::Plant;

use crate::scene::{Scene, hanging, robot};

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
        let options = Options::new(hanging(&["LF"], start, 1000), joints);
        // Some starts are beyond a stop, which is refused as by every plant.
        prop_assume!(Rapier::new(&robot(), &options, &|_| true).is_ok());
        let mut scene = Scene::new(&robot(), &options);
        let energy = scene.plant.energy().stored();
        for k in 1..=100 {
            scene.run_to_us(2000 * k);
            let drift = scene.plant.constraint_violation().unwrap();
            // A link at 30 rad/s leaves its circle by ½ (ωh)² l = 0.03 mm in a step of 1 ms, and a stop is met with as much.
            prop_assert!(drift < 1e-3, "{:?}: {} m open after {} ms", joints, drift, 2 * k);
        }
        // Nothing drives the leg: it has no more than it began with, but for what half a step's velocity misreads.
        let now = scene.plant.energy().stored();
        prop_assert!(now < energy + 0.05 * energy.abs().max(0.02), "{energy} J, then {now} J");
    }
}
