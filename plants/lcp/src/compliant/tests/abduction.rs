//! Legs that abduct, against point masses and against locked joints.

use nalgebra::{Rotation3, UnitQuaternion, Vector3};
use proptest::prelude::*;
use serde_json::{Value, json};
use twinrig_compliant::lanes::{Features, Quad};
use twinrig_compliant::{AbductionJoints, Equations as _, JointState};
use twinrig_contact::Ground;
use twinrig_kernel::{SimDuration, SimTime};
use twinrig_legged::{Abduction, Base, Constraints, Drives, Dynamics as _, Readings as _, Setup};
use twinrig_robot::leg::{Joints, Pantograph};
use twinrig_robot::{Robot, Servo};
use twinrig_runtime::{Plant as _, PlantState};
use twinrig_testing::abduction::{
    JOINT, Tumble, assert_closed, assert_forces, assert_locked, pushes, servo,
};
use twinrig_testing::point_masses::{self, Point, PointMotion};
use twinrig_testing::python;
use twinrig_testing::robots::LEGS;

use super::super::equations::{CompliantFlow, compliant_state};
use super::super::model::{CompliantEquations, CompliantModel};
use super::super::state::State;
use super::compliance;
use crate::fixtures::{self, flow, without_toes};
use crate::{Lcp, Method, Options};

/// A robot whose legs abduct, about axes beside and above the hips.
fn robot() -> Robot {
    let mut robot = without_toes();
    for mount in &mut robot.legs {
        mount.leg.abduction = Some(JOINT);
        mount.leg.compliance = Some(compliance());
    }
    robot
}

type Locked = CompliantFlow<3, 1, 0, 0>;
type Abducting = CompliantFlow<3, 1, 1, 0>;

/// Setup of a robot, and its motion.
#[derive(Clone)]
struct Case {
    base: Base,
    drives: Drives,
    ground: Option<Ground>,
    servo: Option<Servo>,
    tolerance: f64,
    /// Height of the trunk \[m\].
    height: f64,
    motion: Tumble,
}

/// Without drives, in flight.
const FLYING: Case = Case {
    base: Base::Free,
    drives: Drives::None,
    ground: None,
    servo: None,
    tolerance: 1e-6,
    height: 0.5,
    motion: Tumble::AT_REST,
};

