//! A leg without stops, against the reference without stops.

use twinrig_testing::reference_trajectory::ReferenceTrajectory;

use crate::engine::Engine;
use crate::flow::Flow;
use crate::mjcf::write_model;
use crate::model::Model;
use crate::options::{Coordinates, Integrator, Options};

/// Returns the root mean square error of the foot \[m\].
fn rms_error(
    reference: &ReferenceTrajectory,
    coordinates: Coordinates,
    integrator: Integrator,
    step_us: u64,
) -> f64 {
    let robot = reference.robot();
    let mut options = Options::new(reference.setup(step_us), coordinates);
    options.numerics.integrator = integrator;
    let mut model = Model::new(&robot, &options).unwrap();
    model.without_stops = true;
    let engine = Engine::compile(&write_model(&robot, &model)).unwrap();
    let mut flow = Flow::of(model, engine).unwrap();
    let hip = robot.legs[0].hip;
    let interval = reference.number("step_s");
    let steps = libm::round(interval * 1e6 / step_us as f64);
    let rows = reference.rows("foot");
    let mut sum = 0.0;
    for (k, row) in rows.iter().enumerate() {
        let mut step = 0.0;
        while k > 0 && step < steps {
            flow.run(step_us as f64 * 1e-6).unwrap();
            step += 1.0;
        }
        let [foot, _] = flow.foot(0);
        for (axis, expected) in [0, 2].into_iter().zip(row) {
            let error = foot[axis] - flow.trunk.position[axis] - hip[axis] - expected;
            sum += error * error;
        }
    }
    libm::sqrt(sum / rows.len() as f64)
}

#[test]
fn leg_without_stops_agrees_with_the_reference() {
    let reference = ReferenceTrajectory::read("passive-free");
    // Measured values times 1.5.
    for (coordinates, integrator, step_us, bound) in [
        (Coordinates::Minimal, Integrator::Rk4, 2000, 2e-7),
        (Coordinates::Minimal, Integrator::Rk4, 100, 2e-12),
        (Coordinates::Minimal, Integrator::Euler, 2000, 2e-4),
        (Coordinates::Maximal, Integrator::ImplicitFast, 2000, 5e-4),
        (Coordinates::Maximal, Integrator::Euler, 2000, 5e-4),
        (Coordinates::Maximal, Integrator::Euler, 100, 3e-5),
    ] {
        let found = rms_error(&reference, coordinates, integrator, step_us);
        println!("{coordinates:?} {integrator:?} {step_us}: {found:e}");
        assert!(
            found < bound,
            "{coordinates:?} {integrator:?} {step_us}: {found:e}"
        );
    }
}
