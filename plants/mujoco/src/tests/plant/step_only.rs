//! Steps of MuJoCo alone.

use twinrig_legged::{Drives, Setup};
use twinrig_mujoco::{Coordinates, Integrator, Mujoco, MujocoError, Options};
use twinrig_runtime::Plant as _;
use twinrig_testing::robots::{self, LEGS, pose, robot};
use twinrig_testing::trot::Trot;

use super::fixture::{Fixture, hanging, with_options};

/// Returns the options of the complete plant and of steps alone, without corrected friction.
fn both(setup: &Setup, coordinates: Coordinates, integrator: Integrator) -> [Options; 2] {
    [false, true].map(|step_only| {
        let mut options = Options::new(setup.clone(), coordinates);
        options.numerics.integrator = integrator;
        options.numerics.sliding_rounds = 0;
        options.step_only = step_only;
        options
    })
}

fn feet(fixture: &mut Fixture) -> Vec<f64> {
    let signals = LEGS.map(|leg| format!("leg/{leg}/foot/position"));
    let feet = signals.map(|signal| fixture.read(&signal));
    feet.concat()
}

fn released() -> Setup {
    hanging(pose([10.0, -9.5, 9.5], [0.0; 3]))
}

#[test]
fn passive_legs_move_as_in_the_complete_plant() {
    for (coordinates, integrator) in [
        (Coordinates::Minimal, Integrator::Euler),
        (Coordinates::Minimal, Integrator::ImplicitFast),
        (Coordinates::Minimal, Integrator::Discrete),
        (Coordinates::Minimal, Integrator::Rk4),
        (Coordinates::Maximal, Integrator::Euler),
    ] {
        let mut fixtures = both(&released(), coordinates, integrator)
            .map(|options| with_options(&robot(), &options));
        for ms in (10..=300).step_by(10) {
            let [complete, alone] = fixtures.each_mut().map(|fixture| {
                fixture.advance_to_ms(ms);
                feet(fixture)
            });
            assert_eq!(complete, alone, "{integrator:?} at {ms} ms");
        }
    }
}

#[test]
fn trot_of_ideal_servos_moves_as_in_the_complete_plant() {
    let setup = robots::standing(Drives::Ideal { period: 2e-3 }, 2000);
    let options = both(&setup, Coordinates::Minimal, Integrator::ImplicitFast);
    let [complete, alone] = options.map(|options| {
        let mut fixture = with_options(&robot(), &options);
        let start = feet(&mut fixture);
        for ms in (2..=500).step_by(2) {
            fixture.trot(&robot(), &setup, Trot::START, ms);
        }
        let end = feet(&mut fixture);
        assert!((start[0] - end[0]).abs() > 1e-3, "it moves");
        end
    });
    assert_eq!(complete, alone);
}

#[test]
fn readings_follow_and_the_energy_is_that_stored() {
    let [_, options] = both(&released(), Coordinates::Minimal, Integrator::Euler);
    let mut fixture = with_options(&robot(), &options);
    fixture.observe();
    let (start, at_start) = (fixture.energy(), fixture.plant.state().unwrap());
    fixture.advance_to_ms(300);
    // The shared state needs no reading before it.
    let state = fixture.plant.state().unwrap();
    fixture.observe();
    assert_eq!(fixture.plant.state().unwrap(), state);
    assert_ne!(state.get("leg/LF/angles"), at_start.get("leg/LF/angles"));
    let end = fixture.energy();
    assert!(end.stored() < start.stored(), "joints dissipate");
    assert_eq!((end.residual, end.dissipated), (0.0, 0.0));
}

#[test]
fn motors_are_refused() {
    let text = include_str!("../../../../../robots/oncilla.toml");
    let robot = twinrig_robot::RobotFile::parse("oncilla.toml", text).unwrap();
    let robot = robot.robot().unwrap();
    let motors = robot.motors.unwrap();
    let drives = Drives::Motors {
        hip: motors.hip,
        knee: motors.knee,
    };
    let mut options = Options::new(robots::standing(drives, 2000), Coordinates::Minimal);
    options.step_only = true;
    let refused = Mujoco::new(&robot, &options, &|_| true);
    assert!(matches!(refused, Err(MujocoError::Incompatible(_))));
}

#[test]
fn position_actuators_follow_their_commands() {
    let setup = super::fixture::standing();
    let [complete, mut options] = both(&setup, Coordinates::Minimal, Integrator::ImplicitFast);
    options.position_actuators = true;
    let angles = [complete, options].map(|options| {
        let mut fixture = with_options(&robot(), &options);
        for ms in (2..=300).step_by(2) {
            fixture.trot(&robot(), &setup, Trot::START, ms);
        }
        ["LF/hip", "RH/knee"].map(|drive| fixture.value(&format!("leg/{drive}/position")))
    });
    for (flywheel, actuator) in angles[0].iter().zip(angles[1]) {
        // Loads deflect the actuators.
        assert!((flywheel - actuator).abs() < 0.05, "{angles:?}");
    }
    options = both(&setup, Coordinates::Minimal, Integrator::Euler)[0].clone();
    options.position_actuators = true;
    let refused = Mujoco::new(&robot(), &options, &|_| true);
    assert!(matches!(refused, Err(MujocoError::Incompatible(_))));
}
