//! Steps of an engine alone, without the balances and checks of its plant.

use std::path::Path;

use twinrig::Registry;
use twinrig::kernel::SimDuration;
use twinrig_experiment::StudyBuilder;

/// Returns the builder of a study of an engine in a scenario.
fn builder<'r>(
    registry: &'r Registry,
    scenario: &str,
    engine: &str,
    duration: SimDuration,
) -> StudyBuilder<'r> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenarios");
    let (path, names) = (path.join(scenario), [engine.to_owned()]);
    StudyBuilder::new(registry, &path, &[], &names, Some(duration)).unwrap()
}

#[cfg(feature = "mujoco")]
#[test]
fn steps_of_mujoco_alone_are_offered_and_the_same_run() {
    use twinrig_experiment::{PrecisionPlan, precision};

    let (registry, duration) = (twinrig::registry(), SimDuration::from_millis(100));
    let builder = builder(&registry, "passive-legs.toml", "mujoco", duration);
    let plan = PrecisionPlan {
        duration: Some(duration),
        steps: vec![SimDuration::from_millis(2)],
        tolerances: Vec::new(),
        masses: Vec::new(),
        ensemble: 0,
        repetitions: 1,
        budget_s: 1e9,
    };
    let study = precision(&builder, &plan, &mut ()).unwrap();
    let row = |method: &str| {
        let mut rows = study.rows.iter();
        rows.find(|row| row.method == method).unwrap()
    };
    for method in ["minimal, euler", "minimal, implicitfast", "minimal, rk4"] {
        let (complete, alone) = (row(method), row(&format!("{method}, step only")));
        let errors = [complete, alone].map(|row| row.error_rms_m.unwrap());
        assert!((errors[0] / errors[1] - 1.0).abs() < 1e-6, "{errors:?}");
        assert!(complete.energy_residual_j.is_some() && alone.energy_residual_j.is_none());
    }
}

#[cfg(feature = "rapier")]
#[test]
fn steps_of_rapier_alone_are_left_out_where_drives_are() {
    use twinrig_experiment::PlantFactory;

    let alone = |scenario| {
        let (registry, duration) = (twinrig::registry(), SimDuration::from_millis(10));
        let builder = builder(&registry, scenario, "rapier", duration);
        let methods = builder.plants()[0].methods.iter();
        let reasons = builder.left_out().iter();
        let offered = methods.filter(|method| method.step_only).count();
        (
            offered,
            reasons.filter(|why| why.contains("step only")).count(),
        )
    };
    assert_eq!(alone("passive-legs.toml"), (3, 0));
    assert_eq!(alone("trot.toml"), (0, 3));
}
