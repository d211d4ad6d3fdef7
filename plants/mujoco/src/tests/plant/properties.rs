//! Random robots and initial states.

use proptest::prelude::*;
use twinrig_legged::{Base, Setup, StartPose};
use twinrig_mujoco::{Coordinates, Mujoco, Options};
use twinrig_runtime::Plant;
use twinrig_testing::robots::{LEGS, robot};

use super::fixture::hanging;

fn bases() -> impl Strategy<Value = Base> {
    prop_oneof![Just(Base::Free), Just(Base::Planar), Just(Base::Fixed)]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn constraints_stay_closed(
        scale in 0.7..1.5_f64,
        mass in 0.5..3.0_f64,
        stiffness in 0.3..1.5_f64,
        count in 1..=4_usize,
        base in bases(),
        knee in -60.0..-10.0_f64,
        opening in 0.2..5.0_f64,
        rate in -3.0..3.0_f64,
    ) {
        let mut robot = robot();
        for mount in &mut robot.legs {
            let leg = &mut mount.leg;
            for length in [&mut leg.l1, &mut leg.l2, &mut leg.l3, &mut leg.l_delta, &mut leg.diagonal_min, &mut leg.parallel_travel] {
                *length *= scale;
            }
            for part_mass in [&mut leg.mass.l1, &mut leg.mass.l2, &mut leg.mass.l3, &mut leg.mass.foot] {
                *part_mass *= mass;
            }
            leg.diagonal.stiffness *= stiffness;
            leg.parallel.stiffness *= stiffness;
        }
        let q = [5.0, knee, opening - knee].map(f64::to_radians);
        let setup = Setup {
            base,
            legs: LEGS[..count].iter().map(|&leg| leg.to_owned()).collect(),
            ..hanging(StartPose { q, rates: [rate, -rate, rate] }.into())
        };
        for coordinates in Coordinates::ALL {
            let mut options = Options::new(setup.clone(), coordinates);
            options.setup.step = twinrig_kernel::SimDuration::from_micros(250);
            let plant = Mujoco::new(&robot, &options, &|_| true);
            let mut plant = match plant {
                Ok(plant) => plant,
                Err(error) => {
                    // The initial state may be beyond a stop; no other error is expected.
                    prop_assert!(error.to_string().contains("start"), "{error}");
                    continue;
                }
            };
            for ms in 1..=100 {
                let to = twinrig_kernel::SimTime::ZERO + twinrig_kernel::SimDuration::from_millis(ms);
                plant.advance(to, &[]).unwrap();
                let violation = plant.constraint_violation().unwrap();
                // A stop that is hit at 6 m/s is exceeded by the motion of a step.
                prop_assert!(violation < 1.5e-3, "{coordinates:?}: {violation} m after {ms} ms");
            }
            let balance = plant.energy();
            let residual_share = balance.residual.abs() / balance.exchanged;
            prop_assert!(residual_share < 0.1, "{coordinates:?}: {balance:?}");
        }
    }
}
