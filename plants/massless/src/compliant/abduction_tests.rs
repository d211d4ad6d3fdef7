//! Legs that abduct, against point masses and against locked joints.

use nalgebra::{Rotation3, Vector3};
use proptest::prelude::*;
use twinrig_compliant::lanes::Quad;
use twinrig_compliant::{AbductionJoints, Equations as _};
use twinrig_legged::{
    Abduction as Joints, Base, Drives, Dynamics as _, Ledger, Readings as _, Setup,
};
use twinrig_robot::{Abduction, PointMass, Robot, Servo};
use twinrig_testing::point_masses::{self, Point, PointMotion};
use twinrig_testing::robots::{SERVOS, pose, standing, with_legs};

use super::equations::{CompliantFlow, initial};
use crate::model::Options;

/// A robot whose legs abduct about axes beside and above the hips, with a load off its middle.
fn robot() -> Robot {
    let mut robot = with_legs(|leg| {
        leg.abduction = Some(Abduction {
            offset: 0.013,
            height: 0.021,
            abduction_max: 0.6,
            adduction_max: 0.3,
            friction: 2e-3,
        });
    });
    robot.trunk.payloads = vec![PointMass {
        mass: 0.2,
        at: [0.03, 0.02, 0.05],
    }];
    robot
}

/// Motion of a robot: of the trunk, of the feet within the legs, and of the joints.
#[derive(Debug, Clone, Copy)]
struct Case {
    attitude: [f64; 4],
    velocity: [f64; 3],
    turning: [f64; 3],
    feet: [f64; 4],
    angles: [f64; 4],
    rates: [f64; 4],
}

fn case() -> impl Strategy<Value = Case> {
    let three = |most: f64| proptest::array::uniform3(-most..most);
    let four = |most: f64| proptest::array::uniform4(-most..most);
    (
        four(0.5),
        three(1.0),
        three(4.0),
        four(0.3),
        four(0.25),
        four(5.0),
    )
        .prop_map(|(attitude, velocity, turning, feet, angles, rates)| Case {
            attitude: [attitude[0] + 1.0, attitude[1], attitude[2], attitude[3]],
            velocity,
            turning,
            feet,
            angles,
            rates,
        })
}

impl Case {
    /// Builds the robot, its feet moving within the legs.
    fn flow<const A: usize>(
        &self,
        setup: Setup,
        joints: [AbductionJoints<Quad>; A],
    ) -> CompliantFlow<A> {
        let options = Options::compliant(setup, 1e-9);
        let mut flow = initial(&robot(), &options, joints).unwrap();
        let state = &mut flow.state;
        state.position = Quad::of_three([0.1, -0.2, 0.5]);
        state.attitude = Quad(self.attitude);
        state.velocity = Quad::of_three(self.velocity);
        state.turning = Quad::of_three(self.turning);
        for joints in &mut state.abduction {
            (joints.angle, joints.rate) = (Quad(self.angles), Quad(self.rates));
        }
        let carried = flow.equations.relative(&flow.state);
        for (foot, carried) in flow.state.foot.iter_mut().zip(carried) {
            for leg in 0..4 {
                foot.0[leg] += self.feet[leg] - carried.0[leg];
            }
        }
        flow.ledger = Ledger::opened(flow.stored());
        let state = flow.state;
        CompliantFlow::new(flow.equations, state, 1e-9, options.features)
    }

    fn flows(&self, setup: &Setup, servo: Option<Servo>) -> (CompliantFlow<1>, CompliantFlow<0>) {
        let abduction = servo.map_or(Joints::Passive, Joints::Servos);
        let free = Setup {
            abduction,
            ..setup.clone()
        };
        let joints = AbductionJoints::new(&robot(), &free).unwrap();
        (self.flow(free, [joints]), self.flow(setup.clone(), []))
    }
}

/// In the air, between the stops.
fn airborne(drives: Drives) -> Setup {
    Setup {
        ground: None,
        start: pose([10.0, -25.0, 37.0], [0.0; 3]),
        ..standing(drives, 2000)
    }
}

