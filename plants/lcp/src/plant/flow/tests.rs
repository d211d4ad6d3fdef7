use twinrig_robot::GRAVITY;

use super::*;
use crate::fixtures::{self, hanging, motion};
use crate::model::leg_constraints::{DIAGONAL, PANTOGRAPH};
use crate::model::real::Real;

#[test]
fn closed_stop_forces_at_rest_match_virtual_work() {
    let robot = fixtures::without_toes();
    let mut flow = hanging(&robot, ([0.0; 3], [0.0; 3]));
    // In its reference pose the leg is one body on the hip, in equilibrium with its centre of mass
    // below.
    let moments = flow.model.legs[0].constants.moments;
    let [mut x, mut z] = [0.0, 0.0];
    for (moment, angle) in moments.iter().zip(&flow.run.state.angles) {
        x += moment * libm::sin(angle.lane(0));
        z += moment * libm::cos(angle.lane(0));
    }
    let lean = Lanes::splat(libm::atan2(x, z));
    for angle in &mut flow.run.state.angles {
        *angle -= lean;
    }
    flow.step(1e-3).unwrap();
    let state = flow.run.state;
    let motion = motion(&mut flow, &state, 0.0);
    let slope = &motion.slope;
    for leg in 0..4 {
        let accelerations = slope.rates.map(|rate| rate.lane(leg));
        assert!(
            accelerations.iter().all(|a| a.abs() < 1e-6),
            "{accelerations:?}"
        );
        let [first, second, third] = state.angles.map(|angle| angle.lane(leg));
        let leg_data = &robot.legs[leg].leg;
        let (l2, ld) = (leg_data.l2, leg_data.l_delta);
        // The third segment rotates alone against the pantograph's stop and the parallel spring,
        // which pulls by its preload; the second against the diagonal's.
        let [_, b2, b3] = flow.model.legs[leg].constants.moments;
        let weight_on_third = GRAVITY * b3 * libm::sin(third);
        let pull = leg_data.parallel.stiffness
            * leg_data.parallel.preload
            * ld
            * libm::sin(third - second);
        let closed = (weight_on_third + pull) / ld;
        let length = libm::sqrt(l2 * l2 + ld * ld + 2.0 * l2 * ld * libm::cos(second - first));
        let lever = -l2 * ld * libm::sin(second - first) / length;
        let weight_on_second = GRAVITY * b2 * libm::sin(second);
        let extended =
            leg_data.diagonal.stiffness * leg_data.diagonal.preload - weight_on_second / lever;
        let forces = motion.forces.forces.map(|force| force.lane(leg));
        assert!(closed > 0.0 && extended > 0.0, "{closed} {extended}");
        for (found, expected) in [(forces[PANTOGRAPH], closed), (forces[DIAGONAL], extended)] {
            assert!(
                (found - expected).abs() < 1e-7 * expected,
                "{found} and {expected}"
            );
        }
    }
}

#[test]
fn closed_stops_at_rest_stay_closed() {
    let robot = fixtures::without_toes();
    let mut flow = hanging(&robot, ([5.0, 0.0, 0.0], [0.0; 3]));
    for _ in 0..100 {
        flow.step(2e-3).unwrap();
        let active = &flow.run.mode.active;
        assert_eq!(
            [active.closed, active.extended].map(Lanes::to_array),
            [[1.0; 4]; 2]
        );
    }
    assert_eq!(flow.run.counts.events, 0);
    assert!(flow.violation() < 1e-9, "{:e}", flow.violation());
}
