//! At the edges: a typed error or the right outcome, never a NaN, never a hang.

use twinrig_contact::{Ground, HeightField, Terrain};
use twinrig_kernel::SimDuration;
use twinrig_leg::LegCommand;
use twinrig_legged::{Base, Drives, LeggedError, Setup};
use twinrig_massless::{Force, Massless, MasslessError, Options};
use twinrig_robot::Robot;
use twinrig_runtime::Plant;

use crate::scene::{Scene, Trot, at, named_robot, robot, setup};

const LEGS: [&str; 4] = ["LF", "RF", "LH", "RH"];

fn ground(terrain: Terrain, friction: f64) -> Ground {
    Ground::new(terrain, friction, 0.0).unwrap()
}

/// A fall of `height` metres, all feet at once.
fn falling(height: f64, setup: &Setup) -> Setup {
    let terrain = Terrain::StepDown {
        at: -10.0,
        drop: height,
    };
    let friction = setup.ground.as_ref().map_or(0.6, |ground| ground.friction);
    Setup {
        ground: Some(ground(terrain, friction)),
        ..setup.clone()
    }
}

/// Advances or stops with a fault, but never with a number that is none.
fn run(scene: &mut Scene, from_ms: u64, to_ms: u64) -> bool {
    for ms in from_ms + 1..=to_ms {
        let before = scene.observe().to_vec();
        let outcome = scene.try_to(ms);
        assert!(scene.observe().iter().all(|x| x.is_finite()), "at {ms} ms");
        if let Err(fault) = outcome {
            assert_eq!(fault.time, at(ms - 1));
            assert_eq!(scene.observe(), before, "it stays where it last was");
            assert!(!fault.why.is_empty() && !fault.part.is_empty(), "{fault:?}");
            return false;
        }
    }
    true
}

#[test]
fn a_robot_starts_on_a_ground_that_is_higher_than_zero_and_not_in_it() {
    let heights = vec![0.05; 16];
    let plateau = HeightField::new([-1.0, -1.0], 1.0, 4, heights).unwrap();
    for base in [Base::Free, Base::Planar, Base::Fixed] {
        let setup = Setup {
            base,
            ground: Some(ground(Terrain::Heights(plateau.clone()), 0.6)),
            ..setup()
        };
        let mut scene = Scene::new(&robot(), &setup);
        let clearance = scene.value("leg/LF/foot/clearance");
        assert!(clearance.abs() < 1e-12, "{base:?}: {clearance}");
        // Pushed out of an overlap, it would gain energy from nowhere: an impact that gives.
        assert!(run(&mut scene, 0, 100));
        assert!(scene.plant.energy().impact > -1e-9);
        assert!(scene.plant.work().events >= 1, "feet touch down");
    }
}

