//! Closed forms that require initial velocities, which the public interface cannot set.

use nalgebra::{Matrix2, Rotation3, SymmetricEigen, Vector3};
use twinrig_contact::{Ground, Terrain};
use twinrig_kernel::{SimDuration, SimTime};
use twinrig_legged::{Abduction, Base, Contacts, Drives, LeggedPlant, SetPoint, Setup};
use twinrig_robot::leg::{LegCommand, Pantograph, Planar};
use twinrig_robot::{Robot, RobotFile};
use twinrig_runtime::Plant;

use super::Islands;
use crate::flow::Flow;
use crate::model::GRAVITY;
use crate::{Force, Options};

const LEGS: [&str; 4] = ["LF", "RF", "LH", "RH"];

/// Cheetah-cub without friction in its joints.
fn robot() -> Robot {
    let text = include_str!("../../../../robots/cheetah-cub.toml");
    let mut robot = RobotFile::parse("cheetah-cub.toml", text)
        .unwrap()
        .robot()
        .unwrap();
    for mount in &mut robot.legs {
        let friction = &mut mount.leg.joint_friction;
        (friction.hip, friction.knee, friction.ankle) = (0.0, 0.0, 0.0);
    }
    robot
}

/// Cheetah-cub with springs preloaded so that no load of these tests moves them off their stops: a
/// rigid body.
fn rigid() -> Robot {
    let mut robot = robot();
    for mount in &mut robot.legs {
        (mount.leg.diagonal.preload, mount.leg.parallel.preload) = (0.05, 0.05);
    }
    robot
}

/// Cheetah-cub with springs that pull it off its stops: in the air, the feet hang between the
/// stops.
fn stretched(travel: f64) -> Robot {
    let mut robot = robot();
    for mount in &mut robot.legs {
        (mount.leg.diagonal.preload, mount.leg.parallel.preload) = (-0.004, -0.004);
        mount.leg.parallel_travel = travel;
    }
    robot
}

fn setup(base: Base, legs: &[&str], friction: Option<f64>, step: SimDuration) -> Setup {
    let straight = LegCommand {
        hip: 0.0,
        knee: 0.0,
    };
    Setup {
        base,
        legs: legs.iter().map(|leg| (*leg).to_owned()).collect(),
        ground: friction.map(|friction| Ground::new(Terrain::Flat, friction, 0.0).unwrap()),
        step,
        drives: Drives::Ideal { period: 5e-3 },
        abduction: Abduction::Locked,
        contacts: Contacts::Feet,
        set_point: SetPoint::Held,
        start: legs
            .iter()
            .map(|leg| ((*leg).to_owned(), straight))
            .collect(),
    }
}

/// Plant with rigid constraints.
type Massless = LeggedPlant<Islands>;

fn plant(robot: &Robot, setup: &Setup) -> Massless {
    let options = Options::new(setup.clone(), Force::Solve);
    Massless::new(robot, &options, &|_| true).unwrap()
}

/// Sets the velocities of a rigid body's motion (trunk frame).
fn set_velocities(plant: &mut Massless, velocity: Vector3<f64>, rate: Vector3<f64>) {
    let mut state = plant.dynamics().flows[0].state;
    state.set_velocity(velocity);
    state.set_rate(rate);
    for (i, leg) in plant.dynamics().flows[0].model.legs.iter().enumerate() {
        let foot = velocity + rate.cross(&leg.foot_in_trunk(state.foot(i)));
        state.set_foot_velocity(i, Planar::new(foot.x, foot.z));
    }
    plant.dynamics_mut().flows[0].replace(&state).unwrap();
}

fn run(plant: &mut Massless, from: SimTime, steps: u64, step: SimDuration) -> SimTime {
    let mut now = from;
    let commands = [0.0; 8];
    for _ in 0..steps {
        now += step;
        plant.advance(now, &commands).unwrap();
    }
    now
}

