//! Legs that are straight, too long, too short or have no mass; and starts that no leg can take.

use twinrig_kernel::SimDuration;
use twinrig_lcp::{Lcp, LcpError, Method, Options};
use twinrig_leg::{LegCommand, LegError, Pantograph, Planar};
use twinrig_legged::{Base, LeggedError, Setup};
use twinrig_robot::Robot;

use crate::scene::{DEFAULT, Scene, WAYS, built, changed, hanging, pose, robot, standing};

/// Why there is no such plant.
#[track_caller]
fn refusal(robot: &Robot, setup: &Setup) -> LcpError {
    match built(robot, setup, DEFAULT) {
        Err(error) => error,
        Ok(_) => panic!("it was built: {setup:?}"),
    }
}

#[test]
fn a_leg_that_is_all_but_straight_hangs_and_swings() {
    // ∂l_d/∂q̄₂ vanishes with q2_ref: the diagonal holds the knee with next to no lever. The shortest that is left must not
    // matter to how the leg moves.
    for start in [
        pose([10.0, 0.0, 0.0], [0.0; 3]),
        pose([10.0, -20.0, 30.0], [0.0; 3]),
    ] {
        for way in &WAYS[..5] {
            let feet = [1e-9, 1e-6].map(|q2_ref| {
                let straight = changed(|leg| leg.q2_ref = q2_ref);
                let mut scene = Scene::new(&straight, &hanging(start.clone()), *way);
                scene.soundly(0.2).unwrap();
                let balance = scene.energy();
                assert!(
                    balance.residual.abs() < 1e-2 * balance.exchanged,
                    "{way:?}: {balance:?}"
                );
                scene.read("leg/LF/foot/position")
            });
            let apart = (0..3).map(|i| (feet[0][i] - feet[1][i]).abs());
            let apart = apart.fold(0.0, f64::max);
            // A method that locates no events may meet a stop a step earlier or later.
            let bound = if way.method == Method::Moreau {
                5e-5
            } else {
                1e-5
            };
            assert!(apart < bound, "{way:?}: {apart:e}");
        }
    }
}

#[test]
fn a_leg_that_is_straight_is_refused() {
    let error = refusal(&changed(|leg| leg.q2_ref = 0.0), &standing());
    assert!(
        matches!(
            &error,
            LcpError::Legged(LeggedError::Leg {
                why: LegError::Geometry {
                    parameter: "q2_ref",
                    ..
                },
                ..
            })
        ),
        "{error}"
    );
}

#[test]
fn a_cable_that_no_knee_can_have_is_refused() {
    // l_c within |l1 − l2| … l1 + l2.
    let leg = &robot().legs[0].leg;
    let pantograph = Pantograph::new(leg).unwrap();
    let angle_of = |length: f64| (pantograph.cable_length(0.0) - length) / leg.pulley_radius;
    for length in [
        0.9 * (leg.l2 - leg.l1).abs(),
        1.1 * (leg.l1 + leg.l2),
        -1.0,
        f64::NAN,
    ] {
        let command = LegCommand {
            hip: 0.0,
            knee: angle_of(length),
        };
        let setup = Setup {
            start: vec![("RH".to_owned(), command)].into(),
            ..standing()
        };
        let error = refusal(&robot(), &setup);
        assert!(
            matches!(&error, LcpError::Legged(LeggedError::Leg { leg, .. }) if leg == "RH"),
            "{length}: {error}"
        );
    }
}

#[test]
fn a_foot_out_of_reach_has_no_command() {
    let pantograph = Pantograph::new(&robot().legs[0].leg).unwrap();
    for length in [
        1.01 * pantograph.length_max(),
        0.99 * pantograph.length_min(),
    ] {
        let error = pantograph
            .inverse_closed(Planar::new(0.0, -length))
            .unwrap_err();
        assert!(matches!(error, LegError::OutOfReach { .. }), "{error}");
    }
}

#[test]
fn a_start_beyond_a_stop_is_refused_by_how_much() {
    // Extended by 2°, opened by −3°, bottomed out.
    for (q, least, most) in [
        ([0.0, 2.0, 0.0], 1e-5, 2e-3),
        ([0.0, -20.0, 17.0], 0.5e-3, 1e-3),
        ([0.0, -100.0, 100.0], 1e-3, 2e-2),
    ] {
        let error = refusal(&robot(), &hanging(pose(q, [0.0; 3])));
        let LcpError::Legged(LeggedError::StartBeyondStop { leg, by, .. }) = &error else {
            panic!("{error}");
        };
        assert_eq!(leg, "LF");
        assert!((least..most).contains(by), "{q:?}: {error}");
        assert!(error.to_string().contains(&format!("{by:.6} m")), "{error}");
    }
}

#[test]
fn a_step_of_no_length_is_refused() {
    let setup = Setup {
        step: SimDuration::ZERO,
        ..standing()
    };
    let options = Options {
        setup,
        method: Method::Rk4,
        tolerance: Options::TOLERANCE,
        toe: false,
    };
    let error = Lcp::new(&robot(), &options, &|_| true).err().unwrap();
    assert!(
        matches!(error, LcpError::Legged(LeggedError::Step)),
        "{error}"
    );
}

#[test]
fn a_tolerance_that_is_none_is_refused() {
    for tolerance in [0.0, -1e-6, f64::NAN] {
        let error = built(&robot(), &standing(), DEFAULT.within(tolerance)).err();
        assert!(matches!(error, Some(LcpError::Tolerance(_))), "{error:?}");
    }
}

#[test]
fn masses_and_inertias_that_are_none_are_refused() {
    let mass = |error: &LcpError| matches!(error, LcpError::Legged(LeggedError::Mass { .. }));
    // Nothing at the end of the leg; or all that there is in one point of the line.
    for bare in [
        changed(|leg| (leg.mass.l3, leg.mass.foot) = (0.0, 0.0)),
        changed(|leg| leg.mass.foot = f64::NAN),
        changed(|leg| (leg.mass.l1, leg.mass.l2, leg.mass.l3) = (0.0, 0.0, 0.0)),
    ] {
        for base in [Base::Fixed, Base::Free] {
            let error = refusal(&bare, &Setup { base, ..standing() });
            assert!(mass(&error), "{error}");
        }
    }
    let trunks: [fn(&mut Robot); 4] = [
        |robot| robot.trunk.mass = 0.0,
        |robot| robot.trunk.mass = f64::INFINITY,
        |robot| robot.trunk.inertia[1] = 0.0,
        |robot| robot.trunk.inertia[2] = f64::NAN,
    ];
    for change in trunks {
        let mut robot = robot();
        change(&mut robot);
        for base in [Base::Free, Base::Planar] {
            let error = refusal(&robot, &Setup { base, ..standing() });
            assert!(mass(&error), "{error}");
        }
        // A trunk that is held needs none.
        let held = Setup {
            base: Base::Fixed,
            ..standing()
        };
        assert!(built(&robot, &held, DEFAULT).is_ok());
    }
}
