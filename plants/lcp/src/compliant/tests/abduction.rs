//! Legs that abduct, against point masses and against locked joints.

use nalgebra::{Rotation3, Vector3};
use proptest::prelude::*;
use twinrig_compliant::lanes::{Features, Quad};
use twinrig_compliant::{AbductionJoints, Equations as _, JointState};
use twinrig_contact::Ground;
use twinrig_legged::{
    Abduction as AbductionMode, Base, Drives, Dynamics as _, Ledger, Readings as _, Setup,
};
use twinrig_robot::{Abduction, Robot, Servo};
use twinrig_testing::point_masses::{self, Point, PointMotion};

use super::super::equations::{CompliantFlow, compliant_state};
use super::super::model::{CompliantEquations, CompliantModel};
use super::compliance;
use crate::fixtures::{self, flow, without_toes};

/// A robot whose legs abduct, about axes beside and above the hips.
fn robot() -> Robot {
    let mut robot = without_toes();
    for mount in &mut robot.legs {
        mount.leg.abduction = Some(Abduction {
            offset: 0.013,
            height: 0.021,
            abduction_max: 0.6,
            adduction_max: 0.3,
            friction: 2e-3,
        });
        mount.leg.compliance = Some(compliance());
    }
    robot
}

/// Servo of abduction, stronger or weaker.
fn servo(torque: f64) -> Servo {
    Servo {
        torque,
        speed: 6.0,
        lag: 0.02,
        dead_band: 0.0,
        inertia: 1e-5,
    }
}

type Locked = CompliantFlow<3, 1, 0>;
type Abducting = CompliantFlow<3, 1, 1>;

/// Motion of a robot: of the trunk, of the links by leg, and of the joints of abduction.
#[derive(Debug, Clone, Copy)]
struct Case {
    position: [f64; 3],
    attitude: [f64; 4],
    velocity: [f64; 3],
    turning: [f64; 3],
    swing: [f64; 4],
    angles: [f64; 4],
    rates: [f64; 4],
}

fn case() -> impl Strategy<Value = Case> {
    let three = |most: f64| proptest::array::uniform3(-most..most);
    let four = |most: f64| proptest::array::uniform4(-most..most);
    (
        three(0.2),
        four(0.5),
        three(1.0),
        three(4.0),
        four(4.0),
        four(0.25),
        four(5.0),
    )
        .prop_map(
            |(position, attitude, velocity, turning, swing, angles, rates)| Case {
                position,
                attitude: [attitude[0] + 1.0, attitude[1], attitude[2], attitude[3]],
                velocity,
                turning,
                swing,
                angles,
                rates,
            },
        )
}

impl Case {
    /// Builds the robot with joints of abduction, and the same with locked ones.
    fn flows(
        &self,
        base: Base,
        drives: Drives,
        ground: Option<Ground>,
        servo: Option<Servo>,
        tolerance: f64,
    ) -> (Abducting, Locked) {
        let robot = robot();
        let pose = ([20.0, -40.0, 55.0], [-3.0, 5.0, 8.0]);
        let setup = fixtures::setup(&robot, base, pose, drives, ground);
        let rigid = flow::<3>(
            &robot,
            base,
            pose,
            setup.drives.clone(),
            setup.ground.clone(),
        );
        let abduction = servo.map_or(AbductionMode::Passive, AbductionMode::Servos);
        let joints = AbductionJoints::new(&robot, &Setup { abduction, ..setup }).unwrap();
        let compliances = vec![compliance(); 4];
        let model = CompliantModel::new(rigid.model.clone(), &compliances, [joints]);
        let mut state = compliant_state::<3, 1, 1>(&rigid.run.state);
        state.position = Quad::of_three(self.position);
        state.attitude = Quad(self.attitude);
        state.velocity = Quad::of_three(self.velocity);
        state.turning = Quad::of_three(self.turning);
        for (rate, by) in state.rates[1].0.iter_mut().zip(self.swing) {
            *rate += by;
        }
        state.abduction = [JointState {
            angle: Quad(self.angles),
            rate: Quad(self.rates),
            impulse: Quad::splat(0.0),
        }];
        let mut locked = compliant_state::<3, 1, 0>(&rigid.run.state);
        (locked.position, locked.attitude) = (state.position, state.attitude);
        (locked.velocity, locked.turning) = (state.velocity, state.turning);
        locked.rates = state.rates;
        let of_locked = CompliantModel::new(rigid.model, &compliances, []);
        let features = Features::Detected;
        (
            Abducting::new(CompliantEquations::new(model), state, tolerance, features),
            Locked::new(
                CompliantEquations::new(of_locked),
                locked,
                tolerance,
                features,
            ),
        )
    }
}