#[test]
fn sliding_robot_stops_after_v_squared_over_two_mu_g() {
    let (friction, speed) = (0.2, 0.5);
    let step = SimDuration::from_micros(500);
    let mut plant = plant(&rigid(), &setup(Base::Free, &LEGS, Some(friction), step));
    set_velocities(&mut plant, Vector3::new(speed, 0.0, 0.0), Vector3::zeros());
    let (mut now, mut stopped) = (SimTime::ZERO, None);
    while now < SimTime::from_nanos(400_000_000) {
        now = run(&mut plant, now, 1, step);
        if stopped.is_none() && plant.dynamics().flows[0].state.velocity().x < 1e-9 {
            stopped = Some(now);
        }
    }
    // The start shifts the load from four equal feet to the front pair: the stops' recovery yields
    // by some micrometres, and the time of the stop changes by up to a step.
    let time = speed / (friction * GRAVITY);
    let distance = 0.5 * speed * time;
    let (found, place) = (
        stopped.unwrap().as_secs_f64(),
        plant.dynamics().flows[0].state.position().x,
    );
    assert!((found - time).abs() < 1e-3, "{found} s, not {time} s");
    assert!(
        (place - distance).abs() < 2e-3 * distance,
        "{place} m, not {distance} m"
    );
    assert!(
        plant.dynamics().flows[0].state.velocity().norm() < 1e-9,
        "it stays"
    );
    // The kinetic energy is dissipated.
    let kinetic = 0.5 * 1.1 * speed * speed;
    let balance = plant.energy();
    assert!(
        (balance.dissipated - kinetic).abs() < 1e-2 * kinetic,
        "{balance:?}"
    );
}

/// Mass, centre of mass, momentum and angular momentum about it, world frame, of trunk and feet.
fn moments(plant: &Massless) -> (f64, Vector3<f64>, Vector3<f64>, Vector3<f64>) {
    let (state, model) = (
        &plant.dynamics().flows[0].state,
        &plant.dynamics().flows[0].model,
    );
    let turn = Rotation3::from_matrix_unchecked(state.rotation());
    let (velocity, rate) = (state.velocity(), state.rate());
    let mut parts = vec![(model.mass, state.position(), turn * velocity)];
    for (i, leg) in model.legs.iter().enumerate() {
        let foot = leg.foot_in_trunk(state.foot(i));
        let foot_velocity = state.foot_velocity(i);
        let sideways = (velocity + rate.cross(&foot)).y;
        let speed = Vector3::new(foot_velocity.x, sideways, foot_velocity.y);
        parts.push((leg.mass, state.position() + turn * foot, turn * speed));
    }
    let mass: f64 = parts.iter().map(|(m, _, _)| m).sum();
    let centre = parts.iter().map(|(m, r, _)| r * *m).sum::<Vector3<f64>>() / mass;
    let momentum: Vector3<f64> = parts.iter().map(|(m, _, v)| v * *m).sum();
    let spin = turn * model.spin(&rate)
        + parts
            .iter()
            .map(|(m, r, v)| (r - centre).cross(v) * *m)
            .sum::<Vector3<f64>>();
    (mass, centre, momentum, spin)
}

/// Greatest errors of the parabola \[m\] and, relative, of the angular momentum in a flight of 0.3
/// s.
fn flight_errors(robot: &Robot, step_us: u64, hips: [f64; 4], knee: f64) -> [f64; 2] {
    let step = SimDuration::from_micros(step_us);
    let mut plant = plant(robot, &setup(Base::Free, &LEGS, None, step));
    set_velocities(
        &mut plant,
        Vector3::new(0.4, -0.3, 1.5),
        Vector3::new(3.0, 2.0, -4.0),
    );
    let (mass, start, momentum, spin) = moments(&plant);
    let (mut now, mut errors) = (SimTime::ZERO, [0.0_f64; 2]);
    while now < SimTime::from_nanos(300_000_000) {
        let middle_s = now.as_secs_f64() + 0.5 * step.as_secs_f64();
        now += step;
        let swing = libm::sin(12.0 * middle_s);
        let commands: [f64; 8] = std::array::from_fn(|i| {
            if i % 2 == 0 {
                hips[i / 2] * swing
            } else {
                knee
            }
        });
        plant.advance(now, &commands).unwrap();
        let time = now.as_secs_f64();
        let (_, centre, _, spin_now) = moments(&plant);
        let parabola =
            start + momentum / mass * time - Vector3::z() * (0.5 * GRAVITY * time * time);
        errors[0] = errors[0].max((centre - parabola).norm());
        errors[1] = errors[1].max((spin_now - spin).norm() / spin.norm());
    }
    errors
}

