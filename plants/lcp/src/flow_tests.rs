use twinrig_robot::GRAVITY;

use super::*;
use crate::constraints::{DIAGONAL, PANTOGRAPH};
use crate::scenes::{self, hanging};

#[test]
fn two_stops_that_are_closed_at_rest_push_as_virtual_work_says() {
    let robot = scenes::without_toes();
    let mut flow = hanging(&robot, ([0.0; 3], [0.0; 3]));
    // The leg in its reference pose is one body on the hip: it rests where its centre of mass is below.
    let moments = flow.model.legs[0].constants.moments;
    let [mut x, mut z] = [0.0, 0.0];
    for (moment, angle) in moments.iter().zip(&flow.state.angles) {
        x += moment * libm::sin(angle.lane(0));
        z += moment * libm::cos(angle.lane(0));
    }
    let lean = Lanes::splat(libm::atan2(x, z));
    for angle in &mut flow.state.angles {
        *angle -= lean;
    }
    flow.step(1e-3).unwrap();
    let state = flow.state;
    let motion = flow.motion(&state, 0.0);
    let slope = &motion.slope;
    for leg in 0..4 {
        let accelerations = slope.rates.map(|rate| rate.lane(leg));
        assert!(
            accelerations.iter().all(|a| a.abs() < 1e-6),
            "{accelerations:?}"
        );
        let [first, second, third] = state.angles.map(|angle| angle.lane(leg));
        let own = &robot.legs[leg].leg;
        let (l2, ld) = (own.l2, own.l_delta);
        // The third segment turns by itself against the pantograph's stop and the parallel spring, which pulls by its
        // preload; the second against the diagonal's.
        let [_, b2, b3] = flow.model.legs[leg].constants.moments;
        let weight_on_third = GRAVITY * b3 * libm::sin(third);
        let pull = own.parallel.stiffness * own.parallel.preload * ld * libm::sin(third - second);
        let closed = (weight_on_third + pull) / ld;
        let length = libm::sqrt(l2 * l2 + ld * ld + 2.0 * l2 * ld * libm::cos(second - first));
        let lever = -l2 * ld * libm::sin(second - first) / length;
        let weight_on_second = GRAVITY * b2 * libm::sin(second);
        let extended = own.diagonal.stiffness * own.diagonal.preload - weight_on_second / lever;
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
fn stops_that_are_closed_at_rest_stay_closed() {
    let robot = scenes::without_toes();
    let mut flow = hanging(&robot, ([5.0, 0.0, 0.0], [0.0; 3]));
    for _ in 0..100 {
        flow.step(2e-3).unwrap();
        let active = &flow.mode.active;
        assert_eq!(
            [active.closed, active.extended].map(Lanes::to_array),
            [[1.0; 4]; 2]
        );
    }
    assert_eq!(flow.counts.events, 0);
    assert!(flow.open() < 1e-9, "{:e}", flow.open());
}
