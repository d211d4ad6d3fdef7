//! Contact of trunk, knees and ankles in MuJoCo, and its refusal in Rapier.

use std::path::Path;

use twinrig::{Assembly, Execution, Registry, Report, execute};

use crate::of_command_line;

/// Runs the fall of `fall.toml` with these settings.
fn fall(settings: &[(&str, &str)]) -> Result<Report, String> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenarios/fall.toml");
    let registry = Registry::standard();
    let assembly = Assembly::builder(&registry)
        .settings(&of_command_line(settings))
        .file(&path)
        .map_err(|error| error.to_string())?;
    execute(&assembly, &Execution::default()).map_err(|error| error.to_string())
}

#[cfg(feature = "mujoco")]
#[test]
fn a_robot_that_falls_lies_on_the_ground_in_mujoco() {
    for coordinates in ["'minimal'", "'maximal'"] {
        let settings = [
            ("plant.model", "'mujoco'"),
            ("plant.coordinates", coordinates),
            ("plant.contacts", "'all'"),
            ("plant.step", "'0.5 ms'"),
        ];
        let report = fall(&settings).unwrap();
        for line in &report.expectations {
            println!("{coordinates} {:?}", line.outcome);
        }
        // The account of soft contacts.
        let energy = report.energy.unwrap();
        println!("{energy:?}");
    }
}

#[cfg(feature = "rapier")]
#[test]
fn contact_of_the_trunk_is_refused_in_rapier() {
    let refusal = fall(&[("plant.model", "'rapier'")]).unwrap_err();
    assert!(
        refusal.contains("`rapier` has contact at the feet only"),
        "{refusal}"
    );
}
