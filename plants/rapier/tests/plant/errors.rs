//! Invalid options, commands and states are refused with a reason.

use twinrig_kernel::{SimDuration, SimTime};
use twinrig_legged::{LeggedError, StartPose};
use twinrig_rapier::{Joints, Options, Rapier, RapierError, Softness};
use twinrig_robot::PointMass;
use twinrig_runtime::{Plant, PlantState};
use twinrig_testing::robots::{robot, suspended};

use crate::fixture::{standing, with_joints};

fn refused(change: impl FnOnce(&mut Options)) -> RapierError {
    let mut options = Options::new(standing(2000), Joints::Impulse);
    change(&mut options);
    let Err(error) = Rapier::new(&robot(), &options, &|_| true) else {
        panic!("the plant was built");
    };
    error
}

#[test]
fn invalid_settings_are_refused_by_name() {
    assert_eq!(
        refused(|o| o.solver.substeps = 0),
        RapierError::Count("substeps")
    );
    assert_eq!(
        refused(|o| o.solver.pgs_iterations = 0),
        RapierError::Count("pgs_iterations")
    );
    assert_eq!(
        refused(|o| o.solver.solver_iterations = 0),
        RapierError::Count("solver_iterations")
    );
    for bad in [0.0, -1.0, f64::INFINITY] {
        let softness = |natural_frequency, damping_ratio| Softness {
            natural_frequency,
            damping_ratio,
        };
        let error = refused(|o| o.solver.joint_softness = softness(bad, 1.0));
        assert_eq!(
            error,
            RapierError::Softness("joint", "natural frequency", bad)
        );
        let error = refused(|o| o.solver.contact_softness = softness(1.0, bad));
        assert_eq!(
            error,
            RapierError::Softness("contact", "damping ratio", bad)
        );
        assert_eq!(
            refused(|o| o.axial_share = bad),
            RapierError::AxialShare(bad)
        );
    }
    assert!(matches!(
        refused(|o| o.axial_share = f64::NAN),
        RapierError::AxialShare(_)
    ));
}

#[test]
fn invalid_setups_are_refused() {
    let none = refused(|o| o.setup.legs = vec!["XX".to_owned()]);
    assert!(matches!(
        none,
        RapierError::Legged(LeggedError::NoSuchLeg { .. })
    ));
    let step = refused(|o| o.setup.step = SimDuration::ZERO);
    assert_eq!(step, RapierError::Legged(LeggedError::Step));
    let invalid = StartPose {
        q: [0.0, 0.2, 0.0],
        rates: [0.0; 3],
    };
    let invalid = refused(|o| o.setup.start = invalid.into());
    assert!(matches!(invalid, RapierError::Legged(_)));
}

#[test]
fn massless_segments_are_refused() {
    let mut robot = robot();
    robot.legs[0].leg.mass.l2 = 0.0;
    let start = StartPose {
        q: [0.0, -0.3, 0.3],
        rates: [0.0; 3],
    };
    let options = Options::new(suspended(&["LF"], start, 2000), Joints::Impulse);
    let Err(error) = Rapier::new(&robot, &options, &|_| true) else {
        panic!("the plant was built");
    };
    assert!(
        error.to_string().contains("second segment of leg LF"),
        "{error}"
    );
}

#[test]
fn non_finite_command_is_a_fault_that_names_it() {
    let mut fixture = with_joints(&robot(), standing(2000), Joints::Impulse);
    fixture.commands[3] = f64::NAN;
    let at = SimTime::ZERO + SimDuration::from_millis(2);
    let fault = fixture.plant.advance(at, &fixture.commands).unwrap_err();
    assert_eq!(fault.part, "leg/RF/knee/command");
}

#[test]
fn state_with_invalid_attitude_or_velocity_is_refused() {
    let mut fixture = with_joints(&robot(), standing(2000), Joints::Impulse);
    let flat = PlantState::at(SimTime::ZERO).with("body/orientation", &[0.0; 4]);
    assert!(fixture.plant.resume_from(&flat).is_err());
    let non_finite = PlantState::at(SimTime::ZERO).with("body/velocity", &[f64::NAN; 3]);
    assert!(fixture.plant.resume_from(&non_finite).is_err());
}

#[test]
fn payloads_are_refused() {
    let mut robot = robot();
    let (mass, at) = (0.1, [0.02, 0.0, 0.03]);
    robot.trunk.payloads = vec![PointMass { mass, at }];
    let options = Options::new(standing(2000), Joints::Impulse);
    let refused = Rapier::new(&robot, &options, &|_| true).map(|_| ());
    assert_eq!(refused, Err(RapierError::Payload));
}
