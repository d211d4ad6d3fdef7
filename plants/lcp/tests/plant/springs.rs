//! Extreme spring stiffnesses and masses, and motion without friction.

use twinrig_lcp::Method;
use twinrig_testing::robots::with_legs;

use crate::harness::{
    DEFAULT, INTEGRATIONS, Integration, free_swinging_robot, hard_impact, lcp, passive_start, rmse,
    standing_setup, suspended, swinging_start, with_stiffness,
};

#[test]
fn legs_of_a_millionth_of_the_mass_follow_stiff_reference() {
    let light_robot = with_legs(|leg| {
        let mass = &mut leg.mass;
        for part in [&mut mass.l1, &mut mass.l2, &mut mass.l3, &mut mass.foot] {
            *part *= 1e-6;
        }
    });
    for start in [passive_start(), swinging_start()] {
        let setup = suspended(start);
        let exact = Integration::new(Method::Rodas4, 2000).with_tolerance(1e-11);
        let reference = lcp(&light_robot, &setup, exact).trace("LF", 100);
        for integration in &INTEGRATIONS[..2] {
            let mut harness = lcp(&light_robot, &setup, *integration);
            harness.run_checked(0.0).unwrap();
            let error = rmse(&harness.trace("LF", 100), &reference);
            assert!(error < 1e-5, "{integration:?}: {error:e}");
            // The default method falls back to the stiff method for such legs and counts the
            // fallbacks.
            let fallbacks = twinrig_runtime::Plant::work(&harness.plant).fallbacks;
            assert_eq!(
                fallbacks > 40,
                integration.method == Method::Rk4,
                "{fallbacks}"
            );
        }
        // Methods with fixed steps fail with a fault or have the correct final state.
        for integration in &INTEGRATIONS[2..] {
            let mut harness = lcp(&light_robot, &setup, *integration);
            if harness.run_checked(0.1).is_ok() {
                let foot = harness.read("leg/LF/foot/position");
                let differences = (0..3).map(|i| (foot[i] - reference[49][i]).abs());
                assert!(
                    differences.fold(0.0, f64::max) < 1e-3,
                    "{integration:?}: {foot:?}"
                );
            }
        }
    }
}

#[test]
fn legs_of_any_spring_stiffness_move_or_fault() {
    for times in [1e-2, 1e-1, 1.0, 1e1, 1e2, 1e3, 1e4] {
        let robot = with_stiffness(times);
        let setup = suspended(hard_impact());
        let exact = Integration::new(Method::Rodas4, 2000).with_tolerance(1e-11);
        let reference = lcp(&robot, &setup, exact).trace("LF", 200);
        for integration in &INTEGRATIONS[..2] {
            let error = rmse(
                &lcp(&robot, &setup, *integration).trace("LF", 200),
                &reference,
            );
            assert!(error < 1e-4, "× {times} by {integration:?}: {error:e}");
        }
        for integration in &INTEGRATIONS[2..5] {
            let mut harness = lcp(&robot, &setup, *integration);
            let completed = harness.run_checked(0.2).is_ok();
            assert!(completed || times > 1.0, "× {times} by {integration:?}");
            let balance = harness.energy();
            assert!(
                !completed || balance.residual < 0.1 * balance.exchanged + 1e-2,
                "× {times} by {integration:?}: {balance:?}"
            );
        }
        for integration in INTEGRATIONS {
            // On its feet: springs of a thousandfold stiffness throw the robot into the air.
            let mut harness = lcp(&robot, &standing_setup(), integration);
            let completed = harness.run_checked(0.2).is_ok();
            assert!(
                completed || times > 1e2 || (times > 1e1 && integration.method != Method::Rk4),
                "× {times} by {integration:?}"
            );
        }
    }
}

/// Explicit steps at the stability limit: velocities oscillate about the solution while positions
/// follow it.
#[test]
fn energy_balance_closes_under_strong_joint_friction() {
    let damped_robot = with_legs(|leg| {
        let friction = &mut leg.joint_friction;
        for joint in [&mut friction.hip, &mut friction.knee, &mut friction.ankle] {
            *joint = 1.0;
        }
    });
    let dissipated = |integration: Integration| {
        let mut harness = lcp(&damped_robot, &suspended(hard_impact()), integration);
        harness.run_checked(0.2).unwrap();
        let energy = harness.energy();
        let share = energy.residual / energy.exchanged;
        assert!(share.abs() < 1e-6, "{integration:?}: {share:e}");
        energy.dissipated
    };
    let reference = dissipated(Integration::new(Method::Rodas4, 2000).with_tolerance(1e-11));
    for step_us in [100, 500, 2000] {
        let error = dissipated(Integration::new(Method::Rk4, step_us)) / reference - 1.0;
        assert!(error.abs() < 1e-5, "{step_us} us: {error:e}");
    }
}

#[test]
fn energy_is_conserved_for_twenty_seconds_without_friction() {
    let mut robot = free_swinging_robot();
    for mount in &mut robot.legs {
        let friction = &mut mount.leg.joint_friction;
        for joint in [&mut friction.hip, &mut friction.knee, &mut friction.ankle] {
            *joint = 0.0;
        }
        mount.leg.parallel_travel = 0.02;
    }
    for (integration, bound) in [
        (DEFAULT.with_tolerance(1e-9), 3e-5),
        (
            Integration::new(Method::Rodas4, 2000).with_tolerance(1e-8),
            1e-5,
        ),
        (DEFAULT, 2e-2),
        // Symplectic for constant inertia only: bending legs gain energy.
        (Integration::new(Method::Moreau, 500), 0.3),
        (Integration::new(Method::SemiImplicit, 500), 0.3),
    ] {
        let mut harness = lcp(&robot, &suspended(swinging_start()), integration);
        let start = harness.energy().stored();
        let mut greatest = 0.0_f64;
        for ms in (10..=20_000).step_by(10) {
            harness.advance_to_ms(ms);
            greatest = greatest.max(harness.energy().kinetic);
        }
        let balance = harness.energy();
        assert_eq!(
            [balance.dissipated, balance.impact, balance.actuator],
            [0.0; 3]
        );
        let drift = (balance.stored() - start) / greatest;
        assert!(drift.abs() < bound, "{integration:?}: {drift:e}");
    }
}
