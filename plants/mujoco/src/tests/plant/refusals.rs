//! Refused options and states, and their messages.

use twinrig_contact::{Ground, HeightField, Terrain};
use twinrig_kernel::SimTime;
use twinrig_legged::Setup;
use twinrig_mujoco::{Coordinates, Mujoco, MujocoError, Numerics, Options, TimeConstant};
use twinrig_runtime::Plant;
use twinrig_testing::robots::{self, robot};

use super::fixture::{standing, with_coordinates};

fn refused(setup: Setup, change: impl Fn(&mut Numerics)) -> String {
    let mut options = Options::new(setup, Coordinates::Maximal);
    change(&mut options.numerics);
    match Mujoco::new(&robot(), &options, &|_| true) {
        Err(error) => error.to_string(),
        Ok(_) => panic!("it was built"),
    }
}

#[test]
fn invalid_settings_are_refused_by_name() {
    for (setting, change) in [
        (
            "solref_steps",
            (|n| n.closing = TimeConstant::Steps(1.0)) as fn(&mut Numerics),
        ),
        ("solref_steps", |n| n.closing = TimeConstant::Steps(-1.0)),
        ("solref_time", |n| {
            n.closing = TimeConstant::Seconds(f64::NAN);
        }),
        ("solref_damping", |n| n.damping = 0.0),
        ("contact_damping", |n| n.contact_damping = -1.0),
        ("solimp_min", |n| n.impedance[0] = 1.0),
        ("solimp_max", |n| n.impedance[1] = 0.0),
        ("solimp_width", |n| n.width = f64::INFINITY),
        ("solver_tolerance", |n| n.tolerance = -1e-8),
        ("impratio", |n| n.impratio = 0.0),
        ("iterations", |n| n.iterations = 0),
    ] {
        let error = refused(standing(), change);
        assert!(error.contains(setting), "{setting}: {error}");
    }
}

#[test]
fn ground_with_restitution_is_refused_with_a_remedy() {
    let setup = Setup {
        ground: Some(Ground::new(Terrain::Flat, 0.6, 0.3).unwrap()),
        ..standing()
    };
    let error = refused(setup, |_| {});
    assert!(error.contains("restitution = 0"), "{error}");
}

#[test]
fn invalid_inertia_is_refused_before_compilation() {
    let mut robot = robot();
    robot.trunk.inertia = [1e-3, 1e-3, 1.0];
    let options = Options::new(standing(), Coordinates::Minimal);
    let error = Mujoco::new(&robot, &options, &|_| true).err().unwrap();
    assert!(matches!(error, MujocoError::Incompatible(_)), "{error}");
    let mut robot = robots::robot();
    robot.legs[0].leg.mass.l2 = 0.0;
    let error = Mujoco::new(&robot, &options, &|_| true).err().unwrap();
    assert!(
        error.to_string().contains("middle segment of leg LF"),
        "{error}"
    );
}

#[test]
fn foot_outside_the_height_field_is_a_fault() {
    let field = HeightField::new([-0.15, -0.1], 0.05, 7, vec![0.0; 35]).unwrap();
    let setup = Setup {
        ground: Some(Ground::new(Terrain::Heights(field), 0.6, 0.0).unwrap()),
        ..standing()
    };
    let mut fixture = with_coordinates(setup, Coordinates::Minimal);
    let state = fixture.plant.state().unwrap();
    let state = state.with("body/velocity", &[2.0, 0.0, 0.3]);
    fixture.plant.resume_from(&state).unwrap();
    let inputs = fixture.commands.clone();
    let mut fault = None;
    for ms in 1..300 {
        let to = SimTime::ZERO + twinrig_kernel::SimDuration::from_millis(ms);
        if let Err(found) = fixture.plant.advance(to, &inputs) {
            fault = Some(found);
            break;
        }
    }
    let fault = fault.unwrap();
    assert!(
        fault.part.starts_with("leg/") && fault.why.contains("height field"),
        "{fault}"
    );
}

#[test]
fn unstable_step_is_a_fault_with_time_and_energy() {
    let mut robot = robot();
    for mount in &mut robot.legs {
        mount.leg.diagonal.stiffness *= 1e6;
    }
    let options = Options::new(standing(), Coordinates::Minimal);
    let mut plant = Mujoco::new(&robot, &options, &|_| true).unwrap();
    let mut inputs = vec![0.0; 8];
    plant.initial_inputs(&mut inputs);
    let fault = plant
        .advance(
            SimTime::ZERO + twinrig_kernel::SimDuration::from_millis(500),
            &inputs,
        )
        .unwrap_err();
    assert!(fault.why.contains("shorter step"), "{fault}");
    assert!(fault.time < SimTime::ZERO + twinrig_kernel::SimDuration::from_millis(500));
}

#[test]
fn non_finite_input_is_a_fault_that_names_it() {
    let mut fixture = with_coordinates(standing(), Coordinates::Minimal);
    let mut inputs = fixture.commands.clone();
    inputs[3] = f64::NAN;
    let to = SimTime::ZERO + twinrig_kernel::SimDuration::from_millis(2);
    let fault = fixture.plant.advance(to, &inputs).unwrap_err();
    assert_eq!(fault.part, "leg/RF/knee/command");
}
