//! Extreme inputs: a typed error or the right outcome, never a NaN, never a hang.

use twinrig_contact::{Ground, HeightField, Terrain};
use twinrig_kernel::SimDuration;
use twinrig_legged::{Base, Drives, LeggedError, Setup};
use twinrig_massless::{Force, Massless, MasslessError, Options};
use twinrig_robot::Robot;
use twinrig_robot::leg::LegCommand;
use twinrig_runtime::Plant;
use twinrig_testing::plant_harness::at_ms;
use twinrig_testing::robots::{LEGS, robot, robot_named};
use twinrig_testing::trot::Trot;

use super::harness::{Harness, massless, setup, with_force};

fn ground(terrain: Terrain, friction: f64) -> Ground {
    Ground::new(terrain, friction, 0.0).unwrap()
}

/// Setup for a fall of `height` metres onto all feet at once.
fn falling(height: f64, setup: &Setup) -> Setup {
    let terrain = Terrain::step_down(-10.0, height);
    let friction = setup.ground.as_ref().map_or(0.6, |ground| ground.friction);
    Setup {
        ground: Some(ground(terrain, friction)),
        ..setup.clone()
    }
}

/// Advances until a fault; no output may be NaN or infinite.
fn run(harness: &mut Harness, from_ms: u64, to_ms: u64) -> bool {
    for ms in from_ms + 1..=to_ms {
        let before = harness.observe().to_vec();
        let outcome = harness.try_advance_to_us(1000 * ms);
        assert!(
            harness.observe().iter().all(|x| x.is_finite()),
            "at {ms} ms"
        );
        if let Err(fault) = outcome {
            assert_eq!(fault.time, at_ms(ms - 1));
            assert_eq!(harness.observe(), before, "the state is unchanged");
            assert!(!fault.why.is_empty() && !fault.part.is_empty(), "{fault:?}");
            return false;
        }
    }
    true
}

#[test]
fn robot_starts_on_ground_above_zero_without_penetration() {
    let heights = vec![0.05; 16];
    let plateau = HeightField::new([-1.0, -1.0], 1.0, 4, heights).unwrap();
    for base in [Base::Free, Base::Planar, Base::Fixed] {
        let setup = Setup {
            base,
            ground: Some(ground(Terrain::Heights(plateau.clone()), 0.6)),
            ..setup()
        };
        let mut harness = massless(&robot(), &setup);
        let clearance = harness.value("leg/LF/foot/clearance");
        assert!(clearance.abs() < 1e-12, "{base:?}: {clearance}");
        // Recovery from an overlap would generate energy: a negative impact loss.
        assert!(run(&mut harness, 0, 100));
        assert!(harness.plant.energy().impact > -1e-9);
        assert!(harness.plant.work().events >= 1, "feet touch down");
    }
}

#[test]
fn simultaneous_landing_of_four_feet_is_symmetric() {
    for (height, landing_ms) in [(0.05_f64, 100), (0.3, 247), (1.0, 451)] {
        let mut harness = massless(&robot(), &falling(height, &setup()));
        let feet = LEGS.map(|leg| harness.read(&format!("leg/{leg}/foot/position")));
        assert!(feet.iter().all(|foot| foot[2].abs() < 1e-12));
        for leg in LEGS {
            let clearance = harness.value(&format!("leg/{leg}/foot/clearance"));
            assert!((clearance - height).abs() < 1e-12, "{clearance}");
        }
        // Until just before the landing at √(2 height / g).
        assert!(run(&mut harness, 0, landing_ms), "{height} m");
        let fallen = 0.5 * 9.81 * (landing_ms as f64 * 1e-3) * (landing_ms as f64 * 1e-3);
        let foot = harness.read("leg/LF/foot/position")[2];
        assert!((foot + fallen).abs() < 1e-9, "it fell {foot}, not {fallen}");
        harness.plant.begin_window();
        assert!(run(&mut harness, landing_ms, landing_ms + 3), "{height} m");
        let loads = LEGS.map(|leg| harness.value(&format!("leg/{leg}/foot/load")));
        assert!(loads[0] > 1.0);
        // Left and right carry the same load, but not fore and hind: the knees bend backwards.
        assert!((loads[0] - loads[1]).abs() < 1e-6 * loads[0], "{loads:?}");
        assert!((loads[2] - loads[3]).abs() < 1e-6 * loads[2], "{loads:?}");
        // Afterwards it lies or stands, and the energy balance closes. After a fall of a metre a
        // leg folds flat, which no stop prevents: a fault.
        if !run(&mut harness, landing_ms + 3, landing_ms + 500) {
            assert_eq!(height, 1.0);
            continue;
        }
        let balance = harness.energy();
        assert!(
            balance.residual.abs() < 1e-5 * balance.exchanged,
            "{balance:?}"
        );
        assert!(
            balance.kinetic < 0.5 * 1.1 * 2.0 * 9.81 * height,
            "{balance:?}"
        );
    }
}

