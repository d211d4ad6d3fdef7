//! What cannot be is refused with a reason.

use twinrig_kernel::{SimDuration, SimTime};
use twinrig_legged::{LeggedError, StartPose};
use twinrig_rapier::{Joints, Options, Rapier, RapierError, Softness};
use twinrig_runtime::{Plant, PlantState};

use crate::scene::{Scene, hanging, robot, standing};

fn refused(change: impl FnOnce(&mut Options)) -> RapierError {
    let mut options = Options::new(standing(2000), Joints::Impulse);
    change(&mut options);
    let Err(error) = Rapier::new(&robot(), &options, &|_| true) else {
        panic!("it was built");
    };
    error
}

#[test]
fn settings_that_cannot_be_are_refused_by_name() {
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
fn setups_that_cannot_be_are_refused_as_by_every_plant() {
    let none = refused(|o| o.setup.legs = vec!["XX".to_owned()]);
    assert!(matches!(
        none,
        RapierError::Legged(LeggedError::NoSuchLeg { .. })
    ));
    let step = refused(|o| o.setup.step = SimDuration::ZERO);
    assert_eq!(step, RapierError::Legged(LeggedError::Step));
    let beyond = StartPose {
        q: [0.0, 0.2, 0.0],
        rates: [0.0; 3],
    };
    let beyond = refused(|o| o.setup.start = beyond.into());
    assert!(matches!(beyond, RapierError::Legged(_)));
}

#[test]
fn segments_without_mass_are_refused() {
    let mut robot = robot();
    robot.legs[0].leg.mass.l2 = 0.0;
    let start = StartPose {
        q: [0.0, -0.3, 0.3],
        rates: [0.0; 3],
    };
    let options = Options::new(hanging(&["LF"], start, 2000), Joints::Impulse);
    let Err(error) = Rapier::new(&robot, &options, &|_| true) else {
        panic!("it was built");
    };
    assert!(
        error.to_string().contains("second segment of leg LF"),
        "{error}"
    );
}

#[test]
fn a_command_that_is_no_number_is_a_fault_that_names_it() {
    let mut scene = Scene::of(&robot(), standing(2000), Joints::Impulse);
    scene.commands[3] = f64::NAN;
    let at = SimTime::ZERO + SimDuration::from_millis(2);
    let fault = scene.plant.advance(at, &scene.commands).unwrap_err();
    assert_eq!(fault.part, "leg/RF/knee/command");
}

#[test]
fn no_state_without_an_attitude_is_taken_over() {
    let mut scene = Scene::of(&robot(), standing(2000), Joints::Impulse);
    let flat = PlantState::at(SimTime::ZERO).with("body/orientation", &[0.0; 4]);
    assert!(scene.plant.resume_from(&flat).is_err());
    let odd = PlantState::at(SimTime::ZERO).with("body/velocity", &[f64::NAN; 3]);
    assert!(scene.plant.resume_from(&odd).is_err());
}
