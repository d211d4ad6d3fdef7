//! Compliant constraints that are too stiff, and tolerances that are too tight.

use proptest::prelude::*;
use twinrig_lcp::{Constraints, Lcp, Method, Options};
use twinrig_legged::Setup;
use twinrig_runtime::{Plant, PlantFault};
use twinrig_testing::robots::robot;
use twinrig_testing::trot::Trot;

use crate::harness::{Harness, hard_impact, standing_setup, suspended};

fn compliant(stiffness: f64, damping: f64, setup: &Setup, tolerance: f64) -> Harness {
    let mut robot = robot();
    for mount in &mut robot.legs {
        let compliance = mount.leg.compliance.unwrap();
        mount.leg.compliance = Some(compliance.scaled(stiffness, damping));
    }
    let options = Options {
        setup: setup.clone(),
        constraints: Constraints::Compliant,
        method: Method::Rk4,
        tolerance,
        toe: false,
        features: twinrig_lcp::Features::Detected,
    };
    Harness::new(Lcp::new(&robot, &options, &|_| true).unwrap())
}

/// Swings legs onto their stops for 40 ms.
fn swing(stiffness: f64, damping: f64, tolerance: f64) -> (Result<(), PlantFault>, Harness) {
    let mut harness = compliant(stiffness, damping, &suspended(hard_impact()), tolerance);
    let done = harness.run_checked(0.04);
    (done, harness)
}

#[test]
fn stiff_damper_is_refused_with_its_leg_and_a_remedy() {
    let setup = Trot::START.started(&robot(), standing_setup());
    let mut harness = compliant(1.0, 1e6, &setup, 1e-7);
    let fault = (1..20).find_map(|k| {
        harness.commands = Trot::START.commands(&robot(), &setup, 2e-3 * f64::from(k));
        harness.step().err()
    });
    let fault = fault.unwrap();
    assert!(fault.part.starts_with("leg/"), "{fault}");
    for part in ["too stiff", "1/s", "reduce"] {
        assert!(fault.why.contains(part), "{fault}");
    }
}

#[test]
fn tight_tolerance_is_not_taken_for_stiffness() {
    swing(1.0, 1.0, 2e-10).0.unwrap();
    let fault = swing(1.0, 1.0, 1e-17).0.unwrap_err();
    assert_eq!(fault.part, "integrator");
    assert!(fault.why.contains("tolerance of 1e-17 m"), "{fault}");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(12))]
    #[test]
    fn any_compliance_ends_in_bounded_work(stiffness in -3.0..7.0_f64, damping in -3.0..7.0_f64) {
        let power = |exponent| libm::pow(10.0, exponent);
        let (done, harness) = swing(power(stiffness), power(damping), 2e-6);
        let work = harness.plant.work();
        // A million substeps a second, and 200 a step.
        prop_assert!(work.steps + work.fallbacks <= 20 * 2200, "{work:?}");
        if let Err(fault) = done {
            prop_assert!(fault.why.contains("reduce") || fault.why.contains("choose"), "{fault}");
        }
    }
}
