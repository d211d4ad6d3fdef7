//! Falls: simultaneous contacts of feet, stops and ground.

use twinrig_contact::{Ground, HeightField, Terrain};
use twinrig_kernel::SimDuration;
use twinrig_lcp::Method;
use twinrig_legged::{Base, Drives, Setup, StartPose};
use twinrig_robot::{GRAVITY, Servo};
use twinrig_runtime::{Plant, PlantEventKind};
use twinrig_testing::robots::{LEGS, SERVO, flat_ground, pose, robot, with_legs};

use crate::harness::{
    DEFAULT, Harness, INTEGRATIONS, Integration, lcp, lowered_ground, standing_setup,
};

fn drop(height: f64, friction: f64) -> Setup {
    Setup {
        ground: Some(lowered_ground(height, friction)),
        ..standing_setup()
    }
}

/// Runs for a duration, or until the rod of a rigid leg passes its dead centre, which is a fault of
/// that leg; returns whether it does not. Falls from 0.4 m take rods there.
fn keeps_mode(harness: &mut Harness, seconds: f64) -> bool {
    let Err(fault) = harness.run_checked(seconds) else {
        return true;
    };
    let is_rod = fault.part.starts_with("leg/") && fault.why.contains("the rod of the pantograph");
    assert!(is_rod, "{fault}");
    false
}

/// Returns the length of the diagonal of a leg \[m\].
fn diagonal(harness: &mut Harness, leg: &str) -> f64 {
    let sizes = &robot().legs[0].leg;
    let angles = harness.read(&format!("leg/{leg}/angles"));
    let (l2, ld) = (sizes.l2, sizes.l_delta);
    libm::sqrt(l2 * l2 + ld * ld + 2.0 * l2 * ld * libm::cos(angles[1] - angles[0]))
}

#[test]
fn fall_from_one_metre_bottoms_out_within_stops() {
    // Rods of ten times the stiffness stay on their side until the leg is bottomed.
    let robot = with_legs(|leg| leg.parallel.stiffness *= 10.0);
    let least = robot.legs[0].leg.diagonal_min;
    // Rigid hips, and legs without drives.
    let stiff = Drives::Servos {
        hip: Servo {
            torque: 40.0,
            ..SERVO
        },
        knee: SERVO,
    };
    for drives in [stiff, Drives::None] {
        // The stiffer spring is faster by √10, and the fixed step of the last method shorter.
        let semi_implicit = Integration::new(Method::SemiImplicit, 250);
        for integration in INTEGRATIONS[..3].iter().chain([&semi_implicit]) {
            let setup = Setup {
                drives: drives.clone(),
                ..drop(1.0, 0.6)
            };
            let mut harness = lcp(&robot, &setup, *integration);
            let mut shortest = f64::INFINITY;
            for _ in 0..300 {
                harness.run_checked(2e-3).unwrap();
                for leg in LEGS {
                    shortest = shortest.min(diagonal(&mut harness, leg));
                }
            }
            assert!(
                shortest > least - 2e-3,
                "{integration:?}: {shortest} of {least}"
            );
            assert!(
                drives == Drives::None || shortest < least + 2e-3,
                "{integration:?}: {shortest} of {least}"
            );
            let balance = harness.energy();
            assert!(
                balance.residual.abs() < 2e-2 * balance.exchanged,
                "{integration:?}: {balance:?}"
            );
            assert!(balance.impact > 0.5, "{integration:?}: {balance:?}");
        }
    }
}

#[test]
fn comparison_methods_complete_the_fall() {
    for integration in &INTEGRATIONS[4..] {
        let mut harness = lcp(&robot(), &drop(1.0, 0.6), *integration);
        keeps_mode(&mut harness, 0.6);
        assert!(harness.energy().impact > 0.5);
    }
}

#[test]
fn simultaneous_landings_are_located_together() {
    let mut harness = lcp(&robot(), &drop(0.1, 0.6), DEFAULT);
    harness.plant.log_events(true);
    harness.advance_to_ms(200);
    let events = harness.plant.events().iter();
    let landings =
        events.filter(|e| e.part.ends_with("ground") && e.kind == PlantEventKind::Reached);
    let landings: Vec<_> = landings.take(4).map(|e| e.at_s).collect();
    assert_eq!(landings.len(), 4);
    // The motors keep the legs in their pose: the robot falls as a rigid body.
    let expected = libm::sqrt(2.0 * 0.1 / 9.81);
    for at in landings {
        assert!((at - expected).abs() < 2e-3, "{at} of {expected}");
    }
}

