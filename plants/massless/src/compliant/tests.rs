mod abduction;

use nalgebra::{Matrix3, SMatrix, SVector, Vector3};
use proptest::prelude::*;
use twinrig_compliant::frame::rotation;
use twinrig_compliant::lanes::{Features, Quad};
use twinrig_compliant::{DriveLaws, Element, Equations, Flow};
use twinrig_legged::{Base, Drives, Ledger, Setup, StepInputs};
use twinrig_robot::leg::{Gradient, Planar};
use twinrig_robot::{GRAVITY, JointFriction, OneSided, PointMass, Robot};
use twinrig_testing::robots::{SERVO, SERVOS, pose, robot, robot_named, standing, with_legs};

use super::equations::{CompliantFlow, initial};
use super::state::{Slope, State};
use crate::model::Options;
use twinrig_compliant::stop::LEAST;

fn build(robot: &Robot, setup: Setup) -> CompliantFlow {
    initial(robot, &Options::compliant(setup, 1e-6), [], []).unwrap()
}

/// Legs between their stops with slack cables, on servos without limits.
fn between_stops(base: Base) -> CompliantFlow {
    loaded_between_stops(base, Vec::new())
}

fn loaded_between_stops(base: Base, payloads: Vec<PointMass>) -> CompliantFlow {
    let mut robot = with_legs(|leg| {
        leg.diagonal.preload = -0.004;
        leg.parallel.preload = -0.004;
        leg.parallel_travel = 0.014;
        leg.joint_friction = JointFriction {
            hip: 1e-3,
            knee: 2e-3,
            ankle: 3e-3,
            ..leg.joint_friction
        };
    });
    robot.trunk.payloads = payloads;
    let setup = Setup {
        base,
        ground: None,
        start: pose([10.0, -25.0, 37.0], [6.0, -4.0, 3.0]),
        ..standing(Drives::Ideal { period: 5e-3 }, 2000)
    };
    let mut flow = build(&robot, setup);
    flow.state.pulley = Quad(flow.state.pulley.0.map(|pulley| pulley - 1.0));
    flow
}

/// Moves trunk and feet in all directions, and bends each leg differently.
fn tumble(state: &mut State<Quad>, turning: [f64; 3]) {
    state.position = Quad::of_three([0.1, -0.2, 0.5]);
    state.attitude = Quad([0.9, 0.3, -0.2, 0.245]);
    state.velocity = Quad::of_three([1.0, 0.5, 2.0]);
    state.turning = Quad::of_three(turning);
    for lane in 0..4 {
        let shift = 0.02 * lane as f64;
        state.angles[0].0[lane] += shift;
        state.angles[1].0[lane] -= shift;
        state.foot[0].0[lane] = 0.3 - 0.1 * lane as f64;
        state.foot[1].0[lane] = 1.5 + 0.2 * lane as f64;
        state.hip_rate.0[lane] = 6.0 - lane as f64;
    }
}

fn slope(flow: &mut CompliantFlow) -> Slope<Quad> {
    flow.update_slope();
    flow.slope.unwrap()
}

/// A leg in closed form: pose, velocity and forces without elements.
struct ClosedLeg {
    place: Vector3<f64>,
    velocity: Vector3<f64>,
    /// Velocity relative to the trunk, and force on the foot, in the leg plane.
    relative: Vector3<f64>,
    force: Vector3<f64>,
    rates: [f64; 3],
    hip_load: f64,
}