/// Number of the coordinates: trunk, links by leg, joints of abduction; index of the first joint.
const COORDINATES: usize = 22;
const JOINTS: usize = 18;

/// Returns the motion of a robot as point masses: rods of the legs by Simpson's rule.
fn motion<'r, const A: usize>(
    flow: &mut CompliantFlow<3, 1, A>,
    robot: &'r Robot,
) -> PointMotion<impl Fn(&[f64; COORDINATES]) -> Vec<Point> + 'r, COORDINATES> {
    flow.update_slope();
    let (state, slope) = (flow.state, flow.slope.unwrap().state);
    let (position, attitude) = (flow.position(), Rotation3::from_matrix(&flow.rotation()));
    let (velocity, turning) = (Vector3::from(state.velocity.three()), state.turning.three());
    let acceleration =
        Vector3::from(slope.velocity.three()) + Vector3::from(turning).cross(&velocity);
    let (mut rates, mut accelerations) = ([0.0; COORDINATES], [0.0; COORDINATES]);
    rates[..3].copy_from_slice((attitude * velocity).as_slice());
    accelerations[..3].copy_from_slice((attitude * acceleration).as_slice());
    rates[3..6].copy_from_slice(&turning);
    accelerations[3..6].copy_from_slice(&slope.turning.three());
    for leg in 0..4 {
        for link in 0..3 {
            rates[6 + 3 * leg + link] = state.rates[link].0[leg];
            accelerations[6 + 3 * leg + link] = slope.rates[link].0[leg];
        }
        for (joint, slope) in state.abduction.iter().zip(&slope.abduction) {
            rates[JOINTS + leg] = joint.rate.0[leg];
            accelerations[JOINTS + leg] = slope.rate.0[leg];
        }
    }
    let places = move |by: &[f64; COORDINATES]| {
        let mut points = point_masses::trunk(robot);
        for (i, mount) in robot.legs.iter().enumerate() {
            let leg = &mount.leg;
            let angle = |link: usize| state.angles[link].0[i] + by[6 + 3 * i + link];
            let ahead = [0, 1, 2]
                .map(|link| Vector3::new(libm::sin(angle(link)), 0.0, -libm::cos(angle(link))));
            let angle = state
                .abduction
                .first()
                .map_or(0.0, |joint| joint.angle.0[i]);
            let mut put = |mass: f64, at: Vector3<f64>| {
                points.push((
                    mass,
                    point_masses::abducted(mount, angle + by[JOINTS + i], at),
                ));
            };
            let mut rod = |mass: f64, from: Vector3<f64>, along: Vector3<f64>| {
                for (share, at) in [(1.0, 0.0), (4.0, 0.5), (1.0, 1.0)] {
                    put(mass * share / 6.0, from + along * at);
                }
            };
            let knee = ahead[0] * leg.l1;
            let ankle = knee + ahead[1] * leg.l2;
            rod(leg.mass.l1, Vector3::zeros(), knee);
            rod(leg.mass.l2, knee, ahead[1] * leg.l2);
            rod(
                leg.mass.l3,
                ankle - ahead[2] * leg.l_delta,
                ahead[2] * leg.l3,
            );
            put(leg.mass.foot, ankle + ahead[2] * (leg.l3 - leg.l_delta));
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
        let (mut flow, mut locked) = case.flows(Base::Free, Drives::None, None, None, 1e-6);
        let robot = robot();
        let motion = motion(&mut flow, &robot);
        let forces = motion.forces();
        let internal = self::motion(&mut locked, &robot).forces();
        for i in 0..COORDINATES {
            // In flight: nothing acts on the trunk, friction on the joints, and inside the legs
            // that which acts with locked joints.
            let expected = match i {
                0..6 => 0.0,
                6..JOINTS => internal[i],
                _ => -2e-3 * motion.rates[i],
            };
            // Differences over 1e-4 s of places known to 1e-16 m.
            let size = 1e-5 * (1.0 + expected.abs());
            prop_assert!((forces[i] - expected).abs() < size, "{i}: {} {expected}", forces[i]);
        }
        let [kinetic, ..] = flow.stored();
        let expected = motion.kinetic();
        prop_assert!((kinetic - expected).abs() < 1e-7 * expected, "{kinetic} {expected}");
    }

    #[test]
    fn joints_at_rest_at_zero_are_locked(case in case()) {
        let held = Case { angles: [0.0; 4], rates: [0.0; 4], ..case };
        let drives = || fixtures::servo_drives(&robot());
        for (base, drives) in [
            (Base::Free, Drives::None), (Base::Free, drives()), (Base::Planar, drives()),
        ] {
            // A servo without limit holds its position.
            let servo = Some(servo(f64::MAX));
            let (mut flow, mut locked) =
                held.flows(base, drives, Some(fixtures::flat()), servo, 1e-6);
            flow.update_slope();
            locked.update_slope();
            let (found, expected) = (flow.slope.unwrap(), locked.slope.unwrap());
            let mut numbers = Vec::new();
            expected.state.map(|quad| numbers.extend(quad.0));
            let mut i = 0;
            found.state.map(|quad| {
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

    #[test]
    fn servos_follow_their_command_or_are_at_the_limit_of_their_torque(
        case in case(), torque in 0.001..0.3_f64,
    ) {
        let servo = servo(torque);
        for drives in [Drives::None, fixtures::servo_drives(&robot())] {
            let (mut flow, _) =
                case.flows(Base::Free, drives, Some(fixtures::flat()), Some(servo), 1e-6);
            flow.update_slope();
            let joints = flow.slope.unwrap().state.abduction[0];
            for leg in 0..4 {
                let rate = case.rates[leg];
                // At its set-point, the cascade commands the rate to zero.
                let wanted = -rate * 4.0 / 0.02;
                let torque_found = joints.impulse.0[leg] + servo.inertia * joints.rate.0[leg];
                let lost = rate * torque / 6.0;
                let limits = [
                    (-torque - lost).clamp(-torque, 0.0),
                    (torque - lost).clamp(0.0, torque),
                ];
                let within = torque_found.clamp(limits[0], limits[1]);
                prop_assert!((torque_found - within).abs() < 1e-9, "{torque_found} {limits:?}");
                let lag = wanted - joints.rate.0[leg];
                if lag.abs() > 1e-6 * (1.0 + wanted.abs()) {
                    let limit = if lag > 0.0 { limits[1] } else { limits[0] };
                    prop_assert!((torque_found - limit).abs() < 1e-9, "{lag} {torque_found}");
                }
            }
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]
    #[test]
    fn energy_balance_closes_in_drops(case in case(), is_driven in any::<bool>()) {
        let drives = if is_driven { fixtures::servo_drives(&robot()) } else { Drives::None };
        let servo = is_driven.then(|| servo(0.2));
        let (mut flow, _) = case.flows(Base::Free, drives, Some(fixtures::flat()), servo, 1e-9);
        flow.state.position.0[2] += 0.35;
        flow.ledger = Ledger::opened(flow.stored());
        for _ in 0..100 {
            flow.step(2e-3).unwrap();
        }
        let balance = flow.ledger.balance();
        prop_assert!(balance.residual.abs() < 1e-6 * balance.exchanged, "{balance:?}");
    }
}

#[test]
fn a_fixed_trunk_lets_its_legs_swing_like_pendulums() {
    let case = Case {
        position: [0.0; 3],
        attitude: [1.0, 0.0, 0.0, 0.0],
        velocity: [0.0; 3],
        turning: [0.0; 3],
        swing: [0.0; 4],
        angles: [0.1, -0.05, 0.2, 0.0],
        rates: [0.3, 0.0, -1.0, 2.0],
    };
    let (mut flow, _) = case.flows(Base::Fixed, Drives::None, None, None, 1e-9);
    let robot = robot();
    let motion = motion(&mut flow, &robot);
    let forces = motion.forces();
    for leg in JOINTS..COORDINATES {
        let expected = -2e-3 * motion.rates[leg];
        assert!(
            (forces[leg] - expected).abs() < 1e-6,
            "{leg}: {} {expected}",
            forces[leg]
        );
    }
    for _ in 0..100 {
        flow.step(2e-3).unwrap();
    }
    let balance = flow.ledger.balance();
    assert!(
        balance.residual.abs() < 1e-6 * balance.exchanged,
        "{balance:?}"
    );
}

#[test]
fn stops_turn_a_leg_back() {
    let case = Case {
        position: [0.0; 3],
        attitude: [1.0, 0.0, 0.0, 0.0],
        velocity: [0.0; 3],
        turning: [0.0; 3],
        swing: [0.0; 4],
        angles: [0.0; 4],
        rates: [20.0, 20.0, -20.0, -20.0],
    };
    let (mut flow, _) = case.flows(Base::Fixed, Drives::None, None, None, 1e-6);
    flow.log_events(true);
    let mut extremes = [0.0_f64; 4];
    // Before the legs are back at their other stops.
    for _ in 0..22 {
        flow.step(2e-3).unwrap();
        for (most, angle) in extremes.iter_mut().zip(flow.state.abduction[0].angle.0) {
            *most = if angle.abs() > most.abs() {
                angle
            } else {
                *most
            };
        }
    }
    // Left, right, left, right: outwards is to the left on the left.
    for (found, stop) in extremes.into_iter().zip([0.6, 0.3, -0.3, -0.6]) {
        let beyond = found.abs() - f64::abs(stop);
        assert!(
            found * stop > 0.0 && (0.0..0.05).contains(&beyond),
            "{found} {stop}"
        );
    }
    let mut events = Vec::new();
    flow.drain_events(&mut events);
    let names: Vec<_> = events.iter().map(|event| event.part.as_str()).collect();
    for leg in ["LF", "RF", "LH", "RH"] {
        assert!(
            names.contains(&format!("leg/{leg}/abduction").as_str()),
            "{names:?}"
        );
    }
}

#[test]
fn feet_move_at_their_velocities() {
    let case = Case {
        position: [0.1, 0.2, 0.5],
        attitude: [0.9, 0.1, -0.2, 0.3],
        velocity: [0.5, -0.2, 0.1],
        turning: [1.0, 2.0, -1.5],
        swing: [1.0; 4],
        angles: [0.2, -0.1, 0.25, 0.05],
        rates: [3.0, -2.0, 1.0, 4.0],
    };
    let (mut flow, _) = case.flows(Base::Free, Drives::None, None, None, f64::INFINITY);
    let before = flow.feet();
    let step = 1e-6;
    flow.step(step).unwrap();
    let after = flow.feet();
    for (a, b) in before.iter().zip(&after) {
        let mean = (a.velocity + b.velocity) * 0.5;
        assert!(((b.position - a.position) / step - mean).norm() < 1e-8);
    }
}

#[test]
fn bits_and_snapshots_do_not_depend_on_the_processor() {
    let case = Case {
        position: [0.0, 0.0, 0.16],
        attitude: [1.0, 0.05, 0.02, 0.0],
        velocity: [0.3, 0.1, -0.2],
        turning: [0.5, -0.3, 0.2],
        swing: [0.0; 4],
        angles: [0.1, -0.1, 0.05, 0.0],
        rates: [0.0; 4],
    };
    let drives = || fixtures::servo_drives(&robot());
    let build = || {
        case.flows(
            Base::Free,
            drives(),
            Some(fixtures::flat()),
            Some(servo(0.2)),
            1e-6,
        )
        .0
    };
    let mut flow = build();
    let mut other = Abducting::new(flow.equations.clone(), flow.state, 1e-6, Features::Portable);
    for _ in 0..20 {
        flow.step(2e-3).unwrap();
        other.step(2e-3).unwrap();
    }
    assert_eq!(
        (flow.state, flow.sums, flow.control),
        (other.state, other.sums, other.control)
    );
    let mut restored = build();
    restored.restore(flow.save()).unwrap();
    for plant in [&mut flow, &mut restored] {
        for _ in 0..20 {
            plant.step(1.7e-3).unwrap();
        }
    }
    assert_eq!((flow.state, flow.sums), (restored.state, restored.sums));
    assert_eq!(
        flow.abduction_torque(0).to_bits(),
        restored.abduction_torque(0).to_bits()
    );
    let (posture, extra) = (flow.posture(), flow.extra_state());
    let state = extra.iter().fold(
        twinrig_runtime::PlantState::at(twinrig_kernel::SimTime::ZERO),
        |state, (name, values)| state.with(name, values),
    );
    let (resumed, lines) = flow.equations.state_of(&posture, &state).unwrap();
    assert_eq!(
        (resumed.abduction[0].angle, lines.len()),
        (flow.state.abduction[0].angle, 0)
    );
}