#[test]
fn mass_centre_in_flight_follows_a_parabola_and_angular_momentum_is_conserved() {
    // Tumbling at 5 rad/s with hips that swing by up to 0.5 rad at 2 Hz and feet on stretched
    // springs, which swing at up to 40 Hz between the stops: all smooth, so of second order.
    let mut robot = stretched(0.014);
    for mount in &mut robot.legs {
        mount.leg.joint_friction.knee = 1e-3;
        mount.leg.joint_friction.ankle = 1e-3;
    }
    let hips = [0.4, -0.3, -0.5, 0.2];
    let (coarse, fine) = (
        flight_errors(&robot, 4000, hips, 0.0),
        flight_errors(&robot, 2000, hips, 0.0),
    );
    assert!(coarse[0] < 1e-4 && coarse[1] < 5e-3, "{coarse:?}");
    for place in 0..2 {
        let ratio = coarse[place] / fine[place];
        assert!((3.0..5.0).contains(&ratio), "{coarse:?} {fine:?}");
    }
}

#[test]
fn stops_and_cables_conserve_momentum_and_angular_momentum() {
    // As before, and the cables retract the legs abruptly. An impulse acts at the configuration at
    // the start of its step, off by up to half a step's motion: first order.
    let hips = [0.4, -0.3, -0.5, 0.2];
    let (coarse, fine) = (
        flight_errors(&robot(), 1000, hips, 0.5),
        flight_errors(&robot(), 250, hips, 0.5),
    );
    assert!(coarse[0] < 2e-4 && coarse[1] < 1e-2, "{coarse:?}");
    assert!(fine[1] < coarse[1] / 2.0, "{coarse:?} {fine:?}");
}

#[test]
fn planar_robot_in_flight_with_rigid_legs_pitches_at_constant_rate() {
    let step = SimDuration::from_millis(1);
    let mut plant = plant(&rigid(), &setup(Base::Planar, &LEGS, None, step));
    set_velocities(
        &mut plant,
        Vector3::new(0.2, 0.0, 1.0),
        Vector3::new(0.0, 4.0, 0.0),
    );
    run(&mut plant, SimTime::ZERO, 300, step);
    let rate = plant.dynamics().flows[0].state.rate();
    // The stops are constrained at velocity level with recovery of drift: 1e-6 of the rate.
    assert!(
        (rate.y - 4.0).abs() < 4e-6 && rate.x == 0.0 && rate.z == 0.0,
        "{rate}"
    );
}