#[test]
fn symmetric_landing_causes_no_roll_or_yaw() {
    for base in [Base::Free, Base::Planar] {
        for integration in &INTEGRATIONS[..4] {
            let mut harness = lcp(
                &robot(),
                &Setup {
                    base,
                    ..drop(0.1, 0.6)
                },
                *integration,
            );
            harness.run_checked(0.16).unwrap();
            let rpy = harness.read("body/rpy");
            let y = harness.read("body/position")[1];
            assert!(
                rpy[0].abs() + rpy[2].abs() + y.abs() < 1e-6,
                "{integration:?}: {rpy:?} {y}"
            );
            for [left, right] in [["LF", "RF"], ["LH", "RH"]] {
                let feet =
                    [left, right].map(|leg| harness.read(&format!("leg/{leg}/foot/position")));
                for axis in [0, 2] {
                    assert!(
                        (feet[0][axis] - feet[1][axis]).abs() < 1e-6,
                        "{integration:?}: {feet:?}"
                    );
                }
            }
        }
    }
}

#[test]
fn ground_forces_lie_in_friction_cone_from_ice_to_glue() {
    for friction in [0.0, 10.0] {
        for (integration, setup) in INTEGRATIONS[..4].iter().flat_map(|integration| {
            let stand = Setup {
                ground: Some(flat_ground(friction)),
                ..standing_setup()
            };
            [
                (integration, stand),
                (integration, drop(0.1, friction)),
                (integration, drop(1.0, friction)),
            ]
        }) {
            let mut harness = lcp(&robot(), &setup, *integration);
            for _ in 0..300 {
                harness.plant.begin_window();
                if !keeps_mode(&mut harness, 2e-3) {
                    break;
                }
                for leg in LEGS {
                    let force = harness.read(&format!("leg/{leg}/foot/force"));
                    let tangential = libm::hypot(force[0], force[1]);
                    assert!(force[2] > -1e-3, "{integration:?}: {force:?}");
                    assert!(
                        tangential <= friction * force[2] + 1e-2,
                        "{friction} {integration:?}: {force:?}"
                    );
                }
            }
        }
        // The comparison methods may report that no such forces exist.
        for integration in &INTEGRATIONS[4..] {
            let setup = drop(0.1, friction);
            let mut harness = lcp(&robot(), &setup, *integration);
            let _ = harness.run_checked(0.3);
        }
    }
}

/// The impact of another foot moves a sticking foot along the ground: its friction remains one
/// force, whose components must not be released separately like opening stops.
#[test]
fn friction_of_displaced_foot_remains_in_cone() {
    let robot = robot();
    let (hip, knee) = (robot.actuators.hip, robot.actuators.knee);
    let setup = Setup {
        drives: Drives::Servos { hip, knee },
        start: pose([40.1049, -7.82852, 7.82852], [0.0; 3]),
        ..drop(0.15, 0.6)
    };
    let mut harness = lcp(&robot, &setup, DEFAULT.with_toes());
    for _ in 0..150 {
        harness.plant.begin_window();
        harness.run_checked(2e-3).unwrap();
        for leg in LEGS {
            let force = harness.read(&format!("leg/{leg}/foot/force"));
            let tangential = libm::hypot(force[0], force[1]);
            assert!(
                tangential <= 0.6 * force[2] * (1.0 + 1e-6) + 1e-6,
                "{force:?}"
            );
        }
    }
}

#[test]
fn robot_stands_on_ice() {
    let setup = Setup {
        ground: Some(flat_ground(0.0)),
        ..standing_setup()
    };
    let mut harness = lcp(&robot(), &setup, DEFAULT);
    harness.run_checked(1.0).unwrap();
    assert_eq!(harness.plant.work().fallbacks, 0);
    assert!(harness.energy().kinetic < 1e-12);
}

