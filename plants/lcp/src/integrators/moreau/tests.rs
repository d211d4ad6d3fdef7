//! Properties of the midpoint rule: second order for smooth motion, momentum to round-off, energy
//! without drift, overlaps that decay as documented.

use twinrig_contact::{Ground, Terrain};
use twinrig_legged::{Base, Drives, Ledger};
use twinrig_robot::{GRAVITY, Robot, RobotFile};

use super::LastImpulses;
use super::drift::Momentum;
use super::impulses::RECOVERY;
use super::momentum::Geometry;
use crate::constraints::events::SLOTS;
use crate::constraints::motion::Motion;
use crate::fixtures::{self, HARD, PASSIVE, between_stops, distance, flow, motion, tumbling};
use crate::model::real::{Lanes, Real};
use crate::model::state::State;
use crate::options::Method;
use crate::plant::flow::Flow;

/// Returns the same robot with another method, with a tolerance of 1e-12 m where it has one.
fn with_method<const N: usize>(start: &Flow<N>, method: Method) -> Flow<N> {
    let mut flow = Flow::new(start.model.clone(), start.run.state, method, 1e-12);
    flow.run.mode.commands = start.run.mode.commands;
    flow.run.mode.active.hip = start.run.mode.active.hip;
    flow.run.mode.update_any();
    flow
}

fn run<const N: usize>(flow: &mut Flow<N>, seconds: f64, steps: u32) {
    for _ in 0..steps {
        flow.step(seconds / f64::from(steps)).unwrap();
    }
}

/// Swings each leg at its own rates, with slack cables.
fn set_unequal_rates<const N: usize>(flow: &mut Flow<N>) {
    let rates = [
        [1.0, 0.3, -0.5, 0.8],
        [0.2, 1.0, 0.6, -0.4],
        [-0.3, 0.5, 1.0, 0.1],
        [0.5; 4],
    ];
    for (rate, more) in flow.run.state.rates.iter_mut().zip(rates) {
        *rate += Lanes::new(more) * Lanes::splat(3.0);
    }
    flow.run.state.pulley -= Lanes::splat(0.4);
    let stored = flow.stored();
    flow.run.ledger = Ledger::opened(stored);
}

/// Returns the robot of [`between_stops`], with the toes of its file for legs with four links, and
/// with this joint friction.
fn undamped<const N: usize>(friction: f64) -> Robot {
    let (mut robot, _) = between_stops();
    for (mount, file) in robot.legs.iter_mut().zip(fixtures::robot().legs) {
        let leg = &mut mount.leg;
        leg.toe = file.leg.toe.filter(|_| N > 3);
        leg.parallel_travel = 0.02;
        let joints = &mut leg.joint_friction;
        for joint in [&mut joints.hip, &mut joints.knee, &mut joints.ankle] {
            *joint = friction;
        }
    }
    robot
}

/// Returns a robot whose legs swing between their stops.
fn swinging<const N: usize>(robot: &Robot, base: Base, drives: Drives) -> Flow<N> {
    let mut flow = flow::<N>(robot, base, between_stops().1, drives, None);
    set_unequal_rates(&mut flow);
    flow
}

/// Returns the same robot with a tumbling trunk.
fn thrown<const N: usize>(robot: &Robot) -> Flow<N> {
    let mut flow = swinging(robot, Base::Free, Drives::None);
    tumbling(&mut flow);
    flow
}

/// Returns named robots with smooth motion for a while.
fn smooth<const N: usize>() -> Vec<(&'static str, Flow<N>)> {
    let robot = undamped::<N>(0.0);
    let servos = fixtures::servo_drives(&robot);
    let mut driven = swinging(&robot, Base::Free, Drives::Ideal { period: 0.03 });
    driven.run.mode.commands.hip += Lanes::new([0.1, -0.1, 0.05, 0.0]);
    driven.run.mode.commands.pulley -= Lanes::splat(0.5);
    // Servos that stay saturated, on their torque–speed line.
    let mut saturated = swinging(&robot, Base::Free, weak(servos));
    saturated.run.mode.commands.hip += Lanes::splat(50.0);
    saturated.run.mode.commands.hip_saturated = Lanes::splat(1.0);
    saturated.run.mode.active.hip = Lanes::zero();
    saturated.run.mode.commands.pulley -= Lanes::splat(0.5);
    vec![
        ("fixed", swinging(&robot, Base::Fixed, Drives::None)),
        ("planar", swinging(&robot, Base::Planar, Drives::None)),
        ("thrown", thrown(&robot)),
        ("damped", thrown(&undamped::<N>(2e-3))),
        ("driven", driven),
        ("saturated", saturated),
        ("motors", motorised(Base::Free, &robot)),
    ]
}