/// Plant of one fixed leg whose foot rests where springs and weight balance, and the stiffness
/// there.
fn balanced(step: SimDuration, friction: Option<f64>) -> (Massless, Matrix2<f64>) {
    let robot = stretched(0.010);
    let mut plant = plant(&robot, &setup(Base::Fixed, &["LF"], friction, step));
    let leg = Pantograph::new(&robot.legs[0].leg).unwrap();
    let weight = Planar::new(0.0, robot.legs[0].leg.mass.lumped_foot * GRAVITY);
    let hip = leg.hip_reference();
    let force = |foot: Planar| {
        let pose = leg.pose(libm::sin(hip), libm::cos(hip), foot).unwrap();
        leg.spring_gradient(&pose).foot + weight
    };
    let hessian = |foot: Planar| {
        let h = 1e-6;
        let column = |d: Planar| (force(foot + d) - force(foot - d)) / (2.0 * h);
        Matrix2::from_columns(&[column(Planar::new(h, 0.0)), column(Planar::new(0.0, h))])
    };
    let mut foot = Planar::new(0.0, -0.9 * leg.length_max());
    for _ in 0..50 {
        foot -= hessian(foot).try_inverse().unwrap() * force(foot);
    }
    let pose = leg.pose(libm::sin(hip), libm::cos(hip), foot).unwrap();
    assert!(leg.allows(&pose) && force(foot).norm() < 1e-9);
    let mut state = plant.dynamics().flows[0].state;
    state.set_foot(0, foot);
    let height = plant.dynamics().flows[0].model.legs[0].hip.z + foot.y;
    state.set_position(Vector3::new(0.0, 0.0, 0.001 - height));
    plant.dynamics_mut().flows[0].replace(&state).unwrap();
    (plant, hessian(foot))
}

#[test]
fn foot_oscillates_at_the_eigenfrequencies_of_the_energys_hessian() {
    let step = SimDuration::from_millis(1);
    let h = step.as_secs_f64();
    for mode in 0..2 {
        let (mut plant, stiffness) = balanced(step, None);
        let modes = SymmetricEigen::new((stiffness + stiffness.transpose()) * 0.5);
        let exact = (modes.eigenvalues[mode] / plant.dynamics().flows[0].model.legs[0].mass).sqrt();
        let direction: Planar = modes.eigenvectors.column(mode).into();
        let rest = plant.dynamics().flows[0].state.foot(0);
        let mut state = plant.dynamics().flows[0].state;
        state.set_foot(0, rest + direction * 1e-6);
        plant.dynamics_mut().flows[0].replace(&state).unwrap();
        // Frequency ω' of the midpoint rule: tan(ω'h/2) = ωh/2.
        let expected = 2.0 / h * libm::atan(0.5 * exact * h);
        let mut now = SimTime::ZERO;
        let mut worst = 0.0_f64;
        for k in 1..=200_u32 {
            now = run(&mut plant, now, 1, step);
            let place = (plant.dynamics().flows[0].state.foot(0) - rest).dot(&direction);
            let cosine = 1e-6 * libm::cos(expected * h * f64::from(k));
            worst = worst.max((place - cosine).abs());
        }
        // A swing of a micrometre changes the length of the springs by 1e-5 of it.
        assert!(
            worst < 2e-3 * 1e-6,
            "mode {mode} at {exact} rad/s: {worst:e} m"
        );
    }
}

/// Plant after its foot hit the ground at 1 m/s from `gap` metres above, and its speeds before and
/// after.
fn landed(restitution: f64, gap: f64) -> (Massless, f64, f64) {
    let step = SimDuration::from_micros(10);
    let (mut plant, _) = balanced(step, Some(0.0));
    plant.dynamics_mut().flows[0]
        .model
        .ground
        .as_mut()
        .unwrap()
        .restitution = restitution;
    let mut state = plant.dynamics().flows[0].state;
    state.set_position(state.position() - Vector3::z() * (0.001 - gap));
    state.set_foot_velocity(0, Planar::new(0.3, -1.0));
    plant.dynamics_mut().flows[0].replace(&state).unwrap();
    let mut before = 1.0;
    for tick in 1..=20 {
        let speed = -plant.dynamics().flows[0].state.foot_velocity(0).y;
        plant
            .advance(SimTime::from_nanos(10_000 * tick), &[0.0; 2])
            .unwrap();
        if plant.dynamics().flows[0].ledger.impact == 0.0 {
            before = speed;
        }
    }
    let after = plant.dynamics().flows[0].state.foot_velocity(0).y;
    (plant, before, after)
}

/// Heights from which the foot hits the ground at the beginning, in the middle and at the end of a
/// step, which is 10 µm long: springs and weight, in balance 1 mm lower, change the speed little.
const GAPS: [f64; 4] = [30.01e-6, 33e-6, 36e-6, 39.9e-6];