fn closed_leg(flow: &CompliantFlow, i: usize) -> ClosedLeg {
    let (model, state) = (&flow.equations.model.rigid, &flow.state);
    let leg = &model.legs[i];
    let angles = flow.equations.angles(state, i);
    let pose = leg.pantograph.pose_of_angles(angles).unwrap();
    let place = leg.hip + Vector3::new(pose.foot.x, 0.0, pose.foot.y);
    let velocity = Vector3::from(state.velocity.three());
    let turning = Vector3::from(state.turning.three());
    let carried = velocity + turning.cross(&place);
    let (ahead, up) = (state.foot[0].0[i], state.foot[1].0[i]);
    let relative = Planar::new(ahead - carried.x, up - carried.z);
    let [first, second, third] = leg
        .pantograph
        .velocity(&pose, state.hip_rate.0[i], relative)
        .omega;
    let (knee, ankle) = (
        leg.friction.knee * (second - first),
        leg.friction.ankle * (third - second),
    );
    let torques = [knee - leg.friction.hip * first, ankle - knee, -ankle];
    let Gradient { hip, foot } = leg.pantograph.spring_gradient(&pose)
        + leg.pantograph.torque_gradient(&pose, torques) * -1.0;
    ClosedLeg {
        place,
        velocity: Vector3::new(ahead, carried.y, up),
        relative: Vector3::new(relative.x, 0.0, relative.y),
        force: Vector3::new(-foot.x, 0.0, -foot.y),
        rates: [first, second, third],
        hip_load: hip,
    }
}

/// Accelerations of the trunk and of the velocities of the feet, from the equations of all bodies
/// with the sideways forces of the legs as unknowns.
fn maximal_coordinates(flow: &CompliantFlow, legs: &[ClosedLeg]) -> SVector<f64, 22> {
    let (model, state) = (&flow.equations.model.rigid, &flow.state);
    let rows = rotation(state.attitude.0);
    let gravity = Vector3::from(rows[2]) * -GRAVITY;
    let velocity = Vector3::from(state.velocity.three());
    let turning = Vector3::from(state.turning.three());
    let (mut a, mut b) = (SMatrix::<f64, 22, 22>::zeros(), SVector::zeros());
    let inertia = model
        .tensor
        .unwrap_or_else(|| Matrix3::from_diagonal(&model.inertia));
    let mut force = (gravity - turning.cross(&velocity)) * model.mass;
    let mut torque = -turning.cross(&(inertia * turning));
    for i in 0..3 {
        a[(i, i)] = model.mass;
    }
    a.fixed_view_mut::<3, 3>(3, 3).copy_from(&inertia);
    for (k, leg) in legs.iter().enumerate() {
        let (foot, sideways, mass) = (6 + 3 * k, 18 + k, model.legs[k].mass);
        force -= leg.force;
        torque -= leg.place.cross(&leg.force);
        let lever = leg.place.cross(&Vector3::y());
        a[(1, sideways)] = 1.0;
        for i in 0..3 {
            a[(3 + i, sideways)] = lever[i];
            a[(foot + i, foot + i)] = mass;
            b[foot + i] = leg.force[i] + mass * gravity[i];
        }
        a[(foot + 1, sideways)] = -1.0;
        // The foot is accelerated sideways as the point of the trunk that it coincides with, and by
        // its motion relative to the trunk.
        a[(sideways, 1)] = 1.0;
        for i in 0..3 {
            a[(sideways, 3 + i)] = Vector3::ith(i, 1.0).cross(&leg.place).y;
        }
        a[(sideways, foot + 1)] = -1.0;
        let relative = turning.cross(&velocity)
            + turning.cross(&leg.relative) * 2.0
            + turning.cross(&turning.cross(&leg.place));
        b[sideways] = -relative.y;
    }
    for i in 0..3 {
        (b[i], b[3 + i]) = (force[i], torque[i]);
    }
    let mut solution = a.lu().solve(&b).unwrap();
    for (k, leg) in legs.iter().enumerate() {
        let turned = turning.cross(&leg.velocity);
        for i in 0..3 {
            solution[6 + 3 * k + i] -= turned[i];
        }
    }
    solution
}

