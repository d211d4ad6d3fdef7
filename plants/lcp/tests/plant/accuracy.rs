//! Accuracy of the foot over 0.3 s at steps of 2 ms.

use twinrig_lcp::Method;
use twinrig_legged::Start;
use twinrig_robot::Robot;
use twinrig_runtime::Plant;
use twinrig_testing::robots::robot;

use crate::harness::{
    DEFAULT, Integration, free_swinging_robot, hard_impact, lcp, passive_start, rmse, suspended,
    swinging_start, with_stiffness,
};

/// Reference method, independent of the errors of the default.
const EXACT: Integration = Integration::new(Method::Rodas4, 2000).with_tolerance(1e-12);

/// Returns the error of the first leg's foot \[m\].
fn error(robot: &Robot, start: &Start, integration: Integration) -> f64 {
    let setup = suspended(start.clone());
    let reference = lcp(robot, &setup, EXACT).trace("LF", 300);
    let mut harness = lcp(robot, &setup, integration);
    let feet = harness.trace("LF", 300);
    assert_eq!(harness.plant.work().fallbacks, 0);
    rmse(&feet, &reference)
}

#[test]
fn reference_agrees_with_short_steps_of_another_method() {
    let short = Integration::new(Method::Rk4, 10).with_tolerance(f64::INFINITY);
    for (robot, start) in [
        (robot(), passive_start()),
        (robot(), hard_impact()),
        (free_swinging_robot(), swinging_start()),
        (with_stiffness(100.0), passive_start()),
        (with_stiffness(100.0), hard_impact()),
    ] {
        let error = error(&robot, &start, short);
        assert!(error < 1e-9, "{error:e}");
    }
}

#[test]
fn error_of_free_swinging_legs_is_below_two_micrometres() {
    let error = error(&free_swinging_robot(), &swinging_start(), DEFAULT);
    assert!(error < 2e-6, "{error:e}");
}

#[test]
fn error_of_legs_at_stops_is_below_one_micrometre() {
    for start in [passive_start(), hard_impact()] {
        let error = error(&robot(), &start, DEFAULT);
        assert!(error < 1e-6, "{error:e}");
    }
}

#[test]
fn error_up_to_hundredfold_stiffness_is_below_ten_micrometres() {
    for times in [1.0, 3.0, 10.0, 30.0, 100.0] {
        // Preload with equal force at the stops, or with equal length.
        let mut loaded = with_stiffness(times);
        for mount in &mut loaded.legs {
            mount.leg.diagonal.preload *= times;
            mount.leg.parallel.preload *= times;
        }
        for robot in [with_stiffness(times), loaded] {
            for start in [passive_start(), hard_impact()] {
                let error = error(&robot, &start, DEFAULT);
                assert!(error < 1e-5, "stiffness × {times}: {error:e}");
            }
        }
    }
}

#[test]
fn error_of_stiff_method_at_tight_tolerance_is_below_ten_nanometres() {
    for (robot, start) in [
        (robot(), passive_start()),
        (robot(), hard_impact()),
        (free_swinging_robot(), swinging_start()),
    ] {
        let error = error(
            &robot,
            &start,
            Integration::new(Method::Rodas4, 2000).with_tolerance(1e-8),
        );
        assert!(error < 1e-8, "{error:e}");
    }
}

#[test]
fn plain_motions_need_few_evaluations() {
    // Five evaluations per step, and at most a fifth more where stops are located and reached.
    for (robot, start) in [(robot(), passive_start()), (robot(), hard_impact())] {
        let mut harness = lcp(&robot, &suspended(start), DEFAULT);
        harness.advance_to_ms(300);
        let work = harness.plant.work();
        assert!(work.evaluations < 6 * work.steps + 50, "{work:?}");
    }
}