#[test]
fn four_feet_that_land_at_one_instant_share_the_landing() {
    for (height, landing_ms) in [(0.05_f64, 100), (0.3, 247), (1.0, 451)] {
        let mut scene = Scene::new(&robot(), &falling(height, &setup()));
        let feet = LEGS.map(|leg| scene.read(&format!("leg/{leg}/foot/position")).to_vec());
        assert!(feet.iter().all(|foot| foot[2].abs() < 1e-12));
        for leg in LEGS {
            let clearance = scene.value(&format!("leg/{leg}/foot/clearance"));
            assert!((clearance - height).abs() < 1e-12, "{clearance}");
        }
        // Down to just before the landing, √(2 height / g).
        assert!(run(&mut scene, 0, landing_ms), "{height} m");
        let fallen = 0.5 * 9.81 * (landing_ms as f64 * 1e-3) * (landing_ms as f64 * 1e-3);
        let foot = scene.read("leg/LF/foot/position")[2];
        assert!((foot + fallen).abs() < 1e-9, "it fell {foot}, not {fallen}");
        scene.plant.begin_window();
        assert!(run(&mut scene, landing_ms, landing_ms + 3), "{height} m");
        let loads = LEGS.map(|leg| scene.value(&format!("leg/{leg}/foot/load")));
        assert!(loads[0] > 1.0);
        // Left and right share alike; fore and hind do, but for the knees that bend backwards.
        assert!((loads[0] - loads[1]).abs() < 1e-6 * loads[0], "{loads:?}");
        assert!((loads[2] - loads[3]).abs() < 1e-6 * loads[2], "{loads:?}");
        // And then it lies or stands, and the books close. From a metre a leg folds flat, which no stop of it prevents:
        // that is a fault.
        if !run(&mut scene, landing_ms + 3, landing_ms + 500) {
            assert_eq!(height, 1.0);
            continue;
        }
        let balance = scene.energy();
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

/// x of the mass centre of trunk (with what hangs at it) and feet.
fn centre_x(scene: &mut Scene) -> f64 {
    let feet = LEGS.map(|leg| scene.read(&format!("leg/{leg}/foot/position"))[0]);
    (0.98 * scene.read("body/position")[0] + 0.03 * feet.iter().sum::<f64>()) / 1.1
}

#[test]
fn ice_and_glue_are_grounds_too() {
    let robot = robot();
    for friction in [0.0, 10.0] {
        let mut setup = setup();
        setup.ground = Some(ground(Terrain::Flat, friction));
        setup.start = Trot::START.commands(&robot, &setup, 0.0).into();
        let mut scene = Scene::new(&robot, &setup);
        for ms in 1..=400 {
            scene.trot(&robot, &setup, Trot::START, ms);
            scene.observe().iter().for_each(|x| assert!(x.is_finite()));
            if friction == 0.0 {
                for leg in LEGS {
                    let force = scene.read(&format!("leg/{leg}/foot/force")).to_vec();
                    assert!(force[0].abs() < 1e-9 && force[1].abs() < 1e-9, "{force:?}");
                }
            }
        }
        let balance = scene.energy();
        assert!(
            balance.residual.abs() < 1e-5 * balance.exchanged,
            "{friction}: {balance:?}"
        );
        if friction == 0.0 {
            // Nothing outside pulls sideways: trunk and feet together stay where they are.
            let now = centre_x(&mut scene);
            let then = centre_x(&mut Scene::new(&robot, &setup));
            assert!((now - then).abs() < 1e-6, "{now} {then}");
        }
    }
}

/// Why the plant is not built.
#[track_caller]
fn refusal(robot: &Robot, setup: &Setup) -> MasslessError {
    let options = Options {
        setup: setup.clone(),
        force: Force::Solve,
    };
    match Massless::new(robot, &options, &|_| true) {
        Err(error) => error,
        Ok(_) => panic!("it was built: {:?}", setup.start),
    }
}

#[test]
fn a_start_out_of_reach_names_the_leg() {
    let mut setup = setup();
    let mut start = |hip, knee| {
        let command = LegCommand { hip, knee };
        setup.start = vec![("RH".to_owned(), command)].into();
        refusal(&robot(), &setup)
    };
    let error = start(0.0, 9.0);
    assert!(
        matches!(&error, MasslessError::Setup(LeggedError::Leg { leg, .. }) if leg == "RH"),
        "{error}"
    );
    // Within reach of the cable, but 7 mm beyond where the diagonal bottoms out.
    let error = start(0.0, 2.8);
    assert!(
        matches!(&error, MasslessError::Setup(LeggedError::StartBeyondStop { by, .. }) if *by > 1e-3),
        "{error}"
    );
    start(0.0, f64::NAN);
    start(f64::INFINITY, 0.0);
}

#[test]
fn what_cannot_be_built_is_refused_with_a_reason() {
    let refused = |change: &dyn Fn(&mut Robot, &mut Setup)| {
        let (mut robot, mut setup) = (robot(), setup());
        change(&mut robot, &mut setup);
        refusal(&robot, &setup)
    };
    let error = refused(&|_, o| o.legs.push("XX".to_owned()));
    assert!(
        matches!(error, MasslessError::Setup(LeggedError::NoSuchLeg { .. })),
        "{error}"
    );
    let error = refused(&|_, o| o.legs.push("LF".to_owned()));
    assert!(
        matches!(error, MasslessError::Setup(LeggedError::Legs(_))),
        "{error}"
    );
    let error = refused(&|_, o| o.step = SimDuration::ZERO);
    assert!(
        matches!(error, MasslessError::Setup(LeggedError::Step)),
        "{error}"
    );
    let error = refused(&|r, _| r.legs[1].leg.mass.lumped_foot = 0.0);
    assert!(
        matches!(error, MasslessError::Setup(LeggedError::Mass { .. })),
        "{error}"
    );
    let error = refused(&|r, _| r.trunk.mass = -3.0);
    assert!(
        matches!(error, MasslessError::Setup(LeggedError::Mass { .. })),
        "{error}"
    );
    let error = refused(&|r, _| r.legs[2].leg.l1 = 0.0);
    assert!(
        matches!(&error, MasslessError::Setup(LeggedError::Leg { leg, .. }) if leg == "LH"),
        "{error}"
    );
    let error = refused(&|_, o| o.drives = Drives::Ideal { period: 0.0 });
    assert!(
        matches!(error, MasslessError::Setup(LeggedError::Servo { .. })),
        "{error}"
    );
    for inertia in [
        [0.0, 1e-3, 1e-3],
        [1e-3, f64::NAN, 1e-3],
        [1e-3, 1e-3, -1e-3],
    ] {
        // With nothing hung out at the hips that would hide it.
        let error = refused(&|r, _| {
            r.trunk.inertia = inertia;
            for mount in &mut r.legs {
                mount.hip = [0.0; 3];
            }
        });
        assert!(error.to_string().contains("inertia"), "{error}");
    }
}

#[test]
fn a_step_of_ten_milliseconds_is_coarse_but_sound() {
    let robot = robot();
    let mut setup = Setup {
        step: SimDuration::from_millis(10),
        ..setup()
    };
    setup.start = Trot::START.commands(&robot, &setup, 0.0).into();
    let mut scene = Scene::new(&robot, &setup);
    for ms in (10..=1000).step_by(10) {
        scene.trot(&robot, &setup, Trot::START, ms);
        assert!(scene.observe().iter().all(|x| x.is_finite()));
    }
    let balance = scene.energy();
    assert!(
        balance.residual.abs() < 1e-3 * balance.exchanged,
        "{balance:?}"
    );
    let height = scene.read("body/position")[2];
    assert!((0.0..0.2).contains(&height), "{height}");
}

#[test]
fn a_trunk_without_legs_falls_and_one_with_one_leg_stumbles() {
    for base in [Base::Free, Base::Planar, Base::Fixed] {
        let none = Setup {
            base,
            legs: Vec::new(),
            ..setup()
        };
        let mut scene = Scene::new(&robot(), &none);
        let start = scene.read("body/position")[2];
        scene.to(100);
        let z = scene.read("body/position")[2];
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
        let mut scene = Scene::new(&robot(), &one);
        run(&mut scene, 0, 500);
    }
}

#[test]
fn oncilla_stands() {
    let robot = named_robot("oncilla");
    for force in [Force::Solve, Force::Lookup { cells: 32 }] {
        let mut scene = Scene::forced(&robot, &setup(), force);
        let height = scene.read("body/position")[2];
        scene.to(1000);
        let (position, rpy) = (
            scene.read("body/position").to_vec(),
            scene.read("body/rpy").to_vec(),
        );
        assert!((position[2] - height).abs() < 0.1 * height, "{position:?}");
        assert!(rpy.iter().all(|angle| angle.abs() < 0.05), "{rpy:?}");
    }
}

#[test]
fn a_cable_that_is_wound_beyond_all_reach_stalls_its_drive() {
    // The leg bottoms out, the drive pulls with all the torque it has, and nothing breaks. A drive without a limit pulls
    // without limit: that must end in a fault, or hold.
    let mut setup = Setup {
        base: Base::Fixed,
        ground: None,
        ..setup()
    };
    let mut scene = Scene::new(&robot(), &setup);
    for pair in scene.commands.chunks_mut(2) {
        pair[1] = 10.0;
    }
    assert!(run(&mut scene, 0, 500));
    for leg in LEGS {
        let torque = scene.value(&format!("leg/{leg}/knee/torque"));
        assert!((torque - 4.0).abs() < 1e-6, "{torque}");
        let length = {
            let foot = scene.read(&format!("leg/{leg}/foot/position")).to_vec();
            let body = scene.read("body/position").to_vec();
            body[2] - foot[2]
        };
        assert!(length > 0.05, "{length}");
    }
    // The drive's inertia rattles in the stop; on the mean the cable carries what the drive has.
    let mean: f64 = (501..=900)
        .map(|ms| {
            scene.to(ms);
            scene.value("leg/LF/cable/tension") / 400.0
        })
        .sum();
    assert!((mean - 4.0 / 0.025).abs() < 0.01 * mean, "{mean}");
    setup.drives = Drives::Ideal { period: 5e-3 };
    let mut scene = Scene::new(&robot(), &setup);
    for pair in scene.commands.chunks_mut(2) {
        pair[1] = 10.0;
    }
    run(&mut scene, 0, 1000);
}

#[test]
fn a_command_that_is_no_number_is_a_fault_and_leaves_the_plant_where_it_was() {
    for (place, bad) in [
        (0, f64::NAN),
        (3, f64::NAN),
        (1, f64::INFINITY),
        (2, f64::NEG_INFINITY),
    ] {
        let mut scene = Scene::new(&robot(), &setup());
        scene.to(10);
        let before = scene.observe().to_vec();
        let mut commands = scene.commands.clone();
        commands[place] = bad;
        let fault = scene.plant.advance(at(20), &commands).unwrap_err();
        assert_eq!(fault.time, at(10), "{fault}");
        let drive = ["hip", "knee"][place % 2];
        let leg = LEGS[place / 2];
        assert_eq!(fault.part, format!("leg/{leg}/{drive}/command"));
        assert_eq!(scene.observe(), before);
        // And it can go on with commands that are numbers.
        scene.to(30);
        assert!(scene.observe().iter().all(|x| x.is_finite()));
    }
}

#[test]
fn hips_that_are_whirled_round_and_round_end_in_a_fault_or_go_on() {
    let robot = robot();
    let mut setup = setup();
    setup.drives = Drives::Ideal { period: 5e-3 };
    let mut scene = Scene::new(&robot, &setup);
    for ms in 1..=300_u64 {
        for pair in scene.commands.chunks_mut(2) {
            pair[0] = 0.05 * ms as f64;
        }
        let outcome = scene.try_to(ms);
        assert!(scene.observe().iter().all(|x| x.is_finite()), "at {ms} ms");
        if outcome.is_err() {
            break;
        }
    }
}

#[test]
fn weak_and_stiff_springs_and_light_feet_run_or_say_why_not() {
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
                // As many newtons of preload as before.
                spring.stiffness *= stiffness;
                spring.preload /= stiffness.max(1.0);
            }
            mount.leg.mass.lumped_foot *= foot;
        }
        let mut scene = Scene::new(&robot, &setup());
        let through = run(&mut scene, 0, 200);
        // Springs a hundred times too weak let the legs fold flat under the trunk, as far as their ankles go; ten thousand
        // times too stiff, they swing four times in a step of the plant and the energy balance still closes.
        assert!(through, "stiffness × {stiffness}");
        let balance = scene.energy();
        assert!(
            balance.residual.abs() < 1e-3 * balance.exchanged + 1e-6,
            "stiffness × {stiffness}, foot × {foot}: {balance:?}"
        );
    }
}
