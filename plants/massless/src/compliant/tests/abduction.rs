//! Legs that abduct, against point masses and against locked joints.

use nalgebra::{Rotation3, Vector3};
use twinrig_compliant::lanes::Quad;
use twinrig_compliant::{AbductionJoints, Equations as _};
use twinrig_kernel::{SimDuration, SimTime};
use twinrig_legged::{Abduction, Base, Drives, Dynamics as _, Readings as _, Setup};
use twinrig_robot::{PointMass, Robot, Servo};
use twinrig_runtime::{Plant as _, PlantState};
use twinrig_testing::abduction::{
    JOINT, Tumble, assert_closed, assert_forces, assert_locked, pushes, servo,
};
use twinrig_testing::point_masses::{self, Point, PointMotion};
use twinrig_testing::robots::{SERVOS, pose, standing, with_legs};

use super::super::equations::{CompliantFlow, initial};
use crate::Massless;
use crate::model::Options;

/// A robot whose legs abduct about axes beside and above the hips, with a load off its middle.
fn robot() -> Robot {
    let mut robot = with_legs(|leg| leg.abduction = Some(JOINT));
    robot.trunk.payloads = vec![PointMass {
        mass: 0.2,
        at: [0.03, 0.02, 0.05],
    }];
    robot
}

/// Builds the robot in a motion, its feet moving within the legs.
fn flow<const A: usize>(
    setup: Setup,
    motion: &Tumble,
    joints: [AbductionJoints<Quad>; A],
) -> CompliantFlow<A> {
    let options = Options::compliant(setup, 1e-9);
    let flow = initial(&robot(), &options, joints, []).unwrap();
    let mut state = flow.state;
    state.position = Quad([0.1, -0.2, 0.3, 0.0]);
    state.attitude = Quad(motion.attitude);
    state.velocity = Quad::of_three(motion.velocity);
    state.turning = Quad::of_three(motion.turning);
    for joints in &mut state.abduction {
        (joints.angle, joints.rate) = (Quad(motion.angles), Quad(motion.rates));
    }
    let carried = flow.equations.relative(&state);
    for (foot, carried) in state.foot.iter_mut().zip(carried) {
        for leg in 0..4 {
            foot.0[leg] += 0.3 * motion.within[leg] - carried.0[leg];
        }
    }
    CompliantFlow::new(flow.equations, state, 1e-9, options.features)
}

/// Builds the robot with joints of abduction, and the same with locked ones.
fn flows(
    setup: &Setup,
    motion: &Tumble,
    servo: Option<Servo>,
) -> (CompliantFlow<1>, CompliantFlow<0>) {
    let free = Setup {
        abduction: servo.map_or(Abduction::Passive, Abduction::Servos),
        ..setup.clone()
    };
    let joints = AbductionJoints::new(&robot(), &free).unwrap();
    (
        flow(free, motion, [joints]),
        flow(setup.clone(), motion, []),
    )
}

/// In the air, between the stops.
fn airborne(drives: Drives) -> Setup {
    Setup {
        ground: None,
        start: pose([10.0, -25.0, 37.0], [0.0; 3]),
        ..standing(drives, 2000)
    }
}

/// Number of the coordinates: trunk, feet in the planes of the legs, joints; index of the first
/// joint.
const COORDINATES: usize = 18;
const JOINTS: usize = 14;

/// Returns the motion of the masses of trunk, hips and feet.
fn motion<'r, const A: usize>(
    flow: &mut CompliantFlow<A>,
    robot: &'r Robot,
) -> PointMotion<impl Fn(&[f64; COORDINATES]) -> Vec<Point> + 'r, COORDINATES> {
    flow.update_slope();
    let (state, slope) = (flow.state, flow.slope.unwrap().state);
    let (position, attitude) = (flow.position(), Rotation3::from_matrix(&flow.rotation()));
    // The coordinates are those of the trunk's own centre of mass.
    let centre = flow
        .equations
        .centre_of_trunk()
        .map_or_else(Vector3::zeros, Vector3::from);
    let turning = Vector3::from(state.turning.three());
    let spin = Vector3::from(slope.turning.three());
    let velocity = Vector3::from(state.velocity.three()) + turning.cross(&centre);
    let acceleration =
        Vector3::from(slope.velocity.three()) + spin.cross(&centre) + turning.cross(&velocity);
    let (mut rates, mut accelerations) = ([0.0; COORDINATES], [0.0; COORDINATES]);
    rates[..3].copy_from_slice((attitude * velocity).as_slice());
    accelerations[..3].copy_from_slice((attitude * acceleration).as_slice());
    rates[3..6].copy_from_slice(turning.as_slice());
    accelerations[3..6].copy_from_slice(spin.as_slice());
    let relative = flow.equations.relative(&state);
    // Accelerations of the feet within the legs: differences of their velocities.
    let step = 1e-6;
    let moved = |by: f64| {
        let next = state.zip(&slope, |value, rate| {
            Quad(std::array::from_fn(|i| value.0[i] + by * rate.0[i]))
        });
        flow.equations.relative(&next)
    };
    let (before, after) = (moved(-step), moved(step));
    for leg in 0..4 {
        for i in 0..2 {
            rates[6 + 2 * leg + i] = relative[i].0[leg];
            accelerations[6 + 2 * leg + i] = (after[i].0[leg] - before[i].0[leg]) / (2.0 * step);
        }
        for (joint, slope) in state.abduction.iter().zip(&slope.abduction) {
            rates[JOINTS + leg] = joint.rate.0[leg];
            accelerations[JOINTS + leg] = slope.rate.0[leg];
        }
    }
    let places = move |by: &[f64; COORDINATES]| {
        let mut points = point_masses::trunk(robot);
        points.extend(
            robot
                .trunk
                .payloads
                .iter()
                .map(|load| (load.mass, load.at.into())),
        );
        for (i, mount) in robot.legs.iter().enumerate() {
            let leg = &mount.leg;
            let angle = [0, 1, 2].map(|link| state.angles[link].0[i]);
            let lengths = [leg.l1, leg.l2, leg.l3 - leg.l_delta];
            let mut at = Vector3::new(by[6 + 2 * i], 0.0, by[7 + 2 * i]);
            for (length, angle) in lengths.into_iter().zip(angle) {
                at += Vector3::new(libm::sin(angle), 0.0, -libm::cos(angle)) * length;
            }
            let angle = state
                .abduction
                .first()
                .map_or(0.0, |joint| joint.angle.0[i]);
            let foot = point_masses::abducted(mount, angle + by[JOINTS + i], at);
            points.push((leg.mass.lumped_foot, foot));
            // The other masses of the leg are part of the trunk.
            points.push((leg.mass.total() - leg.mass.lumped_foot, mount.hip.into()));
        }
        point_masses::in_world(points, &position, &attitude, by)
    };
    PointMotion {
        places,
        rates,
        accelerations,
    }
}