/// x of the mass centre of trunk (with the masses at its hips) and feet.
fn centre_x(harness: &mut Harness) -> f64 {
    let feet = LEGS.map(|leg| harness.read(&format!("leg/{leg}/foot/position"))[0]);
    (0.98 * harness.read("body/position")[0] + 0.03 * feet.iter().sum::<f64>()) / 1.1
}

#[test]
fn trot_on_zero_and_very_high_friction_closes_its_energy_balance() {
    let robot = robot();
    for friction in [0.0, 10.0] {
        let mut setup = setup();
        setup.ground = Some(ground(Terrain::Flat, friction));
        setup.start = Trot::START.legs(&robot, &setup, 0.0).into();
        let mut harness = massless(&robot, &setup);
        for ms in 1..=400 {
            harness.trot(&robot, &setup, Trot::START, ms);
            harness
                .observe()
                .iter()
                .for_each(|x| assert!(x.is_finite()));
            if friction == 0.0 {
                for leg in LEGS {
                    let force = harness.read(&format!("leg/{leg}/foot/force"));
                    assert!(force[0].abs() < 1e-9 && force[1].abs() < 1e-9, "{force:?}");
                }
            }
        }
        let balance = harness.energy();
        assert!(
            balance.residual.abs() < 1e-5 * balance.exchanged,
            "{friction}: {balance:?}"
        );
        if friction == 0.0 {
            // There is no external horizontal force: the mass centre of trunk and feet stays in
            // place.
            let now = centre_x(&mut harness);
            let then = centre_x(&mut massless(&robot, &setup));
            assert!((now - then).abs() < 1e-6, "{now} {then}");
        }
    }
}

/// Error on construction of the plant.
#[track_caller]
fn build_error(robot: &Robot, setup: &Setup) -> MasslessError {
    let options = Options::new(setup.clone(), Force::Solve);
    match Massless::new(robot, &options, &|_| true) {
        Err(error) => error,
        Ok(_) => panic!("construction succeeded: {:?}", setup.start),
    }
}

#[test]
fn start_out_of_reach_is_an_error_that_names_the_leg() {
    let mut setup = setup();
    let mut start = |hip, knee| {
        let command = LegCommand { hip, knee };
        setup.start = vec![("RH".to_owned(), command)].into();
        build_error(&robot(), &setup)
    };
    let error = start(0.0, 9.0);
    assert!(
        matches!(&error, MasslessError::Setup(LeggedError::Leg { leg, .. }) if leg == "RH"),
        "{error}"
    );
    // Within reach of the cable, but 7 mm beyond the bottom of the diagonal.
    let error = start(0.0, 2.8);
    assert!(
        matches!(&error, MasslessError::Setup(LeggedError::StartBeyondStop { by, .. }) if *by > 1e-3),
        "{error}"
    );
    start(0.0, f64::NAN);
    start(f64::INFINITY, 0.0);
}