#[test]
fn mean_ground_force_matches_impulse_over_window() {
    // The impulse balances weight and momentum, whatever the step size and the impacts within.
    const SECONDS: f64 = 0.3;
    let robot = robot();
    let mut mass = robot.trunk.mass;
    for mount in &robot.legs {
        let masses = &mount.leg.mass;
        mass += masses.l1 + masses.l2 + masses.l3 + masses.foot;
    }
    for integration in [
        DEFAULT,
        Integration::new(Method::Rk4, 500),
        Integration::new(Method::Rodas4, 2000),
        Integration::new(Method::Moreau, 2000),
        Integration::new(Method::Moreau, 500),
        Integration::new(Method::SemiImplicit, 1000),
        Integration::new(Method::SemiImplicit, 250),
        Integration::new(Method::ExplicitEuler, 50),
    ] {
        let mut harness = lcp(&robot, &drop(0.1, 0.6), integration);
        harness.plant.begin_window();
        harness.run_checked(SECONDS - 2e-3).unwrap();
        let before = harness.energy().gravity;
        harness.run_checked(2e-3).unwrap();
        let forces = LEGS.map(|leg| harness.read(&format!("leg/{leg}/foot/force"))[2]);
        let impulse = forces.iter().sum::<f64>() * SECONDS;
        let at = harness.energy().gravity;
        harness.run_checked(2e-3).unwrap();
        let weight = mass * 9.81;
        let momentum = mass * (harness.energy().gravity - before) / (4e-3 * weight);
        let expected = weight * SECONDS + momentum;
        assert!(at.is_finite());
        assert!(
            (impulse - expected).abs() < 1e-2 * expected,
            "{integration:?}: {impulse} of {expected}"
        );
    }
}

#[test]
fn trunks_with_zero_or_one_leg_fall() {
    for base in [Base::Free, Base::Planar, Base::Fixed] {
        for integration in &INTEGRATIONS[..4] {
            let none = Setup {
                base,
                legs: Vec::new(),
                ..standing_setup()
            };
            let mut harness = lcp(&robot(), &none, *integration);
            let start = harness.read("body/position")[2];
            harness.run_checked(0.1).unwrap();
            let distance = start - harness.read("body/position")[2];
            let expected = if base == Base::Fixed { 0.0 } else { 0.049_05 };
            assert!(
                (distance - expected).abs() < 1e-3,
                "{integration:?}: {distance}"
            );
            let one = Setup {
                base,
                legs: vec!["RH".to_owned()],
                ..standing_setup()
            };
            let mut harness = lcp(&robot(), &one, *integration);
            harness.run_checked(0.3).unwrap();
        }
    }
}

/// A foot slides until its friction presses it down by more than its normal force lifts it, which
/// no force solves (Painlevé's paradox). The normal mobility at the ground passes through zero at
/// 0.223 s; a tangential impact stops the slide there.
#[test]
fn jammed_foot_does_not_sink() {
    let setup = Setup {
        base: Base::Planar,
        legs: vec!["LF".to_owned()],
        drives: Drives::None,
        start: pose([-42.0758, -82.8063, 87.371], [0.0; 3]),
        ..drop(0.05, 0.6)
    };
    for method in [Method::Rk4, Method::Rodas4] {
        let integration = Integration::new(method, 100).with_toes();
        let mut harness = lcp(&robot(), &setup, integration);
        for _ in 0..260 {
            harness.run_checked(1e-3).unwrap();
            let clearance = harness.value("leg/LF/foot/clearance");
            assert!(
                clearance > -1e-6,
                "{method:?}: {clearance} at {} us",
                harness.now_us
            );
        }
        assert_eq!(harness.plant.work().fallbacks, 0, "{method:?}");
    }
}

#[test]
fn impacts_that_generate_energy_are_faults_with_every_method() {
    // A scenario cannot contain such a restitution; this simulates a defect.
    let mut setup = drop(0.05, 0.6);
    if let Some(ground) = &mut setup.ground {
        ground.restitution = 2.0;
    }
    for integration in INTEGRATIONS {
        let mut harness = lcp(&robot(), &setup, integration);
        let fault = harness.run_checked(0.3).unwrap_err();
        // The methods for comparison reject the restitution itself, or find the gain in a balance.
        let each_is_checked = matches!(
            integration.method,
            Method::Rk4 | Method::Rodas4 | Method::Moreau
        );
        assert!(
            !each_is_checked
                || fault.part.starts_with("leg/") && fault.why.contains("but can only dissipate"),
            "{integration:?}: {fault}"
        );
    }
}