#[test]
fn landing_foot_dissipates_exactly_its_kinetic_energy() {
    for gap in GAPS {
        let (plant, before, after) = landed(0.0, gap);
        let lost = 0.5 * plant.dynamics().flows[0].model.legs[0].mass * before * before;
        // The step of the impact leaves an overlap; its recovery leaves the foot the resting speed,
        // 0.05 m/s, and the corresponding energy.
        let impact = plant.energy().impact;
        assert!((impact - lost).abs() < 0.003 * lost, "{impact} of {lost}");
        assert!((-0.005..=0.05 + 0.005).contains(&after), "{after}");
        let along = plant.dynamics().flows[0].state.foot_velocity(0).x;
        assert!((along - 0.3).abs() < 5e-3, "no friction, {along}");
    }
}

#[test]
fn foot_rebounds_at_the_coefficient_of_restitution() {
    for restitution in [0.3, 0.8, 1.0] {
        for gap in GAPS {
            let (plant, before, after) = landed(restitution, gap);
            assert!(
                (after - restitution * before).abs() < 5e-3,
                "{after} of {before}"
            );
            let lost = 0.5
                * plant.dynamics().flows[0].model.legs[0].mass
                * before
                * before
                * (1.0 - restitution * restitution);
            let impact = plant.energy().impact;
            assert!((impact - lost).abs() < 5e-5, "{impact} not {lost}");
        }
    }
}

#[test]
fn impacts_that_generate_energy_are_a_fault() {
    // Defects: more energy returned than the overlaps took, and a negative sum.
    let (plant, ..) = landed(0.0, GAPS[0]);
    let fault_of = |defect: fn(&mut Flow)| {
        let mut plant = plant.clone();
        defect(&mut plant.dynamics_mut().flows[0]);
        plant.advance(SimTime::from_nanos(210_000), &[0.0; 2])
    };
    assert_eq!(fault_of(|_| ()), Ok(()));
    let fault = fault_of(|flow| flow.constraints.overlap = -0.1).unwrap_err();
    assert!(fault.why.contains("impacts give 1.000e-1 J"), "{fault}");
    let fault = fault_of(|flow| flow.ledger.impact = -0.1).unwrap_err();
    assert!(fault.why.contains("impacts have generated"), "{fault}");
}

#[test]
fn swinging_foot_conserves_energy_without_friction() {
    // The foot starts at 0.22 m/s and swings between the stops while the drive is held: 0.04 J are
    // exchanged. The iteration of the discrete gradient leaves up to 2e-8 J at the end of a step,
    // which the next step compensates. A trunk that falls and turns, 2 J, adds the iteration's
    // error in the work of gravity, which has the same tolerance, and the third order of the feet's
    // sideways inertia.
    for (base, bound) in [
        (Base::Fixed, 5e-8),
        (Base::Planar, 3.3e-7),
        (Base::Free, 3.3e-7),
    ] {
        for ms in [1, 2] {
            let step = SimDuration::from_millis(ms);
            let (mut plant, _) = balanced(step, None);
            plant.dynamics_mut().flows[0].model.base = base;
            let mut state = plant.dynamics().flows[0].state;
            state.set_foot_velocity(0, Planar::new(0.1, 0.2));
            plant.dynamics_mut().flows[0].replace(&state).unwrap();
            let mut now = run(&mut plant, SimTime::ZERO, 1, step);
            let energy_before = plant.energy();
            let mut greatest = 0.0_f64;
            for _ in 0..100 {
                now = run(&mut plant, now, 1, step);
                greatest = greatest.max((plant.energy().stored() - energy_before.stored()).abs());
            }
            let balance = plant.energy();
            assert!(
                balance.impact == 0.0 && balance.exchanged > 0.03,
                "{balance:?}"
            );
            assert!(greatest < bound, "{base:?} {ms} ms: {greatest:e} J");
        }
    }
}
