//! Straight legs, lengths out of range, zero masses, and invalid starts.

use twinrig_kernel::SimDuration;
use twinrig_lcp::{Lcp, LcpError, Method, Options};
use twinrig_legged::{Base, LeggedError, Setup};
use twinrig_robot::Robot;
use twinrig_robot::leg::{LegCommand, LegError, Pantograph, Planar};
use twinrig_testing::robots::{pose, robot, with_legs};

use crate::harness::{DEFAULT, INTEGRATIONS, build, lcp, standing_setup, suspended};

/// Returns the error of an invalid plant.
#[track_caller]
fn build_error(robot: &Robot, setup: &Setup) -> LcpError {
    match build(robot, setup, DEFAULT) {
        Err(error) => error,
        Ok(_) => panic!("unexpected success: {setup:?}"),
    }
}

#[test]
fn nearly_straight_leg_swings() {
    // ∂l_d/∂q̄₂ vanishes with q2_ref: the diagonal acts on the knee with a vanishing lever. The
    // size of the remaining lever must not affect the motion of the leg.
    for start in [
        pose([10.0, 0.0, 0.0], [0.0; 3]),
        pose([10.0, -20.0, 30.0], [0.0; 3]),
    ] {
        for integration in &INTEGRATIONS[..5] {
            let feet = [1e-9, 1e-6].map(|q2_ref| {
                let straight = with_legs(|leg| leg.q2_ref = q2_ref);
                let mut harness = lcp(&straight, &suspended(start.clone()), *integration);
                harness.run_checked(0.2).unwrap();
                let balance = harness.energy();
                assert!(
                    balance.residual.abs() < 1e-2 * balance.exchanged,
                    "{integration:?}: {balance:?}"
                );
                harness.read("leg/LF/foot/position")
            });
            let difference = (0..3).map(|i| (feet[0][i] - feet[1][i]).abs());
            let difference = difference.fold(0.0, f64::max);
            // A method without event location may reach a stop one step earlier or later.
            let bound = if integration.method == Method::Moreau {
                5e-5
            } else {
                1e-5
            };
            assert!(difference < bound, "{integration:?}: {difference:e}");
        }
    }
}

#[test]
fn straight_leg_is_rejected() {
    let error = build_error(&with_legs(|leg| leg.q2_ref = 0.0), &standing_setup());
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
fn unreachable_cable_length_is_rejected() {
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
            ..standing_setup()
        };
        let error = build_error(&robot(), &setup);
        assert!(
            matches!(&error, LcpError::Legged(LeggedError::Leg { leg, .. }) if leg == "RH"),
            "{length}: {error}"
        );
    }
}

#[test]
fn foot_out_of_reach_is_an_error() {
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
fn start_beyond_stop_is_rejected_with_distance() {
    // Extended by 2°, compressed by 3°, bottomed out.
    for (q, least, greatest) in [
        ([0.0, 2.0, 0.0], 1e-5, 2e-3),
        ([0.0, -20.0, 17.0], 0.5e-3, 1e-3),
        ([0.0, -100.0, 100.0], 1e-3, 2e-2),
    ] {
        let error = build_error(&robot(), &suspended(pose(q, [0.0; 3])));
        let LcpError::Legged(LeggedError::StartBeyondStop { leg, by, .. }) = &error else {
            panic!("{error}");
        };
        assert_eq!(leg, "LF");
        assert!((least..greatest).contains(by), "{q:?}: {error}");
        assert!(error.to_string().contains(&format!("{by:.6} m")), "{error}");
    }
}

#[test]
fn zero_step_is_rejected() {
    let setup = Setup {
        step: SimDuration::ZERO,
        ..standing_setup()
    };
    let options = Options {
        constraints: twinrig_lcp::Constraints::Rigid,
        setup,
        method: Method::Rk4,
        tolerance: Options::TOLERANCE,
        toe: false,
        features: twinrig_lcp::Features::Detected,
    };
    let error = Lcp::new(&robot(), &options, &|_| true).err().unwrap();
    assert!(
        matches!(error, LcpError::Legged(LeggedError::Step)),
        "{error}"
    );
}

#[test]
fn invalid_tolerance_is_rejected() {
    for tolerance in [0.0, -1e-6, f64::NAN] {
        let error = build(
            &robot(),
            &standing_setup(),
            DEFAULT.with_tolerance(tolerance),
        )
        .err();
        assert!(matches!(error, Some(LcpError::Tolerance(_))), "{error:?}");
    }
}

#[test]
fn invalid_masses_and_inertias_are_rejected() {
    let mass = |error: &LcpError| matches!(error, LcpError::Legged(LeggedError::Mass { .. }));
    // No mass at the end of the leg, a NaN mass, or all mass at one point.
    for invalid in [
        with_legs(|leg| (leg.mass.l3, leg.mass.foot) = (0.0, 0.0)),
        with_legs(|leg| leg.mass.foot = f64::NAN),
        with_legs(|leg| (leg.mass.l1, leg.mass.l2, leg.mass.l3) = (0.0, 0.0, 0.0)),
    ] {
        for base in [Base::Fixed, Base::Free] {
            let error = build_error(
                &invalid,
                &Setup {
                    base,
                    ..standing_setup()
                },
            );
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
            let error = build_error(
                &robot,
                &Setup {
                    base,
                    ..standing_setup()
                },
            );
            assert!(mass(&error), "{error}");
        }
        // A fixed trunk needs no mass.
        let fixed = Setup {
            base: Base::Fixed,
            ..standing_setup()
        };
        assert!(build(&robot, &fixed, DEFAULT).is_ok());
    }
}