/// Returns ground with these heights at points 5 cm apart, within `cells` of them in each
/// direction.
fn curved_ground(cells: u32, friction: f64, height: impl Fn([f64; 2]) -> f64) -> Ground {
    let at = |n: u32| 0.05 * (f64::from(n) - f64::from(cells));
    let side = 2 * cells + 1;
    let points = (0..side).flat_map(|row| (0..side).map(move |column| [at(column), at(row)]));
    let heights = points.map(height).collect();
    let field = HeightField::new([at(0); 2], 0.05, side as usize, heights).unwrap();
    Ground::new(Terrain::Heights(field), friction, 0.0).unwrap()
}

#[test]
fn feet_that_slide_through_a_trough_stay_on_its_ground() {
    // h = ½ x²/R, which the cubic spline of a height field reproduces: at 1 m/s its curvature
    // accelerates the feet by 1 m/s². Without this term feet sink by the ratio of this acceleration
    // to the square of the decay rate of constraint errors, 40 µm.
    const RADIUS: f64 = 0.5;
    let trough = |[x, _]: [f64; 2]| 0.5 * libm::pow(x - 0.3, 2.0) / RADIUS;
    let setup = Setup {
        ground: Some(curved_ground(10, 0.0, trough)),
        ..standing_setup()
    };
    for integration in &INTEGRATIONS[..2] {
        let mut harness = lcp(&robot(), &setup, *integration);
        let (mut least, mut fastest) = (0.0_f64, 0.0_f64);
        // Moreau's rule shifts overlaps instead.
        while harness.plant.work().fallbacks == 0 && fastest < 1.0 {
            for leg in LEGS {
                let clearance = harness.read(&format!("leg/{leg}/foot/clearance"))[0];
                least = least.min(clearance);
            }
            fastest = fastest.max(harness.read("body/velocity")[0]);
            harness.run_checked(2e-3).unwrap();
        }
        // The tolerance of a step. The Jacobian of `rodas4` has the slope of the ground and not its
        // curvature.
        assert!(
            fastest > 1.0 && least > -3e-7,
            "{integration:?}: {least:e} m"
        );
        let energy = harness.energy();
        assert!(
            energy.residual.abs() < 3e-5 * energy.exchanged,
            "{energy:?}"
        );
    }
}

#[test]
fn forces_across_a_planar_base_are_least() {
    // The three directions of a sticking foot have two degrees of freedom: across the slope no
    // force moves it. There the correction of an overlap of 1e-10 m was a force of 355 N.
    let slope = |[x, y]: [f64; 2]| 0.2 * x + 0.3 * y - 0.02;
    let setup = Setup {
        base: Base::Planar,
        ground: Some(curved_ground(4, 1.2, slope)),
        ..standing_setup()
    };
    let weight = robot().mass() * GRAVITY;
    for integration in &INTEGRATIONS[..2] {
        let mut harness = lcp(&robot(), &setup, *integration);
        for _ in 0..150 {
            harness.run_checked(2e-3).unwrap();
            for leg in LEGS {
                let force = harness.read(&format!("leg/{leg}/foot/force"));
                let force = libm::hypot(libm::hypot(force[0], force[1]), force[2]);
                assert!(force < weight, "{integration:?}: {force} N at {leg}");
            }
        }
    }
}

#[test]
fn slide_that_begins_on_curved_ground_is_no_fault() {
    // The robot tips over a foot, which moves by 20 nm before it slides. The work of its friction
    // is of either sign within the tolerance of the position.
    let mut ground = curved_ground(4, 0.842_814_924_691_706_2, |[x, y]| x * x + 0.1 * y);
    ground.restitution = 0.151_517_981_174_833_63;
    let servo = Servo {
        torque: 4.104_452_964_844_807,
        speed: 20.0,
        lag: 5e-3,
        dead_band: 0.0,
        ..SERVO
    };
    let q = [
        -0.494_229_827_420_128_55,
        -1.456_195_314_293_352_8,
        1.456_195_314_293_352_8,
    ];
    let setup = Setup {
        ground: Some(ground),
        step: SimDuration::from_micros(500),
        drives: Drives::Servos {
            hip: servo,
            knee: servo,
        },
        start: StartPose { q, rates: [0.0; 3] }.into(),
        ..standing_setup()
    };
    let mut harness = lcp(&robot(), &setup, Integration::new(Method::Rodas4, 500));
    let mut least = 0.0_f64;
    for _ in 0..200 {
        harness.run_checked(5e-4).unwrap();
        least = least.min(harness.energy().dissipated);
    }
    // Otherwise the motion is not the one of interest.
    assert!(least < -1e-8, "{least:e} J");
}