/// Returns the same drives with weak and fast hips.
fn weak(drives: Drives) -> Drives {
    let Drives::Servos { mut hip, knee } = drives else {
        return drives;
    };
    (hip.torque, hip.speed) = (0.02, 40.0);
    Drives::Servos { hip, knee }
}

/// Returns a robot with the motors of another robot file, each at its own voltage.
fn motorised<const N: usize>(base: Base, robot: &Robot) -> Flow<N> {
    let text = include_str!("../../../../../robots/oncilla.toml");
    let file = RobotFile::parse("oncilla.toml", text).unwrap();
    let motors = file.robot().unwrap().motors.unwrap();
    let (hip, knee) = (motors.hip, motors.knee);
    let mut flow = swinging(robot, base, Drives::Motors { hip, knee });
    let commands = &mut flow.run.mode.commands;
    commands.hip = Lanes::new([0.05, -0.05, 0.02, 0.0]);
    commands.hip_damping = Lanes::splat(5e-3);
    commands.pulley = Lanes::splat(-0.01);
    commands.pulley_damping = Lanes::splat(2e-3);
    flow
}

fn error_is_of_second_order<const N: usize>() {
    let seconds = 0.128;
    for (name, start) in smooth::<N>() {
        let mut reference = with_method(&start, Method::Rodas4);
        run(&mut reference, seconds, 64);
        let [coarse, fine] = [128, 256].map(|steps| {
            let mut flow = with_method(&start, Method::Moreau);
            run(&mut flow, seconds, steps);
            assert_eq!(
                (flow.run.counts.events, flow.run.counts.fallbacks),
                (0, 0),
                "{name}"
            );
            distance(&flow.run.state, &reference.run.state)
        });
        let order = libm::log2(coarse / fine);
        assert!(
            (1.9..2.5).contains(&order),
            "{name}: {order}, {coarse:e}, {fine:e}"
        );
    }
}

#[test]
fn error_is_of_second_order_with_point_feet() {
    error_is_of_second_order::<3>();
}

#[test]
fn error_is_of_second_order_with_toes() {
    error_is_of_second_order::<4>();
}

/// Returns the momentum of a robot with a moving trunk.
fn momentum<const N: usize>(flow: &Flow<N>) -> Momentum {
    let state = &flow.run.state;
    let geometry = Geometry::at(&flow.model, &state.angles);
    let legs = &flow.model.side_by_side;
    let found = geometry.momenta(legs, &state.rates, state.turning);
    let body = geometry.body.unwrap();
    Momentum::of(&flow.model, state, &body, found.relative, found.spin)
}

#[test]
fn flight_momentum_is_conserved_to_round_off() {
    let hard = {
        let mut flow = flow::<3>(
            &fixtures::without_toes(),
            Base::Free,
            HARD,
            Drives::None,
            None,
        );
        tumbling(&mut flow);
        flow
    };
    for (name, start) in [("smooth", thrown(&undamped::<3>(0.0))), ("hard", hard)] {
        let mut flow = with_method(&start, Method::Moreau);
        let before = momentum(&flow);
        let size = |v: [f64; 3]| libm::sqrt(v.iter().map(|x| x * x).sum());
        for step in 1..=500 {
            flow.step(2e-3).unwrap();
            let (seconds, now) = (2e-3 * f64::from(step), momentum(&flow));
            let fall = [0.0, 0.0, -0.5 * GRAVITY * seconds * seconds];
            let off = std::array::from_fn(|i| {
                now.position[i] - before.position[i] - seconds * before.velocity[i] - fall[i]
            });
            let turned = std::array::from_fn(|i| now.spin[i] - before.spin[i]);
            assert!(size(off) < 1e-12, "{name}: {off:?} m off at {seconds} s");
            assert!(
                size(turned) < 1e-12 * size(before.spin),
                "{name}: {turned:?}"
            );
        }
        assert_eq!(flow.run.counts.events > 0, name == "hard");
    }
}

#[test]
fn ground_impulses_equal_the_momentum_change() {
    let robot = fixtures::without_toes();
    let ground = Some(fixtures::flat());
    let servos = fixtures::servo_drives(&robot);
    let mut start = flow::<3>(&robot, Base::Free, PASSIVE, servos, ground);
    start.run.state.position[2] = 0.2;
    start.run.state.turning = [1.0, -2.0, 0.5];
    let mut flow = with_method(&start, Method::Moreau);
    let mass = flow.model.trunk.mass;
    let mut greatest = 0.0_f64;
    for _ in 0..300 {
        let (before, sums_before) = (momentum(&flow), flow.run.impulse_sums.ground);
        flow.step(2e-3).unwrap();
        let after = momentum(&flow);
        for i in 0..3 {
            let legs = flow.run.impulse_sums.ground.iter().zip(&sums_before);
            let impulse: f64 = legs.map(|(now, before)| now[i] - before[i]).sum();
            let weight = if i == 2 { mass * GRAVITY * 2e-3 } else { 0.0 };
            let gained = mass * (after.velocity[i] - before.velocity[i]) + weight;
            assert!((gained - impulse).abs() < 1e-12, "{gained} of {impulse}");
            greatest = greatest.max(impulse);
        }
    }
    assert!(greatest > 0.1, "{greatest}");
}