#[test]
fn invalid_robots_and_setups_are_rejected_with_typed_errors() {
    let error_after = |change: &dyn Fn(&mut Robot, &mut Setup)| {
        let (mut robot, mut setup) = (robot(), setup());
        change(&mut robot, &mut setup);
        build_error(&robot, &setup)
    };
    let error = error_after(&|_, o| o.legs.push("XX".to_owned()));
    assert!(
        matches!(error, MasslessError::Setup(LeggedError::NoSuchLeg { .. })),
        "{error}"
    );
    let error = error_after(&|_, o| o.legs.push("LF".to_owned()));
    assert!(
        matches!(error, MasslessError::Setup(LeggedError::Legs(_))),
        "{error}"
    );
    let error = error_after(&|_, o| o.step = SimDuration::ZERO);
    assert!(
        matches!(error, MasslessError::Setup(LeggedError::Step)),
        "{error}"
    );
    let error = error_after(&|r, _| r.legs[1].leg.mass.lumped_foot = 0.0);
    assert!(
        matches!(error, MasslessError::Setup(LeggedError::Mass { .. })),
        "{error}"
    );
    let error = error_after(&|r, _| r.trunk.mass = -3.0);
    assert!(
        matches!(error, MasslessError::Setup(LeggedError::Mass { .. })),
        "{error}"
    );
    let error = error_after(&|r, _| r.legs[2].leg.l1 = 0.0);
    assert!(
        matches!(&error, MasslessError::Setup(LeggedError::Leg { leg, .. }) if leg == "LH"),
        "{error}"
    );
    let error = error_after(&|_, o| o.drives = Drives::Ideal { period: 0.0 });
    assert!(
        matches!(error, MasslessError::Setup(LeggedError::Servo { .. })),
        "{error}"
    );
    for inertia in [
        [0.0, 1e-3, 1e-3],
        [1e-3, f64::NAN, 1e-3],
        [1e-3, 1e-3, -1e-3],
    ] {
        // Without masses at the hips, which would add to the trunk's inertia.
        let error = error_after(&|r, _| {
            r.trunk.inertia = inertia;
            for mount in &mut r.legs {
                mount.hip = [0.0; 3];
            }
        });
        assert!(error.to_string().contains("inertia"), "{error}");
    }
}

#[test]
fn trot_at_a_step_of_ten_milliseconds_stays_bounded() {
    let robot = robot();
    let mut setup = Setup {
        step: SimDuration::from_millis(10),
        ..setup()
    };
    setup.start = Trot::START.legs(&robot, &setup, 0.0).into();
    let mut harness = massless(&robot, &setup);
    for ms in (10..=1000).step_by(10) {
        harness.trot(&robot, &setup, Trot::START, ms);
        assert!(harness.observe().iter().all(|x| x.is_finite()));
    }
    let balance = harness.energy();
    assert!(
        balance.residual.abs() < 1e-3 * balance.exchanged,
        "{balance:?}"
    );
    let height = harness.read("body/position")[2];
    assert!((0.0..0.2).contains(&height), "{height}");
}

#[test]
fn trunk_without_legs_falls_freely_and_one_leg_is_accepted() {
    for base in [Base::Free, Base::Planar, Base::Fixed] {
        let none = Setup {
            base,
            legs: Vec::new(),
            ..setup()
        };
        let mut harness = massless(&robot(), &none);
        let start = harness.read("body/position")[2];
        harness.advance_to_ms(100);
        let z = harness.read("body/position")[2];
        let expected = if base == Base::Fixed {
            0.0
        } else {
            0.5 * 9.81 * 0.01
        };
        assert!((start - z - expected).abs() < 1e-12, "{z}");
        let one = Setup {
            base,
            legs: vec!["RH".to_owned()],
            ..setup()
        };
        let mut harness = massless(&robot(), &one);
        run(&mut harness, 0, 500);
    }
}

#[test]
fn oncilla_stands_at_its_start_height() {
    let robot = robot_named("oncilla");
    for force in [Force::Solve, Force::Lookup { cells: 32 }] {
        let mut harness = with_force(&robot, &setup(), force);
        let height = harness.read("body/position")[2];
        harness.advance_to_ms(1000);
        let (position, rpy) = (harness.read("body/position"), harness.read("body/rpy"));
        assert!((position[2] - height).abs() < 0.1 * height, "{position:?}");
        assert!(rpy.iter().all(|angle| angle.abs() < 0.05), "{rpy:?}");
    }
}

