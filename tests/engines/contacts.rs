//! Contact of trunk, knees and ankles in the engines.

#[cfg(feature = "rapier")]
use twinrig::Status;
#[cfg(feature = "rapier")]
use twinrig_tests::shipped;

use crate::{ENGINES, report_of};

#[cfg(feature = "rapier")]
#[test]
fn rapier_refuses_contact_of_the_trunk_with_ground_that_is_not_flat() {
    let step = "{ profile = 'step-down', at = '9 m', height = '2 cm' }";
    let settings = [("plant.model", "'rapier'"), ("plant.ground", step)];
    let registry = twinrig::registry();
    let assembly = shipped(&registry, "fall.toml", &settings);
    let error = assembly.map(|_| ()).unwrap_err();
    let source = std::error::Error::source(&error).unwrap();
    let refusal = source.to_string();
    assert!(refusal.contains("contact on flat ground only"), "{refusal}");
}

/// The robot of `fall.toml` tips over and lies on its trunk in every engine, as in our own plants.
#[test]
fn a_robot_that_falls_lies_on_the_ground() {
    for engine in ENGINES {
        let model = format!("'{engine}'");
        let settings = [
            ("plant.model", model.as_str()),
            ("plant.contacts", "'all'"),
            ("plant.step", "'0.5 ms'"),
        ];
        let report = report_of("fall.toml", &settings);
        let outcomes = report.expectations.iter().map(|line| &line.outcome);
        let measured: Vec<_> = outcomes.map(|row| (&row.name, row.measured)).collect();
        assert_eq!(report.verdict, Status::Pass, "{engine}: {measured:?}");
        let energy = report.energy.unwrap();
        let residual = energy.residual_j.abs() / energy.exchanged_j;
        // Of tangential impulses Rapier states the magnitude over its substeps, and their last
        // direction only.
        let most = if *engine == "rapier" { 1e-2 } else { 3e-4 };
        assert!(residual < most, "{engine}: {residual}");
    }
}
