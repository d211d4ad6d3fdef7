//! Legs that abduct, against point masses and against locked joints.

use nalgebra::{Rotation3, Vector3};
use proptest::prelude::*;
use twinrig_compliant::lanes::{Features, Quad};
use twinrig_compliant::{AbductionConstants, Equations as _, ServoLaw};
use twinrig_contact::Ground;
use twinrig_legged::{Base, Drives, Dynamics as _, Ledger, Readings as _};
use twinrig_robot::{Abduction, GRAVITY, Robot, Servo};

use super::super::equations::{CompliantFlow, compliant_state};
use super::super::model::{AbductionModel, CompliantEquations, CompliantModel};
use super::super::state::Abduction as JointState;
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
fn servo(torque: f64) -> ServoLaw {
    let servo = Servo {
        torque,
        speed: 6.0,
        lag: 0.02,
        dead_band: 0.0,
        inertia: 1e-5,
    };
    (&twinrig_actuator::PositionServo::new(&servo).unwrap()).into()
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
        servo: Option<ServoLaw>,
        tolerance: f64,
    ) -> (Abducting, Locked) {
        let robot = robot();
        let pose = ([20.0, -40.0, 55.0], [-3.0, 5.0, 8.0]);
        let rigid = flow::<3>(&robot, base, pose, drives, ground);
        let joints = robot
            .legs
            .iter()
            .filter_map(AbductionConstants::new)
            .collect();
        let compliances = vec![compliance(); 4];
        let model = CompliantModel::new(
            rigid.model.clone(),
            &compliances,
            [AbductionModel { joints, servo }],
        );
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

/// Coordinates of the robot: trunk, links by leg, joints of abduction.
#[derive(Debug, Clone)]
struct Coordinates {
    position: Vector3<f64>,
    attitude: Rotation3<f64>,
    angles: [[f64; 3]; 4],
    abduction: [f64; 4],
}

/// Number of the coordinates, and index of the first joint of abduction.
const COORDINATES: usize = 22;
const JOINTS: usize = 18;

impl Coordinates {
    /// Returns the coordinates moved by a small vector, whose rotation is in trunk axes.
    fn moved(&self, by: &[f64; COORDINATES]) -> Self {
        let three = |from: usize| Vector3::new(by[from], by[from + 1], by[from + 2]);
        let mut next = self.clone();
        next.position += three(0);
        next.attitude *= Rotation3::new(three(3));
        for leg in 0..4 {
            for link in 0..3 {
                next.angles[leg][link] += by[6 + 3 * leg + link];
            }
            next.abduction[leg] += by[JOINTS + leg];
        }
        next
    }

    /// Places of point masses \[kg, m\]: rods of the legs by Simpson's rule, and the trunk as three
    /// pairs of points with its moments of inertia.
    fn points(&self, robot: &Robot) -> Vec<(f64, Vector3<f64>)> {
        let mut points = Vec::new();
        let [x, y, z] = robot.trunk.inertia;
        let seconds = [y + z - x, x + z - y, x + y - z].map(|sum| 0.5 * sum);
        let mass = robot.trunk.mass / 6.0;
        for (axis, second) in seconds.into_iter().enumerate() {
            let mut at = Vector3::zeros();
            at[axis] = libm::sqrt(second / (2.0 * mass));
            points.extend([at, -at].map(|at| (mass, at)));
        }
        for (i, mount) in robot.legs.iter().enumerate() {
            let (leg, joint) = (&mount.leg, mount.leg.abduction.unwrap());
            let side = if mount.hip[1] > 0.0 { 1.0 } else { -1.0 };
            let hip = Vector3::from(mount.hip);
            let axis = hip + Vector3::new(0.0, -side * joint.offset, joint.height);
            let turn = Rotation3::from_axis_angle(&Vector3::x_axis(), self.abduction[i]);
            let ahead = self.angles[i].map(|t| Vector3::new(libm::sin(t), 0.0, -libm::cos(t)));
            let mut put = |mass: f64, at: Vector3<f64>| {
                points.push((mass, axis + turn * (hip + at - axis)));
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
        let place = |(mass, at)| (mass, self.position + self.attitude * at);
        points.into_iter().map(place).collect()
    }
}

/// Coordinates, their rates and accelerations.
struct Motion {
    at: Coordinates,
    rates: [f64; COORDINATES],
    accelerations: [f64; COORDINATES],
}

impl Motion {
    fn new<const A: usize>(flow: &mut CompliantFlow<3, 1, A>) -> Self {
        flow.update_slope();
        let (state, slope) = (flow.state, flow.slope.unwrap().state);
        let attitude = Rotation3::from_matrix(&flow.rotation());
        let (velocity, turning) = (Vector3::from(state.velocity.three()), state.turning.three());
        let acceleration =
            Vector3::from(slope.velocity.three()) + Vector3::from(turning).cross(&velocity);
        let (mut rates, mut accelerations) = ([0.0; COORDINATES], [0.0; COORDINATES]);
        rates[..3].copy_from_slice((attitude * velocity).as_slice());
        accelerations[..3].copy_from_slice((attitude * acceleration).as_slice());
        rates[3..6].copy_from_slice(&turning);
        accelerations[3..6].copy_from_slice(&slope.turning.three());
        let mut at = Coordinates {
            position: Vector3::from(state.position.three()),
            attitude,
            angles: [[0.0; 3]; 4],
            abduction: [0.0; 4],
        };
        for leg in 0..4 {
            for link in 0..3 {
                at.angles[leg][link] = state.angles[link].0[leg];
                rates[6 + 3 * leg + link] = state.rates[link].0[leg];
                accelerations[6 + 3 * leg + link] = slope.rates[link].0[leg];
            }
            for (joint, slope) in state.abduction.iter().zip(&slope.abduction) {
                at.abduction[leg] = joint.angle.0[leg];
                rates[JOINTS + leg] = joint.rate.0[leg];
                accelerations[JOINTS + leg] = slope.rate.0[leg];
            }
        }
        Self {
            at,
            rates,
            accelerations,
        }
    }

    /// Generalised forces by d'Alembert's principle: Σ m (ẍ − g) ∂x/∂q.
    fn forces(&self, robot: &Robot) -> [f64; COORDINATES] {
        let after = |h: f64| {
            let by =
                std::array::from_fn(|i| h * self.rates[i] + 0.5 * h * h * self.accelerations[i]);
            self.at.moved(&by).points(robot)
        };
        let along = |i: usize, h: f64| {
            let mut by = [0.0; COORDINATES];
            by[i] = h;
            self.at.moved(&by).points(robot)
        };
        let h = 1e-4;
        let times = [-2.0, -1.0, 0.0, 1.0, 2.0].map(|steps| after(steps * h));
        std::array::from_fn(|i| {
            let (less, more) = (along(i, -h), along(i, h));
            let points = (0..times[2].len()).map(|p| {
                let [a, b, c, d, e] = times.each_ref().map(|points| points[p].1);
                let acceleration = ((b + d) * 16.0 - a - e - c * 30.0) / (12.0 * h * h);
                let force = (acceleration + Vector3::z() * GRAVITY) * times[2][p].0;
                force.dot(&((more[p].1 - less[p].1) / (2.0 * h)))
            });
            points.sum()
        })
    }

    /// Kinetic energy \[J\].
    fn kinetic(&self, robot: &Robot) -> f64 {
        let h = 1e-5;
        let after = |h: f64| {
            self.at
                .moved(&self.rates.map(|rate| h * rate))
                .points(robot)
        };
        let (before, after) = (after(-h), after(h));
        let points = before.iter().zip(&after);
        points
            .map(|((mass, a), (_, b))| 0.5 * mass * ((b - a) / (2.0 * h)).norm_squared())
            .sum()
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]
    #[test]
    fn accelerations_are_those_of_point_masses(case in case()) {
        let (mut flow, mut locked) = case.flows(Base::Free, Drives::None, None, None, 1e-6);
        let robot = robot();
        let (motion, plain) = (Motion::new(&mut flow), Motion::new(&mut locked));
        let (forces, internal) = (motion.forces(&robot), plain.forces(&robot));
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
        let expected = motion.kinetic(&robot);
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
        let law = servo(torque);
        for drives in [Drives::None, fixtures::servo_drives(&robot())] {
            let (mut flow, _) =
                case.flows(Base::Free, drives, Some(fixtures::flat()), Some(law), 1e-6);
            flow.update_slope();
            let joints = flow.slope.unwrap().state.abduction[0];
            for leg in 0..4 {
                let rate = case.rates[leg];
                // At its set-point, the cascade commands the rate to zero.
                let wanted = -rate * 4.0 / 0.02;
                let torque_found = joints.impulse.0[leg] + law.inertia() * joints.rate.0[leg];
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
    let motion = Motion::new(&mut flow);
    let forces = motion.forces(&robot());
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
        rates: [14.0, 14.0, -14.0, -14.0],
    };
    let (mut flow, _) = case.flows(Base::Fixed, Drives::None, None, None, 1e-6);
    flow.log_events(true);
    let mut extremes = [0.0_f64; 4];
    // Before the legs are back at their other stops.
    for _ in 0..30 {
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
