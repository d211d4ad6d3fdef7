//! Detection of unstable step sizes.

use twinrig_lcp::Method;
use twinrig_legged::{Drives, Setup};
use twinrig_robot::Robot;
use twinrig_testing::robots::robot;

use crate::harness::{
    INTEGRATIONS, Integration, free_swinging_robot, hard_impact, lcp, lowered_ground,
    passive_start, standing_setup, suspended, swinging_start,
};

fn cases() -> Vec<(&'static str, Robot, Setup)> {
    let ground = Some(lowered_ground(0.1, 0.6));
    let drop = Setup {
        ground: ground.clone(),
        ..standing_setup()
    };
    let undriven = Setup {
        ground,
        drives: Drives::None,
        ..standing_setup()
    };
    vec![
        ("passive", robot(), suspended(passive_start())),
        ("hard", robot(), suspended(hard_impact())),
        (
            "between",
            free_swinging_robot(),
            suspended(swinging_start()),
        ),
        ("drop", robot(), drop),
        ("undriven", robot(), undriven),
    ]
}

/// Returns cause and time of the fault that ended a run, if any \[s\].
fn fault_of_run(
    robot: &Robot,
    setup: &Setup,
    integration: Integration,
    seconds: f64,
) -> Option<(String, f64)> {
    let mut harness = lcp(robot, setup, integration);
    let fault = harness.run_checked(seconds).err()?;
    // One unstable step may turn a leg beyond its assembly mode and keep the energy within the
    // bounds of the integrator's own check: the watch on the legs, whose fault names unstable steps
    // as a cause, is then the first to see it.
    let is_leg = fault.part.starts_with("leg/") && fault.why.contains("another mechanism");
    assert!(is_leg || fault.part == "integrator", "{fault}");
    assert!(fault.energy.is_finite());
    Some((fault.why, harness.now_us as f64 * 1e-6))
}

#[test]
fn unstable_steps_end_in_instability_fault() {
    for (name, robot, setup) in cases() {
        for (method, step_us) in [
            (Method::ExplicitEuler, 2000),
            (Method::ExplicitEuler, 5000),
            (Method::ExplicitEuler, 10_000),
            (Method::SemiImplicit, 10_000),
            (Method::SemiImplicit, 30_000),
            (Method::Thesis, 10_000),
            (Method::Thesis, 30_000),
        ] {
            let integration = Integration::new(method, step_us);
            let (cause, at) = fault_of_run(&robot, &setup, integration, 1.0)
                .unwrap_or_else(|| panic!("{name} by {integration:?} completed"));
            assert!(
                cause.contains("unstable"),
                "{name} by {integration:?}: {cause}"
            );
            // The fault must precede a plausible trajectory; a falling robot has to land first.
            let landing = if name == "drop" { 0.25 } else { 0.0 };
            assert!(at < landing + 0.1, "{name} by {integration:?}: {at} s");
        }
    }
}

#[test]
fn default_without_error_control_faults_at_unstable_step() {
    for (name, robot, setup) in &cases()[1..3] {
        let integration = Integration::new(Method::Rk4, 10_000).with_tolerance(f64::INFINITY);
        let (cause, _) = fault_of_run(robot, setup, integration, 1.0).unwrap();
        assert!(cause.contains("unstable"), "{name}: {cause}");
    }
}

#[test]
fn error_control_permits_any_step() {
    for (name, robot, setup) in &cases()[..3] {
        for method in [Method::Rk4, Method::Rodas4] {
            let ends = [2000, 50_000].map(|step_us| {
                let mut harness = lcp(robot, setup, Integration::new(method, step_us));
                harness.run_checked(0.3).unwrap();
                harness.read("leg/LF/foot/position")
            });
            for (a, b) in ends[0].iter().zip(&ends[1]) {
                assert!((a - b).abs() < 1e-5, "{name} by {method:?}: {a} and {b}");
            }
        }
    }
}

#[test]
fn suitable_steps_complete_without_fault() {
    let shorter = [
        Integration::new(Method::SemiImplicit, 2000),
        Integration::new(Method::ExplicitEuler, 100),
        Integration::new(Method::Thesis, 20),
    ];
    for (name, robot, setup) in cases() {
        for integration in INTEGRATIONS.iter().chain(&shorter) {
            let fault_of_run = fault_of_run(&robot, &setup, *integration, 0.5);
            assert_eq!(fault_of_run, None, "{name} by {integration:?}");
        }
    }
}