#[test]
fn accelerations_are_those_of_point_masses() {
    let robot = robot();
    for seed in 0..64 {
        let (mut flow, mut locked) = flows(&airborne(SERVOS), &Tumble::drawn(seed), None);
        let motion = motion(&mut flow, &robot);
        let of_locked = self::motion(&mut locked, &robot);
        let internal = of_locked.forces();
        // In flight nothing acts on the trunk, friction on the joints, and on the feet that which
        // acts with locked joints.
        assert_forces(&motion.forces(), |i| match i {
            0..6 => 0.0,
            6..JOINTS => internal[i],
            _ => -JOINT.friction * motion.rates[i],
        });
        // Beside the masses move the rotors of hips and pulleys.
        let rotors = flow.stored()[0] - motion.kinetic();
        let expected = locked.stored()[0] - of_locked.kinetic();
        assert!((rotors - expected).abs() < 1e-7, "{rotors} {expected}");
    }
}

#[test]
fn joints_at_rest_at_zero_are_locked() {
    for seed in 0..64 {
        for base in [Base::Free, Base::Planar] {
            let setup = Setup {
                base,
                ..standing(SERVOS, 2000)
            };
            let motion = Tumble::drawn(seed).upright();
            let (mut flow, mut locked) = flows(&setup, &motion, Some(servo(f64::MAX)));
            flow.update_slope();
            locked.update_slope();
            let (mut found, mut expected) = (Vec::new(), Vec::new());
            flow.slope.unwrap().state.map(|quad| found.extend(quad.0));
            locked
                .slope
                .unwrap()
                .state
                .map(|quad| expected.extend(quad.0));
            assert_locked(&found, &expected);
            for (a, b) in flow.stored().iter().zip(locked.stored()) {
                assert!((a - b).abs() < 1e-12 * (1.0 + a.abs()), "{a} {b}");
            }
        }
    }
}

#[test]
fn energy_balance_closes_in_drops_under_pushes() {
    for seed in 0..24_u32 {
        let setup = Setup {
            start: pose([10.0, -25.0, 37.0], [0.0; 3]),
            ..standing(SERVOS, 2000)
        };
        let servo = (seed % 2 == 0).then(|| servo(0.02 + 0.01 * f64::from(seed)));
        let motion = Tumble::drawn(u64::from(seed));
        let ((mut flow, _), mut pushes) = (flows(&setup, &motion, servo), pushes());
        for step in 0..100 {
            flow.set_load(pushes.over(SimTime::ZERO + SimDuration::from_millis(2 * step)));
            flow.step(2e-3).unwrap();
        }
        let balance = flow.ledger.balance();
        assert!(balance.external.abs() > 1e-3, "{balance:?}");
        assert_closed(&balance, 1e-6);
    }
}

#[test]
fn absent_legs_have_no_joints() {
    // Their joints would divide by an inertia of zero.
    let mut robot = robot();
    robot.legs.truncate(2);
    let setup = Setup {
        legs: robot.legs.iter().map(|mount| mount.name.clone()).collect(),
        abduction: Abduction::Passive,
        ..airborne(SERVOS)
    };
    let mut plant = Massless::new(&robot, &Options::compliant(setup, 1e-6), &|_| true).unwrap();
    let mut inputs = [0.0; 4];
    plant.initial_inputs(&mut inputs);
    let end = SimTime::ZERO + SimDuration::from_millis(50);
    plant.advance(end, &inputs).unwrap();
    let balance = plant.energy();
    assert_closed(&balance, 1e-4);
}

#[test]
fn posture_and_joints_are_restored() {
    let (flow, _) = flows(&airborne(SERVOS), &Tumble::drawn(2), None);
    let state = flow
        .extra_state()
        .iter()
        .fold(PlantState::at(SimTime::ZERO), |state, (name, values)| {
            state.with(name, values)
        });
    let (resumed, lines) = flow.equations.state_of(&flow.posture(), &state).unwrap();
    assert!(lines.is_empty(), "{lines:?}");
    resumed.zip(&flow.state, |a, b| {
        for (a, b) in a.0.iter().zip(b.0) {
            // The pose of a leg is found from hip and foot.
            assert!((a - b).abs() < 1e-9, "{a} {b}");
        }
        a
    });
}