fn servo(torque: f64) -> Servo {
    Servo {
        torque,
        speed: 6.0,
        lag: 0.02,
        dead_band: 0.0,
        inertia: 1e-5,
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

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]
    #[test]
    fn accelerations_are_those_of_point_masses(case in case()) {
        let robot = robot();
        let (mut flow, mut locked) = case.flows(&airborne(SERVOS), None);
        let motion = motion(&mut flow, &robot);
        let forces = motion.forces();
        let internal = self::motion(&mut locked, &robot).forces();
        for i in 0..COORDINATES {
            // In flight: nothing acts on the trunk, friction on the joints, and on the feet what
            // acts with locked joints.
            let expected = match i {
                0..6 => 0.0,
                6..JOINTS => internal[i],
                _ => -2e-3 * motion.rates[i],
            };
            // Differences of places known to 1e-16 m over 1e-4 s, and of velocities over 1e-6 s.
            let size = 1e-5 * (1.0 + expected.abs());
            prop_assert!((forces[i] - expected).abs() < size, "{i}: {} {expected}", forces[i]);
        }
        let rotors: f64 = flow.stored()[0] - motion.kinetic();
        let of_locked: f64 = locked.stored()[0] - self::motion(&mut locked, &robot).kinetic();
        prop_assert!((rotors - of_locked).abs() < 1e-7, "{rotors} {of_locked}");
    }

    #[test]
    fn joints_at_rest_at_zero_are_locked(case in case()) {
        let held = Case { angles: [0.0; 4], rates: [0.0; 4], ..case };
        for base in [Base::Free, Base::Planar] {
            let setup = Setup { base, ..standing(SERVOS, 2000) };
            let (mut flow, mut locked) = held.flows(&setup, Some(servo(f64::MAX)));
            flow.update_slope();
            locked.update_slope();
            let mut numbers = Vec::new();
            locked.slope.unwrap().state.map(|quad| numbers.extend(quad.0));
            let mut i = 0;
            flow.slope.unwrap().state.map(|quad| {
                for value in quad.0 {
                    // Joints follow the others.
                    let expected = numbers.get(i).copied().unwrap_or(value);
                    let size = 1e-9 * (1.0 + expected.abs());
                    assert!((value - expected).abs() < size, "{i}: {value} {expected}");
                    i += 1;
                }
            });
            prop_assert_eq!(i, numbers.len() + 12);
            for (a, b) in flow.stored().iter().zip(locked.stored()) {
                prop_assert!((a - b).abs() < 1e-12 * (1.0 + a.abs()), "{} {}", a, b);
            }
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]
    #[test]
    fn energy_balance_closes_in_drops(
        case in case(), torque in 0.02..0.3_f64, is_driven in any::<bool>(),
    ) {
        let setup = Setup { start: pose([10.0, -25.0, 37.0], [0.0; 3]), ..standing(SERVOS, 2000) };
        let (mut flow, _) = case.flows(&setup, is_driven.then(|| servo(torque)));
        for _ in 0..100 {
            flow.step(2e-3).unwrap();
        }
        let balance = flow.ledger.balance();
        prop_assert!(balance.residual.abs() < 1e-6 * balance.exchanged, "{balance:?}");
    }
}

#[test]
fn posture_and_joints_are_restored() {
    let case = Case {
        attitude: [0.8, 0.2, -0.4, 0.4],
        velocity: [0.5, -0.2, 0.1],
        turning: [1.0, 2.0, -1.5],
        feet: [0.1, -0.1, 0.2, 0.0],
        angles: [0.2, -0.1, 0.25, 0.05],
        rates: [3.0, -2.0, 1.0, 4.0],
    };
    let (flow, _) = case.flows(&airborne(SERVOS), None);
    let state = flow.extra_state().iter().fold(
        twinrig_runtime::PlantState::at(twinrig_kernel::SimTime::ZERO),
        |state, (name, values)| state.with(name, values),
    );
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
