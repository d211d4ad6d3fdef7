//! Springs and masses of other sizes; and none of the friction that hides errors.

use twinrig_lcp::Method;

use crate::scene::{
    DEFAULT, Scene, WAYS, Way, between, changed, hanging, hard, passive, rmse, standing, stiffened,
    swinging,
};

#[test]
fn legs_of_a_millionth_of_their_mass_relax_as_springs_without_mass_do() {
    let light = changed(|leg| {
        let mass = &mut leg.mass;
        for part in [&mut mass.l1, &mut mass.l2, &mut mass.l3, &mut mass.foot] {
            *part *= 1e-6;
        }
    });
    for start in [passive(), swinging()] {
        let setup = hanging(start);
        let exact = Way::by(Method::Rodas4, 2000).within(1e-11);
        let right = Scene::new(&light, &setup, exact).trace("LF", 100);
        for way in &WAYS[..2] {
            let mut scene = Scene::new(&light, &setup, *way);
            scene.soundly(0.0).unwrap();
            let error = rmse(&scene.trace("LF", 100), &right);
            assert!(error < 1e-5, "{way:?}: {error:e}");
            // The default leaves such a leg to the stiff method, and says so.
            let fallbacks = twinrig_runtime::Plant::work(&scene.plant).fallbacks;
            assert_eq!(fallbacks > 40, way.method == Method::Rk4, "{fallbacks}");
        }
        // Methods of fixed steps cannot; they say so, or have it right in the end.
        for way in &WAYS[2..] {
            let mut scene = Scene::new(&light, &setup, *way);
            if scene.soundly(0.1).is_ok() {
                let foot = scene.read("leg/LF/foot/position");
                let apart = (0..3).map(|i| (foot[i] - right[49][i]).abs());
                assert!(apart.fold(0.0, f64::max) < 1e-3, "{way:?}: {foot:?}");
            }
        }
    }
}

#[test]
fn springs_of_any_stiffness_move_legs_or_say_why_not() {
    for times in [1e-2, 1e-1, 1.0, 1e1, 1e2, 1e3, 1e4] {
        let robot = stiffened(times);
        let setup = hanging(hard());
        let exact = Way::by(Method::Rodas4, 2000).within(1e-11);
        let right = Scene::new(&robot, &setup, exact).trace("LF", 200);
        for way in &WAYS[..2] {
            let error = rmse(&Scene::new(&robot, &setup, *way).trace("LF", 200), &right);
            assert!(error < 1e-4, "× {times} by {way:?}: {error:e}");
        }
        for way in &WAYS[2..5] {
            let mut scene = Scene::new(&robot, &setup, *way);
            let through = scene.soundly(0.2).is_ok();
            assert!(through || times > 1.0, "× {times} by {way:?}");
            let balance = scene.energy();
            assert!(
                !through || balance.residual < 0.1 * balance.exchanged + 1e-2,
                "× {times} by {way:?}: {balance:?}"
            );
        }
        for way in WAYS {
            // On its feet: springs a thousand times as stiff throw the robot into the air.
            let mut scene = Scene::new(&robot, &standing(), way);
            let through = scene.soundly(0.2).is_ok();
            assert!(
                through || times > 1e2 || (times > 1e1 && way.method != Method::Rk4),
                "× {times} by {way:?}"
            );
        }
    }
}

/// Explicit steps at their limit of stability: velocities oscillate about the solution while positions follow it.
#[test]
fn the_energy_balance_closes_under_strong_joint_friction() {
    let damped = changed(|leg| {
        let friction = &mut leg.joint_friction;
        for joint in [&mut friction.hip, &mut friction.knee, &mut friction.ankle] {
            *joint = 1.0;
        }
    });
    let dissipated = |way: Way| {
        let mut scene = Scene::new(&damped, &hanging(hard()), way);
        scene.soundly(0.2).unwrap();
        let energy = scene.energy();
        let share = energy.residual / energy.exchanged;
        assert!(share.abs() < 1e-6, "{way:?}: {share:e}");
        energy.dissipated
    };
    let right = dissipated(Way::by(Method::Rodas4, 2000).within(1e-11));
    for step_us in [100, 500, 2000] {
        let error = dissipated(Way::by(Method::Rk4, step_us)) / right - 1.0;
        assert!(error.abs() < 1e-5, "{step_us} us: {error:e}");
    }
}

#[test]
fn without_friction_energy_stays_for_twenty_seconds() {
    let mut robot = between();
    for mount in &mut robot.legs {
        let friction = &mut mount.leg.joint_friction;
        for joint in [&mut friction.hip, &mut friction.knee, &mut friction.ankle] {
            *joint = 0.0;
        }
        mount.leg.parallel_travel = 0.02;
    }
    for (way, most) in [
        (DEFAULT.within(1e-9), 3e-5),
        (Way::by(Method::Rodas4, 2000).within(1e-8), 1e-5),
        (DEFAULT, 2e-2),
        // Symplectic for constant inertia alone: legs that bend gain by them.
        (Way::by(Method::Moreau, 500), 0.3),
        (Way::by(Method::SemiImplicit, 500), 0.3),
    ] {
        let mut scene = Scene::new(&robot, &hanging(swinging()), way);
        let start = scene.energy().stored();
        let mut greatest = 0.0_f64;
        for ms in (10..=20_000).step_by(10) {
            scene.to_ms(ms);
            greatest = greatest.max(scene.energy().kinetic);
        }
        let balance = scene.energy();
        assert_eq!(
            [balance.dissipated, balance.impact, balance.actuator],
            [0.0; 3]
        );
        let drift = (balance.stored() - start) / greatest;
        assert!(drift.abs() < most, "{way:?}: {drift:e}");
    }
}