#[track_caller]
fn assert_near(what: &str, a: f64, b: f64) {
    assert!((a - b).abs() < 1e-11 * (1.0 + a.abs()), "{what}: {a} {b}");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(32))]
    #[test]
    fn slope_is_that_of_all_bodies_with_constraint_forces(
        turning in proptest::array::uniform3(-5.0..5.0_f64),
        mass in prop_oneof![Just(0.0), 0.01..1.0],
        at in proptest::array::uniform3(-0.1..0.1),
    ) {
        let mut flow = loaded_between_stops(Base::Free, vec![PointMass { mass, at }]);
        tumble(&mut flow.state, turning);
        prop_assert!(flow.greatest_depth() == 0.0);
        flow.ledger = Ledger::opened(flow.stored());
        let legs: Vec<_> = (0..4).map(|leg| closed_leg(&flow, leg)).collect();
        let expected = maximal_coordinates(&flow, &legs);
        let found = slope(&mut flow);
        for i in 0..3 {
            assert_near("velocity", expected[i], found.state.velocity.0[i]);
            assert_near("turning", expected[3 + i], found.state.turning.0[i]);
        }
        for (k, leg) in legs.iter().enumerate() {
            for j in 0..3 {
                assert_near("rate", leg.rates[j], found.state.angles[j].0[k]);
            }
            assert_near("load", leg.hip_load, found.flows.hip.0[k]);
            assert_near("ahead", expected[6 + 3 * k], found.state.foot[0].0[k]);
            assert_near("up", expected[8 + 3 * k], found.state.foot[1].0[k]);
        }
    }
}

/// A hard start of legs between their stops, and on them, with the trunk in motion.
fn landing(robot: &Robot, drives: Drives, base: Base) -> CompliantFlow {
    let setup = Setup {
        base,
        start: pose([20.0, -40.0, 55.0], [-6.0, 4.0, 8.0]),
        ..standing(drives, 2000)
    };
    let mut flow = build(robot, setup);
    if base != Base::Fixed {
        flow.state.velocity = Quad::of_three([0.4, 0.0, -0.3]);
        flow.state.turning = Quad::of_three([0.0, -0.3, 0.0]);
    }
    if base == Base::Free {
        flow.state.velocity.0[1] = 0.1;
        flow.state.turning = Quad::of_three([0.5, -0.3, 0.2]);
    }
    flow.ledger = Ledger::opened(flow.stored());
    flow
}

/// Returns the flow with another tolerance.
fn with_tolerance(flow: &CompliantFlow, tolerance: f64, features: Features) -> CompliantFlow {
    Flow::new(flow.equations.clone(), flow.state, tolerance, features)
}

/// Runs for `steps` steps of 2 ms and returns the residual of the energy balance, as a share of the
/// energy that was exchanged.
fn residual(flow: &mut CompliantFlow, steps: usize) -> f64 {
    for _ in 0..steps {
        flow.step(2e-3).unwrap();
    }
    let balance = flow.ledger.balance();
    assert!(balance.dissipated > 0.0);
    (balance.residual / balance.exchanged).abs()
}

#[test]
fn bits_do_not_depend_on_the_processor() {
    let run = |features| {
        let flow = landing(&robot(), SERVOS, Base::Free);
        let mut flow = with_tolerance(&flow, 1e-6, features);
        residual(&mut flow, 100);
        (flow.state, flow.sums, flow.control)
    };
    assert_eq!(run(Features::Detected), run(Features::Portable));
}

#[test]
fn energy_balance_closes_with_the_tolerance() {
    for base in [Base::Free, Base::Planar, Base::Fixed] {
        let flow = landing(&robot(), SERVOS, base);
        let run = |tolerance| {
            let mut flow = with_tolerance(&flow, tolerance, Features::Detected);
            residual(&mut flow, 150)
        };
        let (coarse, fine) = (run(1e-6), run(1e-9));
        assert!(coarse < 1e-3, "{base:?} {coarse:e}");
        assert!(fine < 1e-6, "{base:?} {fine:e}");
    }
}