/// Feet land with lateral velocity, slide, and are reversed by their legs.
#[test]
fn friction_work_never_decreases() {
    let robot = fixtures::without_toes();
    for sideways in [-1.5, -0.5, 0.5, 1.5] {
        let servos = fixtures::servo_drives(&robot);
        let mut start = flow::<3>(&robot, Base::Free, PASSIVE, servos, Some(fixtures::flat()));
        start.run.state.position[2] = 0.2;
        start.run.state.velocity = [sideways, 0.3, 0.0];
        start.run.state.turning = [1.0, -2.0, 0.5];
        let mut flow = with_method(&start, Method::Moreau);
        let mut dissipated = 0.0;
        for step in 0..300 {
            flow.step(2e-3).unwrap();
            let now = flow.run.ledger.balance().dissipated;
            assert!(
                now >= dissipated,
                "{sideways}: {:e} J in step {step}",
                now - dissipated
            );
            dissipated = now;
        }
        assert!(dissipated > 1e-3, "{sideways}: {dissipated}");
    }
}

#[test]
fn energy_does_not_drift_in_twenty_seconds() {
    let robot = undamped::<3>(0.0);
    let fixed = swinging::<3>(&robot, Base::Fixed, Drives::None);
    for (name, start) in [("fixed", fixed), ("thrown", thrown(&robot))] {
        let mut flow = with_method(&start, Method::Moreau);
        let mut mean = |seconds: u32| {
            let (mut sum, mut low, mut high) = (0.0, f64::INFINITY, f64::NEG_INFINITY);
            for _ in 0..500 * seconds {
                flow.step(2e-3).unwrap();
                let residual = flow.run.ledger.balance().residual;
                (low, high) = (low.min(residual), high.max(residual));
                sum += residual;
            }
            assert_eq!(flow.run.counts.events, 0, "{name}");
            (sum / f64::from(500 * seconds), high - low)
        };
        let (first, swing) = mean(4);
        mean(12);
        let (last, _) = mean(4);
        let moved = (last - first).abs();
        assert!(moved < 0.1 * swing, "{name}: {moved:e} of {swing:e} J");
    }
}

fn reversed<const N: usize>(state: &State<Lanes, N>) -> State<Lanes, N> {
    let mut back = *state;
    back.velocity = back.velocity.map(|v| -v);
    back.turning = back.turning.map(|w| -w);
    back.rates = back.rates.map(|rate| -rate);
    back.pulley_rate = -back.pulley_rate;
    back
}

#[test]
fn steps_are_reversible_in_time() {
    let robot = undamped::<3>(0.0);
    let fixed = swinging::<3>(&robot, Base::Fixed, Drives::None);
    for (name, start) in [("fixed", fixed), ("thrown", thrown(&robot))] {
        let mut flow = with_method(&start, Method::Moreau);
        run(&mut flow, 0.2, 100);
        assert!(distance(&flow.run.state, &start.run.state) > 1.0, "{name}");
        flow.run.state = reversed(&flow.run.state);
        run(&mut flow, 0.2, 100);
        let off = distance(&reversed(&flow.run.state), &start.run.state);
        // The tolerance of the iteration, amplified tenfold by every swing.
        assert!(off < 1e-4, "{name}: {off:e}");
    }
}

#[test]
fn legs_on_a_fixed_trunk_are_independent() {
    let robot = undamped::<3>(1e-3);
    let mut start = swinging::<3>(&robot, Base::Fixed, Drives::None);
    let mut unperturbed = with_method(&start, Method::Moreau);
    for lane in [1, 2, 3] {
        start.run.state.rates[1] = start.run.state.rates[1].with_lane(lane, -7.0);
        start.run.state.angles[2] += Lanes::zero().with_lane(lane, 0.05);
    }
    let mut perturbed = with_method(&start, Method::Moreau);
    for _ in 0..20 {
        for flow in [&mut unperturbed, &mut perturbed] {
            flow.step(2e-3).unwrap();
        }
        let bits = |flow: &Flow<3>| {
            let numbers = flow.run.state.angles.iter().chain(&flow.run.state.rates);
            numbers.map(|x| x.lane(0).to_bits()).collect::<Vec<_>>()
        };
        assert_eq!(bits(&unperturbed), bits(&perturbed));
    }
}

