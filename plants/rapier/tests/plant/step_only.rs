//! Steps of the engine alone.

use twinrig_legged::Drives;
use twinrig_rapier::{Joints, Options, Rapier, RapierError, Solver};
use twinrig_testing::reference_trajectory::ReferenceTrajectory;
use twinrig_testing::robots::{self, robot};

use crate::fixture::with_options;

/// Returns the root mean square error of the foot \[m\].
fn error(name: &str, step_us: u64, sweeps: u32) -> f64 {
    let reference = ReferenceTrajectory::read(name);
    let options = options(reference.setup(step_us), sweeps);
    let mut fixture = with_options(&reference.robot(), &options);
    reference.follow(&mut fixture).unwrap().rms
}

fn options(setup: twinrig_legged::Setup, sweeps: u32) -> Options {
    let mut options = Options::new(setup, Joints::Impulse);
    options.step_only = true;
    options.solver = Solver {
        pgs_iterations: sweeps,
        stabilization_iterations: 1,
        ..options.solver
    };
    options
}

#[test]
fn steps_alone_converge_to_the_model_of_the_complete_plant() {
    // Measured: 0.066, 0.83 and 0.63 mm, and at a tenth of the step 0.007, 0.24 and 0.15 mm.
    for (name, coarse, fine) in [
        ("passive", 1e-4, 1.1e-5),
        ("between", 1.3e-3, 3.7e-4),
        ("hard-hit", 1e-3, 2.2e-4),
    ] {
        let errors = [2000, 200].map(|step| error(name, step, 100));
        assert!(errors[0] < coarse && errors[1] < fine, "{name}: {errors:?}");
        assert!(errors[0] > 2.0 * errors[1], "{name}: {errors:?}");
    }
}

#[test]
fn drives_and_trees_are_refused() {
    let ideal = robots::standing(Drives::Ideal { period: 2e-3 }, 2000);
    let none = robots::standing(Drives::None, 2000);
    let mut tree = options(none, 1);
    tree.joints = Joints::Multibody;
    for options in [options(ideal, 1), tree] {
        let refused = Rapier::new(&robot(), &options, &|_| true);
        assert_eq!(refused.err(), Some(RapierError::StepOnly));
    }
}