impl Case {
    /// Builds the robot with joints of abduction, and the same with locked ones.
    fn flows(&self) -> (Abducting, Locked) {
        let (robot, motion) = (robot(), &self.motion);
        let pose = ([20.0, -40.0, 55.0], [-3.0, 5.0, 8.0]);
        let (drives, ground) = (self.drives.clone(), self.ground.clone());
        let setup = fixtures::setup(&robot, self.base, pose, drives.clone(), ground.clone());
        let rigid = flow::<3>(&robot, self.base, pose, drives, ground);
        let abduction = self.servo.map_or(Abduction::Passive, Abduction::Servos);
        let joints = AbductionJoints::new(&robot, &Setup { abduction, ..setup }).unwrap();
        let mut locked = compliant_state::<3, 1, 0, 0>(&rigid.run.state);
        locked.position = Quad([0.1, -0.2, self.height, 0.0]);
        locked.attitude = Quad(motion.attitude);
        locked.velocity = Quad::of_three(motion.velocity);
        locked.turning = Quad::of_three(motion.turning);
        for (rate, by) in locked.rates[1].0.iter_mut().zip(motion.within) {
            *rate += 4.0 * by;
        }
        let free = State {
            position: locked.position,
            attitude: locked.attitude,
            velocity: locked.velocity,
            turning: locked.turning,
            angles: locked.angles,
            rates: locked.rates,
            pulley: locked.pulley,
            pulley_rate: locked.pulley_rate,
            bristles: locked.bristles,
            abduction: [JointState {
                angle: Quad(motion.angles),
                rate: Quad(motion.rates),
                ..JointState::AT_REST
            }],
            body: [],
        };
        let compliances = vec![compliance(); 4];
        let model = CompliantModel::new(rigid.model.clone(), &compliances, [joints], &[]);
        let of_locked = CompliantModel::new(rigid.model, &compliances, [], &[]);
        let (tolerance, features) = (self.tolerance, Features::Detected);
        (
            Abducting::new(CompliantEquations::new(model), free, tolerance, features),
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
    flow: &mut CompliantFlow<3, 1, A, 0>,
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

#[test]
fn accelerations_are_those_of_point_masses() {
    for seed in 0..64 {
        let case = Case {
            motion: Tumble::drawn(seed),
            ..FLYING
        };
        let ((mut flow, mut locked), robot) = (case.flows(), robot());
        let motion = motion(&mut flow, &robot);
        let internal = self::motion(&mut locked, &robot).forces();
        // In flight nothing acts on the trunk, friction on the joints, and inside the legs that
        // which acts with locked joints.
        assert_forces(&motion.forces(), |i| match i {
            0..6 => 0.0,
            6..JOINTS => internal[i],
            _ => -JOINT.friction * motion.rates[i],
        });
        let ([kinetic, ..], expected) = (flow.stored(), motion.kinetic());
        assert!(
            (kinetic - expected).abs() < 1e-7 * expected,
            "{kinetic} {expected}"
        );
    }
}

/// Angle, rate and acceleration of the joints of a robot's description, and those of the trunk.
fn described<const A: usize>(flow: &mut CompliantFlow<3, 1, A, 0>, robot: &Robot) -> Value {
    flow.update_slope();
    let (state, slope) = (flow.state, flow.slope.unwrap().state);
    let attitude = UnitQuaternion::from_matrix(&flow.rotation());
    let mut joints = serde_json::Map::new();
    for (i, mount) in robot.legs.iter().enumerate() {
        let stretched = Joints { q2: 0.0, q3: 0.0 };
        let reference = Pantograph::new(&mount.leg).unwrap().angles(0.0, stretched);
        let mut above = [0.0; 3];
        for (link, name) in ["hip", "knee", "ankle"].into_iter().enumerate() {
            let angle = state.angles[link].0[i] - reference[link];
            let own = [angle, state.rates[link].0[i], slope.rates[link].0[i]];
            let relative = [0, 1, 2].map(|n| own[n] - above[n]);
            joints.insert(format!("{}_{name}", mount.name), json!(relative));
            above = own;
        }
        for (joint, slope) in state.abduction.iter().zip(&slope.abduction) {
            let own = [joint.angle.0[i], joint.rate.0[i], slope.rate.0[i]];
            joints.insert(format!("{}_abduction", mount.name), json!(own));
        }
    }
    let velocity = [state.velocity.three(), state.turning.three()].concat();
    let acceleration = [slope.velocity.three(), slope.turning.three()].concat();
    json!({
        "attitude": attitude.coords.as_slice(),
        "velocity": velocity,
        "acceleration": acceleration,
        "joints": joints,
    })
}

/// By the inverse dynamics of Pinocchio, nothing acts on a trunk in flight, friction on the joints
/// of abduction, and inside the legs that which acts with locked joints.
#[test]
fn accelerations_are_those_of_pinocchio() {
    let Some(python) = python::python_of_peers("pinocchio") else {
        return;
    };
    let script = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/tests/reference/inverse_dynamics.py"
    );
    let robot = robot();
    let (mut free, mut locked) = (Vec::new(), Vec::new());
    for seed in 0..200 {
        let motion = Tumble::drawn(seed);
        let (mut flow, mut of_locked) = Case { motion, ..FLYING }.flows();
        free.push(described(&mut flow, &robot));
        locked.push(described(&mut of_locked, &robot));
    }
    let forces = |robot: &Robot, states: &[Value]| {
        let urdf = twinrig_description::urdf(robot).unwrap();
        let request = json!({ "urdf": urdf, "states": states });
        python::run(&python, script.as_ref(), &[], &request)
    };
    let (found, internal) = (forces(&robot, &free), forces(&without_toes(), &locked));
    let (found, internal) = (found.as_array().unwrap(), internal.as_array().unwrap());
    assert_eq!((found.len(), internal.len()), (200, 200));
    for ((state, found), internal) in free.iter().zip(found).zip(internal) {
        let torque = |of: &Value, name: &str| of["joints"][name].as_f64().unwrap();
        // The weight, and its moment at 1 m. Rods have 1e-14 kg·m² about their axis in the
        // description.
        let scale = robot.mass() * 9.81;
        let close = |what: &str, found: f64, expected: f64| {
            let error = (found - expected).abs() / scale;
            assert!(error < 1e-10, "{what}: {found} {expected}");
        };
        for force in found["trunk"].as_array().unwrap() {
            close("trunk", force.as_f64().unwrap(), 0.0);
        }
        for leg in LEGS {
            for joint in ["hip", "knee", "ankle"] {
                let name = format!("{leg}_{joint}");
                close(&name, torque(found, &name), torque(internal, &name));
            }
            let name = format!("{leg}_abduction");
            let rate = state["joints"][&name][1].as_f64().unwrap();
            close(&name, torque(found, &name), -JOINT.friction * rate);
        }
    }
}

#[test]
fn joints_at_rest_at_zero_are_locked() {
    let servos = || fixtures::servo_drives(&robot());
    for seed in 0..64 {
        for (base, drives) in [
            (Base::Free, Drives::None),
            (Base::Free, servos()),
            (Base::Planar, servos()),
        ] {
            let case = Case {
                base,
                drives,
                ground: Some(fixtures::flat()),
                // Without limit it holds its position.
                servo: Some(servo(f64::MAX)),
                motion: Tumble::drawn(seed).upright(),
                ..FLYING
            };
            let (mut flow, mut locked) = case.flows();
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

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]
    #[test]
    fn servos_follow_their_command_or_are_at_the_limit_of_their_torque(
        seed in any::<u64>(), torque in 0.001..0.3_f64,
    ) {
        let servo = servo(torque);
        for drives in [Drives::None, fixtures::servo_drives(&robot())] {
            let motion = Tumble::drawn(seed);
            let ground = Some(fixtures::flat());
            let case = Case { drives, ground, servo: Some(servo), height: 0.1, motion, ..FLYING };
            let (mut flow, _) = case.flows();
            flow.update_slope();
            let joints = flow.slope.unwrap().state.abduction[0];
            for leg in 0..4 {
                let rate = motion.rates[leg];
                // At its set-point, the cascade commands the rate to zero.
                let wanted = -rate * 4.0 / 0.02;
                let found = joints.impulse.0[leg] + servo.inertia * joints.rate.0[leg];
                let lost = rate * torque / 6.0;
                let limits = [
                    (-torque - lost).clamp(-torque, 0.0),
                    (torque - lost).clamp(0.0, torque),
                ];
                let within = found.clamp(limits[0], limits[1]);
                prop_assert!((found - within).abs() < 1e-9, "{found} {limits:?}");
                let lag = wanted - joints.rate.0[leg];
                if lag.abs() > 1e-6 * (1.0 + wanted.abs()) {
                    let limit = if lag > 0.0 { limits[1] } else { limits[0] };
                    prop_assert!((found - limit).abs() < 1e-9, "{lag} {found}");
                }
            }
        }
    }
}

#[test]
fn energy_balance_closes_in_drops_under_pushes() {
    for seed in 0..24 {
        let is_driven = seed % 2 == 0;
        let case = Case {
            drives: if is_driven {
                fixtures::servo_drives(&robot())
            } else {
                Drives::None
            },
            ground: Some(fixtures::flat()),
            servo: is_driven.then(|| servo(0.2)),
            tolerance: 1e-9,
            height: 0.3,
            motion: Tumble::drawn(seed),
            ..FLYING
        };
        let ((mut flow, _), mut pushes) = (case.flows(), pushes());
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
fn a_fixed_trunk_lets_its_legs_swing_like_pendulums() {
    let motion_of = Tumble {
        angles: [0.1, -0.05, 0.2, 0.0],
        rates: [0.3, 0.0, -1.0, 2.0],
        ..Tumble::AT_REST
    };
    let case = Case {
        base: Base::Fixed,
        tolerance: 1e-9,
        motion: motion_of,
        ..FLYING
    };
    let ((mut flow, _), robot) = (case.flows(), robot());
    let motion = motion(&mut flow, &robot);
    let forces = motion.forces();
    assert_forces(&forces[JOINTS..], |i| {
        -JOINT.friction * motion.rates[JOINTS + i]
    });
    for _ in 0..100 {
        flow.step(2e-3).unwrap();
    }
    let balance = flow.ledger.balance();
    assert_closed(&balance, 1e-6);
}

#[test]
fn stops_turn_a_leg_back() {
    let case = Case {
        base: Base::Fixed,
        motion: Tumble {
            rates: [20.0, 20.0, -20.0, -20.0],
            ..Tumble::AT_REST
        },
        ..FLYING
    };
    let (mut flow, _) = case.flows();
    flow.log_events(true);
    let mut extremes = [0.0_f64; 4];
    // Before the legs are back at their other stops.
    for _ in 0..22 {
        flow.step(2e-3).unwrap();
        for (most, angle) in extremes.iter_mut().zip(flow.state.abduction[0].angle.0) {
            if angle.abs() > most.abs() {
                *most = angle;
            }
        }
    }
    // Left, right, left, right: outwards is to the left on the left.
    let [out, inward] = [JOINT.abduction_max, JOINT.adduction_max];
    for (found, stop) in extremes.into_iter().zip([out, inward, -inward, -out]) {
        let beyond = found.abs() - f64::abs(stop);
        assert!(
            found * stop > 0.0 && (0.0..0.05).contains(&beyond),
            "{found} {stop}"
        );
    }
    let mut events = Vec::new();
    flow.drain_events(&mut events);
    for leg in LEGS {
        let name = format!("leg/{leg}/abduction");
        assert!(
            events.iter().any(|event| event.part == name),
            "{name}: {events:?}"
        );
    }
}

#[test]
fn feet_move_at_their_velocities() {
    let case = Case {
        tolerance: f64::INFINITY,
        motion: Tumble::drawn(1),
        ..FLYING
    };
    let (mut flow, _) = case.flows();
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
fn absent_legs_have_no_joints() {
    // Their joints would divide by an inertia of zero.
    let mut robot = robot();
    robot.legs.truncate(2);
    let pose = ([20.0, -40.0, 55.0], [0.0; 3]);
    let setup = fixtures::setup(&robot, Base::Free, pose, Drives::None, None);
    let setup = Setup {
        abduction: Abduction::Passive,
        ..setup
    };
    let options = Options {
        setup,
        constraints: Constraints::Compliant,
        method: Method::Rk4,
        tolerance: 1e-6,
        toe: false,
        features: Features::Detected,
    };
    let mut plant = Lcp::new(&robot, &options, &|_| true).unwrap();
    let end = SimTime::ZERO + SimDuration::from_millis(50);
    plant.advance(end, &[]).unwrap();
    let balance = plant.energy();
    assert_closed(&balance, 1e-4);
}

#[test]
fn bits_and_snapshots_do_not_depend_on_the_processor() {
    let case = Case {
        drives: fixtures::servo_drives(&robot()),
        ground: Some(fixtures::flat()),
        servo: Some(servo(0.2)),
        height: 0.16,
        motion: Tumble {
            velocity: [0.3, 0.1, -0.2],
            turning: [0.5, -0.3, 0.2],
            angles: [0.1, -0.1, 0.05, 0.0],
            ..Tumble::AT_REST
        },
        ..FLYING
    };
    let mut flow = case.flows().0;
    let mut other = Abducting::new(flow.equations.clone(), flow.state, 1e-6, Features::Portable);
    for _ in 0..20 {
        flow.step(2e-3).unwrap();
        other.step(2e-3).unwrap();
    }
    assert_eq!(
        (flow.state, flow.sums, flow.control),
        (other.state, other.sums, other.control)
    );
    let mut restored = case.flows().0;
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
    let state = extra
        .iter()
        .fold(PlantState::at(SimTime::ZERO), |state, (name, values)| {
            state.with(name, values)
        });
    let (resumed, lines) = flow.equations.state_of(&posture, &state).unwrap();
    assert_eq!(
        (resumed.abduction[0].angle, lines.len()),
        (flow.state.abduction[0].angle, 0)
    );
}