/// Asserts that a gap, of which `rest` is left and which `overlap` is added to, closes by the
/// recovery share in each step, which takes energy.
fn assert_decays(flow: &mut Flow<3>, gap: impl Fn(&mut Flow<3>) -> f64, rest: f64, overlap: f64) {
    let mut expected = overlap;
    for _ in 0..8 {
        let taken = flow.run.ledger.impact;
        expected *= 1.0 - RECOVERY;
        flow.step(5e-4).unwrap();
        let found = gap(flow) - rest;
        assert!((found - expected).abs() < 2e-8, "{found:e} of {expected:e}");
        assert!(flow.run.ledger.impact >= taken);
    }
}

#[test]
fn overlap_of_a_stop_decays_by_the_recovery_share_per_step() {
    let start = flow::<3>(
        &fixtures::without_toes(),
        Base::Fixed,
        PASSIVE,
        Drives::None,
        None,
    );
    let mut flow = with_method(&start, Method::Moreau);
    run(&mut flow, 0.02, 40);
    let (reach, overlap) = (flow.model.side_by_side.l_delta.lane(0), -4e-6);
    let gap = |flow: &mut Flow<3>| {
        let angles = flow.run.state.angles;
        reach * (angles[2] - angles[0]).lane(0)
    };
    // The hip swings, by which the stop sinks a little in each step; some overlap is left.
    let rest = gap(&mut flow);
    assert!(rest.abs() < 2e-8, "{rest:e}");
    flow.run.state.angles[2] += Lanes::splat(overlap / reach);
    assert_decays(&mut flow, gap, rest, overlap);
}

/// The motor unwinds, and the leg bends: without the part of the motor, 15 % decay per step.
#[test]
fn overlap_of_a_cable_decays_by_the_recovery_share_per_step() {
    let start = motorised::<3>(Base::Fixed, &undamped::<3>(1e-2));
    let mut flow = with_method(&start, Method::Moreau);
    flow.run.mode.commands.hip = Lanes::zero();
    flow.run.mode.commands.pulley = Lanes::splat(0.05);
    // Until the leg is at rest on the taut cable.
    run(&mut flow, 3.0, 6000);
    let gap = |flow: &mut Flow<3>| {
        let state = flow.run.state;
        let Motion {
            articulated, drive, ..
        } = motion(flow, &state, 0.0);
        let taut = articulated.chain.taut(&flow.model.side_by_side, &drive);
        taut.gap.lane(0)
    };
    let (radius, overlap) = (flow.model.side_by_side.pulley_radius, -4e-6);
    let rest = gap(&mut flow);
    assert!(rest.abs() < 2e-8, "{rest:e}");
    flow.run.state.pulley -= Lanes::splat(overlap) / radius;
    assert_decays(&mut flow, gap, rest, overlap);
}

/// Without the limit, a foot that lands in a step of microseconds launches the robot in the next
/// step.
#[test]
fn expected_force_after_an_impact_is_limited_by_its_impulse() {
    let mut impact = LastImpulses::default();
    impact.impulses[0][0] = 0.1;
    impact.seconds = 1e-6;
    assert_eq!(impact.forces_over(1e-3)[0][0], 0.1 / 1e-3);
    assert_eq!(impact.forces_over(1e-7)[0][0], 0.1 / 1e-6);
    assert_eq!(LastImpulses::default().forces_over(1e-3), [[0.0; SLOTS]; 4]);
}

/// No step gives energy, and no foot is deeper than the overlap that halves a step, with the growth
/// of a few steps.
#[test]
fn impulses_of_a_landing_take_energy_and_keep_feet_above_ground() {
    for (restitution, friction, speed) in [(0.0, 0.6, 1.0), (0.7, 0.2, 3.0), (0.3, 1.5, 2.0)] {
        let ground = Ground::new(Terrain::Flat, friction, restitution).unwrap();
        let start = ([10.0, -45.0, 45.0], [0.0; 3]);
        let robot = fixtures::robot();
        let start = flow::<3>(&robot, Base::Free, start, Drives::None, Some(ground));
        let mut flow = with_method(&start, Method::Moreau);
        let feet = (0..4).map(|leg| flow.run.footing(&flow.model, leg, 3).unwrap().gap);
        flow.run.state.position[2] += 1e-3 - feet.fold(f64::INFINITY, f64::min);
        flow.run.state.velocity = [0.3, 0.1, -speed];
        flow.run.ledger = Ledger::opened(flow.stored());
        let mut taken = [0.0; 2];
        for step in 0..150 {
            flow.step(2e-3).unwrap();
            let now = [flow.run.ledger.impact, flow.run.ledger.dissipated];
            assert!(now[0] >= taken[0] && now[1] >= taken[1], "{step}");
            taken = now;
            for leg in 0..4 {
                let gap = flow.run.footing(&flow.model, leg, 3).unwrap().gap;
                assert!(gap > -1e-4, "{step}: {gap:e}");
            }
        }
        assert!(taken.iter().all(|taken| *taken > 1e-3), "{taken:?}");
    }
}