#[test]
fn saturated_hips_obey_the_torque_line() {
    let weak = twinrig_robot::Servo {
        torque: 0.6,
        ..SERVO
    };
    let drives = Drives::Servos {
        hip: weak,
        knee: SERVO,
    };
    let flow = landing(&robot(), drives, Base::Free);
    let mut flow = with_tolerance(&flow, 1e-9, Features::Detected);
    let mut start = [0.0; 8];
    twinrig_legged::Dynamics::initial_inputs(&flow, &mut start);
    start[0] += 0.5;
    flow.set_inputs(&StepInputs {
        start: &start,
        rates: &[0.0; 8],
        mean: &start,
    });
    let DriveLaws::Servos { hip: law, .. } = *flow.equations.laws() else {
        panic!("servos");
    };
    let (mut saturated, mut following) = (0, 0);
    for _ in 0..100 {
        flow.step(2e-3).unwrap();
        let found = slope(&mut flow);
        let torque = found.state.hip_rate.0[0] * law.inertia() + found.flows.hip.0[0];
        let most = weak.torque * (1.0 - flow.state.hip_rate.0[0] / weak.speed).clamp(0.0, 1.0);
        assert!(torque <= most + 1e-12, "{torque} {most}");
        if (torque - most).abs() < 1e-12 {
            saturated += 1;
        } else {
            following += 1;
        }
    }
    assert!(saturated > 10 && following > 10, "{saturated} {following}");
    let balance = flow.ledger.balance();
    assert!(
        balance.residual.abs() < 1e-6 * balance.exchanged,
        "{balance:?}"
    );
}

#[test]
fn motors_keep_the_energy_balance() {
    let mut oncilla = robot_named("oncilla");
    for mount in &mut oncilla.legs {
        mount.leg.compliance = robot().legs[0].leg.compliance;
    }
    let motors = oncilla.motors.unwrap();
    let drives = Drives::Motors {
        hip: motors.hip,
        knee: motors.knee,
    };
    let setup = Setup {
        base: Base::Free,
        ..standing(drives, 2000)
    };
    let flow = build(&oncilla, setup);
    let mut flow = with_tolerance(&flow, 1e-9, Features::Detected);
    let inputs = [12.0, 1.0, 6.0, 1.0].repeat(4);
    flow.set_inputs(&StepInputs {
        start: &inputs,
        rates: &[0.0; 16],
        mean: &inputs,
    });
    let before = flow.state.angles[0].0[0];
    assert!(
        residual(&mut flow, 50) < 1e-6,
        "{:?}",
        flow.ledger.balance()
    );
    assert!((flow.state.angles[0].0[0] - before).abs() > 0.01);
}

#[test]
fn posture_and_state_are_equivalent() {
    let mut flow = between_stops(Base::Free);
    tumble(&mut flow.state, [3.0, -2.0, 5.0]);
    let posture = flow.equations.posture(&flow.state);
    let empty = posture.state(twinrig_kernel::SimTime::ZERO);
    let (state, lines) = flow.equations.state_of(&posture, &empty).unwrap();
    assert!(lines.is_empty());
    let (mut found, mut expected) = (Vec::new(), Vec::new());
    let (mut state, mut before) = (state, flow.state);
    before.attitude = Quad(posture.attitude);
    flow.equations
        .visit(&mut state, &mut |quad| found.extend(quad.0));
    flow.equations
        .visit(&mut before, &mut |quad| expected.extend(quad.0));
    for (a, b) in found.iter().zip(&expected) {
        assert!((a - b).abs() < 1e-12, "{a} {b}");
    }
}

#[test]
fn stop_pushes_second_and_third_link_out_of_line() {
    let mut flow = between_stops(Base::Fixed);
    let within = 0.8 * LEAST;
    let ankle = std::f64::consts::PI - libm::asin(within);
    flow.state.angles[2] = Quad(flow.state.angles[1].0.map(|second| second + ankle));
    flow.state.hip_rate = Quad::splat(0.0);
    flow.state.foot = [Quad::splat(0.0); 2];
    // Soft, as other stops are far beyond their limit in this pose.
    let soft = OneSided {
        stiffness: 1e3,
        damping: 1.0,
        toe_region: 1e-3,
    };
    flow.equations.model.legs.pantographs.stops = Element::side_by_side([soft; 4]);
    let mut flow = with_tolerance(&flow, 1e-8, Features::Detected);
    for _ in 0..20 {
        flow.step(1e-4).unwrap();
    }
    let balance = flow.ledger.balance();
    assert!(
        balance.residual.abs() < 1e-7 * balance.exchanged,
        "{balance:?}"
    );
    let [_, second, third] = flow.state.angles.map(|quad| quad.0[0]);
    assert!(libm::sin(third - second) > within, "{}", third - second);
}