#[test]
fn cable_wound_beyond_reach_stalls_its_drive() {
    // The leg bottoms out and the drive pulls at its greatest torque without damage. A drive
    // without a torque limit must end in a fault or hold.
    let mut setup = Setup {
        base: Base::Fixed,
        ground: None,
        ..setup()
    };
    let mut harness = massless(&robot(), &setup);
    for pair in harness.commands.chunks_mut(2) {
        pair[1] = 10.0;
    }
    assert!(run(&mut harness, 0, 500));
    for leg in LEGS {
        let torque = harness.value(&format!("leg/{leg}/knee/torque"));
        assert!((torque - 4.0).abs() < 1e-6, "{torque}");
        let length = {
            let foot = harness.read(&format!("leg/{leg}/foot/position"));
            let body = harness.read("body/position");
            body[2] - foot[2]
        };
        assert!(length > 0.05, "{length}");
    }
    // The drive's inertia oscillates against the stop; the cable's mean tension corresponds to the
    // drive's torque.
    let mean: f64 = (501..=900)
        .map(|ms| {
            harness.advance_to_ms(ms);
            harness.value("leg/LF/cable/tension") / 400.0
        })
        .sum();
    assert!((mean - 4.0 / 0.025).abs() < 0.01 * mean, "{mean}");
    setup.drives = Drives::Ideal { period: 5e-3 };
    let mut harness = massless(&robot(), &setup);
    for pair in harness.commands.chunks_mut(2) {
        pair[1] = 10.0;
    }
    run(&mut harness, 0, 1000);
}

#[test]
fn non_finite_command_is_a_fault_that_leaves_the_plant_unchanged() {
    for (place, bad) in [
        (0, f64::NAN),
        (3, f64::NAN),
        (1, f64::INFINITY),
        (2, f64::NEG_INFINITY),
    ] {
        let mut harness = massless(&robot(), &setup());
        harness.advance_to_ms(10);
        let before = harness.observe().to_vec();
        let mut commands = harness.commands.clone();
        commands[place] = bad;
        let fault = harness.plant.advance(at_ms(20), &commands).unwrap_err();
        assert_eq!(fault.time, at_ms(10), "{fault}");
        let drive = ["hip", "knee"][place % 2];
        let leg = LEGS[place / 2];
        assert_eq!(fault.part, format!("leg/{leg}/{drive}/command"));
        assert_eq!(harness.observe(), before);
        // The plant can continue with finite commands.
        harness.advance_to_ms(30);
        assert!(harness.observe().iter().all(|x| x.is_finite()));
    }
}

#[test]
fn rotating_hips_end_in_a_fault_or_stay_finite() {
    let robot = robot();
    let mut setup = setup();
    setup.drives = Drives::Ideal { period: 5e-3 };
    let mut harness = massless(&robot, &setup);
    for ms in 1..=300_u64 {
        for pair in harness.commands.chunks_mut(2) {
            pair[0] = 0.05 * ms as f64;
        }
        let outcome = harness.try_advance_to_us(1000 * ms);
        assert!(
            harness.observe().iter().all(|x| x.is_finite()),
            "at {ms} ms"
        );
        if outcome.is_err() {
            break;
        }
    }
}

#[test]
fn weak_and_stiff_springs_and_light_feet_close_the_energy_balance() {
    for (stiffness, foot) in [
        (1e-2, 1.0),
        (1e2, 1.0),
        (1e4, 1.0),
        (1.0, 1e-3),
        (1.0, 1e-6),
    ] {
        let mut robot = robot();
        for mount in &mut robot.legs {
            for spring in [&mut mount.leg.diagonal, &mut mount.leg.parallel] {
                // The same preload in newtons.
                spring.stiffness *= stiffness;
                spring.preload /= stiffness.max(1.0);
            }
            mount.leg.mass.lumped_foot *= foot;
        }
        let mut harness = massless(&robot, &setup());
        let completed = run(&mut harness, 0, 200);
        // Springs a hundred times too weak let the legs fold flat under the trunk, up to the limit
        // of the ankles; ten thousand times too stiff, they complete four cycles in a step of the
        // plant, and the energy balance still closes.
        assert!(completed, "stiffness × {stiffness}");
        let balance = harness.energy();
        assert!(
            balance.residual.abs() < 1e-3 * balance.exchanged + 1e-6,
            "stiffness × {stiffness}, foot × {foot}: {balance:?}"
        );
    }
}
